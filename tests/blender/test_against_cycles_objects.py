"""What objects are besides their mesh, against Cycles: matrices that flatten; see test_against_cycles_lights."""

import math

import bpy
import numpy as np
import pytest

from addon.sync.placements import is_flattened, thicken_flattened
from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")


def add_waves(scene: bpy.types.Scene, surface: bpy.types.Material, smooth: bool) -> bpy.types.Object:
    """A sheet above a square of 1 m: no two of its faces meet where it is flattened."""
    n = 12
    points = [
        (i / n - 0.5, j / n - 0.5, 0.2 * math.sin(i) * math.cos(0.7 * j)) for j in range(n + 1) for i in range(n + 1)
    ]
    corners = [j * (n + 1) + i for j in range(n) for i in range(n)]
    return build.add_mesh(scene, "waves", points, [(k, k + 1, k + n + 2, k + n + 1) for k in corners], surface, smooth)


def two_sided() -> bpy.types.Material:
    """Red in front, blue behind, by the emission of a mesh that lights others."""

    def shade(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        back = build.shader(tree, "ShaderNodeNewGeometry").outputs["Backfacing"]
        front = build.shader(tree, "ShaderNodeEmission", Color=(1, 0.1, 0.1, 1))
        mix = build.shader(tree, "ShaderNodeMixShader", Fac=back)
        tree.links.new(front.outputs[0], mix.inputs[1])
        tree.links.new(build.shader(tree, "ShaderNodeEmission", Color=(0.1, 0.1, 1, 1)).outputs[0], mix.inputs[2])
        return mix.outputs[0]

    return build.material("sides", shade)


def flattened_by_itself(scene: bpy.types.Scene) -> None:
    for x, smooth, y_scale in ((-0.7, True, 0.7), (0.7, False, -0.7)):  # smooth and mirrored ones are black in Cycles
        card = add_waves(scene, build.principled("card", Base_Color=(0.8, 0.2, 0.1, 1)), smooth)
        card.location, card.rotation_euler, card.scale = (x, 0, 0.6), (0.3, 0.4, 0.2), (1, y_scale, 0)


def flattened_by_its_parent(scene: bpy.types.Scene) -> None:
    parent = bpy.data.objects.new("parent", None)
    scene.collection.objects.link(parent)
    parent.location, parent.rotation_euler, parent.scale = (0, 0, 0.7), (0.5, 0.2, 0.1), (1, 0, 1)
    card = add_waves(scene, two_sided(), smooth=True)
    card.rotation_euler, card.parent = (1.2, 0.3, 0.4), parent


def left_out(scene: bpy.types.Scene) -> None:
    for item in scene.objects:
        item.hide_render = item.name.startswith("waves")


@pytest.mark.parametrize("add", [flattened_by_itself, flattened_by_its_parent])
def test_flattened_objects_are_cards(empty_scene, add) -> None:
    """Planted bug: Cycles leaves them out."""
    build.add_floor(empty_scene)
    build.set_world(empty_scene)
    build.add_light(empty_scene, "AREA", (0.5, -0.5, 2.5), energy=60.0, size=0.8)
    build.add_camera(empty_scene)
    add(empty_scene)
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result
    assert not compare_with_cycles(empty_scene, plant=left_out).agrees


@pytest.mark.parametrize("rank", [0, 1, 2])
def test_only_planes_are_thickened(rank) -> None:
    """Matrices of a rank, with and without axes of length 0: those of rank 2 keep their plane within 0.1 mm of a
    metre, as the core wants them; the others stay."""
    rng = np.random.default_rng(5)
    matrices = np.tile(np.eye(4, dtype=np.float32), (64, 1, 1))
    turn, skew = (np.linalg.qr(rng.normal(size=(64, 3, 3)))[0] for _ in range(2))
    sizes = rng.uniform(0.3, 2.0, (64, 3)) * (np.arange(3) < rank)
    skew[:32] = np.eye(3)
    matrices[:, :3, :3] = (turn * sizes[:, None, :]) @ skew
    before = matrices.copy()
    assert is_flattened(matrices).all()
    thicken_flattened(matrices)
    assert np.abs(matrices - before).max() < 3e-4
    assert not is_flattened(matrices).any() if rank == 2 else np.array_equal(matrices, before)
