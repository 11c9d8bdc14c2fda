"""A viewport that rests once its picture is clean enough, by the built core and without a window."""

import bpy
import numpy as np
import pytest

from addon import viewport as viewport_module
from addon import viewport_render
from addon.sync import instances
from addon.viewport import Viewport
from addon.viewport_draw import Screen
from tests.blender.test_viewport_denoise import textured_scene
from tests.blender.test_viewport_render import wait_until
from tests.blender.viewport_fakes import FakeEngine, fake_context

pytestmark = pytest.mark.usefixtures("registered_addon")

SIZE = (64, 48)
SAMPLES = 320
THRESHOLD = 0.02
FEWEST = 16  # before a picture is looked at


@pytest.fixture
def shown(built_core, monkeypatch):
    """What a viewport of a scene shows once it rests: the progress of its session, its line, its picture."""
    stages, viewports = [], []

    class RecordedStage(viewport_render.Stage):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            stages.append(self)

    monkeypatch.setattr(viewport_render, "Stage", RecordedStage)
    monkeypatch.setattr(Screen, "draw", lambda *_: None)
    monkeypatch.setattr(viewport_module, "switches", lambda: ())
    monkeypatch.setattr(instances, "shown_in", lambda _: lambda _: True)

    def show(scene):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        camera = scene.camera.evaluated_get(depsgraph)
        window = camera.calc_matrix_camera(depsgraph, x=SIZE[0], y=SIZE[1])
        context = fake_context(scene, window, camera.matrix_world.inverted())
        context.region.width, context.region.height = SIZE
        stages.clear()
        viewport = Viewport(built_core, lambda: None)
        viewports.append(viewport)
        viewport.update(FakeEngine(), context, depsgraph)
        render = viewport._render

        def is_resting():
            assert render.error is None
            return stages and stages[-1].is_finest and stages[-1].session.wait(0.0).status is built_core.Status.DONE

        wait_until(is_resting, 60.0)
        progress = stages[-1].session.wait(0.0)
        wait_until(lambda: f"Sample {progress.frames_done}/{SAMPLES}" in render.picture.status)
        return progress, viewport.status(is_paused=False), render.picture.pixels

    yield show
    for viewport in viewports:
        viewport.stop(waits=True)


def scene_with(preset: str, threshold: float) -> bpy.types.Scene:
    scene = textured_scene(1)
    scene.cistern.viewport_preset, scene.cistern.viewport_samples = preset, SAMPLES
    scene.cistern.viewport_noise_threshold = threshold
    return scene


@pytest.mark.parametrize("preset", ["INTERACTIVE", "PATH_TRACING"])
def test_a_viewport_rests_once_it_is_clean(shown, preset):
    """And most of its pixels before; the picture is that of all samples within the noise that is left."""
    progress, line, picture = shown(scene_with(preset, THRESHOLD))
    assert FEWEST <= progress.mean_samples < progress.frames_done < SAMPLES
    assert 0.0 < progress.noise <= THRESHOLD and f"Noise {progress.noise:.3g}" in line
    whole, _, reference = shown(scene_with(preset, 0.0))
    assert whole.frames_done == whole.mean_samples == SAMPLES and whole.noise < 0.0
    left = np.sqrt(np.mean((np.minimum(picture, 1.0) - np.minimum(reference, 1.0))[..., :3] ** 2))
    assert 0.0 < left < 2.0 * THRESHOLD


def test_a_threshold_that_cannot_be_told_is_left_out_and_named(shown):
    scene = scene_with("RENDER", THRESHOLD)
    scene.cistern.preset = "RESTIR_DI"
    progress, line, _ = shown(scene)
    assert progress.frames_done == SAMPLES
    assert f"Scene '{scene.name}': the noise threshold does nothing" in line
