"""Grids of volume objects against closed forms and against homogeneous media. Each planted bug is the smallest change
that its test must see."""

import cistern_core as core
import numpy as np
import pytest

from tests.support.core_scenes import SceneDescription, emission, medium, render, replicas
from tests.support.statistics import block_means, compare_replicas, compare_to_value

REPLICAS = 16
SIGMA = np.array([1.0, 3.0, 9.0])  # 1/m


def grid_medium(
    scattering: tuple = (0.0, 0.0, 0.0), absorption: tuple = (0.0, 0.0, 0.0), anisotropy: float = 0.0,
    glow: tuple = (0.0, 0.0, 0.0), op: str = "GRID_FACTOR",
) -> core.MaterialProgram:  # fmt: skip
    """As dense and as bright as the grid "density" says."""
    p = core.MaterialProgram("grids")
    one = p.constant(1.0)
    p.closure("CLOSURE_TRANSPARENT", [one, p.constant(1.0, 1.0, 1.0)])
    p.is_boundary = True
    name = p.attribute("density")
    density = p.emit("AVERAGE", [p.emit(op, [], [name] if op == "GRID_FACTOR" else [name, 0])])
    inside = [one, p.constant(*scattering), p.constant(*absorption), density, p.constant(anisotropy), p.constant(0.0)]
    p.closure("CLOSURE_VOLUME", inside, [0])
    p.closure("CLOSURE_VOLUME_EMISSION", [one, p.constant(*glow), density])
    return p


def scaling(scale: tuple | float, shift: tuple | float) -> np.ndarray:
    """place -> scale * place + shift"""
    matrix = np.eye(4, dtype=np.float32)
    matrix[:3, :3] *= np.broadcast_to(scale, 3)
    matrix[:3, 3] = shift
    return matrix


def add_grid(
    scene: SceneDescription, voxels: np.ndarray, half: float, program: core.MaterialProgram, name: str = "density",
    matrix: np.ndarray | None = None, scales_with_object: bool = False,
) -> None:  # fmt: skip
    """The first and the last voxels are at -half and half of a cube; around it one voxel more belongs to the box."""
    size = np.array(voxels.shape[:3])
    steps = (size - 1) / (2.0 * half)
    to_voxel, to_box = scaling(steps, steps * half), scaling(steps, steps * half + 1.0)
    mesh = scene.builder.add_volume(
        "cloud", to_box, tuple(int(n) + 1 for n in size), [(name, voxels, to_voxel, 0.0)], scales_with_object
    )
    materials = scene.builder.add_material_set([scene.builder.add_material(program)], "cloud")
    scene.instances.append((mesh, materials, np.eye(4) if matrix is None else matrix))
    scene.visibility.append(63)


def through(voxels: np.ndarray, half: float, **members: object) -> core.Scene:
    """Head-on along y through the middle of a grid, to a glowing wall."""
    scene = SceneDescription()
    add_grid(scene, voxels, half, grid_medium(absorption=tuple(SIGMA)), **members)
    scene.add_quad((-9, 3, -9), (18, 0, 0), (0, 0, 18), emission((1.0, 1.0, 1.0)))
    scene.set_camera((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), 1e-4)
    return scene.snapshot()


def two_side_by_side() -> core.Scene:
    """Boxes of six times 0.125 m that share a face."""
    scene = SceneDescription()
    for y in (-0.375, 0.375):
        add_grid(
            scene, ramp(np.float32), 0.25, grid_medium(absorption=tuple(SIGMA)), matrix=scaling(1.0, (0.0, y, 0.0))
        )
    scene.add_quad((-9, 3, -9), (18, 0, 0), (0, 0, 18), emission((1.0, 1.0, 1.0)))
    scene.set_camera((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), 1e-4)
    return scene.snapshot()


def transmitted(scene: core.Scene) -> np.ndarray:
    return np.array([image.mean((0, 1)) for image in replicas(scene, REPLICAS, samples=128, size=8)])


def one_voxel() -> np.ndarray:
    voxels = np.zeros((3, 3, 3), np.float32)
    voxels[1, 1, 1] = 2.0
    return voxels


def ramp(kind: type) -> np.ndarray:
    """From 0 to 2 along y, in five voxels, and the same in the cross-section."""
    return np.ascontiguousarray(np.broadcast_to(np.linspace(0.0, 2.0, 5)[None, :, None], (3, 5, 4)), kind)


DEPTHS = {  # metres of density 1
    # A tent of height 2 and a foot of two voxels, 0.25 m apart.
    "one voxel": (lambda: through(one_voxel(), 0.25), 2.0 * 0.25),
    # Half of 2 over 0.5 m, and the fall from 2 to 0 over the voxel after it, of 0.125 m.
    "ramp": (lambda: through(ramp(np.float32), 0.25), 0.5 * 2.0 * 0.5 + 0.5 * 2.0 * 0.125),
    "ramp in half precision": (lambda: through(ramp(np.float16), 0.25), 0.625),
    # Twice as wide: the same lattice is twice as far apart, unless the density is that of the object.
    "scaled": (lambda: through(ramp(np.float32), 0.25, matrix=np.diag([2.0, 2.0, 2.0, 1.0])), 2 * 0.625),
    "scaled with its object": (
        lambda: through(ramp(np.float32), 0.25, matrix=np.diag([2.0, 2.0, 2.0, 1.0]), scales_with_object=True),
        0.625,
    ),
    "two side by side": (two_side_by_side, 2 * 0.625),
    # Without the grid it names, a factor is 1: over the box.
    "without its grid": (lambda: through(one_voxel(), 0.25, name="another"), 4 * 0.25),
}


@pytest.mark.parametrize("case", DEPTHS)
def test_transmittance_is_the_integral_of_what_is_interpolated(case: str) -> None:
    """False-alarm rate 1 % per case. Planted: 1 % of the optical depth, and voxels taken for cells."""
    make, depth = DEPTHS[case]
    found = transmitted(make())
    expected = np.exp(-SIGMA * depth)
    assert compare_to_value(found, expected).agrees, (found.mean(0), expected)
    assert not compare_to_value(found, np.exp(-SIGMA * depth * 1.01)).agrees
    if case == "one voxel":
        assert not compare_to_value(found, np.exp(-SIGMA * 2.0 * 0.25 / 2.0)).agrees


def test_attribute_reads_nothing_where_there_is_no_grid() -> None:
    """And an instance without a volume is no place for grids at all."""
    scene = SceneDescription()
    add_grid(scene, one_voxel(), 0.25, grid_medium(absorption=(9.0, 9.0, 9.0), op="ATTRIBUTE"), name="another")
    scene.add_box(0.5, grid_medium(absorption=(9.0, 9.0, 9.0), op="ATTRIBUTE"))
    scene.add_quad((-9, 3, -9), (18, 0, 0), (0, 0, 18), emission((1.0, 1.0, 1.0)))
    scene.set_camera((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), 1e-4)
    assert np.allclose(render(scene.snapshot(), samples=4)["Combined"][..., :3], 1.0)


@pytest.mark.parametrize(
    ("density", "glow", "plant"),
    [(1.0, (0.3, 0.2, 0.1), 1.02), (4000.0, (0.0, 0.0, 0.0), 1.1)],
    ids=["thin", "dense, without glow"],
)
def test_constant_grid_is_a_homogeneous_cube(density: float, glow: tuple, plant: float) -> None:
    """All that media do: scattering, absorption, emission, in an even one, with a lamp. The box ends where the grid is
    still constant. In the dense one, which paths enter by a tenth of a millimetre, no sample is infinite. False-alarm
    rate 1 % per case. Planted: 2 %, 10 % of the dense one."""
    pictures = []
    for is_grid in (True, False):
        scene = SceneDescription()
        values = [tuple(density * np.array(v)) for v in ((1.0, 2.0, 0.5), (0.5, 0.1, 0.2))]
        if is_grid:
            program = grid_medium(*values, anisotropy=0.3, glow=glow)
            grid = ("density", np.ones((6, 6, 6), np.float32), scaling(2.5, 2.5), 0.0)
            mesh = scene.builder.add_volume("cube", scaling(2.5, 2.0), (4, 4, 4), [grid])
            materials = scene.builder.add_material_set([scene.builder.add_material(program)], "cube")
            scene.instances.append((mesh, materials, np.eye(4)))
            scene.visibility.append(63)
        else:
            scene.add_box(0.8, medium(*values, anisotropy=0.3, glow=glow))
        scene.add_box(1.0, medium((0.3, 0.3, 0.3)))
        scene.builder.add_point_light("lamp", (0.2, -0.1, 1.5), 0.0, (3.0, 3.0, 3.0))
        scene.set_camera((0.0, -4.0, 0.5), (0.0, 0.0, 0.0), 0.3)
        pictures.append(np.array([block_means(i, 2, 2) for i in replicas(scene.snapshot(), REPLICAS, samples=64)]))
    assert compare_replicas(*pictures).agrees, compare_replicas(*pictures)
    assert not compare_replicas(plant * pictures[0], pictures[1]).agrees


def sparse_cloud(size: int = 40, peak: float = 60.0) -> np.ndarray:
    """A few dense drops in a box that is empty for the most part."""
    voxels = np.zeros((size, size, size), np.float32)
    rng = np.random.default_rng(5)
    for x, y, z in rng.integers(4, size - 8, (12, 3)):
        voxels[x : x + 4, y : y + 3, z : z + 4] += peak * rng.random((4, 3, 4), np.float32)
    return voxels


def furnace(max_bounces: int = 1024) -> np.ndarray:
    scene = SceneDescription()
    add_grid(scene, sparse_cloud(), 1.0, grid_medium(scattering=(1.0, 0.7, 0.4), anisotropy=0.4))
    scene.add_box(0.3, medium((1.0, 2.0, 3.0)))
    scene.set_environment((1.0, 1.0, 1.0))
    scene.set_camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), 0.3)
    found = replicas(scene.snapshot(), REPLICAS, samples=32, max_volume_bounces=max_bounces)
    return np.array([block_means(image, 2, 2) for image in found])


def test_furnace() -> None:
    """What scatters all light is invisible in a white world, whatever the bounds of its blocks. False-alarm rate 1 %.
    Planted: paths that end after 8 bounces."""
    assert compare_to_value(furnace(), 1.0).agrees, compare_to_value(furnace(), 1.0)
    assert not compare_to_value(furnace(8), 1.0).agrees


def test_threads_do_not_matter() -> None:
    scene = SceneDescription()
    add_grid(scene, sparse_cloud(), 1.0, grid_medium(scattering=(1.0, 0.7, 0.4), glow=(0.1, 0.0, 0.0)))
    scene.builder.add_point_light("lamp", (0.2, -2.0, 1.5), 0.1, (9.0, 9.0, 9.0))
    scene.set_camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), 0.3)
    pictures = [render(scene.snapshot(), samples=4, threads=threads)["Combined"] for threads in (1, 2, 7)]
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures[1:]) and pictures[0].any()


def test_what_does_not_fit_is_refused() -> None:
    builder = core.SceneBuilder()
    good, eye = np.ones((2, 2, 2), np.float32), np.eye(4, dtype=np.float32)
    for voxels, matrix, size in (
        (np.ones((2, 2), np.float32), eye, (2, 2, 2)),
        (np.ones((2, 2, 2), np.uint8), eye, (2, 2, 2)),
        (np.ones((2, 2, 2, 5), np.float32), eye, (2, 2, 2)),
        (np.ones((0, 2, 2), np.float32), eye, (2, 2, 2)),
        (good, np.zeros((4, 4), np.float32), (2, 2, 2)),
        (good, eye, (0, 2, 2)),
    ):
        with pytest.raises(core.Error, match="cloud"):
            builder.add_volume("cloud", eye, size, [("density", voxels, matrix, 0.0)])
    for drift, opening in ((good, 0.0), (np.ones((2, 2, 2, 3), np.float32), np.nan)):
        with pytest.raises(core.Error, match="cloud"):
            builder.add_volume("cloud", eye, (2, 2, 2), [("INFO:drift", drift, eye, 0.0)], drift_opening=opening)
    handle = builder.add_volume("cloud", eye, (2, 2, 2), [("density", good, eye, 0.0)])
    assert builder.add_volume("cloud", eye, (2, 2, 2), [("density", good.copy(), eye, 0.0)], replace=handle) == handle
