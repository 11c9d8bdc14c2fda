"""A Python stand-in for the material-program part of the core, for testing the node compiler without a build.

It reads the operations from native/scene/op_table.cpp and rejects what the core rejects: unknown operations, wrong
counts, operands of the wrong type, parameters that point nowhere.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

OP_TABLE = Path(__file__).parents[2] / "native" / "scene" / "op_table.cpp"
ENTRY = re.compile(r'\{"(\w+)", "([fcv]*)", (?:\'([fcv])\'|0), (\d), (true|false)\}')
CONSTANT_BIT = 0x8000
MAX_REGISTERS = 256
SAME_REGISTER = {"f": "f", "c": "v", "v": "v"}  # colours and vectors are interchangeable


class Error(RuntimeError):
    pass


@cache
def describe_ops() -> dict[str, tuple[str, str, int, bool]]:
    entries = ENTRY.findall(OP_TABLE.read_text())
    return {name: (inputs, output, int(count), closure == "true") for name, inputs, output, count, closure in entries}


@dataclass
class Instruction:
    op: str
    inputs: list[Any]  # a tuple of three numbers for a constant, else the Instruction read
    parameters: list[int]


@dataclass
class MaterialProgram:
    name: str
    constants: list[tuple[float, float, float]] = field(default_factory=list)
    instructions: list[Instruction] = field(default_factory=list)
    registers: dict[int, Instruction] = field(default_factory=dict)
    """What each was written by last."""
    closures: list[Instruction] = field(default_factory=list)
    attributes: list[str] = field(default_factory=list)
    tables: list[np.ndarray] = field(default_factory=list)
    images: list[int] = field(default_factory=list)
    tile_tables: list[tuple[int, ...]] = field(default_factory=list)
    is_boundary: bool = False

    def constant(self, x: float, y: float = 0.0, z: float = 0.0) -> int:
        if not np.isfinite([x, y, z]).all():
            raise Error(f"{self.name}: constant is not finite")
        self.constants.append((x, y, z))
        return CONSTANT_BIT | (len(self.constants) - 1)

    def emit(
        self, op: str, inputs: Sequence[int] = (), parameters: Sequence[int] = (), output: int | None = None
    ) -> int:
        output = len(self.registers) if output is None else output
        if output >= MAX_REGISTERS:
            raise Error(f"{self.name}: register {output}")
        self.instructions.append(self._checked(op, inputs, parameters, is_closure=False))
        self.registers[output] = self.instructions[-1]
        return output

    def closure(self, op: str, inputs: Sequence[int], parameters: Sequence[int] = ()) -> None:
        self.closures.append(self._checked(op, inputs, parameters, is_closure=True))

    def attribute(self, name: str) -> int:
        if name not in self.attributes:
            self.attributes.append(name)
        return self.attributes.index(name)

    def table(self, values: np.ndarray, alpha: np.ndarray | None = None) -> int:
        for array, shape in ((values, (257, 3)), (alpha, (257,))):
            if array is not None and (
                array.shape != shape or array.dtype != np.float32 or not array.flags.c_contiguous
            ):
                raise Error(f"{self.name}: a table is float32 of shape {shape}")
        self.tables.append(values)
        return len(self.tables) - 1

    def image(self, handle: int) -> int:
        if handle < 0:
            raise Error(f"{self.name}: image handle {handle}")
        self.images.append(handle)
        return len(self.images) - 1

    def tiles(self, images: Sequence[int]) -> int:
        if any(not -1 <= image < len(self.images) for image in images):
            raise Error(f"{self.name}: tiles {images}")
        self.tile_tables.append(tuple(images))
        return len(self.tile_tables) - 1

    def _checked(self, op: str, inputs: Sequence[int], parameters: Sequence[int], is_closure: bool) -> Instruction:
        ops = describe_ops()
        if op not in ops:
            raise Error(f"{self.name}: unknown operation {op}")
        letters, _, parameter_count, closure = ops[op]
        if len(letters) != len(inputs) or parameter_count != len(parameters) or closure != is_closure:
            raise Error(f"{self.name}: {op} given {len(inputs)} inputs and {len(parameters)} parameters")
        arguments = [self._operand(op, code, letter) for code, letter in zip(inputs, letters, strict=True)]
        self._check_parameters(op, parameters)
        return Instruction(op, arguments, list(parameters))

    def _operand(self, op: str, code: int, letter: str) -> Any:
        if code & CONSTANT_BIT:
            return self.constants[code & ~CONSTANT_BIT]
        source = self.registers[code]
        output = describe_ops()[source.op][1]
        if SAME_REGISTER[output] != SAME_REGISTER[letter]:
            raise Error(f"{self.name}: {op} reads {output} of {source.op} as {letter}")
        return source

    def _check_parameters(self, op: str, parameters: Sequence[int]) -> None:
        if any(type(parameter) is not int or parameter < 0 for parameter in parameters):
            raise Error(f"{self.name}: {op} has parameters {parameters}")
        limits = {"RAMP_LOOKUP": self.tables, "RAMP_LOOKUP_ALPHA": self.tables, "CURVE_LOOKUP": self.tables}
        limits |= {"IMAGE": self.images, "IMAGE_ALPHA": self.images, "ENVIRONMENT_IMAGE": self.images}
        limits |= {"TILED_IMAGE": self.tile_tables, "TILED_IMAGE_ALPHA": self.tile_tables}
        of_attributes = ("ATTRIBUTE", "ATTRIBUTE_FACTOR", "ATTRIBUTE_ALPHA", "TANGENT")
        limits |= dict.fromkeys(of_attributes, self.attributes)
        if op in limits and parameters[0] >= len(limits[op]):
            raise Error(f"{self.name}: {op} points at {parameters[0]} of {len(limits[op])}")
