"""Displacement of surfaces, shown as bump: what Cycles calls Bump Only, and here stands in for moved vertices too."""

from __future__ import annotations

from .. import versions
from .compiler import Compiler, NodeView, value_node
from .enums import SPACES, TRANSFORM_KINDS, VECTOR_MATH_VALUES
from .graph import Port, socket_named
from .instructions import VECTOR, Value, constant
from .vector import bump_shift

_OBJECT, _WORLD = SPACES.index("OBJECT"), SPACES.index("WORLD")
_DOT_PRODUCT = VECTOR_MATH_VALUES.index("DOT_PRODUCT")


@value_node("ShaderNodeDisplacement")
def displacement(node: NodeView, output: str) -> Value:
    """World-space vector along the normal; in object space the distance grows with the object's scale."""
    height = node.math("SUBTRACT", node.value("Height"), node.value("Midlevel"))
    distance = node.math("MULTIPLY", height, node.value("Scale"))
    return _along(node, node.normal(), distance, node.node.space == "OBJECT")


@value_node("ShaderNodeVectorDisplacement")
def vector_displacement(node: NodeView, output: str) -> Value:
    """Of a vector in tangent space only the part along the normal: the others do not change the height of a bump."""
    middle = node.emit("BROADCAST", (node.value("Midlevel"),)).retyped(VECTOR)
    scale = node.emit("BROADCAST", (node.value("Scale"),)).retyped(VECTOR)
    vector = node.vector_math("MULTIPLY", node.vector_math("SUBTRACT", node.value("Vector"), middle), scale)
    if node.node.space == "TANGENT":
        return _along(node, node.shading_normal(), node.emit("SEPARATE_Y", (vector,)), is_in_object=True)
    return _object_to_world(node, vector) if node.node.space == "OBJECT" else vector


def _along(node: NodeView, normal: Value, distance: Value, is_in_object: bool) -> Value:
    """The direction does not depend on the bump shift: it is computed once for all heights."""
    if is_in_object:
        in_object = node.emit("VECTOR_TRANSFORM", (normal,), (TRANSFORM_KINDS.index("NORMAL"), _WORLD, _OBJECT))
        normal = _object_to_world(node, in_object)
    return node.vector_math("MULTIPLY", normal, node.emit("BROADCAST", (distance,)).retyped(VECTOR))


def _object_to_world(node: NodeView, vector: Value) -> Value:
    return node.emit("VECTOR_TRANSFORM", (vector,), (TRANSFORM_KINDS.index("VECTOR"), _OBJECT, _WORLD))


def bump_by_displacement(compiler: Compiler, output: Port, method: str) -> None:
    """Bends the shading normal of the whole surface, before anything reads it, as a Bump node of strength 1 does whose
    height is the displacement along the normal. `method` is the material's."""
    socket = socket_named(output.node.inputs, "Displacement")
    if socket is None or output.scope.link_into(output.node, socket) is None:
        return
    if method != "BUMP":
        compiler.warn("true displacement is not supported: it is shown as bump")
    if not compiler.allow_bump:
        return
    code, width = compiler.code, versions.bump_filter_width()
    normal = code.emit("NORMAL")
    heights = []
    for step in (0, 1, 2):
        with compiler.shifted(bump_shift(step, width)):
            vector = compiler.input(Port(output.scope, output.node, socket))
        if vector is None:
            return
        heights.append(code.emit("VECTOR_MATH_VALUE", (vector, normal), (_DOT_PRODUCT,)))
    compiler.forget_values()
    if heights[0] == heights[1] == heights[2]:
        return
    inputs = (*heights, constant(1.0), constant(1.0), normal)
    compiler.normal = code.emit("BUMP", inputs, (0, bump_shift(0, width)))
    code.closure("CLOSURE_NORMAL", (constant(1.0), compiler.normal))
