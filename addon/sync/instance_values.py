"""Numbers that materials read of each instance: Object Info, and attributes of objects, instancers and view layers.

The rules are Blender's (`BKE_object_dupli_find_rgba_attribute`, `BKE_view_layer_find_rgba_attribute`), which Cycles
asks too: a custom property or a path such as "location", of the first of several data-blocks that has it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from .meshes import attribute_rgba
from .nodes.value_names import COLOR, INDEX, INSTANCER, NO_PARTICLE, OBJECT, PARTICLE, split_value_name

Rgba = tuple[float, float, float, float]

NOTHING: Rgba = (0.0, 0.0, 0.0, 0.0)
_NO_ID = np.iinfo(np.int32).max  # of a level of instancing that an item does not have
_LEVELS = 8
_INHERITED = "color"  # instances have that of what instances them


def may_follow_moves(names: Iterable[str]) -> bool:
    """Whether values may change with nothing but the place of an object."""
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
    if kind == PARTICLE:
        return _grey(NO_PARTICLE.get(attribute, 0.0))
    owners = [obj, obj.data]
    if kind == INSTANCER or attribute == _INHERITED:
        owners.insert(0, instancer)
    return _first_value(owners, attribute)


def layer_value(depsgraph: bpy.types.Depsgraph, name: str) -> Rgba:
    """Of an attribute of type View Layer."""
    scene = depsgraph.scene_eval
    return _first_value((depsgraph.view_layer_eval, scene, scene.world), name)


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
) -> NDArray[np.float32] | None:
    """What geometry nodes give each item of the dependency graph, (items, names, 4); not a number where they give
    nothing. `instancer_of` numbers the instancer of each item, -1: none. None where no item has anything.

    Of instances in instances only the outer ones count."""
    kinds_and_names = enumerate(map(split_value_name, names))
    wanted = [(k, name) for k, (kind, name) in kinds_and_names if kind == INSTANCER]
    values: NDArray[np.float32] | None = None
    indices: NDArray[np.int32] | None = None
    for number, instancer in enumerate(instancers):
        columns = _instance_attributes(instancer, [attribute for _, attribute in wanted]) if wanted else {}
        if not columns:
            continue
        if values is None:
            values = np.full((len(instancer_of), len(names), 4), np.nan, np.float32)
            indices = _outer_indices(depsgraph, len(instancer_of))
        for k, attribute in wanted:
            if attribute in columns:
                _give(values[:, k], np.flatnonzero(instancer_of == number), indices, columns[attribute], columns["id"])
    return values


def _give(
    values: NDArray[np.float32],
    items: NDArray[np.intp],
    indices: NDArray[np.int32],
    column: NDArray[np.float32],
    ids: NDArray[np.int32],
) -> None:
    """To items the value of the instance whose id they have."""
    order = np.argsort(ids, kind="stable")
    found = np.searchsorted(ids[order], indices[items]).clip(0, max(len(ids) - 1, 0))
    instance = order[found] if len(ids) else found
    is_there = ids[instance] == indices[items] if len(ids) else np.zeros(len(items), np.bool_)
    values[items[is_there]] = np.nan_to_num(column[instance[is_there]], posinf=0.0, neginf=0.0)


def _instance_attributes(instancer: bpy.types.Object | None, names: Iterable[str]) -> dict[str, NDArray]:
    """Values (n, 4) of the attributes that the instances of geometry nodes have, and their ids under "id"."""
    if instancer is None or not hasattr(instancer, "evaluated_geometry"):  # before Blender 5.0
        return {}
    geometry = instancer.evaluated_geometry()
    points = geometry.instances_pointcloud() if geometry is not None else None
    if points is None:
        return {}
    columns = {name: attribute_rgba(points.attributes.get(name)) for name in names}
    columns = {name: column for name, column in columns.items() if column is not None}
    if columns:
        columns["id"] = _instance_ids(points)
    return columns


def _instance_ids(points: bpy.types.PointCloud) -> NDArray[np.int32]:
    """As the dependency graph numbers instances: by their ids where they have some."""
    ids = np.arange(len(points.points), dtype=np.int32)
    attribute = points.attributes.get("id")
    if attribute is not None and attribute.data_type == "INT":
        attribute.data.foreach_get("value", ids)
    return ids


def _outer_indices(depsgraph: bpy.types.Depsgraph, count: int) -> NDArray[np.int32]:
    """Of each item, its number among the instances that its instancer places itself."""
    ids = np.empty((count, _LEVELS), np.int32)
    depsgraph.object_instances.foreach_get("persistent_id", ids.ravel())
    levels = (ids != _NO_ID).sum(axis=1)
    return ids[np.arange(count), np.maximum(levels - 1, 0)]
