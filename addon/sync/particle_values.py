"""What the Particle Info node reads: numbers of the particles that instances show.

As in Cycles, child particles, hair itself and all else are none."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from .nodes.value_names import PARTICLE, split_value_name
from .placements import hash_pair

# Members of particles, by outputs of the node.
_VECTORS = {"Location": "location", "Velocity": "velocity", "Angular Velocity": "angular_velocity"}
_NUMBERS = {"Size": "size", "Lifetime": "lifetime", "Age": "birth_time"}
_LEVELS = 8
_LARGEST_HASH = 0xFFFFFFFF


def with_particle_values(
    values: NDArray[np.float32] | None, depsgraph: bpy.types.Depsgraph, names: Sequence[str]
) -> NDArray[np.float32] | None:
    """`values` of the items of the dependency graph, (items, names, 4), with those that items have of particles."""
    wanted = [(k, name) for k, (kind, name) in enumerate(map(split_value_name, names)) if kind == PARTICLE]
    items = _items_of_systems(depsgraph) if wanted else {}
    if not items:
        return values
    numbers = _numbers_in_systems(depsgraph)
    if values is None:
        values = np.full((len(numbers), len(names), 4), np.nan, np.float32)
    frame = depsgraph.scene_eval.frame_current_final
    for system, shown in items.values():
        particles = system.particles
        shown = shown[numbers[shown] < len(particles)]
        for k, output in wanted:
            values[shown, k, :3] = np.nan_to_num(_column(particles, output, frame)[numbers[shown]])
            values[shown, k, 3] = 1.0
    return values


def _items_of_systems(
    depsgraph: bpy.types.Depsgraph,
) -> dict[int, tuple[bpy.types.ParticleSystem, NDArray[np.intp]]]:
    """Particle systems that place items, and which."""
    systems: dict[int, bpy.types.ParticleSystem] = {}
    items: dict[int, list[int]] = {}
    for item, instance in enumerate(depsgraph.object_instances):
        system = instance.particle_system
        if system is not None:
            systems.setdefault(system.as_pointer(), system)
            items.setdefault(system.as_pointer(), []).append(item)
    return {key: (systems[key], np.array(found, np.intp)) for key, found in items.items()}


def _numbers_in_systems(depsgraph: bpy.types.Depsgraph) -> NDArray[np.int32]:
    """Of each item, which particle places it; of what is within an instanced collection, its number there."""
    ids = np.empty((len(depsgraph.object_instances), _LEVELS), np.int32)
    depsgraph.object_instances.foreach_get("persistent_id", ids.ravel())
    return ids[:, 0]


def _column(particles: bpy.types.bpy_prop_collection, output: str, frame: float) -> NDArray[np.float32]:
    """(particles, 3), or (particles, 1) of numbers."""
    count = len(particles)
    if output in _VECTORS:
        vectors = np.empty((count, 3), np.float32)
        particles.foreach_get(_VECTORS[output], vectors.ravel())
        return vectors
    if output == "Index":
        return np.arange(count, dtype=np.float32)[:, None]
    if output == "Random":
        return (hash_pair(np.arange(count, dtype=np.int64), 0) / _LARGEST_HASH).astype(np.float32)[:, None]
    numbers = np.empty(count, np.float32)
    particles.foreach_get(_NUMBERS[output], numbers)
    return (np.float32(frame) - numbers if output == "Age" else numbers)[:, None]
