"""Strands of hair to arrays: hair curves, and the hair of particle systems, by Cycles' rules (blender/curves.cpp)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Set
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, takewhile
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import versions
from .colour import srgb_to_linear
from .drift import Drift
from .meshes import read_attribute_values
from .nodes.value_names import STRAND, STRAND_INTERCEPT, STRAND_LENGTH, STRAND_NORMAL, STRAND_RANDOM, STRAND_THICKNESS
from .placements import hash_pair

_DEFAULT_RADIUS = 0.005  # of curves without radii, as Cycles 5.0 shows them
_POLY = 1  # of the attribute "curve_type"
_STRAND_DOMAINS = {"POINT": "POINT", "CURVE": "FACE"}
# Types of modifiers that may add or remove UV maps or colours.
_CHANGE_LAYERS = frozenset(
    {"BOOLEAN", "DATA_TRANSFER", "DYNAMIC_PAINT", "FLUID", "MESH_SEQUENCE_CACHE", "NODES", "OCEAN", "PARTICLE_INSTANCE"}
    | {"REMESH", "SCREW", "SKIN"}
)


@dataclass(frozen=True)
class StrandArrays:
    """The arguments of `SceneBuilder.add_strands` save name and handle."""

    positions: NDArray[np.float32]
    radii: NDArray[np.float32]
    strand_offsets: NDArray[np.int32]
    material_indices: NDArray[np.int32] | None = None
    shape: str = "SPLINES"
    attributes: list[tuple[str, str, NDArray[np.float32]]] = field(default_factory=list)


def curve_arrays(curves: bpy.types.Curves, wanted: Set[str], drift: Drift | None = None) -> StrandArrays | None:
    """Of a data-block of hair curves; None for one without keys."""
    if not len(curves.points) or not len(curves.curves):
        return None
    positions = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", positions.ravel())
    offsets = np.empty(len(curves.curves) + 1, np.int32)
    curves.curve_offset_data.foreach_get("value", offsets)
    radius = curves.attributes.get("radius")
    radii = np.full(len(positions), _DEFAULT_RADIUS, np.float32)
    if radius is not None and len(radius.data) == len(radii):
        radius.data.foreach_get("value", radii)
    attributes = _curve_attributes(curves, wanted)
    if STRAND_NORMAL in wanted:
        normals = np.empty_like(positions)
        curves.normals.foreach_get("vector", normals.ravel())
        attributes.append((STRAND_NORMAL, "POINT", normals))
    if drift is not None:
        attributes += drift.columns(curves)
    shape = "LINES" if _are_straight(curves) else "SPLINES"
    strands = StrandArrays(positions, radii, offsets, None, shape, attributes)
    return _with_info(strands, wanted)


def _are_straight(curves: bpy.types.Curves) -> bool:
    """Where the first is a poly curve; all others are drawn as Catmull-Rom splines through their keys, as in Cycles."""
    types = curves.attributes.get("curve_type")
    return types is not None and versions.poly_curves_are_straight() and types.data[0].value == _POLY


def _curve_attributes(curves: bpy.types.Curves, wanted: Set[str]) -> list[tuple[str, str, NDArray[np.float32]]]:
    """The first with two numbers for each curve, which is the UV map, and those that are wanted."""
    usable = [a for a in curves.attributes if a.domain in _STRAND_DOMAINS]
    uv_map = next((a.name for a in usable if a.data_type == "FLOAT2" and a.domain == "CURVE"), None)
    names = [a.name for a in usable if a.name in wanted and a.name != uv_map]
    found = ((name, curves.attributes[name]) for name in ([uv_map] if uv_map else []) + names)
    values = ((name, _STRAND_DOMAINS[a.domain], read_attribute_values(a)) for name, a in found)
    return [value for value in values if value[2] is not None]


def _begins_with_pairs_of_points(attributes: list[tuple[str, str, NDArray[np.float32]]]) -> bool:
    """Which the core would take for the UV map."""
    return bool(attributes) and attributes[0][1] == "POINT" and attributes[0][2].shape[-1] == 2


def particle_arrays(
    obj: bpy.types.Object, modifier: bpy.types.ParticleSystemModifier, is_render: bool, wanted: Set[str]
) -> StrandArrays | None:
    """Of a particle system of an evaluated object, in its space; None for one without strands.

    Blender has a call for each key, half a microsecond."""
    system, settings = modifier.particle_system, modifier.particle_system.settings
    first, end = _particle_range(system, is_render)
    keys = 2 ** (settings.render_step if is_render else settings.display_step) + 1
    if settings.kink == "SPIRAL":
        keys += settings.kink_extra_steps
    if end <= first:
        return None
    read = system.co_hair
    calls = (read(object=obj, particle_no=number, step=step) for number in range(first, end) for step in range(keys))
    rows = _rows(calls, (end - first) * keys, 3)
    if not rows.any():  # Blender has not evaluated it, as in edit mode; to ask it for more would end it
        return None
    world = _with_last_keys(rows.reshape(end - first, keys, 3)).reshape(-1, 3)
    to_object = _inverse(obj)
    positions = world @ to_object[:3, :3].T + to_object[:3, 3]
    positions = np.ascontiguousarray(positions, np.float32)
    strands = end - first
    offsets = np.arange(0, strands * keys + 1, keys, dtype=np.int32)
    radii = _particle_radii(settings, _times(positions, offsets)[0].reshape(strands, keys))
    slots = np.full(strands, settings.material - 1, np.int32)
    attributes = _emitter_attributes(obj, modifier, first, end, wanted)
    return _with_info(StrandArrays(positions, radii.ravel(), offsets, slots, attributes=attributes), wanted)


def _with_last_keys(keys: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of strands, (strands, keys, 3): shortened ones have fewer keys, for which Blender returns zeros. They stay where
    the last one is, as in Cycles."""
    is_there = keys.any(axis=2)
    if is_there[:, -1].all():
        return keys
    steps = np.arange(keys.shape[1])
    last = np.where(is_there, steps, 0).max(axis=1, keepdims=True)
    return np.take_along_axis(keys, np.minimum(steps, last)[:, :, None], axis=1)


def _inverse(obj: bpy.types.Object) -> NDArray[np.float64]:
    """World to object; of a flattened one Blender's, which is nearly so."""
    try:
        return np.linalg.inv(np.array(obj.matrix_world, np.float64))
    except np.linalg.LinAlgError:
        return np.array(obj.matrix_world.inverted_safe(), np.float64)


def _rows(vectors: Iterable[Iterable[float]], count: int, components: int) -> NDArray[np.float64]:
    """Blender's vectors as an array: a tenth of the time that NumPy takes for a list of them."""
    return np.fromiter(chain.from_iterable(vectors), np.float64, count * components).reshape(count, components)


def _particle_range(system: bpy.types.ParticleSystem, is_render: bool) -> tuple[int, int]:
    """Numbers of the strands that are shown: children hide their parents."""
    parents, children = len(system.particles), len(system.child_particles)
    if not is_render:
        children = children * system.settings.display_percentage // 100
    hides_parents = system.settings.child_type != "NONE" and children > 0
    return (parents if hides_parents else 0), parents + children


def _particle_radii(settings: bpy.types.ParticleSettings, time: NDArray[np.float32]) -> NDArray[np.float32]:
    """At the keys of strands, (strands, keys); `time`: how far along, 0 to 1."""
    shape = settings.shape
    with np.errstate(divide="ignore"):
        power = np.float64(1.0 + shape) if shape < 0.0 else 1.0 / np.float64(1.0 - shape)
    scale = 0.5 * settings.radius_scale
    root, tip = scale * settings.root_radius, scale * settings.tip_radius
    radii = (np.clip(1.0 - time, 0.0, 1.0) ** power) * (root - tip) + tip
    if settings.use_close_tip:
        radii[:, -1] = 0.0
    return radii.astype(np.float32)


def _emitter_attributes(
    obj: bpy.types.Object, modifier: bpy.types.ParticleSystemModifier, first: int, end: int, wanted: Set[str]
) -> list[tuple[str, str, NDArray[np.float32]]]:
    """UV maps, the active render one first, and wanted colours where strands are rooted.

    Blender looks both up by their numbers in the mesh that the modifier found, unchecked: modifiers behind it may have
    added more."""
    system, parents, mesh = modifier.particle_system, modifier.particle_system.particles, obj.data
    if not isinstance(mesh, bpy.types.Mesh) or not len(parents):
        return []

    def column(read: Callable, components: int, name: str, **number: int) -> tuple[str, str, NDArray[np.float32]]:
        last = len(parents) - 1
        known = parents[:]  # to look one up in Blender's list takes as long as the call
        rows = (read(modifier, particle=known[min(i, last)], particle_no=i, **number) for i in range(first, end))
        return name, "FACE", _rows(rows, end - first, components).astype(np.float32)

    origin = obj.original.data
    before, behind = _layers_may_change(obj, modifier)
    found = partial(_layers_found, before=before, behind=behind)
    rendered = next((layer.name for layer in mesh.uv_layers if layer.active_render), "")
    uv_maps = sorted(found(origin.uv_layers, mesh.uv_layers), key=lambda item: item[1] != rendered)
    columns = [column(system.uv_on_emitter, 2, name, uv_no=number) for number, name in uv_maps]
    colors = [item for item in found(origin.vertex_colors, mesh.vertex_colors) if item[1] in wanted]
    encoded = [column(system.mcol_on_emitter, 3, name, vcol_no=number) for number, name in colors]
    return columns + [(name, domain, srgb_to_linear(values)) for name, domain, values in encoded]


def _layers_may_change(obj: bpy.types.Object, modifier: bpy.types.ParticleSystemModifier) -> tuple[bool, bool]:
    """Whether modifiers before this one, and behind it, may add or remove UV maps and colours."""
    place = obj.modifiers.find(modifier.name)
    changes = [item.type in _CHANGE_LAYERS for item in obj.modifiers]
    return any(changes[:place]), any(changes[place + 1 :])


def _layers_found(
    original: Iterable[Any], evaluated: Iterable[Any], before: bool, behind: bool
) -> list[tuple[int, str]]:
    """Layers of the evaluated mesh that the modifier found too, by their numbers there: as at the end, if nothing
    `behind` changes them; as at the beginning, if nothing `before` does; else those that begin both."""
    first, last = [layer.name for layer in original], [layer.name for layer in evaluated]
    if not behind:
        return list(enumerate(last))
    if not before:
        return [(number, name) for number, name in enumerate(first) if name in last]
    same = takewhile(lambda names: names[0] == names[1], zip(first, last, strict=False))
    return [(number, name) for number, (name, _) in enumerate(same)]


def _times(
    positions: NDArray[np.float32], offsets: NDArray[np.int32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """How far along its strand each key is, 0 to 1, and the length of each strand."""
    steps = np.zeros(len(positions), np.float64)
    steps[1:] = np.linalg.norm(np.diff(positions.astype(np.float64), axis=0), axis=1)
    counts = np.diff(offsets)
    is_first = offsets[:-1][counts > 0]
    steps[is_first] = 0.0
    sums = np.cumsum(np.nan_to_num(steps, posinf=0.0))
    starts = np.zeros(len(counts))
    starts[counts > 0] = sums[is_first]
    along = sums - np.repeat(starts, counts)
    lengths = np.zeros(len(counts))
    lengths[counts > 0] = along[offsets[1:][counts > 0] - 1]
    of_keys = np.repeat(lengths, counts)
    times = np.divide(along, of_keys, out=np.zeros_like(along), where=of_keys > 0.0)
    return times.astype(np.float32), lengths.astype(np.float32)


def random_of_numbers(count: int) -> NDArray[np.float32]:
    """Of each strand or point, (count, 1), in [0, 1]: a hash of its number."""
    return (hash_pair(np.arange(count), 0) / float(0xFFFFFFFF)).astype(np.float32)[:, None]


def _with_info(strands: StrandArrays, wanted: Set[str]) -> StrandArrays:
    """Adds what outputs of the Hair Info node read."""
    count = len(strands.strand_offsets) - 1
    columns: list[tuple[str, str, NDArray[np.float32]]] = []
    has_no_uv_map = _begins_with_pairs_of_points(strands.attributes)
    if STRAND in wanted or has_no_uv_map:
        columns.append((STRAND, "FACE", np.ones((count, 1), np.float32)))
    if wanted & {STRAND_INTERCEPT, STRAND_LENGTH}:
        times, lengths = _times(strands.positions, strands.strand_offsets)
        columns.append((STRAND_INTERCEPT, "POINT", times[:, None]))
        columns.append((STRAND_LENGTH, "FACE", lengths[:, None]))
    if STRAND_THICKNESS in wanted:
        columns.append((STRAND_THICKNESS, "POINT", 2.0 * strands.radii[:, None]))
    if STRAND_RANDOM in wanted:
        columns.append((STRAND_RANDOM, "FACE", random_of_numbers(count)))
    strands.attributes[:] = columns + strands.attributes if has_no_uv_map else strands.attributes + columns
    return strands
