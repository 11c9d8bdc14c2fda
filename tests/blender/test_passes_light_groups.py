"""Light groups: with every technique they add up to Combined, and asking for them changes nothing."""

from collections.abc import Callable

import bpy
import numpy as np
import pytest

import addon
from addon import techniques
from tests.blender.engine_fakes import CONSTANTS, fresh_scene, install, read_channels, render
from tests.blender.test_passes import compositor_tree
from tests.support import group_scenes as groups
from tests.support import hair_scenes
from tests.support import kind_scenes as kinds
from tests.support.pass_changes import CHANGES, DIFFERENT, see_through_film
from tests.support.pass_scenes import Layers, render_layers
from tests.support.slow_cases import marked

pytestmark = pytest.mark.usefixtures("registered_addon", "empty_scene")

SIZE, SAMPLES = (40, 32), 6
ROUNDING = 2e-6  # of a value, and as much of 0.5: sums of single precision


def check(scene: bpy.types.Scene, preset: str, change: Callable[[bpy.types.Scene], None] | None = None) -> Layers:
    """One thread without groups against two with them, and their sum against Combined, in each pixel."""
    kinds.save_layers(scene, SIZE, preset)
    if change:
        change(scene)
    names = groups.names_of(scene)
    groups.remove_groups(scene)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    plain, _ = render_layers(scene, "CISTERN", SAMPLES)
    assert not any("Combined_" in name for name in plain)
    groups.add_groups(scene, *names)
    scene.render.threads = 2
    split, _ = render_layers(scene, "CISTERN", SAMPLES)
    assert all(np.array_equal(pixels, split[name]) for name, pixels in plain.items())
    found = groups.sum_of_groups(split, scene)
    np.testing.assert_allclose(found, kinds.color(split, "Combined"), rtol=ROUNDING, atol=1e-6)
    return split


@pytest.mark.parametrize("preset", techniques.PRESETS)
def test_groups_add_up_with_every_preset(preset):
    scene = bpy.context.scene
    groups.build_surfaces(scene)
    split = check(scene, preset)
    assert all(groups.group(split, name).any() for name in groups.names_of(scene))
    # Planted: indirect light of one of them is missing.
    some = groups.sum_of_groups(split, scene) - 1e-3 * groups.group(split, "sun")
    assert not np.allclose(some, kinds.color(split, "Combined"), rtol=ROUNDING, atol=1e-6)


@pytest.mark.parametrize("preset", marked(DIFFERENT, set(DIFFERENT) - {"FINAL", "CELL_RESERVOIRS"}))
@pytest.mark.parametrize("change", CHANGES)
def test_groups_add_up_whatever_is_set(change, preset):
    groups.build_surfaces(bpy.context.scene)
    check(bpy.context.scene, preset, CHANGES[change])


@pytest.mark.parametrize("preset", ["FINAL", "RESTIR_GI"])
def test_groups_and_kinds_are_asked_for_together(preset):
    scene = bpy.context.scene
    groups.build_surfaces(scene)
    alone = check(scene, preset)
    kinds.ask_for_kinds(scene)
    both, _ = render_layers(scene, "CISTERN", SAMPLES)
    for name in groups.names_of(scene):
        np.testing.assert_array_equal(groups.group(both, name), groups.group(alone, name))
    np.testing.assert_allclose(kinds.sum_of_kinds(both), kinds.color(both, "Combined"), rtol=ROUNDING, atol=1e-6)


@pytest.mark.parametrize("preset", ["PATH_TRACING", "INTERACTIVE"])
def test_groups_add_up_in_media(preset):
    groups.build_media(bpy.context.scene)
    check(bpy.context.scene, preset)
    assert any("by path tracing" in w for line in addon.report.last for w in line.warnings) == (preset == "INTERACTIVE")


@pytest.mark.skipif(not hair_scenes.CAN_MAKE_CURVES, reason="no curves by script")
@pytest.mark.parametrize("preset", marked(DIFFERENT, set(DIFFERENT) - {"FINAL", "RESTIR_GI"}))
def test_groups_add_up_in_hair(preset):
    scene = bpy.context.scene
    kinds.build_hair(scene)
    groups.name_groups(scene)
    groups.add_groups(scene, "key", "fill", "sun", "sky")
    check(scene, preset)


@pytest.mark.parametrize("preset", ["PATH_TRACING", "FINAL"])
def test_groups_add_up_with_motion_blur(preset):
    scene = bpy.context.scene
    groups.build_surfaces(scene)
    sign = bpy.data.objects["sign"]
    for frame, x in ((0, 0.0), (2, 0.6)):
        sign.location.x = x
        sign.keyframe_insert("location", frame=frame)
    scene.render.use_motion_blur = True
    check(scene, preset)


@pytest.mark.parametrize("preset", DIFFERENT)
def test_groups_add_up_beside_shadow_catchers(preset):
    """To the picture that is laid over shadows: nothing of catchers is in it."""
    scene = bpy.context.scene
    groups.build_surfaces(scene)
    bpy.data.objects["floor"].is_shadow_catcher = scene.view_layers[0].cistern.use_pass_shadow_catcher = True
    check(scene, preset, see_through_film)


def test_what_names_no_group_of_the_view_layer_is_in_none():
    scene = bpy.context.scene
    groups.build_instances(scene)
    kinds.save_layers(scene, SIZE)
    bpy.data.objects["sun"].lightgroup = ""
    split, _ = render_layers(scene, "CISTERN", SAMPLES)
    bpy.data.objects["sun"].lightgroup = "nowhere"
    again, _ = render_layers(scene, "CISTERN", SAMPLES)
    assert all(np.array_equal(pixels, again[name]) for name, pixels in split.items())
    assert not groups.group(split, "nobody").any()
    left = kinds.color(split, "Combined") - groups.sum_of_groups(split, scene)
    assert left.min() > -1e-5 and left.mean() > 0.05
    left_half = slice(0, SIZE[0] // 2)
    assert groups.group(split, "left")[:, left_half].mean() > 2.0 * groups.group(split, "right")[:, left_half].mean()


def test_groups_are_those_of_each_view_layer():
    scene = bpy.context.scene
    groups.build_surfaces(scene)
    other = scene.view_layers.new("Other")
    for name in ("sign", "key"):  # other numbers than in the first one
        other.lightgroups.add().name = name
    kinds.save_layers(scene, SIZE)
    layers, _ = render_layers(scene, "CISTERN", SAMPLES)
    assert {name.split(".")[1] for name in layers if name.startswith("Other.Combined_")} == {
        "Combined_sign",
        "Combined_key",
    }
    for name in ("sign", "key"):
        np.testing.assert_array_equal(layers[f"Other.Combined_{name}.G"], layers[f"ViewLayer.Combined_{name}.G"])


def test_denoising_leaves_groups_as_they_were_found():
    scene = bpy.context.scene
    groups.build_surfaces(scene)
    kinds.save_layers(scene, SIZE)
    scene.cistern.use_denoising = scene.view_layers[0].cistern.use_pass_noisy = True
    layers, _ = render_layers(scene, "CISTERN", SAMPLES)
    noisy = kinds.color(layers, "Noisy Image")
    assert not np.allclose(noisy, kinds.color(layers, "Combined"), rtol=0.01)
    np.testing.assert_allclose(groups.sum_of_groups(layers, scene), noisy, rtol=ROUNDING, atol=1e-6)


# --- with a fake core -------------------------------------------------------------------------------------------------

NUMBERS = {"Light Group 0": (1.0, 2.0, 3.0), "Light Group 1": (4.0, 5.0, 6.0)}


@pytest.fixture
def core(monkeypatch):
    for name, value in NUMBERS.items():
        monkeypatch.setitem(CONSTANTS, name, value)
    return install(monkeypatch)


def test_passes_have_the_names_of_cycles_and_the_order_of_the_list(core, tmp_path):
    scene = fresh_scene()
    groups.add_groups(scene, "Lamps, warm", "sky")
    channels, _ = render(scene, tmp_path)
    assert core.settings[-1].passes[-2:] == list(NUMBERS)
    for name, value in zip(("Lamps, warm", "sky"), NUMBERS.values(), strict=True):
        for channel, number in zip("RGB", value, strict=True):
            np.testing.assert_array_equal(channels[f"ViewLayer.Combined_{name}.{channel}"], np.float32(number))


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="files of Blender before 5.0 cut names of channels as well")
@pytest.mark.parametrize(
    "name", ["a very long name " * 3 + "of sixty", "光" * 20], ids=["letters", "of three bytes each"]
)
def test_names_are_cut_as_blender_cuts_them(core, tmp_path, name):
    """Under the whole name their passes were not found, and stayed black. (Cycles' are.)"""
    scene = fresh_scene()
    groups.add_groups(scene, name, "sky")
    channels, _ = render(scene, tmp_path)
    found = [pixels for channel, pixels in channels.items() if f"Combined_{name[:5]}" in channel and channel[-1] == "R"]
    assert len(found) == 1
    np.testing.assert_array_equal(found[0], np.float32(NUMBERS["Light Group 0"][0]))


def test_groups_go_through_the_compositor(core, tmp_path):
    scene = fresh_scene()
    groups.add_groups(scene, "warm", "sky")
    tree, output = compositor_tree(scene)
    source = tree.nodes.new("CompositorNodeRLayers")
    source.scene = scene
    tree.links.new(source.outputs["Combined_sky"], output.inputs[0])
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.filepath = str(tmp_path / "composite.exr")
    bpy.ops.render.render(write_still=True)
    channels = read_channels(tmp_path / "composite.exr")
    for channel, value in zip("RGB", NUMBERS["Light Group 1"], strict=True):
        np.testing.assert_allclose(channels[channel], value, rtol=1e-6)
