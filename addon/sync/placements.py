"""What instances show and where: prototypes, the arrays of the core, and Cycles' random numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .instance_values import NOTHING, Rgba
from .light_groups import NO_GROUP

_LARGEST_BELOW_ONE = np.nextafter(np.float32(1.0), np.float32(0.0))
_UINT32_MASK = 0xFFFFFFFF
_UINT64_MASK = 0xFFFFFFFFFFFFFFFF
ALL_SETS = _UINT64_MASK  # of emitters: every set of receivers, or of blockers (native/scene/light_linking.h)
_ODD_64 = np.uint64(0x9E3779B97F4A7C15)  # multiplying by it scatters small numbers over 64 bits
_COPLANAR = 1e-6  # kCoplanar of native/scene/scene_checks.cpp
_CARD_THICKNESS = 1e-4  # of a flattened object, beside its narrower side

_KEY_OF_NOTHING = np.uint64(1)  # what has it is known at no other moment

_NO_LINKS = (0, 0, ALL_SETS, ALL_SETS)

# Of an object, of what instances it (0: nothing) and of its evaluated geometry or lamp.
PrototypeKey = tuple[int, int, int]


@dataclass(frozen=True)
class Surface:
    """What all instances of one geometry of one object have in common."""

    mesh: int
    material_set: int
    object: int
    visibility: int
    holdout: bool
    shadow_catcher: bool
    random: float
    """Object Info > Random; not a number where each instance has its own."""
    flat_axis: int = -1
    """Local axis along which every coordinate of the mesh is 0; -1 for a solid."""
    key: PrototypeKey = (0, 0, 0)
    values: tuple[Rgba, ...] = ()
    """What materials read of it, by the names of the placements."""
    light_set: int = 0
    shadow_set: int = 0
    lit_sets: int = ALL_SETS
    blocker_sets: int = ALL_SETS
    light_group: int = NO_GROUP
    is_looked_at: bool = True
    """False at moments of a shutter that pass it by."""

    @property
    def links(self) -> tuple[int, int, int, int]:
        return self.light_set, self.shadow_set, self.lit_sets, self.blocker_sets


@dataclass(frozen=True)
class Lamp:
    """What all instances of one lamp object have in common."""

    name: str
    visibility: int
    key: PrototypeKey = (0, 0, 0)
    lit_sets: int = ALL_SETS
    blocker_sets: int = ALL_SETS
    light_group: int = NO_GROUP


def identity_of(*numbers: int) -> int:
    """64 bits that stand for these numbers: Python's hash of them, which is the same in every process."""
    return hash(numbers) & _UINT64_MASK


@dataclass(frozen=True)
class Placements:
    """What each item of `depsgraph.object_instances` shows. An entry for each item in order, and after them one for
    each head of hair that an item shows beside its mesh."""

    prototypes: list[Surface | Lamp] = field(default_factory=list)
    prototype_of: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))
    """Of entries; -1 for those that show nothing."""
    value_names: tuple[str, ...] = ()
    item_values: NDArray[np.float32] | None = None
    """What entries have in place of their prototypes' values, (entries, names, 4), where it is a number."""
    hair_items: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, np.intp))
    """Items of the entries for hair."""

    def value_rows(self) -> NDArray[np.float32]:
        """(n, names, 4): one row for each prototype, or one for each item where items differ."""
        if not self.value_names:
            return np.empty((0, 0, 4), np.float32)
        nothing = (NOTHING,) * len(self.value_names)
        rows = np.array([getattr(p, "values", nothing) for p in self.prototypes], np.float32)
        rows = rows.reshape(-1, len(self.value_names), 4)
        if self.item_values is None:
            return rows
        of_items = rows[self.prototype_of] if len(rows) else np.zeros_like(self.item_values)
        return np.where(np.isnan(self.item_values), of_items, self.item_values)

    def value_row_of(self, entries: NDArray[np.intp]) -> NDArray[np.int32]:
        if not self.value_names:
            return np.full(len(entries), -1, np.int32)
        return self.prototype_of[entries] if self.item_values is None else entries.astype(np.int32)

    def entries_showing(self, kind: type) -> NDArray[np.intp]:
        """Entries that show a surface, or a lamp (those are items), in order."""
        chosen = np.array([isinstance(p, kind) for p in self.prototypes] + [False], np.bool_)
        return np.flatnonzero(chosen[self.prototype_of])  # -1 looks up the last entry

    def items_of(self, entries: NDArray[np.intp]) -> NDArray[np.intp]:
        items = len(self.prototype_of) - len(self.hair_items)
        return np.concatenate((np.arange(items), self.hair_items))[entries] if len(self.hair_items) else entries


def instance_arrays(
    placements: Placements, matrices: NDArray[np.float32], random_ids: NDArray[np.int32]
) -> dict[str, NDArray]:
    """The arguments of `SceneBuilder.add_instances` for all placed surfaces; `matrices` (n, 4, 4) hold columns."""
    entries = placements.entries_showing(Surface)
    items, prototype = placements.items_of(entries), placements.prototype_of[entries]

    def column(member: str, dtype: type) -> NDArray:
        return np.array([getattr(p, member, 0) for p in placements.prototypes], dtype)[prototype]

    extras = {}
    if any(isinstance(p, Surface) and p.links != _NO_LINKS for p in placements.prototypes):
        extras = {
            "link_sets": np.stack([column("light_set", np.uint8), column("shadow_set", np.uint8)], 1),
            "links": np.stack([column("lit_sets", np.uint64), column("blocker_sets", np.uint64)], 1),
        }
    if any(isinstance(p, Surface) and p.shadow_catcher for p in placements.prototypes):
        extras["shadow_catcher"] = column("shadow_catcher", np.uint8)
    if any(isinstance(p, Surface) and p.light_group != NO_GROUP for p in placements.prototypes):
        extras["light_group"] = column("light_group", np.int16)
    random = column("random", np.float32)
    keys = instance_keys(placements.prototypes, prototype, random_ids[items])
    columns = np.ascontiguousarray(matrices[items])
    restore_normal_axis(columns, column("flat_axis", np.int32))
    thicken_flattened(columns)
    return {
        "mesh": column("mesh", np.int32),
        "material_set": column("material_set", np.int32),
        "object": column("object", np.int32),
        "object_to_world": np.ascontiguousarray(columns.transpose(0, 2, 1)),
        "visibility": column("visibility", np.uint8),
        "holdout": column("holdout", np.uint8),
        "random": np.where(np.isnan(random), random_fraction(random_ids[items]), random),
        "values": placements.value_row_of(entries),
        "keys": np.where(column("is_looked_at", np.bool_), keys, _KEY_OF_NOTHING),
        **extras,
    }


def instance_keys(
    prototypes: Sequence[Surface | Lamp], prototype_of: NDArray[np.int32], random_ids: NDArray[np.int32]
) -> NDArray[np.uint64]:
    """Numbers that stand for the same instances as long as they exist; 0 for those that cannot be told apart."""
    owners = np.array([identity_of(*prototype.key[:2]) for prototype in prototypes], np.uint64)
    keys = owners[prototype_of] ^ (random_ids.view(np.uint32).astype(np.uint64) * _ODD_64)
    keys ^= _geometry_numbers(prototypes, prototype_of, owners, keys) * _ODD_64
    _, index, counts = np.unique(keys, return_inverse=True, return_counts=True)
    keys[counts[index] > 1] = 0
    return keys


def _geometry_numbers(
    prototypes: Sequence[Surface | Lamp],
    prototype_of: NDArray[np.int32],
    owners: NDArray[np.uint64],
    keys: NDArray[np.uint64],
) -> NDArray[np.uint64]:
    """Of each entry, which of those geometries it shows that have its owners and random id in common."""
    numbers = np.zeros(len(prototype_of), np.uint64)
    _, index, counts = np.unique(owners, return_inverse=True, return_counts=True)
    known: dict[int, dict[int, int]] = {}
    for entry in np.flatnonzero((counts[index] > 1)[prototype_of]) if len(owners) else ():
        geometries = known.setdefault(int(keys[entry]), {})
        geometry = prototypes[prototype_of[entry]].key[2]
        numbers[entry] = geometries.setdefault(geometry, len(geometries))
    return numbers


def restore_normal_axis(columns: NDArray[np.float32], flat_axes: NDArray[np.int32]) -> None:
    """Make matrices invertible that scale a flat mesh by 0 across its plane, where scale changes nothing."""
    for axis in range(3):
        flattened = np.flatnonzero((flat_axes == axis) & ~columns[:, axis, :3].any(axis=1))
        normals = np.cross(columns[flattened, (axis + 1) % 3, :3], columns[flattened, (axis + 2) % 3, :3])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        columns[flattened, axis, :3] = normals / np.where(lengths > 0.0, lengths, 1.0)


def thicken_flattened(columns: NDArray[np.float32]) -> None:
    """Make matrices invertible that flatten to a plane: what they show becomes a card, as thick as can be told from
    none. Those that flatten to a line or a point stay as they are."""
    flattened = np.flatnonzero(is_flattened(columns) & np.isfinite(columns[:, :3, :3]).all(axis=(1, 2)))
    linear = columns[flattened, :3, :3].astype(np.float64)
    left, sizes, right = np.linalg.svd(linear)
    lengths = np.linalg.norm(linear, axis=2).prod(axis=1)
    spans_plane = (sizes[:, 1] > _COPLANAR * sizes[:, 0]) & (sizes[:, 0] < np.sqrt(np.finfo(np.float32).max))
    areas = np.where(spans_plane, sizes[:, 0] * sizes[:, 1], 1.0)
    # Seen by `is_flattened`, edges that all lie in the plane need more.
    thickness = np.maximum(_CARD_THICKNESS * sizes[:, 1], 4.0 * _COPLANAR * lengths / areas)
    # Which side is the front is left to rounding, as in Cycles; where an axis is exactly 0 nothing is mirrored.
    x, y, z = np.moveaxis(columns[flattened, :3, :3], 1, 0)
    with np.errstate(over="ignore", invalid="ignore"):
        is_mirrored = (np.cross(x, y) * z).sum(axis=1, dtype=np.float32) < 0.0
    mirror = np.linalg.det(left) * np.linalg.det(right) * np.where(is_mirrored, -1.0, 1.0)
    sizes[:, 2] = np.copysign(thickness, mirror)
    thickened = (left * sizes[:, None, :]) @ right
    columns[flattened[spans_plane], :3, :3] = thickened[spans_plane]


def is_flattened(columns: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which object-to-world matrices the core leaves out: those without a useful inverse (scene_checks.cpp)."""
    linear = np.ascontiguousarray(np.moveaxis(columns[:, :3, :3], 0, 2), np.float64)  # faster than numpy.linalg
    (a, b, c), (d, e, f), (g, h, i) = linear
    determinants = np.abs(a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g))
    edges = np.sqrt((a * a + b * b + c * c) * (d * d + e * e + f * f) * (g * g + h * h + i * i))
    range_of_floats = np.finfo(np.float32)
    in_range = (determinants >= range_of_floats.tiny) & (determinants <= range_of_floats.max)
    return ~(in_range & (determinants > _COPLANAR * edges))


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


Words = TypeVar("Words", int, NDArray[np.int64])


def hash_pair(x: Words, y: int) -> Words:
    """Jenkins' lookup3 for two words (burtleburtle.net/bob/c/lookup3.c, `final`)."""

    def rotated(v: Words, bits: int) -> Words:
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
