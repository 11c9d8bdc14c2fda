"""How far points go while a shutter is open, where geometry tells it by an attribute `velocity`: as fluids and files of
simulations do, whose points are others in each frame. Grids of volumes: `volume_drift`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .shutter import ShutterTimes

DRIFT = "INFO:drift"
"""The name in the core of the attribute (native/scene/mesh.h), and of the grid (native/scene/voxel_volume.h)."""
_VELOCITY = "velocity"  # [Cycles, blender/mesh.cpp, attr_create_motion_from_velocity]


@dataclass(frozen=True)
class Drift:
    """What is blurred by it, of a render."""

    times: ShutterTimes
    frame_seconds: float
    """From one frame to the next."""
    frame: float
    """The one that is rendered."""

    @staticmethod
    def during(times: ShutterTimes, frame: float, render: bpy.types.RenderSettings) -> Drift:
        return Drift(times, render.fps_base / render.fps, frame)

    @property
    def seconds(self) -> float:
        """Half of the exposure."""
        return 0.5 * self.times.length * self.frame_seconds

    def columns(
        self, geometry: bpy.types.Mesh | bpy.types.Curves | bpy.types.PointCloud
    ) -> list[tuple[str, str, NDArray[np.float32]]]:
        """The attribute that tells how far each point goes in the second half; none where nothing does."""
        velocity = _velocity(geometry)
        return [] if velocity is None else [(DRIFT, "POINT", velocity * np.float32(self.seconds))]


def points_after(mesh: bpy.types.Mesh, seconds: float) -> NDArray[np.float32] | None:
    """Where its points (n, 3) will be, or were; None where nothing tells."""
    velocity = _velocity(mesh)
    if velocity is None:
        return None
    points = np.empty_like(velocity)
    mesh.attributes["position"].data.foreach_get("vector", points.ravel())
    return points + velocity * np.float32(seconds)


def _velocity(geometry: bpy.types.Mesh | bpy.types.Curves | bpy.types.PointCloud) -> NDArray[np.float32] | None:
    """In metres for each second, (n, 3)."""
    velocity = geometry.attributes.get(_VELOCITY)
    if velocity is None or velocity.domain != "POINT" or velocity.data_type != "FLOAT_VECTOR":
        return None
    values = np.empty((len(velocity.data), 3), np.float32)
    velocity.data.foreach_get("vector", values.ravel())
    return values
