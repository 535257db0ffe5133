"""From expressions to the machine's instructions, each with its derivative along the increment.

The compiled step is implicit in the displacement increment dx, so that beside every value that
depends on it d(value)/d(dx) is computed. What holds during a test is computed once, in front.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.balance import MOST
from actuator_glue.model.effects.terms import changes
from actuator_glue.model.effects.terms import machine as m
from actuator_glue.model.effects.terms.expression import FORCES, SIGNAL, Expression
from actuator_glue.model.effects.terms.instructions import Dual, Emitter
from actuator_glue.model.effects.terms.native import InstructionGroup, Native, native
from actuator_glue.model.parameters import NAMES as BASE
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

# The places in the order in which the parts of a program stand.
_PARTS: Final = (('command',), ('valve',), ('flow',), ('specimen', 'piston'), ('sensor',))
PART: Final = {place: i + 1 for i, places in enumerate(_PARTS) for place in places}
_VALUE: Final = {'t': m.T, 'u': m.U, 'e': m.E, 'q': m.Q, 'f': m.F, 'x': m.X, 'v': m.V, 'y': m.Y}
# d/d(dx) of what depends on the increment where a part is executed: a register, or a number.
_MIDDLE: Final[dict[str, int | float]] = {'x': 0.5, 'v': m.D_V_MIDDLE}
_END: Final[dict[str, int | float]] = {'x': 1.0, 'v': m.D_V_END}
_SLOPE: Final = {'valve': _MIDDLE, 'flow': _MIDDLE, 'specimen': _END, 'piston': _END}
# Signals whose slope counts there, too.
_FOLLOWED: Final = {'valve': 'e', 'flow': 'eq', 'specimen': 'f', 'piston': 'f'}
# Where a part finds its signal and its slope, and leaves them.
_SIGNALS: Final[dict[str, Dual]] = {
    'u': (m.U, None),
    'e': (m.E, m.D_E),
    'q': (m.Q, m.D_Q),
    'f': (m.F, m.D_F),
    'y': (m.Y, None),
}
# A straight line through the step cuts off the point at which the error turns, under a held
# command in every sample: of 10 um by a valve's play at 1 kHz it lost 0.17 um; in steps half as
# long 0.04, a quarter 0.01. Where the flow bounds the error, so that it bends within the step, it
# lost 9 um of 500 um; in steps a quarter as long 0.1.
_TURNING: Final = 2
_BENDING: Final = 4
# Signals written only if an instruction of some part reads them; those a part changes always are.
_NEEDS: Final = (
    (m.NEEDS_T, m.T, m.COMMAND, m.FORCE),
    (m.NEEDS_U, m.U, m.COMMAND, m.FORCE),
    (m.NEEDS_E, m.E, m.FLOW, m.FORCE),
    (m.NEEDS_Q, m.Q, m.COMMAND, m.VALVE),
    (m.NEEDS_F, m.F, m.COMMAND, m.FLOW),
    (m.NEEDS_X, m.X, m.COMMAND, m.FLOW),
    (m.NEEDS_V, m.V, m.COMMAND, m.FLOW),
    (m.NEEDS_FLOW, m.Q, m.FORCE, m.FORCE),
)
# What weakens faster than the oil is stiff is not followed implicitly: the least slope of a force
# over the stiffness of what drives it.
_LEAST: Final = -0.5
# d/d(dx) of the control error before any effect on it: the mean of the step.
_E_SLOPE: Final = -0.5
# Functions with a kink.
_CORNERS: Final = {'abs', 'sign', 'min', 'max', 'clip', 'dead'}
_KINKS: Final = _CORNERS | {'sqrt', 'play'}
_HOLDS: Final = dict(zip((*BASE, 'k'), range(m.BETA_1, m.K + 1), strict=True))


class Written(NamedTuple):
    """An effect written as an expression."""

    expression: Expression
    parameters: tuple[Parameter, ...]


@dataclass(frozen=True)
class Program:
    """Instructions of some effects and the registers they work on.

    Attributes:
        code: its parts, machine.PREPARE to machine.KEEP.
        constants: registers that hold a number, and the number.
        times: Newton steps at most of the balance of forces.
        rows: number of registers.
        parameters: register of every parameter.
        memory: registers that remember.
        switches: per effect its register that says whether it acts, its parameters, and their
            neutral values: an effect all of whose parameters are neutral is not there.
        shorter: how many times shorter sub-steps must be under a held command.
    """

    code: tuple[InstructionGroup, ...]
    constants: tuple[tuple[int, float], ...]
    times: int
    rows: int
    parameters: Mapping[str, int]
    memory: tuple[int, ...]
    switches: tuple[tuple[int, tuple[str, ...], tuple[float, ...]], ...]
    shorter: int = 1

    def __getstate__(self) -> dict[str, object]:
        """Native code is of one process."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def _native(self) -> Native:
        return native(self.code, self.constants)

    @cached_property
    def parts(self) -> m.Parts:
        """What the compiled step is told, see machine.PREPARE; valid as long as the program."""
        needs = m.NEEDS_E * self.acts(m.COMMAND, m.VALVE)
        needs |= m.NEEDS_FLOW * self.acts(m.FLOW, m.FLOW)
        moved = range(m.CHANGE_U, m.SHARE + 1)
        needs |= m.NEEDS_CHANGE * any(part.reads(row) for part in self.code for row in moved)
        for flag, row, first, last in _NEEDS:
            needs |= flag * any(part.reads(row) for part in self.code[first : last + 1])
        return np.array([*self._native.addresses, self.times, needs])

    def acts(self, first: int, last: int) -> bool:
        """Whether any of the parts first .. last (machine.COMMAND, ...) changes its signal."""
        return any(part.left for part in self.code[first : last + 1])

    def prepare(self, registers: Array) -> None:
        """Compute what holds during a test, in registers (rows, LANES) of a block."""
        m.once(self.parts[m.PREPARE], registers)

    def start(self, values: Mapping[str, Array], which: NDArray[np.intp]) -> Array:
        """Return registers (blocks, rows, LANES) with the parameters of every lane.

        Args:
            values: parameters by name, each (m,).
            which: parameter set of every lane, (blocks x LANES,).
        """
        out = np.zeros((len(which) // r.LANES, self.rows, r.LANES))
        out[:, m.D_E] = _E_SLOPE
        held = {'origin': m.ORIGIN, **_HOLDS, **self.parameters}
        for name, row in held.items():
            if name in values:
                out[:, row] = values[name][which].reshape(-1, r.LANES)
        for row, names, neutral in self.switches:
            on = np.zeros(len(which), dtype=np.bool_)
            for name, off in zip(names, neutral, strict=True):
                on |= values[name][which] != off
            out[:, row] = on.reshape(-1, r.LANES)
        return out


def compiled(effects: Iterable[Written]) -> Program:
    """Return the program of some effects."""
    written = tuple(effects)
    builder = _Builder(changes.asked(e.expression for e in written))
    for places in _PARTS:
        here = (e for place in places for e in written if e.expression.place == place)
        builder.part(SIGNAL[places[0]], here)
    builder.balance()
    builder.keep()
    valves = (e.expression.tree.words() for e in written if e.expression.place == 'valve')
    return replace(builder.program(), shorter=max(map(_shorter, valves), default=1))


def _shorter(words: set[str]) -> int:
    """How many times shorter sub-steps must be for a valve with these words, command held."""
    if 'q' in words and words & _CORNERS:
        return _BENDING
    return _TURNING if 'play' in words else 1


class _Builder:
    def __init__(self, moves: bool) -> None:
        self._emitter = Emitter({m.STEP, m.D_V_MIDDLE, m.D_V_END, *_HOLDS.values()})
        self._parameters: dict[str, int] = {}
        self._switches: list[tuple[int, tuple[str, ...], tuple[float, ...]]] = []
        self._parts: list[InstructionGroup] = []
        self._times = 1
        # Where every signal and its slope are by now.
        self._signals: dict[str, Dual] = {
            **_SIGNALS,
            'e': (m.E, self._emitter.constant(_E_SLOPE)),
        }
        self._changes = changes.Changes(self._emitter, moves)

    def part(self, signal: str, effects: Iterable[Written]) -> None:
        """Add a part; every effect takes the signal that the one before has made."""
        self._emitter.code = []
        before = self._signals[signal]
        self._changes.begin(signal)
        for effect in effects:
            self._add(effect)
        (value, slope), (to, slope_to) = self._signals[signal], _SIGNALS[signal]
        left = self._changes.left() if signal == 'u' else []
        if value != before[0]:
            left.append((to, value))
        if slope is not None and slope_to is not None and slope != before[1]:
            left.append((slope_to, slope))
            slope = slope_to
        self._signals[signal] = to, slope
        self._parts.append(InstructionGroup(tuple(self._emitter.code), tuple(left)))
        self._emitter.forget()

    def balance(self) -> None:
        """Add a Newton step of the balance of forces, `balance.look`, around the force part.

        That is against a proportional specimen. The velocity is that of the parabola through the
        last three positions: that of the scheme itself may alternate from step to step.
        """
        into, force = self._emitter, self._parts[m.FORCE - 1]
        if not force.left:
            self._parts.append(InstructionGroup((), ()))
            return
        dx, stiffness, dry = -r.IN_DX, -r.STIFFNESS, -r.COULOMB
        into.code = code = []
        before = into.do(m.MUL, into.constant(1.0 / 3.0), -r.DX)
        code.append(m.Instruction(m.ADD, m.X, -r.X, dx))
        code.append(m.Instruction(m.MUL, m.V, m.D_V_END, into.do(m.SUB, dx, before)))
        code.append(m.Instruction(m.MUL, m.F, stiffness, m.X))
        code.append(m.Instruction(m.COPY, m.D_F, stiffness))
        code.extend(force.code)
        left = dict(force.left)
        oil = into.do(m.ADD, -r.IN_STIFF, -r.DAMPING_2)
        least = into.do(m.MUL, into.constant(_LEAST), oil)
        tangent = into.do(m.MAX, left.get(m.D_F, m.D_F), least)
        trial = into.do(m.SUB, -r.IN_PUSH, left[m.F])
        trial = into.do(m.ADD, trial, into.do(m.MUL, tangent, dx))
        taken = into.do(m.MIN, into.do(m.MAX, trial, into.do(m.NEG, dry)), dry)
        moved = into.do(m.DIV, into.do(m.SUB, trial, taken), into.do(m.ADD, oil, tangent))
        self._parts.append(InstructionGroup(tuple(code), ((dx, moved),)))

    def keep(self) -> None:
        """Add what forces remember of a step, once that is known."""
        code = self._parts[m.FORCE - 1].code
        self._parts.append(InstructionGroup(code, tuple(self._emitter.ends.items())))

    def _add(self, effect: Written) -> None:
        into, names = self._emitter, tuple(p.name for p in effect.parameters)
        place = effect.expression.place
        for name in names:
            self._parameters.setdefault(name, into.row(held=True))
        slopes = {
            s: slope if isinstance(slope, int) else into.constant(slope)
            for s, slope in _SLOPE.get(place, {}).items()
        }
        followed = _FOLLOWED.get(place, '')
        into.symbols = {
            **{name: (row, None) for name, row in _HOLDS.items()},
            **{name: (row, slopes.get(name)) for name, row in _VALUE.items()},
            **{s: (at, d if s in followed else None) for s, (at, d) in self._signals.items()},
            **{name: (self._parameters[name], None) for name in names},
        }
        self._changes.follow(into.symbols)
        into.at_end = place in FORCES
        signal = SIGNAL[place]
        before, slope_before = into.symbols[signal]
        used = effect.expression.tree.words()
        after, slope = into.emit(effect.expression.tree)
        if slope_before is not None and slope is None:
            slope = into.constant(0.0)
        on = 0
        if not effect.expression.exact:
            on = into.row(held=True)
            off = tuple(float(p.neutral or 0.0) for p in effect.parameters)
            self._switches.append((on, names, off))
            after = into.do(m.SELECT, after, before, on)
            if slope is not None and slope_before is not None:
                slope = into.do(m.SELECT, slope, slope_before, on)
        self._signals[signal] = after, slope
        self._changes.passed(effect.expression, on)
        if place in FORCES:
            # One Newton step where a force bends slowly, as for a hardening specimen.
            bends = 'v' in used or used & _KINKS
            self._times = max(self._times, MOST if bends else 1)

    def program(self) -> Program:
        """Return what has been added."""
        into = self._emitter
        read = [
            step.result for step in into.prepare if any(p.reads(step.result) for p in self._parts)
        ]
        return Program(
            code=(
                InstructionGroup(tuple(into.prepare), tuple((row, row) for row in read)),
                *self._parts,
            ),
            constants=tuple((row, value) for value, row in into.constants.items()),
            times=self._times,
            rows=into.rows,
            parameters=self._parameters,
            memory=tuple(into.memory),
            switches=tuple(self._switches),
        )
