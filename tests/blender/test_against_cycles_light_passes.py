"""Passes by kind of scattering against those of Cycles in the same process.

Means over 5 x 6 blocks of 6 replicas of each engine, Welch's t-test for all passes of a case together, false-alarm rate
1 % per case (Šidák). Light is compared as it enters Combined, multiplied by its colour, whose mean both engines divide
by; and colours by themselves. `test_planted_bugs` shows what the comparison sees.
"""

from collections.abc import Callable
from functools import cache

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon import techniques
from tests.support import hair_scenes
from tests.support import kind_scenes as kinds
from tests.support.pass_scenes import Layers, render_layers
from tests.support.slow_cases import marked
from tests.support.statistics import Comparison, block_means, compare_replicas

pytestmark = pytest.mark.usefixtures("registered_addon")

SIZE, SAMPLES, REPLICAS = (48, 40), 64, 6
ROWS, COLUMNS = 5, 6
# Before 5.2 Cycles took for that of transmission what a smooth surface lets through, however rough it is.
COLORS = kinds.SURFACE_KINDS if bpy.app.version >= (5, 2, 0) else ("Diffuse", "Glossy")
FLOOR = 2e-4  # tables of the Fresnel terms of rough surfaces, which colours without noise show: 0.1 % of 0.1


def build_footage(scene: bpy.types.Scene) -> None:
    """On a floor that catches shadows, behind which the film is transparent, through clear glass as well."""
    kinds.build_surfaces(scene)
    bpy.data.objects["floor"].is_shadow_catcher = scene.render.film_transparent = True
    for own in (scene.cistern, scene.cycles):
        own.film_transparent_glass = True
    for own in (scene.view_layers[0].cistern, scene.view_layers[0].cycles):
        own.use_pass_shadow_catcher = True


SCENES = {
    "surfaces": kinds.build_surfaces,
    "hair": kinds.build_hair,
    "media": kinds.build_media,
    "footage": build_footage,
}


def pictures(layers: Layers) -> list[NDArray]:
    light = [kinds.light_of(layers, kind, part) for kind in kinds.KINDS for part in ("Direct", "Indirect")]
    colors = [kinds.color(layers, kinds.pass_name(kind, "Color")) for kind in COLORS]
    return [*light, *colors, kinds.color(layers, kinds.EMISSION), kinds.color(layers, kinds.ENVIRONMENT)]


@cache
def replicas(name: str, engine: str, preset: str = "") -> list[Layers]:
    """All layers of renders with different seeds, shared by cases."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    SCENES[name](scene)
    kinds.save_layers(scene, SIZE, preset or "PATH_TRACING")
    kinds.ask_for_kinds(scene)
    first = 1 if engine == "CISTERN" else 1001
    return [render_layers(scene, engine, SAMPLES, seed)[0] for seed in range(first, first + REPLICAS)]


def blocks(layers: list[Layers], read: Callable[[Layers], list[NDArray]]) -> NDArray:
    return np.array([block_means(np.concatenate(read(one), axis=2), ROWS, COLUMNS) for one in layers])


def compare(name: str, preset: str = "PATH_TRACING", read: Callable[[Layers], list[NDArray]] = pictures) -> Comparison:
    ours = blocks(replicas(name, "CISTERN", preset), read)
    return compare_replicas(ours, blocks(replicas(name, "CYCLES"), pictures), floor=FLOOR)


@pytest.mark.parametrize(
    "name",
    [
        "surfaces",
        "media",
        "footage",
        pytest.param("hair", marks=pytest.mark.skipif(not hair_scenes.CAN_MAKE_CURVES, reason="no curves by script")),
    ],
)
def test_light_of_kinds_agrees(name):
    comparison = compare(name)
    assert comparison.agrees, comparison


# FAST answers are biased by intent.
UNBIASED = [p for p in techniques.PRESETS if "FAST" not in p and p not in ("PATH_TRACING", "CELL_CACHE")]


@pytest.mark.parametrize("preset", marked(UNBIASED, set(UNBIASED) - {"FINAL"}))
def test_light_of_kinds_agrees_with_every_technique(preset):
    comparison = compare("surfaces", preset)
    assert comparison.agrees, comparison


def by_albedo(layers: Layers) -> list[NDArray]:
    """Planted: direct light divided between diffuse and glossy as their colours are, not as what lobes make of it."""
    found = pictures(layers)
    diffuse, glossy = (kinds.color(layers, kinds.pass_name(kind, "Color")) for kind in ("Diffuse", "Glossy"))
    whole, share = found[0] + found[2], diffuse / np.maximum(diffuse + glossy, 1e-9)
    return [whole * share, found[1], whole * (1.0 - share), *found[3:]]


def by_roughness(layers: Layers) -> list[NDArray]:
    """Planted: light seen in mirrors is that of Emission and Environment, as in our own passes."""
    found = pictures(layers)
    combined = kinds.color(layers, "Combined")
    seen = combined - kinds.color(layers, "Direct") - kinds.color(layers, "Indirect")
    return [*found[:-1], seen - found[-2]]


@pytest.mark.parametrize("plant", [by_albedo, by_roughness])
def test_planted_bugs(plant):
    assert not compare("surfaces", read=plant).agrees
