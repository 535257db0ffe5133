"""A model structure: Eq. (2) plus any set of effects, simulated for many parameter sets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuator_glue.errors import InputError
from actuator_glue.model import linear
from actuator_glue.model.effects import (
    CATALOGUE,
    Effect,
    Scale,
    assembly,
    layout,
    linear_step,
    run,
)
from actuator_glue.model.effects.effect import Onset
from actuator_glue.model.effects.terms import machine
from actuator_glue.model.effects.terms.program import Written, compiled
from actuator_glue.model.exact import Initial
from actuator_glue.model.parameters import BASE, Parameter
from actuator_glue.records import Array, Record


def _entry(effect: str | Effect) -> Effect:
    if isinstance(effect, Effect):
        return effect
    if effect not in CATALOGUE:
        raise InputError(
            f'effect {effect!r} is not in the catalogue; known: {", ".join(CATALOGUE)}'
        )
    return CATALOGUE[effect]


class Structure:
    """Eq. (2) with a set of effects switched on.

    Args:
        effects: names from the catalogue, or effects that need not be registered; their order is
            that of their parameters.

    Attributes:
        effects: names of the effects.
        parameters: base parameters, then those of every effect.
        names: their names.
        linear: all effects are linear, the simulation is exact (effects/linear_effects.py).

    Raises:
        InputError: unknown or repeated effect.
    """

    def __init__(self, effects: Iterable[str | Effect] = ()) -> None:
        self.entries: tuple[Effect, ...] = tuple(_entry(effect) for effect in effects)
        self.effects: tuple[str, ...] = tuple(effect.name for effect in self.entries)
        if len(set(self.effects)) != len(self.effects):
            raise InputError(f'an effect is named twice in {", ".join(self.effects)}')
        self.parameters: tuple[Parameter, ...] = BASE + tuple(
            p for effect in self.entries for p in effect.parameters
        )
        self.names: tuple[str, ...] = tuple(p.name for p in self.parameters)
        self._columns: dict[str, slice] = {}
        first = len(BASE)
        for effect in self.entries:
            self._columns[effect.name] = slice(first, first + len(effect.parameters))
            first += len(effect.parameters)
        self._on = np.zeros(assembly.SWITCHES, dtype=np.bool_)
        self._on[[s for e in self.entries if e.stage is not None for s in e.stage.switches]] = True
        self.program = compiled(
            Written(e.expression, e.parameters) for e in self.entries if e.expression is not None
        )
        if self.program.acts(machine.COMMAND, machine.FORCE):
            self._on[layout.ON_TERMS] = True
            self._on[layout.ON_FORCE] = self.program.acts(machine.FORCE, machine.FORCE)
        self._plain = all(e.variance is not None for e in self.entries)
        self.linear = all(e.linear for e in self.entries)

    def __repr__(self) -> str:
        return f'Structure({self.effects!r})'

    def bounds(self) -> tuple[Array, Array]:
        """Return lower and upper prior bounds, each of shape (p,)."""
        return (
            np.array([p.lower for p in self.parameters]),
            np.array([p.upper for p in self.parameters]),
        )

    def columns(self, effect: str) -> slice:
        """Return which columns of theta hold an effect's parameters.

        Raises:
            InputError: the structure does not have the effect.
        """
        if effect not in self._columns:
            raise InputError(f'{self!r} does not have the effect {effect!r}')
        return self._columns[effect]

    def neutral(self, theta_base: ArrayLike) -> Array:
        """Return theta with every effect switched off, shape (p,) or (m, p), from (4,) or (m, 4).

        Raises:
            InputError: theta_base has another shape.
        """
        base = linear.thetas(theta_base)
        off = [float(p.neutral or 0.0) for p in self.parameters[len(BASE) :]]
        table = np.hstack([base, np.broadcast_to(off, (len(base), len(off)))])
        return np.asarray(table.reshape(*np.shape(theta_base)[:-1], len(self.parameters)))

    def starts(self, theta_base: ArrayLike, scale: Scale) -> Array:
        """Return typical sizes of the last effect, all others neutral, shape (s, p).

        Args:
            theta_base: base parameters, shape (4,).
            scale: from effects.scale(records, theta_base).
        """
        lower, upper = self.bounds()
        if not self.effects:
            return self.neutral(theta_base)[np.newaxis]
        sizes = np.array(self.entries[-1].starts(scale), dtype=np.float64)
        table = np.repeat(self.neutral(theta_base)[np.newaxis], len(sizes), axis=0)
        table[:, self._columns[self.effects[-1]]] = sizes
        table[:, len(BASE) :] = np.clip(
            table[:, len(BASE) :], lower[len(BASE) :], upper[len(BASE) :]
        )
        return table

    def simulate(
        self,
        theta: ArrayLike,
        record: Record,
        *,
        initial: Initial = 'rest',
        rate: int = 1,
        origin: float = 0.0,
        force: bool = False,
    ) -> Array:
        """Return the recorded displacement the model expects (free run), (n,) or (m, n) [m].

        Args:
            theta: shape (p,) or (m, p), in the order of `parameters`.
            record: command, period, hold and known stiffness are used.
            initial: 'rest' at zero, or 'measured': state from the first measured samples.
            rate: how many times finer than usual the integration steps are.
            origin: time of the first sample since the test began [s]: drift, clock skew and hum
                count from there. gain-drift counts from the first sample, whatever the origin.
            force: return the actuator force [N] instead: what specimen, friction and masses take.

        Raises:
            InputError: wrong shape of theta, or the specimen stiffness is not known.
        """
        table = self.table(theta)
        out = np.empty((len(table), len(record)))
        for which, begin, part in self.stretches(table, record, initial, rate, origin, force):
            out[which, begin : begin + len(part)] = part.T
        return out.reshape(*np.shape(theta)[:-1], len(record))

    def stretches(
        self,
        table: Array,
        record: Record,
        initial: Initial = 'rest',
        rate: int = 1,
        origin: float = 0.0,
        force: bool = False,
    ) -> Iterator[tuple[NDArray[np.intp], int, Array]]:
        """Iterate over what `simulate` returns of theta (m, p), as `parts` yields it."""
        start = linear.initial_state(record) if initial == 'measured' else (0.0, 0.0)
        onsets = self.onsets(record, initial)
        return self.parts(table, record, start, onsets, origin, rate, force)

    def onsets(self, record: Record, initial: Initial) -> tuple[Onset, ...]:
        """Return what depends on where a record begins, effect by effect."""
        moving = record if initial == 'measured' else None
        found = (e.onset(moving) for e in self.entries if e.onset is not None)
        return tuple(onset for onset in found if onset is not None)

    def variance(self, theta: ArrayLike, record: Record, displacement: Array) -> Array:
        """Return the variance that noise-like effects add to the measurement, (m, n) [m^2].

        quantisation and timing-jitter leave the mean of the record: they enter a likelihood
        through this variance, added to that of the noise. Zero where none is switched on.

        Args:
            theta: shape (p,) or (m, p).
            record: gives the period.
            displacement: simulated displacement, shape (n,) or (m, n) [m].
        """
        table = self.table(theta)
        y = np.atleast_2d(displacement)
        out = np.zeros((len(table), y.shape[1]))
        for effect in self.entries:
            if effect.variance is not None:
                velocity = np.gradient(y, record.period, axis=1)
                out += effect.variance(table[:, self._columns[effect.name]], velocity)
        return out.reshape(*np.shape(theta)[:-1], y.shape[1])

    def values(self, table: Array) -> dict[str, Array]:
        """Return every catalogue parameter by name, each (m,), neutral if not in theta."""
        defaults = {p.name: p.neutral for e in CATALOGUE.values() for p in e.parameters}
        off = np.repeat([[*defaults.values()]], len(table), axis=0).T
        known = dict(zip(defaults, np.ascontiguousarray(off), strict=True))
        known.update(zip(self.names, table.T, strict=True))
        return known

    @property
    def exact(self) -> tuple[int, bool]:
        """States beside x and q, and whether there is a delay, for a linear structure's steps."""
        return linear_step.third(e.exact for e in self.entries), bool(self._on[layout.ON_LAG])

    @property
    def switches(self) -> NDArray[np.bool_]:
        """Which stages of the kernel act, shape (assembly.SWITCHES,)."""
        return self._on.copy()

    @np.errstate(all='ignore')  # NaN and infinity are the answer where parameters are absurd
    def sensed(self, table: Array, time: Array, displacement: Array) -> Array:
        """Return the displacement (n, m) after the sensor's post-steps (bias, drift, hum)."""
        for effect in self.entries:
            if effect.output is not None:
                part = table[:, self._columns[effect.name]]
                displacement = effect.output(part, time[:, np.newaxis], displacement)
        return displacement

    def table(self, theta: ArrayLike) -> Array:
        """Return theta as (m, p).

        Raises:
            InputError: another number of parameters.
        """
        table = np.ascontiguousarray(theta, dtype=np.float64)
        p = len(self.parameters)
        if table.ndim not in (1, 2) or table.shape[-1] != p:
            raise InputError(
                f'theta has shape {table.shape}; {self!r} takes ({p},) or (m, {p}): '
                f'{", ".join(self.names)}'
            )
        return table.reshape(-1, p)

    def parts(
        self,
        table: Array,
        record: Record,
        start: tuple[float, float],
        onsets: Sequence[Onset],
        origin: float,
        rate: int = 1,
        force: bool = False,
    ) -> Iterator[tuple[NDArray[np.intp], int, Array]]:
        """Yield which parameter sets (c,), from which sample, and what they record (n, c).

        That is the displacement [m], or the actuator force [N].
        """
        if self._plain:
            x = linear.simulate(
                table[:, : len(BASE)],
                record.command,
                stiffness=record.known_stiffness(),
                period=record.period,
                hold=record.hold,
                initial=start,
            )
            yield np.arange(len(table)), 0, x.T * record.known_stiffness() if force else x.T
            return
        values = self.values(table)
        if self.linear:
            blocks = run.exact_blocks(values, *self.exact, record, start, force)
        else:
            with np.errstate(all='ignore'):  # absurd parameters
                for onset in onsets:
                    values |= onset(values, origin)
            values['origin'] = np.full(len(table), origin)
            blocks = run.blocks(values, self._on, self.program, record, start, rate, force)
        for which, begin, x in blocks:
            now = np.asarray(np.arange(begin, begin + len(x)) * record.period + origin)
            yield which, begin, x if force else self.sensed(table[which], now, x)
