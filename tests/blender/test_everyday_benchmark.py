"""The benchmark of everyday scenes: that its scenes are what they say, and how it measures noise."""

import bpy
import numpy as np
import pytest

from tests.benchmark.everyday.__main__ import noise
from tests.benchmark.everyday.scenes import SCENES
from tests.support.engines import prepare, render

pytestmark = pytest.mark.usefixtures("registered_addon")


@pytest.mark.parametrize("name", SCENES)
def test_scenes_are_lit_and_seen(name):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    SCENES[name]()
    scene = bpy.context.scene
    prepare(scene, 24, 18)
    picture = render(scene, "CISTERN", 8, 0)[..., :3]
    lit = picture.mean(axis=2) > 1e-4
    assert lit.mean() > 0.25 and 1e-3 < np.median(picture[lit]) < 10.0
    assert picture.std() > 0.02 * picture.mean()


def test_noise_is_variance_over_the_squared_mean_in_boxes():
    random = np.random.default_rng(1)
    pictures = 2.0 + 0.5 * random.standard_normal((400, 40, 60, 3))
    expected = 0.5**2 / (2.0**2 * 1.01)
    assert noise(pictures, 1) == pytest.approx(expected, rel=0.02)
    assert noise(pictures, 4) == pytest.approx(expected / 16, rel=0.04)
    pictures[:, :2, :2] *= random.standard_normal((400, 1, 1, 1)) * 10  # a few that are noisiest do not count
    assert noise(pictures, 1) == pytest.approx(expected, rel=0.02)
