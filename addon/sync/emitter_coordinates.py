"""What Texture Coordinate and UV Map nodes read From Instancer: where on a surface an instance sits.

Blender knows that of particles and of what faces instance. Of all other instances both are as at the origin."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from .nodes.value_names import EMITTER, split_value_name


def with_emitter_coordinates(
    values: NDArray[np.float32] | None, depsgraph: bpy.types.Depsgraph, names: Sequence[str]
) -> NDArray[np.float32] | None:
    """`values` of the items of the dependency graph, (items, names, 4), with those coordinates of all instances."""
    wanted = [(k, name) for k, (kind, name) in enumerate(map(split_value_name, names)) if kind == EMITTER]
    if not wanted:
        return values
    items = depsgraph.object_instances
    is_instance = np.empty(len(items), np.bool_)
    items.foreach_get("is_instance", is_instance)
    if values is None:
        values = np.full((len(items), len(names), 4), np.nan, np.float32)
    for k, output in wanted:
        values[is_instance, k] = 0.0
        if output == "UV":
            coordinates = np.empty((len(items), 2), np.float32)
            items.foreach_get("uv", coordinates.ravel())
        else:  # from -1 to 1; Cycles takes half of that and another half away
            coordinates = np.empty((len(items), 3), np.float32)
            items.foreach_get("orco", coordinates.ravel())
            coordinates = 0.5 * coordinates - 0.5
        values[is_instance, k, : coordinates.shape[1]] = np.nan_to_num(coordinates[is_instance])
    return values
