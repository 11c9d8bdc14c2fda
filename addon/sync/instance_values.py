"""Numbers that materials read of each instance: Object Info, and attributes of objects, instancers and view layers.

The rules are Blender's (`BKE_object_dupli_find_rgba_attribute`, `BKE_view_layer_find_rgba_attribute`), which Cycles
asks too: a custom property or a path such as "location", of the first of several data-blocks that has it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from .instance_levels import InstanceLevels
from .nodes.value_names import (
    COLOR,
    EMITTER,
    INDEX,
    INSTANCER,
    NO_PARTICLE,
    OBJECT,
    OCCLUSION_DISTANCE,
    PARTICLE,
    split_value_name,
)

Rgba = tuple[float, float, float, float]

NOTHING: Rgba = (0.0, 0.0, 0.0, 0.0)
_INHERITED = "color"  # instances have that of what instances them


def may_follow_others(names: Iterable[str]) -> bool:
    """Whether values may change with an object, its place included, whose they are not: paths lead anywhere."""
    return any(split_value_name(name)[0] in (OBJECT, INSTANCER) for name in names)


def object_values(names: Sequence[str], obj: bpy.types.Object, instancer: bpy.types.Object | None) -> tuple[Rgba, ...]:
    """Of the instances of an object, save what geometry nodes give each."""
    return tuple(_object_value(name, obj, instancer) for name in names)


def _object_value(name: str, obj: bpy.types.Object, instancer: bpy.types.Object | None) -> Rgba:
    if name == COLOR:
        return tuple((instancer or obj).color)
    if name == INDEX:
        return _grey(obj.pass_index)
    kind, attribute = split_value_name(name)
    if kind == EMITTER:
        return NOTHING
    if kind == PARTICLE:
        return _grey(NO_PARTICLE.get(attribute, 0.0))
    owners = [obj, obj.data]
    if kind == INSTANCER or attribute == _INHERITED:
        owners.insert(0, instancer)
    return _first_value(owners, attribute)


def layer_value(depsgraph: bpy.types.Depsgraph, name: str) -> Rgba:
    """Of an attribute of type View Layer, which looks past its world; of OCCLUSION_DISTANCE, with its world."""
    scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    world = scene.world
    if name == OCCLUSION_DISTANCE and layer.world_override is not None:
        world = layer.world_override
    return _first_value((layer, scene, world), name)


def _first_value(owners: Iterable[bpy.types.bpy_struct | None], name: str) -> Rgba:
    values = (_property(owner, name) for owner in owners if owner is not None)
    return next((value for value in values if value is not None), NOTHING)


def _property(owner: bpy.types.bpy_struct, name: str) -> Rgba | None:
    """Numbers, or up to four of them, that an owner has by this name."""
    value = owner.get(name)
    if value is None:
        try:
            value = owner.path_resolve(name)
        except ValueError:
            return None
    return _rgba(value)


def _rgba(value: object) -> Rgba | None:
    if isinstance(value, int | float):
        return _grey(value)
    if isinstance(value, str):
        return None
    try:
        numbers = [float(number) for number in value if not isinstance(number, bool | str)]
    except (TypeError, ValueError):
        return None
    return _finite((*numbers, *(0.0, 0.0, 0.0, 1.0)[len(numbers) :])) if 0 < len(numbers) <= 4 else None


def _grey(value: float) -> Rgba:
    return _finite((value, value, value, 1.0))


def _finite(numbers: Iterable[float]) -> Rgba:
    return tuple(np.nan_to_num(np.array(tuple(numbers), np.float32), posinf=0.0, neginf=0.0).tolist())


def item_values(
    depsgraph: bpy.types.Depsgraph,
    names: Sequence[str],
    instancers: Sequence[bpy.types.Object | None],
    instancer_of: NDArray[np.int32],
    warn: Callable[[str], None],
) -> NDArray[np.float32] | None:
    """What geometry nodes give each item of the dependency graph, (items, names, 4); not a number where they give
    nothing. `instancer_of` numbers the instancer of each item, -1: none. None where no item has anything."""
    kinds_and_names = enumerate(map(split_value_name, names))
    wanted = [(k, name) for k, (kind, name) in kinds_and_names if kind == INSTANCER]
    if not wanted or not instancers or not hasattr(bpy.types.Object, "evaluated_geometry"):  # before Blender 5.0
        return None
    levels = InstanceLevels(depsgraph, [attribute for _, attribute in wanted], len(instancer_of), warn)
    order = np.argsort(instancer_of, kind="stable")
    starts = np.searchsorted(instancer_of[order], np.arange(len(instancers)))
    for instancer, items in zip(instancers, np.split(order, starts)[1:], strict=True):
        if instancer is not None:
            levels.enter(instancer, items)
    if not levels.has_values:
        return None
    values = np.full((len(instancer_of), len(names), 4), np.nan, np.float32)
    values[:, [k for k, _ in wanted]] = levels.values
    return values
