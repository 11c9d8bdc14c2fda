"""Renders of small scenes by the built core through Blender: needs `cistern_core`."""

import math
import time

import bpy
import numpy as np
import pytest

import addon
from addon import techniques
from addon.engine import CisternEngine
from tests.blender.engine_fakes import fresh_scene, read_channels, render
from tests.blender.test_passes import blender_names, enable_all

pytestmark = pytest.mark.usefixtures("registered_addon", "built_core")


def plane(channels, name, ids="RGB"):
    return np.stack([channels[f"ViewLayer.{name}.{channel}"] for channel in ids], axis=2)


def small_scene(samples=4, width=24, height=16):
    """The factory cube under a lamp, on a floor, before a grey world."""
    scene = fresh_scene(width, height, samples)
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    lamp = scene.objects["Cube"].material_slots[0].material
    lamp.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 0.2
    return scene


def test_light_passes_add_up_to_the_picture(tmp_path):
    scene = small_scene()
    enable_all(scene.view_layers[0])
    channels, [report] = render(scene, tmp_path)
    assert (report.error, report.samples) == (None, 4)
    assert report.peak_memory_mb > 0.0
    names = blender_names()
    parts = [plane(channels, names[name]) for name in ("Direct", "Indirect", "Emission", "Environment")]
    assert all(part.max() > 0.0 for part in parts)
    np.testing.assert_allclose(plane(channels, "Combined"), sum(parts), rtol=1e-4, atol=1e-5)


def test_data_passes_have_blenders_meaning(tmp_path):
    scene = small_scene()
    enable_all(scene.view_layers[0])
    scene.render.film_transparent = True
    bpy.data.objects["Plane"].hide_render = True
    channels, _ = render(scene, tmp_path)
    alpha = channels["ViewLayer.Combined.A"]
    outside, inside = alpha == 0.0, alpha == 1.0
    assert outside.any() and inside.any()
    depth = next(pixels for name, pixels in channels.items() if name.startswith("ViewLayer.Depth."))
    assert np.all(depth[outside] == np.float32(1e10))
    assert np.all((depth[inside] > 5.0) & (depth[inside] < 15.0))
    assert np.abs(plane(channels, "Position", "XYZ")[inside]).max() < 1.01
    lengths = np.linalg.norm(plane(channels, "Normal", "XYZ")[inside], axis=1)
    assert np.all((lengths > 0.3) & (lengths < 1.001))
    assert np.all(plane(channels, "Combined")[outside] == 0.0)


def test_border_is_the_same_part_of_the_full_picture(tmp_path):
    scene = small_scene()
    scene.cistern.pixel_filter = "BOX"
    full, _ = render(scene, tmp_path)
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.25, 0.5
    part, _ = render(scene, tmp_path)
    assert part["ViewLayer.Combined.R"].shape == (4, 12)
    np.testing.assert_allclose(plane(part, "Combined").mean(), plane(full, "Combined")[4:8, 6:18].mean(), rtol=0.1)


def test_one_pixel_and_a_wide_row(tmp_path):
    scene = small_scene(width=100, height=100)
    scene.render.resolution_percentage = 1
    channels, _ = render(scene, tmp_path)
    assert channels["ViewLayer.Combined.R"].shape == (1, 1)
    scene.render.resolution_percentage = 100
    scene.render.resolution_x, scene.render.resolution_y = 8192, 4
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 0.75
    scene.cistern.samples = 1
    channels, _ = render(scene, tmp_path)
    assert channels["ViewLayer.Combined.R"].shape == (1, 8192)
    assert channels["ViewLayer.Combined.A"].min() == 1.0


def test_same_seed_same_picture(tmp_path):
    scene = small_scene()
    first, _ = render(scene, tmp_path)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    second, _ = render(scene, tmp_path)
    assert all(np.array_equal(first[name], second[name]) for name in first)
    scene.cistern.seed = 1
    third, _ = render(scene, tmp_path)
    assert not np.array_equal(first["ViewLayer.Combined.R"], third["ViewLayer.Combined.R"])


def test_persistent_data_follows_an_animation(tmp_path):
    scene = small_scene()
    scene.cistern.use_animated_seed = False
    cube = bpy.data.objects["Cube"]
    cube.keyframe_insert("location", frame=1)
    cube.location.x += 2.0
    cube.keyframe_insert("location", frame=2)
    scene.frame_start, scene.frame_end = 1, 2
    pictures = {}
    for persistent in (False, True):
        scene.render.use_persistent_data = persistent
        scene.render.filepath = str(tmp_path / f"{persistent}_")
        bpy.ops.render.render(animation=True)
        pictures[persistent] = [read_channels(tmp_path / f"{persistent}_000{frame}.exr") for frame in (1, 2)]
    assert not np.array_equal(*(picture["ViewLayer.Combined.R"] for picture in pictures[True]))
    for kept, fresh in zip(pictures[True], pictures[False], strict=True):
        assert np.array_equal(kept["ViewLayer.Combined.R"], fresh["ViewLayer.Combined.R"])


def test_cancel_returns_quickly_with_what_is_finished(tmp_path, monkeypatch):
    scene = small_scene(samples=2**20)
    started = time.monotonic()
    monkeypatch.setattr(CisternEngine, "is_stop_wanted", lambda self: time.monotonic() > started + 1.0)
    channels, [report] = render(scene, tmp_path)
    assert time.monotonic() - started < 3.0
    assert report.error is None and 0 < report.samples < 2**20
    assert plane(channels, "Combined").max() > 0.0


def test_time_limit_ends_the_render(tmp_path):
    scene = small_scene(samples=2**20)
    scene.cistern.time_limit = 0.5
    _, [report] = render(scene, tmp_path)
    assert report.error is None and 0.4 < report.seconds < 3.0


def test_noise_threshold_ends_the_render(tmp_path):
    scene = small_scene(samples=2**20)
    scene.cistern.noise_threshold = 0.05
    _, [report] = render(scene, tmp_path)
    assert report.error is None and report.warnings == []
    assert 16 <= report.samples < 2**20 and 0.0 < report.noise <= 0.05


@pytest.mark.parametrize("preset", ["FINAL", "PATH_TRACING"])
def test_adaptive_sampling_ends_what_is_clean(tmp_path, preset):
    scene = small_scene(4096, 96, 64)
    scene.cistern.preset, scene.cistern.noise_threshold = preset, 0.01
    scene.view_layers[0].cistern.use_pass_sample_count = True
    channels, [adaptive] = render(scene, tmp_path)
    counts = number(channels, "Sample Count")
    assert counts.min() >= 40 and counts.max() == adaptive.samples
    assert counts.mean() == pytest.approx(adaptive.mean_samples)
    scene.cistern.use_adaptive_sampling = False
    _, [whole] = render(scene, tmp_path)
    assert adaptive.error is None and 40 <= adaptive.mean_samples < 0.9 * adaptive.samples
    assert whole.mean_samples == whole.samples <= adaptive.samples


def test_pictures_with_shadow_catchers_end_as_a_whole(tmp_path):
    scene = small_scene(samples=4096)
    next(o for o in scene.objects if o.type == "MESH").is_shadow_catcher = True
    scene.cistern.noise_threshold = 0.02
    _, [report] = render(scene, tmp_path)
    assert report.error is None and report.mean_samples == report.samples


def test_noise_threshold_counts_noise_as_exposed(tmp_path):
    scene = small_scene(samples=4096)
    scene.cistern.noise_threshold = 0.05
    scene.view_settings.exposure = -20.0
    _, [report] = render(scene, tmp_path)
    assert report.samples == 16, "all is black"


def test_noise_threshold_does_nothing_where_samples_do_not_tell_their_noise(tmp_path):
    scene = small_scene(samples=20)
    scene.cistern.preset, scene.cistern.noise_threshold = "RESTIR_DI", 0.5
    _, [report] = render(scene, tmp_path)
    assert report.samples == 20 and report.noise is None
    assert len(report.warnings) == 1 and "noise threshold" in report.warnings[0]


def test_layers_show_their_own_collections(tmp_path):
    scene = small_scene()
    second = scene.view_layers.new("Second")
    second.layer_collection.children[0].exclude = True
    channels, reports = render(scene, tmp_path)
    assert [report.layer for report in reports] == ["ViewLayer", "Second"]
    assert not np.array_equal(channels["ViewLayer.Combined.R"], channels["Second.Combined.R"])


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_light_of_no_finite_energy_is_named(bad, tmp_path):
    scene = small_scene()
    scene.objects["Light"].data.energy = bad
    if math.isfinite(scene.objects["Light"].data.energy):
        pytest.skip("this Blender does not store such a value")
    scene.render.filepath = str(tmp_path / "failed.exr")
    with pytest.raises(RuntimeError, match="Light"):
        bpy.ops.render.render(write_still=True)
    assert "Light" in addon.report.last_report().error


def test_triangles_left_out_for_a_vertex_at_nowhere_are_a_warning(tmp_path):
    scene = small_scene()
    scene.objects["Cube"].data.vertices[3].co.x = math.nan
    channels, [report] = render(scene, tmp_path)
    assert report.error is None and any("Cube" in warning for warning in report.warnings)
    assert np.all(np.isfinite(plane(channels, "Combined")))


def test_scene_without_anything_is_black(tmp_path):
    scene = fresh_scene()
    for name in ("Cube", "Light"):
        bpy.data.objects.remove(bpy.data.objects[name])
    scene.world = None
    channels, [report] = render(scene, tmp_path)
    assert report.error is None
    assert plane(channels, "Combined").max() == 0.0


def number(channels, name):
    return next(pixels for channel, pixels in channels.items() if channel.startswith(f"ViewLayer.{name}."))


@pytest.mark.parametrize("preset", [identifier for identifier, *_ in techniques.PRESET_ITEMS if identifier != "CUSTOM"])
def test_every_preset_renders_nearly_the_same_picture(tmp_path, preset):
    """At 16 samples of 24 x 16 pixels the mean is within 2 %, and the largest bias of these presets is about 3 %."""
    scene = small_scene(samples=16)
    means = []
    for choice in (preset, "FINAL"):
        bpy.ops.cistern.choose_preset(preset=choice)
        channels, [report] = render(scene, tmp_path)
        assert (report.error, report.warnings) == (None, [])
        means.append(plane(channels, "Combined").mean())
    assert means[0] == pytest.approx(means[1], rel=0.1)


def light_means(scene, folder, **answers):
    """Means of the picture and of its indirect light."""
    for name, answer in answers.items():
        setattr(scene.cistern, name, answer)
    channels, [report] = render(scene, folder)
    assert (report.error, report.warnings) == (None, [])
    return plane(channels, "Combined").mean(), plane(channels, "Indirect").mean()


@pytest.fixture(scope="module")
def path_traced_means(registered_addon, tmp_path_factory):
    """Standard errors: 0.2 % and 1 %."""
    return light_means(small_scene(samples=1024), tmp_path_factory.mktemp("path"))


def is_near(means, expected):
    """At 256 samples four standard errors or more: false alarms once in 10,000 seeds, of which one is tried."""
    return means == (pytest.approx(expected[0], rel=0.02), pytest.approx(expected[1], rel=0.08))


@pytest.mark.parametrize(
    "answers",
    [
        {"secondary": "RIS"},
        {"secondary": "CELL_RESERVOIRS"},
        {"indirect": "SCREEN_REUSE"},
        {"indirect": "WORLD_REUSE"},
        {"secondary": "RIS", "indirect": "SCREEN_REUSE"},
        {"direct": "RESTIR", "secondary": "CELL_RESERVOIRS", "indirect": "WORLD_REUSE"},
    ],
    ids=lambda answers: "-".join(answers.values()),
)
def test_answers_about_later_points_find_the_light_of_path_tracing(tmp_path, path_traced_means, answers):
    assert is_near(light_means(small_scene(samples=256), tmp_path, **answers), path_traced_means)


def test_light_of_later_bounces_would_be_missed(tmp_path, path_traced_means):
    """Planted: an answer that stops after two bounces."""
    scene = small_scene(samples=256)
    scene.cistern.max_bounces = 1
    assert not is_near(light_means(scene, tmp_path), path_traced_means)


@pytest.mark.parametrize("preset", ["FINAL", "RESTIR_DI", "CELL_CACHE"])
def test_passes_of_reuse_have_their_documented_scales(tmp_path, preset):
    scene = small_scene()
    enable_all(scene.view_layers[0])
    bpy.ops.cistern.choose_preset(preset=preset)
    channels, [report] = render(scene, tmp_path)
    assert report.error is None
    cells, occupancy = plane(channels, "Cells"), number(channels, "Cell Occupancy")
    occupied = occupancy > 0
    assert occupied.any()
    assert np.all((cells[occupied] >= 0.099) & (cells[occupied] <= 1.001)) and np.all(cells[~occupied] == 0.0)
    assert np.all(occupancy == np.round(occupancy)) and occupancy.max() <= occupancy.size
    assert len(np.unique(cells[occupied], axis=0)) > 3
    confidence, weight = number(channels, "Reservoir Confidence"), number(channels, "Reservoir Weight")
    assert np.all(confidence >= 0.0) and np.all(weight >= 0.0)
    assert (weight.max() > 0.0) == (confidence.max() >= 1.0) == (preset != "FINAL")
    reused = number(channels, "Reuse Count")
    assert reused.max() > 0.0 and np.all(reused == np.round(reused))


@pytest.mark.parametrize(
    "view",
    [
        "CELLS",
        "CELL_OCCUPANCY",
        "CELL_LEVEL",
        "NORMAL_BIN",
        "RESERVOIR_CONFIDENCE",
        "RESERVOIR_WEIGHT",
        "REUSE_COUNT",
        "SAMPLE_COUNT",
        "DIRECT",
    ],
)
def test_views_of_the_built_core_are_pictures(tmp_path, view):
    scene = small_scene()
    bpy.ops.cistern.choose_preset(preset="RESTIR_DI")
    scene.cistern.view = view
    channels, [report] = render(scene, tmp_path)
    shown = plane(channels, "Combined")
    assert report.error is None
    assert np.all(np.isfinite(shown)) and 0.0 < shown.max() <= (1.001 if view != "DIRECT" else np.inf)


def test_cells_by_position_alone_are_fewer(tmp_path):
    scene = small_scene()
    scene.view_layers[0].cistern.use_pass_cells = True
    scene.cistern.cell_pixels = 8.0
    counts = []
    for by_normal in (True, False):
        scene.cistern.use_normal_cells = by_normal
        channels, _ = render(scene, tmp_path)
        counts.append(len(np.unique(plane(channels, "Cells").reshape(-1, 3), axis=0)))
    assert counts[1] < counts[0]


def test_cells_smaller_than_a_pixel_are_refused_by_name(tmp_path):
    scene = small_scene()
    scene.cistern.cell_pixels, scene.cistern.view = 0.5, "CELLS"
    scene.render.filepath = str(tmp_path / "failed.exr")
    with pytest.raises(RuntimeError, match="cell_pixels"):
        bpy.ops.render.render(write_still=True)
    assert "cell_pixels" in addon.report.last_report().error
