"""History that outlives its session: what a RenderCache carries from one render to the next, through edits.

The unit of evidence is the replica: a session of a few frames before an edit, then the first frame of a second session
after it, with one seed; against cold starts of the reference path tracer after the edit.

False-alarm rate of all comparisons in this file together: FALSE_ALARM_RATE, shared out by Šidák.
"""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Callable

import cistern_core as core
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.core_scenes import DEFAULTS
from tests.support.edited_scenes import EDITS, EditableScene, edited, studio
from tests.support.statistics import Comparison, block_means, compare_replicas, sidak

FALSE_ALARM_RATE = 0.01
REPLICAS = 48
REFERENCE_SAMPLES = 16
FRAMES_BEFORE = 3
SIZE = 20
BLOCKS = 4

SYSTEMS: dict[str, dict] = {
    "restir": dict(direct="RESTIR"),
    "visibility": dict(direct="RESTIR", visibility_reuse=True),
    "cache": dict(direct="RESTIR_CACHE"),
    "cells": dict(secondary="CELL_RESERVOIRS"),
    "screen": dict(indirect="SCREEN_REUSE"),
    "world": dict(indirect="WORLD_REUSE"),
    "all screen": dict(direct="RESTIR", secondary="CELL_RESERVOIRS", indirect="SCREEN_REUSE"),
    "all world": dict(direct="RESTIR", secondary="CELL_RESERVOIRS", indirect="WORLD_REUSE"),
    "shared": dict(direct="RESTIR", indirect="CELL_SHARED"),
}
SETTINGS = dict(light_candidates=4, spatial_radius=6.0, cache_candidates=16, cache_refresh=4, max_bounces=2)
SETTINGS |= dict(cell_pixels=10)

QUICK: list[tuple[str, str]] = [
    *(("restir", edit) for edit in EDITS),
    ("visibility", "moved_ball"),
    ("visibility", "moved_tile"),
    ("cache", "camera"),
    ("cells", "moved_lamp"),
    ("cells", "everything"),
    ("screen", "camera"),
    ("world", "camera"),
    ("screen", "moved_lamp"),
    ("world", "everything"),
    ("shared", "everything"),
]
# Whose history is of light that bounced, after edits of what it bounces off.
BOUNCED = [
    (system, edit) for system in ("cells", "screen", "world", "shared") for edit in ("painted_wall", "bent_floor")
]
ALL = [(system, edit) for system in SYSTEMS for edit in EDITS]
SLOW = [case for case in ALL if case not in QUICK]
CASE_RATE = sidak(FALSE_ALARM_RATE, len(ALL) + len(BOUNCED))


def run(scene: core.Scene, cache: core.RenderCache | None, **settings) -> core.Session:
    """A finished session that goes on with the history of the cache."""
    passes = ["Direct", "Indirect", "Reservoir Confidence", "Reservoir Weight"]
    members = (
        DEFAULTS | SETTINGS | dict(width=SIZE, height=SIZE, samples=1, passes=passes, keep_history=True) | settings
    )
    session = core.Session(core.Settings(**members))
    session.start(scene, cache)
    progress = session.wait(600.0)
    assert progress.status is core.Status.DONE, progress.error
    assert progress.non_finite_samples == progress.non_finite_weights == 0
    return session


def color(session: core.Session) -> NDArray:
    return session.read("Combined")[..., :3]


def bounced(session: core.Session) -> NDArray:
    return session.read("Indirect")


@functools.cache
def scenes(edit: str) -> tuple[core.Scene, core.Scene]:
    return edited(edit)


def values(picture: NDArray) -> NDArray:
    return np.concatenate([block_means(picture, n, n) for n in (1, BLOCKS)])


Light = Callable[[core.Session], NDArray]


@functools.cache
def reference(edit: str, light: Light = color) -> NDArray:
    after = scenes(edit)[1]
    seeds = range(100_000, 100_000 + REPLICAS)
    return np.array([values(light(run(after, None, samples=REFERENCE_SAMPLES, seed=seed))) for seed in seeds])


def after_edit(system: str, edit: str, seed: int, light: Light = color, stale: float = 0.0) -> NDArray:
    """The first frame after the edit. `stale`: planted, a share of its light that is what it was before."""
    before, after = scenes(edit)
    cache = core.RenderCache()
    members = SYSTEMS[system] | dict(seed=seed)
    earlier = run(before, cache, **members | dict(samples=FRAMES_BEFORE))
    return (1.0 - stale) * light(run(after, cache, **members)) + stale * light(earlier)


def compare(system: str, edit: str, light: Light = color, scale: float = 1.0, stale: float = 0.0) -> Comparison:
    seeds = range(1, REPLICAS + 1)
    pictures = np.array([values(after_edit(system, edit, seed, light, stale)) for seed in seeds])
    return compare_replicas(scale * pictures, reference(edit, light), CASE_RATE)


@pytest.mark.parametrize(("system", "edit"), QUICK)
def test_the_first_frame_after_an_edit_is_unbiased(system: str, edit: str) -> None:
    result = compare(system, edit)
    assert result.agrees, result


@pytest.mark.slow
@pytest.mark.parametrize(("system", "edit"), SLOW)
def test_every_system_is_unbiased_after_every_edit(system: str, edit: str) -> None:
    result = compare(system, edit)
    assert result.agrees, result


def test_too_much_light_is_seen() -> None:
    """Planted bug: weights of the frame after the edit 8 % too large."""
    result = compare("restir", "moved_lamp", scale=1.08)
    assert not result.agrees, result


@pytest.mark.parametrize(("system", "edit"), BOUNCED)
def test_bounced_light_after_an_edit_is_that_of_the_new_scene(system: str, edit: str) -> None:
    """Planted bug: half of it as before, as history would leave it that nothing weighs against the present."""
    assert compare(system, edit, bounced).agrees
    assert not compare(system, edit, bounced, stale=0.5).agrees


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("system", SYSTEMS)
def test_two_sessions_make_the_frames_of_one(system: str, threads: int) -> None:
    """To the last bit, as far as that can be seen: in reservoirs, and in pictures but for the sums over frames."""
    scene = scenes("nothing")[0]
    one = run(scene, None, samples=4, **SYSTEMS[system])
    cache = core.RenderCache()
    parts = [run(scene, cache, samples=n, threads=threads, **SYSTEMS[system]) for n in (2, 1, 1)]
    for name in ("Reservoir Confidence", "Reservoir Weight"):
        assert np.array_equal(one.read(name), parts[-1].read(name))
    mean = (2.0 * color(parts[0]) + color(parts[1]) + color(parts[2])) / 4.0
    np.testing.assert_allclose(mean, color(one), rtol=1e-5, atol=1e-6)


def test_first_frames_alone_may_have_history() -> None:
    """They look at it and leave it; the others are those of independent frames. Planted bug: all have it. Random
    numbers, since Sobol points depend on how many frames there will be."""
    scene = scenes("nothing")[0]
    cells = dict(indirect="CELL_SHARED", sequence="RANDOM")

    def last(*renders: dict) -> NDArray:
        cache = core.RenderCache()
        return [color(run(scene, cache, **cells | dict(first_frame_history=True) | more)) for more in renders][-1]

    def later_frames(*history: dict, **more) -> NDArray:
        return 4.0 * last(*history, dict(samples=4) | more) - last(*history, dict(samples=1) | more)

    independent = later_frames(temporal_reuse=False)
    np.testing.assert_allclose(later_frames(), independent, rtol=1e-4, atol=1e-5)
    assert not np.allclose(later_frames(first_frame_history=False), independent, rtol=1e-2, atol=1e-2)
    one, many = dict(samples=1), dict(samples=5)
    assert np.array_equal(last(many, one), last(one, one))
    assert not np.array_equal(last(one, one), last(one))


def test_other_systems_keep_the_history_of_all_frames() -> None:
    scene = scenes("nothing")[0]
    for system in (dict(direct="RESTIR"), dict(secondary="CELL_RESERVOIRS"), SYSTEMS["screen"], SYSTEMS["world"]):
        first, all_frames = (
            color(run(scene, None, samples=3, **dict(indirect="CELL_SHARED", first_frame_history=is_first) | system))
            for is_first in (True, False)
        )
        assert np.array_equal(first, all_frames)


def test_equal_scenes_made_anew_keep_the_history_of_lights() -> None:
    """Planted bug for the test above as well: without history, reservoirs differ."""
    first, cache = run(scenes("nothing")[0], core.RenderCache()), core.RenderCache()
    assert not np.array_equal(first.read("Combined"), np.zeros((SIZE, SIZE, 4), np.float32))
    settings = SYSTEMS["restir"]
    run(studio().snapshot(), cache, **settings)
    kept = run(studio().snapshot(), cache, **settings).read("Reservoir Confidence")
    cold = run(studio().snapshot(), None, **settings).read("Reservoir Confidence")
    assert kept.max() <= cold.max(), "meshes are other objects: history is dropped where they are seen"
    scene = studio()
    run(scene.snapshot(), cache, **settings)
    kept = run(scene.snapshot(), cache, **settings).read("Reservoir Confidence")
    assert np.median(kept) > 1.5 * np.median(cold)


@pytest.mark.parametrize("system", ["restir", "cells", "screen"])
def test_nothing_is_kept_unless_it_is_wanted(system: str) -> None:
    scene = scenes("nothing")[0]
    cold = run(scene, None, **SYSTEMS[system])
    for unwanted in (dict(keep_history=False), dict(temporal_reuse=False), dict(max_bounces=3), dict(bias="FAST")):
        cache = core.RenderCache()
        run(scene, cache, **SYSTEMS[system] | unwanted)
        assert np.array_equal(color(run(scene, cache, **SYSTEMS[system])), color(cold)), unwanted
    run(scene, cache, **SYSTEMS[system])
    cache.drop_history()
    assert np.array_equal(color(run(scene, cache, **SYSTEMS[system])), color(cold))


def mean_confidence(session: core.Session) -> float:
    return float(session.read("Reservoir Confidence").mean())


@pytest.mark.parametrize("edit", EDITS)
def test_history_of_lights_survives_edits(edit: str) -> None:
    """Confidence counts the frames behind a reservoir: nearly everywhere more than a cold start has. A surface
    of another shape starts cold."""
    before, after = scenes(edit)
    settings = dict(direct="RESTIR", spatial_reuse=False)
    cache = core.RenderCache()
    run(before, cache, samples=8, **settings)
    kept = mean_confidence(run(after, cache, **settings))
    cold = mean_confidence(run(after, None, **settings))
    assert kept > (4.0 if edit in ("everything", "bent_floor") else 6.0) * cold


def test_history_follows_a_moving_object() -> None:
    """Keys name things whatever order they come in; without keys, and in another order, the ball is another thing."""

    def confidence_on_ball(keys: bool) -> float:
        scene = studio()
        cache = core.RenderCache()
        settings = dict(direct="RESTIR", spatial_reuse=False, width=40, height=40)
        run(scene.snapshot(), cache, samples=8, **settings)
        scene.move(4, (0.5, 0.0, 0.0))
        after = scene.snapshot()
        if not keys:
            before = core.SceneBuilder(after)
            before.clear_instances()
            mesh, materials, matrices = zip(*scene.instances, strict=True)
            zeros = np.zeros(len(mesh), np.int32)
            before.add_instances(np.array(mesh, np.int32), np.array(materials, np.int32), zeros,
                                 np.array(matrices, np.float32), np.full(len(mesh), 31, np.uint8))  # fmt: skip
            after = before.snapshot()
        return float(run(after, cache, **settings).read("Reservoir Confidence")[14:20, 20:28].mean())

    assert confidence_on_ball(keys=True) > 2.0 * confidence_on_ball(keys=False)


def test_a_sharp_picture_goes_on_with_a_coarse_one() -> None:
    scene = scenes("nothing")[0]
    cache = core.RenderCache()
    settings = dict(direct="RESTIR", indirect="SCREEN_REUSE", spatial_reuse=False)
    run(scene, cache, samples=8, width=20, height=20, **settings)
    assert mean_confidence(run(scene, cache, width=40, height=40, **settings)) > 4.0
    part = run(scene, cache, width=40, height=40, region=(7, 3, 20, 30), **settings)
    assert mean_confidence(part) > 5.0
    back = run(scene, cache, width=11, height=9, **settings)
    assert np.isfinite(color(back)).all() and mean_confidence(back) > 3.0


def test_odd_orders() -> None:
    """Empty scenes, scenes without lights, cancelled sessions in between: complete frames come out of all."""
    cache, settings = core.RenderCache(), SYSTEMS["all world"]
    empty = EditableScene()
    empty.set_camera((0, -3, 0), (0, 0, 0))
    nothing_there = empty.builder.snapshot()
    unlit = studio()
    for light in range(2):
        unlit.builder.remove_light(light)
    for scene in (nothing_there, scenes("nothing")[0], nothing_there, unlit.snapshot(), scenes("everything")[1]):
        picture = color(run(scene, cache, **settings))
        assert np.isfinite(picture).all()
        cancelled = core.Session(core.Settings(width=SIZE, height=SIZE, samples=9, keep_history=True, **settings))
        cancelled.start(scene, cache)
        cancelled.cancel()
    assert picture.mean() > 0.05


def test_a_cancelled_session_gives_history_back() -> None:
    """One that did not finish a frame leaves what it took: no frame is lost to an impatient user."""
    scene, cache = scenes("nothing")[0], core.RenderCache()
    settings = dict(direct="RESTIR", spatial_reuse=False)
    run(scene, cache, samples=8, **settings)
    for _ in range(3):
        session = core.Session(
            core.Settings(
                **DEFAULTS | SETTINGS | settings | dict(width=4096, height=2048, samples=1, keep_history=True)
            )
        )
        session.start(scene, cache)
        session.cancel()
    assert mean_confidence(run(scene, cache, **settings)) > 6.0


def test_two_sessions_may_share_a_cache() -> None:
    """One has the history, the other starts cold; both render complete frames, and may be dropped by any thread."""
    scene, cache = scenes("nothing")[0], core.RenderCache()
    cold = color(run(scene, None, samples=2, **SYSTEMS["all screen"]))
    pictures: list[NDArray] = []

    def render() -> None:
        for _ in range(4):
            pictures.append(color(run(scene, cache, samples=2, **SYSTEMS["all screen"])))

    threads = [threading.Thread(target=render) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(pictures) == 12
    assert all(np.isfinite(p).all() and abs(p.mean() / cold.mean() - 1.0) < 0.2 for p in pictures)
    worker = threading.Thread(target=cache.drop_history)
    worker.start()
    worker.join()


def test_history_costs_memory_that_can_be_freed() -> None:
    scene, cache = scenes("nothing")[0], core.RenderCache()
    run(scene, cache, width=200, height=200, **SYSTEMS["all screen"])
    with_history = cache.memory_bytes
    cache.drop_history()
    assert with_history - cache.memory_bytes > 200 * 200 * 500
    assert cache.memory_bytes > 0


@pytest.mark.parametrize("keep_instances", [False, True])
def test_pictures_from_a_cache_are_those_without(keep_instances: bool) -> None:
    """Embree scenes and lights that are kept from before an edit serve as well as new ones."""
    cache = core.RenderCache()
    settings = dict(keep_history=False, keep_instances=keep_instances, samples=2)
    for edit in EDITS:
        for scene in scenes(edit):
            again = color(run(scene, cache, **settings))
            assert np.array_equal(again, color(run(scene, None, **settings))), edit


def test_parts_of_scenes_are_shared() -> None:
    scene = studio()
    before = scene.snapshot()
    builder = core.SceneBuilder(before)
    assert builder.add_object_name("objects") == 0
    mesh = builder.take_mesh(before, 0)
    assert mesh == 6
    assert builder.mesh_statistics(mesh) == builder.mesh_statistics(0)
    with pytest.raises(core.Error, match="no mesh with handle 99"):
        builder.take_mesh(before, 99)
    with pytest.raises(core.Error, match="keys"):
        builder.add_instances(
            np.zeros(1, np.int32), np.zeros(1, np.int32), np.zeros(1, np.int32), np.eye(4, dtype=np.float32)[None],
            np.full(1, 31, np.uint8), keys=np.zeros(2, np.uint64),
        )  # fmt: skip
    assert np.array_equal(color(run(builder.snapshot(), None)), color(run(before, None)))


@pytest.mark.parametrize("system", ["restir", "cells", "screen", "world"])
def test_cancel_returns_soon_in_large_pictures(system: str) -> None:
    """0.1 s is the goal; the bound leaves room for a busy machine. Buffers of a gigabyte must not be waited for."""
    scene, cache = scenes("nothing")[0], core.RenderCache()
    for seconds in (0.05, 0.2, 0.6):
        members = DEFAULTS | SYSTEMS[system] | dict(width=1920, height=1080, samples=100, keep_history=True)
        session = core.Session(core.Settings(**members))
        session.start(scene, cache)
        time.sleep(seconds)
        start = time.perf_counter()
        session.cancel()
        assert time.perf_counter() - start < 0.4
