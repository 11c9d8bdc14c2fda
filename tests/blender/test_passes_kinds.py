"""Passes by kind of scattering: with every technique they add up to Combined, and asking for them changes nothing."""

from collections.abc import Callable

import bpy
import numpy as np
import pytest

import addon
from addon import techniques
from tests.support import hair_scenes
from tests.support import kind_scenes as kinds
from tests.support.pass_changes import CHANGES, DIFFERENT, see_through_film
from tests.support.pass_scenes import Layers, render_layers
from tests.support.slow_cases import marked

pytestmark = pytest.mark.usefixtures("registered_addon", "empty_scene")

SIZE, SAMPLES = (40, 32), 6
ROUNDING = 2e-6  # of a value, and as much of 0.5: sums of eight products of single precision


def check(scene: bpy.types.Scene, preset: str, change: Callable[[bpy.types.Scene], None] | None = None) -> Layers:
    """One thread without kinds against two with them, and their sum against Combined, in each pixel."""
    kinds.save_layers(scene, SIZE, preset)
    if change:
        change(scene)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    plain, _ = render_layers(scene, "CISTERN", SAMPLES)
    scene.render.threads = 2
    kinds.ask_for_kinds(scene)
    split, _ = render_layers(scene, "CISTERN", SAMPLES)
    assert all(np.array_equal(pixels, split[name]) for name, pixels in plain.items())
    found = kinds.sum_of_kinds(split, scene.render.film_transparent)
    np.testing.assert_allclose(found, kinds.color(split, "Combined"), rtol=ROUNDING, atol=1e-6)
    return split


@pytest.mark.parametrize("preset", techniques.PRESETS)
def test_kinds_add_up_with_every_preset(preset):
    kinds.build_surfaces(bpy.context.scene)
    split = check(bpy.context.scene, preset)
    # Planted: Emission and Environment as mirrors show them, which is glossy light already.
    combined = kinds.color(split, "Combined")
    mirrored = combined - kinds.color(split, "Direct") - kinds.color(split, "Indirect")
    straight = kinds.color(split, kinds.EMISSION) + kinds.color(split, kinds.ENVIRONMENT)
    assert not np.allclose(kinds.sum_of_kinds(split) - straight + mirrored, combined, rtol=ROUNDING, atol=1e-6)


@pytest.mark.parametrize("preset", marked(DIFFERENT, set(DIFFERENT) - {"FINAL", "CELL_RESERVOIRS"}))
@pytest.mark.parametrize("change", CHANGES)
def test_kinds_add_up_whatever_is_set(change, preset):
    kinds.build_surfaces(bpy.context.scene)
    check(bpy.context.scene, preset, CHANGES[change])


@pytest.mark.parametrize("preset", ["PATH_TRACING", "INTERACTIVE"])
def test_kinds_add_up_in_media(preset):
    kinds.build_media(bpy.context.scene)
    check(bpy.context.scene, preset)
    assert any("by path tracing" in w for line in addon.report.last for w in line.warnings) == (preset == "INTERACTIVE")


@pytest.mark.skipif(not hair_scenes.CAN_MAKE_CURVES, reason="no curves by script")
@pytest.mark.parametrize("preset", DIFFERENT)
def test_kinds_add_up_in_hair(preset):
    kinds.build_hair(bpy.context.scene)
    check(bpy.context.scene, preset)


@pytest.mark.parametrize("preset", DIFFERENT)
def test_kinds_add_up_beside_shadow_catchers(preset):
    """To the picture that is laid over shadows: nothing of catchers is in it."""
    scene = bpy.context.scene
    kinds.build_surfaces(scene)
    bpy.data.objects["floor"].is_shadow_catcher = scene.view_layers[0].cistern.use_pass_shadow_catcher = True
    split = check(scene, preset, see_through_film)
    assert kinds.light_of(split, "Glossy", "Indirect").any()


def test_denoising_leaves_kinds_as_they_were_found():
    scene = bpy.context.scene
    kinds.build_surfaces(scene)
    kinds.save_layers(scene, SIZE)
    kinds.ask_for_kinds(scene)
    scene.cistern.use_denoising = scene.view_layers[0].cistern.use_pass_noisy = True
    layers, _ = render_layers(scene, "CISTERN", SAMPLES)
    noisy = kinds.color(layers, "Noisy Image")
    assert not np.allclose(noisy, kinds.color(layers, "Combined"), rtol=0.01)
    np.testing.assert_allclose(kinds.sum_of_kinds(layers), noisy, rtol=ROUNDING, atol=1e-6)
