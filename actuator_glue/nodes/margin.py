"""The stability of the hybrid test that an actuator is in, after every window of the estimator."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hybrid.watch import MarginWatch, Watched
from actuator_glue.io.partition import read_partition
from actuator_glue.model.parameters import NAMES
from actuator_glue.nodes import base, spin, topics
from actuator_glue.nodes.beside import Beside
from actuator_glue.nodes.messages import publish
from actuator_glue.nodes.parameters import Spec
from actuator_glue.nodes.silence import Silence
from actuator_glue.online.conversion import Head
from actuator_glue.sample_block import stamp_ns

SPECS = (
    Spec(
        'partition',
        '',
        'the hybrid test: YAML file or a shipped one, benchmark_case_1 ... 4, sdof',
        read_only=True,
    ),
    Spec(
        'compensator',
        [1.0, 0.0, 0.0],
        'factors of target, its rate [s] and its acceleration [s^2] in the command',
        read_only=True,
    ),
    Spec(
        'frequencies',
        [1.0, 5.0, 10.0],
        'where delay and amplitude of the actuator are told [Hz]',
        read_only=True,
    ),
    Spec('warn_above', 0.05, 'P(unstable) from which the node warns', '1', 0.0, 1.0, True),
    Spec('clear_below', 0.02, 'P(unstable) below which it warns no more', '1', 0.0, 1.0, True),
    Spec('seed', 1, 'seed of the specimens of a partition that spreads them', '', 0, 2**31, True),
)


def _watch(values: Mapping[str, Any]) -> MarginWatch:
    return MarginWatch(
        read_partition(values['partition']),
        values['compensator'],
        values['frequencies'],
        warn_above=values['warn_above'],
        clear_below=values['clear_below'],
        seed=values['seed'],
    )


class MarginNode(base.SuiteNode):
    """Takes the estimator's draws, publishes StabilityMargin, warns on /diagnostics."""

    def __init__(self) -> None:
        super().__init__('margin', SPECS)

    def check(self, values: Mapping[str, Any]) -> None:
        """Refuse parameters from which no watch can be made."""
        if values['partition']:
            _watch(values)

    def do_configure(self) -> None:
        """Read the partition."""
        if not self.parameters['partition']:
            raise InputError(
                'no hybrid test is given: partition:=FILE, or a shipped one such as sdof'
            )
        self._out = self.publisher(topics.MARGIN)

    def do_activate(self) -> None:
        """Wait for posteriors."""
        self.watch = _watch(self.parameters.values())
        self.windows = 0
        self.last: Watched | None = None
        self._doubts: list[str] = []
        self._silence = Silence(time.monotonic())
        compiling = Beside(self, self._compile)

        def look() -> None:
            if compiling.done:
                timer.cancel()
                self._silence.heard(time.monotonic())
                self.subscribe(topics.POSTERIOR, self._posterior)
                self.subscribe(topics.DRAWS, self._take)

        timer = self.every(0.1, look)

    def _compile(self) -> None:
        """Take made-up draws once, to compile: that takes seconds, cold a minute."""
        draws = np.array([134.0, 1.1e9, 2.5e5, 0.5]) * np.linspace(0.98, 1.02, 64)[:, np.newaxis]
        _watch(self.parameters.values()).take(draws, list(NAMES), [], 64.0)

    def do_report(self) -> None:
        """P(unstable), margin, and the warning for as long as it holds."""
        if not hasattr(self, 'watch'):
            return
        self.health.values |= {'partition': self.watch.partition.name, 'windows': self.windows}
        self._silence.tell(self, topics.DRAWS.name, time.monotonic())
        if self.last is None:
            return
        p = self.last.p_unstable
        self.health.values |= {
            'P(unstable)': p.value,
            'P(unstable), upper limit': p.upper,
            'delay margin (s)': float(self.last.margin[1]),
            'computing (s)': self._seconds,
        }
        if self._doubts:
            self.complain(
                'doubt',
                'P(unstable) and margin rest on a posterior that is doubted: '
                f'{", ".join(self._doubts)}; /diagnostics of the estimator says why',
            )
        if self.last.warning:
            self.complain(
                'stability',
                f'P(unstable) = {p.value:.3g} ({p.lower:.3g} to {p.upper:.3g}) in '
                f'{self.watch.partition.name}: more delay compensation, or end the test',
            )

    def _posterior(self, message: Any) -> None:
        self._doubts = list(getattr(message, 'doubts', ()))

    def _take(self, message: Any) -> None:
        started = time.monotonic()
        self._silence.heard(started)
        names, effects = list(message.parameter_names), list(message.effects)
        values = np.asarray(message.values, dtype=np.float64)
        if not names or values.size < 2 * len(names) or values.size % len(names):
            raise InputError(f'{values.size} values are no draws of {len(names)} parameters')
        draws = values.reshape(-1, len(names))
        found = self.watch.take(draws, names, effects, message.ess_min)
        self.windows += 1
        self.last, self._seconds = found, time.monotonic() - started
        head = Head(stamp_ns(message.header), message.header.frame_id)
        publish(self._out, head, self._fields(found, int(message.window)))

    def _fields(self, found: Watched, window: int) -> dict[str, Any]:
        share, given = found.p_unstable, self.parameters.values()
        fields = {
            'window': window,
            'partition': self.watch.partition.name,
            'compensator': np.array(given['compensator']),
            'draws': found.draws,
            'p_unstable': share.value,
            'p_unstable_lower': share.lower,
            'p_unstable_upper': share.upper,
            'level': given['warn_above'],
            'warning': found.warning,
            'most_sensitive': found.most_sensitive,
            'left_out': list(found.left_out),
            'frequency': np.array(given['frequencies']),
        }
        for name in ('margin', 'growth', 'delay', 'amplitude', 'bandwidth'):
            for limit, value in zip(
                ('lower', 'median', 'upper'), getattr(found, name), strict=True
            ):
                fields[f'{name}_{limit}'] = value if value.ndim else float(value)
        return fields


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return spin.main(MarginNode, args)


if __name__ == '__main__':
    sys.exit(main())
