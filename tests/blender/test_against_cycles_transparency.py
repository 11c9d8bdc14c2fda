"""Transparent surfaces on the way of camera, shadow and scattered rays, against Cycles."""

import bpy
import pytest

from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")


def material(node_type: str) -> bpy.types.Material:
    surface = bpy.data.materials.new(node_type)
    surface.use_nodes = True
    tree = surface.node_tree
    tree.nodes.clear()
    output, shader = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new(node_type)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return surface


def triangle(scene: bpy.types.Scene, height: float, surface: bpy.types.Material, scale: float = 1.0) -> None:
    """A triangle across the view, without an inner edge on which a ray could hit it twice."""
    mesh = bpy.data.meshes.new("triangle")
    corners = [(-9.0 * scale, -6.0 * scale, height), (9.0 * scale, -6.0 * scale, height), (0.0, 9.0 * scale, height)]
    mesh.from_pydata(corners, [], [(0, 1, 2)])
    mesh.materials.append(surface)
    scene.collection.objects.link(bpy.data.objects.new("triangle", mesh))


def build(scene: bpy.types.Scene, surface: bpy.types.Material, layers: int) -> bpy.types.Light:
    """A surface under transparent layers, seen from above, lit by a soft lamp above them all."""
    triangle(scene, 0.0, surface)
    clear = material("ShaderNodeBsdfTransparent")
    for layer in range(layers):
        triangle(scene, 0.05 * (layer + 1), clear)
    lamp = bpy.data.lights.new("lamp", "POINT")
    lamp.energy, lamp.shadow_soft_size = 10.0, 0.25
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0.0, 0.0, 3.0)
    lamp_object = bpy.data.objects.new("lamp", lamp)
    lamp_object.location = (0.3, 0.0, 0.6)
    lamp_object.visible_camera = False
    for item in (camera, lamp_object):
        scene.collection.objects.link(item)
    scene.camera = camera
    return lamp


@pytest.mark.parametrize("node_type", ["ShaderNodeBsdfDiffuse", "ShaderNodeEmission"])
@pytest.mark.parametrize("layers", [3, 4, 5, 8, 9, 10])
def test_limit_of_transparent_surfaces(empty_scene: bpy.types.Scene, node_type: str, layers: int) -> None:
    """Eight are passed: by the camera's and the shadow ray together, and what follows them shows its emission only."""
    if layers == 9 and node_type == "ShaderNodeEmission" and bpy.app.version < (5, 0, 0):
        pytest.skip("Cycles before 5.0 shows emission behind one transparent surface more")
    build(empty_scene, material(node_type), layers)
    result = compare_with_cycles(empty_scene, size=(16, 16), samples=32, blocks=2)
    assert result.agrees, result


def test_soft_lamp_seen_through_a_transparent_surface(empty_scene: bpy.types.Scene) -> None:
    """A rough mirror finds the lamp by scattered rays too, whose weights must match those of light samples."""
    metal = material("ShaderNodeBsdfAnisotropic")
    metal.node_tree.nodes[1].inputs["Roughness"].default_value = 0.4
    build(empty_scene, metal, layers=2)
    result = compare_with_cycles(empty_scene, size=(32, 32), samples=64, blocks=2)
    assert result.agrees, result


def half_transparent() -> bpy.types.Material:
    glassy = material("ShaderNodeBsdfPrincipled")
    glassy.node_tree.nodes[1].inputs["Alpha"].default_value = 0.3
    return glassy


def under_opaque_shadows(scene: bpy.types.Scene, radius: float) -> bpy.types.Material:
    """A lamp and a grey world over a floor, a part of it below a half transparent sheet, whose material is returned."""
    build(scene, material("ShaderNodeBsdfDiffuse"), layers=0).shadow_soft_size = radius
    sheet = half_transparent()
    triangle(scene, 0.2, sheet, scale=0.06)
    scene.world = bpy.data.worlds.new("world")
    scene.world.color = (0.3, 0.3, 0.3)
    sheet.use_transparent_shadow = False
    return sheet


@pytest.mark.parametrize("radius", [0.0, 0.25])
@pytest.mark.parametrize("preset", ["PATH_TRACING", "FINAL"])
def test_transparent_shadows_off(empty_scene: bpy.types.Scene, preset: str, radius: float) -> None:
    under_opaque_shadows(empty_scene, radius)
    result = compare_with_cycles(empty_scene, samples=64, preset=preset)
    assert result.agrees, result


def test_planted_transparent_shadows(empty_scene: bpy.types.Scene) -> None:
    sheet = under_opaque_shadows(empty_scene, 0.0)
    result = compare_with_cycles(
        empty_scene, samples=64, plant=lambda scene: setattr(sheet, "use_transparent_shadow", True)
    )
    assert not result.agrees


def test_planted_bug(empty_scene: bpy.types.Scene) -> None:
    """Cycles' limit is two lower: one would not be seen before 5.0."""

    def plant(scene: bpy.types.Scene) -> None:
        scene.cycles.transparent_max_bounces -= 2

    build(empty_scene, material("ShaderNodeEmission"), layers=8)
    assert not compare_with_cycles(empty_scene, size=(16, 16), samples=32, blocks=2, plant=plant).agrees
