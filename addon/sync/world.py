"""The world to the environment of the core."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from . import versions
from .instances import RAY_BITS
from .materials import MaterialTable

if TYPE_CHECKING:
    from cistern_core import SceneBuilder


def sync_world(depsgraph: bpy.types.Depsgraph, builder: SceneBuilder, materials: MaterialTable) -> None:
    """Set the environment; without a world, or where the view layer hides it, the builder's black one stays."""
    view_layer = depsgraph.view_layer_eval
    world = view_layer.world_override or depsgraph.scene_eval.world
    if world is None or not view_layer.use_sky:
        return
    material = materials.world_handle(world)
    if material is None:
        return
    method = versions.cycles_setting(world, "sampling_method", "AUTOMATIC")
    resolution = versions.cycles_setting(world, "sample_map_resolution", 0) if method == "MANUAL" else 0
    builder.set_environment(
        material=material,
        visibility=world_visibility(world),
        importance_width=resolution,
        importance_sampling=method != "NONE",
    )


def world_visibility(world: bpy.types.World) -> int:
    """Bits of the rays that may see the world; a shadow ray always reaches it."""
    flags = getattr(world, "cycles_visibility", None)
    hidden = sum(bit for name, bit in RAY_BITS.items() if name != "shadow" and not getattr(flags, name, True))
    return sum(RAY_BITS.values()) - hidden
