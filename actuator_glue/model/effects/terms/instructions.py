"""Instructions for the machine from the tree of an expression, with d/d(dx) beside every value."""

from __future__ import annotations

from typing import Final

from actuator_glue.model.effects.terms import machine as m
from actuator_glue.model.effects.terms.expression import MEMORY
from actuator_glue.model.effects.terms.tree import Tree

_ONE: Final = {
    name: int(getattr(m, name.upper()))
    for name in ['neg', 'abs', 'sign', 'sqrt', 'exp', 'log', 'sin', 'cos', 'tanh', 'atan']
}
# Most factors of a power that is multiplied out.
_MOST: Final = 16
_TINY: Final = 1e-150
# As good as no limit.
_FASTEST: Final = 1e150

# A register with the value, and one with the slope d/d(dx) where there is one.
Dual = tuple[int, int | None]


class Emitter:
    """Registers and instructions of one part after another.

    What depends on parameters alone goes in front (`prepare`); nothing is computed twice.

    Attributes:
        rows: registers so far.
        constants: register of every constant.
        memory: registers that remember.
        prepare: instructions executed once.
        code: instructions of the present part.
        symbols: register and slope of what an expression may name.
        changes, jumps: the same with what it changes by over the step in place of the slope:
            steadily, and in the leap of a held command.
        at_end: whether values are those of the step's end, which may be tried more than once.
        ends: what then is remembered: its register, and that with the value.
    """

    def __init__(self, held: set[int]) -> None:
        self.rows = m.FIXED
        self.constants: dict[float, int] = {}
        self.memory: list[int] = []
        self.prepare: list[m.Instruction] = []
        self.code: list[m.Instruction] = []
        self.symbols: dict[str, Dual] = {}
        self.changes: dict[str, Dual] = {}
        self.jumps: dict[str, Dual] = {}
        self.at_end = False
        self.ends: dict[int, int] = {}
        self._held = set(held)
        self._prepared: dict[tuple[int, ...], int] = {}
        self._known: dict[tuple[int, ...], int] = {}
        self._kept: dict[tuple[int, ...], int] = {}

    def forget(self) -> None:
        """Forget what was computed from signals that have changed."""
        self._known.clear()
        self._kept.clear()

    def row(self, held: bool = False) -> int:
        """Return a new register; `held` if it does not change during a test."""
        self.rows += 1
        if held:
            self._held.add(self.rows - 1)
        return self.rows - 1

    def constant(self, value: float) -> int:
        """Return the register of a number."""
        if value not in self.constants:
            self.constants[value] = self.row(held=True)
        return self.constants[value]

    def do(self, op: int, a: int, b: int = 0, c: int = 0, memory: int = 0) -> int:
        """Return the register with the result of an operation, computed once."""
        operands = [a, *([b] if b else []), *([c] if c else [])]
        held = self._held.issuperset(operands) and not memory
        known, code = (self._prepared, self.prepare) if held else (self._known, self.code)
        key = op, a, b, c, memory
        if key not in known:
            known[key] = self.row(held)
            if memory:  # of the two that it leaves beside
                self.rows += 2
            code.append(m.Instruction(op, known[key], a, b, c, memory))
        return known[key]

    def _keep(self, *key: int) -> int:
        """Return the register that remembers for an operation on these."""
        if key not in self._kept:
            self._kept[key] = self.row()
            self.memory.append(self._kept[key])
        return self._kept[key]

    def along(self, symbols: dict[str, Dual], tree: Tree) -> int | None:
        """Return the slope of an expression along others than `symbols`, as `jumps`."""
        before, self.symbols = self.symbols, symbols
        slope = self.emit(tree)[1]
        self.symbols = before
        return slope

    def _times(self, a: int, slope: int | None) -> int | None:
        if slope is None or slope == self.constants.get(1.0):
            return None if slope is None else a
        return self.do(m.MUL, a, slope)

    def _plus(self, a: int | None, b: int | None, op: int = m.ADD) -> int | None:
        if a is None or b is None:
            return a if b is None else b if op == m.ADD else self.do(m.NEG, b)
        return self.do(op, a, b)

    def emit(self, tree: Tree) -> Dual:
        """Add the instructions of an expression, return where its value and slope are."""
        name, parts = tree.operation, tree.operands
        if name == 'number':
            return self.constant(tree.value), None
        if name == 'symbol':
            return self.symbols[tree.name]
        if name == 'pow':
            return self._power(*parts)
        if name in MEMORY:
            return self._remembered(name, *parts)
        found = [self.emit(part) for part in parts]
        if name in _ONE:
            return self._one(name, *found[0])
        if name in ('add', 'sub', 'mul', 'div'):
            return self._two(name, *found[0], *found[1])
        if name in ('min', 'max'):
            return self._chosen(name, *found)
        if name == 'clip':
            return self._chosen('min', self._chosen('max', found[0], found[1]), found[2])
        (a, da), (w, _) = found  # dead
        least = self.do(m.NEG, w), None
        inside, slope = self._chosen('min', self._chosen('max', found[0], least), (w, None))
        return self.do(m.SUB, a, inside), self._plus(da, slope, m.SUB)

    def _two(self, name: str, a: int, da: int | None, b: int, db: int | None) -> Dual:
        if name == 'mul':
            return self.do(m.MUL, a, b), self._plus(self._times(b, da), self._times(a, db))
        if name == 'div' and db is None and b in self._held and a not in self._held:
            # A division costs as much as ten products, and this one is done in front.
            return self._two('mul', a, da, self.do(m.DIV, self.constant(1.0), b), None)
        if name == 'div':
            out = self.do(m.DIV, a, b)
            top = self._plus(da, self._times(out, db), m.SUB)
            return out, None if top is None else self.do(m.DIV, top, b)
        op = m.ADD if name == 'add' else m.SUB
        return self.do(op, a, b), self._plus(da, db, op)

    def _one(self, name: str, a: int, da: int | None) -> Dual:
        out = self.do(_ONE[name], a)
        if da is None or name == 'sign':
            return out, None
        if name == 'neg':
            return out, self.do(m.NEG, da)
        one = self.constant(1.0)
        if name in ('sqrt', 'log', 'atan'):
            below = a
            if name == 'sqrt':
                safe = self.do(m.MAX, out, self.constant(_TINY))
                below = self.do(m.ADD, safe, safe)
            elif name == 'atan':
                below = self.do(m.ADD, one, self.do(m.MUL, a, a))
            return out, self.do(m.DIV, da, below)
        if name == 'tanh':
            gain = self.do(m.SUB, one, self.do(m.MUL, out, out))
        elif name == 'sin':
            gain = self.do(m.COS, a)
        elif name == 'cos':
            gain = self.do(m.NEG, self.do(m.SIN, a))
        else:
            gain = self.do(m.SIGN, a) if name == 'abs' else out
        return out, self.do(m.MUL, gain, da)

    def _chosen(self, name: str, left: Dual, right: Dual) -> Dual:
        (a, da), (b, db) = left, right
        out = self.do(m.MIN if name == 'min' else m.MAX, a, b)
        if da is None and db is None:
            return out, None
        zero = self.constant(0.0)
        first = self.do(m.LESS, a, b) if name == 'min' else self.do(m.LESS, b, a)
        a_slope, b_slope = zero if da is None else da, zero if db is None else db
        return out, self.do(m.SELECT, a_slope, b_slope, first)

    def _power(self, base: Tree, exponent: Tree) -> Dual:
        a, da = self.emit(base)
        sign, power = 1, exponent
        if exponent.operation == 'neg':
            sign, power = -1, exponent.operands[0]
        if power.operation == 'number' and power.value in range(_MOST + 1):
            return self._whole(a, da, sign * int(power.value))
        n, _ = self.emit(exponent)
        out = self.do(m.POW, a, n)
        if da is None:
            return out, None
        safe = self.do(m.MAX, a, self.constant(_TINY))
        less = self.do(m.POW, safe, self.do(m.SUB, n, self.constant(1.0)))
        return out, self.do(m.MUL, self.do(m.MUL, n, less), da)

    def _whole(self, a: int, da: int | None, n: int) -> Dual:
        """A power multiplied out, and its slope."""
        if n < 0:
            below, slope = self._whole(a, da, -n)
            out = self.do(m.DIV, self.constant(1.0), below)
            if slope is None:
                return out, None
            return out, self.do(m.NEG, self.do(m.MUL, self.do(m.MUL, out, out), slope))
        if n == 0:
            return self.constant(1.0), None
        if n == 1:
            return a, da
        less, _ = self._whole(a, None, n - 1)
        slope = self._times(self.do(m.MUL, self.constant(float(n)), less), da) if da else None
        return self.do(m.MUL, less, a), slope

    def _remembered(self, name: str, operand: Tree, *sizes: Tree) -> Dual:
        """What remembers, and its slope; along `changes` its own change, and it does not jump."""
        a, da = self.emit(operand)
        if self.at_end and name == 'play':
            return self._dragged(a, da, self.emit(sizes[0])[0])
        one, b = self.constant(1.0), m.STEP
        if name == 'lag':
            steps = self.do(m.DIV, m.STEP, self.emit(sizes[0])[0])
            b = self.do(m.EXP, self.do(m.NEG, steps))
            mean = self.do(m.DIV, self.do(m.SUB, one, b), steps)
            if self.at_end:
                return self._relaxed(a, da, b, mean)
            out = self.do(m.LAG, a, b, mean, self._keep(m.LAG, a, b))
            moved, gain = out + 1, self.do(m.SUB, one, mean)
        elif name == 'integral':
            out = self.do(m.INTEGRAL, a, b, memory=self._keep(m.INTEGRAL, a))
            moved, gain = out + 1, self.do(m.MUL, self.constant(0.5), b)
        else:
            b = self.emit(sizes[0])[0]
            change, jump = self.along(self.changes, operand), self.along(self.jumps, operand)
            out, moved, gain = self._turning(name == 'play', a, b, change, jump)
        if self.symbols is self.jumps:
            return out, None
        if self.symbols is self.changes:
            return out, moved
        return out, self._times(gain, da)

    def _dragged(self, a: int, da: int | None, half: int) -> Dual:
        """Play at the step's end, which keeps nothing until the step is known."""
        kept = self._keep(m.PLAY, a, half)
        before = self.do(m.RECALL, kept, a), None
        above, below = (self.do(op, a, half) for op in (m.ADD, m.SUB))
        out, slope = self._chosen('max', self._chosen('min', before, (above, da)), (below, da))
        self.ends[kept] = out
        return out, slope

    def _relaxed(self, a: int, da: int | None, left: int, mean: int) -> Dual:
        """Lag at the step's end of what runs straight in it; kept once the step is known.

        Args:
            a: the signal at the end.
            da: its slope.
            left: share of the lag that the step leaves.
            mean: mean of that share over the step.
        """
        signal, lagged = self._keep(m.RECALL, a), self._keep(m.LAG, a, left)
        follows = self.do(m.SUB, self.constant(1.0), mean)
        old = self.do(m.MUL, left, self.do(m.RECALL, lagged, a))
        begun = self.do(m.MUL, self.do(m.SUB, mean, left), self.do(m.RECALL, signal, a))
        out = self.do(m.ADD, self.do(m.ADD, old, begun), self.do(m.MUL, follows, a))
        self.ends[signal], self.ends[lagged] = a, out
        return out, self._times(follows, da)

    def _turning(
        self, plays: bool, a: int, b: int, change: int | None, jump: int | None
    ) -> tuple[int, int, int]:
        """Play or a rate limit, before a jump and after it: mean, change, share that follows."""
        op = m.PLAY if plays else m.LIMIT
        kept = self._keep(op, a, b)
        if not plays:  # times no time it must be a number
            b = self.do(m.MUL, self.do(m.MIN, b, self.constant(_FASTEST)), m.STEP)
        rise = self.constant(0.0) if change is None else change
        if jump is None:
            out = self.do(op, a, b, rise, kept)
            return out, out + 1, out + 2
        after = m.SHARE
        before = self.do(m.SUB, self.constant(1.0), after)
        apart = self.do(m.ADD, jump, self.do(m.MUL, self.constant(0.5), rise))
        first = self.do(m.SUB, a, self.do(m.MUL, after, apart))
        found = []
        for at, share in ((first, before), (self.do(m.ADD, first, apart), after)):
            most = b if plays else self.do(m.MUL, b, share)
            out = self.do(op, at, most, self.do(m.MUL, rise, share), kept)
            found.append((self.do(m.MUL, share, out), out + 1, self.do(m.MUL, share, out + 2)))
        mean, moved, gain = (self.do(m.ADD, *both) for both in zip(*found, strict=True))
        return mean, moved, gain
