"""Light groups against those of Cycles in the same process.

Means over 5 x 6 blocks of 6 replicas of each engine, Welch's t-test for all groups of a case together, false-alarm rate
1 % per case (Šidák). `test_planted_bugs` shows what the comparison sees.
"""

from collections.abc import Callable
from functools import cache

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon import techniques
from tests.support import group_scenes as groups
from tests.support import kind_scenes as kinds
from tests.support.pass_scenes import Layers, render_layers
from tests.support.slow_cases import marked
from tests.support.statistics import Comparison, block_means, compare_replicas

pytestmark = pytest.mark.usefixtures("registered_addon")

SIZE, SAMPLES, REPLICAS = (48, 40), 64, 6
ROWS, COLUMNS = 5, 6


def build_footage(scene: bpy.types.Scene) -> None:
    """On a floor that catches shadows, behind which the film is transparent, through clear glass as well."""
    groups.build_surfaces(scene)
    bpy.data.objects["floor"].is_shadow_catcher = scene.render.film_transparent = True
    for own in (scene.cistern, scene.cycles):
        own.film_transparent_glass = True
    for own in (scene.view_layers[0].cistern, scene.view_layers[0].cycles):
        own.use_pass_shadow_catcher = True


def build_cut_out(scene: bpy.types.Scene) -> None:
    """Through a leaf that is held out."""
    groups.build_surfaces(scene)
    bpy.data.objects["leaf"].is_holdout = True


def build_sky_behind(scene: bpy.types.Scene) -> None:
    """The same with the pass Environment: then the sky's group has what is behind the film."""
    build_footage(scene)
    scene.view_layers[0].use_pass_environment = True


def build_backdrop(scene: bpy.types.Scene) -> None:
    """On a floor that catches shadows, before the sky itself."""
    groups.build_surfaces(scene)
    bpy.data.objects["floor"].is_shadow_catcher = True


SCENES = {
    "surfaces": groups.build_surfaces,
    "media": groups.build_media,
    "nested_media": groups.build_nested_media,
    "instances": groups.build_instances,
    "footage": build_footage,
    "sky_behind": build_sky_behind,
    "backdrop": build_backdrop,
    "cut_out": build_cut_out,
}


@cache
def replicas(name: str, engine: str, preset: str = "") -> list[dict[str, NDArray]]:
    """The groups of renders with different seeds, shared by cases."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    SCENES[name](scene)
    kinds.save_layers(scene, SIZE, preset or "PATH_TRACING")
    first = 1 if engine == "CISTERN" else 1001

    def found(layers: Layers) -> dict[str, NDArray]:
        return {one: groups.group(layers, one) for one in groups.names_of(scene)}

    return [found(render_layers(scene, engine, SAMPLES, seed)[0]) for seed in range(first, first + REPLICAS)]


Pictures = dict[str, NDArray]


def blocks(pictures: list[Pictures], change: Callable[[Pictures], Pictures] = lambda same: same) -> NDArray:
    return np.array([block_means(np.concatenate([*change(one).values()], axis=2), ROWS, COLUMNS) for one in pictures])


def compare(name: str, preset: str = "PATH_TRACING", change: Callable[[Pictures], Pictures] = dict) -> Comparison:
    ours = blocks(replicas(name, "CISTERN", preset), change)
    return compare_replicas(ours, blocks(replicas(name, "CYCLES")))


@pytest.mark.parametrize("name", marked(SCENES, {"nested_media", "sky_behind"}))
def test_groups_agree(name):
    comparison = compare(name)
    assert comparison.agrees, comparison


# FAST answers are biased by intent.
UNBIASED = [p for p in techniques.PRESETS if "FAST" not in p and p not in ("PATH_TRACING", "CELL_CACHE")]


@pytest.mark.parametrize("preset", marked(UNBIASED, set(UNBIASED) - {"FINAL", "RESTIR_GI"}))
def test_groups_agree_with_every_technique(preset):
    comparison = compare("surfaces", preset)
    assert comparison.agrees, comparison


def lamp_in_another_group(pictures: Pictures) -> Pictures:
    """Planted: the sun counts as the fill."""
    return pictures | {"fill": pictures["fill"] + pictures["sun"], "sun": 0.0 * pictures["sun"]}


def glow_in_no_group(pictures: Pictures) -> Pictures:
    """Planted: a twentieth of the sign's light is in no group."""
    return pictures | {"sign": 0.95 * pictures["sign"]}


def exchanged(pictures: Pictures) -> Pictures:
    """Planted: two groups by each other's name."""
    return pictures | {"key": pictures["fill"], "fill": pictures["key"]}


@pytest.mark.parametrize("plant", [lamp_in_another_group, glow_in_no_group, exchanged])
def test_planted_bugs(plant):
    assert not compare("surfaces", change=plant).agrees
