"""Texture nodes: images and procedural patterns."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ..versions import box_projections_end, has_old_voronoi_cells, wraps_scaled_magic
from . import enums
from .compiler import NodeView, value_node
from .inputs import position, uv_coordinate
from .instructions import COLOR, VECTOR, Value, constant
from .vector import separate, vector_constant

MISSING_IMAGE = (1.0, 0.0, 1.0)  # magenta, as everywhere in Blender
_LEAST_SCALE = 1e-5  # as in Cycles
UNCHANGED = [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)]  # translation, rotation, scale
AXES = {"X": 0, "Y": 1, "Z": 2}
COLOR_STAYS_MULTIPLIED = 1 << 16  # by alpha, as in Cycles where nothing reads the alpha; see native/scene/op_table.cpp


def _generated(node: NodeView) -> Value:
    return node.at_shift("GENERATED")


def texture_vector(node: NodeView, unlinked: Callable[[NodeView], Value] = _generated) -> Value:
    """The linked vector, else the texture's own coordinate, through the node's texture mapping panel."""
    vector = node.linked("Vector")
    vector = unlinked(node) if vector is None else vector
    mapping = getattr(node.node, "texture_mapping", None)
    return vector if mapping is None else _texture_mapping(node, vector, mapping)


def _texture_mapping(node: NodeView, vector: Value, mapping: bpy.types.TexMapping) -> Value:
    """Minimum and maximum are not read, and normals are only of unit length where something changes, as in Cycles."""
    axes = (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z)
    if axes != ("X", "Y", "Z"):
        vector = node.emit("COMBINE_XYZ", [_axis(node, vector, axis) for axis in axes])
    placement = [tuple(xyz) for xyz in (mapping.translation, mapping.rotation, mapping.scale)]
    if axes == ("X", "Y", "Z") and placement == UNCHANGED:
        return vector
    if mapping.vector_type in ("TEXTURE", "NORMAL"):  # which divide by it
        placement[2] = tuple(
            s if abs(s) > _LEAST_SCALE else _LEAST_SCALE * (-1.0 if s < 0.0 else 1.0) for s in placement[2]
        )
    parts = [vector_constant(*xyz) for xyz in placement]
    return node.emit("MAPPING", (vector, *parts), (enums.MAPPING_TYPES.index(mapping.vector_type),))


def _axis(node: NodeView, vector: Value, axis: str) -> Value:
    return constant(0.0) if axis == "NONE" else separate(node, vector, AXES[axis])


def _image_index(node: NodeView) -> int:
    """Index for the instruction's parameter, -1 when there is no image to read."""
    image = node.node.image
    if image is None:
        node.warn(f"node '{node.name}' has no image: it is magenta")
        return -1
    handle = node.compiler.context.image_handle(image, node.node.image_user)
    return -1 if handle < 0 else node.compiler.code.program.image(handle)


def _tile_indices(node: NodeView) -> list[int]:
    """Indices of the tiles from 1001 on, -1 for those that are not there."""
    program = node.compiler.code.program
    return [
        -1 if handle < 0 else program.image(handle) for handle in node.compiler.context.tile_handles(node.node.image)
    ]


@value_node("ShaderNodeTexImage")
def image_texture(node: NodeView, output: str) -> Value:
    tree_node = node.node
    is_tiled = tree_node.image is not None and tree_node.image.source == "TILED"
    is_box = tree_node.projection == "BOX"
    tiles = _tile_indices(node) if is_tiled else [_image_index(node)]
    if is_box:  # which has but the first tile
        tiles, is_tiled = tiles[:1], is_tiled and box_projections_end()
    if max(tiles) < 0:
        return constant(1.0) if output == "Alpha" else constant(*MISSING_IMAGE, COLOR)
    projection = node.choice("projection", enums.PROJECTIONS)
    if is_box:
        projection |= round(100.0 * tree_node.projection_blend) << 8
    if not tree_node.outputs["Alpha"].is_linked:
        projection |= COLOR_STAYS_MULTIPLIED
    parameters = (
        node.choice("interpolation", enums.INTERPOLATIONS),
        node.choice("extension", enums.EXTENSIONS),
        projection,
    )
    vector = texture_vector(node, uv_coordinate)
    suffix = "_ALPHA" if output == "Alpha" else ""
    normal = node.shading_normal() if is_box else vector_constant(0.0, 0.0, 0.0)
    if is_tiled:
        table = node.compiler.code.program.tiles(tiles)
        return node.emit(f"TILED_IMAGE{suffix}", (vector, normal), (table, *parameters))
    return node.emit(f"IMAGE{suffix}", (vector, normal), (tiles[0], *parameters))


@value_node("ShaderNodeTexEnvironment")
def environment_texture(node: NodeView, output: str) -> Value:
    index = _image_index(node)
    if index < 0:
        return constant(*MISSING_IMAGE, COLOR)
    projection = node.choice("projection", enums.ENVIRONMENT_PROJECTIONS)
    parameters = (index, node.choice("interpolation", enums.INTERPOLATIONS), projection)
    return node.emit("ENVIRONMENT_IMAGE", (texture_vector(node, position),), parameters)


@value_node("ShaderNodeTexChecker")
def checker(node: NodeView, output: str) -> Value:
    vector, scale = texture_vector(node), node.value("Scale")
    if output == "Fac":
        return node.emit("CHECKER_FACTOR", (vector, scale))
    return node.emit("CHECKER", (vector, *node.values("Color1, Color2"), scale))


@value_node("ShaderNodeTexGradient")
def gradient(node: NodeView, output: str) -> Value:
    kind = node.choice("gradient_type", enums.GRADIENT_TYPES)
    return node.emit("GRADIENT", (texture_vector(node),), (kind,))


@value_node("ShaderNodeTexNoise")
def noise(node: NodeView, output: str) -> Value:
    tree_node = node.node
    kind = node.choice("noise_type", enums.NOISE_TYPES)
    parameters = (node.choice("noise_dimensions", enums.DIMENSIONS), int(tree_node.normalize), kind)
    inputs = (texture_vector(node), *node.values("W, Scale, Detail, Roughness, Lacunarity, Offset, Gain, Distortion"))
    return node.emit("NOISE_COLOR" if output == "Color" else "NOISE", inputs, parameters)


@value_node("ShaderNodeTexVoronoi")
def voronoi(node: NodeView, output: str) -> Value | None:
    if output == "W":
        return None
    tree_node = node.node
    dimensions = node.choice("voronoi_dimensions", enums.DIMENSIONS)
    metric = node.choice("distance", enums.VORONOI_METRICS)
    feature = node.choice("feature", enums.VORONOI_FEATURES)
    names = "W, Scale, Detail, Roughness, Lacunarity, Smoothness, Exponent, Randomness"
    inputs = (texture_vector(node), *node.values(names))
    kind = output.upper() if output in ("Color", "Position") else "DISTANCE"
    bits = int(tree_node.normalize) + 2 * int(has_old_voronoi_cells())
    return node.emit(f"VORONOI_{kind}", inputs, (dimensions, metric, feature, bits))


@value_node("ShaderNodeTexWave")
def wave(node: NodeView, output: str) -> Value:
    tree_node = node.node
    direction = "bands_direction" if tree_node.wave_type == "BANDS" else "rings_direction"
    inputs = node.values("Scale, Distortion, Detail, Detail Scale, Detail Roughness, Phase Offset")
    profile = node.choice("wave_profile", enums.WAVE_PROFILES)
    parameters = (node.choice("wave_type", enums.WAVE_TYPES), node.choice(direction, enums.WAVE_DIRECTIONS), profile)
    return node.emit("WAVE", (texture_vector(node), *inputs), parameters)


@value_node("ShaderNodeTexWhiteNoise")
def white_noise(node: NodeView, output: str) -> Value:
    """Its unlinked vector is the socket's zero, not a coordinate."""
    op = "WHITE_NOISE_COLOR" if output == "Color" else "WHITE_NOISE"
    return node.emit(op, node.values("Vector, W"), (node.choice("noise_dimensions", enums.DIMENSIONS),))


@value_node("ShaderNodeTexBrick")
def brick(node: NodeView, output: str) -> Value:
    tree_node = node.node
    inputs = node.values("Color1, Color2, Mortar, Scale, Mortar Size, Mortar Smooth, Bias, Brick Width, Row Height")
    offset, squash = round(1000.0 * tree_node.offset), round(1000.0 * tree_node.squash)
    parameters = (offset, tree_node.offset_frequency, squash, tree_node.squash_frequency)
    return node.emit("BRICK_FACTOR" if output == "Fac" else "BRICK", (texture_vector(node), *inputs), parameters)


@value_node("ShaderNodeTexMagic")
def magic(node: NodeView, output: str) -> Value:
    parameters = (node.node.turbulence_depth, int(wraps_scaled_magic()))
    color = node.emit("MAGIC", (texture_vector(node), *node.values("Scale, Distortion")), parameters)
    return node.emit("AVERAGE", (color.retyped(VECTOR),)) if output == "Fac" else color


@value_node("ShaderNodeTexGabor")
def gabor(node: NodeView, output: str) -> Value:
    inputs = (texture_vector(node), *node.values("Scale, Frequency, Anisotropy, Orientation 2D, Orientation 3D"))
    return node.emit("GABOR", inputs, (node.choice("gabor_type", enums.GABOR_TYPES), enums.GABOR_OUTPUTS.index(output)))


@value_node("ShaderNodeRadialTiling")
def radial_tiling(node: NodeView, output: str) -> Value:
    """From Blender 5.0 on."""
    inputs = node.values("Vector, Sides, Roundness")
    if output == "Segment Coordinates":
        return node.emit("RADIAL_TILING", inputs, (int(node.node.normalize),))
    return node.emit("RADIAL_TILING_VALUE", inputs, (enums.RADIAL_TILING_VALUES.index(output),))
