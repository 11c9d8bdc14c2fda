"""Indirect light, and light at later path vertices, by reuse against the reference path tracer.

As in test_direct_reuse.py the unit of evidence is the replica: a whole session from a cold start, several frames with
what the system carries from one to the next; block means of both estimators meet in Welch's t-tests.

False-alarm rate of all comparisons in this file together: FALSE_ALARM_RATE, shared out by Šidák over the cases and the
values of each. Where few paths bring most of the light, means over few replicas are not normal and t-tests call false
alarms: lamps here are big.
"""

from __future__ import annotations

import functools
import itertools

import cistern_core as core
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.core_scenes import SceneDescription, principled, render
from tests.support.path_scenes import GRAY, SCENES, harsh_room, lamp_to_ceiling, room
from tests.support.statistics import Comparison, block_means, compare_replicas, sidak

FALSE_ALARM_RATE = 0.01
REPLICAS, REFERENCE_REPLICAS = 32, 48  # references are shared by many cases
FRAMES = 8
REFERENCE_SAMPLES = 24
SIZE = 20
BLOCKS = 3

DIRECT = ("NEE", "RIS", "RESTIR", "RESTIR_CACHE")
SECONDARY = ("NEE", "RIS", "CELL_RESERVOIRS")
INDIRECT = ("PATH", "SCREEN_REUSE", "WORLD_REUSE", "CELL_SHARED")
Answers = tuple[str, str, str]
REFERENCE: Answers = ("NEE", "NEE", "PATH")
COMBINATIONS: list[Answers] = [c for c in itertools.product(DIRECT, SECONDARY, INDIRECT) if c != REFERENCE]

SETTINGS = dict(light_candidates=4, spatial_radius=6.0, cache_candidates=16, cache_refresh=4, cell_pixels=10)
"""Few candidates, a small radius and cache and large cells, as suits a small picture; the rest as published."""

LIMITS: dict[str, dict] = {
    "": dict(max_bounces=3),
    "one bounce": dict(max_bounces=1),
    "two bounces": dict(max_bounces=2),
    "one transparent surface": dict(max_bounces=2, max_transparent_bounces=1),
    "kinds": dict(max_bounces=4, max_diffuse_bounces=2, max_glossy_bounces=1, max_transmission_bounces=3),
}

QUICK: list[tuple[Answers, str, str]] = [
    (("NEE", "NEE", "SCREEN_REUSE"), "indirect_room", ""),
    (("NEE", "NEE", "WORLD_REUSE"), "glossy_room", ""),
    (("RIS", "NEE", "WORLD_REUSE"), "indirect_room", ""),
    (("RESTIR", "NEE", "SCREEN_REUSE"), "mirror_room", ""),
    (("NEE", "RIS", "PATH"), "mirror_room", ""),
    (("NEE", "CELL_RESERVOIRS", "PATH"), "indirect_room", ""),
    (("NEE", "CELL_RESERVOIRS", "SCREEN_REUSE"), "glossy_room", ""),
    (("RESTIR", "CELL_RESERVOIRS", "WORLD_REUSE"), "open_scene", ""),
    (("RIS", "RIS", "SCREEN_REUSE"), "panes", ""),
    (("NEE", "NEE", "WORLD_REUSE"), "panes", ""),
    (("NEE", "NEE", "WORLD_REUSE"), "open_scene", ""),
    (("NEE", "RIS", "WORLD_REUSE"), "mirror_room", "one bounce"),
    (("NEE", "NEE", "SCREEN_REUSE"), "leaning", ""),
    (("NEE", "NEE", "CELL_SHARED"), "indirect_room", ""),
    (("NEE", "NEE", "CELL_SHARED"), "panes", ""),
    (("RESTIR", "CELL_RESERVOIRS", "CELL_SHARED"), "glossy_room", ""),
    (("NEE", "NEE", "CELL_SHARED"), "leaning", ""),
    (("NEE", "RIS", "CELL_SHARED"), "mirror_room", "one bounce"),
    (("NEE", "NEE", "SCREEN_REUSE"), "hidden_objects", ""),
    (("NEE", "RIS", "WORLD_REUSE"), "hidden_objects", ""),
    (("NEE", "NEE", "SCREEN_REUSE"), "glossy_room", "kinds"),
    (("NEE", "NEE", "WORLD_REUSE"), "hidden_objects", "kinds"),
    (("NEE", "NEE", "CELL_SHARED"), "hidden_objects", "kinds"),
    (("NEE", "NEE", "CELL_SHARED"), "colored_stripes", ""),
    (("NEE", "NEE", "SCREEN_REUSE"), "colored_stripes", ""),
    (("NEE", "CELL_RESERVOIRS", "WORLD_REUSE"), "colored_stripes", ""),
    (("NEE", "NEE", "SCREEN_REUSE"), "glowing_room", ""),
    (("RESTIR", "CELL_RESERVOIRS", "WORLD_REUSE"), "glowing_room", ""),
    (("RIS", "RIS", "CELL_SHARED"), "glowing_room", ""),
]
"""Cases of quick runs: each answer but the cache, which is slow to start, and each scene."""

THREE_SCENES = ("glossy_room", "panes", "open_scene")
"""For all combinations. What is special about the others shows with any answer for direct light."""

ALL: list[tuple[Answers, str, str]] = [
    *((a, name, "") for a in COMBINATIONS for name in (SCENES if a[0] == "NEE" else THREE_SCENES)),
    *(
        (("NEE", "CELL_RESERVOIRS", indirect), name, limits)
        for indirect in INDIRECT[1:]
        for name in ("glossy_room", "mirror_room", "panes")
        for limits in LIMITS
        if limits
    ),
]
SLOW = [case for case in ALL if case not in QUICK]
OTHER_CASES = 21  # below: sharing without history and on trial, settings of path reuse, deep links
CASE_RATE = sidak(FALSE_ALARM_RATE, len(QUICK) + len(SLOW) + OTHER_CASES)

FAST: dict[str, tuple[Answers, str, int]] = {
    # Of what a vertex of a large cell finds, much lies behind others: 1/M counts them all the same.
    "cells that a one-sided lamp lights in part": (("NEE", "CELL_RESERVOIRS", "PATH"), "indirect_room", 16),
    # Sample points that a neighbour found are hidden by a thin wall.
    "pixels beside a thin wall": (("NEE", "NEE", "SCREEN_REUSE"), "indirect_room", 144),
    "cells with a thin wall": (("NEE", "NEE", "WORLD_REUSE"), "indirect_room", 64),
    # Groups beside a thin wall: what a few of them see is divided by how many they are.
    "groups with a thin wall": (("NEE", "NEE", "CELL_SHARED"), "indirect_room", 32),
    # Glossy sample points taken as Lambertian.
    "glossy sample points": (("NEE", "NEE", "WORLD_REUSE"), "glossy_room", 144),
}
"""Systems that promise no unbiasedness, scenes built so that it shows, and the replicas that it takes to be sure."""


@functools.cache
def scene(name: str) -> core.Scene:
    return SCENES[name]()


def members_of(answers: Answers) -> dict:
    return dict(zip(("direct", "secondary", "indirect"), answers, strict=True)) | SETTINGS


def values(passes: dict[str, NDArray]) -> NDArray:
    """What is compared of a picture: means over blocks and over all of it."""
    return np.concatenate([block_means(passes["Combined"][..., :3], n, n) for n in (1, BLOCKS)])


def sessions(name: str, count: int, first_seed: int, **settings) -> NDArray:
    """(count, values) of cold starts with different seeds."""
    return np.array([values(render(scene(name), SIZE, seed=first_seed + k, **settings)) for k in range(count)])


@functools.cache
def reference(name: str, limits: str) -> NDArray:
    return sessions(name, REFERENCE_REPLICAS, 100_000, samples=REFERENCE_SAMPLES, **LIMITS[limits])


def compare(
    answers: Answers, name: str, limits: str = "", replicas: int = REPLICAS, scale: float = 1.0, **settings
) -> Comparison:
    members = members_of(answers) | LIMITS[limits] | dict(samples=FRAMES, bias="UNBIASED") | settings
    return compare_replicas(scale * sessions(name, replicas, 1, **members), reference(name, limits), CASE_RATE)


def ids(cases: list[tuple[Answers, str, str]]) -> list[str]:
    return ["-".join([*answers, name] + ([limits] if limits else [])) for answers, name, limits in cases]


@pytest.mark.parametrize(("answers", "name", "limits"), QUICK, ids=ids(QUICK))
def test_unbiased_systems_agree_with_the_reference(answers: Answers, name: str, limits: str) -> None:
    result = compare(answers, name, limits)
    assert result.agrees, result


@pytest.mark.slow
@pytest.mark.parametrize(("answers", "name", "limits"), SLOW, ids=ids(SLOW))
def test_all_combinations_agree_with_the_reference(answers: Answers, name: str, limits: str) -> None:
    result = compare(answers, name, limits)
    assert result.agrees, result


@pytest.mark.parametrize("name", ["indirect_room", "glossy_room", "panes", "leaning", "open_scene"])
def test_sharing_without_history_agrees_with_the_reference(name: str) -> None:
    result = compare(("NEE", "NEE", "CELL_SHARED"), name, temporal_reuse=False)
    assert result.agrees, result


VARIANTS: dict[str, tuple[Answers, str, dict]] = {
    "uniform directions": (("NEE", "NEE", "SCREEN_REUSE"), "glossy_room", dict(path_source="UNIFORM")),
    "uniform directions, direct light reused": (
        ("RESTIR", "NEE", "SCREEN_REUSE"), "mirror_room", dict(path_source="UNIFORM"),
    ),
    "cosine directions": (("RIS", "NEE", "SCREEN_REUSE"), "leaning", dict(path_source="COSINE")),
    "chosen by radiance": (("NEE", "NEE", "SCREEN_REUSE"), "glossy_room", dict(path_target="RADIANCE")),
    "chosen by radiance in cells": (("NEE", "NEE", "WORLD_REUSE"), "leaning", dict(path_target="RADIANCE")),
    "six visible points of a cell": (
        ("NEE", "NEE", "WORLD_REUSE"), "glossy_room", dict(path_cell_count=6, path_deep_points=False),
    ),
    "no history of spatial reservoirs": (("NEE", "NEE", "SCREEN_REUSE"), "glossy_room", dict(path_spatial_cap=0.0)),
    "every second tile": (("NEE", "NEE", "SCREEN_REUSE"), "indirect_room", dict(path_multi_bounce=0.5)),
    "every second tile, light reused": (
        ("NEE", "CELL_RESERVOIRS", "SCREEN_REUSE"), "panes", dict(path_multi_bounce=0.5),
    ),
    "all of it": (
        ("RESTIR", "NEE", "SCREEN_REUSE"), "panes",
        dict(path_source="UNIFORM", path_target="RADIANCE", path_multi_bounce=0.5, path_validation=3),
    ),
}  # fmt: skip


@pytest.mark.parametrize("variant", VARIANTS)
def test_settings_of_path_reuse_change_no_mean(variant: str) -> None:
    answers, name, settings = VARIANTS[variant]
    result = compare(answers, name, **settings)
    assert result.agrees, result


def test_validation_drops_nothing_where_nothing_changed() -> None:
    """Traced again from their random numbers, all paths are the same to the last bit; so is the picture."""
    settings = members_of(("RESTIR", "NEE", "SCREEN_REUSE")) | dict(samples=7, seed=3, max_bounces=3)
    settings |= dict(path_source="COSINE", path_multi_bounce=0.5)
    pictures = [render(scene("panes"), SIZE, path_validation=n, **settings)["Combined"] for n in (0, 1, 3)]
    assert all(np.array_equal(pictures[0], picture) for picture in pictures[1:])


@functools.cache
def large_picture(name: str, visible: int, indirect: str = "CELL_SHARED", **settings) -> NDArray:
    """Smaller ones of as few samples have no trial."""
    members = members_of(("NEE", "NEE", indirect)) | dict(temporal_reuse=False, share_visible=visible)
    return render(scene(name), 96, samples=48, seed=3, max_bounces=3, **members, **settings)["Combined"]


@pytest.mark.parametrize("share_visible", [1, 16])
@pytest.mark.parametrize("name", ["indirect_room", "glossy_room"])
def test_sharing_on_trial_is_sharing_or_path_tracing(name: str, share_visible: int) -> None:
    """A trial before the first frame decides; its own samples go nowhere. With any number of threads alike."""
    tried = [large_picture(name, share_visible, share_trial=True, threads=n) for n in (1, 2, 7)]
    assert all(np.array_equal(tried[0], picture) for picture in tried[1:])
    ways = (dict(visible=share_visible), dict(visible=1), dict(visible=1, indirect="PATH"))
    assert any(np.array_equal(tried[0], large_picture(name, **way)) for way in ways)


@pytest.mark.parametrize("name", [pytest.param("indirect_room", marks=pytest.mark.slow), "open_scene"])
def test_a_trial_may_follow_the_first_frame_with_history(name: str) -> None:
    """Frames share until a trial is a small part of the time they took, for 104 x 104 pixels 29; then it decides, as
    one before all frames does. Planted bug: any other way. Random numbers, since Sobol points depend on how many
    frames there will be."""
    shared = members_of(("NEE", "NEE", "CELL_SHARED")) | dict(temporal_reuse=False)
    ways = [shared, shared | dict(share_visible=1), members_of(("NEE", "NEE", "PATH"))]
    ways = [way | dict(sequence="RANDOM") for way in ways]

    @functools.cache
    def sum_of(samples: int, way: int, **settings) -> NDArray:
        passes = render(scene(name), 104, samples=samples, seed=3, max_bounces=3, **ways[way] | settings)
        return samples * passes["Combined"].astype(np.float64)

    history = dict(temporal_reuse=True, first_frame_history=True, share_trial=True)
    found = sum_of(64, 0, **history) - sum_of(1, 0, **history)
    tried = sum_of(64, 0, share_trial=True)
    for way in range(len(ways)):
        expected = sum_of(29, 0) - sum_of(1, 0) + sum_of(64, way) - sum_of(29, way)
        is_chosen = np.array_equal(tried, sum_of(64, way))
        assert np.allclose(found, expected, rtol=1e-3, atol=1e-3) == is_chosen


@pytest.mark.parametrize("cells", [dict(share_visible=1), dict(share_deep=1), {}], ids=["next", "visible", "both"])
def test_what_is_handed_on_does_not_depend_on_the_color_of_its_finder(cells: dict) -> None:
    """Paths that end where their own colour is gone leave others less than their due: the green of white stripes was 15
    to 24 % too dark."""
    result = compare(("NEE", "NEE", "CELL_SHARED"), "colored_stripes", temporal_reuse=False, **cells)
    assert result.agrees, result


def test_deep_links_get_no_less_of_lamps_that_count_bounces() -> None:
    """Without the history of pixels, what cells hold counts for more."""
    result = compare(("NEE", "NEE", "WORLD_REUSE"), "counting_lamp", temporal_reuse=False)
    assert result.agrees, result


@pytest.mark.parametrize("case", FAST)
def test_fast_systems_are_seen_to_be_biased(case: str) -> None:
    """The planted bug of this file is one we ship: 1/M instead of a promise, sample points taken as Lambertian."""
    answers, name, replicas = FAST[case]
    result = compare(answers, name, replicas=replicas, bias="FAST")
    assert not result.agrees, result


def gray_room() -> core.Scene:
    description = SceneDescription()
    room(description, left=GRAY, right=GRAY)
    lamp_to_ceiling(description)
    return description.snapshot()


def test_sharing_between_like_surfaces_moves_light_and_makes_none() -> None:
    """Where all that share are Lambertian with one albedo, a sample's weights sum to what its own path would have had:
    the picture's sum is the same to rounding, while its pixels differ. Planted bug: equal weights."""
    members = members_of(("NEE", "NEE", "CELL_SHARED"))
    members |= dict(samples=4, max_bounces=3, seed=1, temporal_reuse=False)
    members |= dict(share_deep=8)  # of so few, none is left out by chance
    sums = {}
    for bias in ("UNBIASED", "FAST"):
        shared, alone = (
            render(gray_room(), SIZE, bias=bias, share_visible=size, **members)["Combined"][..., :3].astype(np.float64)
            for size in (8, 1)
        )
        assert np.abs(shared - alone).max() > 0.01 * alone.mean()
        sums[bias] = shared.sum() / alone.sum()
    assert abs(sums["UNBIASED"] - 1.0) < 1e-5
    assert abs(sums["FAST"] - 1.0) > 1e-3


def test_groups_are_small_for_denoisers() -> None:
    """Planted bug: groups of 64 as they are asked for."""
    members = members_of(("NEE", "NEE", "CELL_SHARED")) | dict(samples=2, seed=1, temporal_reuse=False)
    asked = render(gray_room(), SIZE, share_visible=64, share_for_denoiser=True, **members)["Combined"]
    small, large = (render(gray_room(), SIZE, share_visible=size, **members)["Combined"] for size in (16, 64))
    assert np.array_equal(asked, small) and not np.array_equal(asked, large)


@pytest.mark.parametrize("members", [dict(share_visible=1, share_deep=1), dict(temporal_reuse=False)])
def test_equal_weights_lose_nothing_that_is_handed_to_nobody(members: dict) -> None:
    """Of points that reflect narrowly: what they send stays with its finder, also where that is history. Means of 8
    pictures lie within 3 % of one another; light lost or counted twice has been a third."""
    description, metal = SceneDescription(), principled((0.8, 0.8, 0.8), metallic=1.0, roughness=0.3)
    room(description, metal, metal, metal, metal, metal)
    lamp_to_ceiling(description)
    scene = description.snapshot()

    def mean(**settings) -> float:
        pictures = [render(scene, 24, samples=8, max_bounces=3, seed=s, **settings)["Combined"] for s in range(8)]
        return float(np.mean([picture[..., :3] for picture in pictures]))

    expected = mean(**members_of(("NEE", "NEE", "PATH")))
    assert abs(mean(**members_of(("NEE", "NEE", "CELL_SHARED")), bias="FAST", **members) / expected - 1.0) < 0.1


@pytest.mark.parametrize("name", ["indirect_room", "open_scene"])
def test_five_percent_too_much_light_is_seen(name: str) -> None:
    """Planted bug: contribution weights 5 % too large."""
    result = compare(("NEE", "CELL_RESERVOIRS", "WORLD_REUSE"), name, scale=1.05)
    assert not result.agrees, result


def is_quick(answers: Answers) -> bool:
    """Answers for direct light have tests of their own; here they are beside others."""
    return answers[1:] != ("NEE", "PATH") and answers[0] in ("NEE", "RESTIR")


BIT_MODES = [
    pytest.param(answers, bias, id="-".join([*answers, bias]), marks=() if is_quick(answers) else pytest.mark.slow)
    for answers in COMBINATIONS
    for bias in ("UNBIASED", "FAST")
]


@pytest.mark.parametrize(("answers", "bias"), BIT_MODES)
def test_same_bits_for_any_number_of_threads(answers: Answers, bias: str) -> None:
    passes = ["Direct", "Indirect", "Emission", "Environment"]
    settings = members_of(answers) | dict(size=SIZE, samples=4, max_bounces=3, bias=bias, passes=passes)
    settings |= dict(temporal_reuse=True)
    one = render(scene("panes"), seed=3, threads=1, **settings)
    for threads in (2, 7):
        several = render(scene("panes"), seed=3, threads=threads, **settings)
        assert all(np.array_equal(one[name], several[name]) for name in one)
    other = render(scene("panes"), seed=4, threads=1, **settings)
    assert not np.array_equal(one["Indirect"], other["Indirect"])  # or else equality would prove nothing


@pytest.mark.parametrize("strength", [1e-12, 1e12])
@pytest.mark.parametrize(("answers", "bias"), BIT_MODES)
def test_no_weight_is_other_than_finite(answers: Answers, bias: str, strength: float) -> None:
    """`render` fails on samples and weights that are not; native tests see that such weights are counted."""
    settings = members_of(answers) | dict(size=SIZE, samples=6, max_bounces=4, bias=bias, temporal_reuse=True)
    picture = render(harsh_room(strength), seed=3, **settings)["Combined"]
    assert picture.max() > 1e-3 * strength


@pytest.mark.parametrize("bias", ["UNBIASED", "FAST"])
@pytest.mark.parametrize("indirect", INDIRECT[1:])
def test_twice_the_light_is_twice_the_picture(indirect: str, bias: str) -> None:
    """To the last bit: resampling sees only ratios, and a factor of two rounds nothing."""

    def lit(strength: float) -> NDArray:
        description = SceneDescription()
        room(description)
        lamp_to_ceiling(description, strength)
        answers = ("RESTIR", "CELL_RESERVOIRS", indirect)
        settings = members_of(answers) | dict(samples=4, seed=3, max_bounces=3, bias=bias)
        return render(description.snapshot(), SIZE, **settings)["Combined"][..., :3]

    once, twice = lit(2.0), lit(4.0)
    assert once.mean() > 0.01
    assert np.array_equal(2.0 * once, twice)
