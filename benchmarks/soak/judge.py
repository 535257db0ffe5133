"""What a soak left in its bag: which faults were told, when the bands were back, what was lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.io.bag_reader import messages
from actuator_glue.io.messages import deserialize

# A band counts as good from here on; it is one of 95 %.
GOOD = 0.85
# A fault is told within this time [s]; a clock set back takes two stretches of a second.
TOLD_SECONDS = 15.0
WINDOW = 5.0  # s
HOLE = 2.5  # s, bands come every second


@dataclass(slots=True)
class Fault:
    """One fault.

    Attributes:
        kind: which.
        time: when it began, wall clock [s].
        seconds: how long it lasted [s].
        told: whether it showed on /diagnostics.
        back: from its end to the first of good bands that last a window [s]; NaN for not before
            the next fault.
    """

    kind: str
    time: float
    seconds: float
    told: bool = False
    back: float = float('nan')


# Node and key whose value grows, or whose text appears.
SHOWN = {
    'drop_out': ('lab_bridge', 'lost'),
    'nan_burst': ('lab_bridge', 'not finite'),
    'clock_jump': ('lab_bridge', 'clock steps'),
    'restart': ('lab_bridge', 'restarts'),
    'disorder': ('lab_bridge', 'duplicates'),
    'garbage': ('lab_bridge', 'malformed'),
    'spike': ('estimator', 'windows failed'),
    'estimator_killed': ('estimator', 'start (last)'),
    'worker_killed': ('estimator', 'worker (count)'),
    'recorder_stalled': ('recorder', ''),
}


@dataclass(slots=True)
class Content:
    """What was read from a bag.

    Attributes:
        reports: time and values of every report, by node.
        bands: time of publication and coverage of every scored band.
        indices: running index of every block, and how many samples it has.
        delays: from the sending of each block to the recorder's callback [s].
    """

    reports: dict[str, list[tuple[float, dict[str, str]]]]
    bands: list[tuple[float, float]]
    indices: list[tuple[int, int]]
    delays: list[float]


def read(bag: Path) -> Content:
    """Return what a bag holds of a soak."""
    content = Content({}, [], [], [])
    for found in messages(bag):
        kind = found.type.rpartition('/')[2]
        when = found.publish_time * 1e-9
        if kind == 'DiagnosticArray':
            for status in deserialize(found.type, found.data).status:
                values = {v.key: v.value for v in status.values}
                content.reports.setdefault(status.name.strip('/'), []).append((when, values))
        elif kind == 'PredictionBand':
            band = deserialize(found.type, found.data)
            if band.scored and band.kind == 'total':
                content.bands.append((when, float(band.widest_coverage)))
        elif kind == 'SampleBlock':
            block = deserialize(found.type, found.data)
            content.indices.append((int(block.index), len(block.command)))
            content.delays.append((found.log_time - found.publish_time) * 1e-9)
    content.bands.sort()
    return content


def judge(faults: Sequence[Fault], content: Content) -> None:
    """Fill in whether each fault was told, and when the bands were back."""
    last = max((t for reports in content.reports.values() for t, _ in reports[-1:]), default=0.0)
    last = max([last, *(t for t, _ in content.bands[-1:])])
    for number, fault in enumerate(faults):
        following = faults[number + 1].time if number + 1 < len(faults) else last
        fault.told = _told(fault, content)
        fault.back = _back(fault.time + fault.seconds, following, content.bands)


def _back(end: float, following: float, bands: Sequence[tuple[float, float]]) -> float:
    """Return the time from the end of a fault until bands are good, and stay so for a window.

    No band for longer than two hops is as bad as a bad one.
    """
    after = [(t, c) for t, c in bands if end < t <= following]
    for place, (begin, _) in enumerate(after):
        until = min(begin + WINDOW, following)
        lasting = [(t, c) for t, c in after[place:] if t <= until]
        holes = any(b - a > HOLE for a, b in pairwise([*(t for t, _ in lasting), until]))
        if not holes and all(c >= GOOD for _, c in lasting):
            return begin - end
    return float('nan')


def _told(fault: Fault, content: Content) -> bool:
    node, key = SHOWN[fault.kind]
    reports = content.reports.get(node, [])
    if fault.kind == 'recorder_stalled':
        # A node that stands still says nothing: that is seen.
        times = [t for t, _ in reports]
        gaps = [b - a for a, b in pairwise(times) if b > fault.time > a - 5.0]
        return bool(gaps) and max(gaps) > 2.0
    before = [v.get(key, '') for t, v in reports if t <= fault.time]
    after = [v.get(key, '') for t, v in reports if fault.time < t < fault.time + TOLD_SECONDS]
    if fault.kind == 'estimator_killed':
        later = [v.get(key, '') for t, v in reports if t > fault.time]
        return any('begins anew' in v for v in later)
    was = _number(before[-1]) if before else 0.0
    return any(_number(v) > was for v in after)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def whole(content: Content) -> int:
    """Return how many samples the bag lacks beyond the gaps that the bridge itself has told."""
    reports = content.reports.get('lab_bridge', [])
    told = _number(reports[-1][1].get('lost', '0')) if reports else 0.0
    missing, expected = 0, None
    for index, count in content.indices:
        if expected is not None and index > expected:
            missing += index - expected
        expected = index + count
    return max(0, round(missing - told))


def summary(content: Content) -> dict[str, Any]:
    """Return what the nodes reported last."""
    last = {node: reports[-1][1] for node, reports in content.reports.items()}
    keys = (
        'windows',
        'windows dropped',
        'deadlines missed',
        'latency median (s)',
        'latency p99 (s)',
    )
    good = sum(c >= GOOD for _, c in content.bands)
    hops = content.bands[-1][0] - content.bands[0][0] + 1.0 if content.bands else 1.0
    median, late = np.quantile(content.delays or [np.nan], (0.5, 0.99))
    return {
        'estimator': {key: last.get('estimator', {}).get(key) for key in keys},
        'good_bands_per_hop': good / hops,
        'worst_write_lag_s': last.get('recorder', {}).get('worst bag write lag (s)'),
        'callback_delay_s': {'median': float(median), 'p99': float(late)},
    }
