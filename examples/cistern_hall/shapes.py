"""Meshes as NumPy arrays: patches, lathes, lofts and tubes, and their way into Blender. Lengths in metres."""

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
TAU = 2.0 * np.pi


@dataclass(frozen=True)
class Shape:
    """Quads with a UV map and a material index each."""

    positions: Array  # (points, 3)
    quads: NDArray[np.int64]  # (quads, 4)
    uvs: Array  # (quads, 4, 2)
    materials: NDArray[np.int64]  # (quads,)

    def moved(self, offset: ArrayLike = (0.0, 0.0, 0.0), turn: float = 0.0, scale: ArrayLike = 1.0) -> "Shape":
        """Scaled, turned about Z (radians) and moved, in this order."""
        c, s = np.cos(turn), np.sin(turn)
        rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        positions = (self.positions * np.asarray(scale)) @ rotation.T + np.asarray(offset)
        return Shape(positions, self.quads, self.uvs, self.materials)

    def painted(self, material: int) -> "Shape":
        return Shape(self.positions, self.quads, self.uvs, np.full_like(self.materials, material))


def joined(shapes: Sequence[Shape]) -> Shape:
    offsets = np.cumsum([0] + [len(shape.positions) for shape in shapes[:-1]])
    return Shape(
        np.concatenate([shape.positions for shape in shapes]),
        np.concatenate([shape.quads + offset for shape, offset in zip(shapes, offsets, strict=True)]),
        np.concatenate([shape.uvs for shape in shapes]),
        np.concatenate([shape.materials for shape in shapes]),
    )


def patch(points: Array, uv_size: tuple[float, float] = (1.0, 1.0)) -> Shape:
    """A surface through a (rows, columns, 3) grid of points. UVs run from 0 to uv_size[0] along the columns and to
    uv_size[1] along the rows. Seen with rows upwards and columns to the right, it faces the viewer."""
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    corners = (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1])
    quads = np.stack([corner.ravel() for corner in corners], axis=1)
    u, v = np.meshgrid(np.linspace(0.0, uv_size[0], columns), np.linspace(0.0, uv_size[1], rows))
    uvs = np.stack([u.ravel(), v.ravel()], axis=1)[quads]
    return Shape(points.reshape(-1, 3), quads, uvs, np.zeros(len(quads), dtype=np.int64))


def lathe(profile: ArrayLike, segments: int, uv_size: tuple[float, float] = (2.0, 1.0), flutes: int = 0) -> Shape:
    """A profile of (radius, z), from below upwards, turned about Z; with flutes, grooves are cut all the way up."""
    radius, z = np.asarray(profile, dtype=np.float64).T
    angle = np.linspace(0.0, TAU, segments + 1)
    depth = 0.07 * np.abs(np.sin(0.5 * flutes * angle)) ** 0.7 if flutes else np.zeros_like(angle)
    r = radius[:, None] * (1.0 - depth)[None, :]
    points = np.stack([r * np.cos(angle), r * np.sin(angle), np.broadcast_to(z[:, None], r.shape)], axis=2)
    return patch(points, uv_size)


def loft_square(profile: ArrayLike, side_segments: int = 4, hollow: float = 0.0) -> Shape:
    """A profile of (half width, z) as a square block; `hollow` draws the middle of the sides in by that share."""
    half, z = np.asarray(profile, dtype=np.float64).T
    t = np.linspace(-1.0, 1.0, side_segments + 1)[:-1]
    side = np.stack([np.full_like(t, 1.0) - hollow * (1.0 - t * t), t], axis=1)
    sides = [side]
    for _ in range(3):
        sides.append(sides[-1] @ np.array([[0.0, 1.0], [-1.0, 0.0]]))
    outline = np.concatenate([*sides, side[:1]])
    points = np.empty((len(half), len(outline), 3))
    points[:, :, :2] = half[:, None, None] * outline[None]
    points[:, :, 2] = z[:, None]
    return patch(points, (4.0, 1.0))


def box(size: Sequence[float], bevel: float = 0.01) -> Shape:
    """A box about the origin with bevelled upper and lower edges."""
    x, y, z = (0.5 * side for side in size)
    profile = [(1e-4, -z), (1.0 - bevel / x, -z), (1.0, -z + bevel), (1.0, z - bevel), (1.0 - bevel / x, z), (1e-4, z)]
    return loft_square(profile, 1).moved(scale=(x, y, 1.0))


def tube(path: Array, radii: ArrayLike, segments: int = 8) -> Shape:
    """A round tube along a path (points, 3); `radii` is one number or one for each point."""
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    helper = np.where(np.abs(tangents[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    side = np.cross(helper, tangents)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(tangents, side)
    angle = np.linspace(0.0, TAU, segments + 1)
    ring = np.cos(angle)[None, :, None] * side[:, None] + np.sin(angle)[None, :, None] * up[:, None]
    radius = np.broadcast_to(np.asarray(radii, dtype=np.float64), (len(path),))
    return patch(path[:, None] + radius[:, None, None] * ring, (1.0, 4.0))


def sphere(radius: float, segments: int = 16, squash: float = 1.0) -> Shape:
    angle = np.linspace(-0.499 * np.pi, 0.499 * np.pi, segments // 2 + 1)
    return lathe(np.stack([radius * np.cos(angle), radius * squash * np.sin(angle)], axis=1), segments)


def to_mesh(
    name: str, shape: Shape, materials: Sequence[bpy.types.Material], sharp_angle: float = np.radians(38.0)
) -> bpy.types.Mesh:
    """A smooth mesh whose edges stay sharp beyond an angle (radians)."""
    mesh = bpy.data.meshes.new(name)
    count = len(shape.quads)
    mesh.vertices.add(len(shape.positions))
    mesh.vertices.foreach_set("co", shape.positions.astype(np.float32).ravel())
    mesh.loops.add(4 * count)
    mesh.loops.foreach_set("vertex_index", shape.quads.astype(np.int32).ravel())
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 4 * count, 4, dtype=np.int32))
    mesh.polygons.foreach_set("material_index", shape.materials.astype(np.int32))
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", shape.uvs.astype(np.float32).ravel())
    for material in materials:
        mesh.materials.append(material)
    mesh.update(calc_edges=True)
    weld(mesh)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), dtype=bool))
    mesh.set_sharp_from_angle(angle=sharp_angle)
    return mesh


def weld(mesh: bpy.types.Mesh) -> None:
    """Joins the seams of closed shapes, so that shading is smooth across them."""
    import bmesh

    work = bmesh.new()
    work.from_mesh(mesh)
    bmesh.ops.remove_doubles(work, verts=work.verts, dist=1e-5)
    work.to_mesh(mesh)
    work.free()
