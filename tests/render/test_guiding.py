"""Guided bounces against the reference path tracer, on small scenes of diffuse, glossy, leaning and see-through things.

As in test_direct_reuse.py the unit of evidence is the replica: a whole session from a cold start, whose later frames
bounce to where the earlier ones found light; block means of both estimators meet in Welch's t-tests.

False-alarm rate of all comparisons in this file together: FALSE_ALARM_RATE, shared out by Šidák over the cases and the
values of each.
"""

from __future__ import annotations

import functools

import cistern_core as core
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.core_scenes import SceneDescription, principled, render, replicas
from tests.support.path_scenes import GRAY, SCENES, room
from tests.support.statistics import Comparison, block_means, compare_replicas, compare_to_value, sidak

FALSE_ALARM_RATE = 0.01
REPLICAS = 32
FRAMES = 20  # those from the seventeenth on are guided by what sixteen found
REFERENCE_SAMPLES = 32
SIZE = 24
BLOCKS = 3
Answers = tuple[str, str, str]
PATH: Answers = ("NEE", "NEE", "PATH")
SHARED: Answers = ("NEE", "NEE", "CELL_SHARED")
KINDS = dict(max_bounces=4, max_diffuse_bounces=2, max_glossy_bounces=1, max_transmission_bounces=3)

CASES: list[tuple[Answers, str, dict]] = [
    *((PATH, name, {}) for name in ("indirect_room", "glossy_room", "panes", "leaning", "open_scene", "mirror_room")),
    *((SHARED, name, {}) for name in ("indirect_room", "glossy_room", "panes", "leaning")),
    (PATH, "hidden_objects", KINDS),
    (SHARED, "hidden_objects", KINDS),
    (("LEARNED", "LEARNED", "CELL_SHARED"), "open_scene", {}),
    (("RESTIR", "NEE", "PATH"), "panes", {}),
    (("RIS", "CELL_RESERVOIRS", "PATH"), "indirect_room", {}),
    (("NEE", "NEE", "SCREEN_REUSE"), "indirect_room", {}),
    (("NEE", "RIS", "WORLD_REUSE"), "leaning", {}),
]
CASE_RATE = sidak(FALSE_ALARM_RATE, len(CASES) + 3)


@functools.cache
def scene(name: str) -> core.Scene:
    return SCENES[name]()


def members_of(answers: Answers, limits: dict) -> dict:
    common = dict(max_bounces=3, temporal_reuse=False, light_candidates=4, spatial_radius=6.0)
    return dict(zip(("direct", "secondary", "indirect"), answers, strict=True)) | common | limits


def sessions(name: str, first_seed: int, **settings) -> NDArray:
    """(REPLICAS, block means of the picture and its mean) of cold starts with different seeds."""

    def values(seed: int) -> NDArray:
        picture = render(scene(name), SIZE, seed=seed, **settings)["Combined"][..., :3]
        return np.concatenate([block_means(picture, n, n) for n in (1, BLOCKS)])

    return np.array([values(first_seed + k) for k in range(REPLICAS)])


@functools.cache
def reference(name: str, limits: tuple) -> NDArray:
    return sessions(name, 100_000, samples=REFERENCE_SAMPLES, **members_of(PATH, dict(limits)))


def compare(answers: Answers, name: str, limits: dict, scale: float = 1.0) -> Comparison:
    pictures = sessions(name, 1, samples=FRAMES, guiding="ON", **members_of(answers, limits))
    return compare_replicas(scale * pictures, reference(name, tuple(limits.items())), CASE_RATE)


def ids() -> list[str]:
    return ["-".join([*answers, name] + (["kinds"] if limits else [])) for answers, name, limits in CASES]


@pytest.mark.parametrize(("answers", "name", "limits"), CASES, ids=ids())
def test_guided_paths_agree_with_the_reference(answers: Answers, name: str, limits: dict) -> None:
    result = compare(answers, name, limits)
    assert result.agrees, result


@pytest.mark.parametrize("answers", [PATH, SHARED])
def test_two_percent_too_much_light_is_seen(answers: Answers) -> None:
    """Planted bug: as if light samples and guided bounces together counted for 1.02."""
    result = compare(answers, "indirect_room", {}, scale=1.02)
    assert not result.agrees, result


def test_a_closed_box_holds_its_light() -> None:
    """Walls that emit 1 and reflect 0.8: every ray sees 5."""
    box = SceneDescription()
    box.add_box(1.0, principled((0.8,) * 3, emission=1.0))
    box.set_camera((0.3, 0.2, -0.1), (-1.0, 0.1, 0.4))
    pictures = replicas(box.snapshot(), 16, samples=64, guiding="ON")
    result = compare_to_value(np.array([block_means(p, 2, 2) for p in pictures]), 5.0, CASE_RATE)
    assert result.agrees, result


def lit_through_a_gap() -> core.Scene:
    """A room whose light comes through a gap beside a wall, behind which a lamp looks the other way."""
    result = SceneDescription()
    room(result)
    result.add_quad((0.3, -2.99, 0), (0, 3.49, 0), (0, 0, 2), GRAY, name="wall")
    lamp = ((0.95, -1.5, 1.0), (0, 0.8, 0), (0, 0, 0.8), (-1, 0, 0))
    result.builder.add_area_light("panel", *lamp, (10.0, 10.0, 10.0))
    result.set_camera((-0.3, -2.8, 1.0), (-0.3, 0, 0.95), half_width=0.4)
    return result.snapshot()


@pytest.mark.slow
def test_guiding_pays_where_light_comes_through_a_gap() -> None:
    """At most four fifths of the path tracer's variance at equal samples, those included that learned; it was 0.6."""
    gap = lit_through_a_gap()

    def variance(guiding: str) -> float:
        settings = dict(samples=192, max_bounces=6, guiding=guiding, sequence="RANDOM")
        pictures = np.array([render(gap, 64, seed=seed, **settings)["Combined"][..., :3] for seed in (1, 2)])
        return float(pictures.var(axis=0, ddof=1).mean() / pictures.mean() ** 2)

    assert variance("ON") < 0.8 * variance("OFF")


@pytest.mark.parametrize("answers", [PATH, SHARED, ("LEARNED", "CELL_RESERVOIRS", "WORLD_REUSE")])
def test_same_bits_for_any_number_of_threads(answers: Answers) -> None:
    passes = ["Direct", "Indirect", "Emission", "Environment"]
    settings = members_of(answers, {}) | dict(size=SIZE, samples=10, passes=passes, seed=3)
    one = render(scene("glossy_room"), threads=1, guiding="ON", **settings)
    for threads in (2, 7):
        several = render(scene("glossy_room"), threads=threads, guiding="ON", **settings)
        assert all(np.array_equal(one[name], several[name]) for name in one)
    plain = render(scene("glossy_room"), threads=1, **settings)
    assert not np.array_equal(one["Indirect"], plain["Indirect"])  # or else equality would prove nothing


def test_automatic_guiding_waits_for_its_trial() -> None:
    """Too few samples for one, or samples that depend on each other: the unguided picture, to the last bit."""
    settings = dict(size=SIZE, seed=3, max_bounces=3)
    for other in (dict(samples=40), dict(samples=2, indirect="SCREEN_REUSE")):
        off, auto = (render(scene("panes"), guiding=g, **settings, **other)["Combined"] for g in ("OFF", "AUTO"))
        assert np.array_equal(off, auto)


def test_automatic_guiding_decides_alike_for_any_number_of_threads() -> None:
    """400,000 paths at 160 x 160 pixels are 16 samples; of 48 the last 24 are guided, since the gap asks for it."""
    settings = dict(size=160, samples=48, seed=3, max_bounces=2, passes=["Guided"])
    gap = lit_through_a_gap()
    one, two = (render(gap, threads=n, guiding="AUTO", **settings) for n in (1, 2))
    assert one["Guided"].mean() > 0.9
    assert all(np.array_equal(one[name], two[name]) for name in one)


@pytest.mark.slow
def test_automatic_guiding_leaves_what_sharing_finds() -> None:
    """Once shared, that light has little noise: the picture is the unguided one, to the last bit."""
    settings = dict(size=160, samples=48, seed=3, max_bounces=2, indirect="CELL_SHARED")
    off, auto = (render(lit_through_a_gap(), guiding=g, **settings)["Combined"] for g in ("OFF", "AUTO"))
    assert np.array_equal(off, auto)


def test_a_pass_shows_where_bounces_are_guided() -> None:
    settings = dict(samples=64, seed=1, max_bounces=3, passes=["Guided"])
    guided, plain = (render(lit_through_a_gap(), 64, guiding=g, **settings)["Guided"] for g in ("ON", "OFF"))
    assert set(np.unique(guided)) <= {0.0, 1.0}
    assert guided.mean() > 0.1
    assert np.all(plain == 0.0)
