"""Light choice that learns against the reference path tracer, on small scenes of lamps, emissive triangles, sky, glossy
and see-through things.

As in test_direct_reuse.py the unit of evidence is the replica: a whole session from a cold start, whose later frames
choose lights by what the earlier ones saw; block means of both estimators meet in Welch's t-tests.

False-alarm rate of all comparisons in this file together: FALSE_ALARM_RATE, shared out by Šidák over the cases and the
values of each.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import cistern_core as core
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support import direct_light_scenes, path_scenes
from tests.support.core_scenes import SceneDescription, emission, principled, render
from tests.support.statistics import Comparison, block_means, compare_replicas, sidak

FALSE_ALARM_RATE = 0.01
REPLICAS = 48
FRAMES = 9  # the table of the last is of eight
REFERENCE_SAMPLES = 32
SIZE = 24
BLOCKS = 3
SETTINGS = dict(max_bounces=2, light_candidates=4, spatial_radius=6.0)
Answers = tuple[str, str, str]


def lanterns() -> core.Scene:
    """Two rooms with a wall between, each with emissive quads of its own colour, behind blinds; the sky looks in."""
    scene = SceneDescription()
    white, glossy = principled((0.7, 0.7, 0.7)), principled((0.5, 0.5, 0.5), specular=0.5, roughness=0.3)
    scene.add_quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), glossy, name="floor")
    scene.add_quad((-2, 2, 0), (4, 0, 0), (0, 0, 2), white, name="back")
    scene.add_quad((0.02, -2, 0), (0, 4, 0), (0, 0, 1.4), white, name="wall")
    scene.add_quad((-2, -1, 1.8), (4, 0, 0), (0, 3, 0), white, name="ceiling")
    for k in range(16):
        side, x, y = (-1.0, 1.0)[k % 2], 0.3 + 0.2 * (k // 2), -1.2 + 0.37 * (k // 2)
        color = (4.0, 1.0 + 0.2 * k, 0.5) if k % 2 else (0.5, 1.0 + 0.2 * k, 4.0)
        scene.add_quad((side * x, y, 0.5), (0.2, 0, 0), (0, 0.0, 0.12), emission(color), name="lantern")
        scene.add_quad((side * x - 0.05, y - 0.1, 0.35), (0.3, 0, 0), (0, 0, 0.2), white, name="blind")
    direct_light_scenes.sky(scene, 0.05, 0.3)
    scene.set_camera((0.0, -4.4, 2.2), (0.0, 0.0, 0.5), half_width=0.42)
    return scene.snapshot()


SCENES: dict[str, Callable[[], core.Scene]] = {
    "lanterns": lanterns,
    **{name: direct_light_scenes.SCENES[name] for name in ("occluders", "many_lights", "transparency", "spots")},
    "open_scene": path_scenes.SCENES["open_scene"],
}
BOTH: Answers = ("LEARNED", "LEARNED", "PATH")
QUICK: list[tuple[Answers, str]] = [
    *((BOTH, name) for name in SCENES),
    (("LEARNED", "NEE", "PATH"), "lanterns"),
    (("NEE", "LEARNED", "PATH"), "lanterns"),
    (("RIS", "LEARNED", "PATH"), "many_lights"),
    (("LEARNED", "CELL_RESERVOIRS", "PATH"), "occluders"),
    (("LEARNED", "LEARNED", "SCREEN_REUSE"), "lanterns"),
    (("LEARNED", "LEARNED", "WORLD_REUSE"), "many_lights"),
    (("LEARNED", "LEARNED", "CELL_SHARED"), "lanterns"),
]
CASE_RATE = sidak(FALSE_ALARM_RATE, len(QUICK))


@functools.cache
def scene(name: str) -> core.Scene:
    return SCENES[name]()


def members_of(answers: Answers) -> dict:
    return dict(zip(("direct", "secondary", "indirect"), answers, strict=True)) | SETTINGS


def sessions(name: str, count: int, first_seed: int, **settings) -> NDArray:
    """(count, block means of the picture and its mean) of cold starts with different seeds."""

    def values(seed: int) -> NDArray:
        picture = render(scene(name), SIZE, seed=seed, **settings)["Combined"][..., :3]
        return np.concatenate([block_means(picture, n, n) for n in (1, BLOCKS)])

    return np.array([values(first_seed + k) for k in range(count)])


@functools.cache
def reference(name: str) -> NDArray:
    return sessions(name, REPLICAS, 100_000, samples=REFERENCE_SAMPLES, **SETTINGS)


def compare(answers: Answers, name: str, scale: float = 1.0) -> Comparison:
    pictures = sessions(name, REPLICAS, 1, samples=FRAMES, **members_of(answers))
    return compare_replicas(scale * pictures, reference(name), CASE_RATE)


@pytest.mark.parametrize(("answers", "name"), QUICK, ids=["-".join([*answers, name]) for answers, name in QUICK])
def test_learned_choice_agrees_with_the_reference(answers: Answers, name: str) -> None:
    result = compare(answers, name)
    assert result.agrees, result


@pytest.mark.parametrize("name", SCENES)
def test_three_percent_too_much_light_is_seen(name: str) -> None:
    """Planted bug: as if light samples and scattered rays together counted for 1.03."""
    result = compare(BOTH, name, scale=1.03)
    assert not result.agrees, result


def hidden_lamps() -> core.Scene:
    """A floor beside a wall, behind which all but four of many lamps are."""
    scene = SceneDescription()
    gray = principled((0.6, 0.6, 0.6))
    scene.add_quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), gray, name="floor")
    scene.add_quad((0, -2, 0), (0, 4, 0), (0, 0, 3), gray, name="wall")
    for k in range(60):
        position = (-0.1 - 0.3 * (k % 3), -1.9 + 0.065 * k, 0.3 + 0.1 * (k % 5))
        scene.builder.add_point_light("hidden", position, 0.02, (1.0, 1.0, 1.0))
    for k in range(4):
        scene.builder.add_point_light("lamp", (1.6, -1.5 + k, 1.2), 0.02, (1.0, 0.8, 0.6))
    scene.set_camera((1.0, 0.0, 3.5), (1.0, 0.0, 0.0), half_width=0.25)
    return scene.snapshot()


def test_learning_pays_where_most_lights_are_hidden() -> None:
    """At most half of the light tree's variance at equal samples that are not stratified: it knows nothing of walls.
    Ratios of other seeds are within a tenth of one another."""
    picture = hidden_lamps()

    def variance(direct: str) -> float:
        settings = dict(samples=64, max_bounces=0, direct=direct, sequence="RANDOM")
        pictures = [render(picture, SIZE, seed=seed, **settings)["Combined"][..., :3] for seed in range(1, 9)]
        return float(np.var(pictures, axis=0, ddof=1).mean())

    assert variance("LEARNED") < 0.5 * variance("NEE")


@pytest.mark.parametrize(
    "answers", [BOTH, ("LEARNED", "CELL_RESERVOIRS", "PATH"), ("LEARNED", "LEARNED", "CELL_SHARED")]
)
def test_same_bits_for_any_number_of_threads(answers: Answers) -> None:
    passes = ["Direct", "Indirect", "Emission", "Environment"]
    settings = members_of(answers) | dict(size=SIZE, samples=6, passes=passes)
    one = render(scene("many_lights"), seed=3, threads=1, **settings)
    for threads in (2, 7):
        several = render(scene("many_lights"), seed=3, threads=threads, **settings)
        assert all(np.array_equal(one[name], several[name]) for name in one)
    other = render(scene("many_lights"), seed=4, threads=1, **settings)
    assert not np.array_equal(one["Indirect"], other["Indirect"])  # or else equality would prove nothing


def test_a_single_emitter_costs_nothing_and_changes_nothing() -> None:
    """Nothing is learned where there is nothing to choose: the picture is the reference's to the last bit."""
    settings = dict(size=SIZE, samples=4, seed=3, max_bounces=3)
    room = path_scenes.SCENES["glossy_room"]()
    plain = render(room, **settings)
    learned = render(room, direct="LEARNED", secondary="LEARNED", **settings)
    assert all(np.array_equal(plain[name], learned[name]) for name in plain)


def test_passes_show_what_was_learned() -> None:
    """Both rooms have eight lanterns of their own: more than one matters, fewer than all."""
    names = ["Light Choice Entropy", "Light Choice Samples"]
    learned, plain = (
        render(lanterns(), 48, samples=33, seed=1, passes=names, **SETTINGS | dict(direct=direct))
        for direct in ("LEARNED", "NEE")
    )
    entropy, samples = (learned[name][..., 0] for name in names)
    known = samples > 0.0
    assert known.mean() > 0.2
    assert samples[known].min() >= 64.0
    assert 1.5 < np.exp(np.median(entropy[known])) < 16.0
    assert np.all(entropy[~known] == 0.0)
    assert all(np.all(plain[name] == 0.0) for name in names)
