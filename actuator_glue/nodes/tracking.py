"""The tracking numbers of a window as a message."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from actuator_glue.nodes import topics
from actuator_glue.nodes.estimator_worker import Tracked
from actuator_glue.nodes.messages import publish
from actuator_glue.online.conversion import Head

# Field in the message: name in `RecordTracking`.
_NUMBERS = {
    'fei_amplitude': 'fei_amplitude',
    'fei_delay': 'fei_delay_s',
    'j1': 'J1_s',
    'j2': 'J2',
    'j3': 'J3',
    'ti': 'ti_m2',
    'hsem': 'hsem',
}
_LIMITS = ('lower', 'median', 'upper')


def publish_tracking(
    out: Mapping[topics.Topic, Any], found: Tracked, frequencies: tuple[float, ...]
) -> Iterator[str]:
    """Publish what was computed; yield why it cannot be."""
    if topics.TRACKING not in out:
        yield 'actuator_glue_msgs is older than this node: build it again (make setup)'
    else:
        publish(out[topics.TRACKING], *message(found, frequencies))


def message(found: Tracked, frequencies: tuple[float, ...]) -> tuple[Head, dict[str, Any]]:
    """Return header and fields of a TrackingIndicators."""
    predicted, measured = found.numbers.predicted, found.numbers.measured
    told = [f for f in frequencies if f'delay_at_{f:g}_hz_s' in predicted]
    fields: dict[str, Any] = {'window': found.window, 'frequency': np.array(told)}
    for limit in _LIMITS:
        for what, unit in (('delay', '_s'), ('amplitude', '')):
            values = [getattr(predicted[f'{what}_at_{f:g}_hz{unit}'], limit) for f in told]
            fields[f'{what}_{limit}'] = np.array(values)
    for name, known in {'bandwidth': 'bandwidth_hz', **_NUMBERS}.items():
        band = predicted.get(known)
        for limit in _LIMITS:
            fields[f'{name}_{limit}'] = float(getattr(band, limit, np.nan))
        if name in _NUMBERS:
            fields[f'{name}_measured'] = float(measured.get(known, np.nan))
    return Head(found.stamp_ns, found.actuator), fields
