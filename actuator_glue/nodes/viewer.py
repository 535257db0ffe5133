"""What the nodes publish now, on a page of the browser of this computer."""

from __future__ import annotations

import sys
from functools import partial

from actuator_glue.nodes import base, spin, topics
from actuator_glue.nodes.health import Rate
from actuator_glue.nodes.parameters import Spec
from actuator_glue.view.history import History
from actuator_glue.view.intake import LIVE_SAMPLES, TYPES, Intake
from actuator_glue.view.server import PORT, PageServer

SPECS = (
    Spec('port', PORT, 'port of 127.0.0.1, 0 for any that is free', '', 0, 65535, True),
    Spec('open', False, 'open the page in the browser', read_only=True),
)


class ViewerNode(base.SuiteNode):
    """Subscribes to everything that is shown; the page's server has a thread of its own."""

    def __init__(self) -> None:
        self.server: PageServer | None = None
        super().__init__('viewer', SPECS)

    def do_activate(self) -> None:
        """Open the page's server and subscribe."""
        self.intake = Intake(History(LIVE_SAMPLES), 'live', live=True)
        self.received = Rate()
        self.server = PageServer(self.intake, self.parameters['port'])
        self.get_logger().info(f'page at {self.server.url}')
        for topic in topics.RECORDED:
            kind = topic.type.__name__
            if kind in TYPES:
                self.subscribe(topic, partial(self._take, kind))
        if self.parameters['open']:
            import webbrowser

            webbrowser.open(self.server.url)

    def do_deactivate(self) -> None:
        """Close the page's server."""
        if self.server is not None:
            self.server.close()
            self.server = None

    def do_report(self) -> None:
        """Where the page is, and how much it gets."""
        if self.server is not None:
            self.health.values.update({'page': self.server.url, 'messages': self.received.count})

    def _take(self, kind: str, message: object) -> None:
        self.received.add()
        self.intake.take(kind, message)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return spin.main(ViewerNode, args)


if __name__ == '__main__':
    sys.exit(main())
