"""The lamps of a scene in a builder; from sync to sync only those that moved or changed are given to it anew."""

from __future__ import annotations

from collections import Counter
from collections.abc import Set
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from . import SyncReport
from .changes import Changes, original_uid
from .light_groups import NO_GROUP
from .lights import light_call
from .materials import MaterialTable
from .placements import ALL_SETS, Lamp, Placements, PrototypeKey, identity_of

if TYPE_CHECKING:
    from cistern_core import SceneBuilder


@dataclass(frozen=True)
class PlacedLamp:
    """A lamp of the builder; handle None for one that gives no light."""

    handle: int | None
    lamp: Lamp
    place: bytes
    call: tuple = ()
    """What the builder was told."""


@dataclass
class KeptLamps:
    """What the builder holds of earlier syncs, by prototype and how many of it came before."""

    placed: dict[tuple[PrototypeKey, int], PlacedLamp] = field(default_factory=dict)
    free_handles: list[int] = field(default_factory=list)
    # By item that shows a lamp, in order.
    keys: list[tuple[PrototypeKey, int]] = field(default_factory=list)
    lamps: list[Lamp] = field(default_factory=list)
    items: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, np.intp))
    matrices: NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 4, 4), np.float32))

    def are_any(self, objects: Set[int]) -> bool:
        """Whether one of these objects is a lamp."""
        return any(lamp.key[0] in objects for lamp in self.lamps)

    def have_moved(self, matrices: NDArray[np.float32]) -> bool:
        """Whether one of the lamps, at the same items of the same list, stands elsewhere now."""
        return not np.array_equal(matrices[self.items], self.matrices)

    def touched(self, matrices: NDArray[np.float32], changes: Changes) -> set[PrototypeKey]:
        """Those that stand elsewhere now, at the same items of the same list, or that are among the changes."""
        is_still = (matrices[self.items] == self.matrices).all(axis=(1, 2))
        pairs = zip(self.lamps, is_still, strict=True)
        return {lamp.key for lamp, still in pairs if not still or changes.lists_any(lamp.key)}


def edited_lamps(
    depsgraph: bpy.types.Depsgraph, kept: KeptLamps, changes: Changes, matrices: NDArray[np.float32]
) -> dict[PrototypeKey, bpy.types.Object] | None:
    """The evaluated objects of the lamps that were moved or edited, at the same items of the same list.

    None where something else was edited, or a lamp that is placed by another object: it takes a look at every item."""
    own_keys = {lamp.key for lamp in kept.lamps if not lamp.key[1]}
    objects = {key[0] for key in own_keys}
    shading = {key[2] for key in own_keys} | {original_uid(depsgraph.scene.world)}
    has_others = changes.has_unlisted or changes.has_images or changes.meshes
    if has_others or not (changes.objects <= objects and changes.shading <= shading):
        return None
    listed = {original_uid(update.id): update.id for update in depsgraph.updates}
    touched = kept.touched(matrices, changes)
    if not touched <= own_keys or not listed.keys() >= {key[0] for key in touched}:
        return None
    edited = {key: listed[key[0]] for key in touched}
    return edited if all(original_uid(obj.data) == key[2] for key, obj in edited.items()) else None


class LampTable:
    """Lives as long as one sync. `exported` counts the lamps that it gave to the builder or took away."""

    def __init__(
        self, builder: SceneBuilder, materials: MaterialTable, report: SyncReport, kept: KeptLamps, changes: Changes
    ) -> None:
        self._builder = builder
        self._materials = materials
        self._report = report
        self._kept = kept
        self._changes = changes
        self.exported = 0

    def place(
        self,
        placements: Placements,
        matrices: NDArray[np.float32],
        lights: dict[PrototypeKey, bpy.types.Light],
    ) -> None:
        """Make the builder's lamps those of the placements; `matrices` (n, 4, 4) hold columns."""
        kept = self._kept
        items = placements.entries_showing(Lamp)
        lamps = [placements.prototypes[index] for index in placements.prototype_of[items]]
        self._materials.keep(lamp.key[2] for lamp in lamps)
        is_same_list = lamps == kept.lamps
        if not is_same_list:
            self._remove_missing(lamps)
        is_known = (
            (matrices[items] == kept.matrices).all(axis=(1, 2)) if is_same_list else np.zeros(len(items), np.bool_)
        )
        for index, key in enumerate(kept.keys):
            if not is_known[index] or self._is_touched(lamps[index]):
                self._place(key, lamps[index], matrices[items[index]], lights)
        kept.items, kept.lamps, kept.matrices = items, lamps, matrices[items]

    def _remove_missing(self, lamps: list[Lamp]) -> None:
        """Take the list of lamps over, and those that it lacks out of the builder."""
        kept = self._kept
        counts: Counter[PrototypeKey] = Counter()
        kept.keys = []
        for lamp in lamps:
            kept.keys.append((lamp.key, counts[lamp.key]))
            counts[lamp.key] += 1
        for key in kept.placed.keys() - set(kept.keys):
            self._free(kept.placed.pop(key))

    def _place(
        self,
        key: tuple[PrototypeKey, int],
        lamp: Lamp,
        matrix: NDArray[np.float32],
        lights: dict[PrototypeKey, bpy.types.Light],
    ) -> None:
        known = self._kept.placed.get(key)
        is_known = known is not None and (known.lamp, known.place) == (lamp, matrix.tobytes())
        if not is_known or self._is_touched(lamp):
            with self._report.about(("lamp", key)):
                self._kept.placed[key] = self._add(lamp, lights[lamp.key], matrix, known, identity_of(*key[0], key[1]))

    def _is_touched(self, lamp: Lamp) -> bool:
        return self._changes.is_everything or self._changes.lists_any(lamp.key)

    def _free(self, placed: PlacedLamp | None) -> None:
        if placed is not None and placed.handle is not None:
            self._builder.remove_light(placed.handle)
            self._kept.free_handles.append(placed.handle)
            self.exported += 1

    def _add(
        self, lamp: Lamp, light: bpy.types.Light, matrix: NDArray[np.float32], known: PlacedLamp | None, key: int
    ) -> PlacedLamp:
        place = matrix.tobytes()
        call = light_call(light, matrix.T.astype(np.float64))
        if call is None:
            self._report.warn(f"Light '{lamp.name}': it has no size, by its settings or its scale, and gives no light")
            self._free(known)
            return PlacedLamp(None, lamp, place)
        material = self._materials.light_handle(light)
        told = (call.method, material, *(np.asarray(value).tobytes() for value in call.arguments.values()))
        handle = known.handle if known is not None else None
        if handle is not None and (known.lamp, known.call) == (lamp, told):
            return PlacedLamp(handle, lamp, place, told)
        if handle is None and self._kept.free_handles:
            handle = self._kept.free_handles.pop()
        add = getattr(self._builder, call.method)
        common = {"name": lamp.name, "visibility": lamp.visibility, "material": material, "key": key}
        if (lamp.lit_sets, lamp.blocker_sets) != (ALL_SETS, ALL_SETS):
            common |= {"lit_sets": lamp.lit_sets, "blocker_sets": lamp.blocker_sets}
        if lamp.light_group != NO_GROUP:
            common["light_group"] = lamp.light_group
        handle = add(**common, replace=handle, **call.arguments)
        self.exported += 1
        return PlacedLamp(handle, lamp, place, told)
