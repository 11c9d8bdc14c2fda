"""Everything the dependency graph places in the world, by one path: objects, collections, particles, geometry nodes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from . import SyncReport
from .changes import EVERYTHING, Changes, data_uid, original_uid
from .emitter_coordinates import with_emitter_coordinates
from .fluid_grids import gas_domain
from .instance_values import item_values, may_follow_others, object_values
from .lamp_table import KeptLamps, LampTable, edited_lamps
from .light_groups import group_of_object
from .light_linking import LightLinks
from .lights import wants_shadow_caustics
from .materials import MaterialTable, TreeUses
from .mesh_table import KeptMeshes, MeshTable, PlacedMesh
from .particle_values import with_particle_values
from .placements import (
    Lamp,
    Placements,
    PrototypeKey,
    Surface,
    identity_of,
    instance_arrays,
    is_flattened,
    name_random,
)
from .shutter import bends, moves
from .studio_light import shown_in
from .subdivision import Subdivision, subdivision_of

if TYPE_CHECKING:
    from cistern_core import SceneBuilder

    from .drift import Drift
    from .shutter import Moment

# Bits of native/scene/instance.h by the names Blender gives an object's `visible_*` flags.
RAY_BITS = {"camera": 1, "diffuse": 2, "glossy": 4, "transmission": 8, "shadow": 16, "volume_scatter": 32}
# Nothing is missing when these are left out: the first have no surface, the surface of the second is an item of its own
# in the dependency graph, already a mesh, and the last are drawn by Blender, over the pictures of all engines.
_INVISIBLE_TYPES = {"EMPTY", "ARMATURE", "LATTICE", "CAMERA", "SPEAKER", "LIGHT_PROBE"}
_MESHED_TYPES = {"CURVE", "SURFACE", "FONT", "META"}
_DRAWN_TYPES = {"GREASEPENCIL", "GPENCIL"}
_NAMES_SHOWN = 5
_ITEMS_BETWEEN_LOOKS = 1 << 14  # 60 ms
_ROUND = bpy.types.Curves | bpy.types.PointCloud  # what consists of strands or points

Traits = tuple[object, ...]
"""All that is read of an object itself and may change, by a driver or a script, together with its place."""


@dataclass
class KeptInstances:
    """What the builder holds of earlier syncs: no reference to Blender's data."""

    meshes: KeptMeshes = field(default_factory=KeptMeshes)
    lamps: KeptLamps = field(default_factory=KeptLamps)
    prototypes: dict[PrototypeKey, Surface | Lamp | None] = field(default_factory=dict)
    names: dict[tuple[str, int, str], int] = field(default_factory=dict)
    """Names and pass indices of objects, and names of their topmost parents."""
    placements: Placements = field(default_factory=Placements)
    links: LightLinks = field(default_factory=LightLinks)
    traits: dict[int, Traits] = field(default_factory=dict)
    """Of objects, and of what instances them, by session id."""
    random_ids: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))
    arrays: dict[str, NDArray] = field(default_factory=dict)
    """As last given to the builder, and with them the names and rows of values."""
    value_names: tuple[str, ...] = ()
    value_rows: NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 0, 4), np.float32))

    def with_new_traits(self, depsgraph: bpy.types.Depsgraph, changes: Changes) -> Changes:
        """Count what moved among what was edited where more has changed: Blender does not tell of what drivers and new
        names change at the same time."""
        if not changes.moved:
            return changes
        listed = {original_uid(update.id): update.id for update in depsgraph.updates}
        edited = {uid for uid in changes.moved & self.traits.keys() if traits(listed[uid]) != self.traits[uid]}
        return replace(changes, moved=changes.moved - edited, objects=changes.objects | edited) if edited else changes


class InstanceSync:
    """One pass over the instances of a dependency graph; every geometry, material set and name is added once.

    Everything is where `kept` has it unless `changes` touched it. `space`: a 3D viewport that may hide objects.
    `moment`: of an open shutter, at which only what is blurred is looked at; `drift`: of its middle."""

    def __init__(
        self,
        depsgraph: bpy.types.Depsgraph,
        builder: SceneBuilder,
        materials: MaterialTable,
        wanted: TreeUses,
        report: SyncReport,
        kept: KeptInstances | None = None,
        changes: Changes = EVERYTHING,
        space: bpy.types.SpaceView3D | None = None,
        light_groups: Mapping[str, int] | None = None,
        moment: Moment | None = None,
        drift: Drift | None = None,
        subdivides: bool = True,
    ) -> None:
        self._depsgraph = depsgraph
        self._builder = builder
        self._materials = materials
        self._report = report
        self._kept = kept if kept is not None else KeptInstances()
        self._changes = changes
        self._is_in_viewport = shown_in(space)
        self._light_groups = light_groups or {}
        self._moment, self._drift = moment, drift
        self._subdivides = subdivides
        self._value_names = tuple(sorted(wanted.instance_values))
        # Whether the values of objects that were not edited may be those of the last sync.
        self._knows_values = self._value_names == self._kept.placements.value_names
        self._knows_values &= not ((changes.moved or changes.objects) and may_follow_others(self._value_names))
        self._knows_materials = not materials.has_new_layer_values
        self._prototypes: dict[PrototypeKey, Surface | Lamp | None] = {}
        self._traits: dict[int, Traits] = {}
        self._lights: dict[PrototypeKey, bpy.types.Light] = {}
        self._links = LightLinks()
        self.meshes = MeshTable(builder, wanted.attributes, report, self._kept.meshes, changes.meshes)
        self.lamps = LampTable(builder, materials, report, self._kept.lamps, changes)

    def run(self) -> None:
        """Add all surfaces and lamps of the dependency graph to the builder."""
        kept = self._kept
        matrices, random_ids = read_places(self._depsgraph)
        edited = self._place_edited_lamps(matrices, random_ids)
        placements = edited if edited is not None else self._place()
        self._place_surfaces(placements, instance_arrays(placements, matrices, random_ids))
        self.lamps.place(placements, matrices, self._lights)
        kept.placements, kept.random_ids = placements, random_ids
        if edited is None:
            kept.prototypes, kept.links, kept.traits = self._prototypes, self._links, self._traits
            self.meshes.finish()

    @property
    def surface_items(self) -> NDArray[np.intp]:
        """Items of the dependency graph whose surfaces the builder has, in its order."""
        placements = self._kept.placements
        return placements.items_of(placements.entries_showing(Surface))

    @property
    def surfaces(self) -> list[Surface]:
        """The different ones of the last run."""
        return [shown for shown in self._prototypes.values() if isinstance(shown, Surface)]

    def _place_surfaces(self, placements: Placements, arrays: dict[str, NDArray]) -> None:
        if replace_instances(self._builder, self._kept, placements, arrays):
            warn_of_flattened(self._builder, self._kept, self._report)

    def _place(self) -> Placements:
        prototypes: list[Surface | Lamp] = []
        slots: dict = {}
        slot_of: list[int] = []
        instancers: dict = {None: -1}
        instancer_of: list[int] = []
        hair: dict[tuple, list[int]] = {}
        hair_slots: list[int] = []
        hair_items: list[int] = []
        read = attrgetter("show_self", "instance_object", "parent", "show_particles")
        for item in self._depsgraph.object_instances:
            show, instanced, parent, show_hair = read(item)
            # Instances share one temporary object. It cannot be part of the key, and Blender never frees what Python is
            # given to know it by (120 bytes each time), which resolving a path past it does without.
            owner = item.object if instanced is None else instanced
            key = (item.path_resolve("object.data"), owner, parent, show, show_hair)
            slot = slots.get(key)
            if len(slot_of) % _ITEMS_BETWEEN_LOOKS == 0:
                self._report.look_up()
            if slot is None:
                obj = item.object
                for one in (obj, parent):
                    self._note_traits(one)
                is_in_view = self._is_in_viewport(obj)
                prototype = self._known_prototype(obj, parent) if show and is_in_view else None
                slot = slots[key] = -1 if prototype is None else len(prototypes)
                if prototype is not None:
                    prototypes.append(prototype)
                found = self._hair(obj, owner, parent) if show_hair and is_in_view else []
                if found:
                    hair[key] = list(range(len(prototypes), len(prototypes) + len(found)))
                    prototypes += found
            if hair and key in hair:
                hair_slots += hair[key]
                hair_items += [len(slot_of)] * len(hair[key])
            slot_of.append(slot)
            if self._value_names:
                instancer_of.append(instancers.setdefault(parent, len(instancers) - 1))
        with self._report.about("values"):
            values = self._item_values(instancers, instancer_of)
        if values is not None and hair_items:
            values = np.concatenate((values, values[hair_items]))
        with self._report.about("links"):
            linked = self._links.link(prototypes, self._report)
        return Placements(
            linked,
            np.array(slot_of + hair_slots, np.int32),
            self._value_names,
            values,
            np.array(hair_items, np.intp),
        )

    def _hair(
        self, obj: bpy.types.Object, shown: bpy.types.Object, instancer: bpy.types.Object | None
    ) -> list[Surface]:
        """The hair of particle systems; `shown`: the object that has them, where `obj` is its instance."""
        is_render = self._depsgraph.mode == "RENDER"
        surfaces: list[Surface] = []
        if not self._depsgraph.view_layer_eval.use_strand or not self._visibility(obj, instancer)[0]:
            return surfaces
        for number, modifier in enumerate(shown.modifiers if len(shown.particle_systems) else ()):
            if modifier.type != "PARTICLE_SYSTEM" or not (
                modifier.show_render if is_render else modifier.show_viewport
            ):
                continue
            settings = modifier.particle_system.settings
            if settings.type != "HAIR" or settings.render_type != "PATH":
                continue
            # What geometry nodes of an object instance goes by its name and has its hair, with materials of their own.
            of_data = ~identity_of(number, data_uid(obj.data))
            key = (original_uid(obj), original_uid(instancer), of_data)
            known = self._kept.prototypes.get(key) if self._is_untouched(key) and self.meshes.knows_attributes else None
            if known is None:
                owner = identity_of(original_uid(shown), number)
                has_shape = self._has_shape(obj, instancer)
                with self._report.about(("object", key)):
                    hair = self.meshes.placed_hair(shown, number, owner, is_render) if has_shape else None
                    mesh = hair if has_shape else self.meshes.empty()
                    known = None if mesh is None else self._surface(obj, instancer, key, mesh)
            else:
                self.meshes.keep(known.mesh)
            self._prototypes[key] = known
            surfaces += [] if known is None else [known]
        return surfaces

    def _item_values(self, instancers: dict, instancer_of: list[int]) -> NDArray[np.float32] | None:
        known = list(instancers)[1:]  # without None
        indices = np.array(instancer_of, np.int32)
        values = item_values(self._depsgraph, self._value_names, known, indices, self._report.warn)
        values = with_particle_values(values, self._depsgraph, self._value_names)
        return with_emitter_coordinates(values, self._depsgraph, self._value_names)

    def _place_edited_lamps(self, matrices: NDArray[np.float32], random_ids: NDArray[np.int32]) -> Placements | None:
        """The placements of the last sync with the lamps that were edited since; None if that is not all there is."""
        kept = self._kept
        is_same_list = np.array_equal(random_ids, kept.random_ids)
        if not is_same_list or not (self.meshes.knows_attributes and self._knows_values and self._knows_materials):
            return None
        edited = edited_lamps(self._depsgraph, kept.lamps, self._changes, matrices)
        if edited is None or any(kept.links.has(key[0]) for key in edited):
            return None
        lamps = {key: self._prototype(obj, None, key) for key, obj in edited.items()}
        if self._links:
            return None
        self._lights = {key: obj.data for key, obj in edited.items()}
        kept.prototypes |= lamps
        kept.traits |= {key[0]: traits(obj) for key, obj in edited.items()}
        prototypes = [lamps.get(prototype.key, prototype) for prototype in kept.placements.prototypes]
        return replace(kept.placements, prototypes=prototypes)

    def _known_prototype(self, obj: bpy.types.Object, instancer: bpy.types.Object | None) -> Surface | Lamp | None:
        """The prototype of an earlier sync where nothing touched it, else a new one."""
        is_mesh, is_round = isinstance(obj.data, bpy.types.Mesh), isinstance(obj.data, _ROUND)
        is_volume = self._is_volume(obj)
        is_mesh &= not is_volume
        uid = data_uid(obj.data) if is_mesh else original_uid(obj.data)
        key = (original_uid(obj), original_uid(instancer), uid)
        if obj.type == "LIGHT":
            self._lights[key] = obj.data
        known = self._kept.prototypes.get(key) if self._is_untouched(key) else None
        if known is not None and self._kept.links.has(key[0]):
            self._links.read(obj)
        if is_round and known is not None and self.meshes.knows_attributes:
            self.meshes.keep(known.mesh)
        elif known is None or is_round or is_volume or (is_mesh and self._mesh(obj, instancer).handle != known.mesh):
            known = self._prototype(obj, instancer, key)
        self._prototypes[key] = known
        return known

    def _note_traits(self, obj: bpy.types.Object | None) -> None:
        uid = original_uid(obj)
        if obj is not None and uid not in self._traits:
            is_known = not (self._changes.has_unlisted or uid in self._changes.objects)
            known = self._kept.traits.get(uid) if is_known else None
            self._traits[uid] = traits(obj) if known is None else known

    def _is_untouched(self, key: PrototypeKey) -> bool:
        is_known = self._knows_values and self._knows_materials
        return is_known and not (self._changes.has_unlisted or self._changes.lists_any(key))

    @staticmethod
    def _is_volume(obj: bpy.types.Object) -> bool:
        is_mesh = isinstance(obj.data, bpy.types.Mesh)
        return isinstance(obj.data, bpy.types.Volume) or (is_mesh and gas_domain(obj) is not None)

    def _mesh(self, obj: bpy.types.Object, instancer: bpy.types.Object | None) -> PlacedMesh | None:
        if not self._has_shape(obj, instancer) and isinstance(obj.data, bpy.types.Mesh) and len(obj.data.polygons):
            return self.meshes.empty()
        subdivision = self._subdivision(obj)
        drifts = self._drift is not None and subdivision is None and bends(obj, instancer)
        return self.meshes.placed(obj, original_uid(obj), subdivision, self._drift if drifts else None)

    def _subdivision(self, obj: bpy.types.Object) -> Subdivision | None:
        if not self._subdivides:
            return None
        found = subdivision_of(obj, self._depsgraph.scene_eval, self._depsgraph.mode == "RENDER")
        # Not the evaluated mesh: after a render with a Grease Pencil object, those of Blender 4.2 no longer tell.
        if found is None or not getattr(obj.original.data, "is_editmode", False):
            return found
        self._report.warn(f"Object '{obj.name}': is subdivided by its levels, not adaptively, while it is edited")
        return None

    def _prototype(
        self, obj: bpy.types.Object, instancer: bpy.types.Object | None, key: PrototypeKey
    ) -> Surface | Lamp | None:
        """None for what has no surface, or is hidden from every kind of ray."""
        self._links.read(obj)
        with self._report.about(("object", key)):
            return self._shown(obj, instancer, key)

    def _shown(
        self, obj: bpy.types.Object, instancer: bpy.types.Object | None, key: PrototypeKey
    ) -> Surface | Lamp | None:
        if obj.type == "LIGHT":
            return self._lamp(obj, instancer, key)
        if self._is_volume(obj):
            return self._volume(obj, instancer, key)
        if not isinstance(obj.data, bpy.types.Mesh | _ROUND):
            if obj.type not in _INVISIBLE_TYPES | _MESHED_TYPES | _DRAWN_TYPES:
                self._report.warn(f"Object '{obj.name}': type {obj.type} is not supported and left out")
            return None
        view_layer = self._depsgraph.view_layer_eval
        is_in_layer = {bpy.types.Mesh: view_layer.use_solid, bpy.types.Curves: view_layer.use_strand}
        is_shown = self._visibility(obj, instancer)[0] and is_in_layer.get(type(obj.data), True)
        mesh = self._mesh(obj, instancer) if is_shown else None
        if mesh is None:
            return None
        return self._surface(obj, instancer, key, mesh)

    def _volume(self, obj: bpy.types.Object, instancer: bpy.types.Object | None, key: PrototypeKey) -> Surface | None:
        """None for one whose material has no volume, or reads no grid that is there, as in Cycles."""
        if not self._visibility(obj, instancer)[0] or not self._depsgraph.view_layer_eval.use_volumes:
            return None
        material = self._materials.volume_handle(obj)
        if material is None:
            return None
        material_set, names = material
        if self._moment is not None:  # its boxes have other voxels
            return self._surface(obj, instancer, key, self.meshes.empty(), material_set)
        drift, frame = self._drift if moves(obj, instancer) else None, self._depsgraph.scene_eval.frame_current
        box = self.meshes.placed_volume(obj, original_uid(obj), names, frame, drift)
        return None if box is None else self._surface(obj, instancer, key, box, material_set)

    def _visibility(self, obj: bpy.types.Object, instancer: bpy.types.Object | None) -> tuple[int, bool]:
        """Bits of the rays that see it, and whether it is a holdout."""
        parent = obj if instancer is None else instancer
        view_layer = self._depsgraph.view_layer_eval
        holdout = parent.holdout_get(view_layer=view_layer)
        visibility = ray_visibility(obj) & ray_visibility(parent)
        if parent.indirect_only_get(view_layer=view_layer) and not holdout:
            visibility &= ~RAY_BITS["camera"]
        return visibility, holdout

    def _has_shape(self, obj: bpy.types.Object, instancer: bpy.types.Object | None) -> bool:
        return self._moment is None or self._moment.has_shape_of(obj, instancer)

    def _surface(
        self,
        obj: bpy.types.Object,
        instancer: bpy.types.Object | None,
        key: PrototypeKey,
        mesh: PlacedMesh,
        material_set: int | None = None,
    ) -> Surface:
        for text in mesh.warnings:
            self._report.warn(text)
        visibility, holdout = self._visibility(obj, instancer)
        random = name_random(obj.name) if instancer is None else math.nan
        name = self._name_handle(obj)
        if material_set is None:
            material_set = self._materials.set_handle(obj)
        values = object_values(self._value_names, obj, instancer)
        return Surface(
            mesh.handle if self._has_shape(obj, instancer) else self.meshes.empty().handle,
            material_set,
            name,
            visibility,
            holdout,
            obj.is_shadow_catcher or (instancer is not None and instancer.is_shadow_catcher),
            random,
            mesh.flat_axis,
            key,
            values,
            light_group=group_of_object(obj, instancer, self._light_groups),
            is_looked_at=self._moment is None or self._moment.has(obj, instancer),
        )

    def _lamp(self, obj: bpy.types.Object, instancer: bpy.types.Object | None, key: PrototypeKey) -> Lamp | None:
        if wants_shadow_caustics(obj.data):
            found = "only scattered rays find its light behind glass, and none of a lamp without size"
            self._report.warn(f"Light '{obj.name}': Shadow Caustics are not supported, {found}")
        visibility = self._visibility(obj, instancer)[0]
        return Lamp(obj.name, visibility, key, light_group=group_of_object(obj, instancer, self._light_groups))

    def _name_handle(self, obj: bpy.types.Object) -> int:
        label = (obj.name, obj.pass_index, _topmost(obj).name)
        self._report.matte_names["object"].add(label[0])
        self._report.matte_names["asset"].add(label[2])
        names = self._kept.names
        if label not in names:
            names[label] = self._builder.add_object_name(*label)
        return names[label]


def _topmost(obj: bpy.types.Object) -> bpy.types.Object:
    while obj.parent is not None:
        obj = obj.parent
    return obj


def read_places(depsgraph: bpy.types.Depsgraph) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Matrices (n, 4, 4), column by column as Blender has them, and random ids of all items, in order."""
    count = len(depsgraph.object_instances)
    matrices, random_ids = np.empty((count, 4, 4), np.float32), np.empty(count, np.int32)
    depsgraph.object_instances.foreach_get("matrix_world", matrices.ravel())
    depsgraph.object_instances.foreach_get("random_id", random_ids)
    return matrices, random_ids


def replace_instances(
    builder: SceneBuilder, kept: KeptInstances, placements: Placements, arrays: dict[str, NDArray]
) -> bool:
    """Give the builder these instances in place of those it has; False where they are the same."""
    names, rows = placements.value_names, placements.value_rows()
    has_same_values = names == kept.value_names and np.array_equal(rows, kept.value_rows)
    if not has_same_values:
        builder.set_instance_values(names, rows)
        kept.value_names, kept.value_rows = names, rows
    is_same = arrays.keys() == kept.arrays.keys()
    is_same &= all(np.array_equal(values, kept.arrays.get(name), equal_nan=True) for name, values in arrays.items())
    if is_same and has_same_values:
        return False
    if kept.arrays:
        builder.clear_instances()
    if len(arrays["mesh"]):
        builder.add_instances(**arrays)
    kept.arrays = arrays
    return True


def warn_of_flattened(builder: SceneBuilder, kept: KeptInstances, report: SyncReport) -> None:
    """Of the instances that the builder was just given."""
    with report.about("flattened"):
        if not builder.singular_instances:
            return
        names = [name for name, *_ in kept.names]  # handles count up from 0
        matrices = kept.arrays["object_to_world"].transpose(0, 2, 1)
        objects = np.unique(kept.arrays["object"][is_flattened(matrices)])
        shown = ", ".join(f"'{names[handle]}'" for handle in objects[:_NAMES_SHOWN])
        rest = f" and {len(objects) - _NAMES_SHOWN} more" if len(objects) > _NAMES_SHOWN else ""
        report.warn(f"Objects scaled to a line or a point, or beyond all range, are left out: {shown}{rest}")


def follow_moves(
    depsgraph: bpy.types.Depsgraph, builder: SceneBuilder, kept: KeptInstances, moved: Set[int], report: SyncReport
) -> bool:
    """Move surfaces. False, and nothing done, where the list is another one or a lamp moved: it takes more."""
    if kept.lamps.are_any(moved):
        return False
    matrices, random_ids = read_places(depsgraph)
    may_change = may_follow_others(kept.placements.value_names)
    if may_change or not np.array_equal(random_ids, kept.random_ids) or kept.lamps.have_moved(matrices):
        return False
    if replace_instances(builder, kept, kept.placements, instance_arrays(kept.placements, matrices, random_ids)):
        warn_of_flattened(builder, kept, report)
    return True


def traits(obj: bpy.types.Object) -> Traits:
    flags = (obj.is_holdout, obj.is_shadow_catcher, obj.show_instancer_for_viewport)
    return obj.name, obj.pass_index, tuple(obj.color), ray_visibility(obj), *flags


def ray_visibility(obj: bpy.types.Object) -> int:
    """Bits of the rays that an object lets itself be seen by."""
    return sum(bit for name, bit in RAY_BITS.items() if getattr(obj, f"visible_{name}"))
