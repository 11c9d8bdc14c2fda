"""Images and node trees that no scene should have, through Blender to the picture: a message that names the
data-block, or correct output; never a crash, never a black frame without a word. Needs `cistern_core`.
"""

import math
from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.blender.bad_input import HEIGHT, WIDTH, Change, picture_of, surface, tree
from tests.blender.engine_fakes import fresh_scene

pytestmark = pytest.mark.usefixtures("registered_addon", "built_core")


def show(image: bpy.types.Image | None) -> None:
    """As the colour of the cube, glowing: its own colour reaches the picture."""
    node = tree().nodes.new("ShaderNodeTexImage")
    node.image = image
    surface().inputs["Emission Strength"].default_value = 1.0
    for name in ("Base Color", "Emission Color"):
        tree().links.new(node.outputs["Color"], surface().inputs[name])


def image_file(path: Path, source: str = "FILE") -> bpy.types.Image:
    image = bpy.data.images.new("Wanted", 4, 4)
    image.source, image.filepath = source, str(path)
    return image


def broken_file(folder: Path, content: bytes) -> Path:
    path = folder / "broken.png"
    path.write_bytes(content)
    return path


BROKEN_IMAGES = {
    "missing": lambda folder: image_file(folder / "nowhere.png"),
    "empty file": lambda folder: image_file(broken_file(folder, b"")),
    "no image": lambda folder: image_file(broken_file(folder, b"this is not a picture")),
    "a folder": lambda folder: image_file(folder),
    "missing sequence": lambda folder: image_file(folder / "nowhere001.png", "SEQUENCE"),
    "missing movie": lambda folder: image_file(folder / "nowhere.mp4", "MOVIE"),
}


@pytest.mark.parametrize("name", BROKEN_IMAGES)
def test_an_unreadable_image_is_magenta_and_named(name, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    show(BROKEN_IMAGES[name](tmp_path))
    pixels, report = picture_of(scene, tmp_path)
    assert any("'Wanted'" in warning and "magenta" in warning for warning in report.warnings), report.warnings
    red, green, blue = pixels[HEIGHT // 2, WIDTH // 2]
    assert red > 0.9 and blue > 0.9 and green < 0.2


def test_a_missing_sky_is_magenta_and_named(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    nodes = scene.world.node_tree.nodes
    node = nodes.new("ShaderNodeTexEnvironment")
    node.image = image_file(tmp_path / "nowhere.hdr")
    background = next(n for n in nodes if n.type == "BACKGROUND")
    scene.world.node_tree.links.new(node.outputs[0], background.inputs[0])
    pixels, report = picture_of(scene, tmp_path)
    assert any("'Wanted'" in warning for warning in report.warnings)
    assert pixels[0, 0, 0] > 0.9 and pixels[0, 0, 1] < 0.1


@pytest.mark.parametrize("value", [math.nan, math.inf, -5.0])
def test_a_bad_pixel_in_the_sky_spoils_no_other(value, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    image = bpy.data.images.new("sky", 16, 8, float_buffer=True)
    pixels = np.ones((8, 16, 4), np.float32)
    pixels[6, 3, :3] = value
    image.pixels.foreach_set(pixels.ravel())
    nodes = scene.world.node_tree.nodes
    node = nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    background = next(n for n in nodes if n.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 1.0
    scene.world.node_tree.links.new(node.outputs[0], background.inputs[0])
    rendered, _ = picture_of(scene, tmp_path)
    assert rendered.mean() > 0.5


def test_an_image_of_no_size_is_magenta(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    picture_of(scene, tmp_path)
    image = bpy.data.images["Render Result"]
    show(image)
    assert tuple(image.size) == (0, 0)
    _, report = picture_of(scene, tmp_path)
    assert any("'Render Result'" in warning for warning in report.warnings)


def links_in_a_circle(kind: str) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        first, second = tree().nodes.new(kind), tree().nodes.new(kind)
        tree().links.new(first.outputs[0], second.inputs[0])
        tree().links.new(second.outputs[0], first.inputs[0])
        tree().links.new(second.outputs[0], surface().inputs["Roughness"])

    return change


@pytest.mark.parametrize("kind", ["ShaderNodeMath", "NodeReroute", "ShaderNodeMix"])
def test_links_in_a_circle(kind, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    links_in_a_circle(kind)(scene)
    assert picture_of(scene, tmp_path)[0].max() > 0.0


def test_a_group_in_itself(tmp_path) -> None:
    """Blender refuses the assignment, which leaves a group without a tree inside; that one must be harmless."""
    scene = fresh_scene(WIDTH, HEIGHT)
    outer = bpy.data.node_groups.new("Outer", "ShaderNodeTree")
    outer.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    inner = outer.nodes.new("ShaderNodeGroup")
    inner.node_tree = outer
    output = outer.nodes.new("NodeGroupOutput")
    if inner.outputs:
        outer.links.new(inner.outputs[0], output.inputs[0])
    group = tree().nodes.new("ShaderNodeGroup")
    group.node_tree = outer
    tree().links.new(group.outputs[0], surface().inputs["Base Color"])
    assert picture_of(scene, tmp_path)[0].max() > 0.0


def test_three_hundred_values_that_wait_for_each_other(tmp_path) -> None:
    """Too many for the core's registers: said, and grey."""
    scene = fresh_scene(WIDTH, HEIGHT)
    value = tree().nodes.new("ShaderNodeTexNoise").outputs[0]
    for number in range(300):
        node, waiting = tree().nodes.new("ShaderNodeMath"), tree().nodes.new("ShaderNodeTexNoise")
        waiting.inputs["Scale"].default_value = number
        tree().links.new(waiting.outputs[0], node.inputs[0])
        tree().links.new(value, node.inputs[1])
        value = node.outputs[0]
    tree().links.new(value, surface().inputs["Roughness"])
    pixels, report = picture_of(scene, tmp_path)
    assert any("Material 'Material'" in warning for warning in report.warnings) and pixels.max() > 0.0


def mix_glossy_shaders(count: int) -> None:
    value = surface().outputs[0]
    for index in range(count):
        mix, glossy = tree().nodes.new("ShaderNodeMixShader"), tree().nodes.new("ShaderNodeBsdfGlossy")
        glossy.inputs["Roughness"].default_value = index / count
        tree().links.new(value, mix.inputs[1])
        tree().links.new(glossy.outputs[0], mix.inputs[2])
        value = mix.outputs[0]
    output = next(node for node in tree().nodes if node.type == "OUTPUT_MATERIAL")
    tree().links.new(value, output.inputs["Surface"])


@pytest.mark.parametrize(("count", "is_named"), [(40, False), (70, True)])
def test_many_closures(count, is_named, tmp_path) -> None:
    """More lobes than the core holds: said."""
    scene = fresh_scene(WIDTH, HEIGHT)
    mix_glossy_shaders(count)
    pixels, report = picture_of(scene, tmp_path)
    assert pixels.max() > 0.0
    assert any("'Material'" in warning and "lobes" in warning for warning in report.warnings) == is_named


def test_unsupported_nodes_are_named(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    node = tree().nodes.new("ShaderNodeUVAlongStroke")
    tree().links.new(node.outputs[0], surface().inputs["Roughness"])
    pixels, report = picture_of(scene, tmp_path)
    assert any("Material 'Material'" in w and node.bl_label in w for w in report.warnings)
    assert pixels.max() > 0.0
