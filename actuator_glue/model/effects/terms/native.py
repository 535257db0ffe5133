"""Native code of a program, made of its instructions within some milliseconds.

LLVM gets operations and numbers of registers alone, nothing that anybody has written. Values stay
in the processor from one instruction to the next; a part stores what others read.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Final, NamedTuple

import llvmlite.binding as llvm
from llvmlite import ir

from actuator_glue.model.effects.layout import LANES
from actuator_glue.model.effects.terms import machine as m
from actuator_glue.model.effects.terms.lanes import VECTOR, WIDE, LaneNumbers
from actuator_glue.model.effects.terms.operations import PURE, REMEMBERING, remembered

_INDEX: Final = ir.IntType(64)


class InstructionGroup(NamedTuple):
    """Instructions that are executed together.

    Attributes:
        code: the instructions.
        left: what they leave: a register, and that which holds its value.
    """

    code: tuple[m.Instruction, ...]
    left: tuple[tuple[int, int], ...]

    def reads(self, row: int) -> bool:
        """Whether it needs a register as it is before."""
        return any(row in step[2:5] for step in self.code) or any(row == at for _, at in self.left)


class Native:
    """Code of the parts of a program, in this process.

    Attributes:
        addresses: of every part's, 0 where a part has no instructions.
    """

    def __init__(
        self, parts: tuple[InstructionGroup, ...], constants: Mapping[int, float]
    ) -> None:
        module = ir.Module()
        written = [i for i, part in enumerate(parts) if part.left]
        for i in written:
            _Writer(module, f'part{i}', constants).write(parts[i])
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        machine = llvm.Target.from_default_triple().create_target_machine(
            cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(), jit=True
        )
        # It owns the code.
        self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(str(module)), machine)
        self._engine.finalize_object()
        self.addresses = [0] * len(parts)
        for i in written:
            self.addresses[i] = self._engine.get_function_address(f'part{i}')


# More than there are forms of a learned term, each of which takes 0.7 MB.
@lru_cache(maxsize=96)
def native(
    parts: tuple[InstructionGroup, ...], constants: tuple[tuple[int, float], ...]
) -> Native:
    """Return the code of a program's parts; `constants` are registers and their values."""
    return Native(parts, dict(constants))


class _Writer:
    """Writes a function of registers and the step's table: a loop over vectors of lanes."""

    def __init__(self, module: Any, name: str, constants: Mapping[int, float]) -> None:
        kind = ir.FunctionType(ir.VoidType(), [ir.DoubleType().as_pointer()] * 2)
        function = ir.Function(module, kind, name)
        entry, self._loop, self._end = (function.append_basic_block() for _ in range(3))
        ir.IRBuilder(entry).branch(self._loop)
        self._code, self._tables = ir.IRBuilder(self._loop), function.args
        self._lane = self._code.phi(_INDEX)
        self._lane.add_incoming(_INDEX(0), entry)
        self._known = {
            row: LaneNumbers(self._code, ir.Constant(VECTOR, [value] * WIDE))
            for row, value in constants.items()
        }

    def write(self, part: InstructionGroup) -> None:
        """Write the function, to its end."""
        for step in part.code:
            a, b, c = (self._read(row) for row in step[2:5])
            if step.operation in PURE:
                self._known[step.result] = PURE[step.operation](a, b, c)
            else:
                kept = remembered(step.operation, a, self._read(step.memory))
                made = REMEMBERING[step.operation](a, b, c, kept)
                rows = step.result, step.memory, step.result + 1, step.result + 2
                self._known.update(zip(rows, made, strict=True))
                self._store(step.memory, made[1])
        for row, value in [(row, self._read(held)) for row, held in part.left]:
            self._store(row, value)
        code, after = self._code, self._code.add(self._lane, _INDEX(WIDE))
        self._lane.add_incoming(after, self._loop)
        code.cbranch(code.icmp_unsigned('<', after, _INDEX(LANES)), self._loop, self._end)
        ir.IRBuilder(self._end).ret_void()

    def _address(self, row: int) -> Any:
        table, begin = self._tables[row < 0], -row if row < 0 else row * LANES
        place = self._code.add(self._lane, _INDEX(begin))
        return self._code.bitcast(self._code.gep(table, [place]), VECTOR.as_pointer())

    def _read(self, row: int) -> LaneNumbers:
        if row not in self._known:
            self._known[row] = LaneNumbers(
                self._code, self._code.load(self._address(row), align=8)
            )
        return self._known[row]

    def _store(self, row: int, number: LaneNumbers) -> None:
        self._code.store(number.value, self._address(row), align=8)
