"""Messages of the suite, of a bag or a live system, into a history."""

from __future__ import annotations

import math
import threading
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import (
    Note,
    as_published,
    decoded,
    messages,
    refuse,
    summarise,
)
from actuator_glue.io.bag_samples import topics_of_actuator
from actuator_glue.io.messages import deserialize, full_name
from actuator_glue.sample_block import from_message
from actuator_glue.view.history import History

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
# Live: a quarter of an hour at 1 kHz, 20 MB. A bag: all of it, up to 1.3 GB.
LIVE_SAMPLES = 1 << 20
MOST_SAMPLES = 1 << 26
_LONGEST_GAP = 1 << 22  # samples that a bag lacks and the page leaves empty, an hour at 1 kHz
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
        self._health: dict[str, dict[str, str]] = {}

    def take(self, kind: str, message: Any) -> None:
        """Take a message; `kind` is the bare name of its type."""
        with self.lock:
            getattr(self, f'_take_{TYPES[kind]}')(message)

    def _take_samples(self, message: Any) -> None:
        block = from_message(message)
        # Shown as it came, NaN and all: a fault is what somebody looks for.
        if len(block.measured) == len(block) > 0 and block.period > 0.0:
            rows = {'command': block.command, 'measured': block.measured}
            self.history.add_samples(block.index, block.period, rows)

    def _take_setup(self, setup: Any) -> None:
        content = {
            'actuator': setup.actuator or setup.header.frame_id,
            'stiffness': _number(setup.specimen_stiffness),
            'rate': _number(setup.rate),
            'source': setup.source,
        }
        self.history.add_event('setup', content)

    def _take_posterior(self, posterior: Any) -> None:
        columns = zip(
            posterior.parameter_names, posterior.units, posterior.mean, posterior.stddev,
            posterior.prior_dominated, strict=False,
        )  # fmt: skip
        rows = [
            {'name': n, 'unit': u, 'mean': _number(m), 'sd': _number(s), 'prior': bool(p)}
            for n, u, m, s, p in columns
        ]
        content = {
            'window': int(posterior.window),
            'parameters': rows,
            'effects': list(posterior.effects),
            'rhat': _number(posterior.rhat_max),
            'ess': _number(posterior.ess_min),
            'converged': bool(posterior.converged),
            'nrmse': _number(posterior.nrmse),
            'seconds': _number(posterior.seconds),
        }
        self.history.add_event('posterior', content)

    def _take_band(self, band: Any) -> None:
        if band.kind != 'total' or not len(band.levels):
            return
        count, levels = len(band.median), np.asarray(band.levels)
        widest = len(levels) - 1
        if len(band.lower) != count * len(levels) or len(band.upper) != len(band.lower):
            return
        part = slice(widest * count, (widest + 1) * count)
        rows = {'lower': band.lower[part], 'median': band.median, 'upper': band.upper[part]}
        self.history.add_band(int(band.index), rows)
        if not band.scored:
            return
        self._coverage.append((float(band.widest_coverage), count))
        shares, weights = zip(*self._coverage, strict=True)
        content = {
            'level': _number(band.widest_level),
            'last': _number(band.widest_coverage),
            'mean': _number(np.average(shares, weights=weights)),
            'windows': len(self._coverage),
            'width': _number(band.widest_width),
            'forecast': bool(band.forecast),
        }
        self.history.add_event('coverage', content)

    def _take_response(self, response: Any) -> None:
        content = {
            'frequency': _number(response.headline_frequency),
            'amplitude': _number(response.headline_amplitude),
            'phase': _number(response.headline_phase),
            'delay': _number(response.headline_delay),
        }
        self.history.add_event('response', content)

    def _take_diagnosis(self, found: Any) -> None:
        content = {
            'verdict': found.verdict,
            'summary': found.summary,
            'effects': [effect.name for effect in found.effects],
            'advice': list(found.advice),
        }
        self.history.add_event('diagnosis', content)

    def _take_health(self, array: Any) -> None:
        for status in array.status[:_NODES]:
            if status.name in self._health or len(self._health) < _NODES:
                level = status.level
                number = level[0] if isinstance(level, bytes) else int(level)
                self._health[status.name] = {'level': str(number), 'message': status.message}
        self.history.add_event('health', {name: dict(v) for name, v in self._health.items()})


def _number(value: Any) -> float | None:
    """Return what JSON can hold."""
    return float(value) if math.isfinite(value) else None


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
    samples = following = 0
    streams = 0  # places that gaps and new streams take
    kinds = {full_name('SampleBlock')}
    for block in decoded(path, kinds, topics=topics, note=note):
        samples += len(block[1].measured)
        missing = block[1].index - following
        streams += missing if 0 < missing < _LONGEST_GAP else missing != 0
        following = block[1].index + len(block[1].measured)
    if not 0 < samples + streams <= MOST_SAMPLES:
        raise InputError(f'{path}: {samples} samples; a page shows 1 to {MOST_SAMPLES}')
    intake = Intake(History(samples + streams), str(path), live=False)
    for found in as_published(messages(path, types=names, topics=topics, note=lambda _: None)):
        try:
            intake.take(names[found.type], deserialize(found.type, found.data))
        except InputError as error:
            note(f'{path}: topic {found.topic}: {error}; not shown')
    return intake
