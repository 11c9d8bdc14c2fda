"""Gaussian splats: what a cloud of them sends, and that all techniques agree about it.

False-alarm rate of all comparisons in this file together: FALSE_ALARM_RATE.
"""

from __future__ import annotations

import cistern_core as core
import numpy as np
import pytest

from tests.support.core_scenes import SceneDescription, principled, render, replicas
from tests.support.statistics import compare_replicas, sidak
from tests.support.window_room import block_replicas, room

FALSE_ALARM_RATE = 0.01
UNBIASED = dict(bias="UNBIASED", cell_pixels=10)
SYSTEMS = {
    "learned": dict(direct="LEARNED", secondary="LEARNED", guiding="ON"),
    "shared": UNBIASED | dict(indirect="CELL_SHARED", share_trial=False, light_samples=2),
    "screen": UNBIASED | dict(direct="RESTIR", indirect="SCREEN_REUSE"),
    "world": UNBIASED | dict(direct="RESTIR", indirect="WORLD_REUSE"),
    "secondary": UNBIASED | dict(direct="RIS", secondary="CELL_RESERVOIRS"),
}
HAZES = ("", "card", "transparent", "paint", "glass")
CASE_RATE = sidak(FALSE_ALARM_RATE, len(SYSTEMS) * (len(HAZES) + 1))
SPHERE = 200
COLORS = ((0.9, 0.2, 0.1), (0.1, 0.8, 0.3), (0.2, 0.3, 0.9))
OPACITIES = (0.4, 0.5, 0.9)


def stack(factor: float = 1.0) -> core.Scene:
    """Three splats one behind the other, seen through so narrow a lens that they are the same all over the picture."""
    scene = SceneDescription()
    scene.add_splats([(0.0, 0.0, -z) for z in (0.0, 0.5, 1.0)], np.ones((3, 3)), COLORS, factor * np.array(OPACITIES))
    scene.set_camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), half_width=1e-3)
    return scene.snapshot()


def linear(srgb: np.ndarray) -> np.ndarray:
    return ((srgb + 0.055) / 1.055) ** 2.4


def expected_of_stack() -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of a sample: the colours laid over each other in order. [Kerbl et al. 2023, eq. 3]"""
    weights = np.array(OPACITIES) * np.cumprod([1.0, *(1.0 - np.array(OPACITIES))])[:-1]
    colors = linear(np.array(COLORS))
    mean = weights @ colors
    return mean, weights @ colors**2 - mean**2


@pytest.mark.parametrize(("factor", "is_right"), [(1.0, True), (0.97, False)])
def test_splats_are_laid_over_each_other_in_order(factor: float, is_right: bool) -> None:
    """The second is a planted bug: opacities 3 % lower. Random numbers alone tell variances."""
    size, samples = 32, 256
    picture = render(stack(factor), size=size, samples=samples, sequence="RANDOM")["Combined"]
    mean, variance = expected_of_stack()
    z = (picture[..., :3].mean(axis=(0, 1)) - mean) / np.sqrt(variance / (size * size * samples))
    assert (np.abs(z).max() < 4.0) == is_right, z


def garden(brightness: float = 1.0) -> core.Scene:
    """A shell of paint that splats make, some of which shine, over a floor under a lamp and a sky."""
    scene = SceneDescription()
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(SPHERE, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    rotations = rng.normal(size=(SPHERE, 4))
    colors, opacities = rng.uniform(0.3, 0.9, (SPHERE, 3)), rng.uniform(0.2, 1.0, SPHERE)
    scales = np.exp(rng.uniform(np.log(0.02), np.log(0.2), (SPHERE, 3)))
    centers = directions + np.array((0.0, 0.0, 0.9))
    half = SPHERE // 2
    paint = principled((0.8, 0.6, 0.4))
    for part, material in ((slice(0, half), None), (slice(half, None), paint)):
        scene.add_splats(centers[part], scales[part], colors[part], opacities[part], rotations[part], material)
    scene.add_quad((-3.0, -3.0, 0.0), (6.0, 0.0, 0.0), (0.0, 6.0, 0.0), principled((0.7, 0.7, 0.7)))
    scene.builder.add_point_light("lamp", (1.5, -1.0, 2.5), 0.2, (8.0 * brightness,) * 3)
    scene.set_environment((0.2 * brightness, 0.25 * brightness, 0.3 * brightness))
    scene.set_camera((0.0, -4.0, 2.0), (0.0, 0.0, 0.7))
    return scene.snapshot()


def blocks(scene: core.Scene, first_seed: int, **settings) -> np.ndarray:
    pictures = replicas(scene, 16, first_seed, size=32, samples=16, max_bounces=6, **settings)
    return pictures.reshape(16, 4, 8, 4, 8, 3).mean(axis=(2, 4)).reshape(16, -1)


@pytest.mark.parametrize("system", SYSTEMS)
def test_all_techniques_agree(system: str) -> None:
    paths = blocks(garden(), 101)
    result = compare_replicas(blocks(garden(), 1, **SYSTEMS[system]), paths, CASE_RATE)
    assert result.agrees, result


def test_a_brighter_garden_is_seen() -> None:
    """Planted bug: 5 % more light of lamp and sky."""
    assert not compare_replicas(blocks(garden(1.05), 1, **SYSTEMS["shared"]), blocks(garden(), 101), CASE_RATE).agrees


def transparent(share: float) -> core.MaterialProgram:
    p = core.MaterialProgram("transparent")
    p.closure("CLOSURE_TRANSPARENT", [p.constant(1.0), p.constant(share, share, share)])
    return p


def hazy_room(kind: str, brightness: float = 1.0) -> core.Scene:
    """Between walls that light each other, in a window and before a lamp outside hang splats that let most pass."""
    black, paint = principled((0.0, 0.0, 0.0)), principled((0.6, 0.8, 0.7))
    return room(
        brightness,
        glass=(0.0, 0.01) if kind == "glass" else (),
        lamps=True,
        haze={"transparent": transparent(0.3), "paint": paint, "glass": paint}.get(kind, black),
        card=transparent(0.5) if kind == "card" else None,
    )


@pytest.mark.parametrize("haze", HAZES)
@pytest.mark.parametrize("system", SYSTEMS)
def test_all_techniques_agree_about_haze(system: str, haze: str) -> None:
    """What a ray meets is chance, and another ray of the same segment meets something else: where paths are taken over
    by asking again, light that has come through once has to come through twice."""
    settings = dict(max_bounces=4)
    paths = block_replicas(hazy_room(haze), 101, **settings | dict(light_through_panes=False, find_openings=False))
    result = compare_replicas(block_replicas(hazy_room(haze), 1, **settings | SYSTEMS[system]), paths, CASE_RATE)
    assert result.agrees, result


@pytest.mark.parametrize("system", SYSTEMS)
def test_brighter_haze_is_seen(system: str) -> None:
    """Planted bug: 8 % more light."""
    settings = dict(max_bounces=4)
    paths = block_replicas(hazy_room(""), 101, **settings)
    brighter = block_replicas(hazy_room("", 1.08), 1, **settings | SYSTEMS[system])
    assert not compare_replicas(brighter, paths, CASE_RATE).agrees


def test_the_picture_is_the_same_on_any_number_of_threads() -> None:
    one, three = (render(garden(), threads=threads, indirect="CELL_SHARED")["Combined"] for threads in (1, 3))
    assert np.array_equal(one, three)
