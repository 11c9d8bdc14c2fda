"""Tangents of UV maps against Cycles, which has them at corners: normal maps and the Tangent node.

They are shown as light, so that there is no noise but that of edges."""

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")


def shown(what: str) -> bpy.types.Material:
    def make(tree: build.Nodes) -> bpy.types.NodeSocket:
        node = tree.nodes.new(what)
        if what == "ShaderNodeNormalMap":
            node.inputs["Color"].default_value = (0.75, 0.6, 0.85, 1.0)
        else:
            node.direction_type = "UV_MAP"
        scaled = tree.nodes.new("ShaderNodeVectorMath")
        scaled.operation = "MULTIPLY_ADD"
        scaled.inputs[1].default_value = scaled.inputs[2].default_value = (0.5, 0.5, 0.5)
        tree.links.new(node.outputs[0], scaled.inputs[0])
        return build.shader(tree, "ShaderNodeEmission", Color=scaled.outputs[0]).outputs[0]

    return build.material("shown", make)


def cube() -> None:
    bpy.ops.mesh.primitive_cube_add(size=1.6)


def ball() -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)


def head() -> None:
    bpy.ops.mesh.primitive_monkey_add(size=1.6)


def drum() -> None:
    """Its lids have seven corners."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=7, depth=1.4, radius=0.8)


def sheet() -> None:
    """Through the origin nearly: its middle point sees all others around itself."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4, size=2.0)
    for vertex, height in zip(
        bpy.context.object.data.vertices, np.random.default_rng(7).normal(0.0, 0.25, 25), strict=True
    ):
        vertex.co.z = height


def map_of(obj: bpy.types.Object, change: Callable[[np.ndarray], np.ndarray]) -> None:
    layer = obj.data.uv_layers[0]
    uv = np.empty((len(layer.data), 2), np.float32)
    layer.data.foreach_get("uv", uv.ravel())
    layer.data.foreach_set("uv", np.ascontiguousarray(change(uv), np.float32).ravel())


def mirrored(uv: np.ndarray) -> np.ndarray:
    """About a line through the middle, as symmetric models are mapped."""
    return np.stack([np.abs(uv[:, 0] - 0.5), uv[:, 1]], 1)


def as_it_is(uv: np.ndarray) -> np.ndarray:
    return uv


def half_missing(uv: np.ndarray) -> np.ndarray:
    return np.where(np.arange(len(uv))[:, None] < len(uv) // 2, 0.3, uv)


def random(uv: np.ndarray) -> np.ndarray:
    return np.random.default_rng(1).random(uv.shape)


def missing(uv: np.ndarray) -> np.ndarray:
    return np.zeros_like(uv)


CASES = {
    "cube": (cube, as_it_is),
    "ball": (ball, as_it_is),
    "head": (head, as_it_is),
    "drum": (drum, as_it_is),
    "mirrored map": (head, mirrored),
    "random map": (head, random),
    "map without area": (cube, missing),
    "map without area in half of the faces": (head, half_missing),
    "cube without a map": (cube, None),
    "head without a map": (head, None),
    "sheet without a map": (sheet, None),
}


@pytest.fixture
def place(empty_scene: bpy.types.Scene) -> Callable[[str, str], bpy.types.Object]:
    """Smooth, turned and stretched."""

    def place(case: str, what: str) -> bpy.types.Object:
        make, change = CASES[case]
        make()
        obj = bpy.context.object
        obj.data.shade_smooth()
        if change is None:
            obj.data.uv_layers.remove(obj.data.uv_layers[0])
        else:
            map_of(obj, change)
        obj.rotation_euler, obj.scale = (0.3, 0.4, 0.2), (1.0, 0.6, 0.8)
        obj.data.materials.append(shown(what))
        build.add_camera(empty_scene, (0.4, -4.0, 2.5), (1.0, 0.0, 0.0)).data.lens = 60.0
        return obj

    return place


@pytest.mark.parametrize("what", ["ShaderNodeNormalMap", "ShaderNodeTangent"])
@pytest.mark.parametrize("case", CASES)
def test_tangents_are_those_of_corners(empty_scene, place, case: str, what: str) -> None:
    if CASES[case][1] is None and bpy.app.version < (5, 0, 0):
        pytest.skip("Cycles had others then")
    place(case, what)
    result = compare_with_cycles(empty_scene, blocks=8)
    assert result.agrees, result


def test_sharp_edges_part_them(empty_scene, place) -> None:
    for edge in list(place("cube", "ShaderNodeNormalMap").data.edges)[:5]:
        edge.use_edge_sharp = True
    result = compare_with_cycles(empty_scene, blocks=8)
    assert result.agrees, result


@pytest.mark.parametrize("what", ["ShaderNodeNormalMap", "ShaderNodeTangent"])
def test_tangents_of_triangles_are_seen(empty_scene, place, what: str) -> None:
    """Planted: in Cycles each face is mapped by itself, a little apart from the others, and so has its own."""
    obj = place("cube", what)

    def plant(_: bpy.types.Scene) -> None:
        map_of(obj, lambda uv: uv + 0.01 * np.repeat(np.arange(len(uv) // 4), 4)[:, None])

    assert not compare_with_cycles(empty_scene, blocks=8, plant=plant).agrees
