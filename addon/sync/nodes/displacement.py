"""Displacement of surfaces: as bump, by moved vertices, or both."""

from __future__ import annotations

from .. import versions
from .compiler import Compiler, NodeView, value_node
from .enums import NORMAL_MAP_SPACES, SPACES, TRANSFORM_KINDS, VECTOR_MATH_VALUES
from .graph import Port, socket_named
from .instructions import COLOR, VECTOR, Value, constant
from .vector import bump_shift

_OBJECT, _WORLD = SPACES.index("OBJECT"), SPACES.index("WORLD")
_DOT_PRODUCT = VECTOR_MATH_VALUES.index("DOT_PRODUCT")


@value_node("ShaderNodeDisplacement")
def displacement(node: NodeView, output: str) -> Value:
    """World-space vector along the normal; in object space the distance grows with the object's scale."""
    height = node.math("SUBTRACT", node.value("Height"), node.value("Midlevel"))
    distance = node.math("MULTIPLY", height, node.value("Scale"))
    return _along(node, node.given_normal(), distance, node.node.space == "OBJECT")


@value_node("ShaderNodeVectorDisplacement")
def vector_displacement(node: NodeView, output: str) -> Value:
    """Of a vector in tangent space, bumps take only the part along the normal: the others do not change the height."""
    middle = node.emit("BROADCAST", (node.value("Midlevel"),)).retyped(VECTOR)
    scale = node.emit("BROADCAST", (node.value("Scale"),)).retyped(VECTOR)
    vector = node.vector_math("MULTIPLY", node.vector_math("SUBTRACT", node.value("Vector"), middle), scale)
    if node.node.space == "TANGENT":
        if node.compiler.moves_vertices:
            return _in_tangent_frame(node, vector)
        return _along(node, node.shading_normal(), node.emit("SEPARATE_Y", (vector,)), is_in_object=True)
    return _object_to_world(node, vector) if node.node.space == "OBJECT" else vector


def _along(node: NodeView, normal: Value, distance: Value, is_in_object: bool) -> Value:
    """The direction does not depend on the bump shift: it is computed once for all heights."""
    if is_in_object:
        in_object = node.emit("VECTOR_TRANSFORM", (normal,), (TRANSFORM_KINDS.index("NORMAL"), _WORLD, _OBJECT))
        normal = _object_to_world(node, in_object)
    return node.vector_math("MULTIPLY", normal, node.emit("BROADCAST", (distance,)).retyped(VECTOR))


def _in_tangent_frame(node: NodeView, vector: Value) -> Value:
    """Along the UV map's tangent, the normal and the UV map's bitangent, each of unit length in object space."""
    uv_map = node.compiler.code.program.attribute("")
    normal = node.shading_normal()
    total = _along(node, normal, node.emit("SEPARATE_Y", (vector,)), is_in_object=True)
    for axis, color in (("SEPARATE_X", (1.0, 0.5, 0.5)), ("SEPARATE_Z", (0.5, 1.0, 0.5))):
        inputs = (constant(*color, COLOR), constant(1.0), normal)
        direction = node.emit("NORMAL_MAP", inputs, (NORMAL_MAP_SPACES["TANGENT"], uv_map, 0, 1))
        part = _along(node, direction, node.emit(axis, (vector,)), is_in_object=True)
        total = node.vector_math("ADD", total, part)
    return total


def _object_to_world(node: NodeView, vector: Value) -> Value:
    return node.emit("VECTOR_TRANSFORM", (vector,), (TRANSFORM_KINDS.index("VECTOR"), _OBJECT, _WORLD))


def displace(compiler: Compiler, output: Port, method: str) -> None:
    """What the Displacement of a material does by its `method`, before anything reads the normal that it may bend."""
    socket = socket_named(output.node.inputs, "Displacement")
    if socket is None or output.scope.link_into(output.node, socket) is None:
        return
    displacement = Port(output.scope, output.node, socket)
    if method != "BUMP":
        _move_vertices(compiler, displacement, keeps_normals=method == "BOTH")
    if method != "DISPLACEMENT" and compiler.allow_bump:
        _bend_normal(compiler, displacement, is_moved=method == "BOTH")


def _move_vertices(compiler: Compiler, displacement: Port, keeps_normals: bool) -> None:
    compiler.moves_vertices = True
    vector = compiler.input(displacement)
    compiler.moves_vertices = False
    compiler.forget_values()
    if vector is not None:
        compiler.code.closure("CLOSURE_DISPLACEMENT", (constant(1.0), vector), (int(keeps_normals),))


def _bend_normal(compiler: Compiler, displacement: Port, is_moved: bool) -> None:
    """Bends the shading normal of the whole surface as a Bump node of strength 1 does whose height is the displacement
    along the normal. Of a surface that `is_moved` too, heights and normal are those before it was."""
    code, width = compiler.code, versions.bump_filter_width()
    normal = code.emit("NORMAL")
    heights = []
    for step in (0, 1, 2):
        with compiler.shifted(bump_shift(step, width)):
            vector = compiler.input(displacement)
        if vector is None:
            return
        heights.append(code.emit("VECTOR_MATH_VALUE", (vector, normal), (_DOT_PRODUCT,)))
    compiler.forget_values()
    if is_moved:
        code.closure("CLOSURE_DISPLACED_BUMP", (constant(1.0), *heights), (bump_shift(0, width),))
        return  # the surface's own normal is then the bent one
    if heights[0] == heights[1] == heights[2]:
        return
    inputs = (*heights, constant(1.0), constant(1.0), normal)
    compiler.normal = code.emit("BUMP", inputs, (0, bump_shift(0, width)))
    code.closure("CLOSURE_NORMAL", (constant(1.0), compiler.normal))
