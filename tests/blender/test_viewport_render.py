"""The rendering thread of a viewport: coarse first, always the newest job, and nobody waits for it."""

import threading
import time

import numpy as np
import pytest

from addon import viewport_render
from addon.viewport_camera import WHOLE, View
from addon.viewport_render import FIRST_PICTURE_SECONDS, PATIENCE_SECONDS, Job
from tests.blender.viewport_fakes import REGION, FakeViewportCore, watched_render

SETTINGS = (("cell_pixels", 0.0), ("keep_history", True), ("passes", ()))


def job(scene="scene", samples=3, finest=1, shown=WHOLE, mode="COMBINED", **limits: float) -> Job:
    limits = tuple(({"samples": samples} | limits).items())
    return Job(scene, View(*REGION, shown, ()), SETTINGS, mode, limits, finest)


@pytest.fixture
def core():
    return FakeViewportCore()


@pytest.fixture
def render(core):
    with watched_render(core) as render:
        yield render


def wait_until(condition, seconds=20.0):
    end = time.perf_counter() + seconds
    while not condition():
        assert time.perf_counter() < end, "not in time"
        time.sleep(0.002)


def sizes(core):
    return [session.settings.width for session in core.sessions]


def test_pixels_get_finer_until_they_are_those_of_the_screen(core, render):
    render.submit(job())
    wait_until(lambda: render.pictures and render.pictures[-1].status.count("Sample 3/3"))
    assert sizes(core) == [8, 16, 32, 64]
    assert [session.settings.samples for session in core.sessions] == [1, 1, 1, 3]
    assert [picture.pixels.shape for picture in render.pictures[:4]] == [
        (6, 8, 4),
        (12, 16, 4),
        (24, 32, 4),
        (48, 64, 4),
    ]
    coarse = [picture.status for picture in render.pictures[:3]]
    assert coarse == [f"Rendering | Pixel Size {pixel}×" for pixel in (8, 4, 2)]
    assert all(session.is_cancelled for session in core.sessions)


def test_the_first_and_the_finest_pictures_each_go_on_with_their_own_history(core, render):
    render.submit(job())
    wait_until(lambda: len(core.sessions) == 4)
    drafts = [vars(session.settings) for session in core.sessions[:3]]
    assert [(draft["is_draft"], draft["keep_history"]) for draft in drafts] == [
        (True, True),
        (True, False),
        (True, False),
    ]
    finest = core.sessions[3].settings
    assert finest.keep_history and not hasattr(finest, "is_draft")


def test_the_finest_pixel_is_the_users(core, render):
    render.submit(job(finest=4))
    wait_until(lambda: len(core.sessions) >= 2 and render.pictures[-1].pixels.shape[1] == 16)
    assert sizes(core) == [8, 16]


@pytest.mark.parametrize(("pixels_in_time", "first"), [(64 * 48, 64), (64 * 48 - 1, 32), (32 * 24, 32), (1, 4)])
def test_the_first_picture_is_as_coarse_as_it_has_to_be(core, render, pixels_in_time, first):
    render._seconds_per_pixel = 0.99999 * FIRST_PICTURE_SECONDS / pixels_in_time
    render.submit(job())
    wait_until(lambda: core.sessions)
    assert sizes(core)[0] == first


def test_jobs_before_the_newest_are_never_begun(core, render):
    core.frame_seconds = 0.05
    render.submit(job("first"))
    wait_until(lambda: core.sessions)
    for index in range(20):
        render.submit(job(index))
    wait_until(lambda: any(session.scene != "first" for session in core.sessions))
    assert {session.scene for session in core.sessions} == {"first", 19}


def test_while_jobs_keep_coming_each_that_is_begun_is_seen(core, render):
    core.frame_seconds = 0.03
    end = time.perf_counter() + 1.0
    index = 0
    while time.perf_counter() < end:
        render.submit(job(index := index + 1))
        time.sleep(0.004)
    assert len(render.pictures) >= 8
    coarse = [session for session in core.sessions if session.settings.width == 8]
    assert len(coarse) <= len(render.pictures) + 1


def test_a_frame_that_takes_long_is_left_and_the_next_is_coarser(core, render):
    core.frame_seconds = 30.0
    render.submit(job("slow"))
    wait_until(lambda: core.sessions)
    start = time.perf_counter()
    render.submit(job("edit"))
    wait_until(lambda: len(core.sessions) >= 2)
    assert PATIENCE_SECONDS * 0.5 < time.perf_counter() - start < 5.0
    assert sizes(core)[1] == 4


def test_building_a_scene_does_not_try_the_patience(core, render):
    core.building_seconds = 3.0 * PATIENCE_SECONDS
    render.submit(job("large"))
    wait_until(lambda: core.sessions)
    render.submit(job("edit"))
    wait_until(lambda: len(core.sessions) >= 2)
    assert [picture.pixels[0, 0, 0] for picture in render.pictures][:1] == [1.0]


def test_submitting_and_stopping_never_wait_for_a_frame(core, render):
    core.frame_seconds = 30.0
    render.submit(job())
    wait_until(lambda: core.sessions)
    start = time.perf_counter()
    render.submit(job("other"))
    render.pause()
    render.stop()
    assert time.perf_counter() - start < 0.1
    wait_until(lambda: not render.is_alive)


def seconds_of(call):
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


@pytest.fixture
def long_redraw(monkeypatch) -> float:
    """Seconds for which a redraw waits, far beyond the delays of a busy machine."""
    monkeypatch.setattr(viewport_render, "REDRAW_SECONDS", 2.0)
    return 2.0


def test_a_redraw_gets_the_picture_of_its_edit(core, render, long_redraw):
    core.frame_seconds = 0.2
    render.submit(job("edit"))
    assert 0.1 < seconds_of(render.await_picture) < long_redraw
    assert render.picture.request == render.requests == 1
    assert not render.pictures, "a redraw was asked for by the picture that it was about to show"


def test_a_redraw_does_not_wait_long(core, render, long_redraw):
    core.frame_seconds = 30.0
    render.submit(job("edit"))
    assert long_redraw <= seconds_of(render.await_picture) + 0.1
    assert seconds_of(render.await_picture) < 0.5 * long_redraw  # the same edit is not waited for again


def test_while_pictures_are_late_ever_fewer_are_waited_for(core, render, monkeypatch):
    monkeypatch.setattr(viewport_render, "REDRAW_SECONDS", 0.02)
    core.frame_seconds = 30.0

    def is_awaited(number: int) -> bool:
        render.submit(job(number))
        render.await_picture()
        return render._unawaited == 0

    assert [number for number in range(50) if is_awaited(number)] == [0, 2, 6, 14, 30, 46]
    core.frame_seconds = 0.002
    monkeypatch.setattr(viewport_render, "REDRAW_SECONDS", 20.0)
    render.submit(job("soon"))
    wait_until(lambda: render.picture is not None)
    assert is_awaited(50) and is_awaited(51)


def test_paused_it_rests_with_its_picture(core, render):
    render.submit(job(samples=100_000))
    wait_until(lambda: render.picture is not None and render.picture.pixels.shape[1] == 64)
    render.pause()
    wait_until(lambda: core.sessions[-1].is_cancelled)
    count = len(render.pictures)
    time.sleep(0.3)
    assert len(render.pictures) == count and render.picture is not None
    render.submit(job("on"))
    wait_until(lambda: len(render.pictures) > count)


def test_a_failure_is_told_and_the_next_job_works(core, render):
    core.failure = "out of memory"
    render.submit(job())
    wait_until(lambda: render.error == "out of memory")
    core.failure = ""
    render.submit(job("smaller"))
    wait_until(lambda: render.picture is not None and render.error is None)


def test_a_border_renders_its_part_in_its_place(core, render):
    render.submit(job(shown=(0.25, 0.5, 0.75, 1.0)))
    wait_until(lambda: core.sessions and sizes(core)[-1] == 64 and core.sessions[-1].is_cancelled)
    assert core.sessions[-1].settings.region == (16, 24, 32, 24)
    assert render.picture.place == (0.25, 0.5, 0.75, 1.0)


def test_cells_keep_their_size_on_the_screen(core, render):
    render.submit(job(mode="CELLS"))
    wait_until(lambda: len(core.sessions) == 4)
    assert [session.settings.cell_pixels for session in core.sessions] == [1.25, 2.5, 5.0, 10.0]
    wait_until(lambda: core.sessions[-1].is_cancelled)
    render._seconds_per_pixel = 1.0
    render.submit(job(mode="CELLS"))
    wait_until(lambda: len(core.sessions) >= 5)
    assert (sizes(core)[4], core.sessions[4].settings.cell_pixels) == (4, 1.0)  # the core allows no less


def test_all_sessions_share_one_cache_and_run_beside_the_caller(core, render):
    render.submit(job())
    wait_until(lambda: len(core.sessions) == 4)
    assert len({id(session.cache) for session in core.sessions}) == 1
    assert all(session.thread is not threading.current_thread() for session in core.sessions)


def test_the_limits_are_those_of_the_finest_picture(core, render):
    render.submit(job(time_limit=5.0))
    wait_until(lambda: len(core.sessions) == 4)
    assert [getattr(session.settings, "time_limit", None) for session in core.sessions] == [None, None, None, 5.0]


def test_numbers_are_shown_through_their_scale(core, render):
    render.submit(job(mode="CELL_OCCUPANCY"))
    wait_until(lambda: render.picture is not None)
    assert render.picture.pixels.shape[2] == 4 and np.all(render.picture.pixels[..., 3] == 1.0)
