"""What geometry nodes give instances, on every level of instancing; from Blender 5.0 on.

bpy tells of an item only its numbers on each level (`persistent_id`). What they count is Blender's way of instancing
(`object_dupli.cc`): objects of a collection, components of a geometry, or its instances. So each level is looked up in
what the levels around it lead to, for all items at once that come by there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from .meshes import attribute_rgba

_NO_ID = np.iinfo(np.int32).max  # of a level of instancing that an item does not have
_LEVELS = 8
_LEVELS_OF_OTHERS = 2  # that particles, vertices and faces add
# Components of a geometry in Blender's order, and types of objects that show them themselves.
_COMPONENTS = {
    "mesh_base": {"MESH"},
    "volume": {"VOLUME"},
    "curves": {"CURVE", "FONT", "CURVES"},
    "pointcloud": {"POINTCLOUD"},
    "grease_pencil": {"GREASEPENCIL"},
}

_GEOMETRY_TYPES = {"SURFACE", "META"}.union(*_COMPONENTS.values())


@dataclass(frozen=True)
class _Instances:
    """Of one geometry; `references` are what the instances show."""

    ids: NDArray[np.int32]
    order: NDArray[np.intp]
    reference_of: NDArray[np.int32]
    references: Sequence[object]
    columns: dict[str, NDArray[np.float32]]
    components: int
    """That are items of their own, before the instances."""

    def find(self, ids: NDArray[np.int32]) -> NDArray[np.intp]:
        """The instances with these ids, -1: none."""
        found = self.order[np.searchsorted(self.ids[self.order], ids).clip(0, len(self.ids) - 1)]
        return np.where(self.ids[found] == ids, found, -1)


class InstanceLevels:
    """Fills `values`, (items, attributes, 4), with what the innermost level has that knows an attribute."""

    def __init__(
        self, depsgraph: bpy.types.Depsgraph, attributes: Sequence[str], count: int, warn: Callable[[str], None]
    ) -> None:
        self.values = np.full((count, len(attributes), 4), np.nan, np.float32)
        self.has_values = False
        self._depsgraph = depsgraph
        self._attributes = attributes
        self._warn = warn
        self._ids, self._depth = _outermost_first(depsgraph, count)
        self._instances_of: dict[bpy.types.Object, _Instances | None] = {}
        self._members: dict[bpy.types.Collection, list[bpy.types.Object]] = {}

    def enter(self, owner: bpy.types.Object, items: NDArray[np.intp], level: int = 0) -> None:
        """Look up items that an object instances, whose numbers from `level` on are its own."""
        items = items[self._depth[items] > level]
        if not len(items):
            return
        instances = self._instances(owner)
        if instances is not None:
            goes_deeper = not _instances_otherwise(owner)
            self._enter_instances(instances, owner, items, level, goes_deeper)
            if goes_deeper:
                return
        if _instances_otherwise(owner):
            self._warn_of_what_is_inside(owner, items, level)
        elif _is_collection(owner):
            self._enter_collection(owner.instance_collection, items, level)

    def _enter_collection(self, collection: bpy.types.Collection, items: NDArray[np.intp], level: int) -> None:
        items = items[self._depth[items] > level + 1]
        if not len(items):
            return
        if collection not in self._members:
            self._members[collection] = list(collection.all_objects)
        members = self._members[collection]
        for number, part in _groups(self._ids[items, level], items):
            if number < len(members):
                self.enter(members[number], part, level + 1)

    def _enter_instances(
        self, instances: _Instances, owner: bpy.types.Object, items: NDArray[np.intp], level: int, goes_deeper: bool
    ) -> None:
        if instances.components:
            items = items[(self._ids[items, level] == instances.components) & (self._depth[items] > level + 1)]
            level += 1
        found = instances.find(self._ids[items, level])
        items, found = items[found >= 0], found[found >= 0]
        for k, attribute in enumerate(self._attributes):
            if attribute in instances.columns and len(items):
                column = instances.columns[attribute]
                self.values[items, k] = np.nan_to_num(column[found], posinf=0.0, neginf=0.0)
                self.has_values = True
        if not goes_deeper:
            return
        is_deeper = self._depth[items] > level + 1
        for number, part in _groups(instances.reference_of[found[is_deeper]], items[is_deeper]):
            if 0 <= number < len(instances.references):
                self._enter_reference(instances.references[number], owner, part, level + 1)

    def _enter_reference(self, shown: object, owner: bpy.types.Object, items: NDArray[np.intp], level: int) -> None:
        if isinstance(shown, bpy.types.Object):
            self.enter(shown, items, level)
        elif isinstance(shown, bpy.types.Collection):
            members = self._shown_members(shown, owner)
            for number, part in _groups(self._ids[items, level], items):
                if number % 2 and number // 2 < len(members):  # even: the member itself, odd: what it instances
                    self.enter(members[number // 2], part, level + 1)
        elif shown is not None:
            instances = self._read(shown)
            if instances is not None:
                self._enter_instances(instances, owner, items, level, True)

    def _shown_members(self, collection: bpy.types.Collection, owner: bpy.types.Object) -> list[bpy.types.Object]:
        shown = _shown_in(collection, "hide_render" if self._depsgraph.mode == "RENDER" else "hide_viewport")
        return [member for member in collection.all_objects if member in shown and member != owner]

    def _instances(self, owner: bpy.types.Object) -> _Instances | None:
        if owner not in self._instances_of:
            # Of an empty, bpy makes instances of its collection, which Blender's own numbers do not count.
            geometry = _evaluated_geometry(owner) if owner.type in _GEOMETRY_TYPES else None
            self._instances_of[owner] = None if geometry is None else self._read(geometry, owner.type)
        return self._instances_of[owner]

    def _read(self, geometry: bpy.types.GeometrySet, owner_type: str = "") -> _Instances | None:
        points = geometry.instances_pointcloud()
        if points is None or not len(points.points):
            return None
        columns = {name: attribute_rgba(points.attributes.get(name)) for name in self._attributes}
        ids = _instance_ids(points)
        references = np.zeros(len(ids), np.int32)
        points.attributes[".reference_index"].data.foreach_get("value", references)
        return _Instances(
            ids,
            np.argsort(ids, kind="stable"),
            references,
            geometry.instance_references(),
            {name: column for name, column in columns.items() if column is not None},
            sum(
                owner_type not in owners and getattr(geometry, component) is not None
                for component, owners in _COMPONENTS.items()
            ),
        )

    def _warn_of_what_is_inside(self, owner: bpy.types.Object, items: NDArray[np.intp], level: int) -> None:
        """Which child or particle a number means, bpy does not tell."""
        if not (self._depth[items] > level + _LEVELS_OF_OTHERS).any():
            return
        # `depsgraph.objects` lacks children that only their instances show.
        others = [other for other in self._depsgraph.ids if isinstance(other, bpy.types.Object)]
        all_instances = [self._instances(other) for other in others]
        known = {name for instances in all_instances if instances is not None for name in instances.columns}
        for name in sorted(known):
            self._warn(
                f"Object '{owner.name}': attribute '{name}' that geometry nodes give instances inside of its particles "
                "or children is not supported"
            )


def _evaluated_geometry(owner: bpy.types.Object) -> bpy.types.GeometrySet | None:
    """None for one that is in the dependency graph without having been evaluated: hidden objects may be."""
    try:
        return owner.evaluated_geometry()
    except TypeError:
        return None


def _outermost_first(depsgraph: bpy.types.Depsgraph, count: int) -> tuple[NDArray[np.int32], NDArray[np.intp]]:
    """Numbers of each item, and how many it has."""
    ids = np.empty((count, _LEVELS), np.int32)
    depsgraph.object_instances.foreach_get("persistent_id", ids.ravel())
    depth = (ids != _NO_ID).sum(axis=1)
    inwards = np.maximum(depth[:, None] - 1 - np.arange(_LEVELS), 0)
    return np.take_along_axis(ids, inwards, axis=1), depth


def _groups(numbers: NDArray[np.int32], items: NDArray[np.intp]) -> list[tuple[int, NDArray[np.intp]]]:
    """Items by their numbers."""
    order = np.argsort(numbers, kind="stable")
    distinct, starts = np.unique(numbers[order], return_index=True)
    return list(zip(distinct.tolist(), np.split(items[order], starts[1:]), strict=True)) if len(items) else []


def _is_collection(owner: bpy.types.Object) -> bool:
    return owner.instance_type == "COLLECTION" and owner.instance_collection is not None


def _instances_otherwise(owner: bpy.types.Object) -> bool:
    """By vertices, faces or particles: bpy mixes those with the instances of geometry nodes."""
    kinds = (system.settings.render_type for system in owner.particle_systems)
    return owner.instance_type in ("VERTS", "FACES") or any(kind in ("OBJECT", "COLLECTION") for kind in kinds)


def _shown_in(collection: bpy.types.Collection, flag: str) -> set[bpy.types.Object]:
    """Objects that neither they themselves hide nor all collections that they are in."""
    if getattr(collection, flag):
        return set()
    own = {obj for obj in collection.objects if not getattr(obj, flag)}
    return own.union(*(_shown_in(child, flag) for child in collection.children))


def _instance_ids(points: bpy.types.PointCloud) -> NDArray[np.int32]:
    """As the dependency graph numbers instances: by their ids where they have some."""
    ids = np.arange(len(points.points), dtype=np.int32)
    attribute = points.attributes.get("id")
    if attribute is not None and attribute.data_type == "INT":
        attribute.data.foreach_get("value", ids)
    return ids
