"""Tiled images (UDIM) on the test sphere against Cycles; method as in test_against_cycles_lights."""

from pathlib import Path

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")

# The sphere's map covers [-0.4, 2.1] x [0.2, 2.2], so that what lies outside of all tiles is seen too.
TILES = (1001, 1002, 1003, 1011, 1012)
SCALE, LOCATION = (2.5, 2.0, 1.0), (-0.4, 0.2, 0.0)


def udim_image(folder: Path) -> bpy.types.Image:
    """Tile 1011 has no file."""
    for number in set(TILES) - {1011}:
        build.save_tile(str(folder / f"t.{number}.png"), number)
    return build.tiled_image(str(folder / "t.<UDIM>.png"), TILES)


def uvtile_image(folder: Path) -> bpy.types.Image:
    for number in TILES:
        column, row = (number - 1001) % 10, (number - 1001) // 10
        build.save_tile(str(folder / f"t_u{column + 1}_v{row + 1}.png"), number)
    return build.tiled_image(str(folder / "t_<UVTILE>.png"), TILES)


def packed_image(folder: Path) -> bpy.types.Image:
    image = uvtile_image(folder)
    image.pack()
    for file in folder.glob("t_*.png"):
        file.unlink()
    return image


def shaded(image: bpy.types.Image, use: str, **members):
    """A surface that uses the image as its colour, its emission, its alpha or its bumps."""

    def make(tree):
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        for name, value in members.items():
            setattr(node, name, value)
        vector = tree.nodes.new("ShaderNodeTexCoord").outputs["UV"]
        mapped = build.shader(tree, "ShaderNodeMapping", Vector=vector, Scale=SCALE, Location=LOCATION).outputs[0]
        tree.links.new(mapped, node.inputs["Vector"])
        if use == "Emission":
            return build.shader(tree, "ShaderNodeEmission", Color=node.outputs["Color"], Strength=0.3).outputs[0]
        if use == "Bump":
            bump = build.shader(tree, "ShaderNodeBump", Height=node.outputs["Color"], Strength=0.5, Distance=0.05)
            return build.shader(tree, "ShaderNodeBsdfDiffuse", Normal=bump.outputs[0]).outputs[0]
        inputs = {"Base_Color": node.outputs["Color"], "Roughness": 0.7}
        inputs |= {"Alpha": node.outputs["Alpha"]} if use == "Alpha" else {}
        return build.shader(tree, "ShaderNodeBsdfPrincipled", **inputs).outputs[0]

    return make


CASES = {
    "colour": (udim_image, "Color", {}),
    "alpha": (udim_image, "Alpha", {"interpolation": "Cubic"}),
    "packed": (packed_image, "Alpha", {"extension": "EXTEND"}),
    "emission": (uvtile_image, "Emission", {"extension": "CLIP", "interpolation": "Closest"}),
    "bump": (uvtile_image, "Bump", {}),
    "box": (udim_image, "Color", {"projection": "BOX"}),
}


@pytest.mark.parametrize("case", CASES)
def test_tiles(empty_scene: bpy.types.Scene, tmp_path: Path, case: str) -> None:
    if case == "bump" and bpy.app.version < (4, 5, 0):
        pytest.skip("Cycles 4.2 corrects perturbed normals in another way: 0.9 % of the mean")
    make_image, use, members = CASES[case]
    build.stage(empty_scene, build.material("ball", shaded(make_image(tmp_path), use, **members)))
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def test_planted_bug(empty_scene: bpy.types.Scene, tmp_path: Path) -> None:
    """Two of Cycles' tiles are swapped."""
    build.stage(empty_scene, build.material("ball", shaded(uvtile_image(tmp_path), "Color")))

    def swap(scene: bpy.types.Scene) -> None:
        build.save_tile(str(tmp_path / "t_u1_v1.png"), 1002)
        build.save_tile(str(tmp_path / "t_u2_v1.png"), 1001)

    assert not compare_with_cycles(empty_scene, plant=swap).agrees
