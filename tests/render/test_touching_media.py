"""Media whose boundaries lie in one plane, with each other or with a surface, and media that some rays do not see.

All of it absorbs only, so that one sample is exact. Each scene is looked at along a few rays; that without absorption,
or with one boundary less, is the planted bug: `test_lost_boundaries_show`.
"""

import cistern_core as core
import numpy as np
import pytest

from tests.support.core_scenes import (
    CAMERA,
    SHADOW,
    VISIBLE_TO_ALL,
    SceneDescription,
    emission,
    medium,
    principled,
    render,
)

CORNERS = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
WHITE = (1.0, 1.0, 1.0)
TOLERANCE = 5e-3  # of what is seen: rays do without some roundings of the coordinates, in media that may be dense


def turned(scale: float = 1.0, mirror: float = 1.0, shift: tuple = (0.0, 0.0, 0.0)) -> np.ndarray:
    """Along no axis, so that the same plane is another of every object, to rounding."""
    axis, angle = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8]), 1.1
    cross = np.cross(np.eye(3), axis)
    matrix = np.eye(4)
    rotation = np.cos(angle) * np.eye(3) - np.sin(angle) * cross + (1 - np.cos(angle)) * np.outer(axis, axis)
    matrix[:3, :3] = rotation @ np.diag([scale, scale, scale * mirror])
    matrix[:3, 3] = shift
    return matrix


POSES = {
    "straight": np.eye(4),
    "turned": turned(),
    "mirrored": turned(mirror=-1.0),
    "far": turned(shift=(100.0, -300.0, 40.0)),
    "large": turned(scale=50.0),
    "small": turned(scale=0.02, shift=(1.0, 2.0, 3.0)),
}
CUBES = [((-1.0, 0.0, 0.0), 0.4), ((0.0, 0.0, 0.0), 1.5), ((1.0, 0.0, 0.0), 0.7), ((0.0, 0.0, 1.0), 0.9)]


def cube_matrix(pose: np.ndarray, center: tuple) -> np.ndarray:
    place = np.eye(4)
    place[:3, 3] = center
    return pose @ place


def chord(pose: np.ndarray, center: tuple, origin: np.ndarray, end: np.ndarray) -> float:
    """Metres of the way between two places that are inside of a cube."""
    to_cube = np.linalg.inv(cube_matrix(pose, center))
    a, b = ((to_cube @ np.append(p, 1.0))[:3] for p in (origin, end))
    with np.errstate(divide="ignore"):
        ends = np.sort(np.array([(-0.5 - a) / (b - a), (0.5 - a) / (b - a)]), 0)
    return max(0.0, min(1.0, ends[1].min()) - max(0.0, ends[0].max())) * float(np.linalg.norm(end - origin))


def absorbed(pose: np.ndarray, origin: np.ndarray, end: np.ndarray, cubes: list = CUBES) -> float:
    unit = np.linalg.norm(pose[:3, 0])  # as dense for all sizes
    return float(np.exp(-sum(a * chord(pose, center, origin, end) / unit for center, a in cubes)))


def add_cubes(
    scene: SceneDescription, pose: np.ndarray, are_copies: bool, visibility: int = VISIBLE_TO_ALL, cubes: list = CUBES
) -> None:
    """Each of its own medium; copies share a mesh, others are put into the world's space."""
    unit = np.linalg.norm(pose[:3, 0])
    for center, a in cubes:
        inside = medium(absorption=(a / unit,) * 3)
        scene.add_mesh(CORNERS, SIDES, inside, cube_matrix(pose, center), visibility=visibility)
        if are_copies:  # of the first mesh
            scene.instances[-1] = (scene.instances[0][0], *scene.instances[-1][1:])


def rays(pose: np.ndarray, inside: bool) -> list[tuple[np.ndarray, np.ndarray]]:
    """Through the row; those from `inside` begin in its middle."""
    rng = np.random.default_rng(3)
    found = []
    for _ in range(12):
        middle = np.append(rng.uniform(-0.4, 0.4, 3), 1.0)
        away = np.append(rng.normal(size=3) * (1.0, 0.4, 0.4), 0.0)
        away *= 4.0 / np.linalg.norm(away)
        start = middle if inside else middle - away
        found.append(((pose @ start)[:3], (pose @ (middle + away))[:3]))
    return found


def seen(scene: SceneDescription, origin: np.ndarray, end: np.ndarray) -> np.ndarray:
    scene.set_camera(tuple(origin), tuple(end), 1e-5)
    return render(scene.snapshot(), size=2, samples=1, max_bounces=0)["Combined"][..., :3]


def through_cubes(
    pose: np.ndarray, are_copies: bool, inside: bool, cubes: list = CUBES
) -> tuple[np.ndarray, np.ndarray]:
    """What is seen of a wall that glows, and what should be."""
    found, expected = [], []
    for origin, end in rays(pose, inside):
        scene = SceneDescription()
        add_cubes(scene, pose, are_copies, cubes=cubes)
        along = end - origin
        u = np.cross(along, (0.3, 1.0, 0.2))
        v = np.cross(along, u) / np.linalg.norm(along)
        scene.add_quad(tuple(end - u / 2 - v / 2), tuple(u), tuple(v), emission(WHITE))
        found.append(seen(scene, origin, end))
        clipped = origin + 1e-3 * along / np.linalg.norm(along)
        expected.append(absorbed(pose, clipped, end, cubes))
    return np.array(found), np.array(expected)[:, None, None, None]


@pytest.mark.parametrize("inside", [False, True], ids=["from outside", "from inside"])
@pytest.mark.parametrize("are_copies", [False, True], ids=["meshes", "copies"])
@pytest.mark.parametrize("pose", POSES)
def test_cubes_side_by_side(pose: str, are_copies: bool, inside: bool) -> None:
    found, expected = through_cubes(POSES[pose], are_copies, inside)
    assert np.allclose(found, expected, rtol=TOLERANCE), np.abs(found / expected - 1).max((1, 2, 3))


def test_more_at_one_place_than_are_kept() -> None:
    """Sixteen media are; of more, some do not begin and others end later. (Rays met them all again and again, and paths
    ended in black.)"""
    center = (0.0, 0.0, 0.0)
    sixteen, expected = through_cubes(POSES["turned"], False, False, [(center, 0.05)] * 16)
    assert np.allclose(sixteen, expected, rtol=TOLERANCE)
    forty, _ = through_cubes(POSES["turned"], False, False, [(center, 0.05)] * 40)
    never_left = np.exp(-16 * 0.05 * 8.0)  # by any ray, whose ways are 8 long
    assert (forty > never_left).all() and (forty < (1 + TOLERANCE) * expected).all(), forty / expected


@pytest.mark.parametrize("pose", POSES)
def test_parts_of_a_mesh_side_by_side(pose: str) -> None:
    """Where one ends the other begins: the medium goes on."""
    both = [*CORNERS, *((x + 1.0, y, z) for x, y, z in CORNERS)]
    sides = [*SIDES, *(tuple(k + 8 for k in side) for side in SIDES)]
    cubes = [((0.0, 0.0, 0.0), 0.8), ((1.0, 0.0, 0.0), 0.8)]
    matrix = POSES[pose]
    for origin, end in rays(matrix, False):
        scene = SceneDescription()
        inside = medium(absorption=(0.8 / np.linalg.norm(matrix[:3, 0]),) * 3)
        scene.add_mesh(both, sides, inside, matrix)
        along = end - origin
        u = np.cross(along, (0.3, 1.0, 0.2))
        v = np.cross(along, u) / np.linalg.norm(along)
        scene.add_quad(tuple(end - u / 2 - v / 2), tuple(u), tuple(v), emission(WHITE))
        assert np.allclose(seen(scene, origin, end), absorbed(matrix, origin, end, cubes), rtol=TOLERANCE)


def floor_point(pose: np.ndarray, x: float, y: float, z: float = -0.5) -> np.ndarray:
    return (pose @ (x, y, z, 1.0))[:3]


def add_floor(scene: SceneDescription, pose: np.ndarray, program: core.MaterialProgram, z: float = -0.5) -> None:
    corner, u, v = (pose @ p for p in ((-9, -8, z, 1), (20, 0, 0, 0), (0, 20, 0, 0)))
    scene.add_quad(tuple(corner[:3]), tuple(u[:3]), tuple(v[:3]), program)


@pytest.mark.parametrize("is_visible", [True, False], ids=["seen", "unseen"])
@pytest.mark.parametrize("z", [-0.5, -0.2], ids=["on it", "through it"])
@pytest.mark.parametrize("pose", ["straight", "turned", "far", "large"])
def test_fog_on_a_floor(pose: str, z: float, is_visible: bool) -> None:
    """Lit by a lamp of no size through the fog, which the camera may not see: it casts its shadow even so, and no light
    is lost below the floor."""
    matrix, rng = POSES[pose], np.random.default_rng(7)
    lamp, eye = (matrix @ (0.7, -1.1, 3.0, 1.0))[:3], (matrix @ (0.4, -3.0, 2.0, 1.0))[:3]
    for _ in range(12):
        place = floor_point(matrix, *rng.uniform(-1.4, 1.4, 2), z)
        pictures = []
        for has_fog in (False, True):
            scene = SceneDescription()
            add_floor(scene, matrix, principled(), z)
            if has_fog:
                add_cubes(scene, matrix, False, VISIBLE_TO_ALL - (0 if is_visible else CAMERA))
            power = 100.0 * np.linalg.norm(matrix[:3, 0]) ** 2
            scene.builder.add_point_light("lamp", tuple(lamp), 0.0, (power,) * 3)
            pictures.append(seen(scene, eye, place))
        expected = absorbed(matrix, place, lamp) * (absorbed(matrix, eye, place) if is_visible else 1.0)
        assert pictures[0].min() > 0.1
        assert np.allclose(pictures[1], expected * pictures[0], rtol=TOLERANCE), place


def test_fog_that_throws_no_shadow() -> None:
    """Which shadow rays do not see, on a floor and through one: it dims what the camera sees, and no more."""
    for z in (-0.5, -0.2):
        pictures = []
        for has_fog in (False, True):
            scene = SceneDescription()
            add_floor(scene, np.eye(4), principled(), z)
            if has_fog:
                add_cubes(scene, np.eye(4), False, VISIBLE_TO_ALL - SHADOW)
            scene.builder.add_point_light("lamp", (0.7, -1.1, 3.0), 0.0, (100.0,) * 3)
            pictures.append(seen(scene, np.array((0.4, -3.0, 2.0)), np.array((0.1, 0.2, z))))
        expected = absorbed(np.eye(4), np.array((0.4, -3.0, 2.0)), np.array((0.1, 0.2, z)))
        assert np.allclose(pictures[1], expected * pictures[0], rtol=TOLERANCE)


@pytest.mark.parametrize("pose", ["straight", "turned", "far", "large"])
def test_fog_on_a_floor_that_glows(pose: str) -> None:
    """Seen in wide pictures: every ray meets the floor below the fog, and none goes through."""
    matrix = POSES[pose]
    scene = SceneDescription()
    add_floor(scene, matrix, emission(WHITE))
    add_cubes(scene, matrix, False)
    eye = (matrix @ (0.4, -3.0, 2.0, 1.0))[:3]
    scene.set_camera(tuple(eye), tuple(floor_point(matrix, 0.0, 0.0)), 0.3)
    picture = render(scene.snapshot(), size=64, samples=4)["Combined"][..., :3]
    assert picture.min() > np.exp(-1.5 * 2.0), picture.min()


def test_lost_boundaries_show() -> None:
    """Planted: the cube of the row that is entered last is never left, or the first one not entered."""
    found, expected = through_cubes(np.eye(4), False, False)
    without = np.array([absorbed(np.eye(4), o, e, CUBES[1:]) for o, e in rays(np.eye(4), False)])[:, None, None, None]
    assert np.allclose(found, expected, rtol=TOLERANCE)
    assert not np.allclose(found, without, rtol=TOLERANCE)
