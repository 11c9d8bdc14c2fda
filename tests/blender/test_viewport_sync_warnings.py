"""What a viewport warns of: all that is so in the scene as it is, whatever was edited last, and nothing that was."""

from collections.abc import Callable

import bpy
import pytest
from watched_scene import base_color

WRONG = "no such picture.png"


def toggle_lamp() -> None:
    lamp = bpy.data.lights["AREA Lamp"]
    lamp.size = 0.0 if lamp.size else 1.0


def toggle_caustics() -> None:
    lamp = bpy.data.lights["SUN Lamp"]
    lamp.cycles.is_caustics_light = not lamp.cycles.is_caustics_light
    lamp.update_tag()


def toggle_node(name: str = "Material 1") -> None:
    """A texture without an image."""
    nodes, links = (tree := bpy.data.materials[name].node_tree).nodes, tree.links
    if "Image Texture" in nodes:
        nodes.remove(nodes["Image Texture"])
    else:
        links.new(nodes.new("ShaderNodeTexImage").outputs["Color"], base_color(bpy.data.materials[name]))


def toggle_flatness() -> None:
    obj = bpy.data.objects["Object 1"]
    obj.scale = (1, 1, 1) if obj.scale.x == 0.0 else (0, 0, 0)


def toggle_mesh() -> None:
    """Shared by two objects."""
    vertex = bpy.data.meshes["Shared"].vertices[0]
    vertex.co.x = 0.0 if vertex.co.x != 0.0 else 1e19


CAUSES: dict[str, Callable[[], None]] = {
    "a lamp without size": toggle_lamp,
    "shadow caustics": toggle_caustics,
    "a texture without an image": toggle_node,
    "a flattened object": toggle_flatness,
    "coordinates that are too large": toggle_mesh,
}


def edit_all_else() -> None:
    bpy.data.lights["SUN Lamp"].energy += 1.0
    base_color(bpy.data.materials["Material 2"]).default_value[0] += 0.1
    move()


def move() -> None:
    bpy.data.objects["Object 2"].location.x += 1.0


@pytest.mark.parametrize("name", CAUSES)
def test_a_warning_stays_while_its_cause_does(watched, name) -> None:
    assert watched.warnings == []
    watched.after(CAUSES[name])
    assert len(watched.warnings) == 1
    watched.expect_truth()
    for edit in (edit_all_else, move, lambda: toggle_node("Material 2")):
        watched.after(edit)
        watched.expect_truth()
    assert len(watched.warnings) == 2
    watched.after(CAUSES[name])
    assert len(watched.warnings) == 1
    watched.expect_truth()


def test_those_of_a_mesh_stay_with_the_object_that_is_left(watched) -> None:
    watched.after(toggle_mesh)
    assert len(watched.warnings) == 1
    watched.after(lambda: bpy.data.objects.remove(bpy.data.objects["Object 0"]))
    assert len(watched.warnings) == 1
    watched.expect_truth()


def test_those_of_an_image_stay_with_the_material_that_is_left(watched, tmp_path) -> None:
    image = bpy.data.images.new("Missing", 1, 1)
    image.source, image.filepath = "FILE", str(tmp_path / WRONG)
    for number in (1, 2):
        material = bpy.data.materials[f"Material {number}"]
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        watched.after(lambda m=material, n=node: m.node_tree.links.new(n.outputs["Color"], base_color(m)))
    watched.expect_truth()
    for number, count in ((1, 1), (2, 0)):
        tree = bpy.data.materials[f"Material {number}"].node_tree
        watched.after(lambda tree=tree: tree.links.remove(base_color_link(tree)))
        assert len(watched.warnings) == count
        watched.expect_truth()


def base_color_link(tree: bpy.types.NodeTree) -> bpy.types.NodeLink:
    return next(link for link in tree.links if link.to_socket.name == "Base Color")
