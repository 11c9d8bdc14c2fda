"""Small OpenVDB files, written by the module that Blender carries."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.sync import versions

needs_openvdb = pytest.mark.skipif(versions.volume_reader() is None, reason="this Blender cannot read OpenVDB files")


def write_grids(
    path: Path,
    grids: dict[str, np.ndarray],
    voxel: float = 0.1,
    first: tuple[int, int, int] = (0, 0, 0),
    matrix: np.ndarray | None = None,
) -> Path:
    """Arrays (x, y, z) or (x, y, z, 3), whose first voxel has the index `first`; voxels are `voxel` apart, or `matrix`
    leads from indices to places."""
    openvdb = versions.volume_reader()
    written = []
    for name, values in grids.items():
        grid = openvdb.FloatGrid() if values.ndim == 3 else openvdb.Vec3SGrid()
        grid.copyFromArray(np.ascontiguousarray(values, np.float32), ijk=first)
        grid.name, grid.gridClass = name, openvdb.GridClass.FOG_VOLUME
        rows = np.diag([voxel, voxel, voxel, 1.0]) if matrix is None else matrix.T  # it multiplies rows
        grid.transform = openvdb.createLinearTransform(rows.tolist())
        written.append(grid)
    openvdb.write(str(path), grids=written)
    return path


def add_volume(
    scene: bpy.types.Scene, path: Path | str, material: bpy.types.Material | None = None, name: str = "cloud"
) -> bpy.types.Object:
    volume = bpy.data.volumes.new(name)
    volume.filepath = str(path)
    if material is not None:
        volume.materials.append(material)
    obj = bpy.data.objects.new(name, volume)
    scene.collection.objects.link(obj)
    return obj


def puff(size: int = 20, voxels: tuple[int, int, int] | None = None) -> np.ndarray:
    """A lumpy ball of density up to 1, that fades to 0 before the box ends."""
    n = voxels or (size, size, size)
    x, y, z = np.meshgrid(*(np.linspace(-1, 1, k) for k in n), indexing="ij")
    lumps = 0.3 * np.sin(5 * x + 1) * np.sin(6 * y) * np.sin(4 * z + 2)
    return np.clip(1.6 * (0.9 - np.sqrt(x * x + y * y + z * z) + lumps), 0.0, 1.0).astype(np.float32)
