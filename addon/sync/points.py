"""Point clouds to arrays: each point a ball, by Cycles' rules (blender/pointcloud.cpp); for the core a strand of one
key."""

from __future__ import annotations

from collections.abc import Set

import bpy
import numpy as np
from numpy.typing import NDArray

from .drift import Drift
from .meshes import read_attribute_values
from .nodes.value_names import POINT_POSITION, POINT_RADIUS, POINT_RANDOM
from .strands import StrandArrays, random_of_numbers

_DEFAULT_RADIUS = 0.01  # of points without radii, as in Cycles


def point_arrays(cloud: bpy.types.PointCloud, wanted: Set[str], drift: Drift | None = None) -> StrandArrays | None:
    """None for a cloud without points."""
    count = len(cloud.points)
    if not count:
        return None
    positions = np.empty((count, 3), np.float32)
    cloud.attributes["position"].data.foreach_get("vector", positions.ravel())
    radii = np.full(count, _DEFAULT_RADIUS, np.float32)
    radius = cloud.attributes.get("radius")
    if radius is not None and len(radius.data) == count:
        radius.data.foreach_get("value", radii)
    attributes = point_attributes(cloud, positions, radii, wanted)
    if drift is not None:
        attributes += drift.columns(cloud)
    return StrandArrays(positions, radii, np.arange(count + 1, dtype=np.int32), shape="BALLS", attributes=attributes)


def point_attributes(
    cloud: bpy.types.PointCloud, positions: NDArray[np.float32], radii: NDArray[np.float32], wanted: Set[str]
) -> list[tuple[str, str, NDArray[np.float32]]]:
    """Of each point: those of the cloud that are wanted, and what outputs of the Point Info node read."""
    known = ((a.name, read_attribute_values(a)) for a in cloud.attributes if a.name in wanted)
    columns = {name: values for name, values in known if values is not None}
    if POINT_POSITION in wanted:
        columns[POINT_POSITION] = positions
    if POINT_RADIUS in wanted:
        columns[POINT_RADIUS] = radii[:, None]
    if POINT_RANDOM in wanted:
        columns[POINT_RANDOM] = random_of_numbers(len(radii))
    return [(name, "FACE", values) for name, values in columns.items()]
