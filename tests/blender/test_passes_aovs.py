"""Passes that materials and worlds write themselves, beside Cycles, in the same process and from the same scene."""

import bpy
import numpy as np
import pytest

from addon import report
from tests.support import pass_scenes
from tests.support.blender_scenes import shader
from tests.support.slow_cases import marked

pytestmark = pytest.mark.usefixtures("registered_addon")

CHANNELS = ["Tint.R", "Tint.G", "Tint.B", "Tint.A", "Level.X"]


@pytest.fixture
def cards(empty_scene):
    def build(preset="PATH_TRACING"):
        pass_scenes.build_cards(empty_scene)
        pass_scenes.write_aovs(empty_scene)
        pass_scenes.prepare_layers(empty_scene, preset)
        return empty_scene

    return build


def compare(scene, plant=None):
    return pass_scenes.compare_layers(scene, CHANNELS, plant)


PRESETS = ("PATH_TRACING", "FINAL", "RESTIR_DI", "CELL_RESERVOIRS", "WORLD_PATHS")


@pytest.mark.parametrize("preset", marked(PRESETS, {"RESTIR_DI", "CELL_RESERVOIRS"}))
def test_aovs_are_those_of_cycles(cards, preset):
    result = compare(cards(preset))
    assert result.agrees, result


@pytest.mark.parametrize("has_glass", [False, True])
def test_aovs_under_a_transparent_film(cards, has_glass):
    scene = cards()
    scene.render.film_transparent = True
    scene.cycles.film_transparent_glass = scene.cistern.film_transparent_glass = has_glass
    result = compare(scene)
    assert result.agrees, result


def muted_group(scene):
    tree = bpy.data.materials["Thick"].node_tree
    next(node for node in tree.nodes if node.bl_idname == "ShaderNodeGroup").mute = True


def other_sky(scene):
    tree = scene.world.node_tree
    node = next(node for node in tree.nodes if getattr(node, "aov_name", "") == "Level")
    node.inputs["Value"].default_value = 1.99


def denser_thin_card(scene):
    tree = bpy.data.materials["Thin"].node_tree
    next(node for node in tree.nodes if node.bl_idname == "ShaderNodeMixShader").inputs[0].default_value = 0.45


@pytest.mark.parametrize("plant", [muted_group, other_sky, denser_thin_card])
def test_planted_differences_are_found(cards, plant):
    result = compare(cards(), plant)
    assert not result.agrees, result


def test_what_only_aovs_need_is_not_shaded_with(cards):
    """The picture is the same to the bit, also with an AOV in a loop of colours that the surface reads too."""
    scene = cards()
    tree = bpy.data.materials["Solid"].node_tree
    surface = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfDiffuse")
    noise = shader(tree, "ShaderNodeTexNoise", Scale=3.0)
    tree.links.new(noise.outputs["Color"], surface.inputs["Color"])
    pass_scenes.add_aov(tree, "Tint", Color=noise.outputs["Color"])
    with_aovs, _ = pass_scenes.render_layers(scene, "CISTERN", 8)
    while scene.view_layers[0].aovs:
        scene.view_layers[0].aovs.remove(scene.view_layers[0].aovs[0])
    without, _ = pass_scenes.render_layers(scene, "CISTERN", 8)
    assert "ViewLayer.Tint.R" in with_aovs and "ViewLayer.Tint.R" not in without
    for channel in "RGBA":
        name = f"ViewLayer.Combined.{channel}"
        np.testing.assert_array_equal(with_aovs[name], without[name])


def test_aovs_are_the_same_with_any_number_of_threads(cards):
    one, three = pass_scenes.layers_by_threads(cards("FINAL"))
    for channel in CHANNELS:
        np.testing.assert_array_equal(one[f"ViewLayer.{channel}"], three[f"ViewLayer.{channel}"])


def test_names_that_conflict_are_left_out(cards):
    scene = cards()
    scene.view_layers[0].aovs[0].name = "Combined"
    channels, _ = pass_scenes.render_layers(scene, "CISTERN", 1)
    assert "ViewLayer.Level.X" in channels and not any(".Tint." in name for name in channels)
    assert warnings_of_aovs() == [left_out("Combined")]


def warnings_of_aovs():
    return [warning for warning in report.last_report().warnings if "AOV" in warning]


def left_out(name):
    return f"View layer 'ViewLayer': shader AOV '{name}' is left out, since another pass has this name"


@pytest.mark.parametrize("kind", ["COLOR", "VALUE"])
@pytest.mark.parametrize(
    "name", ["Direct", "Noisy Image", "Denoising Albedo", "Depth", "CryptoObject00", "Combined_key"]
)
def test_names_of_other_passes_are_left_out_after_a_change_of_the_engine(cards, name, kind):
    """Blender has not marked them then: it did when Cycles was asked for its passes, of which few have these names."""
    scene = cards()
    scene.render.engine = "CYCLES"
    layer = scene.view_layers[0]
    layer.use_pass_cryptomatte_object = layer.use_pass_z = True
    layer.lightgroups.add(name="key")
    layer.cistern.use_pass_noisy = layer.cistern.use_pass_denoising_albedo = True
    without, _ = pass_scenes.render_layers(scene, "CISTERN", 1)
    scene.render.engine = "CYCLES"
    aov = layer.aovs[0]
    aov.name, aov.type = name, kind
    channels, _ = pass_scenes.render_layers(scene, "CISTERN", 1)
    assert warnings_of_aovs() == [left_out(name)]
    assert {other for other in without if ".Tint." not in other} == set(channels)
    for channel, pixels in channels.items():
        np.testing.assert_array_equal(pixels, without[channel], channel)


def test_numbers_without_end_count_as_zero(cards):
    scene = cards()
    tree = bpy.data.materials["Solid"].node_tree
    divided = tree.nodes.new("ShaderNodeMath")
    divided.operation = "LOGARITHM"
    uv = tree.nodes.new("ShaderNodeTexCoord").outputs["UV"]
    tree.links.new(uv, divided.inputs[0])
    pass_scenes.add_aov(tree, "Level", Value=divided.outputs[0])
    channels, _ = pass_scenes.render_layers(scene, "CISTERN", 4)
    assert np.isfinite(channels["ViewLayer.Level.X"]).all()
