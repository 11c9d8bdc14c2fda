"""Pictures do not depend on the number of threads, and do depend on the seed."""

import cistern_core as core
import numpy as np
import pytest

from tests.support.core_scenes import SceneDescription, emission, principled, render


def room() -> core.Scene:
    scene = SceneDescription()
    scene.add_box(1.0, principled((0.7, 0.6, 0.5)))
    scene.add_sphere(0.4, principled((0.9, 0.9, 0.9), metallic=1.0, roughness=0.3), (0.3, 0.2, -0.6))
    scene.add_sphere(0.3, principled((1.0, 1.0, 1.0), specular=0.5, roughness=0.0, transmission=1.0), (-0.4, 0.3, -0.7))
    scene.add_quad((-0.3, -0.3, 0.99), (0, 0.6, 0), (0.6, 0, 0), emission((5.0, 4.0, 3.0)))
    scene.builder.add_point_light("lamp", (0.5, -0.5, 0.5), 0.1, (0.3, 0.3, 0.5))
    scene.set_camera((0.0, -0.95, 0.0), (0.0, 1.0, -0.2), half_width=0.7)
    return scene.snapshot()


@pytest.mark.parametrize("sampler", [core.LightSampling.UNIFORM, core.LightSampling.POWER, core.LightSampling.TREE])
def test_same_bits_for_any_number_of_threads(sampler: core.LightSampling) -> None:
    scene = room()
    settings = dict(
        size=48, samples=6, light_sampling=sampler, seed=3, passes=["Direct", "Indirect", "Depth", "Normal"]
    )
    one = render(scene, threads=1, **settings)
    for threads in (2, 7):
        several = render(scene, threads=threads, **settings)
        assert all(np.array_equal(one[name], several[name]) for name in one)


def test_seed_changes_the_picture() -> None:
    """Planted bug for the test above: if the picture ignored its random numbers, equality would prove nothing."""
    scene = room()
    assert not np.array_equal(render(scene, seed=1)["Combined"], render(scene, seed=2)["Combined"])


def test_passes_add_up_to_combined() -> None:
    passes = render(room(), size=48, samples=8)
    parts = passes["Direct"] + passes["Indirect"] + passes["Emission"] + passes["Environment"]
    np.testing.assert_allclose(passes["Combined"][..., :3], parts, rtol=1e-5, atol=1e-6)
    assert passes["Indirect"].mean() > 0.01 and passes["Direct"].mean() > 0.01


def test_a_region_is_a_cut_out_of_the_full_frame() -> None:
    scene = room()
    full = render(scene, size=32, samples=2)["Combined"]
    part = render(scene, size=32, samples=2, region=(5, 9, 11, 7))["Combined"]
    assert np.array_equal(part, full[9:16, 5:16])
