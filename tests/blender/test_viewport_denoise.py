"""Denoising beside the rendering of a viewport: when, of what, how it is shown, and that nothing waits for it."""

import threading
import time

import numpy as np
import pytest

from addon import denoise, open_image_denoise, settings, ui_sampling, viewport_denoise
from addon.sync.live import LiveSync
from addon.viewport_camera import WHOLE, View
from addon.viewport_denoise import FILTER_SHARE, Schedule, passes_of_one_moment
from addon.viewport_render import Job, ViewportRender
from tests.blender.engine_fakes import fresh_scene
from tests.blender.test_denoise import textured_scene
from tests.blender.test_open_image_denoise import error, has_library
from tests.blender.test_ui import draw
from tests.blender.test_viewport_render import SETTINGS, wait_until
from tests.blender.viewport_fakes import (
    REGION,
    FakeViewportCore,
    FakeViewportSession,
    look_through_camera,
    watched_render,
)

CLEAN = -1.0


def job(scene="scene", samples=4, finest=1, shown=WHOLE, is_denoised=True) -> Job:
    return Job(scene, View(*REGION, shown, ()), SETTINGS, "COMBINED", (("samples", samples),), finest, is_denoised)


class StandIn:
    """In place of the library: pictures of -1, after `seconds`; as deaf to orders to stop as is asked for."""

    def __init__(self):
        self.seconds, self.is_deaf, self.error = 0.0, False, None
        self.shapes, self.left = [], 0
        self.at_once, self.most_at_once = 0, 0

    def __call__(self, read, samples, threads, is_wanted):
        self.shapes.append(read("Combined").shape)
        self.at_once += 1
        self.most_at_once = max(self.most_at_once, self.at_once)
        end = time.perf_counter() + self.seconds
        while time.perf_counter() < end and (self.is_deaf or is_wanted()):
            time.sleep(0.001)
        self.at_once -= 1
        if self.error is not None:
            raise self.error
        if not is_wanted():
            self.left += 1
            return None
        return np.full_like(read("Combined"), CLEAN)


@pytest.fixture
def stand_in(monkeypatch):
    stand_in = StandIn()
    monkeypatch.setattr(denoise, "quickly_denoised_combined", stand_in)
    return stand_in


@pytest.fixture
def core():
    return FakeViewportCore()


@pytest.fixture
def render(core):
    with watched_render(core) as render:
        yield render
    assert not any(thread.name == "cistern-viewport-denoiser" for thread in threading.enumerate())


def is_clean(picture):
    return bool(np.all(picture.pixels == CLEAN))


def denoised_samples(pictures):
    """Of the finest pixels, each number once."""
    found = (picture.denoised for picture in pictures if picture.denoised is not None)
    return list(dict.fromkeys(samples for pixel, samples in found if pixel == 1))


def test_the_last_sample_is_denoised_and_the_line_says_so(core, render, stand_in):
    render.submit(job())
    wait_until(lambda: render.picture is not None and render.picture.denoised == (1, 4))
    assert is_clean(render.picture) and render.picture.status == "Rendering | Sample 4/4 | Denoised"
    assert stand_in.shapes[-1] == (REGION[1], REGION[0], 4) and stand_in.most_at_once == 1


def test_noise_is_shown_first_and_never_follows_what_is_denoised(core, render, stand_in):
    core.frame_seconds, stand_in.seconds = 0.1, 0.15
    render._seconds_per_pixel = 1e-9  # no coarse pictures
    render.submit(job(samples=12))
    wait_until(lambda: render.picture is not None and render.picture.denoised == (1, 12))
    kinds = [is_clean(picture) for picture in render.pictures]
    assert kinds[0] is False and kinds == sorted(kinds)
    assert denoised_samples(render.pictures)[0] == 1
    between = [picture.status for picture in render.pictures if "Denoised at Sample" in picture.status]
    assert between and between[0].startswith("Rendering | Sample ")


def test_coarse_pictures_are_denoised_while_finer_ones_render(core, render, stand_in):
    core.frame_seconds = 0.05
    render.submit(job())
    wait_until(lambda: render.picture is not None and render.picture.denoised == (1, 4))
    pixels = list(dict.fromkeys(picture.denoised[0] for picture in render.pictures if picture.denoised))
    assert pixels == [8, 4, 2, 1]
    noisy = [picture.pixels.shape[1] for picture in render.pictures if picture.denoised is None]
    assert noisy == [8], "the first picture comes at once, with its noise, and is the only one that does"
    assert "Rendering | Pixel Size 2× | Denoised" in [picture.status for picture in render.pictures]


def test_a_coarse_picture_never_replaces_a_finer_one(core, render, stand_in):
    stand_in.seconds, stand_in.is_deaf = 0.3, True
    render.submit(job(samples=1000))
    wait_until(lambda: any(picture.denoised for picture in render.pictures))
    widths = [picture.pixels.shape[1] for picture in render.pictures]
    assert widths == sorted(widths)


def test_twice_as_many_samples_are_always_worth_it_and_one_more_where_samples_are_dear(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(viewport_denoise.time, "perf_counter", lambda: now[0])
    schedule = Schedule()
    assert schedule.is_due(1)
    schedule.begin(3)
    assert not schedule.is_due(3) and not schedule.is_due(5) and schedule.is_due(6)
    schedule.finish(2.0)
    now[0] += 2.0 * (1.0 / FILTER_SHARE - 1.0) - 0.01
    assert not schedule.is_due(4)
    now[0] += 0.02
    assert schedule.is_due(4) and not schedule.is_due(3)


class FrugalSession(FakeViewportSession):
    """As the core: new pixels are there after the next frame, for who has read."""

    def __init__(self, core, settings):
        super().__init__(core, settings)
        self.version, self.has_been_read = 0, True

    def wait(self, seconds):
        progress = super().wait(seconds)
        if self.has_been_read and progress.frames_done > self.version:
            self.version, self.has_been_read = progress.frames_done, False
        progress.version = self.version
        return progress

    def read(self, name):
        self.has_been_read = True
        return super().read(name)


def test_pixels_are_those_of_the_sample_that_is_due(core, render, stand_in):
    """Not of the sample before it: they are asked for in time."""
    core.Session = lambda settings: FrugalSession(core, settings)
    core.frame_seconds, stand_in.seconds = 0.2, 0.1
    render._seconds_per_pixel = 1e-9
    render.submit(job(samples=9))
    wait_until(lambda: render.picture is not None and render.picture.denoised == (1, 9))
    assert denoised_samples(render.pictures) == [1, 2, 4, 8, 9]


def test_filters_take_a_small_share_of_many_samples(core, render, stand_in):
    """With ten times as many samples while a filter runs as before it, there are few filters."""
    stand_in.seconds, core.frame_seconds = 0.02, 0.002
    render._seconds_per_pixel = 1e-9
    render.submit(job(samples=1000))
    wait_until(lambda: render.picture is not None and render.picture.denoised == (1, 1000))
    samples = denoised_samples(render.pictures)
    assert 4 <= len(samples) <= 18
    assert len(stand_in.shapes) == len(samples)


def test_a_newer_job_waits_for_no_filter(core, render, stand_in):
    """Even if the library does not stop: the next picture of the next job comes meanwhile."""
    stand_in.seconds, stand_in.is_deaf = 1.5, True
    render._seconds_per_pixel = 1e-9
    render.submit(job(samples=100_000))
    wait_until(lambda: stand_in.shapes)
    start = time.perf_counter()
    render.submit(job("edit", samples=100_000))
    wait_until(lambda: render.picture.request == 2)
    assert time.perf_counter() - start < 0.75
    wait_until(lambda: stand_in.left == 1)
    assert not any(is_clean(picture) for picture in render.pictures)


def test_what_is_filtered_for_an_older_job_is_left_and_never_shown(core, render, stand_in):
    stand_in.seconds = 30.0
    render._seconds_per_pixel = 1e-9
    render.submit(job(samples=100_000))
    wait_until(lambda: stand_in.shapes)
    render.submit(job("edit", samples=2, is_denoised=False))
    wait_until(lambda: "Sample 2/2" in render.picture.status)
    assert stand_in.left == 1 and not any(is_clean(picture) for picture in render.pictures)


def test_paused_the_filter_is_left_and_the_picture_stays(core, render, stand_in):
    core.frame_seconds, stand_in.seconds = 0.02, 0.05
    render.submit(job(samples=100_000))
    wait_until(lambda: render.picture is not None and render.picture.denoised and render.picture.denoised[0] == 1)
    stand_in.seconds = 30.0
    count = len(stand_in.shapes)
    wait_until(lambda: len(stand_in.shapes) > count)
    render.pause()
    wait_until(lambda: stand_in.left >= 1 and core.sessions[-1].is_cancelled)
    assert is_clean(render.picture)


def test_without_denoising_nothing_is_filtered_or_read_for_it(core, render, stand_in):
    render.submit(job(is_denoised=False))
    wait_until(lambda: render.picture is not None and "Sample 4/4" in render.picture.status)
    assert stand_in.shapes == []
    assert {name for session in core.sessions for name in session.reads} == {"Combined"}


@pytest.mark.parametrize("failure", [denoise.DenoiserError("out of memory"), ValueError("shapes")])
def test_errors_are_told_once_and_pictures_keep_their_noise(core, render, stand_in, failure):
    stand_in.error = failure
    render.submit(job())
    wait_until(lambda: render.picture is not None and "Sample 4/4" in render.picture.status and render.warnings)
    assert render.warnings == [f"The picture is not denoised: {failure}"] and render.error is None
    count = len(stand_in.shapes)
    assert count <= 4 and not is_clean(render.picture)
    time.sleep(0.1)
    assert len(stand_in.shapes) == count
    stand_in.error = None
    render.submit(job("next"))
    wait_until(lambda: render.picture.denoised == (1, 4) and render.picture.request == 2)
    assert render.warnings == []


def test_an_error_at_the_end_brings_back_the_noisy_picture(core, render, stand_in):
    core.frame_seconds = 0.05
    render.submit(job())
    wait_until(lambda: render.picture is not None and render.picture.denoised)
    stand_in.error = denoise.DenoiserError("out of memory")
    wait_until(lambda: render.picture.denoised is None and "Sample 4/4" in render.picture.status)


def test_without_the_library_the_warning_says_so(core, render, monkeypatch):
    monkeypatch.setattr(open_image_denoise, "find_library", lambda: None)
    render.submit(job())
    wait_until(lambda: render.picture is not None and "Sample 4/4" in render.picture.status and render.warnings)
    assert render.warnings == ["The picture is not denoised: this Blender comes without Open Image Denoise"]
    assert "without" in denoise.viewport_sentence()
    render.submit(job(is_denoised=False))
    wait_until(lambda: render.warnings == [])


def test_a_border_is_denoised_in_its_place(core, render, stand_in):
    render.submit(job(shown=(0.25, 0.5, 0.75, 1.0)))
    wait_until(lambda: render.picture is not None and render.picture.denoised == (1, 4))
    assert render.picture.place == (0.25, 0.5, 0.75, 1.0) and render.picture.pixels.shape == (24, 32, 4)


def test_the_finest_pixel_is_the_users(core, render, stand_in):
    render.submit(job(finest=4))
    wait_until(lambda: render.picture is not None and render.picture.denoised == (4, 4))
    assert render.picture.pixels.shape == (12, 16, 4)


class Moving:
    """A session whose pixels are new at every second look, for a while."""

    def __init__(self, changes):
        self.version, self.changes, self.reads = 1, changes, 0

    def wait(self, seconds):
        return self

    def read(self, name):
        self.reads += 1
        if self.changes > 0 and self.reads % (1 + len(denoise.QUICK_PASSES)) == 2:
            self.version, self.changes = self.version + 1, self.changes - 1
        return np.full((1, 1, 3), self.version)


def test_passes_are_of_one_moment():
    passes = passes_of_one_moment(Moving(changes=2))
    assert set(passes) == {"Combined", *denoise.QUICK_PASSES}
    assert {float(pixels[0, 0, 0]) for pixels in passes.values()} == {3.0}
    assert len(passes_of_one_moment(Moving(changes=1000))) == len(passes)  # and does not try for ever


def test_alpha_and_what_is_empty_stay_and_lamps_in_view_are_kept(monkeypatch):
    layers = []

    def play(found, albedo, normal, has_clean_guides, threads, is_wanted):
        layers.append(found)
        assert has_clean_guides is (threads == 8)
        return 10.0 - found.scattered

    monkeypatch.setattr(denoise, "denoise_quickly", play)
    picture = np.array([[(4, 4, 4, 1), (4, 4, 4, 0.25), (0, 0, 0, 0)]], np.float32)
    emission = np.array([[(1, 1, 1), (1, 1, 1), (0, 0, 0)]], np.float32)
    passes = dict.fromkeys(denoise.QUICK_PASSES, 0.0 * emission) | {"Combined": picture, "Emission": emission}
    for samples in (7, 8):
        combined = denoise.quickly_denoised_combined(passes.__getitem__, samples, samples, lambda: True)
    assert np.array_equal(combined[..., 3], picture[..., 3]) and np.all(combined[0, 2] == 0.0)
    assert np.all(combined[0, :2, :3] == 7.0) and np.array_equal(layers[0].kept, emission)


# Settings and panel.


@pytest.mark.usefixtures("registered_addon")
@pytest.mark.parametrize(
    ("is_on", "view", "is_denoised"), [(True, "COMBINED", True), (True, "DIRECT", False), (False, "COMBINED", False)]
)
def test_the_render_alone_is_denoised(is_on, view, is_denoised):
    scene = fresh_scene()
    assert not scene.cistern.use_viewport_denoising
    scene.cistern.use_viewport_denoising, scene.cistern.viewport_view = is_on, view
    arguments = settings.viewport_settings(FakeViewportCore(), scene)
    assert settings.is_viewport_denoised(scene) is is_denoised
    assert (set(denoise.QUICK_PASSES) <= set(arguments["passes"])) is is_denoised
    assert not settings.is_denoised(scene, scene.view_layers[0], is_preview=False), (
        "final renders have a switch of their own"
    )


@pytest.mark.usefixtures("registered_addon")
@pytest.mark.parametrize("is_there", [True, False])
def test_the_panel_says_what_it_does(monkeypatch, is_there):
    monkeypatch.setattr(denoise, "is_there", lambda: is_there)
    scene = fresh_scene()
    panel = ui_sampling.CISTERN_RENDER_PT_viewport
    assert "use_viewport_denoising" in draw(panel, scene=scene)
    assert not any(line.startswith("label") for line in draw(panel, scene=scene))
    scene.cistern.use_viewport_denoising = True
    text = " ".join(line.removeprefix("label ") for line in draw(panel, scene=scene) if line.startswith("label"))
    assert text == denoise.viewport_sentence() and ("without" in text) is not is_there


# By the built core and the library.


SIZE = (200, 150)


def shown(core, samples, is_denoised, preset="INTERACTIVE", seed=0):
    """What a viewport of a small scene shows at the end."""
    scene = textured_scene(1)
    scene.cistern.viewport_preset, scene.cistern.seed = preset, seed
    scene.cistern.use_viewport_denoising = is_denoised
    sync, render = LiveSync(core), ViewportRender(core, lambda: None)
    kind = (1, samples) if is_denoised else None
    try:
        render.submit(real_job(core, scene, sync, samples))
        wait_until(lambda: render.picture is not None and f"Sample {samples}/{samples}" in render.picture.status)
        wait_until(lambda: render.picture.denoised == kind)
        assert (render.error, render.warnings, render.picture.pixels.shape[1]) == (None, [], SIZE[0])
        return render.picture.pixels
    finally:
        render.stop(waits=True)
        sync.close()


def real_job(core, scene, sync, samples):
    view = look_through_camera(scene, SIZE, sync)
    arguments = settings.viewport_settings(core, scene)
    arguments["passes"] = tuple(arguments["passes"])
    is_denoised = settings.is_viewport_denoised(scene)
    members = tuple(sorted(arguments.items()))
    return Job(sync.builder.snapshot(), view, members, "COMBINED", (("samples", samples),), 1, is_denoised)


@has_library
@pytest.mark.parametrize("preset", ["INTERACTIVE", "PATH_TRACING"])
@pytest.mark.usefixtures("registered_addon")
def test_a_denoised_viewport_is_nearer_to_a_long_one(built_core, preset, monkeypatch):
    """Planted: guides in the wrong order."""
    long = shown(built_core, 256, False, "PATH_TRACING", seed=1)
    noisy, clean = (shown(built_core, 1, is_denoised, preset) for is_denoised in (False, True))
    before, after = (error(picture[..., :3], long[..., :3]) for picture in (noisy, clean))
    monkeypatch.setattr(denoise, "GUIDE_PASSES", denoise.GUIDE_PASSES[::-1])
    planted = error(shown(built_core, 1, True, preset)[..., :3], long[..., :3])
    assert after < 0.65 * before and planted > 1.1 * after
    outside = clean[..., 3] == 0.0
    assert outside.any() and np.all(clean[outside] == 0.0)
    assert clean[..., :3].mean() == pytest.approx(long[..., :3].mean(), rel=0.04)
