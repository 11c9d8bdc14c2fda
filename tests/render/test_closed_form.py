"""Scenes whose answer is a formula, derived in each test. False-alarm rate 1 % per test; planted bugs beside them."""

import math

import cistern_core as core
import numpy as np
import pytest

from tests.support.core_scenes import SceneDescription, emission, principled, replicas
from tests.support.statistics import compare_to_value

ALBEDO = 0.6
REPLICAS = 16


def floor_below(add_light) -> core.Scene:
    """A Lambertian floor seen from above in one tiny spot: its irradiance at the origin is what is measured."""
    scene = SceneDescription()
    scene.add_quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), principled((ALBEDO,) * 3))
    add_light(scene)
    scene.set_camera((0.0, 0.0, 0.2), (0.0, 0.0, 0.0), half_width=1e-3)
    return scene.snapshot()


def irradiance(scene: core.Scene, **settings) -> np.ndarray:
    """(replicas, 1) estimates of the irradiance at the origin."""
    pictures = replicas(scene, REPLICAS, size=4, samples=settings.pop("samples", 128), **settings)
    return pictures.mean(axis=(1, 2, 3))[:, None] * math.pi / ALBEDO


def disk(scene: SceneDescription, radius: float, height: float, radiance: float, sides: int = 256) -> None:
    """A horizontal emissive disk facing down."""
    angles = -2.0 * np.pi * np.arange(sides) / sides  # clockwise from above: its normal points down
    scene.add_mesh(
        np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full(sides, height)], 1),
        [(0, k, k + 1) for k in range(1, sides - 1)],
        emission((radiance,) * 3),
    )


@pytest.mark.parametrize("sampler", [core.LightSampling.UNIFORM, core.LightSampling.POWER, core.LightSampling.TREE])
def test_disk_over_floor(sampler: core.LightSampling) -> None:
    """A disk of radius r at height h: E = pi L r^2 / (r^2 + h^2). The 256-gon is 0.01 % smaller."""
    scene = floor_below(lambda s: disk(s, 0.5, 1.0, 3.0))
    area = 0.5 * 256 * math.sin(2 * math.pi / 256) / math.pi
    result = compare_to_value(irradiance(scene, light_sampling=sampler), area * math.pi * 3.0 * 0.25 / 1.25)
    assert result.agrees, result


@pytest.mark.parametrize("sampler", [core.LightSampling.UNIFORM, core.LightSampling.POWER, core.LightSampling.TREE])
def test_disks_in_one_place_shine_once(sampler: core.LightSampling) -> None:
    """Rays meet one of them. Found apart, light samples would bring each, by up to half of the light too much."""

    def add(scene: SceneDescription) -> None:
        for _ in range(2):
            disk(scene, 0.5, 1.0, 3.0)

    area = 0.5 * 256 * math.sin(2 * math.pi / 256) / math.pi
    result = compare_to_value(irradiance(floor_below(add), light_sampling=sampler), area * math.pi * 3.0 * 0.25 / 1.25)
    assert result.agrees, result


def test_disk_over_floor_sees_half_a_percent() -> None:
    """Planted bug: a light 0.5 % too strong."""
    scene = floor_below(lambda s: disk(s, 0.5, 1.0, 3.0 * 1.005))
    assert not compare_to_value(irradiance(scene, samples=512), math.pi * 3.0 * 0.25 / 1.25).agrees


def test_point_light() -> None:
    """E = I cos(theta) / d^2 at an offset: exact, without noise."""
    scene = floor_below(lambda s: s.builder.add_point_light("p", (1.0, 0.0, 2.0), 0.0, (10.0,) * 3))
    assert irradiance(scene).mean() == pytest.approx(10.0 * 2.0 / 5.0**1.5, rel=1e-4)


def test_soft_point_light() -> None:
    """A disk of radius r that faces the receiver at distance d: E = I / (d^2 + r^2) below it."""
    scene = floor_below(lambda s: s.builder.add_point_light("p", (0.0, 0.0, 2.0), 0.5, (10.0,) * 3, soft=True))
    assert compare_to_value(irradiance(scene), 10.0 / 4.25).agrees


def test_sphere_light() -> None:
    """A sphere at distance d of its centre: E = I / d^2, whatever its radius."""
    scene = floor_below(lambda s: s.builder.add_point_light("p", (0.0, 0.0, 2.0), 0.5, (10.0,) * 3, soft=False))
    assert compare_to_value(irradiance(scene), 10.0 / 4.0).agrees


@pytest.mark.parametrize("angle", [0.0, 0.2, 1.5])
def test_sun(angle: float) -> None:
    """Irradiance S on a plane facing the sun, S cos(tilt) on the floor."""
    tilt = 0.4
    direction = (math.sin(tilt), 0.0, math.cos(tilt))
    scene = floor_below(lambda s: s.builder.add_sun_light("s", direction, angle, (3.0,) * 3))
    result = compare_to_value(irradiance(scene), 3.0 * math.cos(tilt))
    assert result.agrees, result


def test_square_area_light() -> None:
    """A square of side 2a above: four corner factors [Howell, A Catalog of Radiation Heat Transfer, B-3]."""
    a, h, radiance = 0.4, 1.0, 5.0
    x = a / h
    quarter = x / math.sqrt(1 + x * x) * math.atan(x / math.sqrt(1 + x * x))
    expected = 4.0 * radiance * quarter
    scene = floor_below(
        lambda s: s.builder.add_area_light("a", (0, 0, h), (2 * a, 0, 0), (0, 2 * a, 0), (0, 0, -1), (radiance,) * 3)
    )
    result = compare_to_value(irradiance(scene), expected)
    assert result.agrees, result


def test_two_parallel_squares_of_light_add_up() -> None:
    """Linearity: light A plus light B is the sum of each alone; doubling a light doubles the picture."""

    def lit(first: float, second: float) -> np.ndarray:
        def add(scene: SceneDescription) -> None:
            disk(scene, 0.3, 1.0, first)
            scene.builder.add_point_light("p", (0.8, 0.0, 0.7), 0.1, (second,) * 3)

        return irradiance(floor_below(add), samples=256)

    both, first, second, double = lit(2.0, 1.0), lit(2.0, 0.0), lit(0.0, 1.0), lit(4.0, 0.0)
    assert compare_to_value(both, float(first.mean() + second.mean())).p_value > 1e-4
    assert double.mean() == pytest.approx(2.0 * first.mean(), rel=0.01)
    assert not compare_to_value(both, float(first.mean() + 1.05 * second.mean())).agrees  # planted bug
