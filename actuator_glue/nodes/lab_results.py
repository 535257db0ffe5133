"""What the estimator finds, sent back to the laboratory's controller."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from actuator_glue.nodes import topics
from actuator_glue.nodes.base import SuiteNode
from actuator_glue.sample_block import stamp_ns
from actuator_glue.streams.address import Allowed
from actuator_glue.streams.results import FIELDS, connect
from actuator_glue.streams.seal import read_key

# What a margin node adds.
_RISK = ('p_unstable', 'p_unstable_upper')


class ResultsOut:
    """Collects what belongs to a window and sends it when its frequency response is there.

    Where a margin node runs, the window is sent again as soon as P(unstable) is known: what a
    controller acts on comes neither late nor from another window.

    Args:
        node: subscribes.
        values: its parameters.

    Raises:
        InputError: the address or the key cannot be used.
    """

    def __init__(self, node: SuiteNode, values: Mapping[str, Any]) -> None:
        self._node = node
        seal = read_key(values['key_file']) if values['key_file'] else None
        allowed = Allowed([entry for entry in values['allow'] if entry])
        self._sender = connect(values['results'], seal, allowed)
        self._values: dict[str, float] = {}
        self._sent = self._unheard = 0

    def listen(self) -> None:
        """Subscribe until deactivation."""
        self._values.clear()
        self._node.subscribe(topics.POSTERIOR, self._posterior)
        self._node.subscribe(topics.BAND, self._band)
        self._node.subscribe(topics.RESPONSE, self._response)
        self._node.subscribe(topics.MARGIN, self._margin)

    def report(self) -> dict[str, Any]:
        """Return how many results have left."""
        return {'results sent': self._sent, 'results that nobody takes': self._unheard}

    def close(self) -> None:
        """Let go of the socket."""
        self._sender.close()

    def _posterior(self, message: Any) -> None:
        self._values = {
            'coverage': self._values.get('coverage', float('nan')),
            'window': float(message.window),
            'time': 1e-9 * stamp_ns(message.header),
            **{
                name: float(getattr(message, name))
                for name in FIELDS
                if name.endswith(('_mean', '_stddev', '_max'))
            },
        }

    def _band(self, message: Any) -> None:
        if message.scored and message.kind == message.TOTAL:
            self._values['coverage'] = float(message.widest_coverage)

    def _response(self, message: Any) -> None:
        if message.window != self._values.get('window'):
            return
        self._values |= {
            'delay': float(message.headline_delay),
            'amplitude': float(message.headline_amplitude),
            'phase': float(message.headline_phase),
            'frequency': float(message.headline_frequency),
        }
        self._send()

    def _margin(self, message: Any) -> None:
        if message.window != self._values.get('window'):
            return
        self._values |= {name: float(getattr(message, name)) for name in _RISK}
        if 'delay' in self._values:
            self._send()

    def _send(self) -> None:
        if self._sender.send(self._values):
            self._sent += 1
        else:
            self._unheard += 1
