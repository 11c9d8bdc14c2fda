"""The world to the environment of the core."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy

from . import versions
from .instances import RAY_BITS
from .light_groups import NO_GROUP, group_of_world
from .materials import MaterialTable
from .studio_light import StudioLight

_BLACK = -1  # no material


def environment_arguments(
    depsgraph: bpy.types.Depsgraph,
    materials: MaterialTable,
    light_groups: Mapping[str, int] | None = None,
    studio: StudioLight | None = None,
) -> dict[str, Any]:
    """Keyword arguments of `SceneBuilder.set_environment`; black without a world, or where the view layer hides it.
    `studio` stands in for it, hidden or not."""
    view_layer = depsgraph.view_layer_eval
    world = view_layer.world_override or depsgraph.scene_eval.world
    if studio is not None:
        color = (0.0, 0.0, 0.0) if world is None else tuple(world.color)
        rays = {} if world is None else _rays_of(world)
        return {"material": materials.studio_handle(studio, color), **rays}
    material = materials.world_handle(world) if world is not None and view_layer.use_sky else None
    if material is None:
        return {"material": _BLACK}
    group = group_of_world(world, light_groups or {})
    return {
        "material": material,
        **_rays_of(world),
        **({} if group == NO_GROUP else {"light_group": group}),
    }


def _rays_of(world: bpy.types.World) -> dict[str, Any]:
    """Who sees it, and how light samples are chosen."""
    method = versions.cycles_setting(world, "sampling_method", "AUTOMATIC")
    resolution = versions.cycles_setting(world, "sample_map_resolution", 0) if method == "MANUAL" else 0
    return {
        "visibility": world_visibility(world),
        "importance_width": resolution,
        "importance_sampling": method != "NONE",
    }


def world_visibility(world: bpy.types.World) -> int:
    """Bits of the rays that may see the world; a shadow ray always reaches it."""
    flags = getattr(world, "cycles_visibility", None)
    names = {"scatter" if name == "volume_scatter" else name: bit for name, bit in RAY_BITS.items()}
    hidden = sum(bit for name, bit in names.items() if name != "shadow" and not getattr(flags, name, True))
    return sum(RAY_BITS.values()) - hidden
