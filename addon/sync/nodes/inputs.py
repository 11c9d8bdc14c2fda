"""Input nodes: coordinates, geometry, attributes, object, light path and plain values."""

from __future__ import annotations

import bpy

from . import value_names
from .compiler import NodeView, TreeKind, default_of, value_node
from .enums import LIGHT_PATH_OUTPUTS, SPACES, TRANSFORM_KINDS, VECTOR_MATH_VALUES
from .graph import socket_named
from .instructions import COLOR, VECTOR, Value, constant
from .vector import NORMAL_TRANSFORM, default_tangent, separate, vector_constant

_PARTICLE_VECTORS = {"Location", "Velocity", "Angular Velocity"}
_POWERS_OF_DISTANCE = {"Quadratic": 0, "Linear": 1, "Constant": 2}
DOT_PRODUCT, _LENGTH = VECTOR_MATH_VALUES.index("DOT_PRODUCT"), VECTOR_MATH_VALUES.index("LENGTH")
_FARTHEST = 1e30  # metres; what is beyond is a sun or a world
_DIAGONAL = (3.0**-0.5,) * 3


@value_node("ShaderNodeRGB", "ShaderNodeValue")
def plain_value(node: NodeView, output: str) -> Value:
    return default_of(socket_named(node.node.outputs, output))


@value_node("FunctionNodeInputVector")
def input_vector(node: NodeView, output: str) -> Value:
    """From Blender 5.2 on, which also makes such nodes of what is the same everywhere where it resolves trees."""
    x, y, z, *_ = (*node.node.vector, 0.0)  # of two to four dimensions
    return vector_constant(x, y, z)


@value_node("FunctionNodeInputInt", "FunctionNodeInputBool")
def input_number(node: NodeView, output: str) -> Value:
    return constant(float(node.node.integer if hasattr(node.node, "integer") else node.node.boolean))


def uv_coordinate(node: NodeView, uv_map: str = "") -> Value:
    """(u, v, 0) of the named map, "" is the first; 0 where there is no map."""
    kind = node.compiler.kind
    if kind is TreeKind.LAMP:
        node.warn("only area lamps have UV coordinates: they read 0")
    if kind in (TreeKind.LAMP, TreeKind.WORLD):
        return vector_constant(0.0, 0.0, 0.0)
    return node.at_shift("ATTRIBUTE", (node.compiler.code.program.attribute(uv_map),))


def position(node: NodeView) -> Value:
    """World position of the hit; in the world's own tree the direction of view, as Cycles has it."""
    return node.at_shift("GENERATED" if node.compiler.is_world else "POSITION")


@value_node("ShaderNodeTexCoord")
def texture_coordinate(node: NodeView, output: str) -> Value | None:
    if node.node.from_instancer and output in value_names.EMITTER_COORDINATES:
        return _emitter_coordinate(node, output)
    if output == "UV":
        return uv_coordinate(node)
    if output == "Object":
        return _object_coordinate(node, node.node.object)
    ops = {
        "Generated": "GENERATED",
        "Normal": "NORMAL_COORDINATE",
        "Camera": "CAMERA_COORDINATE",
        "Window": "WINDOW_COORDINATE",
        "Reflection": "REFLECTION_COORDINATE",
    }
    if node.compiler.normal is not None and output in ("Normal", "Reflection"):
        return _of_bent_normal(node, output)
    return node.at_shift(ops[output]) if output in ops else None


def _of_bent_normal(node: NodeView, output: str) -> Value:
    normal = node.shading_normal()
    if output == "Normal":
        return node.emit(
            "VECTOR_TRANSFORM", (normal,), (NORMAL_TRANSFORM, SPACES.index("WORLD"), SPACES.index("OBJECT"))
        )
    from_eye = node.vector_math("MULTIPLY", node.emit("INCOMING"), vector_constant(-1.0, -1.0, -1.0))
    return node.vector_math("REFLECT", from_eye, normal)


def _object_coordinate(node: NodeView, other: bpy.types.Object | None) -> Value:
    if other is None:
        return position(node) if node.compiler.is_world else node.at_shift("OBJECT_COORDINATE")
    matrix = other.matrix_world.inverted_safe()
    at = position(node)
    rows = [node.emit("VECTOR_MATH_VALUE", (at, vector_constant(*row[:3])), (DOT_PRODUCT,)) for row in matrix[:3]]
    return node.vector_math("ADD", node.emit("COMBINE_XYZ", rows), vector_constant(*(row[3] for row in matrix[:3])))


def _emitter_coordinate(node: NodeView, output: str) -> Value:
    """The same all over an instance; 0 on what is none."""
    if not node.compiler.is_surface:
        return vector_constant(0.0, 0.0, 0.0)
    name = value_names.attribute_value_name(value_names.EMITTER, output)
    return node.emit("INSTANCE_VALUE", (), (node.compiler.code.program.attribute(name),))


@value_node("ShaderNodeUVMap")
def uv_map(node: NodeView, output: str) -> Value:
    if node.node.from_instancer:
        return _emitter_coordinate(node, "UV")
    return uv_coordinate(node, node.node.uv_map)


@value_node("ShaderNodeNewGeometry")
def geometry(node: NodeView, output: str) -> Value | None:
    if output == "Position":
        return position(node)
    if output == "Tangent":
        return default_tangent(node) if node.compiler.is_surface else vector_constant(0.0, 0.0, 0.0)
    if output in value_names.GEOMETRY_OUTPUTS and node.compiler.is_surface:
        return mesh_attribute(node, value_names.GEOMETRY_OUTPUTS[output], "Fac", missing_alpha=0)
    if output == "Normal":
        return node.shading_normal()
    ops = {"True Normal": "TRUE_NORMAL", "Incoming": "INCOMING", "Backfacing": "BACKFACING"}
    return node.emit(ops[output]) if output in ops else None


@value_node("ShaderNodeHairInfo")
def hair_info(node: NodeView, output: str) -> Value | None:
    """0 on what is no hair."""
    if output not in value_names.STRAND_OUTPUTS:
        return None
    if not node.compiler.is_surface:
        return constant(0.0)
    value = mesh_attribute(node, value_names.STRAND_OUTPUTS[output], "Fac", missing_alpha=0)
    return _scaled_width(node, value) if output == "Thickness" else value


def _scaled_width(node: NodeView, width: Value) -> Value:
    """Of a strand or point in world space; of unevenly scaled objects it is that of the diagonal."""
    diagonal = node.vector_math("MULTIPLY", width, vector_constant(*_DIAGONAL))
    spaces = (SPACES.index("OBJECT"), SPACES.index("WORLD"))
    return _length(node, node.emit("VECTOR_TRANSFORM", (diagonal,), (TRANSFORM_KINDS.index("VECTOR"), *spaces)))


def _length(node: NodeView, vector: Value) -> Value:
    return node.emit("VECTOR_MATH_VALUE", (vector, constant(0.0, letter=VECTOR)), (_LENGTH,))


@value_node("ShaderNodePointInfo")
def point_info(node: NodeView, output: str) -> Value:
    """0 on what is no point."""
    is_vector = output == "Position"
    if not node.compiler.is_surface:
        return vector_constant(0.0, 0.0, 0.0) if is_vector else constant(0.0)
    value = mesh_attribute(node, value_names.POINT_OUTPUTS[output], "Vector" if is_vector else "Fac", missing_alpha=0)
    if not is_vector:
        return _scaled_width(node, value) if output == "Radius" else value
    spaces = (SPACES.index("OBJECT"), SPACES.index("WORLD"))
    moved = node.emit("VECTOR_TRANSFORM", (value,), (TRANSFORM_KINDS.index("POINT"), *spaces))
    is_point = mesh_attribute(node, value_names.POINT_OUTPUTS[output], "Alpha", missing_alpha=0)
    return node.vector_math("MULTIPLY", moved, node.emit("BROADCAST", (is_point,)).retyped(VECTOR))


@value_node("ShaderNodeParticleInfo")
def particle_info(node: NodeView, output: str) -> Value:
    if not node.compiler.is_surface:
        return constant(value_names.NO_PARTICLE.get(output, 0.0))
    name = value_names.attribute_value_name(value_names.PARTICLE, output)
    value = node.emit("INSTANCE_VALUE", (), (node.compiler.code.program.attribute(name),))
    return value if output in _PARTICLE_VECTORS else separate(node, value, 0)


@value_node("ShaderNodeObjectInfo")
def object_info(node: NodeView, output: str) -> Value | None:
    if output == "Random" and node.compiler.is_lamp:
        node.compiler.unsupported(node.node, output)
    if output in ("Location", "Random"):
        return node.emit("OBJECT_LOCATION" if output == "Location" else "OBJECT_RANDOM")
    if output == "Material Index":
        return constant(node.compiler.pass_index)
    if node.compiler.is_surface:
        return _instance_value(node, value_names.INFO_OUTPUTS[output], output)
    if node.compiler.is_world:
        return constant(0.0)
    defaults = {"Color": constant(1.0, 1.0, 1.0, COLOR), "Alpha": constant(1.0)}  # of a new object; indices are 0
    node.compiler.unsupported(node.node, output)
    return defaults.get(output, constant(0.0))


@value_node("ShaderNodeLightPath")
def light_path(node: NodeView, output: str) -> Value:
    return node.emit("LIGHT_PATH", (), (LIGHT_PATH_OUTPUTS[output],))


@value_node("ShaderNodeAttribute")
def attribute(node: NodeView, output: str) -> Value:
    name, kind = node.node.attribute_name, node.node.attribute_type
    if kind == value_names.VIEW_LAYER:
        return _layer_value(node, name, output)
    if not node.compiler.is_surface:
        if kind != "GEOMETRY":
            node.warn(f"attribute '{name}' of type {kind} is not supported: it reads 0")
        return constant(1.0 if output == "Alpha" else 0.0)
    if kind == value_names.INSTANCER and not hasattr(bpy.types.Object, "evaluated_geometry"):
        node.warn(f"attribute '{name}': what geometry nodes give to instances is read from Blender 5.0 on")
    if kind in (value_names.OBJECT, value_names.INSTANCER):
        return _instance_value(node, value_names.attribute_value_name(kind, name), output)
    if not name:
        return constant(1.0 if output == "Alpha" else 0.0)
    return mesh_attribute(node, name, output, missing_alpha=1)


def _instance_value(node: NodeView, name: str, output: str) -> Value:
    index = node.compiler.code.program.attribute(name)
    if output == "Alpha":
        return node.emit("INSTANCE_VALUE_ALPHA", (), (index,))
    value = node.emit("INSTANCE_VALUE", (), (index,))
    if output == "Object Index":
        return separate(node, value, 0)
    return node.emit("AVERAGE", (value,)) if output == "Fac" else value


def _layer_value(node: NodeView, name: str, output: str) -> Value:
    *rgb, alpha = node.compiler.context.layer_value(name)
    if output == "Alpha":
        return constant(alpha)
    return constant(sum(rgb) / 3.0) if output == "Fac" else vector_constant(*rgb)


@value_node("ShaderNodeVolumeInfo")
def volume_info(node: NodeView, output: str) -> Value | None:
    """Grids of volume objects; 0 of what is none."""
    name = value_names.VOLUME_OUTPUTS.get(output)
    if name is None:
        return None
    if not node.compiler.is_surface:
        return constant(0.0)
    return mesh_attribute(node, name, "Color" if output == "Color" else "Fac", missing_alpha=0)


@value_node("ShaderNodeVertexColor")
def color_attribute(node: NodeView, output: str) -> Value:
    return mesh_attribute(node, node.node.layer_name or value_names.RENDER_COLOR, output, missing_alpha=0)


def mesh_attribute(node: NodeView, name: str, output: str, missing_alpha: int) -> Value:
    """`missing_alpha` is that of a mesh without the attribute; its colour is black. Of volume objects: a grid."""
    if node.compiler.grids is not None:
        node.compiler.grids.add(name)
    index = node.compiler.code.program.attribute(name)
    if output == "Alpha":
        return node.at_shift("ATTRIBUTE_ALPHA", (index, missing_alpha))
    return node.at_shift("ATTRIBUTE_FACTOR" if output == "Fac" else "ATTRIBUTE", (index,))


@value_node("ShaderNodeCameraData")
def camera_data(node: NodeView, output: str) -> Value | None:
    """Below bumps as well, heights of which it therefore is none: Cycles has it where the surface is."""
    at = _direction_in_camera(node) if node.compiler.is_world else node.emit("CAMERA_COORDINATE", (), (0,))
    if output == "View Vector":
        return node.vector_math("NORMALIZE", at)
    if output == "View Z Depth":
        return separate(node, at, 2)
    return _length(node, at)


def _direction_in_camera(node: NodeView) -> Value:
    """Worlds take the direction for a place, as Cycles does."""
    spaces = (SPACES.index("WORLD"), SPACES.index("CAMERA"))
    return node.emit("VECTOR_TRANSFORM", (position(node),), (TRANSFORM_KINDS.index("POINT"), *spaces))


@value_node("ShaderNodeFresnel")
def fresnel(node: NodeView, output: str) -> Value:
    return node.emit("FRESNEL", (node.value("IOR"), node.given_normal()))


@value_node("ShaderNodeLayerWeight")
def layer_weight(node: NodeView, output: str) -> Value:
    op = "LAYER_WEIGHT_FRESNEL" if output == "Fresnel" else "LAYER_WEIGHT_FACING"
    return node.emit(op, (node.value("Blend"), node.given_normal()))


@value_node("ShaderNodeWireframe")
def wireframe(node: NodeView, output: str) -> Value:
    return node.emit("WIREFRAME", (node.value("Size"),), (int(node.node.use_pixel_size), node.compiler.shift))


@value_node("ShaderNodeLightFalloff")
def light_falloff(node: NodeView, output: str) -> Value:
    """svm_node_light_falloff of Cycles, with 1 / (1 + s / d^2) in place of d^2 / (s + d^2): suns are 1e38 m away."""
    strength, smooth = node.value("Strength"), node.value("Smooth")
    length = node.emit("LIGHT_PATH", (), (LIGHT_PATH_OUTPUTS["Ray Length"],))
    if _POWERS_OF_DISTANCE[output] > 0:
        is_near = node.math("LESS_THAN", length, constant(_FARTHEST))
        factor = node.math("POWER", length, is_near)  # 1 for what is endlessly far
        for _ in range(_POWERS_OF_DISTANCE[output]):
            strength = node.math("MULTIPLY", strength, factor)
    if smooth.constant is not None and smooth.constant[0] <= 0.0:
        return strength
    part = node.math("DIVIDE", node.math("MAXIMUM", smooth, constant(0.0)), node.math("MULTIPLY", length, length))
    return node.math("DIVIDE", strength, node.math("ADD", constant(1.0), part))


@value_node("GeometryNodeInputSceneTime")
def scene_time(node: NodeView, output: str) -> Value:
    scene = node.compiler.context.layer_value
    frame, rate, base = (scene(name)[0] for name in ("frame_current_final", "render.fps", "render.fps_base"))
    return constant(frame if output == "Frame" else frame * base / rate)
