"""Grids of volume objects to arrays: of OpenVDB files, and of volumes that modifiers and geometry nodes make.

Blender gives its voxels to nobody but writes them to files; its own module for Python reads those.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import SyncReport, versions
from .drift import DRIFT
from .volume_drift import VolumeDrift

_LEAF = 8  # voxels along an axis: Cycles' volumes are made of leaves of OpenVDB's trees, and so is our box
_MOST_BYTES = 1 << 32  # of the dense box of one object's grids
_MOST_REACH = 8  # that velocities may make a box larger, times its longest side
_TYPES = {"bool": np.bool_, "int32": np.int32, "int64": np.int64, "double": np.float64, "vec3d": np.float64}
_TYPES |= {"float": np.float32, "vec3s": np.float32, "vec3i": np.int32}
_LARGEST_HALF = float(np.finfo(np.float16).max)


@dataclass(frozen=True)
class Grid:
    """Voxels (x, y, z) or (x, y, z, channels)."""

    name: str
    voxels: NDArray[np.floating]
    object_to_voxel: NDArray[np.float32]
    background: float = 0.0
    first: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the value of the first voxel is in the lattice of leaves."""
    margin: int = 1
    """Voxels around those that are active: as far as interpolation reaches."""

    @property
    def arguments(self) -> tuple[str, NDArray, NDArray, float]:
        return self.name, self.voxels, self.object_to_voxel, self.background


@dataclass(frozen=True)
class VolumeArrays:
    """The arguments of `SceneBuilder.add_volume` save name and handle."""

    object_to_box: NDArray[np.float32]
    size: tuple[int, int, int]
    grids: list[tuple[str, NDArray, NDArray, float]]
    scales_with_object: bool
    drift_opening: float = 0.0
    texture_space: NDArray[np.float32] | None = None

    def corners(self) -> NDArray[np.float64]:
        """Of the box, (8, 3) in object space."""
        ends = np.array([[(i >> axis & 1) * self.size[axis] for axis in range(3)] + [1] for i in range(8)], np.float64)
        return (ends @ np.linalg.inv(self.object_to_box.astype(np.float64)).T)[:, :3]


def volume_version(volume: bpy.types.Volume, names: Collection[str], drift: VolumeDrift | None = None) -> int:
    """A number that stands for the grids of these names as they are now; 0: unknown."""
    render = volume.render
    members = (tuple(sorted(names)), render.precision, render.space, drift)
    if volume.session_uid:  # what modifiers made; Blender gives a new one to the result of every evaluation
        return hash((volume.session_uid, *members)) or 1
    if not volume.grids.load():
        return 0
    try:
        file = Path(volume.grids.frame_filepath).stat()
    except OSError:
        return 0
    return hash((volume.grids.frame_filepath, file.st_mtime_ns, file.st_size, *members)) or 1


def volume_arrays(
    volume: bpy.types.Volume,
    owner: str,
    names: Collection[str],
    report: SyncReport,
    drift: VolumeDrift | None = None,
) -> VolumeArrays | None:
    """None, and a warning that names `owner`, where nothing can be read; none where there is nothing to read."""
    if not volume.grids.load():
        error = volume.grids.error_message
        if error:
            report.warn(f"{owner}: {volume.filepath!r} cannot be read, it is left out: {error}")
        return None
    wanted = [grid.name for grid in volume.grids if grid.name in names]
    if not wanted:
        return None
    openvdb = versions.volume_reader()
    if openvdb is None:
        report.warn(f"{owner}: this Blender has no Python module for OpenVDB, the volume is left out")
        return None
    try:
        with _file_of(volume) as path:
            return _arrays(partial(openvdb.read, str(path)), wanted, volume, owner, report, drift)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        text = str(error).strip()[:100] or type(error).__name__
        report.warn(f"{owner}: {volume.filepath!r} cannot be read, it is left out: {text}")
        return None


@contextmanager
def _file_of(volume: bpy.types.Volume) -> Iterator[Path]:
    """The file that holds the grids as they are; a copy where modifiers made them."""
    path = Path(volume.grids.frame_filepath)
    if not volume.session_uid and volume.grids.frame_filepath and path.exists():
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "volume.vdb"
        volume.grids.save(filepath=str(copy))
        yield copy


def _arrays(
    read: Callable[[str], Any],
    names: Sequence[str],
    volume: bpy.types.Volume,
    owner: str,
    report: SyncReport,
    drift: VolumeDrift | None,
) -> VolumeArrays | None:
    is_half = volume.render.precision != "FULL"
    memory = _Memory(_MOST_BYTES, 2 if is_half else 4)
    scales = volume.render.space == "OBJECT"
    found = (_grid([read(name)], name, is_half, memory, owner, report) for name in names)
    grids = [grid for grid in found if grid is not None]
    if not grids:
        return None
    at_rest = boxed(grids, scales)
    try:
        way = drift and _grid(
            [read(name) for name in drift.names], DRIFT, is_half, memory, owner, report, drift.exposure
        )
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        report.warn(f"{owner}: velocities cannot be read, they are left out: {str(error).strip()[:100]}")
        return at_rest
    if way is None or not way.voxels.any():
        return at_rest
    farthest = np.maximum(way.voxels.max(axis=(0, 1, 2)), -way.voxels.min(axis=(0, 1, 2))).astype(np.float64)
    reach = drift.reach(farthest)
    if (np.abs(grids[0].object_to_voxel[:3, :3]) @ reach).max() > _MOST_REACH * max(at_rest.size):
        report.warn(f"{owner}: goes {reach.max():.3g} m while the shutter is open, its velocities are left out")
        return at_rest
    arrays = boxed(grids, scales, reach=reach)
    box = at_rest.corners()
    return replace(
        arrays,
        grids=[*arrays.grids, way.arguments],
        drift_opening=drift.opening,
        texture_space=np.stack([box.min(axis=0), box.max(axis=0)]).astype(np.float32),
    )


@dataclass
class _Memory:
    """What grids of one object may still take."""

    bytes_left: int
    value_bytes: int

    def take(self, values: int) -> bool:
        self.bytes_left -= values * self.value_bytes
        return self.bytes_left >= 0


def _grid(
    vdbs: Sequence[Any],
    name: str,
    is_half: bool,
    memory: _Memory,
    owner: str,
    report: SyncReport,
    factor: float = 1.0,
) -> Grid | None:
    """Of one, or of three in one lattice whose values are the components of vectors; times a factor."""
    told = vdbs[0].name
    boxes = np.array([vdb.evalActiveVoxelBoundingBox() for vdb in vdbs if not vdb.empty()], np.int64).reshape(-1, 2, 3)
    boxes = boxes[(boxes[:, 1] >= boxes[:, 0]).all(axis=1)]
    if not len(boxes):
        return None
    lowest, highest = boxes[:, 0].min(0), boxes[:, 1].max(0)
    if not all(vdb.transform.isLinear for vdb in vdbs):
        report.warn(f"{owner}: grid '{told}' lies in no straight lattice, it is left out")
        return None
    lattices = [_object_to_voxel(vdb, lowest) for vdb in vdbs]
    if not all(np.array_equal(lattice, lattices[0]) for lattice in lattices):
        report.warn(f"{owner}: grid '{told}' lies in another lattice than its other components, it is left out")
        return None
    channels = sum(3 if vdb.valueTypeName.startswith("vec3") else 1 for vdb in vdbs)
    if not memory.take(int(np.prod(highest - lowest + 1)) * channels):
        report.warn(f"{owner}: the box of grid '{told}' is larger than memory allows, it is left out")
        return None
    is_supported = all(vdb.valueTypeName in _TYPES for vdb in vdbs) and (channels == 3 or name != DRIFT)
    if not is_supported:
        report.warn(f"{owner}: grid '{told}' of type {vdbs[0].valueTypeName} is not supported, it is left out")
        return None
    voxels = _voxels(vdbs, lowest, highest, channels)
    if factor != 1.0:
        voxels = voxels.astype(np.float32, copy=False)
        voxels *= np.float32(factor)
    margin = int(not versions.tiles_end_sharply() or vdbs[0].activeLeafVoxelCount() > 0)
    background = 0.0 if name == DRIFT else float(np.mean(np.array(vdbs[0].background, np.float64)))
    first = tuple(lowest + versions.voxel_centre())
    return Grid(name, stored(voxels, is_half), lattices[0], background, first, margin)


def _voxels(vdbs: Sequence[Any], lowest: NDArray, highest: NDArray, channels: int) -> NDArray:
    """The dense box of active voxels; of several grids, which then have one component each, side by side."""
    size, first = tuple(int(n) for n in highest - lowest + 1), tuple(int(n) for n in lowest)
    voxels = np.empty(size if channels == 1 else (*size, channels), _TYPES[vdbs[0].valueTypeName])
    if len(vdbs) == 1:
        vdbs[0].copyToArray(voxels, ijk=first)
        return voxels
    for component, vdb in enumerate(vdbs):
        part = np.empty(size, _TYPES[vdb.valueTypeName])
        vdb.copyToArray(part, ijk=first)
        voxels[..., component] = part
    return voxels


def stored(voxels: NDArray, is_half: bool) -> NDArray[np.floating]:
    """As the core keeps them: finite, in single or half precision. What comes in single precision, and can be written
    to, is overwritten: large grids leave no room for copies."""
    finite = voxels.astype(np.float32, copy=not voxels.flags.writeable)
    np.nan_to_num(finite, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
    if is_half:
        finite = np.clip(finite, -_LARGEST_HALF, _LARGEST_HALF, out=finite).astype(np.float16)
    return np.ascontiguousarray(finite)


def _object_to_voxel(vdb: Any, lowest: NDArray) -> NDArray[np.float32]:  # noqa: ANN401
    origin = np.array(vdb.transform.indexToWorld(tuple(float(n) for n in lowest)))
    voxel_to_object = np.eye(4)
    for axis in range(3):
        step = lowest.astype(np.float64)
        step[axis] += 1.0
        voxel_to_object[:3, axis] = np.array(vdb.transform.indexToWorld(tuple(step))) - origin
    voxel_to_object[:3, 3] = origin
    try:
        object_to_voxel = np.linalg.inv(voxel_to_object)
    except np.linalg.LinAlgError as error:
        raise ValueError(f"the matrix of grid '{vdb.name}' cannot be inverted") from error
    object_to_voxel[:3, 3] -= versions.voxel_centre()
    return object_to_voxel.astype(np.float32)


def boxed(
    grids: Sequence[Grid], scales_with_object: bool, leaf: int = _LEAF, reach: NDArray[np.floating] | None = None
) -> VolumeArrays:
    """Grids in their box, in voxels of the first: as large as what interpolation reaches, in whole leaves; and `reach`
    along each axis of the object beyond."""
    first = grids[0]
    lowest, highest = np.full(3, np.inf), np.full(3, -np.inf)
    for grid in grids:
        to_first = first.object_to_voxel.astype(np.float64) @ np.linalg.inv(grid.object_to_voxel.astype(np.float64))
        ends = np.array([np.full(3, -grid.margin), np.array(grid.voxels.shape[:3]) - 1 + grid.margin], np.float64)
        corners = np.array([[ends[i >> a & 1][a] for a in range(3)] for i in range(8)])
        corners = corners @ to_first[:3, :3].T + to_first[:3, 3]
        lowest, highest = np.minimum(lowest, corners.min(0)), np.maximum(highest, corners.max(0))
    if reach is not None:
        around = np.abs(first.object_to_voxel[:3, :3].astype(np.float64)) @ reach
        lowest, highest = lowest - around, highest + around
    begin = np.floor((np.round(lowest, 3) + first.first) / leaf) * leaf - first.first
    end = (np.floor((np.round(highest, 3) + first.first) / leaf) + 1) * leaf - first.first
    shift = np.eye(4)
    shift[:3, 3] = -begin
    object_to_box = (shift @ first.object_to_voxel.astype(np.float64)).astype(np.float32)
    size = tuple(int(n) for n in end - begin)
    return VolumeArrays(object_to_box, size, [grid.arguments for grid in grids], scales_with_object)
