"""The Scene Time node, which shaders have from Blender 5.2 on, against Cycles."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(bpy.app.version < (5, 2, 0), reason="shaders have Scene Time from Blender 5.2 on"),
]


def shine(scene: bpy.types.Scene, output: str) -> None:
    def surface(tree: build.Nodes) -> bpy.types.NodeSocket:
        time = tree.nodes.new("GeometryNodeInputSceneTime").outputs[output]
        return build.shader(tree, "ShaderNodeEmission", Strength=time).outputs[0]

    build.stage(scene, build.material("ball", surface))
    scene.render.fps, scene.render.fps_base = 30, 1.001


@pytest.mark.parametrize("output", ["Seconds", "Frame"])
def test_time_is_the_same(empty_scene: bpy.types.Scene, output: str) -> None:
    shine(empty_scene, output)
    for frame, subframe in ((12, 0.0), (40, 0.5)):
        empty_scene.frame_set(frame, subframe=subframe)
        result = compare_with_cycles(empty_scene)
        assert result.agrees, result


def test_another_frame_is_seen(empty_scene: bpy.types.Scene) -> None:
    """Planted bug: a frame later."""
    shine(empty_scene, "Frame")
    empty_scene.frame_set(12)
    result = compare_with_cycles(empty_scene, plant=lambda scene: scene.frame_set(13))
    assert not result.agrees, result
