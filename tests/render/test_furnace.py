"""White furnaces: light may be neither lost nor made. Each test's planted bug is the smallest change it must see."""

import cistern_core as core
import numpy as np
import pytest

from tests.render.test_path_reuse import COMBINATIONS, Answers, members_of
from tests.support.core_scenes import SceneDescription, emission, principled, render, replicas
from tests.support.statistics import Comparison, block_means, compare_to_value, sidak

REPLICAS = 16


def closed_box(albedo: float) -> core.Scene:
    """Inside a box whose walls emit 1 and reflect `albedo`: every ray sees 1 / (1 - albedo)."""
    scene = SceneDescription()
    walls = principled((albedo,) * 3, emission=1.0)
    scene.add_box(1.0, walls)
    scene.set_camera((0.3, 0.2, -0.1), (-1.0, 0.1, 0.4))
    return scene.snapshot()


def blocks(scene: core.Scene, **settings):
    return np.array([block_means(image, 2, 2) for image in replicas(scene, REPLICAS, **settings)])


@pytest.mark.parametrize("albedo", [0.5, 0.8])
@pytest.mark.parametrize("sampler", [core.LightSampling.UNIFORM, core.LightSampling.POWER, core.LightSampling.TREE])
def test_closed_box_holds_its_light(albedo: float, sampler: core.LightSampling) -> None:
    """False-alarm rate 1 % per case."""
    result = compare_to_value(blocks(closed_box(albedo), samples=64, light_sampling=sampler), 1.0 / (1.0 - albedo))
    assert result.agrees, result


@pytest.mark.parametrize("albedo", [0.5, 0.8])
def test_closed_box_sees_a_lost_bounce(albedo: float) -> None:
    """Planted bug: the last 1.6 % (half albedo) or 2.3 % of the light, from later bounces, is dropped."""
    few = 4 if albedo == 0.5 else 15
    result = compare_to_value(blocks(closed_box(albedo), samples=64, max_bounces=few), 1.0 / (1.0 - albedo))
    assert not result.agrees, result


REUSE = [(answers, albedo) for answers in COMBINATIONS for albedo in (0.5, 0.8)]
REUSE_RATE = sidak(0.01, len(REUSE))


def reuse_in_closed_box(answers: Answers, albedo: float, twice: float = 0.0) -> Comparison:
    """`twice`: planted, a share of what sample points emit that comes with the light they reflect as well."""
    settings = members_of(answers) | dict(size=16, samples=8, bias="UNBIASED")
    passes = [render(closed_box(albedo), seed=seed, **settings) for seed in range(1, REPLICAS + 1)]
    pictures = [p["Combined"][..., :3] + twice * p["Direct"] for p in passes]
    found = np.array([block_means(picture, 2, 2) for picture in pictures])
    return compare_to_value(found, 1.0 / (1.0 - albedo), REUSE_RATE)


@pytest.mark.parametrize(
    ("answers", "albedo"),
    [
        pytest.param(answers, albedo, id="-".join([*answers, str(albedo)]), marks=() if is_quick else pytest.mark.slow)
        for answers, albedo in REUSE
        for is_quick in [answers[0] == "NEE" and albedo == 0.5]
    ],
)
def test_reuse_counts_emission_once(answers: Answers, albedo: float) -> None:
    """All walls are lamps to visible points and sample points alike. False-alarm rate 1 % for all cases together."""
    result = reuse_in_closed_box(answers, albedo)
    assert result.agrees, result


@pytest.mark.parametrize("indirect", ["SCREEN_REUSE", "WORLD_REUSE", "CELL_SHARED"])
def test_emission_counted_twice_is_seen(indirect: str) -> None:
    """Planted bug, by a tenth of it: 2.5 % too much light."""
    result = reuse_in_closed_box(("NEE", "CELL_RESERVOIRS", indirect), 0.5, twice=0.1)
    assert not result.agrees, result


def white_sphere(**material) -> core.Scene:
    scene = SceneDescription()
    scene.add_sphere(1.0, principled((1.0, 1.0, 1.0), **material), rings=64)
    scene.set_environment((1.0, 1.0, 1.0))
    scene.set_camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), half_width=0.22)
    return scene.snapshot()


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.6, 1.0])
def test_rough_metal_with_compensation_is_invisible(roughness: float) -> None:
    """White metal in a white sky: the compensation is an approximation by a table, hence 1 %."""
    mean = render(white_sphere(metallic=1.0, roughness=roughness), samples=256)["Combined"][..., :3].mean()
    assert mean == pytest.approx(1.0, abs=0.01)


def test_rough_metal_without_compensation_is_dark() -> None:
    """Planted bug for the test above: plain GGX loses what bounces twice between its facets."""
    picture = render(white_sphere(metallic=1.0, roughness=1.0, multiscatter=False), samples=256)["Combined"]
    assert picture[..., :3].mean() < 0.9


def test_white_lambert_is_invisible() -> None:
    """False-alarm rate 1 %."""
    result = compare_to_value(blocks(white_sphere(), samples=64), 1.0)
    assert result.agrees, result


def test_emission_alone_is_exact() -> None:
    scene = SceneDescription()
    scene.add_box(1.0, emission((0.25, 0.5, 2.0)))
    scene.set_camera((0.3, 0.2, -0.1), (-1.0, 0.1, 0.4))
    picture = render(scene.snapshot(), samples=1)["Combined"]
    assert (picture == np.array([0.25, 0.5, 2.0, 1.0], np.float32)).all()
