"""What can be baked: for each of Blender's bake types the passes of the core, and the colours made of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Reader = Callable[[str], NDArray[np.float32]]

# Of a menu, by Blender's identifiers.
BAKE_ITEMS = (
    ("COMBINED", "Combined", "All light that leaves the surface, or some kinds of it"),
    (
        "AO",
        "Ambient Occlusion",
        "How much nearby surfaces, as near as the world says, hide from each point",
    ),
    ("POSITION", "Position", "Where the surface is in the world, in metres"),
    ("NORMAL", "Normal", "Where the surface faces, with its bump and normal maps"),
    ("UV", "UV", "Coordinates of the UV map that is rendered"),
    ("ROUGHNESS", "Roughness", "How rough reflections and refractions are, mean over the parts of a material"),
    ("EMIT", "Emit", "Light that the surface itself sends"),
    ("DIFFUSE", "Diffuse", "Light that is scattered evenly, its colour, or both"),
    ("GLOSSY", "Glossy", "Light that is reflected, the colour of reflections, or both"),
    ("TRANSMISSION", "Transmission", "Light that is refracted, its colour, or both"),
)

# Bits of a bake's filter (source/blender/makesdna/DNA_scene_types.h).
EMIT, DIFFUSE, GLOSSY, TRANSMISSION = 1 << 1, 1 << 2, 1 << 3, 1 << 4
DIRECT, INDIRECT, COLOR = 1 << 6, 1 << 7, 1 << 8
KINDS = {"DIFFUSE": ("Diffuse", DIFFUSE), "GLOSSY": ("Glossy", GLOSSY), "TRANSMISSION": ("Transmission", TRANSMISSION)}
PARTS = {"Direct": DIRECT, "Indirect": INDIRECT}
ALL_LIGHT = EMIT | DIFFUSE | GLOSSY | TRANSMISSION | DIRECT | INDIRECT


@dataclass(frozen=True)
class BakeType:
    core_passes: tuple[str, ...]
    color: Callable[[Reader], NDArray[np.float32]]
    """(height, width, 3)."""


def find_type(identifier: str, pass_filter: int) -> BakeType | None:
    """By Blender's identifier and filter; None for what there is not."""
    if identifier == "COMBINED":
        return combined(pass_filter)
    if identifier in KINDS:
        return light_of_kind(KINDS[identifier][0], pass_filter)
    return SURFACE_TYPES.get(identifier)


def combined(pass_filter: int) -> BakeType:
    """All light, or some kinds of it with their colours."""
    if pass_filter & ALL_LIGHT == ALL_LIGHT:
        return BakeType(("Combined",), lambda read: read("Combined")[..., :3])
    kinds = [light_of_kind(name, pass_filter | COLOR) for name, bit in KINDS.values() if pass_filter & bit]
    kinds = kinds if pass_filter & (DIRECT | INDIRECT) else []
    emission = [EMISSION] if pass_filter & EMIT else []
    return sum_of(kinds + emission)


def light_of_kind(name: str, pass_filter: int) -> BakeType:
    """Light that surfaces scatter in one way: direct, indirect or both, with or without their colour; or that alone."""
    parts = [f"{name} {part}" for part, bit in PARTS.items() if pass_filter & bit]
    colors = [f"{name} Color"] if pass_filter & COLOR or not parts else []

    def color(read: Reader) -> NDArray[np.float32]:
        light = sum(read(part) for part in parts) if parts else 1.0
        return light * read(colors[0]) if colors else np.asarray(light)

    return BakeType((*parts, *colors), color)


def sum_of(types: list[BakeType]) -> BakeType:
    core_passes = tuple(dict.fromkeys(name for bake_type in types for name in bake_type.core_passes))
    return BakeType(core_passes, lambda read: np.sum([bake_type.color(read) for bake_type in types], axis=0))


def _pass(name: str, make: Callable[[NDArray[np.float32]], NDArray[np.float32]] = lambda values: values) -> BakeType:
    return BakeType((name,), lambda read: make(read(name)))


def _grey(values: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.repeat(values, 3, axis=2)


EMISSION = _pass("Unscattered Emission")
SURFACE_TYPES = {
    "EMIT": EMISSION,
    "AO": _pass("Ambient Occlusion"),
    "POSITION": _pass("Position"),
    "NORMAL": _pass("Normal"),  # of the world; Blender turns them to the space that is asked for
    "UV": _pass("UV"),
    "ROUGHNESS": _pass("Roughness", _grey),
}
