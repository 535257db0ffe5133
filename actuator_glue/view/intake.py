"""Messages of the suite, of a bag or a live system, into a history."""

from __future__ import annotations

import threading
from array import array
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import BagMessage, as_published, messages, summarise
from actuator_glue.io.bag_records import without_samples
from actuator_glue.io.bag_samples import topics_of_actuator
from actuator_glue.io.messages import deserialize, full_name
from actuator_glue.io.remarks import Note, refuse
from actuator_glue.motion import METRES
from actuator_glue.sample_block import Block, check_times, from_message
from actuator_glue.setups import known_stiffness
from actuator_glue.view.explanations import Explanation, diagnosed, explanations, number, said
from actuator_glue.view.history import History
from actuator_glue.view.logbook import REMEMBERED
from actuator_glue.view.timeline import Timeline
from actuator_glue.view.trends import TrendColumn

_DIAGNOSTICS = 'diagnostic_msgs/msg/DiagnosticArray'
# Types that are shown, and what takes them.
TYPES = {
    'TestSetup': 'setup',
    'SampleBlock': 'samples',
    'PosteriorMoments': 'posterior',
    'PredictionBand': 'band',
    'FrequencyResponseBand': 'response',
    'Diagnosis': 'diagnosis',
    'DiagnosticArray': 'health',
}
# Live: a quarter of an hour at 1 kHz, 30 MB. A bag: all of it, up to 2 GB.
LIVE_SAMPLES = 1 << 20
MOST_SAMPLES = 1 << 26
_WINDOWS = 20  # scored windows over which the coverage is told
_NODES = 64


class Intake:
    """Takes messages into a history; one thread writes while another reads.

    Args:
        history: where to.
        title: what is shown, for people.

    Attributes:
        lock: held while the history changes.
        live: whether there is more to come.
    """

    def __init__(self, history: History, title: str, *, live: bool) -> None:
        self.history = history
        self.title = title
        self.live = live
        self.lock = threading.Lock()
        self._coverage: deque[tuple[float, int]] = deque(maxlen=_WINDOWS)
        self._nodes: set[str] = set()
        self._explained = ''
        self._place: int | None = None

    def take(self, kind: str, message: Any, place: int | None = None) -> None:
        """Take a message.

        Args:
            kind: bare name of its type.
            message: the message.
            place: of its first sample, or at which it was received; None for what comes now.

        Raises:
            InputError: samples that have no place in time; nothing of them is taken.
        """
        with self.lock:
            self._place = place
            getattr(self, f'_take_{TYPES[kind]}')(message)

    @property
    def _at(self) -> int:
        """Place at which what is taken was known."""
        return self.history.measured_to if self._place is None else self._place

    def _tell(self, kind: str, content: dict[str, Any], of: str = '') -> None:
        self.history.add_event(kind, content, self._place, of=of)

    def _take_samples(self, message: Any) -> None:
        block = shown(message)
        if block is not None:
            rows = {'command': block.command, 'measured': block.measured}
            if block.force is not None:
                rows['force'] = block.force
            self.history.add_samples(block.index, block.period, rows, self._place)

    def _take_setup(self, setup: Any) -> None:
        content = {
            'actuator': setup.actuator or setup.header.frame_id,
            'stiffness': known_stiffness(setup.specimen_stiffness),
            'rate': number(setup.rate),
            'source': setup.source,
            'motion': setup.motion or METRES,
        }
        self._tell('setup', content)

    def _take_posterior(self, posterior: Any) -> None:
        columns = list(
            zip(
                posterior.parameter_names,
                posterior.units,
                posterior.mean,
                posterior.stddev,
                posterior.prior_dominated,
                strict=False,
            )
        )
        carried = explanations(posterior)
        content = {
            'window': int(posterior.window),
            'parameters': [said(n, u, m, s) | {'prior': bool(p)} for n, u, m, s, p in columns],
            'structures': [one.told() for one in carried],
            'rhat': number(posterior.rhat_max),
            'ess': number(posterior.ess_min),
            'converged': bool(posterior.converged),
            'nrmse': number(posterior.nrmse),
            'seconds': number(posterior.seconds),
            'doubts': list(getattr(posterior, 'doubts', ())),
        }
        self._tell('posterior', content)
        row = {TrendColumn('weight', one.name): one.weight for one in carried}
        for name, unit, mean, sd, prior in columns:
            row[TrendColumn('mean', name, unit)] = float(mean)
            row[TrendColumn('sd', name, unit)] = float(sd)
            row[TrendColumn('prior', name, unit)] = float(prior)
        self.history.trends.add(self._at, row)
        self._explain(carried)

    def _explain(self, carried: Sequence[Explanation]) -> None:
        """Put into the log that others are carried, or that another one is the likeliest."""
        others = ', '.join(sorted(one.name for one in carried))
        explained = f'{carried[0].name}; {others}'
        if explained != self._explained:
            shares = ', '.join(f'{one.name} {one.weight * 100:.0f} %' for one in carried)
            self.history.log.news(self._at, 'explanations', shares)
        self._explained = explained

    def _take_band(self, band: Any) -> None:
        if band.kind != 'total' or not len(band.levels):
            return
        count, levels = len(band.median), np.asarray(band.levels)
        widest = len(levels) - 1
        if len(band.lower) != count * len(levels) or len(band.upper) != len(band.lower):
            return
        part = slice(widest * count, (widest + 1) * count)
        rows = {'lower': band.lower[part], 'median': band.median, 'upper': band.upper[part]}
        self.history.add_band(int(band.index), rows, self._place, again=bool(band.scored))
        if not band.scored:
            return
        self._coverage.append((float(band.widest_coverage), count))
        shares, weights = zip(*self._coverage, strict=True)
        content = {
            'level': number(band.widest_level),
            'last': number(band.widest_coverage),
            'mean': number(np.average(shares, weights=weights)),
            'windows': len(self._coverage),
            'width': number(band.widest_width),
            'forecast': bool(band.forecast),
        }
        self._tell('coverage', content)

    def _take_response(self, response: Any) -> None:
        content = {
            'frequency': number(response.headline_frequency),
            'amplitude': number(response.headline_amplitude),
            'phase': number(response.headline_phase),
            'delay': number(response.headline_delay),
        }
        self._tell('response', content)

    def _take_diagnosis(self, found: Any) -> None:
        self._tell('diagnosis', diagnosed(found))
        why = f' ({found.reason})' if getattr(found, 'reason', '') else ''
        self.history.log.news(self._at, 'diagnosis', found.summary + why)

    def _take_health(self, array: Any) -> None:
        remembered = round(REMEMBERED / self.history.period) if self.history.period else 0
        for status in array.status[:_NODES]:
            if status.name in self._nodes or len(self._nodes) < _NODES:
                self._nodes.add(status.name)
                level = status.level
                worst = level[0] if isinstance(level, bytes) else int(level)
                values = {item.key: item.value for item in getattr(status, 'values', ())}
                self._tell('health', {'level': worst, 'message': status.message}, of=status.name)
                self.history.log.health(
                    self._at, remembered, status.name, worst, status.message, values
                )


def shown(message: Any) -> Block | None:
    """Return the block of a SampleBlock, NaN and all: a fault is what somebody looks for.

    None where it holds no samples, or channels of different lengths.

    Raises:
        InputError: nobody can say when its samples were: an absurd period or running index.
    """
    block = from_message(message)
    if not len(block.measured) == len(block) > 0:
        return None
    check_times(block)
    return block


def read_bag(path: Path | str, namespace: str | None = None, *, note: Note = refuse) -> Intake:
    """Return what a bag holds of one actuator.

    Args:
        path: bag folder or lone .mcap.
        namespace: whose topics, where a bag has several actuators.
        note: called with one line per damage and message that cannot be shown; the default
            raises it.

    Raises:
        InputError: no bag, no samples, several actuators and no namespace, more samples than are
            kept.
    """
    names = {_DIAGNOSTICS if n == 'DiagnosticArray' else full_name(n): n for n in TYPES}
    topics = {'/diagnostics', *topics_of_actuator(path, summarise(path), namespace)}
    timeline, places = _timeline(
        as_published(messages(path, types={full_name('SampleBlock')}, topics=topics, note=note))
    )
    if not timeline.samples:
        raise InputError(
            f'{without_samples(path)}, and `actuator-glue convert {path} OUT --channels MAP.yaml` '
            'makes a bag that is shown'
        )
    if not 0 < timeline.capacity <= MOST_SAMPLES:
        raise InputError(
            f'{path}: {timeline.samples} samples; a page shows 1 to {MOST_SAMPLES} with the '
            'pauses between them'
        )
    if timeline.passed:
        note(
            f'{path}: the sample rate changes to {1.0 / timeline.period:.6g} Hz; the '
            f'{timeline.passed} samples before that are not shown'
        )
    intake = Intake(History(timeline.capacity, events=None), str(path), live=False)
    for found in as_published(messages(path, types=names, topics=topics, note=lambda _: None)):
        kind = names[found.type]
        try:
            content = deserialize(found.type, found.data, found.definition)
            samples = kind == 'SampleBlock' and shown(content) is not None
            place = next(places) if samples else timeline.place(found.log_time)
            intake.take(kind, content, place)
        except InputError as error:
            note(f'{path}: topic {found.topic}: {error}; not shown')
    return intake


def _timeline(found: Iterable[BagMessage]) -> tuple[Timeline, Iterator[int]]:
    """Return when a bag's blocks were there, and the places of their first samples in turn."""
    timeline, places = Timeline(), array('q')
    for message in found:
        # What cannot be decoded is told of where it is to be shown.
        with suppress(InputError):
            block = shown(deserialize(message.type, message.data, message.definition))
            if block is not None:
                at = timeline.add(block.index, len(block), block.period, message.log_time)
                places.append(at)
    return timeline, iter(places)
