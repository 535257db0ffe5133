"""What lab_bridge listens to: a live stream of a laboratory's controller."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.nodes.blocks import BlockPublisher
from actuator_glue.nodes.health import ERROR
from actuator_glue.nodes.pacer import Step
from actuator_glue.nodes.streamer import Streamer
from actuator_glue.records import MAX_DISPLACEMENT, check_motion
from actuator_glue.streams.address import Allowed
from actuator_glue.streams.layout import PLAIN
from actuator_glue.streams.layout_file import read_layout
from actuator_glue.streams.reception import Reception, Samples
from actuator_glue.streams.seal import read_key
from actuator_glue.streams.transports import Terms, source

_CHECK = 'check byte_order, type and unit of each value in the layout'
# What a count says, for people; each is shown on /diagnostics the moment it grows.
FAULTS = {
    'lost': 'samples were lost and are a gap',
    'duplicates': 'samples came twice and were left out',
    'reordered': 'samples came out of order and were put right',
    'late': 'samples came too late and were left out',
    'implausible': 'samples have a number far off the stream and were left out',
    'restarts': 'times the sender began to count anew',
    'interruptions': 'times the connection broke: a gap as long as the silence',
    'malformed': 'messages do not fit the layout and were left out',
    'untimed': 'samples have a time that is no number and were stamped by their counter',
    'clock set': "times the sender's clock was set while its counter went on",
    'coarse': 'samples have a float32 counter or time too large to count on, and were left out',
    'not authentic': 'messages have no valid signature and were left out',
    'senders refused': 'messages came from senders that are not allowed',
    'second sender': 'messages came from a second sender while the first still sends',
    'overruns': 'samples were dropped because this node was too slow',
    'not finite': 'samples hold NaN or infinity',
    'out of range': f'samples hold a displacement beyond {MAX_DISPLACEMENT:g} m: {_CHECK}',
    'socket errors': 'errors of the socket',
    'site unreachable': "times the site behind the shadow didn't answer",
}
# Numbers below this are none of a test; they come of bytes in another order or of another type.
# A simulated actuator at rest comes to them in the end, but never begins with them [m].
_LEAST = 1e-30
_JUDGED = 3.0  # seconds of samples that are not zero
# A counter that leaves the same gap before more of so many messages counts no samples [1].
_MANY, _FEW = 0.5, 50
# Silence of this length is reported [s].
SILENT = 1.0
# Time that messages may take to become samples: those wait for any that may come before them [s].
_PREPARED = 0.5
# Longest pause between two looks at the socket [s].
LOOK = 0.02


class LiveSource:
    """A stream that arrives; listens from configuration on, publishes while active.

    Args:
        node: who publishes.
        values: its parameters.
        out: where samples go.

    Raises:
        InputError: address, layout, key or rate cannot be used, or the port is taken.
    """

    def __init__(self, node: Streamer, values: Mapping[str, Any], out: BlockPublisher) -> None:
        if values['file']:
            raise InputError('parameters file and source are both given; keep one')
        self._node, self._out = node, out
        transport, self._address = source(values['source'])
        layout = read_layout(values['layout']) if values['layout'] else PLAIN
        rate = values['rate'] or layout.rate
        if rate is None:
            raise InputError(
                f'{self._address}: the sample rate is not known; give it in the layout '
                '(rate: 1000) or as parameter rate'
            )
        seal = read_key(values['key_file']) if values['key_file'] else None
        self._fresh = partial(
            Reception, layout, rate, in_order=transport.in_order, signed=seal is not None
        )
        self._reception = self._fresh()
        self._warnings = self._reception.warnings(layout.modulus)
        given = values['specimen_stiffness']
        self._stiffness = layout.stiffness if given < 0.0 else given
        self._hold = layout.hold or 'zoh' if values['hold'] == 'file' else values['hold']
        self._motion = check_motion(layout.motion, self._stiffness, str(self._address))
        self._actuator = values['actuator'] or layout.actuator
        self._period = 1.0 / rate
        self._pause = min(0.5 * values['block'] * self._period, LOOK)
        terms = Terms(
            layout,
            rate,
            lambda: int(node.get_clock().now().nanoseconds),
            Allowed([entry for entry in values['allow'] if entry]),
            seal,
        )
        self._listener = transport.listen(self._address, terms)
        self._told: Counter[str] = Counter()
        self._finite: Counter[str] = Counter()
        self._heard = self._nonzero = 0
        self._largest = 0.0
        self._alike = self._gap = self._next = self._before = 0

    def described(self) -> list[str]:
        """Return what is listened to."""
        known = 'not known' if self._stiffness is None else f'{self._stiffness:g} N/m'
        return [
            f'listening to {self._address}: {1.0 / self._period:g} Hz, order by '
            f'{self._reception.order}, specimen stiffness {known}',
            *self._warnings,
        ]

    def steps(self) -> Iterator[Step]:
        """Yield what has arrived, for ever."""
        self._reception = self._fresh()
        self._nonzero, self._largest = 0, 0.0
        self._alike = self._gap = self._next = 0
        self._before = self._messages()
        self._announce()
        # Before it is said that the stream begins: a program that waits for that sends at once.
        self._node.introduce(self._drain)
        last, unused_since = time.monotonic(), math.inf
        while True:
            batches = self._listener.receive(0.1)
            now = time.monotonic()
            found = [s for rows in batches for s in self._reception.push(rows, now)]
            found += self._reception.waited(now, self._node.get_clock().now().nanoseconds)
            if found:
                last, self._heard, unused_since = now, self._messages(), math.inf
            elif self._messages() != self._heard:
                unused_since = min(unused_since, now)
            fresh = now - _PREPARED < unused_since < math.inf
            if now - last > SILENT and not fresh:
                last, unused_since = now, math.inf  # to be told once a second
                self._tell_silence()
            self._tell()
            yield Step(0.0, partial(self._publish, found))
            if batches:
                time.sleep(self._pause)

    def _messages(self) -> int:
        """Return how many have come, whether or not they fit the layout; no connections."""
        return self._listener.counts['messages'] + self._listener.counts['malformed']

    def _tell_silence(self) -> None:
        """Tell that no sample comes; whether that is for want of messages is no guess."""
        before, self._heard = self._heard, self._messages()
        if self._heard == before:
            self._node.complain('silence', f'nothing arrives from {self._address}')
        else:
            self._node.complain(
                'no sample',
                f'messages arrive from {self._address}, and all are left out; check the layout',
            )

    def _drain(self) -> None:
        """Let go of samples that came while nobody was ready: they belong to the time before."""
        began = time.monotonic()
        while self._listener.receive(0.0) and time.monotonic() - began < SILENT:
            pass

    def report(self) -> dict[str, Any]:
        """Return counts, offset and skew of the sender's clock; tell of a wrong rate."""
        clock = self._reception.clock
        self._tell_rate()
        if self._nonzero > _JUDGED / self._period and self._largest < _LEAST:
            self._node.complain(
                'out of range', f'no displacement reaches {_LEAST:g} m: {_CHECK}', ERROR
            )
        messages = self._messages() - self._before
        counted = self._reception.order == 'counter' and messages > _FEW
        if counted and self._alike > _MANY * messages:
            self._node.complain(
                'counter',
                'most messages have the same gap before them: the counter counts something else '
                'than the layout says (counts: packets or samples), or is that of a faster loop; '
                'give it another name there, so that it is stepped over',
                ERROR,
            )
        return {
            'source': str(self._address),
            'order by': self._reception.order,
            'sample rate (Hz)': 1.0 / self._period,
            **{name: self._told[name] for name in ('messages', 'connections', *FAULTS)},
            'clock offset to sender (s)': clock.offset,
            'clock skew to sender (ppm)': 1e6 * clock.skew,
            'spread of shortest delays (s)': clock.spread,
            'clock steps': clock.steps,
        }

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()

    def clock_jumped(self) -> None:
        """Do nothing: arrivals show the jump to the map of the sender's clock."""

    def _announce(self) -> None:
        now = self._node.get_clock().now().nanoseconds
        self._out.begin(self._actuator, self._period, now)
        self._out.setup(self._stiffness, self._hold, 0, str(self._address), self._motion)

    def _publish(self, found: list[Samples]) -> None:
        for samples in found:
            gap = samples.index - self._next
            self._alike += 0 < gap == self._gap
            self._gap = gap or self._gap
            self._next = samples.index + len(samples.command)
            if samples.began and self._reception.counts['restarts']:
                self._announce()
            self._out.begin(self._actuator, self._period, samples.stamp_ns, samples.index)
            self._out.samples(samples.index, samples.command, samples.measured, samples.force)
            self._node.samples.add(len(samples.command))
            bad = ~(np.isfinite(samples.command) & np.isfinite(samples.measured))
            self._finite['not finite'] += int(bad.sum())
            most = np.fmax(np.abs(samples.command), np.abs(samples.measured))
            self._finite['out of range'] += int(((most > MAX_DISPLACEMENT) & ~bad).sum())
            self._nonzero += int((most > 0.0).sum())
            self._largest = max(self._largest, float(np.fmax(most, 0.0).max()))

    def _tell(self) -> None:
        """Show what has gone wrong since the last look; counts are read by another thread."""
        counts = self._listener.counts + self._reception.counts + self._finite
        for name, meaning in FAULTS.items():
            if counts[name] > self._told[name]:
                hint = self._listener.hint if name == 'malformed' else ''
                what = f'{counts[name] - self._told[name]} {meaning}'
                self._node.complain(name, f'{what} ({hint})' if hint else what)
        self._told = counts
        self._tell_rate()

    def _tell_rate(self) -> None:
        if fault := self._reception.rate_fault:
            # Always in the same words: what lasts is logged once.
            self._node.complain(
                'sample rate', f'{fault}; give the true one as rate or in the layout', ERROR
            )
