"""Light and shadow linking: which objects an emitter lights, and which throw shadows in its light.

The rules are Blender's (`depsgraph_light_linking.cc`), whose results Python does not see: an emitter names a collection
of receivers and one of blockers. The objects in it, and in the collections below, are included or excluded; what counts
is said where they hang on the emitter's own collection, later entries overrule earlier ones, and objects overrule
collections. If any is included, only those are lit; else all but the excluded ones. Objects that all emitters treat
alike are a set, and emitters name the sets they work on by 64 bits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import bpy

from . import SyncReport
from .changes import original_uid
from .placements import ALL_SETS, Lamp, Surface

_SET_COUNT = 64
_DEFAULT_SET = 0  # of objects that no emitter tells from others

# What a collection says of objects, by their session ids: whether they are included.
_States = dict[int, bool]


@dataclass
class _Kind:
    """One of the two kinds of linking: the collections of emitters, by their session ids."""

    what: str
    collections: dict[int, _States] = field(default_factory=dict)
    collection_of: dict[int, int] = field(default_factory=dict)
    """By emitter, an object's session id."""

    def read(self, emitter: int, collection: bpy.types.Collection | None) -> None:
        if collection is None:
            return
        uid = original_uid(collection)
        self.collection_of[emitter] = uid
        if uid not in self.collections:
            self.collections[uid] = dict(_states(collection.original or collection))


class LightLinks:
    """The links of one sync: first `read` of all objects, then `link` what they show."""

    def __init__(self) -> None:
        self._receivers = _Kind("lights they receive")
        self._blockers = _Kind("lights they block")

    def __bool__(self) -> bool:
        return bool(self._receivers.collection_of or self._blockers.collection_of)

    def has(self, emitter: int) -> bool:
        return emitter in self._receivers.collection_of or emitter in self._blockers.collection_of

    def read(self, obj: bpy.types.Object) -> None:
        linking = obj.light_linking
        receivers, blockers = linking.receiver_collection, linking.blocker_collection
        if receivers is not None or blockers is not None:
            self._receivers.read(original_uid(obj), receivers)
            self._blockers.read(original_uid(obj), blockers)

    def link(self, prototypes: Iterable[Surface | Lamp], report: SyncReport) -> list[Surface | Lamp]:
        """The same, with their sets; without any links none is changed."""
        prototypes = list(prototypes)
        if not self:
            return prototypes
        shown = {uid for p in prototypes if isinstance(p, Surface) for uid in p.key[:2]}
        light_sets, lit = _solve(self._receivers, shown, report)
        shadow_sets, blockers = _solve(self._blockers, shown, report)

        def linked(p: Surface | Lamp) -> Surface | Lamp:
            emitter, instancer = p.key[:2]
            sets = {
                "lit_sets": lit.get(self._receivers.collection_of.get(emitter), ALL_SETS),
                "blocker_sets": blockers.get(self._blockers.collection_of.get(emitter), ALL_SETS),
            }
            if isinstance(p, Surface):  # what instances it goes first
                sets["light_set"] = light_sets.get(instancer) or light_sets.get(emitter, _DEFAULT_SET)
                sets["shadow_set"] = shadow_sets.get(instancer) or shadow_sets.get(emitter, _DEFAULT_SET)
            return replace(p, **sets)

        return [linked(p) for p in prototypes]


def _states(collection: bpy.types.Collection) -> Iterator[tuple[int, bool]]:
    """Later ones count."""
    for child, link in zip(collection.children, collection.collection_children, strict=True):
        is_included = link.light_linking.link_state == "INCLUDE"
        yield from ((uid, is_included) for uid in _objects_below(child))
    for obj, link in zip(collection.objects, collection.collection_objects, strict=True):
        yield original_uid(obj), link.light_linking.link_state == "INCLUDE"


def _objects_below(collection: bpy.types.Collection) -> Iterator[int]:
    for child in collection.children:
        yield from _objects_below(child)
    yield from map(original_uid, collection.objects)


def _solve(kind: _Kind, shown: set[int], report: SyncReport) -> tuple[dict[int, int], dict[int, int]]:
    """The set of each object that is shown and not in the default one, and the bits of each collection."""
    opinions: dict[int, dict[int, bool]] = {}
    for collection, states in kind.collections.items():
        for obj, is_included in states.items():
            if obj in shown:
                opinions.setdefault(obj, {})[collection] = is_included
    numbers: dict[tuple[tuple[int, bool], ...], int] = {}
    sets: dict[int, int] = {}
    included = dict.fromkeys(kind.collections, 0)
    excluded = dict.fromkeys(kind.collections, 0)
    for obj, opinion in opinions.items():
        number = numbers.setdefault(tuple(opinion.items()), len(numbers) + 1)
        if number >= _SET_COUNT:
            continue
        sets[obj] = number
        for collection, is_included in opinion.items():
            (included if is_included else excluded)[collection] |= 1 << number
    if len(numbers) >= _SET_COUNT:
        report.warn(
            f"Light linking tells {len(numbers)} groups of objects apart by the {kind.what}: "
            f"{_SET_COUNT - 1} are known, the rest is treated as not linked"
        )
    # An included object that is not shown, too, makes a collection one that lights nothing else.
    for collection, states in kind.collections.items():
        if not included[collection] and any(states.values()):
            included[collection] = 1 << _SET_COUNT
    masks = {c: (included[c] or ALL_SETS) & ~excluded[c] & ALL_SETS for c in kind.collections}
    return sets, masks
