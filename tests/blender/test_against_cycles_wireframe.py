"""The Wireframe node against Cycles: shining lines on heads, in metres and in pixels, and as a height."""

import math

import bmesh
import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")


def wireframe(tree: bpy.types.NodeTree, size: float, is_in_pixels: bool) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeWireframe")
    node.use_pixel_size, node.inputs["Size"].default_value = is_in_pixels, size
    return node.outputs[0]


def lines(scene: bpy.types.Scene, size: float, is_in_pixels: bool) -> bpy.types.Scene:
    """Two heads, one of them scaled unevenly and mirrored, through a long lens: away from the middle of wide pictures
    Cycles' pixels are smaller."""
    glow = build.material(
        "lines",
        lambda tree: build.shader(tree, "ShaderNodeEmission", Color=wireframe(tree, size, is_in_pixels)).outputs[0],
    )
    for x, scale in ((-1.2, (1.0, 1.0, 1.0)), (1.2, (-1.0, 0.5, 1.4))):
        shape = bmesh.new()
        bmesh.ops.create_monkey(shape)
        head = bpy.data.objects.new("head", bpy.data.meshes.new("head"))
        shape.to_mesh(head.data)
        shape.free()
        head.location, head.scale = (x, 0.0, 0.0), scale
        head.data.materials.append(glow)
        scene.collection.objects.link(head)
    build.add_camera(scene, (0.0, -60.0, 15.0), (math.radians(76), 0.0, 0.0), lens=600.0)
    return scene


@pytest.mark.parametrize(("size", "is_in_pixels"), [(0.05, False), (0.4, False), (1.5, True), (4.0, True)])
def test_lines_are_as_wide(empty_scene, size, is_in_pixels):
    assert compare_with_cycles(lines(empty_scene, size, is_in_pixels)).agrees


@pytest.mark.parametrize(("size", "is_in_pixels"), [(0.05, False), (1.5, True)])
def test_lines_a_tenth_too_wide_are_seen(empty_scene, size, is_in_pixels):
    """Planted: in the picture of Cycles."""

    def widen(scene: bpy.types.Scene) -> None:
        node = next(node for node in bpy.data.materials["lines"].node_tree.nodes if node.type == "WIREFRAME")
        node.inputs["Size"].default_value *= 1.1

    assert not compare_with_cycles(lines(empty_scene, size, is_in_pixels), plant=widen).agrees
