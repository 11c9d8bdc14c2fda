"""How the voxels of volume objects go on while a shutter is open: by a grid of velocities, as Cycles has it
(blender/volume.cpp, kernel/geom/volume.h)."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from .drift import Drift


@dataclass(frozen=True)
class VolumeDrift:
    """Of one volume."""

    names: tuple[str, ...]
    """One grid of vectors, or three of numbers."""
    exposure: float
    """What velocities are to be multiplied by to get the way of a whole exposure."""
    opening: float
    """When the shutter opens, in exposures since the voxels were as they are."""

    def reach(self, farthest: NDArray[np.floating]) -> NDArray[np.floating]:
        """How far from where they are things get that go `farthest` in an exposure."""
        return farthest * max(abs(self.opening), abs(self.opening + 1.0))


def volume_drift(volume: bpy.types.Volume, drift: Drift | None) -> VolumeDrift | None:
    """None where nothing is blurred, or no grid tells."""
    names = _velocity_grids(volume) if drift is not None else ()
    unit = drift.frame_seconds if drift is not None and volume.velocity_unit == "SECOND" else 1.0
    if not names or volume.velocity_scale == 0.0:
        return None
    opening = (drift.times.opening - _when(volume, drift)) / drift.times.length
    return VolumeDrift(names, volume.velocity_scale * unit * drift.times.length, opening)


def _velocity_grids(volume: bpy.types.Volume) -> tuple[str, ...]:
    volume.grids.load()
    there = {grid.name for grid in volume.grids}
    parts = (volume.velocity_x_grid, volume.velocity_y_grid, volume.velocity_z_grid)
    if volume.velocity_grid in there:
        return (volume.velocity_grid,)
    return parts if all(parts) and set(parts) <= there else ()


def _when(volume: bpy.types.Volume, drift: Drift) -> float:
    """The time of its voxels, in frames since the frame that is rendered. What modifiers make of nothing is of the
    middle of the exposure, where the scene is; of a sequence Blender takes the whole frame of that."""
    middle = drift.times.middle
    if not volume.filepath:
        return middle
    return int(drift.frame + middle) - drift.frame if volume.is_sequence else 0.0
