"""Participating media against closed forms. Each planted bug is the smallest change that its test must see."""

import math

import cistern_core as core
import numpy as np
import pytest

from tests.support.core_scenes import (
    CAMERA,
    VISIBLE_TO_ALL,
    SceneDescription,
    emission,
    medium,
    principled,
    render,
    replicas,
    same_everywhere,
    uneven_medium,
)
from tests.support.statistics import Comparison, block_means, compare_replicas, compare_to_value

DRAINE, DROPLETS, FOURNIER_FORAND = 2, 3, 4  # phase functions
REPLICAS = 16
CLIP_START = 1e-3  # m, of SceneDescription.set_camera
ABSORPTION = (0.3, 0.7, 1.5)  # 1/m


def compare(scene: core.Scene, expected: float | np.ndarray, **settings) -> Comparison:
    found = np.array([block_means(image, 2, 2) for image in replicas(scene, REPLICAS, **settings)])
    return compare_to_value(found, expected)


def furnace(anisotropy: float) -> core.Scene:
    """A ball that scatters and does not absorb, in a white sky: nothing of it is to be seen."""
    scene = SceneDescription()
    scene.add_sphere(1.0, medium((2.0, 0.5, 5.0), anisotropy=anisotropy))
    scene.set_environment((1.0, 1.0, 1.0))
    scene.set_camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), 0.2)
    return scene.snapshot()


@pytest.mark.parametrize("anisotropy", [0.0, 0.8, -0.8])
def test_medium_without_absorption_is_invisible(anisotropy: float) -> None:
    """False-alarm rate 1 % per case."""
    result = compare(furnace(anisotropy), 1.0, samples=32)
    assert result.agrees, result


def test_furnace_sees_a_lost_bounce() -> None:
    """Planted bug: what is scattered more than 9 times is dropped, 0.6 % of the light."""
    result = compare(furnace(0.0), 1.0, samples=32, max_volume_bounces=8)
    assert not result.agrees, result


def test_furnace_in_a_furnace() -> None:
    """The camera in a scattering world, around it walls that glow: all is as bright as they are."""
    scene = SceneDescription()
    scene.add_box(2.0, emission((1.0, 1.0, 1.0)))
    scene.add_sphere(0.5, medium((2.0, 3.0, 1.0), anisotropy=-0.4))
    scene.builder.set_environment(scene.builder.add_material(medium((0.5, 0.3, 0.8), is_boundary=False)))
    scene.set_camera((0.0, -0.3, 0.1), (0.0, 1.0, 0.0))
    result = compare(scene.snapshot(), 1.0, samples=32)
    assert result.agrees, result


def absorbing_slab(**inside) -> core.Scene:
    """The camera looks at a glowing wall through two nested boxes of absorption, 0.4 m inside of 1 m, head-on."""
    scene = SceneDescription()
    scene.add_box(0.5, medium(absorption=ABSORPTION, **inside))
    scene.add_box(0.2, medium(absorption=ABSORPTION, density=2.0))
    scene.add_quad((-9, 3, -9), (18, 0, 0), (0, 0, 18), emission((1.0, 1.0, 1.0)))
    scene.set_camera((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), 1e-4)
    return scene.snapshot()


def test_absorption_is_exact() -> None:
    """[Beer and Lambert] Nothing is left to chance: one sample is exact. Overlapping media add up."""
    expected = np.exp(-np.array(ABSORPTION) * (1.0 + 2.0 * 0.4))
    picture = render(absorbing_slab(), samples=1)["Combined"][..., :3]
    assert np.allclose(picture, expected, rtol=1e-5)


def test_emission_is_exact() -> None:
    """The integral of exp(-a t) over the parts of the slab, in and around the inner box, of which one emits."""
    a = np.array(ABSORPTION)
    outer, inner = np.exp(-0.3 * a), np.exp(-0.4 * 3.0 * a)
    glow = (1 - outer) / a + outer * (1 - inner) / (3.0 * a) + outer * inner * (1 - outer) / a
    expected = 0.5 * glow + outer * inner * outer
    picture = render(absorbing_slab(glow=(0.5, 0.5, 0.5)), samples=1)["Combined"][..., :3]
    assert np.allclose(picture, expected, rtol=1e-5)


def uneven_slab(**inside) -> core.Scene:
    """Head-on through a box of 1 m, where the density is the distance from its middle, to a glowing wall."""
    scene = SceneDescription()
    scene.add_box(0.5, uneven_medium(**inside))
    scene.add_quad((-9, 3, -9), (18, 0, 0), (0, 0, 18), emission((1.0, 1.0, 1.0)))
    scene.set_camera((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), 1e-4)
    return scene.snapshot()


def test_uneven_absorption() -> None:
    """False-alarm rate 1 %: the integral of the density is 1/4 m. Planted: 1 %."""
    found = np.array([i.mean((0, 1)) for i in replicas(uneven_slab(absorption=(1.0, 3.0, 9.0)), REPLICAS, samples=256)])
    expected = np.exp(-np.array([1.0, 3.0, 9.0]) / 4)
    assert compare_to_value(found, expected).agrees, (found.mean(0), expected)
    assert not compare_to_value(found, 1.01 * expected).agrees


def test_uneven_media_are_even_ones_where_they_do_not_vary() -> None:
    """By tracking and by closed forms, with all they may do. Planted: 2 %."""
    pictures = []
    for make in (medium, same_everywhere):
        scene = SceneDescription()
        scene.add_box(0.8, make((1.0, 2.0, 0.5), (0.5, 0.1, 0.2), anisotropy=0.3, glow=(0.3, 0.2, 0.1)))
        scene.add_box(1.0, medium((0.3, 0.3, 0.3)))
        scene.builder.add_point_light("lamp", (0.2, -0.1, 1.5), 0.0, (3.0, 3.0, 3.0))
        scene.set_camera((0.0, -4.0, 0.5), (0.0, 0.0, 0.0), 0.3)
        pictures.append(np.array([block_means(i, 2, 2) for i in replicas(scene.snapshot(), REPLICAS, samples=64)]))
    assert compare_replicas(*pictures).agrees, compare_replicas(*pictures)
    assert not compare_replicas(1.02 * pictures[0], pictures[1]).agrees


def test_surface_that_is_not_closed_ends() -> None:
    """A tiny triangle that fog begins at, and never ends: rays behind it do, and soon."""
    scene = SceneDescription()
    scene.add_mesh([(-1e-6, 0, -1e-6), (1e-6, 0, -1e-6), (0, 0, 1e-6)], [(0, 1, 2)], uneven_medium((1.0, 1.0, 1.0)))
    scene.add_quad((-9, 300, -9), (18, 0, 0), (0, 0, 18), emission((1.0, 1.0, 1.0)))
    scene.set_camera((0.0, -1e-5, 0.0), (0.0, 0.0, 0.0), 1e-3)
    assert np.isfinite(render(scene.snapshot(), size=2, samples=1)["Combined"]).all()


def test_uneven_medium_without_absorption_is_invisible() -> None:
    scene = SceneDescription()
    scene.add_sphere(1.0, uneven_medium((4.0, 1.0, 10.0)))
    scene.add_box(0.3, medium((1.0, 2.0, 3.0)))
    scene.set_environment((1.0, 1.0, 1.0))
    scene.set_camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), 0.2)
    result = compare(scene.snapshot(), 1.0, samples=32)
    assert result.agrees, result


def lamp_in_endless_fog(phase: tuple[int, float] = (0, 0.0)) -> core.Scene:
    scene = SceneDescription()
    fog = medium((0.2, 0.1, 0.05), (0.1, 0.1, 0.1), anisotropy=0.5, is_boundary=False, phase=phase)
    scene.builder.set_environment(scene.builder.add_material(fog))
    scene.builder.add_point_light("lamp", (0.4, 3.0, 0.0), radius=0.0, intensity=(10.0, 10.0, 10.0))
    scene.set_camera((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1e-4)
    return scene.snapshot()


def scattered_once(g: float = 0.5, with_shadow: bool = True, alpha: float = 0.0) -> np.ndarray:
    """What reaches the origin from along +y: the integral of transmittance, scattering, phase function and intensity
    over r^2, by the trapezoidal rule in the angle at the lamp, where the integrand is smooth. Fog begins where the
    camera clips. The phase function is Draine's, without `alpha` Henyey and Greenstein's."""
    scattering, extinction = np.array([0.2, 0.1, 0.05]), np.array([0.3, 0.2, 0.15])
    angle = np.linspace(math.atan2(CLIP_START - 3.0, 0.4), 0.5 * math.pi - 1e-6, 200001)
    t = 3.0 + 0.4 * np.tan(angle)
    r = np.hypot(t - 3.0, 0.4)
    cosine = (3.0 - t) / r
    phase = (1 - g * g) / (4 * math.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
    phase *= (1 + alpha * cosine**2) / (1 + alpha * (1 + 2 * g * g) / 3)
    length = t[:, None] - CLIP_START + (r[:, None] if with_shadow else 0.0)
    integrand = scattering * np.exp(-extinction * length) * (phase * 10.0 / 0.4)[:, None]  # r^2 cancels
    step = angle[1] - angle[0]
    return (integrand[1:] + integrand[:-1]).sum(0) * 0.5 * step


def test_single_scattering() -> None:
    """False-alarm rate 1 %. Planted: light comes to the fog undimmed, the phase function the other way round, 2 %."""
    found = np.array(
        [image.mean((0, 1)) for image in replicas(lamp_in_endless_fog(), REPLICAS, samples=64, max_bounces=0)]
    )
    assert compare_to_value(found, scattered_once()).agrees, (found.mean(0), scattered_once())
    assert not compare_to_value(found, scattered_once(with_shadow=False)).agrees
    assert not compare_to_value(found, scattered_once(g=-0.5)).agrees
    assert not compare_to_value(found, 1.02 * scattered_once()).agrees


def test_single_scattering_by_draine() -> None:
    """False-alarm rate 1 %. Planted: Henyey and Greenstein's phase function, an alpha that is 10 % off."""
    pictures = replicas(lamp_in_endless_fog((DRAINE, 3.0)), REPLICAS, samples=64, max_bounces=0)
    found = np.array([image.mean((0, 1)) for image in pictures])
    assert compare_to_value(found, scattered_once(alpha=3.0)).agrees, (found.mean(0), scattered_once(alpha=3.0))
    assert not compare_to_value(found, scattered_once()).agrees
    assert not compare_to_value(found, scattered_once(alpha=3.3)).agrees


def ball_in_fog(use_mis: bool, phase: tuple[int, float] = (0, 0.0), anisotropy: float = 0.3) -> core.Scene:
    scene = SceneDescription()
    scene.add_box(0.8, medium((1.2, 1.0, 0.8), (0.2, 0.2, 0.2), anisotropy=anisotropy, phase=phase))
    common = dict(use_mis=use_mis, visibility=VISIBLE_TO_ALL - CAMERA)
    scene.builder.add_point_light("lamp", (0.2, -0.1, 0.1), 0.3, (5.0, 5.0, 5.0), soft=False, **common)
    scene.set_camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), 0.25)
    return scene.snapshot()


def test_endless_fog_of_one_colour_lets_the_others_pass() -> None:
    """Each sample, save for roulette."""
    scene = SceneDescription()
    p = core.MaterialProgram("sky")
    one, zero = p.constant(1.0), p.constant(0.0)
    p.closure("CLOSURE_EMISSION", [one, p.constant(1.0, 1.0, 1.0), one])
    p.closure("CLOSURE_VOLUME", [one, p.constant(0.0, 0.0, 0.5), zero, one, zero, zero], [0])
    scene.builder.set_environment(scene.builder.add_material(p))
    scene.set_camera((0.0, -10.0, 0.0), (0.0, 0.0, 0.0), 0.02)
    pictures = replicas(scene.snapshot(), REPLICAS, samples=64, max_bounces=8)
    found = np.array([picture.mean((0, 1)) for picture in pictures])
    assert compare_to_value(found[:, :2], np.ones(2)).agrees, found.mean(0)
    assert not compare_to_value(0.999 * found[:, :2], np.ones(2)).agrees


PHASES = {
    "Henyey and Greenstein's": ((0, 0.0), 0.3),
    "Draine's": ((DRAINE, 2.0), 0.3),
    "of droplets": ((DROPLETS, 0.0), 0.06),
    "Fournier and Forand's": ((FOURNIER_FORAND, 0.45), 1.2),
}


@pytest.mark.parametrize("case", PHASES)
def test_scattered_rays_and_light_samples_find_the_same_lamp(case: str) -> None:
    """False-alarm rate 1 %. Planted: 3 % of the light is found twice."""
    both, samples_alone = (
        np.array([block_means(p, 2, 2) for p in replicas(ball_in_fog(use_mis, *PHASES[case]), REPLICAS, samples=128)])
        for use_mis in (True, False)
    )
    assert compare_replicas(both, samples_alone).agrees, compare_replicas(both, samples_alone)
    assert not compare_replicas(1.03 * both, samples_alone).agrees


@pytest.mark.parametrize("distance", [1e4, 1e7])
def test_lamps_far_away_light_fog_as_a_sun_does(distance: float) -> None:
    """Across a cube of 5 cm, the farther one is seen under angles that single precision does not tell apart.
    False-alarm rate 1 %. Planted: 3 % of the light is found twice."""

    def lit(add_lamp) -> np.ndarray:
        scene = SceneDescription()
        scene.add_box(0.025, medium((12.0, 10.0, 8.0)))
        add_lamp(scene.builder)
        scene.set_camera((0.0, -0.2, 0.0), (0.0, 0.0, 0.0), 0.02)
        pictures = replicas(scene.snapshot(), REPLICAS, samples=64, max_bounces=0)
        return np.array([block_means(image, 2, 2) for image in pictures])

    power = (3.0 * distance**2,) * 3
    lamp = lit(lambda builder: builder.add_point_light("lamp", (distance, 0.0, 0.0), radius=0.0, intensity=power))
    sun = lit(lambda builder: builder.add_sun_light("sun", (1.0, 0.0, 0.0), 0.0, (3.0, 3.0, 3.0)))
    assert compare_replicas(lamp, sun).agrees, compare_replicas(lamp, sun)
    assert not compare_replicas(1.03 * lamp, sun).agrees


def fog_of_all_kinds() -> core.Scene:
    scene = SceneDescription()
    scene.add_sphere(0.8, medium((2.0, 1.0, 3.0), (0.2, 0.1, 0.4), anisotropy=0.3, glow=(0.1, 0.2, 0.3)))
    scene.add_box(0.4, medium((1.0, 4.0, 1.0), anisotropy=-0.3))
    scene.add_quad((-5, -5, -1), (10, 0, 0), (0, 10, 0), emission((0.5, 0.5, 0.5)))
    scene.builder.add_point_light("lamp", (0.4, -2.0, 1.0), radius=0.1, intensity=(10.0, 10.0, 10.0))
    scene.set_environment((0.2, 0.3, 0.5))
    scene.set_camera((0.0, -3.0, 0.5), (0.0, 0.0, 0.0))
    return scene.snapshot()


@pytest.mark.parametrize(
    "techniques",
    [
        {"indirect": "CELL_SHARED", "guiding": "AUTO"},
        {"direct": "RESTIR", "secondary": "CELL_RESERVOIRS", "indirect": "SCREEN_REUSE", "guiding": "ON"},
        {"direct": "LEARNED", "secondary": "LEARNED"},
        {"threads": 2},
        {"threads": 7},
    ],
)
def test_pictures_are_those_of_path_tracing(techniques: dict) -> None:
    """Whatever is asked for, bit by bit, with any number of threads."""
    scene = fog_of_all_kinds()
    expected = render(scene, samples=4, threads=1)["Combined"]
    assert np.array_equal(render(scene, samples=4, **techniques)["Combined"], expected)


def test_depth_is_that_of_surfaces() -> None:
    """Fog in front of a wall does not change where it is."""
    passes = ["Depth", "Normal", "Position"]
    pictures = []
    for density in (0.0, 2.0):
        scene = SceneDescription()
        scene.add_box(1.0, medium((1.0, 1.0, 1.0), density=density))
        scene.add_quad((-9, 3, -9), (18, 0, 0), (0, 0, 18), emission((1.0, 1.0, 1.0)))
        scene.set_camera((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), 0.2)
        pictures.append(render(scene.snapshot(), samples=4, passes=passes, sequence="RANDOM"))
    for name in passes:
        assert np.allclose(pictures[0][name], pictures[1][name], rtol=1e-5, atol=1e-5), name


BAD = [
    {"density": -1.0},
    {"density": 3e38, "scattering": (1e30, 1.0, 0.0)},
    {"anisotropy": 5.0},
    {"anisotropy": -1.0},
    {"scattering": (-1.0, 0.5, 2.0), "absorption": (-2.0, -0.1, 0.0)},
    {"glow": (3e38, 0.0, -1.0), "density": 1e-38},
]


@pytest.mark.parametrize("values", BAD)
def test_bad_values(values: dict) -> None:
    """Clamped: no sample is not a number (`render` looks), none hangs."""
    scene = SceneDescription()
    scene.add_sphere(0.8, medium(**({"scattering": (2.0, 1.0, 3.0)} | values)))
    scene.add_quad((-5, -5, -1), (10, 0, 0), (0, 10, 0), emission((0.5, 0.5, 0.5)))
    scene.builder.add_point_light("lamp", (0.0, 0.0, 0.0), radius=0.0, intensity=(10.0, 10.0, 10.0))
    scene.set_environment((0.2, 0.3, 0.5))
    scene.set_camera((0.0, -3.0, 0.5), (0.0, 0.0, 0.0))
    if "glow" not in values:
        assert np.isfinite(render(scene.snapshot(), samples=4)["Combined"]).all()
    else:  # radiance beyond all range is counted and left out
        session = core.Session(core.Settings(width=8, height=8, samples=2))
        session.start(scene.snapshot())
        assert session.wait(60.0).status is core.Status.DONE


def linked_fire(lit_sets: int) -> core.Scene:
    """A cube of glowing air above a floor: what it emits is for receivers of these sets, of which the floor is 0."""
    scene = SceneDescription()
    scene.add_box(0.5, medium(glow=(1.0, 0.5, 0.25)))
    floor = principled((0.8, 0.8, 0.8), specular=0.0)
    scene.add_quad((-3.0, -3.0, -1.0), (6.0, 0.0, 0.0), (0.0, 6.0, 0.0), floor, "floor")
    every_set = 2**64 - 1
    scene.links = np.array([(lit_sets, every_set), (every_set, every_set)], np.uint64)
    scene.set_camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), 0.8)
    return scene.snapshot()


def test_cameras_see_media_whatever_they_are_linked_to() -> None:
    """Planted: the link, which keeps the light from the floor."""
    linked, free = (render(linked_fire(sets), samples=64)["Combined"][..., :3] for sets in (0b10, 0b11))
    fire, floor = (slice(8, 10), slice(7, 9)), slice(0, 4)
    assert free[fire][..., 0].min() > 0.2
    np.testing.assert_array_equal(linked[fire], free[fire])
    assert linked[floor].max() == 0.0 < free[floor].mean()
