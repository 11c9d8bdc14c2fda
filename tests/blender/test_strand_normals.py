"""Strands whose normals are bent by nodes: light from behind them is found by techniques that reuse paths, too."""

import math

import bpy
import numpy as np
import pytest

from tests.blender import test_against_cycles_hair as hair
from tests.support import blender_scenes as build
from tests.support.engines import prepare, render
from tests.support.hair_scenes import CAN_MAKE_CURVES, add_fur
from tests.support.statistics import block_means, compare_replicas

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(not CAN_MAKE_CURVES, reason="scripts cannot make hair curves"),
]


def below_a_ceiling(scene: bpy.types.Scene) -> None:
    """Fur that is lit by a bright ceiling alone, as if all of it lay on the ground."""
    hair.stage(scene)
    for lamp in [obj for obj in scene.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(lamp)
    scene.world = None
    add_fur(scene, build.material("hair", hair.upright))
    corners = [(-3, -3, 2.5), (3, -3, 2.5), (3, 3, 2.5), (-3, 3, 2.5)]
    white = build.principled("white", Base_Color=(0.9, 0.9, 0.9, 1), Roughness=1.0)
    build.add_mesh(scene, "ceiling", corners, [(0, 1, 2, 3)], white)
    build.add_light(scene, "SPOT", (1.5, 1.5, 1.2), (math.pi, 0.0, 0.0), energy=500.0, spot_size=1.5)
    prepare(scene, 32, 32)


def blocks(scene: bpy.types.Scene, preset: str) -> np.ndarray:
    scene.cistern.preset = preset
    return np.array([block_means(render(scene, "CISTERN", 24, seed)[..., :3], 4, 4).ravel() for seed in range(1, 9)])


@pytest.mark.parametrize("preset", ["RESTIR_GI", "WORLD_PATHS", "FINAL"])
def test_pictures_are_those_of_path_tracing(empty_scene: bpy.types.Scene, preset: str) -> None:
    """False-alarm rate 1 % per case. Planted: a fifth of the light is missing."""
    below_a_ceiling(empty_scene)
    traced, reused = blocks(empty_scene, "PATH_TRACING"), blocks(empty_scene, preset)
    result = compare_replicas(traced, reused)
    assert result.agrees, result
    assert not compare_replicas(traced, 0.8 * reused).agrees
