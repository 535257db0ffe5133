"""The parts of all effects in the compiled step, put together: one njit function a place.

Each function does what the one before does, and then the next effect's part. Compiled code is kept
of what calls them only: they are inlined there.
"""

from __future__ import annotations

from functools import partial, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model.effects import catalogue
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.stage import Quantity
from actuator_glue.records import Array

_njit: Any = partial(njit, cache=False)
_STAGES = [e.stage for e in catalogue.ENTRIES if e.stage is not None]
# Stages of one place act in the order of the effects' names.
_BY_NAME = [
    e.stage for e in sorted(catalogue.ENTRIES, key=lambda e: e.name) if e.stage is not None
]

# Known once every effect has taken its rows and its switch.
SIZE = r.ROWS.close()
SWITCHES = r.SWITCHES.close()


def _sum(first: Any, then: Any) -> Any:
    @_njit
    def both(p: Any) -> Any:
        return first(p) + then(p)

    return both


def _product(first: Any, then: Any) -> Any:
    @_njit
    def both(p: Any) -> Any:
        return first(p) * then(p)

    return both


def _filled(first: Any, then: Any) -> Any:
    @_njit
    def both(w: Array, n: int, p: Any, case: Any) -> None:
        first(w, n, p, case)
        then(w, n, p, case)

    return both


def _passed(first: Any, then: Any) -> Any:
    @_njit
    def both(w: Array, n: int, value: Any, slope: Any) -> Any:
        value, slope = first(w, n, value, slope)
        return then(w, n, value, slope)

    return both


def _sensed(first: Any, then: Any) -> Any:
    @_njit
    def both(w: Array, n: int, y: Any) -> Any:
        return then(w, n, first(w, n, y))

    return both


def _added(first: Any, then: Any) -> Any:
    @_njit
    def both(w: Array, n: int) -> Any:
        return first(w, n) + then(w, n)

    return both


def _times(first: Any, gain: Any, own: Any) -> Any:
    @_njit
    def all_lanes(w: Array, on: NDArray[np.bool_], time: float) -> None:
        first(w, on, time)
        if on[own]:
            for n in range(r.LANES):
                w[r.IN_GAIN + n] *= gain(w, n, time)

    return all_lanes


@_njit
def _no_gain(w: Array, on: NDArray[np.bool_], time: float) -> None:
    for n in range(r.LANES):
        w[r.IN_GAIN + n] = 1.0


def _total(quantity: Quantity, join: Any) -> Any:
    return reduce(join, [s.adds[quantity] for s in _STAGES if quantity in s.adds])


# (p) -> what all effects together make of the scheme's quantities.
gain = _total('gain', _product)
delay, skew, offset = _total('delay', _sum), _total('skew', _sum), _total('error', _sum)
valve_lag, dry = _total('valve_lag', _sum), _total('dry', _sum)
damping, mass = _total('damping', _sum), _total('mass', _sum)
# (w, n, p, case): rows of all effects.
fill = reduce(_filled, [s.fill for s in _STAGES if s.fill is not None])
# (w, n, value, slope) -> (value, slope): control error, and flow after its gains.
error = reduce(_passed, [s.error for s in _BY_NAME if s.error is not None])
limit = reduce(_passed, [s.limit for s in _BY_NAME if s.limit is not None])
# (w, n) -> what the controller's own transducer shows beyond the position.
beyond = reduce(_added, [s.beyond for s in _BY_NAME if s.beyond is not None])
# (w, n, y) -> y: recorded displacement; `shown` where what carries the actuator does not move.
sensed = reduce(_sensed, [s.sensed for s in _BY_NAME if s.sensed is not None])
shown = reduce(_sensed, [s.sensed for s in _BY_NAME if s.sensed is not None and s.beyond is None])
# (w, on, time): writes IN_GAIN of all lanes, from IN_Q; an effect that is off costs nothing.
gains: Any = _no_gain
for _stage in _BY_NAME:
    if _stage.gain is not None:
        gains = _times(gains, _stage.gain, _stage.own)
