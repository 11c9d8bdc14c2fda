"""Displacement as bump, Blender's own choice for new materials, against Cycles; method as in
test_against_cycles_lights."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(
        bpy.app.version < (4, 5, 0), reason="Cycles 4.2 corrects perturbed normals in another way: 1.5 % darker"
    ),
]

Nodes = bpy.types.ShaderNodeTree


def vector_math(tree: Nodes, operation: str, a: object, b: object) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    for socket, value in zip(node.inputs, (a, b), strict=False):
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node.outputs[0]


def waves(tree: Nodes) -> bpy.types.Node:
    coordinates = tree.nodes.new("ShaderNodeTexCoord").outputs["Object"]
    return build.shader(tree, "ShaderNodeTexNoise", Vector=coordinates, Scale=2.5, Detail=0.0)


def along_normal(space: str, scale: float = 0.15) -> Callable[[Nodes], bpy.types.NodeSocket]:
    def make(tree: Nodes) -> bpy.types.NodeSocket:
        node = build.shader(tree, "ShaderNodeDisplacement", Height=waves(tree).outputs[0], Midlevel=0.3, Scale=scale)
        node.space = space
        return node.outputs[0]

    return make


def along_vector(space: str) -> Callable[[Nodes], bpy.types.NodeSocket]:
    def make(tree: Nodes) -> bpy.types.NodeSocket:
        vector = waves(tree).outputs["Color"]
        node = build.shader(tree, "ShaderNodeVectorDisplacement", Vector=vector, Midlevel=0.4, Scale=0.2)
        node.space = space
        return node.outputs[0]

    return make


def diffuse(tree: Nodes) -> bpy.types.NodeSocket:
    return build.shader(tree, "ShaderNodeBsdfDiffuse", Color=(0.7, 0.6, 0.5, 1)).outputs[0]


def plastic(tree: Nodes) -> bpy.types.NodeSocket:
    return build.shader(tree, "ShaderNodeBsdfPrincipled", Roughness=0.4, Coat_Weight=0.5).outputs[0]


def normal_mapped(tree: Nodes) -> bpy.types.NodeSocket:
    """A normal map on top takes the place of the displaced normal, and its shadowing is measured from that."""
    node = build.shader(tree, "ShaderNodeNormalMap", Color=(0.7, 0.45, 0.9, 1))
    return build.shader(tree, "ShaderNodeBsdfPrincipled", Roughness=0.4, Normal=node.outputs[0]).outputs[0]


def normal_mapped_in_object_space(tree: Nodes) -> bpy.types.NodeSocket:
    """Half as strong: half of it is the displaced normal."""
    node = build.shader(tree, "ShaderNodeNormalMap", Color=(0.7, 0.3, 0.8, 1), Strength=0.5)
    node.space = "OBJECT"
    return build.shader(tree, "ShaderNodeBsdfDiffuse", Normal=node.outputs[0]).outputs[0]


def normal_mapped_without_uv(tree: Nodes) -> bpy.types.NodeSocket:
    """A normal map without coordinates is the displaced normal."""
    node = build.shader(tree, "ShaderNodeNormalMap", Color=(0.7, 0.45, 0.9, 1))
    node.uv_map = "Missing"
    return build.shader(tree, "ShaderNodeBsdfDiffuse", Normal=node.outputs[0]).outputs[0]


def straightened(tree: Nodes) -> bpy.types.NodeSocket:
    """The surface's own normal undoes the bump, but not its shadowing."""
    normal = tree.nodes.new("ShaderNodeNewGeometry").outputs["True Normal"]
    return build.shader(tree, "ShaderNodeBsdfDiffuse", Normal=normal).outputs[0]


def boxed(tree: Nodes) -> bpy.types.NodeSocket:
    """The sides of a box projection are blended by the displaced normal."""
    image = tree.nodes.new("ShaderNodeTexImage")
    image.image = build.gradient_image()
    image.projection, image.projection_blend = "BOX", 0.5
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], image.inputs["Vector"])
    return build.shader(tree, "ShaderNodeBsdfDiffuse", Color=image.outputs["Color"]).outputs[0]


def mirrored(tree: Nodes) -> bpy.types.NodeSocket:
    """Shows what nodes read of the normal."""
    coordinates = tree.nodes.new("ShaderNodeTexCoord").outputs
    facing = tree.nodes.new("ShaderNodeLayerWeight").outputs["Facing"]
    total = facing
    for direction in (coordinates["Normal"], coordinates["Reflection"]):
        total = vector_math(tree, "ADD", total, direction)
    bright = vector_math(tree, "ADD", total, (2.0, 2.0, 2.0))  # no colour below 0
    return build.shader(tree, "ShaderNodeEmission", Color=bright, Strength=0.3).outputs[0]


CASES = {
    "object": (along_normal("OBJECT"), diffuse),
    "world": (along_normal("WORLD"), plastic),
    "normal map": (along_normal("WORLD"), normal_mapped),
    "normal map in object space": (along_normal("WORLD"), normal_mapped_in_object_space),
    "normal map without UVs": (along_normal("WORLD"), normal_mapped_without_uv),
    "true normal": (along_normal("WORLD", scale=0.4), straightened),
    "box projection": (along_normal("WORLD", scale=0.4), boxed),
    "nodes that read the normal": (along_normal("OBJECT"), mirrored),
    "a colour": (lambda tree: vector_math(tree, "MULTIPLY", waves(tree).outputs["Color"], (0.2,) * 3), diffuse),
    "vector in tangent space": (along_vector("TANGENT"), diffuse),
    "vector in object space": (along_vector("OBJECT"), diffuse),
    "vector in world space": (along_vector("WORLD"), diffuse),
}


def displaced_card(scene: bpy.types.Scene, displacement: Callable, surface: Callable) -> bpy.types.Object:
    """A tilted and unevenly scaled card, lit from the side."""
    material = build.material("card", surface)
    tree = material.node_tree
    output = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(displacement(tree), output.inputs["Displacement"])
    build.stage(scene, build.principled())
    bpy.data.objects.remove(scene.objects["sphere"])
    card = build.add_floor(scene, material, half=0.9)
    card.data.uv_layers.new(name="UVMap")
    card.location, card.rotation_euler, card.scale = (0.0, 0.0, 1.0), (0.5, 0.3, 0.2), (1.0, 0.6, 1.4)
    return card


@pytest.mark.parametrize("case", CASES)
def test_displacement(empty_scene: bpy.types.Scene, case: str) -> None:
    displaced_card(empty_scene, *CASES[case])
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def unscaled_distance(scene: bpy.types.Scene) -> None:
    for material in bpy.data.materials:
        for node in material.node_tree.nodes:
            if node.bl_idname == "ShaderNodeDisplacement":
                node.space = "WORLD"


def steeper(scene: bpy.types.Scene) -> None:
    for material in bpy.data.materials:
        for node in material.node_tree.nodes:
            if node.bl_idname == "ShaderNodeDisplacement":
                node.inputs["Scale"].default_value *= 1.1


@pytest.mark.parametrize("plant", [unscaled_distance, steeper])
def test_planted_bugs(empty_scene: bpy.types.Scene, plant: Callable) -> None:
    """Cycles' displacement is in world space, or a tenth stronger."""
    displaced_card(empty_scene, *CASES["object"])
    assert not compare_with_cycles(empty_scene, plant=plant).agrees
