"""An entry of the catalogue from an expression: typical sizes and, for sensors, the post-step."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.model.effects.effect import Effect, Scale
from actuator_glue.model.effects.layout import LANES
from actuator_glue.model.effects.terms import machine as m
from actuator_glue.model.effects.terms import program, trace
from actuator_glue.model.effects.terms.expression import SIGNAL, Expression, read, reserved
from actuator_glue.model.parameters import TABLE_2, Parameter
from actuator_glue.records import Array

# Shares of its signal that an effect of a typical size changes.
_SHARES = (0.01, 0.05, 0.25)
# Values tried of a parameter that does nothing by itself.
_SHAPES = 3
# Sizes tried for it, and samples of the motion they are tried on.
_LEAST, _SAMPLES = 1e-9, 200
# Shares of its parameters' ranges off neutral, at one of which an effect must be small. Ranges of
# a small or weak machine are wide for the usual one, where the third power of a force is 10^14
# times as large.
_NEAR = (1e-9, 1e-18, 1e-27)
_SMALL = 1e-2
# A test on which expressions are tried.
_USUAL = Scale(1e-2, 0.1, 10.0, 1e-3, 1e5, TABLE_2)


def term(
    name: str,
    equation: str,
    parameters: tuple[Parameter, ...],
    *,
    group: str = '',
    signature: str = '',
    source: str = '',
    searched: bool = True,
    check: bool = True,
) -> Effect:
    """Return the entry of an effect written as `place: symbol = expression`.

    Args:
        name: name on the command line.
        equation: for example `sensor: y = y + cubic*y**3`; see docs/effects.md.
        parameters: every one with a neutral value; all of them neutral are no effect.
        group: effects that leave nearly the same trace; its own name if empty.
        signature: what it leaves in the residual.
        source: literature.
        searched: whether the diagnosis tries it.
        check: try the expression at once; the catalogue's own are tried by tests.

    Raises:
        InputError: the expression or a parameter cannot be used.
    """
    try:
        _check(name, parameters)
        found = read(equation, tuple(p.name for p in parameters))
        if check:
            found = _expression(equation, parameters)
        text = equation.partition(':')[2].strip()
        effect = Effect(
            name=name,
            place=found.place,
            equation=text,
            parameters=parameters,
            group=group or name,
            signature=signature or 'none described',
            source=source or 'an expression of the user',
            starts=_Starts(name, equation, parameters),
            expression=found,
            output=_Sensor(name, equation, parameters) if found.place == 'sensor' else None,
            searched=searched,
        )
        if check:
            _check_neutral(effect)
    except InputError as error:
        raise InputError(f'effect {name!r}: {error}') from None
    return effect


def starting_from(effect: Effect, rows: Iterable[tuple[float, ...]]) -> Effect:
    """Return a term whose fits start from these parameters, not from what a sine responds to."""
    assert isinstance(effect.starts, _Starts)
    return replace(effect, starts=replace(effect.starts, given=tuple(rows)))


def _check(name: str, parameters: tuple[Parameter, ...]) -> None:
    if not name or not set(name) <= set('abcdefghijklmnopqrstuvwxyz0123456789-') or name[0] == '-':
        raise InputError('a name has small letters, digits and hyphens')
    if not parameters:
        raise InputError('an effect needs a parameter whose neutral value switches it off')
    for p in parameters:
        if not (p.name.isidentifier() and p.name.isascii()) or p.name in reserved():
            raise InputError(f'parameter {p.name!r}: not a name, or one with a meaning of its own')
        if p.neutral is None or not (
            np.isfinite([p.lower, p.upper]).all() and p.lower <= p.neutral <= p.upper
        ):
            raise InputError(
                f'parameter {p.name!r}: bounds {p.lower:g} .. {p.upper:g} must be finite and '
                f'hold the neutral value {p.neutral}'
            )
        if not p.lower < p.upper:
            raise InputError(f'parameter {p.name!r}: the lower bound is not below the upper one')
    if len({p.name for p in parameters}) < len(parameters):
        raise InputError('two parameters have one name')


@dataclass(frozen=True, slots=True)
class _Starts:
    """Typical sizes: those that change the signal by a share of it, in a sinusoidal motion."""

    name: str
    equation: str
    parameters: tuple[Parameter, ...]
    given: tuple[tuple[float, ...], ...] = ()

    def __call__(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.given:
            return self.given
        columns = range(len(self.parameters))
        found = {j: self._sizes(scale, j, {}) for j in columns}
        # What does nothing by itself (a width, an exponent) shapes the others.
        for shape in [j for j in columns if not found[j]]:
            p = self.parameters[shape]
            spaced = np.geomspace if p.lower > 0.0 else np.linspace
            for value in spaced(p.lower, p.upper, _SHAPES + 2)[1:-1]:
                for j in columns:
                    if j != shape:
                        found[j] += self._sizes(scale, j, {shape: float(value)})
        rows = [row for j in columns for row in found[j]]
        # An effect that this motion does not show still needs somewhere to start.
        middle = [0.1 * p.upper + 0.9 * float(p.neutral or 0.0) for p in self.parameters]
        return tuple(dict.fromkeys(rows)) or (tuple(middle),)

    def _sizes(self, scale: Scale, j: int, others: Mapping[int, float]) -> list[tuple[float, ...]]:
        """Return rows in which one parameter brings the wanted changes, all but these neutral."""
        found: list[tuple[float, ...]] = []
        parameter = self.parameters[j]
        neutral = float(parameter.neutral or 0.0)
        for end in (parameter.upper, parameter.lower):
            if end == neutral:
                continue
            table = _neutral(self.parameters)
            table[:, list(others)] = list(others.values())
            table[:, j] = neutral + (end - neutral) * np.geomspace(_LEAST, 1.0, LANES)
            share = changed(self, table, scale)
            for wanted in _SHARES:
                if (share >= wanted).any():
                    found.append(tuple(table[int((share >= wanted).argmax())].tolist()))
        return found


@dataclass(frozen=True, slots=True)
class _Sensor:
    """Post-step on the recorded displacement."""

    name: str
    equation: str
    parameters: tuple[Parameter, ...]

    def __call__(self, table: Array, time: Array, y: Array) -> Array:
        made = _program(self.equation, self.parameters)
        out, when = np.empty(y.shape), np.ascontiguousarray(time[:, 0])
        blocks = -(-len(table) // LANES)
        which = np.minimum(np.arange(blocks * LANES), len(table) - 1)
        values = {p.name: table[:, j] for j, p in enumerate(self.parameters)}
        for block, registers in enumerate(made.start(values, which)):
            lanes = slice(block * LANES, min((block + 1) * LANES, len(table)))
            made.prepare(registers)
            m.sense(registers, made.parts[m.SENSOR], when, y[:, lanes], out[:, lanes])
        return out


@lru_cache(maxsize=256)
def _expression(equation: str, parameters: tuple[Parameter, ...]) -> Expression:
    """Return the expression; tries whether it is exact."""
    found = read(equation, tuple(p.name for p in parameters))
    tried = replace(found, exact=True)
    made = program.compiled([program.Written(tried, parameters)])
    before, after = _tried(made, tried.place, _neutral(parameters), parameters, _USUAL)
    return replace(found, exact=bool((after == before).all()))


@lru_cache(maxsize=256)
def _program(equation: str, parameters: tuple[Parameter, ...]) -> program.Program:
    return program.compiled([program.Written(_expression(equation, parameters), parameters)])


def _neutral(parameters: tuple[Parameter, ...]) -> Array:
    """Return a table (LANES, p) of neutral parameters."""
    row = [float(p.neutral or 0.0) for p in parameters]
    return np.repeat(np.array([row]), LANES, axis=0)


def changed(starts: _Starts, table: Array, scale: Scale) -> Array:
    """Return the relative change of the signal under each parameter set (LANES, p)."""
    made = _program(starts.equation, starts.parameters)
    place = _expression(starts.equation, starts.parameters).place
    before, after = _tried(made, place, table, starts.parameters, scale)
    size = float(np.sqrt(np.mean(before**2)))
    if place in ('specimen', 'piston'):
        # Without a specimen there is no force to compare with.
        size = max(size, 0.2 * scale.oil * scale.stroke)
    with np.errstate(all='ignore'):
        return np.asarray(np.sqrt(np.mean((after - before) ** 2, axis=0)) / size)


def _tried(
    made: program.Program,
    place: str,
    table: Array,
    parameters: tuple[Parameter, ...],
    scale: Scale,
) -> tuple[Array, Array]:
    """Return the signal in a sinusoidal motion, before (n, 1) and after (n, LANES) the effect."""
    period = 2.0 * np.pi * scale.stroke / scale.velocity
    step = 3.0 * period / _SAMPLES
    motion = trace.sine(scale, step * np.arange(_SAMPLES, dtype=np.float64), period)
    values = {p.name: table[:, j] for j, p in enumerate(parameters)}
    after = trace.run(made, place, values, motion, step, scale.stiffness, scale.theta)
    return motion[SIGNAL[place]][:, None], after


def along(
    effect: Effect,
    table: Array,
    motion: Mapping[str, Array],
    step: float,
    stiffness: float,
    theta: Array,
) -> Array:
    """Return what a term makes of its signal along a motion, (m, n) [unit of the signal].

    Args:
        effect: the term's entry.
        table: its parameters (m, p).
        motion: trace of everything in its equation, its signal among it, (n,) each.
        step: time between two points of the traces [s].
        stiffness: of the specimen [N/m].
        theta: Eq. (2)'s parameters (4,).
    """
    starts = effect.starts
    assert isinstance(starts, _Starts)
    made = _program(starts.equation, starts.parameters)
    place = _expression(starts.equation, starts.parameters).place
    blocks = []
    for begin in range(0, len(table), LANES):
        rows = table[np.minimum(np.arange(begin, begin + LANES), len(table) - 1)]
        values = {p.name: rows[:, j] for j, p in enumerate(effect.parameters)}
        blocks.append(trace.run(made, place, values, motion, step, stiffness, theta).T)
    return np.concatenate(blocks)[: len(table)]


def _check_neutral(effect: Effect) -> None:
    """Refuse an effect that does not vanish as its parameters become neutral."""
    starts = effect.starts
    assert isinstance(starts, _Starts)
    for near in _NEAR:
        table = _neutral(effect.parameters)
        for j, p in enumerate(effect.parameters):
            neutral = table[0, j]
            step = max(near * (p.upper - p.lower), 2.0 * np.spacing(abs(neutral)))
            table[2 * j % LANES, j] = min(neutral + step, p.upper)
            table[(2 * j + 1) % LANES, j] = max(neutral - step, p.lower)
        if (changed(starts, table, _USUAL) < _SMALL).all():
            return
    raise InputError(
        f'{effect.equation!r} is still there with all parameters close to neutral ('
        + ', '.join(f'{p.name} = {p.neutral:g}' for p in effect.parameters)
        + '): at their neutral values Eq. (2) must be left'
    )
