"""Links that lead to nothing, through reroutes and muted nodes: before Blender 5.0 what they reach reads 0."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")

# By name: a node, muted unless it is a reroute, the output that is linked, and the input behind it.
CASES = {
    "reroute": ("NodeReroute", 0, "Base Color"),
    "reroute of a number": ("NodeReroute", 0, "Roughness"),
    "reroute to a normal": ("NodeReroute", 0, "Normal"),
    "invert": ("ShaderNodeInvert", 0, "Base Color"),
    "math": ("ShaderNodeMath", 0, "Base Color"),
    "gamma to a number": ("ShaderNodeGamma", 0, "Roughness"),
    "bump": ("ShaderNodeBump", 0, "Normal"),
    "noise, which nothing passes": ("ShaderNodeTexNoise", 1, "Base Color"),
    "a colour": ("ShaderNodeRGB", 0, "Base Color"),
}


def shown_behind(scene: bpy.types.Scene, case: str) -> bpy.types.Node:
    kind, output, target = CASES[case]
    surface = build.principled("behind", Base_Color=(0.8, 0.3, 0.2, 1.0), Roughness=0.4)
    tree = surface.node_tree
    node = tree.nodes.new(kind)
    node.mute = kind != "NodeReroute"
    principled = next(other for other in tree.nodes if other.type == "BSDF_PRINCIPLED")
    tree.links.new(principled.inputs[target], node.outputs[output])
    build.stage(scene, surface)
    return principled


@pytest.mark.parametrize("case", CASES)
def test_dead_links(empty_scene: bpy.types.Scene, case: str) -> None:
    shown_behind(empty_scene, case)
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def test_another_value_is_seen(empty_scene: bpy.types.Scene) -> None:
    principled = shown_behind(empty_scene, "a colour")

    def plant(_scene: bpy.types.Scene) -> None:
        principled.inputs["Base Color"].default_value = (0.7, 0.3, 0.2, 1.0)

    result = compare_with_cycles(empty_scene, plant=plant)
    assert not result.agrees, result
