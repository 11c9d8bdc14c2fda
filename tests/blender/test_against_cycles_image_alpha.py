"""What an image's alpha does to its colours, by Alpha Mode: a card that shows one texel, with and without Alpha as its
opacity. A wrong mode is off by a factor of 1.5 at least; Cycles rounds what it multiplies to bytes, by a twentieth."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.sync import versions
from tests.support import blender_scenes as build
from tests.support.engines import prepare, render

pytestmark = pytest.mark.usefixtures("registered_addon")

TEXEL = np.array([0.6, 0.5, 0.4, 0.25])
CASES = [
    (suffix, mode, is_packed)
    for suffix in (".png", ".exr", ".bmp")
    for mode in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")
    for is_packed in (False, True)
]


def image_of(path: Path, mode: str, is_packed: bool) -> bpy.types.Image:
    oiio = versions.image_reader()
    is_half = path.suffix == ".exr"
    spec = oiio.ImageSpec(4, 4, 4, oiio.HALF if is_half else oiio.UINT8)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    texel = TEXEL.astype(np.float16) if is_half else np.rint(255 * TEXEL).astype(np.uint8)
    output.write_image(np.tile(texel, (4, 4, 1)))
    output.close()
    image = bpy.data.images.load(str(path))
    image.alpha_mode = mode
    if is_packed:
        image.pack()
    return image


def card(scene: bpy.types.Scene, image: bpy.types.Image) -> None:
    """Its left half shows the colours, its right half lets them through by alpha."""

    def make(tree: bpy.types.ShaderNodeTree) -> bpy.types.NodeSocket:
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        place = tree.nodes.new("ShaderNodeTexCoord").outputs["Window"]
        x = build.shader(tree, "ShaderNodeSeparateXYZ", Vector=place).outputs["X"]
        half = build.shader(tree, "ShaderNodeMath", Value=x)
        half.operation = "LESS_THAN"
        opacity = build.shader(tree, "ShaderNodeMath", Value=half.outputs[0])
        opacity.operation = "MAXIMUM"
        tree.links.new(texture.outputs["Alpha"], opacity.inputs[1])
        mix = tree.nodes.new("ShaderNodeMixShader")
        glow = build.shader(tree, "ShaderNodeEmission", Color=texture.outputs["Color"])
        for index, source in enumerate((opacity, tree.nodes.new("ShaderNodeBsdfTransparent"), glow)):
            tree.links.new(source.outputs[0], mix.inputs[index])
        return mix.outputs[0]

    corners = [(-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0)]
    build.add_mesh(scene, "card", corners, [(0, 1, 2, 3)], build.material("shown", make))
    build.set_world(scene, (0, 0, 0), strength=0.0)
    build.add_camera(scene, (0, 0, 3), (0, 0, 0))
    prepare(scene, 4, 2)


@pytest.mark.parametrize(("suffix", "mode", "is_packed"), CASES)
def test_alpha_modes(empty_scene: bpy.types.Scene, tmp_path: Path, suffix: str, mode: str, is_packed: bool) -> None:
    card(empty_scene, image_of(tmp_path / f"texel{suffix}", mode, is_packed))
    ours, theirs = (render(empty_scene, engine, 4, 1)[..., :3] for engine in ("CISTERN", "CYCLES"))
    np.testing.assert_allclose(ours, theirs, rtol=0.08, atol=1e-4)
