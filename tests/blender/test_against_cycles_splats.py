"""Gaussian splats against Cycles: their shapes, what they send, what they cover and what scatters at them."""

import bpy
import numpy as np
import pytest

from addon import report
from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles, prepare, render
from tests.support.splat_scenes import splat_cloud

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(bpy.app.version < (5, 3, 0), reason="Blender has Gaussian splats from 5.3 on"),
]


def by_radiance(kind: str) -> bpy.types.Material:
    """Of that shader, coloured by what splats send."""

    def nodes(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        read = tree.nodes.new("ShaderNodeAttribute")
        read.attribute_name = "radiance"
        if kind == "Transparent":
            shine = build.shader(tree, "ShaderNodeEmission", Color=read.outputs["Color"]).outputs[0]
            clear = build.shader(tree, "ShaderNodeBsdfTransparent", Color=(0.9, 0.7, 0.5, 1.0)).outputs[0]
            mix = tree.nodes.new("ShaderNodeMixShader")
            tree.links.new(shine, mix.inputs[1])
            tree.links.new(clear, mix.inputs[2])
            return mix.outputs[0]
        return build.shader(tree, kind, Color=read.outputs["Color"]).outputs[0]

    return build.material("splats", nodes)


def garden(scene: bpy.types.Scene, material: bpy.types.Material | None = None, count: int = 60) -> bpy.types.Object:
    """A cloud over a floor, in an object that is turned and unevenly scaled, under a lamp and the sky."""
    cloud = splat_cloud("garden", count)
    if material is not None:
        cloud.materials.append(material)
    placed = bpy.data.objects.new("garden", cloud)
    placed.location, placed.rotation_euler, placed.scale = (0.0, 0.0, 1.2), (0.3, 0.2, 0.4), (1.0, 0.8, 1.3)
    scene.collection.objects.link(placed)
    build.add_floor(scene)
    build.add_light(scene, "POINT", (1.0, -1.5, 3.0), energy=150.0, shadow_soft_size=0.2)
    build.set_world(scene)
    build.add_camera(scene, (0.0, -6.0, 3.0), (1.13, 0.0, 0.0))
    return placed


def widen(cloud: bpy.types.PointCloud, factor: float) -> None:
    attribute = cloud.attributes["scale"]
    scales = np.empty((len(attribute.data), 3), np.float32)
    attribute.data.foreach_get("vector", scales.ravel())
    attribute.data.foreach_set("vector", (factor * scales).ravel())
    cloud.update_tag()


def test_splats_shine_as_they_were_seen(empty_scene):
    garden(empty_scene)
    assert compare_with_cycles(empty_scene).agrees


@pytest.mark.parametrize("kind", ["ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlossy", "Transparent"])
def test_splats_with_a_material(empty_scene, kind):
    garden(empty_scene, by_radiance(kind))
    assert compare_with_cycles(empty_scene).agrees


@pytest.mark.parametrize("kind", ["", "ShaderNodeBsdfDiffuse"])
def test_splats_that_share_their_paths(empty_scene, kind):
    garden(empty_scene, by_radiance(kind) if kind else None)
    assert compare_with_cycles(empty_scene, preset="FINAL").agrees


@pytest.mark.parametrize("output", ["Position", "Radius", "Random"])
def test_what_materials_read(empty_scene, output):
    def nodes(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        value = tree.nodes.new("ShaderNodePointInfo").outputs[output]
        return build.shader(tree, "ShaderNodeEmission", Color=value).outputs[0]

    garden(empty_scene, build.material("info", nodes))
    assert compare_with_cycles(empty_scene).agrees


@pytest.mark.parametrize("left_out", ["rotation", "radiance:base", "radiance:sh_4", "scale"])
def test_attributes_that_are_not_there(empty_scene, left_out):
    cloud = garden(empty_scene).data
    cloud.attributes.remove(cloud.attributes[left_out])
    assert compare_with_cycles(empty_scene).agrees


def test_opacities_beyond_one(empty_scene):
    cloud = garden(empty_scene, count=8).data
    base = np.empty((8, 4), np.float32)
    cloud.attributes["radiance:base"].data.foreach_get("vector", base.ravel())
    base[:, 3] = np.linspace(0.0, 2.5, 8)
    cloud.attributes["radiance:base"].data.foreach_set("vector", base.ravel())
    assert compare_with_cycles(empty_scene).agrees


def test_wide_splats(empty_scene):
    """Without what rays in them could end at, see the table in addon/README.md."""
    widen(garden(empty_scene, count=8).data, 4.0)
    bpy.data.objects.remove(next(o for o in empty_scene.objects if o.name == "floor"))
    assert compare_with_cycles(empty_scene).agrees


def test_splats_that_are_a_tenth_wider_are_seen(empty_scene):
    """Planted: in the picture of Cycles."""
    cloud = garden(empty_scene).data
    assert not compare_with_cycles(empty_scene, plant=lambda _: widen(cloud, 1.1)).agrees


def test_what_is_no_number_is_named_and_left_out(empty_scene):
    cloud = garden(empty_scene).data
    rotation = np.empty((len(cloud.points), 4), np.float32)
    cloud.attributes["rotation"].data.foreach_get("value", rotation.ravel())
    rotation[:2] = 0.0
    rotation[2] = np.nan
    cloud.attributes["rotation"].data.foreach_set("value", rotation.ravel())
    prepare(empty_scene, 8, 8)
    render(empty_scene, "CISTERN", 1, 1)
    assert [text for line in report.last for text in line.warnings if "garden" in text] == [
        "Point cloud 'garden': 3 splats are left out, whose values are not finite, or whose scale or rotation is 0"
    ]
