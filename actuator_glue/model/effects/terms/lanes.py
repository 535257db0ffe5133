"""Formulas that write native code: what is computed with `LaneNumbers` is computed when it runs.

One operation of the processor for each that is written, none joined or reordered: a parameter set
gets the same bits whatever its neighbours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from llvmlite import ir

# Parameter sets in one vector.
WIDE: Final = 8
VECTOR: Final = ir.VectorType(ir.DoubleType(), WIDE)
# What, added to a number, leaves no bits below its point.
WHOLE: Final = 1.5 * 2.0**52
# Of a double: what is added to the exponent, and where that begins.
_EXPONENT, _MANTISSA = 1023, 52


def _value(number: LaneNumbers | float) -> Any:
    return (
        number.value if isinstance(number, LaneNumbers) else ir.Constant(VECTOR, [number] * WIDE)
    )


def _two(
    name: str, turned: bool = False
) -> Callable[[LaneNumbers, LaneNumbers | float], LaneNumbers]:
    def method(self: LaneNumbers, other: LaneNumbers | float) -> LaneNumbers:
        a, b = (other, self) if turned else (self, other)
        return LaneNumbers(self.code, getattr(self.code, name)(_value(a), _value(b)))

    return method


def _compared(
    how: str, unordered: bool = False
) -> Callable[[LaneNumbers, LaneNumbers | float], LaneNumbers]:
    def method(self: LaneNumbers, other: LaneNumbers | float) -> LaneNumbers:
        compare = self.code.fcmp_unordered if unordered else self.code.fcmp_ordered
        return LaneNumbers(self.code, compare(how, self.value, _value(other)))

    return method


@dataclass(frozen=True, slots=True)
class LaneNumbers:
    """A number of every lane; from a comparison its truth.

    Attributes:
        code: writes the code, an llvmlite.ir.IRBuilder.
        value: what the number is called there.
    """

    code: Any
    value: Any

    __add__, __radd__ = _two('fadd'), _two('fadd', turned=True)
    __sub__, __rsub__ = _two('fsub'), _two('fsub', turned=True)
    __mul__, __rmul__ = _two('fmul'), _two('fmul', turned=True)
    __truediv__, __rtruediv__ = _two('fdiv'), _two('fdiv', turned=True)
    __or__ = _two('or_')
    __lt__, __gt__ = _compared('<'), _compared('>')
    __le__, __ge__ = _compared('<='), _compared('>=')
    # Not __eq__: lanes are values of a dataclass, too.
    equals, differs = _compared('=='), _compared('!=', unordered=True)

    def __neg__(self) -> LaneNumbers:
        return LaneNumbers(self.code, self.code.fneg(self.value))

    def __abs__(self) -> LaneNumbers:
        return self.call('fabs')

    def choose(self, yes: LaneNumbers | float, no: LaneNumbers | float) -> LaneNumbers:
        """Return one number where this is true and another one where it is not."""
        return LaneNumbers(self.code, self.code.select(self.value, _value(yes), _value(no)))

    def call(self, function: str, *others: LaneNumbers | float) -> LaneNumbers:
        """Return a function of LLVM."""
        module, name = self.code.module, f'llvm.{function}.v{WIDE}f64'
        operands = [self.value, *map(_value, others)]
        kind = ir.FunctionType(VECTOR, [VECTOR] * len(operands))
        known = module.globals.get(name) or ir.Function(module, kind, name)
        return LaneNumbers(self.code, self.code.call(known, operands))

    def power_of_two(self) -> LaneNumbers:
        """Return 2^k of k + WHOLE, whose lowest bits are those of the integer k."""
        code, kind = self.code, ir.VectorType(ir.IntType(64), WIDE)
        k = code.add(code.bitcast(self.value, kind), ir.Constant(kind, [_EXPONENT] * WIDE))
        k = code.shl(k, ir.Constant(kind, [_MANTISSA] * WIDE))
        return LaneNumbers(code, code.bitcast(k, VECTOR))
