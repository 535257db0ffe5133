"""What an expression is read into."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Tree:
    """A number, a symbol, or an operation (the name of an operator or a function) on others."""

    operation: str
    operands: tuple[Tree, ...] = ()
    value: float = 0.0
    name: str = ''

    def words(self) -> set[str]:
        """Return all operations, functions and symbols in it."""
        return {self.operation, self.name}.union(*(part.words() for part in self.operands))
