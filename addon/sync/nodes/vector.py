"""Vector nodes: mapping, normals, bump, rotations and frames."""

from __future__ import annotations

from .compiler import NodeView, value_node
from .enums import (
    MAPPING_TYPES,
    NORMAL_MAP_SPACES,
    ROTATION_TYPES,
    SPACES,
    TRANSFORM_KINDS,
    VECTOR_MATH_OPERATIONS,
    VECTOR_MATH_VALUES,
)
from .fold import normalize
from .instructions import COLOR, FLOAT, VECTOR, Value, constant

NORMAL_TRANSFORM = TRANSFORM_KINDS.index("NORMAL")


def vector_constant(x: float, y: float, z: float) -> Value:
    return constant(x, y, z, VECTOR)


@value_node("ShaderNodeMapping")
def mapping(node: NodeView, output: str) -> Value:
    kind = node.choice("vector_type", MAPPING_TYPES)
    location = node.value("Location", vector_constant(0.0, 0.0, 0.0))  # absent for VECTOR and NORMAL in some versions
    inputs = (node.value("Vector"), location, *node.values("Rotation, Scale"))
    return node.emit("MAPPING", inputs, (kind,))


@value_node("ShaderNodeNormalMap")
def normal_map(node: NodeView, output: str) -> Value:
    color = node.value("Color")
    if node.node.space.startswith("BLENDER_"):  # baked by Blender before 2.5: y and z point the other way
        flip = [constant(*xyz, COLOR) for xyz in ((1.0, -1.0, -1.0), (0.0, 1.0, 1.0))]
        color = node.vector_math("MULTIPLY_ADD", color, *flip).retyped(COLOR)
    space = node.choice("space", NORMAL_MAP_SPACES)
    uv_map = node.compiler.code.program.attribute(node.node.uv_map)
    directx = getattr(node.node, "convention", "OPENGL") == "DIRECTX"
    is_original = getattr(node.node, "base", "ORIGINAL") != "DISPLACED"  # a choice from Blender 5.1 on
    parameters = (space, uv_map, int(directx), int(is_original))
    return node.emit("NORMAL_MAP", (color, node.value("Strength"), node.shading_normal()), parameters)


@value_node("ShaderNodeBump")
def bump(node: NodeView, output: str) -> Value:
    normal = node.normal()
    compiler = node.compiler
    if not compiler.allow_bump or not compiler.is_surface:
        return normal
    heights: list[Value | None] = []
    width = _filter_width(node)
    for step in (0, 1, 2):
        with compiler.shifted(bump_shift(step, width)):
            heights.append(node.linked("Height"))
    if heights[0] is None or heights[0].constant is not None:
        return normal
    if heights[0] == heights[1] == heights[2]:
        return normal if normal == node.shading_normal() else node.vector_math("NORMALIZE", normal)
    inputs = (*heights, node.value("Strength"), node.value("Distance"), normal)
    return node.emit("BUMP", inputs, (int(node.node.invert), bump_shift(0, width)))


def _filter_width(node: NodeView) -> float:
    """Distance in pixels over which heights are compared: 1 before Blender had the socket. A link counts as none."""
    port = node.port("Filter Width")
    return 1.0 if port is None else port.socket.default_value


def bump_shift(step: int, filter_width: float) -> int:
    """The parameter that native/scene/material_program.h calls `shift`."""
    return step + 4 * round(1000.0 * min(max(filter_width, 0.001), 10.0))


@value_node("ShaderNodeBevel")
def bevel(node: NodeView, output: str) -> Value:
    given, shading = node.normal(), node.shading_normal()
    if not node.compiler.traces_rays:
        return given
    rounded = node.emit("BEVEL", (node.value("Radius"), shading), (node.node.samples,))
    if given == shading:
        return rounded
    bent = node.vector_math("ADD", given, node.vector_math("SUBTRACT", rounded, shading))  # keeps what bends the normal
    return node.vector_math("NORMALIZE", bent)


@value_node("ShaderNodeNormal")
def normal(node: NodeView, output: str) -> Value:
    direction = next(socket for socket in node.node.outputs if socket.identifier == "Normal").default_value
    fixed = vector_constant(*normalize(tuple(direction)))
    if output == "Normal":
        return fixed
    unit = node.vector_math("NORMALIZE", node.value("Normal"))
    return node.emit("VECTOR_MATH_VALUE", (fixed, unit), (VECTOR_MATH_VALUES.index("DOT_PRODUCT"),))


@value_node("ShaderNodeVectorMath")
def vector_math(node: NodeView, output: str) -> Value | None:
    operation = node.node.operation
    a, b, c, scale = node.values("Vector, Vector_001, Vector_002, Scale")
    if operation in VECTOR_MATH_VALUES:
        value = node.emit("VECTOR_MATH_VALUE", (a, b), (VECTOR_MATH_VALUES.index(operation),))
        return value if output == "Value" else node.emit("BROADCAST", (value,)).retyped(VECTOR)
    if operation == "ROUND":  # from Blender 5.2 on
        return node.vector_math("FLOOR", node.vector_math("ADD", a, vector_constant(0.5, 0.5, 0.5)))
    if operation not in VECTOR_MATH_OPERATIONS or output == "Value":
        return None
    return node.emit("VECTOR_MATH", (a, b, c, scale), (VECTOR_MATH_OPERATIONS.index(operation),))


@value_node("ShaderNodeVectorRotate")
def vector_rotate(node: NodeView, output: str) -> Value:
    kind = node.choice("rotation_type", ROTATION_TYPES)
    inputs = node.values("Vector, Center, Axis, Angle, Rotation")
    return node.emit("VECTOR_ROTATE", inputs, (kind, int(node.node.invert)))


@value_node("ShaderNodeVectorTransform")
def vector_transform(node: NodeView, output: str) -> Value:
    spaces = (node.choice("convert_from", SPACES), node.choice("convert_to", SPACES))
    vector = node.value("Vector")
    if spaces[0] == spaces[1]:
        return vector
    return node.emit("VECTOR_TRANSFORM", (vector,), (node.choice("vector_type", TRANSFORM_KINDS), *spaces))


@value_node("ShaderNodeTangent")
def tangent(node: NodeView, output: str) -> Value:
    if node.node.direction_type == "UV_MAP":
        name = node.compiler.code.program.attribute(node.node.uv_map)
        return _in_tangent_plane(node, node.emit("TANGENT", (), (name,)))
    return radial_tangent(node, node.node.axis)


def default_tangent(node: NodeView) -> Value:
    """What an unlinked Tangent reads: as Cycles, around the object's Z axis."""
    return radial_tangent(node, "Z")


def radial_tangent(node: NodeView, axis: str) -> Value:
    """Direction around an axis through the middle of the object's bounds."""
    generated = node.emit("GENERATED", (), (0,))
    centered = node.vector_math("SUBTRACT", generated, vector_constant(0.5, 0.5, 0.5))
    direction = {"X": (1.0, 0.0, 0.0), "Y": (0.0, -1.0, 0.0), "Z": (0.0, 0.0, 1.0)}[axis]
    around = node.vector_math("CROSS_PRODUCT", vector_constant(*direction), centered)
    world = node.emit("VECTOR_TRANSFORM", (around,), (NORMAL_TRANSFORM, SPACES.index("OBJECT"), SPACES.index("WORLD")))
    return _in_tangent_plane(node, world)


def _in_tangent_plane(node: NodeView, direction: Value) -> Value:
    shading_normal = node.shading_normal()
    side = node.vector_math("NORMALIZE", node.vector_math("CROSS_PRODUCT", direction, shading_normal))
    return node.vector_math("CROSS_PRODUCT", shading_normal, side)


@value_node("ShaderNodeCombineXYZ")
def combine_xyz(node: NodeView, output: str) -> Value:
    return node.emit("COMBINE_XYZ", node.values("X, Y, Z"))


@value_node("ShaderNodeSeparateXYZ")
def separate_xyz(node: NodeView, output: str) -> Value:
    return separate(node, node.value("Vector"), "XYZ".index(output))


def separate(node: NodeView, value: Value, channel: int) -> Value:
    """Component 0, 1 or 2; of a grey broadcast the number itself."""
    if value.type == FLOAT:
        return value
    return node.emit(("SEPARATE_X", "SEPARATE_Y", "SEPARATE_Z")[channel], (value,))
