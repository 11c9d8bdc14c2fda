"""The IES Texture node: a table of a luminaire, by direction."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import photometry
from .compiler import NodeView, value_node
from .enums import EXTENSIONS, INTERPOLATIONS, PROJECTIONS, SPACES, TRANSFORM_KINDS
from .instructions import Value, constant
from .vector import separate, vector_constant

BROKEN = 100.0  # watts to everywhere, glaring: as in Cycles


@value_node("ShaderNodeTexIES")
def ies_texture(node: NodeView, output: str) -> Value:
    strength = node.value("Strength")
    try:
        text = _text(node.node, node.scope.libraries)
        luminaire = photometry.parse(text)
    except (OSError, ValueError) as error:
        node.warn(f"the light profile of node '{node.name}' cannot be read, it is {BROKEN:g} everywhere: {error}")
        return node.math("MULTIPLY", strength, constant(BROKEN))
    key = ("ies", hashlib.sha256(text.encode()).digest())
    handle = node.compiler.context.table_handle(key, "light profile", lambda: _grey(luminaire.table()))
    index = node.compiler.code.program.image(handle)
    parameters = (index, INTERPOLATIONS["Linear"], EXTENSIONS.index("EXTEND"), PROJECTIONS.index("FLAT"))
    color = node.emit("IMAGE", (_place(node), vector_constant(0.0, 0.0, 0.0)), parameters)
    return node.math("MULTIPLY", strength, separate(node, color, 0))


def _text(node: bpy.types.Node, libraries: Sequence[bpy.types.Library | None]) -> str:
    """`libraries`: of the groups that the node may be from; the first that has the file."""
    if node.mode == "INTERNAL":
        if node.ies is None:
            raise ValueError("there is no text")
        return node.ies.as_string()
    paths = [Path(bpy.path.abspath(node.filepath, library=library)) for library in libraries]
    found = next((path for path in paths if path.is_file()), paths[0])
    return found.read_text(encoding="latin-1")


def _grey(table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Colours, the first row at the bottom."""
    return np.ascontiguousarray(np.repeat(table[:, :, None], 3, 2))


def _place(node: NodeView) -> Value:
    """Where in the table: around the axis to the right, from straight down upwards."""
    linked = node.linked("Vector")
    direction = node.vector_math("NORMALIZE", _to_receiver(node) if linked is None else linked)
    x, y, z = (separate(node, direction, axis) for axis in range(3))
    around = node.math("ADD", node.math("ARCTAN2", x, y), constant(math.pi))
    down = node.math("ARCCOSINE", node.math("MULTIPLY", z, constant(-1.0)))
    u = _texel(node, around, 2.0 * math.pi, photometry.COLUMNS)
    return node.emit("COMBINE_XYZ", (u, _texel(node, down, math.pi, photometry.ROWS), constant(0.0)))


def _to_receiver(node: NodeView) -> Value:
    """Where the light goes, as the luminaire is turned: as Normal of Texture Coordinate, which is another direction on
    an unevenly scaled one."""
    parameters = (TRANSFORM_KINDS.index("NORMAL"), SPACES.index("WORLD"), SPACES.index("OBJECT"))
    return node.emit("VECTOR_TRANSFORM", (node.emit("INCOMING"),), parameters)


def _texel(node: NodeView, angle: Value, range_of_angle: float, count: int) -> Value:
    """0 at the middle of the first texel, `range_of_angle` at that of the last."""
    scale = (count - 1.0) / (count * range_of_angle)
    return node.math("ADD", node.math("MULTIPLY", angle, constant(scale)), constant(0.5 / count))
