"""Glass that splits light into its colours: none is lost, limits do not tint it, and reuse leaves it to path tracing.

False-alarm rate of all comparisons in this file together: FALSE_ALARM_RATE.
"""

from __future__ import annotations

import cistern_core as core
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.core_scenes import SceneDescription, emission, principled, render, replicas
from tests.support.statistics import block_means, compare_to_value, sidak

FALSE_ALARM_RATE = 0.01
STRONG = 0.1  # inverse Abbe number: four times that of flint
WHITE = (1.0, 1.0, 1.0)
CASE_RATE = sidak(FALSE_ALARM_RATE, 2)
REUSE = {
    "shared": dict(indirect="CELL_SHARED", direct="LEARNED", secondary="LEARNED"),
    "reservoirs": dict(direct="RESTIR", secondary="CELL_RESERVOIRS"),
    "paths of neighbours": dict(indirect="WORLD_REUSE"),
}


def ball(base: tuple[float, float, float] = WHITE, inverse_abbe: float = STRONG, roughness: float = 0.0) -> core.Scene:
    """Under an even white sky."""
    scene = SceneDescription()
    glass = principled(base, roughness=roughness, specular=0.5, transmission=1.0, inverse_abbe=inverse_abbe)
    scene.add_sphere(1.0, glass)
    scene.set_environment(WHITE)
    scene.set_camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), 0.2)
    return scene.snapshot()


def wall(inverse_abbe: float = STRONG) -> core.Scene:
    """Behind a ball that shows it the other way round: it shines on one side, with radiance 1."""
    scene = SceneDescription()
    scene.add_sphere(1.0, principled(WHITE, roughness=0.0, specular=0.5, transmission=1.0, inverse_abbe=inverse_abbe))
    scene.add_quad((0.0, 6.0, -4.0), (0.0, 0.0, 8.0), (4.0, 0.0, 0.0), emission(WHITE), "wall")
    scene.set_camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), 0.2)
    return scene.snapshot()


def combined(scene: core.Scene, **settings: object) -> NDArray:
    return render(scene, samples=64, passes=["Combined"], **settings)["Combined"][..., :3]


def spread(picture: NDArray) -> NDArray:
    """Between the channels of each pixel."""
    return np.ptp(picture, axis=2)


@pytest.mark.parametrize("roughness", [0.0, 0.3])
def test_nothing_is_lost_of_any_colour(roughness: float) -> None:
    """Planted bug: the glass takes some of the red. What facets keep is given back to 1.5 %."""
    tolerance = 0.0 if roughness == 0.0 else 0.015

    def result(base: tuple[float, float, float]) -> tuple[bool, NDArray]:
        pictures = replicas(ball(base, roughness=roughness), 12, samples=32, passes=["Combined"])
        blocks = np.array([block_means(picture, 2, 2) for picture in pictures])
        return compare_to_value(blocks, 1.0, CASE_RATE).agrees, blocks.mean(0)

    agrees, means = result(WHITE)
    assert agrees or np.abs(means - 1.0).max() < tolerance, means
    agrees, means = result((0.9, 1.0, 1.0))
    assert not agrees and np.abs(means - 1.0).max() > tolerance


def test_edges_are_coloured_by_dispersion_alone() -> None:
    assert spread(combined(wall())).max() > 0.2
    assert spread(combined(wall(0.0))).max() < 1e-5


def test_limits_leave_faces_white() -> None:
    """Of light that is brighter than the limit."""
    face = (slice(6, 10), slice(2, 6))
    for settings in ({}, dict(clamp_direct=0.1)):
        mean = combined(wall(), **settings)[face].mean((0, 1))
        assert mean.min() > 0.02 and np.ptp(mean) < 0.1 * mean.mean(), settings


@pytest.mark.parametrize("system", REUSE)
def test_reuse_leaves_it_to_path_tracing(system: str) -> None:
    np.testing.assert_array_equal(combined(wall(), **REUSE[system]), combined(wall()))
    assert not np.array_equal(combined(wall(0.0), **REUSE[system]), combined(wall()))


def test_threads_do_not_matter() -> None:
    np.testing.assert_array_equal(combined(wall(), threads=1), combined(wall(), threads=7))


def test_passes_by_kind_add_up() -> None:
    """Within the ball."""
    kinds = ("Diffuse", "Glossy", "Transmission")
    parts = [f"{kind} {part}" for kind in kinds for part in ("Direct", "Indirect", "Color")]
    found = {name: x[..., :3] for name, x in render(wall(), samples=16, passes=["Combined", *parts]).items()}
    lit = (found[f"{kind} Direct"] + found[f"{kind} Indirect"] for kind in kinds)
    total = sum(light * found[f"{kind} Color"] for kind, light in zip(kinds, lit, strict=True))
    np.testing.assert_allclose(total[2:14, 2:14], found["Combined"][2:14, 2:14], atol=1e-4)
