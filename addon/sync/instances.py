"""Everything the dependency graph places in the world, by one path: objects, collections, particles, geometry nodes."""

from __future__ import annotations

import math
import time
from collections.abc import Set
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from . import SyncReport
from .lights import is_portal, light_call
from .materials import MaterialTable
from .meshes import has_own_texture_space, mesh_arrays

if TYPE_CHECKING:
    from cistern_core import SceneBuilder

# Bits of native/scene/instance.h by the names Blender gives an object's `visible_*` flags.
RAY_BITS = {"camera": 1, "diffuse": 2, "glossy": 4, "transmission": 8, "shadow": 16}
# Nothing is missing when these are left out: the former have no surface, and the surface of the latter is an item of
# its own in the dependency graph, already a mesh.
_INVISIBLE_TYPES = {"EMPTY", "ARMATURE", "LATTICE", "CAMERA", "SPEAKER", "LIGHT_PROBE"}
_MESHED_TYPES = {"CURVE", "SURFACE", "FONT", "META"}
_LARGEST_BELOW_ONE = np.nextafter(np.float32(1.0), np.float32(0.0))
_UINT32_MASK = 0xFFFFFFFF
_COPLANAR = 1e-6  # kCoplanar of native/scene/scene_checks.cpp
_NAMES_SHOWN = 5
# Ray tracing leaves out triangles beyond this, in metres (Embree's largest coordinate, rounded).
_LARGEST_COORDINATE = 1.8e18


@dataclass(frozen=True)
class Surface:
    """What all instances of one geometry of one object have in common."""

    mesh: int
    material_set: int
    object: int
    visibility: int
    holdout: bool
    random: float
    """Object Info > Random; not a number where each instance has its own."""
    flat_axis: int = -1
    """Local axis along which every coordinate of the mesh is 0; -1 for a solid."""


@dataclass(frozen=True)
class Lamp:
    """What all instances of one lamp object have in common. Lives no longer than the sync that made it."""

    name: str
    light: bpy.types.Light
    visibility: int


@dataclass(frozen=True)
class Placements:
    """The prototype that each item of `depsgraph.object_instances` shows; -1 for items that show nothing."""

    prototypes: list[Surface | Lamp]
    prototype_of: NDArray[np.int32]

    def items_showing(self, kind: type) -> NDArray[np.intp]:
        """Items that show a surface, or a lamp, in order."""
        chosen = np.array([isinstance(p, kind) for p in self.prototypes] + [False], np.bool_)
        return np.flatnonzero(chosen[self.prototype_of])  # -1 looks up the last entry


class InstanceSync:
    """One pass over the instances of a dependency graph; every geometry, material set and name is added once."""

    def __init__(
        self,
        depsgraph: bpy.types.Depsgraph,
        builder: SceneBuilder,
        materials: MaterialTable,
        wanted_attributes: Set[str],
        report: SyncReport,
    ) -> None:
        self._depsgraph = depsgraph
        self._builder = builder
        self._materials = materials
        self._wanted_attributes = wanted_attributes
        self._report = report
        self._meshes: dict[int, tuple[int, int] | None] = {}  # handle and flat axis
        self._names: dict[str, int] = {}
        self.mesh_seconds = 0.0

    def run(self) -> None:
        """Add all surfaces and lamps of the dependency graph to the builder."""
        placements = self._place()
        count = len(placements.prototype_of)
        matrices = np.empty((count, 4, 4), np.float32)  # Blender fills them column by column
        random_ids = np.empty(count, np.int32)
        self._depsgraph.object_instances.foreach_get("matrix_world", matrices.ravel())
        self._depsgraph.object_instances.foreach_get("random_id", random_ids)
        arrays = instance_arrays(placements, matrices, random_ids)
        if len(arrays["mesh"]):
            self._builder.add_instances(**arrays)
        if self._builder.singular_instances:
            self._warn_of_flattened(arrays)
        self._add_lamps(placements, matrices)

    def _place(self) -> Placements:
        prototypes: list[Surface | Lamp] = []
        slots: dict = {}
        slot_of: list[int] = []
        read = attrgetter("show_self", "object", "object.data", "instance_object", "parent")
        for show, obj, data, instanced, parent in map(read, self._depsgraph.object_instances):
            # Instances share one temporary object, which therefore cannot be part of the key.
            key = (data, obj if instanced is None else instanced, parent, show)
            slot = slots.get(key)
            if slot is None:
                prototype = self._prototype(obj, parent) if show else None
                slot = slots[key] = -1 if prototype is None else len(prototypes)
                if prototype is not None:
                    prototypes.append(prototype)
            slot_of.append(slot)
        return Placements(prototypes, np.array(slot_of, np.int32))

    def _prototype(self, obj: bpy.types.Object, instancer: bpy.types.Object | None) -> Surface | Lamp | None:
        """None for what has no surface, or is hidden from every kind of ray."""
        parent = obj if instancer is None else instancer
        view_layer = self._depsgraph.view_layer_eval
        holdout = parent.holdout_get(view_layer=view_layer)
        visibility = ray_visibility(obj) & ray_visibility(parent)
        if parent.indirect_only_get(view_layer=view_layer) and not holdout:
            visibility &= ~RAY_BITS["camera"]
        self._warn_of_what_is_ignored(obj)
        if obj.type == "LIGHT":
            return self._lamp(obj, visibility)
        if not isinstance(obj.data, bpy.types.Mesh):
            if obj.type not in _INVISIBLE_TYPES | _MESHED_TYPES:
                self._report.warn(f"Object '{obj.name}': type {obj.type} is not supported and left out")
            return None
        mesh = self._mesh(obj.data) if visibility and view_layer.use_solid else None
        if mesh is None:
            return None
        if instancer is None and has_own_texture_space(obj.data):
            self._report.warn(
                f"Mesh '{obj.data.name}': its own texture space is ignored, Generated uses the bounding box"
            )
        random = name_random(obj.name) if instancer is None else math.nan
        name = self._name_handle(obj.name)
        handle, flat_axis = mesh
        return Surface(handle, self._materials.set_handle(obj), name, visibility, holdout, random, flat_axis)

    def _warn_of_what_is_ignored(self, obj: bpy.types.Object) -> None:
        linking = obj.light_linking
        if linking.receiver_collection is not None or linking.blocker_collection is not None:
            self._report.warn(f"Object '{obj.name}': light linking is not supported and is ignored")
        if obj.is_shadow_catcher and obj.type != "LIGHT":
            self._report.warn(f"Object '{obj.name}': shadow catchers are not supported, it is an ordinary surface")
        for system in obj.particle_systems:
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                self._report.warn(f"Object '{obj.name}': hair is not supported and left out")

    def _lamp(self, obj: bpy.types.Object, visibility: int) -> Lamp | None:
        if is_portal(obj.data):
            self._report.warn(f"Light '{obj.name}': portals are not supported, it is left out")
            return None
        return Lamp(obj.name, obj.data, visibility)

    def _mesh(self, mesh: bpy.types.Mesh) -> tuple[int, int] | None:
        """Handle and flat axis, one per evaluated geometry; None for one without polygons."""
        key = mesh.as_pointer()
        if key not in self._meshes:
            start = time.perf_counter()
            self._meshes[key] = self._add_mesh(mesh) if len(mesh.polygons) else None
            self.mesh_seconds += time.perf_counter() - start
        return self._meshes[key]

    def _add_mesh(self, mesh: bpy.types.Mesh) -> tuple[int, int]:
        arrays = mesh_arrays(mesh, self._wanted_attributes)
        flat_axis = next((axis for axis in range(3) if not arrays.positions[:, axis].any()), -1)
        handle = self._builder.add_mesh(mesh.name, **vars(arrays))
        # Triangles without area are dropped too, but nobody misses them.
        dropped = self._builder.mesh_statistics(handle)["dropped_triangles"]
        if dropped and not np.isfinite(arrays.positions).all():
            self._report.warn(f"Mesh '{mesh.name}': coordinates are not finite, {dropped} triangles are left out")
        elif np.abs(arrays.positions).max(initial=0.0) > _LARGEST_COORDINATE:
            self._report.warn(f"Mesh '{mesh.name}': triangles beyond {_LARGEST_COORDINATE:.1e} m are left out")
        return handle, flat_axis

    def _warn_of_flattened(self, arrays: dict[str, NDArray]) -> None:
        names = list(self._names)  # handles count up from 0
        objects = np.unique(arrays["object"][is_flattened(arrays["object_to_world"])])
        shown = ", ".join(f"'{names[handle]}'" for handle in objects[:_NAMES_SHOWN])
        rest = f" and {len(objects) - _NAMES_SHOWN} more" if len(objects) > _NAMES_SHOWN else ""
        self._report.warn(f"Objects scaled to zero along an axis, or beyond all range, are left out: {shown}{rest}")

    def _name_handle(self, name: str) -> int:
        if name not in self._names:
            self._names[name] = self._builder.add_object_name(name)
        return self._names[name]

    def _add_lamps(self, placements: Placements, matrices: NDArray[np.float32]) -> None:
        for item in placements.items_showing(Lamp):
            lamp = placements.prototypes[placements.prototype_of[item]]
            call = light_call(lamp.light, matrices[item].T.astype(np.float64))
            if call is None:
                self._report.warn(
                    f"Light '{lamp.name}': it has no size, by its settings or its scale, and gives no light"
                )
                continue
            material = self._materials.light_handle(lamp.light)
            method = getattr(self._builder, call.method)
            method(name=lamp.name, visibility=lamp.visibility, material=material, **call.arguments)


def instance_arrays(
    placements: Placements, matrices: NDArray[np.float32], random_ids: NDArray[np.int32]
) -> dict[str, NDArray]:
    """The arguments of `SceneBuilder.add_instances` for all placed surfaces; `matrices` (n, 4, 4) hold columns."""
    items = placements.items_showing(Surface)
    prototype = placements.prototype_of[items]

    def column(member: str, dtype: type) -> NDArray:
        return np.array([getattr(p, member, 0) for p in placements.prototypes], dtype)[prototype]

    random = column("random", np.float32)
    columns = np.ascontiguousarray(matrices[items])
    restore_normal_axis(columns, column("flat_axis", np.int32))
    return {
        "mesh": column("mesh", np.int32),
        "material_set": column("material_set", np.int32),
        "object": column("object", np.int32),
        "object_to_world": np.ascontiguousarray(columns.transpose(0, 2, 1)),
        "visibility": column("visibility", np.uint8),
        "holdout": column("holdout", np.uint8),
        "random": np.where(np.isnan(random), random_fraction(random_ids[items]), random),
    }


def restore_normal_axis(columns: NDArray[np.float32], flat_axes: NDArray[np.int32]) -> None:
    """Make matrices invertible that scale a flat mesh by 0 across its plane, where scale changes nothing."""
    for axis in range(3):
        flattened = np.flatnonzero((flat_axes == axis) & ~columns[:, axis, :3].any(axis=1))
        normals = np.cross(columns[flattened, (axis + 1) % 3, :3], columns[flattened, (axis + 2) % 3, :3])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        columns[flattened, axis, :3] = normals / np.where(lengths > 0.0, lengths, 1.0)


def is_flattened(matrices: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which object-to-world matrices the core leaves out: those without a useful inverse (scene_checks.cpp)."""
    linear = matrices[:, :3, :3].astype(np.float64)
    determinants = np.abs(np.linalg.det(linear))
    edges = np.prod(np.linalg.norm(linear, axis=1), axis=1)
    range_of_floats = np.finfo(np.float32)
    in_range = (determinants >= range_of_floats.tiny) & (determinants <= range_of_floats.max)
    return ~(in_range & (determinants > _COPLANAR * edges))


def ray_visibility(obj: bpy.types.Object) -> int:
    """Bits of the rays that an object lets itself be seen by."""
    return sum(bit for name, bit in RAY_BITS.items() if getattr(obj, f"visible_{name}"))


def random_fraction(random_ids: NDArray[np.int32]) -> NDArray[np.float32]:
    """Object Info > Random of instance ids, in [0, 1): the id as an unsigned fraction, as in Cycles."""
    fraction = (random_ids.view(np.uint32) / float(_UINT32_MASK)).astype(np.float32)
    return np.minimum(fraction, _LARGEST_BELOW_ONE)


def name_random(name: str) -> float:
    """Object Info > Random of an object that is no instance: a hash of its name, as in Cycles."""
    code = 0
    for byte in name.encode():
        code = (code * 37 + byte) & _UINT32_MASK
    return float(random_fraction(np.array([hash_pair(code, 0)], np.uint32).view(np.int32))[0])


def hash_pair(x: int, y: int) -> int:
    """Jenkins' lookup3 for two words (burtleburtle.net/bob/c/lookup3.c, `final`)."""

    def rotated(v: int, bits: int) -> int:
        return ((v << bits) | (v >> (32 - bits))) & _UINT32_MASK

    start = (0xDEADBEEF + (2 << 2) + 13) & _UINT32_MASK
    a, b, c = (start + x) & _UINT32_MASK, (start + y) & _UINT32_MASK, start
    c = ((c ^ b) - rotated(b, 14)) & _UINT32_MASK
    a = ((a ^ c) - rotated(c, 11)) & _UINT32_MASK
    b = ((b ^ a) - rotated(a, 25)) & _UINT32_MASK
    c = ((c ^ b) - rotated(b, 16)) & _UINT32_MASK
    a = ((a ^ c) - rotated(c, 4)) & _UINT32_MASK
    b = ((b ^ a) - rotated(a, 14)) & _UINT32_MASK
    return ((c ^ b) - rotated(b, 24)) & _UINT32_MASK
