"""Change of signals over a sub-step, for functions that turn over within one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from actuator_glue.model.effects.terms import machine as m
from actuator_glue.model.effects.terms.expression import REMEMBERING, SIGNAL, Expression
from actuator_glue.model.effects.terms.instructions import Dual, Emitter

# Registers with what signals change by beside jumps.
ROWS: Final = {'u': m.CHANGE_U, 'x': m.CHANGE_X, 'f': m.CHANGE_F, 'q': m.CHANGE_Q}
_TURNING: Final = {'play', 'limit_rate'}


def asked(expressions: Iterable[Expression]) -> bool:
    """Return whether any expression needs the changes; a force is that at the step's end."""
    return any(e.tree.words() & _TURNING for e in expressions if e.place in REMEMBERING)


class Changes:
    """Change of each signal so far: its steady part, and the jump of a held command.

    Args:
        into: where the instructions go.
        asked: whether any expression needs the changes.
    """

    def __init__(self, into: Emitter, asked: bool) -> None:
        self._into, self._asked = into, asked
        self._tables: tuple[dict[str, int | None], ...] = (
            {**ROWS, 't': m.STEP},
            {'u': m.JUMP},
        )

    def begin(self, signal: str) -> None:
        """Begin the part that changes a signal."""
        steady, jumps = self._tables
        if signal == 'e' and self._asked:
            steady['e'] = self._into.do(m.SUB, m.CHANGE_U, m.CHANGE_X)
            jumps['e'] = m.JUMP
        elif signal == 'q':  # the error's are not left
            steady['e'] = jumps['e'] = None

    def follow(self, symbols: dict[str, Dual]) -> None:
        """Tell what symbols in front of an effect change by."""
        self._into.changes, self._into.jumps = (
            {name: (row, table.get(name)) for name, (row, _) in symbols.items()}
            for table in self._tables
        )

    def passed(self, expression: Expression, on: int) -> None:
        """Note an effect on its signal; register `on` says whether it acts, 0: it does."""
        into, signal = self._into, SIGNAL[expression.place]
        if not self._asked or expression.place not in REMEMBERING:
            return
        for table, symbols in zip(self._tables, (into.changes, into.jumps), strict=True):
            before, after = table.get(signal), into.along(symbols, expression.tree)
            if on and after != before:
                none = into.constant(0.0)
                after = into.do(m.SELECT, after or none, before or none, on)
            table[signal] = after

    def left(self) -> list[tuple[int, int]]:
        """Return what the part of the command leaves: a register, and that with its value."""
        found = []
        for table, row in zip(self._tables, (m.CHANGE_U, m.JUMP), strict=True):
            if table['u'] != row:
                found.append((row, table['u'] or self._into.constant(0.0)))
                table['u'] = row
        return found
