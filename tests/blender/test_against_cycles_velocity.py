"""Motion blur of points whose velocity an attribute tells, against Cycles; method as in test_against_cycles_lights."""

import functools
import itertools

import bpy
import numpy as np
import pytest

from tests.support import blender_scenes as build
from tests.support import hair_scenes
from tests.support.engines import compare_with_cycles
from tests.support.motion_scenes import animate, put_in_motion, resting

pytestmark = pytest.mark.usefixtures("registered_addon")


@pytest.fixture
def moving(empty_scene):
    return functools.partial(put_in_motion, empty_scene)


def drift(geometry):
    """Tell points that rest to turn and to rise."""
    place = geometry.attributes["position"].data
    points = np.zeros((len(place), 3), np.float32)
    place.foreach_get("vector", points.ravel())
    speeds = np.stack([-3.0 * points[:, 1], 3.0 * points[:, 0], np.full(len(points), 8.0)], 1).astype(np.float32)
    geometry.attributes.new("velocity", "FLOAT_VECTOR", "POINT").data.foreach_set("vector", speeds.ravel())


def drifting(scene, ball):
    drift(ball.data)


def melting(scene, ball):
    """The same, with points of their own in each frame."""
    drifting(scene, ball)
    decimate = ball.modifiers.new("decimate", "DECIMATE")
    decimate.ratio = 0.5
    animate(decimate, "ratio", 0.4, 0.5, 0.6)


DRIFTS = {"shape": (drifting, "CENTER"), "points": (melting, "CENTER"), "opened before": (drifting, "END")}


@pytest.mark.parametrize("case", DRIFTS)
def test_velocity(moving, case):
    result = compare_with_cycles(moving(*DRIFTS[case]))
    assert result.agrees, result


def test_velocity_of_what_is_not_to_bend(moving):
    scene = moving(drifting)
    bpy.data.objects["sphere"].cycles.use_deform_motion = False
    result = compare_with_cycles(scene)
    assert result.agrees, result


def test_other_velocities_are_seen(moving):
    """Planted: slower by a third, by the frame rate."""

    def plant(scene):
        scene.render.fps_base *= 2.0 / 3.0

    assert not compare_with_cycles(moving(drifting), plant=plant).agrees


def make_points_of(obj):
    """Balls at its vertices, of its material and with its attributes."""
    tree = bpy.data.node_groups.new("cloud", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "GeometryNodeMeshToPoints", "GeometryNodeSetMaterial", "NodeGroupOutput")
    nodes = [tree.nodes.new(kind) for kind in kinds]
    for before, after in itertools.pairwise(nodes):
        tree.links.new(before.outputs[0], after.inputs[0])
    nodes[1].inputs["Radius"].default_value = 0.1
    nodes[2].inputs["Material"].default_value = obj.data.materials[0]
    obj.modifiers.new("cloud", "NODES").node_group = tree


@pytest.mark.parametrize("kind", ["hair", "points"])
def test_velocity_of_hair_and_points(moving, kind):
    scene = moving(resting)
    surface = build.principled("coat", Base_Color=(0.3, 0.5, 0.8, 1.0), Roughness=0.7)
    if kind == "hair":
        obj = hair_scenes.add_fur(scene, surface)
    else:
        obj = build.add_sphere(scene, surface, radius=0.6, segments=12)
        make_points_of(obj)
    drift(obj.data)
    result = compare_with_cycles(scene)
    assert result.agrees, result
