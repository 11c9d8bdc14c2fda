"""The Raycast node, which Blender has from 5.2 on, against Cycles: what it returns as what shines."""

from collections.abc import Callable

import bpy
import pytest
from test_against_cycles_ray_nodes import Fill, glow, shapes, shown_normal

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(bpy.app.version < (5, 2, 0), reason="the Raycast node came with Blender 5.2"),
]


def raycast(output: str, is_local: bool = False, **inputs: object) -> Fill:
    def fill(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        node = build.shader(tree, "ShaderNodeRaycast", **{k: v(tree) if callable(v) else v for k, v in inputs.items()})
        node.only_local = is_local
        return node.outputs[output]

    return fill


def geometry(output: str) -> Callable[[bpy.types.NodeTree], bpy.types.NodeSocket]:
    return lambda tree: build.shader(tree, "ShaderNodeNewGeometry").outputs[output]


def fixed(*xyz: float) -> Callable[[bpy.types.NodeTree], bpy.types.NodeSocket]:
    def fill(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        node = tree.nodes.new("ShaderNodeCombineXYZ")
        for socket, value in zip(node.inputs, xyz, strict=True):
            socket.default_value = value
        return node.outputs[0]

    return fill


ALONG_NORMAL = dict(Position=geometry("Position"), Direction=geometry("Normal"))
CASES = {
    "hit": raycast("Is Hit", Length=2.0, **ALONG_NORMAL),
    "self": raycast("Self Hit", Length=2.0, **ALONG_NORMAL),
    "distance": raycast("Hit Distance", Length=0.8, **ALONG_NORMAL),
    "local distance": raycast("Hit Distance", is_local=True, Length=0.8, **ALONG_NORMAL),
    "position": shown_normal(raycast("Hit Position", Length=1.5, **ALONG_NORMAL)),
    "normal": shown_normal(raycast("Hit Normal", Length=1.5, **ALONG_NORMAL)),
    "aslant, not of length 1": raycast("Hit Distance", Length=1.0, Direction=fixed(0.6, -0.4, 1.2)),
    "unlinked": raycast("Hit Distance", Length=1.0),
    "unlinked direction": raycast("Hit Distance", Length=3.0, Position=fixed(0.3, 0.4, -2.0)),
    "from one place": shown_normal(
        raycast("Hit Normal", Length=9.0, Position=fixed(0, 0, 3), Direction=fixed(0, 0, -1))
    ),
    "reflections": raycast("Hit Distance", Length=1.0, Direction=geometry("Incoming")),
}


@pytest.mark.parametrize("case", CASES)
def test_it_returns_the_same(empty_scene: bpy.types.Scene, case: str) -> None:
    result = compare_with_cycles(shapes(empty_scene, glow("cast", CASES[case])))
    assert result.agrees, result


def test_bumps_of_distances(empty_scene: bpy.types.Scene) -> None:
    """Rays that start beside the point do not meet the surface they start on."""

    def surface(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        inside = build.shader(tree, "ShaderNodeVectorMath", Vector=geometry("Normal")(tree))
        inside.operation = "SCALE"
        inside.inputs["Scale"].default_value = -1.0
        ray = dict(Position=geometry("Position"), Direction=lambda tree: inside.outputs[0])
        bump = build.shader(tree, "ShaderNodeBump", Height=raycast("Hit Distance", Length=1.0, **ray)(tree))
        return build.shader(tree, "ShaderNodeBsdfDiffuse", Normal=bump.outputs[0]).outputs[0]

    build.stage(empty_scene, build.material("ball", surface))
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def test_other_lengths_are_seen(empty_scene: bpy.types.Scene) -> None:
    """Planted bug: a length that is 5 % too large."""

    def plant(scene: bpy.types.Scene) -> None:
        node = next(n for n in bpy.data.materials["cast"].node_tree.nodes if n.bl_idname == "ShaderNodeRaycast")
        node.inputs["Length"].default_value *= 1.05

    result = compare_with_cycles(shapes(empty_scene, glow("cast", CASES["distance"])), plant=plant)
    assert not result.agrees, result
