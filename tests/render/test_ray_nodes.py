"""Nodes that trace rays: closed forms, and reuse, which evaluates their materials again, against path tracing.

False-alarm rate of each comparison with a closed form 1 %; of all comparisons of reuse together 1 %.
"""

from __future__ import annotations

import functools
import math

import cistern_core as core
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.render.test_path_reuse import Answers, members_of, values
from tests.support.core_scenes import SceneDescription, principled, render, replicas
from tests.support.ray_node_scenes import SCENES, shining_normal, shining_occlusion
from tests.support.statistics import Comparison, compare_replicas, compare_to_value, sidak

REPLICAS = 16
FAR = 500.0  # half a side of what stands for an infinite plane, in metres


def look_down(scene: SceneDescription, x: float, height: float = 0.2) -> core.Scene:
    """At a spot of a tenth of a millimetre."""
    scene.set_camera((x, 0.0, height), (x, 0.0, 0.0), half_width=3e-4)
    return scene.snapshot()


def seen(scene: core.Scene, samples: int = 64) -> NDArray:
    """(replicas, channels) of the mean over the spot."""
    return replicas(scene, REPLICAS, size=4, samples=samples, max_bounces=0).mean(axis=(1, 2))


def beside_wall(height: float, **members) -> core.Scene:
    """A spot of floor 1 m from a long wall."""
    scene = SceneDescription()
    scene.add_quad((-FAR, -FAR, 0), (2 * FAR, 0, 0), (0, 2 * FAR, 0), shining_occlusion(**members))
    scene.add_quad((1.0, -FAR, 0), (0, 2 * FAR, 0), (0, 0, height), principled())
    return look_down(scene, 0.0)


def below_ceiling(distance: float, **members) -> core.Scene:
    """A spot of floor 1 m below a ceiling without end, seen from between the two."""
    scene = SceneDescription()
    scene.add_quad((-FAR, -FAR, 0), (2 * FAR, 0, 0), (0, 2 * FAR, 0), shining_occlusion(distance, **members))
    scene.add_quad((-FAR, -FAR, 1), (2 * FAR, 0, 0), (0, 2 * FAR, 0), principled())
    return look_down(scene, 0.0)


@pytest.mark.parametrize("height", [0.5, 1.0, 3.0])
def test_a_wall_occludes_as_much_as_its_view_factor(height: float) -> None:
    """Of an element beside a long strip at a right angle: (1 - d / sqrt(d^2 + h^2)) / 2."""
    open_part = 1.0 - 0.5 * (1.0 - 1.0 / math.hypot(1.0, height))
    result = compare_to_value(seen(beside_wall(height, distance=2 * FAR)), open_part)
    assert result.agrees, result


def test_a_wall_one_per_cent_too_high_is_seen() -> None:
    """Planted bug: 0.3 % of what is open."""
    found = seen(beside_wall(1.01, distance=2 * FAR), 256)
    assert not compare_to_value(found, 1.0 - 0.5 * (1.0 - 1.0 / math.sqrt(2.0))).agrees


@pytest.mark.parametrize("distance", [0.9, 1.1, 2.0])
def test_a_ceiling_occludes_up_to_the_distance(distance: float) -> None:
    """Of rays within acos(h / distance) of the normal: cosine-weighted (h / distance)^2 are open."""
    result = compare_to_value(seen(below_ceiling(distance)), min(1.0 / distance**2, 1.0))
    assert result.agrees, result


def test_a_distance_one_per_cent_too_large_is_seen() -> None:
    """Planted bug."""
    assert not compare_to_value(seen(below_ceiling(2.0 * 1.01), 256), 0.25).agrees


@pytest.mark.parametrize("is_local", [False, True])
def test_inside_of_a_sphere(is_local: bool) -> None:
    """From a point of it the other side is 2 R cos t away, t from the inward normal, and so beyond a distance d where
    cos t > d / 2 R: of cosine-weighted directions 1 - (d / 2 R)^2. A ball just inside is another object, which only
    counts where the node is not local. 0.2 % for flat faces, at the middle of one of 384 round the equator."""
    scene = SceneDescription()
    scene.add_sphere(1.0, shining_occlusion(1.0, is_inside=True, is_local=is_local), rings=192)
    if is_local:
        scene.add_sphere(0.2, principled(), (0.7, 0.0, 0.0))
    angle = 0.5 * math.pi / 192
    place = np.array([math.cos(angle) * math.cos(angle), math.cos(angle) * math.sin(angle), math.sin(angle)])
    scene.set_camera(tuple(1.3 * place), tuple(place), half_width=3e-4)
    result = compare_to_value(seen(scene.snapshot()), 0.75)
    assert abs(result.ratio - 1.0) < 4 * result.ratio_error + 2e-3, result


def test_what_is_seen_from_inside_of_the_floor_is_closed() -> None:
    """Below it lies nothing, and the wall stands on it: all is open; only the floor itself, all is open too."""
    for members in (dict(is_inside=True), dict(is_local=True), dict(is_inside=True, is_local=True)):
        assert (seen(beside_wall(1.0, distance=2 * FAR, **members), 4) == 1.0).all()


def beside_edge(x: float, radius: float, probes: int) -> core.Scene:
    """The top of a long bar, x away from an edge at which its side begins."""
    scene = SceneDescription()
    points = [(a, b, c) for a in (-5.0, 0.0) for b in (-5.0, 5.0) for c in (-5.0, 0.0)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    scene.add_mesh(points, faces, shining_normal(radius, probes))
    return look_down(scene, -x)


def mean_slope(x: float, radius: float) -> float:
    """Of the mean normal: what the side weighs over what the top does, by (1 - r / radius)^3 of the distance r."""
    n = 400
    along, off = np.meshgrid(*(radius * (np.arange(n) + 0.5) / n,) * 2)

    def weight(r: NDArray) -> float:
        return float((np.clip(1.0 - r / radius, 0.0, None) ** 3).sum())

    side = weight(np.sqrt(along**2 + off**2 + x**2))
    signed = np.concatenate([-off, off], axis=0)  # towards the edge
    both = np.concatenate([along, along], axis=0)
    top = float((np.clip(1.0 - np.hypot(both, signed) / radius, 0.0, None) ** 3)[signed < x].sum())
    return side / top


@pytest.mark.parametrize("x", [0.0, 0.05, 0.1])
def test_an_edge_bends_the_normal_as_much_as_its_sides_weigh(x: float) -> None:
    """With so many probes the mean of unit normals is the unit normal of the mean, but for 0.3 %."""
    found = seen(beside_edge(x, 0.2, 128)).mean(axis=0)
    assert found[1] == pytest.approx(0.0, abs=1e-6)
    assert found[0] / found[2] == pytest.approx(mean_slope(x, 0.2), rel=5e-3)


def test_a_radius_five_per_cent_too_large_is_seen() -> None:
    """Planted bug."""
    found = seen(beside_edge(0.05, 0.2 * 1.05, 128)).mean(axis=0)
    assert found[0] / found[2] != pytest.approx(mean_slope(0.05, 0.2), rel=5e-3)


def test_far_from_edges_normals_are_what_they_were() -> None:
    found = seen(beside_edge(0.5, 0.2, 4), 4)
    np.testing.assert_allclose(found, np.broadcast_to([0.0, 0.0, 1.0], found.shape), atol=1e-6)


CASES: list[tuple[Answers, str]] = [
    (answers, name)
    for answers in (
        ("NEE", "NEE", "CELL_SHARED"),
        ("RIS", "NEE", "PATH"),
        ("RESTIR", "NEE", "PATH"),
        ("RESTIR_CACHE", "NEE", "PATH"),
        ("NEE", "CELL_RESERVOIRS", "PATH"),
        ("NEE", "NEE", "SCREEN_REUSE"),
        ("NEE", "NEE", "WORLD_REUSE"),
    )
    for name in SCENES
]
"""Of each preset of the add-on that promises no bias."""
CASE_RATE = sidak(0.01, len(CASES))
LIMITS = dict(max_bounces=3)
SESSIONS, FRAMES, REFERENCE_SAMPLES, SIZE = 32, 8, 24, 20


@functools.cache
def scene(name: str) -> core.Scene:
    return SCENES[name]()


def sessions(name: str, first_seed: int, **settings) -> NDArray:
    return np.array([values(render(scene(name), SIZE, seed=first_seed + k, **settings)) for k in range(SESSIONS)])


@functools.cache
def reference(name: str) -> NDArray:
    return sessions(name, 100_000, samples=REFERENCE_SAMPLES, **LIMITS)


def compare(answers: Answers, name: str, scale: float = 1.0) -> Comparison:
    members = members_of(answers) | LIMITS | dict(samples=FRAMES, bias="UNBIASED")
    return compare_replicas(scale * sessions(name, 1, **members), reference(name), CASE_RATE)


QUICK = [
    (("NEE", "NEE", "CELL_SHARED"), "dirty_room"),
    (("RESTIR", "NEE", "PATH"), "dirty_room"),
    (("NEE", "CELL_RESERVOIRS", "PATH"), "bevelled_room"),
    (("NEE", "NEE", "SCREEN_REUSE"), "bevelled_room"),
    (("NEE", "NEE", "WORLD_REUSE"), "dirty_room"),
]


@pytest.mark.parametrize(
    ("answers", "name"),
    [
        pytest.param(*case, id="-".join([*case[0], case[1]]), marks=() if case in QUICK else pytest.mark.slow)
        for case in CASES
    ],
)
def test_reuse_agrees_with_path_tracing(answers: Answers, name: str) -> None:
    result = compare(answers, name)
    assert result.agrees, result


@pytest.mark.parametrize("name", SCENES)
def test_two_per_cent_too_bright_are_seen(name: str) -> None:
    """Planted bug."""
    result = compare(("NEE", "NEE", "CELL_SHARED"), name, scale=1.02)
    assert not result.agrees, result


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("answers", [("NEE", "NEE", "PATH"), ("RESTIR", "CELL_RESERVOIRS", "CELL_SHARED")])
def test_same_bits_for_any_number_of_threads(name: str, answers: Answers) -> None:
    settings = members_of(answers) | LIMITS | dict(samples=3, seed=5)
    one, *others = (render(scene(name), SIZE, threads=n, **settings)["Combined"] for n in (1, 2, 7))
    assert all(np.array_equal(one, other) for other in others)
