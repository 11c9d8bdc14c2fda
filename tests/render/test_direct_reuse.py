"""Direct light by reuse against the reference path tracer, on scenes that are unkind to it.

The unit of evidence is the replica: a whole session from a cold start, several frames with what the system carries from
one to the next. Pixels and frames of one session share samples, sessions with different seeds share nothing. Means of
blocks of pixels of both estimators meet in Welch's t-tests, so that the noise of the reference counts too.

False-alarm rate of all comparisons in this file together: FALSE_ALARM_RATE, shared out by Šidák over the cases and the
values of each.
"""

from __future__ import annotations

import functools

import cistern_core as core
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.core_scenes import SceneDescription, principled, render
from tests.support.direct_light_scenes import SCENES
from tests.support.statistics import Comparison, block_means, compare_replicas, sidak

FALSE_ALARM_RATE = 0.01
REPLICAS = 32
FRAMES = 8
REFERENCE_SAMPLES = 64
SIZE = 32
BLOCKS = 4
BOUNCES = {"many_lights": 1, "transparency": 1}  # scenes with mirrors; elsewhere only what is lit directly

MODES: dict[str, dict] = {
    "ris": dict(direct="RIS"),
    "restir": dict(direct="RESTIR"),
    "restir with visibility reuse": dict(direct="RESTIR", visibility_reuse=True),
    "restir in space alone, two rounds": dict(direct="RESTIR", temporal_reuse=False, spatial_rounds=2),
    "cache": dict(direct="RESTIR_CACHE", cache_candidates=16, cache_refresh=4),
}
"""Unbiased systems. Few candidates and a small radius, as suits a small picture; the rest as published. The cache is
renewed within the frames of a replica."""
COMMON = dict(bias="UNBIASED", light_candidates=8, spatial_radius=8.0)

FAST: dict[str, tuple[dict, str]] = {
    # Neighbours of like normal and distance that a one-sided lamp, or a cone, cannot light count as if it could.
    "restir beside a one-sided lamp": (dict(direct="RESTIR"), "corrugated"),
    "restir at the edges of cones": (dict(direct="RESTIR"), "spots"),
    "restir with visibility reuse under slats": (dict(direct="RESTIR", visibility_reuse=True), "occluders"),
    "cache at the edges of cones": (MODES["cache"], "spots"),
}
"""Systems that promise no unbiasedness, and scenes built so that it shows."""

SAMPLERS = [core.LightSampling.UNIFORM, core.LightSampling.POWER, core.LightSampling.TREE]
CASES = len(MODES) * len(SCENES) * len(SAMPLERS)
CASE_RATE = sidak(FALSE_ALARM_RATE, CASES)


@functools.cache
def scene(name: str) -> core.Scene:
    return SCENES[name]()


def values(passes: dict[str, NDArray]) -> NDArray:
    """What is compared of a picture: means over blocks and over all, of direct light and of everything."""
    pictures = [passes["Direct"], passes["Combined"][..., :3]]
    return np.concatenate([block_means(p, n, n) for p in pictures for n in (1, BLOCKS)])


def sessions(name: str, count: int, first_seed: int, **settings) -> NDArray:
    """(count, values) of cold starts with different seeds."""
    members = dict(size=SIZE, max_bounces=BOUNCES.get(name, 0), passes=["Direct"]) | settings
    return np.array([values(render(scene(name), seed=first_seed + k, **members)) for k in range(count)])


@functools.cache
def reference(name: str) -> NDArray:
    return sessions(name, REPLICAS, 1000, samples=REFERENCE_SAMPLES)


def compare(name: str, settings: dict, replicas: int = REPLICAS, scale: float = 1.0) -> Comparison:
    pictures = sessions(name, replicas, 1, **(dict(samples=FRAMES) | COMMON | settings))
    return compare_replicas(scale * pictures, reference(name), CASE_RATE)


def is_quick(mode: str, name: str) -> bool:
    """The cache takes a quarter of a second to start, for every replica."""
    return mode != "cache" or name == "corrugated"


def cases(is_slow: bool) -> list:
    """Every system on every scene: by one light sampler in quick runs, by the others too in slow ones."""
    picked = []
    for m, mode in enumerate(MODES):
        for s, name in enumerate(SCENES):
            for k, sampler in enumerate(SAMPLERS):
                in_quick_runs = (m + s) % len(SAMPLERS) == k and is_quick(mode, name)
                if in_quick_runs != is_slow:
                    picked.append(pytest.param(mode, name, sampler, id=f"{mode}-{name}-{sampler.name}"))
    return picked


@pytest.mark.parametrize(("mode", "name", "sampler"), cases(is_slow=False))
def test_unbiased_systems_agree_with_the_reference(mode: str, name: str, sampler: core.LightSampling) -> None:
    result = compare(name, MODES[mode] | dict(light_sampling=sampler))
    assert result.agrees, result


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "name", "sampler"), cases(is_slow=True))
def test_unbiased_systems_agree_with_the_reference_for_every_sampler(
    mode: str, name: str, sampler: core.LightSampling
) -> None:
    result = compare(name, MODES[mode] | dict(light_sampling=sampler))
    assert result.agrees, result


@pytest.mark.parametrize("case", FAST)
def test_fast_systems_are_seen_to_be_biased(case: str) -> None:
    """The planted bug of this file is one we ship: 1/M instead of a promise."""
    settings, name = FAST[case]
    result = compare(name, settings | dict(bias="FAST"), REPLICAS // 2)
    assert not result.agrees, result


@pytest.mark.parametrize("name", SCENES)
def test_three_percent_too_much_light_is_seen(name: str) -> None:
    """Planted bug: contribution weights 3 % too large."""
    result = compare(name, MODES["ris"], scale=1.03)
    assert not result.agrees, result


ALL_MODES = MODES | {f"fast {name}": MODES[name] | dict(bias="FAST") for name in ("restir", "cache")}


@pytest.mark.parametrize("mode", ALL_MODES)
def test_same_bits_for_any_number_of_threads(mode: str) -> None:
    settings = dict(size=SIZE, samples=4, max_bounces=2, seed=3, passes=["Direct", "Indirect"]) | COMMON
    one = render(scene("many_lights"), threads=1, **(settings | ALL_MODES[mode]))
    for threads in (2, 7):
        several = render(scene("many_lights"), threads=threads, **(settings | ALL_MODES[mode]))
        assert all(np.array_equal(one[name], several[name]) for name in one)
    other = render(scene("many_lights"), threads=1, **(settings | ALL_MODES[mode] | dict(seed=4)))
    assert not np.array_equal(one["Direct"], other["Direct"])  # or else equality would prove nothing


def two_lights(first: float, second: float) -> core.Scene:
    """A floor between two lamps of the given strengths."""
    lit = SceneDescription()
    lit.add_quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), principled((0.7, 0.6, 0.5), specular=0.5, roughness=0.3))
    if first > 0.0:
        lit.builder.add_point_light("a", (-0.8, 0.2, 0.6), 0.1, (first, 0.5 * first, 0.2 * first))
    if second > 0.0:
        lit.builder.add_area_light("b", (0.9, 0, 0.5), (0, 0.6, 0), (0, 0, 0.4), (-1, 0, 0), (second,) * 3)
    lit.set_camera((0.0, -3.0, 2.0), (0.0, 0.0, 0.0), half_width=0.5)
    return lit.snapshot()


@pytest.mark.parametrize("mode", ALL_MODES)
def test_twice_the_light_is_twice_the_picture(mode: str) -> None:
    """To the last bit: resampling sees only ratios, and a factor of two rounds nothing."""
    settings = dict(size=SIZE, samples=4, seed=3, max_bounces=1) | COMMON | ALL_MODES[mode]
    once, twice = (render(two_lights(k, 3.0 * k), **settings)["Combined"][..., :3] for k in (1.0, 2.0))
    assert once.mean() > 0.01
    assert np.array_equal(2.0 * once, twice)


@pytest.mark.parametrize("mode", [m if m != "cache" else pytest.param(m, marks=pytest.mark.slow) for m in MODES])
def test_lights_add_up(mode: str) -> None:
    """Both lamps give the sum of each alone. False-alarm rate 0.1 % per case."""

    def lit(first: float, second: float, first_seed: int) -> NDArray:
        settings = dict(size=SIZE, samples=FRAMES, max_bounces=0) | COMMON | MODES[mode]
        snapshot = two_lights(first, second)
        pictures = [render(snapshot, seed=first_seed + k, **settings)["Combined"][..., :3] for k in range(16)]
        return np.array([block_means(picture, BLOCKS, BLOCKS) for picture in pictures])

    both, first, second = lit(1.0, 3.0, 1), lit(1.0, 0.0, 101), lit(0.0, 3.0, 201)
    result = compare_replicas(both, first + second, 0.001)
    assert result.agrees, result
    assert not compare_replicas(both, first + 1.1 * second, 0.001).agrees  # planted bug
