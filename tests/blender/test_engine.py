"""The engine's own part of a render: geometry of the result, layers, figures, cancelling, errors."""

import json
from types import SimpleNamespace

import bpy
import numpy as np
import OpenImageIO
import pytest

import addon
from addon import progress
from addon.engine import CisternEngine
from addon.layer_render import LayerRender
from addon.sync import SyncError, SyncStoppedError
from tests.blender.engine_fakes import FakeExport, fresh_scene, install, read_channels, render

pytestmark = pytest.mark.usefixtures("registered_addon")


@pytest.fixture
def core(monkeypatch):
    return install(monkeypatch)


def expect_frame(channels, x, y, width, height):
    """Every pixel of the picture holds its place in the full frame."""
    columns, rows = np.meshgrid(np.arange(x, x + width), np.arange(y, y + height))
    np.testing.assert_array_equal(channels["ViewLayer.Combined.R"], columns)
    np.testing.assert_array_equal(channels["ViewLayer.Combined.G"], rows)


def test_full_frame_arrives_unflipped(core, tmp_path):
    channels, [report] = render(fresh_scene(8, 6), tmp_path)
    expect_frame(channels, 0, 0, 8, 6)
    assert (core.settings[0].width, core.settings[0].height) == (8, 6)
    assert (report.samples, report.error, report.layer) == (2, None, "ViewLayer")


def test_caching_of_light_is_shown_with_its_own_progress(core, tmp_path, monkeypatch):
    texts, shares = [], []
    status_bar = SimpleNamespace(
        update_stats=lambda stats, info: texts.append(info),
        update_progress=shares.append,
        update_memory_stats=lambda **_: None,
    )
    show = LayerRender.show

    def show_recorded(layer, *arguments):
        engine, layer.engine = layer.engine, status_bar
        show(layer, *arguments)
        layer.engine = engine

    monkeypatch.setattr(LayerRender, "show", show_recorded)
    monkeypatch.setattr(progress, "BACKGROUND_SECONDS", 0.0)
    core.caching = [0.25, 0.5]
    _, [report] = render(fresh_scene(samples=2), tmp_path)
    assert [text.split(" | ")[:2] for text in texts] == [
        ["Caching light", "25%"],
        ["Caching light", "50%"],
        ["Rendering", "Sample 1/2"],
        ["Rendering", "Sample 2/2"],
    ]
    assert [" | 2 Openings" in text for text in texts] == [False, False, True, True]
    assert (shares, report.samples) == ([0.25, 0.5, 0.5, 1.0], 2)


def test_background_renders_tell_little():
    """Of a stage that goes on once in a while, of a new one at once."""
    clock = progress.StatusClock()
    assert [clock.is_due(stage) for stage in ("Building", "Building", "Rendering", "Rendering")] == 2 * [True, False]
    clock.due = 0.0
    assert clock.is_due("Rendering")


@pytest.mark.parametrize(
    ("border", "region"),
    [
        ((0.25, 0.75, 0.5, 1.0), (4, 6, 8, 6)),
        ((0.3, 0.61, 0.2, 0.9), (4, 2, 5, 8)),  # fractions are cut off
        ((0.5, 0.5625, 0.5, 0.585), (8, 6, 1, 1)),  # one pixel
    ],
)
@pytest.mark.parametrize("crop", [False, True])
def test_border_renders_its_part_of_the_frame(core, tmp_path, border, region, crop):
    scene = fresh_scene(16, 12)
    scene.render.use_border, scene.render.use_crop_to_border = True, crop
    scene.render.border_min_x, scene.render.border_max_x = border[:2]
    scene.render.border_min_y, scene.render.border_max_y = border[2:]
    channels, _ = render(scene, tmp_path)
    assert core.settings[0].region == region
    assert (core.settings[0].width, core.settings[0].height) == (16, 12)
    x, y, width, height = region
    if not crop:
        channels = {name: plane[y : y + height, x : x + width] for name, plane in channels.items()}
    expect_frame(channels, x, y, width, height)


def test_smallest_and_widest_pictures(core, tmp_path):
    scene = fresh_scene(100, 100)
    scene.render.resolution_percentage = 1
    channels, _ = render(scene, tmp_path)
    expect_frame(channels, 0, 0, 1, 1)

    scene = fresh_scene(8192, 4)
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.0, 1.0
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 0.75
    channels, _ = render(scene, tmp_path)
    expect_frame(channels, 0, 2, 8192, 1)


def test_each_enabled_layer_is_rendered_and_reported(core, tmp_path):
    scene = fresh_scene()
    scene.view_layers.new("Second")
    scene.view_layers.new("Off").use = False
    scene.view_layers["Second"].samples = 5
    channels, reports = render(scene, tmp_path)
    assert [(report.layer, report.samples) for report in reports] == [("ViewLayer", 2), ("Second", 5)]
    assert "Second.Combined.R" in channels
    assert "Off.Combined.R" not in channels


def test_each_view_of_a_stereo_render_has_its_own_camera(core, tmp_path):
    scene = fresh_scene(64, 48)
    scene.render.use_multiview = True
    scene.render.image_settings.views_format = "INDIVIDUAL"
    scene.camera.data.stereo.convergence_mode = "OFFAXIS"
    scene.render.filepath = str(tmp_path / "eye.exr")
    bpy.ops.render.render(write_still=True)
    for eye in "LR":
        expect_frame(read_channels(tmp_path / f"eye_{eye}.exr"), 0, 0, 64, 48)
    left, right = FakeExport.cameras
    distance = np.linalg.norm(left["camera_to_world"][:3, 3] - right["camera_to_world"][:3, 3])
    stereo = scene.camera.data.stereo
    assert distance == pytest.approx(stereo.interocular_distance, rel=1e-4)
    # Off-axis eyes look at the same window in the plane of convergence.
    offset = (left["left"] - right["left"]) * stereo.convergence_distance
    assert offset == pytest.approx(stereo.interocular_distance, rel=1e-3)


def test_a_single_eye_has_its_own_camera(core, tmp_path):
    """As where each eye is a job of its own."""
    scene = fresh_scene(64, 48)
    scene.render.use_multiview = True
    scene.render.views["right"].use = False
    scene.camera.data.stereo.pivot = "CENTER"
    scene.render.filepath = str(tmp_path / "eye.exr")
    bpy.ops.render.render(write_still=True)
    [left] = FakeExport.cameras
    distance = np.linalg.norm(left["camera_to_world"][:3, 3] - np.array(scene.camera.matrix_world)[:3, 3])
    assert distance == pytest.approx(scene.camera.data.stereo.interocular_distance / 2, rel=1e-3)


def test_an_empty_has_no_eyes(core, tmp_path):
    """Blender would take its data for a camera's, and it has none."""
    scene = fresh_scene(64, 48)
    empty = bpy.data.objects.new("Empty", None)
    scene.collection.objects.link(empty)
    empty.matrix_world, scene.camera = scene.camera.matrix_world, empty
    scene.render.use_multiview = True
    scene.render.image_settings.views_format = "INDIVIDUAL"
    scene.render.filepath = str(tmp_path / "eye.exr")
    bpy.ops.render.render(write_still=True)
    left, right = FakeExport.cameras
    np.testing.assert_array_equal(left["camera_to_world"], right["camera_to_world"])


def test_printed_line_is_json_with_the_promised_keys(core, tmp_path, capfd):
    FakeExport.warnings = ('Material "Ü\n1"',)
    render(fresh_scene(), tmp_path)
    [line] = [line for line in capfd.readouterr().out.splitlines() if line.startswith("CISTERN ")]
    values = json.loads(line.removeprefix("CISTERN "))
    assert set(values) == {
        "frame",
        "layer",
        "samples",
        "mean_samples",
        "noise",
        "seconds",
        "cpu_seconds",
        "sync_seconds",
        "peak_memory_mb",
        "warnings",
        "error",
    }
    assert values["warnings"] == ['Material "Ü\n1"']
    assert values["peak_memory_mb"] == 3.0
    assert values["seconds"] >= values["sync_seconds"] >= 0.0


@pytest.mark.parametrize("what", ["samples", "weights"])
def test_numbers_that_are_not_finite_are_a_warning_with_their_count(core, tmp_path, what):
    setattr(core, f"non_finite_{what}", 17)
    _, [report] = render(fresh_scene(), tmp_path)
    assert len(report.warnings) == 1 and f"17 {what}" in report.warnings[0]


def test_cancel_keeps_what_is_finished(core, tmp_path, monkeypatch):
    breaks = iter([False, False, True])
    monkeypatch.setattr(CisternEngine, "is_stop_wanted", lambda self: next(breaks, True))
    channels, [report] = render(fresh_scene(samples=1000), tmp_path)
    assert core.cancelled_sessions == 1
    assert (report.samples, report.error) == (3, None)
    assert np.all(channels["ViewLayer.Combined.B"] == 3.0)


@pytest.mark.parametrize("is_kept", [False, True])
def test_cancelled_export_leaves_no_picture_and_no_error(core, tmp_path, is_kept):
    scene = fresh_scene()
    scene.render.use_persistent_data = is_kept
    scene.render.filepath = str(tmp_path / "none.exr")
    FakeExport.failure = SyncStoppedError()
    closed, exporters = FakeExport.closed, FakeExport.instances
    addon.report.last.clear()
    bpy.ops.render.render()
    [report] = addon.report.last
    assert (report.samples, report.error, core.settings) == (0, None, [])
    assert FakeExport.closed > closed
    FakeExport.failure = None
    bpy.ops.render.render()
    assert FakeExport.instances == exporters + 2, "an exporter that was stopped half-way is not used again"


def rendered_error(scene, tmp_path):
    """The report of a render that fails; Blender's operator must fail as well."""
    scene.render.filepath = str(tmp_path / "failed.exr")
    addon.report.last.clear()
    with pytest.raises(RuntimeError) as raised:
        bpy.ops.render.render(write_still=True)
    [report] = addon.report.last
    assert report.error in str(raised.value)
    return report


def test_refused_scene_is_an_error_in_blender_and_in_the_report(core, tmp_path):
    for error in (SyncError("Light 'Lamp': energy is nan"), core.Error("mesh 'Cube': position 3 is not finite")):
        FakeExport.failure = error
        assert rendered_error(fresh_scene(), tmp_path).error == str(error)


def test_unforeseen_error_is_reported_with_its_traceback(core, tmp_path, capfd):
    FakeExport.failure = KeyError("surprise")
    assert "KeyError" in rendered_error(fresh_scene(), tmp_path).error
    assert "Traceback" in capfd.readouterr().err


def test_failed_session_is_reported_and_the_next_render_works(core, tmp_path):
    core.failure = "out of memory while building the scene"
    assert rendered_error(fresh_scene(), tmp_path).error == core.failure
    core.failure = ""
    _, [report] = render(fresh_scene(), tmp_path)
    assert report.error is None


def test_no_camera_is_an_error(core, tmp_path):
    scene = fresh_scene()
    bpy.data.objects.remove(scene.camera)
    with pytest.raises(RuntimeError, match="camera"):
        bpy.ops.render.render()


@pytest.mark.parametrize(("persistent", "exporters"), [(False, 2), (True, 1)])
def test_animation_keeps_the_exported_scene_only_when_asked(core, tmp_path, persistent, exporters):
    scene = fresh_scene()
    scene.render.use_persistent_data = persistent
    scene.frame_start, scene.frame_end = 3, 4
    scene.render.filepath = str(tmp_path / "frame_")
    bpy.ops.render.render(animation=True)
    assert FakeExport.instances == exporters
    assert FakeExport.closed == (0 if persistent else exporters)
    assert FakeExport.syncs == [(3, "ViewLayer"), (4, "ViewLayer")]


def test_animated_seed_differs_by_frame_and_a_fixed_one_does_not(core, tmp_path):
    scene = fresh_scene()
    for animated, count in ((True, 2), (False, 1)):
        core.settings.clear()
        scene.cistern.use_animated_seed = animated
        for frame in (1, 2):
            scene.frame_set(frame)
            render(scene, tmp_path)
        assert len({settings.seed for settings in core.settings}) == count


def test_settings_reach_the_core(core, tmp_path):
    scene = fresh_scene()
    scene.cistern.light_sampler = "POWER"
    scene.cistern.pixel_filter = "GAUSSIAN"
    scene.cistern.max_glossy_bounces = 7
    scene.render.film_transparent = True
    scene.render.threads_mode, scene.render.threads = "FIXED", 3
    render(scene, tmp_path)
    settings = core.settings[0]
    assert (settings.light_sampling.name, settings.pixel_filter.name) == ("POWER", "GAUSSIAN")
    assert (settings.max_glossy_bounces, settings.film_transparent, settings.threads) == (7, True, 3)


def test_metadata_of_the_file_names_the_samples(core, tmp_path):
    render(fresh_scene(), tmp_path)
    spec = OpenImageIO.ImageInput.open(str(tmp_path / "picture.exr")).spec()
    assert "2" in [str(attribute.value) for attribute in spec.extra_attribs if attribute.name.endswith(".samples")]
