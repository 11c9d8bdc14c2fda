"""Light groups: which group of the view layer an emitter belongs to, by the number that the core knows it by."""

from __future__ import annotations

from collections.abc import Mapping

import bpy

NO_GROUP = -1


def group_numbers(view_layer: bpy.types.ViewLayer) -> dict[str, int]:
    """By name: the order of the view layer's list."""
    return {group.name: number for number, group in enumerate(view_layer.lightgroups)}


def group_of_object(obj: bpy.types.Object, instancer: bpy.types.Object | None, numbers: Mapping[str, int]) -> int:
    """Its own, or if it names none that of what instances it; as in Cycles. Names that are not in the view layer are of
    no group."""
    if not numbers:
        return NO_GROUP
    return numbers.get(_name(obj) or _name(instancer), NO_GROUP)


def group_of_world(world: bpy.types.World, numbers: Mapping[str, int]) -> int:
    return numbers.get(_name(world), NO_GROUP)


def _name(data_block: bpy.types.Object | bpy.types.World | None) -> str:
    """As the user set it: with Persistent Data, what Blender evaluated is not told of a change of it alone."""
    return "" if data_block is None else (data_block.original or data_block).lightgroup
