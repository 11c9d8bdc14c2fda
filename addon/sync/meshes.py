"""Evaluated meshes to arrays, by the fastest routes Blender offers.

Attributes whose buffer has exactly the stored type are copied as one block; the same data through `vertices` or
`loops` is converted element by element and costs ten to fifty times as much.
"""

from __future__ import annotations

from collections.abc import Iterator, Set
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .colour import srgb_to_linear
from .drift import Drift
from .islands import random_per_island
from .nodes.value_names import GENERATED, POINTINESS, RANDOM_PER_ISLAND, RENDER_COLOR
from .pointiness import pointiness
from .subdivision import Subdivision

# Attribute type -> (property of an element, components). Other types carry nothing a shader can read.
_READABLE_TYPES = {
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "INT8": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
    "QUATERNION": ("value", 4),
    "FLOAT4": ("vector", 4),
}
_READABLE_DOMAINS = ("POINT", "FACE", "CORNER", "EDGE")
_LARGEST_POLYGON_OF_CORE = 4
SAME_COORDINATE = 1e-5  # of the mesh's extent: rounding


@dataclass(frozen=True)
class MeshArrays:
    """The arguments of `SceneBuilder.add_mesh` save name and handle."""

    positions: NDArray[np.float32]
    corner_vertices: NDArray[np.int32]
    polygon_offsets: NDArray[np.int32] | None = None
    triangle_corners: NDArray[np.int32] | None = None
    triangle_polygons: NDArray[np.int32] | None = None
    material_indices: NDArray[np.int32] | None = None
    normals: NDArray[np.float32] | None = None
    normals_domain: str = "FACE"
    sharp_faces: NDArray[np.uint8] | None = None
    attributes: list[tuple[str, str, NDArray[np.float32]]] = field(default_factory=list)
    subdivision: dict[str, Any] | None = None
    texture_space: NDArray[np.float32] | None = None


def mesh_arrays(
    mesh: bpy.types.Mesh,
    wanted_attributes: Set[str] = frozenset(),
    subdivision: Subdivision | None = None,
    vertex_groups: dict[str, int] | None = None,
    drift: Drift | None = None,
) -> MeshArrays:
    """Copy a mesh out. All UV maps come along, the active render one first; other attributes when they are wanted, and
    so vertex groups, of which the object has the numbers."""
    corner_count, polygon_count = len(mesh.loops), len(mesh.polygons)
    offsets = _polygon_offsets(mesh, polygon_count, corner_count)
    triangle_corners, triangle_polygons = _tessellation(mesh, offsets)
    normals, normals_domain = _normals(mesh, corner_count)
    sharp = _column(mesh, "sharp_face", "value", np.bool_, polygon_count)
    attributes = _attributes(mesh, wanted_attributes) + _vertex_groups(mesh, vertex_groups or {}, wanted_attributes)
    if drift is not None:
        attributes += drift.columns(mesh)
    return MeshArrays(
        positions=points_of(mesh),
        corner_vertices=_corner_vertices(mesh, corner_count),
        polygon_offsets=offsets,
        triangle_corners=triangle_corners,
        triangle_polygons=triangle_polygons,
        material_indices=_column(mesh, "material_index", "value", np.int32, polygon_count),
        normals=normals,
        normals_domain=normals_domain,
        sharp_faces=sharp.view(np.uint8) if sharp is not None and normals_domain != "FACE" else None,
        attributes=attributes,
        subdivision=None if subdivision is None else subdivision.arguments(mesh),
        texture_space=texture_space(mesh) if GENERATED in wanted_attributes else None,
    )


def generated_coordinates(mesh: bpy.types.Mesh) -> NDArray[np.float32] | None:
    """(n, 3): where points were before modifiers and shape keys moved them, in the texture space of the original mesh.
    None where that is as the core has it by itself: where points are, in the mesh's bounds. In viewports Blender only
    knows points as they are."""
    before = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("undeformed_co", before.ravel())
    size = np.array(mesh.texspace_size, np.float32)
    scale = np.divide(0.5, size, out=np.zeros_like(size), where=size != 0.0)
    generated = (before - np.array(mesh.texspace_location, np.float32)) * scale + 0.5
    positions = points_of(mesh)
    lower = positions.min(axis=0, initial=np.inf)
    extent = positions.max(axis=0, initial=-np.inf) - lower
    in_bounds = np.divide(positions - lower, extent, out=np.full_like(positions, 0.5), where=extent > 0.0)
    return None if np.allclose(generated, in_bounds, rtol=0.0, atol=SAME_COORDINATE) else generated


@contextmanager
def whole_mesh(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> Iterator[bpy.types.Mesh]:
    """The mesh of an evaluated object; a copy while that is edited, which Blender keeps in another form then."""
    if not mesh.is_editmode:
        yield mesh
        return
    try:
        yield obj.to_mesh()
    finally:
        obj.to_mesh_clear()


def texture_space(mesh: bpy.types.Mesh) -> NDArray[np.float32] | None:
    """(2, 3): corners of the box that Generated coordinates of what is inside map to [0, 1]; None where these are the
    mesh's bounds, as the core has it by itself."""
    place, half = np.array(mesh.texspace_location, np.float32), np.array(mesh.texspace_size, np.float32)
    positions = points_of(mesh)
    if not len(positions):
        return None
    box = np.stack([place - half, place + half])
    bounds = np.stack([positions.min(axis=0), positions.max(axis=0)])
    return None if np.allclose(box, bounds, rtol=0.0, atol=SAME_COORDINATE * np.abs(bounds).max()) else box


def points_of(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    positions = np.empty((len(mesh.vertices), 3), np.float32)
    if len(positions):
        mesh.attributes["position"].data.foreach_get("vector", positions.ravel())
    return positions


def _corner_vertices(mesh: bpy.types.Mesh, corner_count: int) -> NDArray[np.int32]:
    corners = _column(mesh, ".corner_vert", "value", np.int32, corner_count)
    return corners if corners is not None else np.empty(0, np.int32)


def _column(mesh: bpy.types.Mesh, name: str, member: str, dtype: type, count: int) -> NDArray | None:
    attribute = mesh.attributes.get(name)
    if attribute is None or count == 0 or len(attribute.data) != count:
        return None
    values = np.empty(count, dtype)
    attribute.data.foreach_get(member, values)
    return values


def _polygon_offsets(mesh: bpy.types.Mesh, polygon_count: int, corner_count: int) -> NDArray[np.int32] | None:
    """First corner of every polygon and the total; None where every polygon is a triangle."""
    if corner_count == 3 * polygon_count:
        return None
    offsets = np.empty(polygon_count + 1, np.int32)
    mesh.polygons.foreach_get("loop_start", offsets[:-1])
    offsets[-1] = corner_count
    return offsets


def _tessellation(
    mesh: bpy.types.Mesh, offsets: NDArray[np.int32] | None
) -> tuple[NDArray[np.int32], NDArray[np.int32]] | tuple[None, None]:
    """Blender's triangles where a polygon is larger than the core can split, else (None, None)."""
    if offsets is None or np.diff(offsets).max(initial=0) <= _LARGEST_POLYGON_OF_CORE:
        return None, None
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners, polygons = np.empty((count, 3), np.int32), np.empty(count, np.int32)
    mesh.loop_triangles.foreach_get("loops", corners.ravel())
    mesh.loop_triangle_polygons.foreach_get("value", polygons)
    return corners, polygons


def _normals(mesh: bpy.types.Mesh, corner_count: int) -> tuple[NDArray[np.float32] | None, str]:
    """Where nothing but flat faces parts them, smooth ones beside these are as if all were smooth, as in Cycles."""
    domain, has_own = mesh.normals_domain, mesh.has_custom_normals
    if domain == "FACE" and has_own and "sharp_face" in mesh.attributes:
        domain = "POINT"  # normals that faces were given are blended there
    if corner_count == 0 or domain == "FACE":
        return None, "FACE"
    at_points = domain == "POINT" or not (has_own or _has_sharp_edges(mesh))
    source, domain = (mesh.vertex_normals, "POINT") if at_points else (mesh.corner_normals, "CORNER")
    normals = np.empty((len(source), 3), np.float32)
    source.foreach_get("vector", normals.ravel())
    return normals, domain


def _has_sharp_edges(mesh: bpy.types.Mesh) -> bool:
    sharp = _column(mesh, "sharp_edge", "value", np.bool_, len(mesh.edges))
    return sharp is not None and bool(sharp.any())


def _attributes(mesh: bpy.types.Mesh, wanted: Set[str]) -> list[tuple[str, str, NDArray[np.float32]]]:
    uv_maps = sorted(mesh.uv_layers, key=lambda layer: not layer.active_render)  # stable: Blender's order otherwise
    names = [layer.name for layer in uv_maps]
    names += [a.name for a in mesh.attributes if a.name in wanted and a.name not in names]
    columns = [column for column in (_attribute_values(mesh, name) for name in names) if column is not None]
    if RANDOM_PER_ISLAND in wanted and len(mesh.polygons):
        columns.append((RANDOM_PER_ISLAND, "FACE", random_per_island(mesh)))
    if POINTINESS in wanted and len(mesh.polygons):
        columns.append((POINTINESS, "POINT", pointiness(mesh)))
    generated = generated_coordinates(mesh) if GENERATED in wanted and len(mesh.polygons) else None
    if generated is not None:
        columns.append((GENERATED, "POINT", generated))
    return columns + _unnamed_color(mesh, wanted)


def _unnamed_color(mesh: bpy.types.Mesh, wanted: Set[str]) -> list[tuple[str, str, NDArray]]:
    """The colours a nameless Color Attribute node means, the active render ones, under the name it asks for."""
    index = mesh.color_attributes.render_color_index
    if RENDER_COLOR not in wanted or not 0 <= index < len(mesh.color_attributes):
        return []
    values = _attribute_values(mesh, mesh.color_attributes[index].name)
    return [(RENDER_COLOR, *values[1:])] if values is not None else []


def _vertex_groups(
    mesh: bpy.types.Mesh, numbers: dict[str, int], wanted: Set[str]
) -> list[tuple[str, str, NDArray[np.float32]]]:
    """Weights of the groups that are wanted and whose names no attributes have, by their numbers in the object."""
    columns = {
        number: np.zeros((len(mesh.vertices), 1), np.float32)
        for name, number in numbers.items()
        if name in wanted and name not in mesh.attributes
    }
    for row, vertex in enumerate(mesh.vertices if columns else ()):
        for element in vertex.groups:
            if element.group in columns:
                columns[element.group][row] = element.weight
    names = {number: name for name, number in numbers.items()}
    return [(names[number], "POINT", weights) for number, weights in columns.items()]


def _attribute_values(mesh: bpy.types.Mesh, name: str) -> tuple[str, str, NDArray[np.float32]] | None:
    attribute = mesh.attributes.get(name)
    if attribute is None or attribute.domain not in _READABLE_DOMAINS or attribute.data_type not in _READABLE_TYPES:
        return None
    values = _read_values(attribute)
    if attribute.domain == "EDGE":
        return name, "POINT", _means_at_points(mesh, attribute, values)
    return name, attribute.domain, values


def attribute_rgba(attribute: bpy.types.Attribute | None) -> NDArray[np.float32] | None:
    """As Blender turns values into colours: (n, 4), one number being grey, missing ones 0, alpha 1."""
    if attribute is None or attribute.data_type not in _READABLE_TYPES:
        return None
    values = _read_values(attribute)
    rgba = np.zeros((len(values), 4), np.float32)
    rgba[:, 3] = 1.0
    rgba[:, : 3 if values.shape[1] == 1 else values.shape[1]] = values
    return rgba


def read_attribute_values(attribute: bpy.types.Attribute) -> NDArray[np.float32] | None:
    """(n, 1 to 4) as a shader reads them; None for kinds that carry nothing it can."""
    return _read_values(attribute) if attribute.data_type in _READABLE_TYPES else None


def _read_values(attribute: bpy.types.Attribute) -> NDArray[np.float32]:
    member, components = _READABLE_TYPES[attribute.data_type]
    values = np.empty((len(attribute.data), components), np.float32)
    if len(values):
        attribute.data.foreach_get(member, values.ravel())
    return values


def _means_at_points(
    mesh: bpy.types.Mesh, attribute: bpy.types.Attribute, values: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Values of edges at points as Blender mixes them for Cycles: the mean over the edges there, 0 without any.

    Integers are rounded, a point is true where one of its edges is, and byte colours are averaged as they are encoded.
    """
    kind = attribute.data_type
    if kind == "BYTE_COLOR":
        attribute.data.foreach_get("color_srgb", values.ravel())
    ends = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", ends)
    points = len(mesh.vertices)
    sums = np.array([np.bincount(ends, np.repeat(column, 2), points) for column in values.T])
    means = sums.T / np.maximum(np.bincount(ends, minlength=points), 1)[:, None]
    if kind == "BOOLEAN":
        means = means > 0.0
    elif kind in ("INT", "INT8"):
        means = np.copysign(np.floor(np.abs(means) + 0.5), means)
    elif kind == "BYTE_COLOR":
        means[:, :3] = srgb_to_linear(means[:, :3])
    return np.ascontiguousarray(means, np.float32)
