"""Light that is clamped, against Cycles: by how often it has turned, mirrors and glass counted."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support import engines
from tests.support.slow_cases import marked
from tests.support.statistics import compare_replicas

pytestmark = pytest.mark.usefixtures("registered_addon")

SIZE, SAMPLES, COUNT, BLOCKS = (32, 32), 64, 6, 2
AHEAD = (1.5708, 0.0, 0.0)
LIMITS = {"direct": (0.3, 0.0), "indirect": (0.0, 0.3), "both": (0.3, 0.3)}


def mirror(tree: build.Nodes) -> bpy.types.NodeSocket:
    return build.shader(tree, "ShaderNodeBsdfAnisotropic", Color=(1.0, 1.0, 1.0, 1.0), Roughness=0.0).outputs[0]


def pane(tree: build.Nodes) -> bpy.types.NodeSocket:
    return build.shader(tree, "ShaderNodeBsdfGlass", Color=(1.0, 1.0, 1.0, 1.0), Roughness=0.0, IOR=1.45).outputs[0]


def lit_wall(scene: bpy.types.Scene, in_front: object = None) -> None:
    """Seen straight, in a mirror or through a pane: a wall in a lamp's light, which is above the limits."""
    white = build.principled("wall", Base_Color=(0.8, 0.8, 0.8, 1.0), Specular_IOR_Level=0.0)
    points = [(-2, 2, 0), (2, 2, 0), (2, 2, 3), (-2, 2, 3)]
    build.add_mesh(scene, "wall", points, [(0, 1, 2, 3)], white)
    build.add_light(scene, "POINT", (0.0, 0.5, 1.5), energy=150.0, shadow_soft_size=0.2)
    if in_front is mirror:
        build.add_floor(scene, build.material("mirror", mirror), half=3.0)
        build.add_camera(scene, (0.0, -3.0, 1.5), (1.1, 0.0, 0.0))
    elif in_front is pane:
        points = [(-2, -1, 0), (2, -1, 0), (2, -1, 3), (-2, -1, 3)]
        build.add_mesh(scene, "pane", points, [(0, 1, 2, 3)], build.material("pane", pane))
        build.add_camera(scene, (0.0, -4.0, 1.5), AHEAD)
    else:
        build.add_floor(scene, white, half=3.0)
        build.add_camera(scene, (0.0, -4.0, 1.5), AHEAD)


STAGES = {"diffuse": None, "mirror": mirror, "pane": pane}
CASES = {f"{stage}, {limits}": (stage, limits) for stage in STAGES for limits in LIMITS}
SLOW = {"diffuse, both", "mirror, both", "pane, both", "diffuse, direct"}


def compared(scene: bpy.types.Scene, ours: tuple[float, float], theirs: tuple[float, float]):
    engines.prepare(scene, *SIZE, 4)
    scene.cistern.clamp_direct, scene.cistern.clamp_indirect = ours
    scene.cycles.sample_clamp_direct, scene.cycles.sample_clamp_indirect = theirs
    found = engines.replicas(scene, "CISTERN", COUNT, SAMPLES, BLOCKS)
    return compare_replicas(found, engines.replicas(scene, "CYCLES", COUNT, SAMPLES, BLOCKS, first_seed=1001))


@pytest.mark.parametrize("case", marked(CASES, SLOW))
def test_limits(empty_scene: bpy.types.Scene, case: str) -> None:
    stage, limits = CASES[case]
    lit_wall(empty_scene, STAGES[stage])
    result = compared(empty_scene, LIMITS[limits], LIMITS[limits])
    assert result.agrees, result


def test_the_other_limit_is_seen(empty_scene: bpy.types.Scene) -> None:
    """Planted: what a mirror shows counts as direct."""
    lit_wall(empty_scene, mirror)
    assert not compared(empty_scene, LIMITS["direct"], LIMITS["indirect"]).agrees
