"""Files whose scene-linear colours are not of Rec. 709 (from Blender 5.0 on) against Cycles; method as in
test_against_cycles_lights."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import pytest
from test_against_cycles_textures import byte_image

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(not hasattr(bpy.data, "colorspace"), reason="files may choose from Blender 5.0 on"),
]

FITS = 0.02
"""As far the fits of spectra are from Cycles' in any space; a colour of another space is 0.1 off and more."""

Make = Callable[[bpy.types.ShaderNodeTree], bpy.types.NodeSocket]


def stored(tree: bpy.types.ShaderNodeTree) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = byte_image()
    return node.outputs["Color"]


def along(kind: str, low: float, high: float) -> Make:
    """The colours that a node gives numbers, from left to right."""

    def make(tree: bpy.types.ShaderNodeTree) -> bpy.types.NodeSocket:
        uv = tree.nodes.new("ShaderNodeTexCoord").outputs["UV"]
        place = build.shader(tree, "ShaderNodeSeparateXYZ", Vector=uv).outputs[0]
        number = build.shader(tree, "ShaderNodeMapRange", Value=place, To_Min=low, To_Max=high).outputs[0]
        node = tree.nodes.new(kind)
        tree.links.new(number, node.inputs[0])
        return node.outputs[0]

    return make


def grey(tree: bpy.types.ShaderNodeTree) -> bpy.types.NodeSocket:
    return build.shader(tree, "ShaderNodeRGBToBW", Color=stored(tree)).outputs[0]


CASES = {
    "image": stored,
    "grey": grey,
    "blackbody": along("ShaderNodeBlackbody", 1500.0, 9000.0),
    "wavelength": along("ShaderNodeWavelength", 380.0, 730.0),
}


@pytest.mark.parametrize("space", ["ACEScg", "Linear Rec.2020"])
@pytest.mark.parametrize("case", CASES)
def test_colours_that_are_not_of_the_working_space(empty_scene: bpy.types.Scene, case: str, space: str) -> None:
    bpy.ops.wm.set_working_color_space(working_space=space, convert_colors=False)
    scene = bpy.context.scene
    surface = build.material(
        "card", lambda tree: build.shader(tree, "ShaderNodeEmission", Color=CASES[case](tree)).outputs[0]
    )
    build.add_floor(scene, surface, half=2.0)
    camera = build.add_camera(scene, (0, 0, 5), (0, 0, 0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 4.0
    result = compare_with_cycles(
        scene, (32, 32), samples=32, blocks=8, floor=0.0 if case in ("image", "grey") else FITS
    )
    assert result.agrees, result
