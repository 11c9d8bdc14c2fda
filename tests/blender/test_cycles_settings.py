"""Settings taken over from Cycles: values, what is said to be left out, the button and the command line's option."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from addon import command_line, cycles_settings
from addon.properties import MAX_SAMPLES
from tests.blender.engine_fakes import fresh_scene
from tests.support import engines
from tests.support.statistics import block_means

pytestmark = pytest.mark.usefixtures("registered_addon")


@pytest.fixture
def scene():
    scene = fresh_scene()
    scene.cycles.use_adaptive_sampling = scene.cycles.use_fast_gi = False
    scene.cycles.blur_glossy = 0.0
    return scene


def other_value(prop, value):
    """Another one than a setting has, which both engines allow."""
    if prop.type == "BOOLEAN":
        return not value
    if prop.type == "ENUM":
        return next(item.identifier for item in prop.enum_items if item.identifier != value)
    return value + 3


@pytest.mark.parametrize(("ours", "theirs"), cycles_settings.COPIED)
def test_each_setting_is_copied(scene, ours, theirs):
    prop = scene.cycles.bl_rna.properties[theirs]
    setattr(scene.cycles, theirs, other_value(prop, getattr(scene.cistern, ours)))
    assert getattr(scene.cistern, ours) != getattr(scene.cycles, theirs)
    assert cycles_settings.take_over(scene) == []
    assert getattr(scene.cistern, ours) == getattr(scene.cycles, theirs)


def test_layers_have_the_passes(scene):
    first, second = scene.view_layers[0], scene.view_layers.new("Second")
    second.cycles.use_pass_volume_direct = second.cycles.denoising_store_passes = True
    second.cycles.pass_debug_sample_count = True
    cycles_settings.take_over(scene)
    assert not first.cistern.use_pass_volume_direct and not first.cistern.use_pass_denoising_albedo
    assert second.cistern.use_pass_volume_direct and not second.cistern.use_pass_volume_indirect
    assert second.cistern.use_pass_sample_count and not first.cistern.use_pass_sample_count
    assert second.cistern.use_pass_denoising_albedo and second.cistern.use_pass_denoising_normal


@pytest.mark.parametrize(
    ("is_adaptive", "threshold", "samples", "expected"),
    [(False, 0.5, 10, 0.0), (True, 0.25, 10, 0.25), (True, 0.0, 100, 0.01), (True, 0.0, 4096, 0.001)],
)
def test_noise_threshold(scene, is_adaptive, threshold, samples, expected):
    scene.cycles.use_adaptive_sampling = is_adaptive
    scene.cycles.adaptive_threshold, scene.cycles.samples = threshold, samples
    scene.cycles.use_preview_adaptive_sampling = not is_adaptive
    scene.cycles.preview_adaptive_threshold = 0.125
    cycles_settings.take_over(scene)
    assert scene.cistern.noise_threshold == pytest.approx(expected)
    assert scene.cistern.viewport_noise_threshold == (0.0 if is_adaptive else 0.125)


def test_viewports_without_end(scene):
    """Samples of 0 there, whose automatic threshold is the least."""
    scene.cycles.preview_samples = 0
    scene.cycles.use_preview_adaptive_sampling, scene.cycles.preview_adaptive_threshold = True, 0.0
    cycles_settings.take_over(scene)
    assert scene.cistern.viewport_samples == MAX_SAMPLES
    assert scene.cistern.viewport_noise_threshold == pytest.approx(cycles_settings.LEAST_AUTOMATIC_THRESHOLD)


def test_what_changes_pictures_and_has_no_like_is_named(scene):
    scene.render.use_simplify = True
    for name, value, words in [
        ("use_fast_gi", True, "no Fast GI Approximation"),
        ("use_camera_cull", True, "no Culling (Simplify)"),
        ("use_distance_cull", True, "no Culling (Simplify)"),
    ]:
        before = getattr(scene.cycles, name)
        setattr(scene.cycles, name, value)
        assert cycles_settings.take_over(scene) == [words]
        setattr(scene.cycles, name, before)
    scene.cycles.film_transparent_roughness = 0.3
    assert cycles_settings.take_over(scene) == []  # only behind transparent glass
    scene.cycles.film_transparent_glass = True
    assert cycles_settings.take_over(scene) == ["glass is transparent up to a roughness of 0.1"]


def test_the_button(scene):
    scene.cycles.samples = 77
    assert bpy.ops.cistern.take_cycles_settings() == {"FINISHED"}
    assert scene.cistern.samples == 77


def test_single_options_win_over_those_of_cycles(scene, capsys):
    scene.cycles.samples, scene.cycles.max_bounces = 77, 3
    options = ["blender", "--", "--cistern-cycles-settings", "--cistern-samples", "5"]
    command_line.apply(command_line.parse(options), scene)
    assert (scene.cistern.samples, scene.cistern.max_bounces) == (5, 3)
    assert capsys.readouterr().err == ""
    scene.cycles.use_fast_gi = True
    command_line.apply(command_line.parse(options), scene)
    assert "no Fast GI Approximation" in capsys.readouterr().err
    command_line.take_cycles_settings(SimpleNamespace())
    assert "Cycles is not enabled" in capsys.readouterr().err


def test_pictures_are_alike_afterwards(scene):
    """A closed grey room with a lamp: means of both engines differ by a third before (no bounce and 12), and by what
    noise allows (three standard errors of six seeds, a chance of one in a hundred) after."""
    for other in list(bpy.data.objects):
        bpy.data.objects.remove(other)
    bpy.ops.mesh.primitive_cube_add(size=4.0)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.2, 0.6))
    bpy.context.object.data.energy = 100.0
    bpy.ops.object.camera_add(location=(0.0, -1.5, 0.0), rotation=(np.pi / 2, 0.0, 0.0))
    scene.camera = bpy.context.object
    engines.prepare(scene, 16, 16, bounces=12)
    scene.cycles.max_bounces, scene.cycles.samples = 0, 64
    scene.cycles.sample_clamp_direct, scene.cycles.sample_clamp_indirect = 0.5, 0.0

    def means(engine):
        pictures = [block_means(engines.render(scene, engine, 64, seed), 1, 1)[:3] for seed in range(6)]
        return np.mean(pictures), np.std(np.mean(pictures, axis=1), ddof=1) / np.sqrt(len(pictures))

    theirs, their_error = means("CYCLES")
    before, _ = means("CISTERN")
    cycles_settings.take_over(scene)
    after, error = means("CISTERN")
    assert before > 1.3 * theirs
    assert abs(after - theirs) < 3.0 * np.hypot(error, their_error)
