"""A laboratory's data as the suite's topics: a file played, or a live stream listened to."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from typing import Any

from actuator_glue.errors import InputError
from actuator_glue.nodes import spin, streamer
from actuator_glue.nodes.blocks import BlockPublisher
from actuator_glue.nodes.lab_file import FileSource
from actuator_glue.nodes.lab_live import LiveSource
from actuator_glue.nodes.lab_results import ResultsOut
from actuator_glue.nodes.pacer import Step
from actuator_glue.nodes.parameters import Spec

SPECS = (
    Spec('file', '', 'laboratory file or bag', read_only=True),
    Spec('channels', '', 'channel map of the file (YAML)', read_only=True),
    Spec(
        'source',
        '',
        'live stream in place of a file: udp://HOST:PORT, tcp://HOST:PORT, lsl:NAME '
        'or openfresco://HOST:PORT',
        read_only=True,
    ),
    Spec('layout', '', 'layout of the source (YAML), empty for that of `send`', read_only=True),
    Spec(
        'rate', 0.0, 'sample rate of the source, 0 for what the layout says', 'Hz', 0.0, 1e5, True
    ),
    Spec(
        'allow',
        [''],
        'IP addresses and networks that may send; none for this machine alone',
        read_only=True,
    ),
    Spec('key_file', '', 'file with the key of signed messages (HMAC-SHA256)', read_only=True),
    Spec(
        'results',
        '',
        'where results go back to: udp://HOST:PORT or lsl:NAME, empty for nowhere',
        read_only=True,
    ),
    Spec(
        'specimen_stiffness',
        -1.0,
        'specimen stiffness k, -1 for what file or layout says',
        'N/m',
        -1.0,
        1e12,
        True,
    ),
    Spec(
        'hold',
        'file',
        'how the command runs between its samples; file: as file or layout says',
        read_only=True,
        choices=('file', 'zoh', 'linear'),
    ),
    Spec(
        'actuator', '', 'name of the actuator, empty for what file or layout says', read_only=True
    ),
    Spec('block', 10, 'samples per message, of a source about', '1', 1, 100_000, True),
    Spec(
        'preview',
        0.0,
        'how far ahead commands of a file are published, 0 for not',
        's',
        0.0,
        60.0,
        True,
    ),
    *streamer.specs(exit_at_end=True),
)


# Parameters that say something of files only, or of sources only.
_OF_FILES, _OF_SOURCES = ('channels', 'speed', 'preview'), ('layout', 'rate')


class LabBridgeNode(streamer.Streamer):
    """Publishes the samples of a file at their own rate, or of a live source as they come."""

    def __init__(self) -> None:
        self._source: FileSource | LiveSource | None = None
        self._results: ResultsOut | None = None
        super().__init__('lab_bridge', SPECS)

    def check(self, values: Mapping[str, Any]) -> None:
        """A stiffness is -1 or not negative."""
        if -1.0 < values['specimen_stiffness'] < 0.0:
            raise InputError(
                f'specimen_stiffness {values["specimen_stiffness"]:g} N/m is negative; give it in '
                'N/m, or -1 for what file or layout says'
            )

    @property
    def speed(self) -> float:
        """A live source keeps its own time."""
        return 0.0 if isinstance(self._source, LiveSource) else super().speed

    def do_configure(self) -> None:
        """Read the file or begin to listen: what is wrong is said before a test begins."""
        values = self.parameters.values()
        out = BlockPublisher(self.publisher)
        kind = LiveSource if values['source'] else FileSource
        self.at_cleanup(self._close)
        if values['results']:
            self._results = ResultsOut(self, values)
        self._source = kind(self, values, out)
        for line in self._source.described():
            self.get_logger().info(line)
        self._tell_idle(values)

    def _tell_idle(self, values: Mapping[str, Any]) -> None:
        """Warn of what was given and does nothing: nobody would look for it."""
        live = bool(values['source'])
        kind, other, idle = (
            ('source', 'file', _OF_FILES) if live else ('file', 'source', _OF_SOURCES)
        )
        for spec in SPECS:
            if spec.name in idle and values[spec.name] != spec.default:
                self.get_logger().warning(
                    f'{spec.name} = {values[spec.name]!r} says something of a {other}, and a '
                    f'{kind} is given: it does nothing'
                )

    def do_activate(self) -> None:
        """Begin the stream, and listen for results."""
        if self._results is not None:
            self._results.listen()
        super().do_activate()

    def _close(self) -> None:
        for opened in (self._source, self._results):
            if opened is not None:
                opened.close()
        self._source = self._results = None

    def clock_jumped(self) -> None:
        """Stamps go on from the new time."""
        if self._source is not None:
            self._source.clock_jumped()

    def stream(self) -> Iterator[Step]:
        """Yield what file or source gives."""
        assert self._source is not None
        return self._source.steps()

    def do_report(self) -> None:
        """What every stream reports, and what is known of the source."""
        super().do_report()
        for opened in (self._source, self._results):
            if opened is not None:
                self.health.values.update(opened.report())


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return spin.main(LabBridgeNode, args)


if __name__ == '__main__':
    sys.exit(main())
