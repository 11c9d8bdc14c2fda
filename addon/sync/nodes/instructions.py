"""The instruction list of one material: folding, common subexpressions, and writing out what closures need."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from .. import versions
from ..colour import REC709_SPACE, known_space, luminance_weights
from . import blend  # noqa: F401 - completes FOLDERS
from .enums import VECTOR_MATH_VALUES
from .fold import FOLDERS, Triple

if TYPE_CHECKING:
    from cistern_core import MaterialProgram

FLOAT, COLOR, VECTOR = "f", "c", "v"
MAX_REGISTERS = 256  # kMaxRegisters of native/scene/material_program.h
TABLE_SIZE = 257  # kTableSize there
LARGEST_FLOAT = float(np.finfo(np.float32).max)


@dataclass(frozen=True, slots=True)
class Value:
    """What an input reads: a constant, or the output of the instruction with index `register`."""

    type: str
    constant: Triple | None = None
    register: int = -1

    def retyped(self, letter: str) -> Value:
        """The same three numbers under another name: colour and vector share registers."""
        return replace(self, type=letter)


def constant(x: float, y: float = 0.0, z: float = 0.0, letter: str = FLOAT) -> Value:
    """A constant; as in the core, what single precision cannot hold becomes 0."""
    xyz = tuple(float(value) if abs(value) <= LARGEST_FLOAT else 0.0 for value in (x, y, z))
    return Value(letter, xyz)


@dataclass(frozen=True, slots=True)
class _Instruction:
    op: str
    inputs: tuple[Value, ...]
    parameters: tuple[int, ...]


class InstructionList:
    """Instructions in single-assignment form; nothing reaches the program before `write`."""

    def __init__(self, core: ModuleType, name: str) -> None:
        self.program = core.MaterialProgram(name)
        self._ops = core.describe_ops()
        self._instructions: list[_Instruction] = []
        self._known: dict[_Instruction, Value] = {}
        self._closures: list[_Instruction] = []
        self._tables: dict[bytes, int] = {}

    def emit(self, op: str, inputs: Sequence[Value] = (), parameters: Sequence[int] = ()) -> Value:
        if op == "LUMINANCE" and known_space(versions.working_space()) != REC709_SPACE:  # whose weights the core has
            weights = constant(*luminance_weights(versions.working_space()), letter=VECTOR)
            color = self.convert(inputs[0], COLOR).retyped(VECTOR)
            return self.emit("VECTOR_MATH_VALUE", (color, weights), (VECTOR_MATH_VALUES.index("DOT_PRODUCT"),))
        letters, output, _, _ = self._ops[op]
        arguments = self._converted(op, inputs, letters)
        parameters = tuple(int(parameter) for parameter in parameters)
        known = _fold(op, arguments, parameters) or _simplify(op, arguments, parameters)
        if known is not None:
            return known.retyped(output)
        instruction = _Instruction(op, arguments, parameters)
        if instruction not in self._known:
            self._known[instruction] = Value(output, None, len(self._instructions))
            self._instructions.append(instruction)
        return self._known[instruction]

    def closure(self, op: str, inputs: Sequence[Value], parameters: Sequence[int] = ()) -> None:
        """Append a closure; one of constant weight 0 is left out."""
        if inputs[0].constant is not None and inputs[0].constant[0] == 0.0:
            return
        arguments = self._converted(op, inputs, self._ops[op][0])
        self._closures.append(_Instruction(op, arguments, tuple(parameters)))

    def convert(self, value: Value, letter: str) -> Value:
        """Blender's implicit conversion: grey, luminance of a colour, mean of a vector."""
        if value.type == letter:
            return value
        if letter == FLOAT:
            return self.emit("LUMINANCE" if value.type == COLOR else "AVERAGE", [value])
        if value.type == FLOAT:
            return self.emit("BROADCAST", [value]).retyped(letter)
        return value.retyped(letter)

    def table(self, values: np.ndarray, alpha: np.ndarray | None = None) -> int:
        values = np.nan_to_num(values)
        key = values.tobytes() + (b"" if alpha is None else alpha.tobytes())
        if key not in self._tables:
            self._tables[key] = self.program.table(values, alpha)
        return self._tables[key]

    def _converted(self, op: str, inputs: Sequence[Value], letters: str) -> tuple[Value, ...]:
        if len(inputs) != len(letters):
            raise ValueError(f"{op} takes {len(letters)} inputs, not {len(inputs)}")
        return tuple(self.convert(value, letter) for value, letter in zip(inputs, letters, strict=True))

    def needed(self) -> list[int]:
        """Indices of the instructions some closure depends on, in order."""
        reached: set[int] = set()
        pending = [value.register for closure in self._closures for value in closure.inputs]
        while pending:
            index = pending.pop()
            if index >= 0 and index not in reached:
                reached.add(index)
                pending += [value.register for value in self._instructions[index].inputs]
        return sorted(reached)

    def registers(self) -> dict[int, int]:
        """Of the instructions in `needed`: each takes the lowest that holds nothing that is still to be read."""
        needed = self.needed()
        readers = [value.register for closure in self._closures for value in closure.inputs]
        last_reader = dict.fromkeys(readers, len(self._instructions))  # closures come after all
        for index in reversed(needed):
            for value in self._instructions[index].inputs:
                last_reader.setdefault(value.register, index)
        placed: dict[int, int] = {}
        free: list[int] = []
        used = 0
        for index in needed:
            inputs = {value.register for value in self._instructions[index].inputs} - {-1}
            for source in inputs:
                if last_reader[source] == index:
                    heapq.heappush(free, placed[source])
            if not free:
                free.append(used)
                used += 1
            placed[index] = heapq.heappop(free)
        return placed

    @property
    def closures(self) -> list[tuple[str, tuple[Value, ...], tuple[int, ...]]]:
        return [(closure.op, closure.inputs, closure.parameters) for closure in self._closures]

    def write(self) -> MaterialProgram:
        registers = self.registers()
        constants: dict[Triple, int] = {}

        def operand(value: Value) -> int:
            if value.constant is None:
                return registers[value.register]
            if value.constant not in constants:
                constants[value.constant] = self.program.constant(*value.constant)
            return constants[value.constant]

        for index, register in registers.items():
            instruction = self._instructions[index]
            inputs = [operand(value) for value in instruction.inputs]
            self.program.emit(instruction.op, inputs, list(instruction.parameters), register)
        for closure in self._closures:
            self.program.closure(closure.op, [operand(value) for value in closure.inputs], list(closure.parameters))
        return self.program


def _fold(op: str, inputs: tuple[Value, ...], parameters: tuple[int, ...]) -> Value | None:
    if op not in FOLDERS or any(value.constant is None for value in inputs):
        return None
    try:
        result = FOLDERS[op]([value.constant for value in inputs], parameters)
    except (OverflowError, ZeroDivisionError, ValueError):
        return None
    if result is None or not all(abs(value) <= LARGEST_FLOAT for value in result):
        return None  # what is not finite may still vanish in the core, as 1 / infinity does
    return constant(*result)


def _is(value: Value, *numbers: float) -> bool:
    return value.constant is not None and value.constant[: len(numbers)] == numbers


def _simplify(op: str, inputs: tuple[Value, ...], parameters: tuple[int, ...]) -> Value | None:
    """The operand an instruction merely hands on (x + 0, x * 1, x * 0, mix by 0 or 1, gamma 1), or None."""
    if op == "MATH" and not parameters[1]:
        return _simplify_math(parameters[0], inputs[0], inputs[1])
    if op == "MIX_FLOAT" or (op == "MIX_COLOR" and parameters[0] == 0 and not parameters[2]):
        return inputs[1] if _is(inputs[0], 0.0) else inputs[2] if _is(inputs[0], 1.0) else None
    if op == "MIX_VECTOR":
        return inputs[1] if _is(inputs[0], 0.0, 0.0, 0.0) else inputs[2] if _is(inputs[0], 1.0, 1.0, 1.0) else None
    if op == "GAMMA":
        return inputs[0] if _is(inputs[1], 1.0) else None
    if op == "INVERT":
        return inputs[1] if _is(inputs[0], 0.0) else None
    if op == "MAPPING" and parameters[0] != 3:  # a NORMAL mapping normalises even when it is the identity
        neutral = [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)]
        return inputs[0] if [value.constant for value in inputs[1:]] == neutral else None
    return None


def _simplify_math(operation: int, a: Value, b: Value) -> Value | None:
    if operation == 0:  # ADD
        return b if _is(a, 0.0) else a if _is(b, 0.0) else None
    if operation == 2:  # MULTIPLY
        if _is(a, 0.0) or _is(b, 0.0):
            return constant(0.0)
        return b if _is(a, 1.0) else a if _is(b, 1.0) else None
    return a if operation in (1, 3) and _is(b, 1.0 if operation == 3 else 0.0) else None  # SUBTRACT, DIVIDE
