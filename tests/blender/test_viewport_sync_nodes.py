"""The live scene of a viewport: materials that only geometry nodes give to objects, which are then not listed."""

from collections.abc import Callable

import bpy
import numpy as np
import pytest
from small_objects import grid_with_cubes, link, triangle
from watched_scene import base_color

from addon.sync.live import Exported


def on_instances(material: bpy.types.Material) -> None:
    grid_with_cubes(2, material)


def on_the_mesh(material: bpy.types.Material) -> None:
    node = add_modifier(link("Bare", triangle("Bare")), "GeometryNodeSetMaterial")
    node.inputs["Material"].default_value = material


def on_a_realised_object(material: bpy.types.Material) -> None:
    source = bpy.data.objects.new("Source", triangle("Source"))
    source.data.materials.append(material)
    node = add_modifier(link("Bare", triangle("Bare")), "GeometryNodeObjectInfo")
    node.inputs["Object"].default_value = source


def add_modifier(obj: bpy.types.Object, kind: str) -> bpy.types.GeometryNode:
    """A geometry node of the kind on an object, between what goes in and what comes out."""
    tree = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    start, node, end = (tree.nodes.new(name) for name in ("NodeGroupInput", kind, "NodeGroupOutput"))
    if "Geometry" in node.inputs:
        tree.links.new(start.outputs[0], node.inputs["Geometry"])
    tree.links.new(node.outputs["Geometry"], end.inputs[0])
    obj.modifiers.new("Nodes", "NODES").node_group = tree
    return node


PLACES = {f.__name__: f for f in (on_instances, on_the_mesh, on_a_realised_object)}


def new_material() -> bpy.types.Material:
    material = bpy.data.materials.new("Given")
    material.use_nodes = True
    return material


@pytest.mark.parametrize("place", PLACES)
def test_an_edit_is_followed(watched, place) -> None:
    material = new_material()
    watched.after(lambda: PLACES[place](material))
    watched.expect_truth()
    exported = watched.after(lambda: setattr(base_color(material), "default_value", (1, 0, 0, 1)))
    assert exported == Exported(materials=1)
    watched.expect_truth()


def group_of(kind: str) -> tuple[bpy.types.ShaderNodeTree, bpy.types.Node]:
    """A group that hands out what one node gives, and that node."""
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    node, output = group.nodes.new(kind), group.nodes.new("NodeGroupOutput")
    if kind != "ShaderNodeGroup":
        group.links.new(node.outputs[0], output.inputs[0])
    return group, node


def outer_group(inner: bpy.types.ShaderNodeTree) -> bpy.types.ShaderNodeTree:
    group, node = group_of("ShaderNodeGroup")
    node.node_tree = inner
    group.links.new(node.outputs[0], next(n for n in group.nodes if n.type == "GROUP_OUTPUT").inputs[0])
    return group


def color_by(material: bpy.types.Material, group: bpy.types.ShaderNodeTree) -> None:
    node = material.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    material.node_tree.links.new(node.outputs[0], base_color(material))


def edit_group(material: bpy.types.Material) -> Callable[[], None]:
    group, color = group_of("ShaderNodeRGB")
    color_by(material, group)
    return lambda: setattr(color.outputs[0], "default_value", (0, 1, 0, 1))


def remove_inner_group(material: bpy.types.Material) -> Callable[[], None]:
    """Of which Blender lists the outer group alone, as for those below."""
    inner, color = group_of("ShaderNodeRGB")
    color.outputs[0].default_value = (0, 1, 0, 1)
    color_by(material, outer_group(inner))
    return lambda: bpy.data.node_groups.remove(inner)


def remap_inner_group(material: bpy.types.Material) -> Callable[[], None]:
    inner, color = group_of("ShaderNodeRGB")
    color.outputs[0].default_value = (0, 1, 0, 1)
    color_by(material, outer_group(inner))
    used, _ = group_of("ShaderNodeRGB")
    color_by(bpy.data.materials["Material 1"], used)
    return lambda: inner.user_remap(used)


def remap_image_in_group(material: bpy.types.Material) -> Callable[[], None]:
    group, texture = group_of("ShaderNodeTexImage")
    used, other_texture = group_of("ShaderNodeTexImage")
    texture.image, other_texture.image = bpy.data.images.new("Old", 2, 2), bpy.data.images.new("New", 2, 2)
    texture.image.generated_color = (0, 1, 0, 1)
    color_by(material, group)
    color_by(bpy.data.materials["Material 1"], used)
    return lambda: texture.image.user_remap(other_texture.image)


def remove_object_that_a_group_names(material: bpy.types.Material) -> Callable[[], None]:
    group, coordinates = group_of("ShaderNodeTexCoord")
    coordinates.object = bpy.data.objects["Empty 3"]
    output = next(n for n in group.nodes if n.type == "GROUP_OUTPUT")
    group.links.new(coordinates.outputs["Object"], output.inputs[0])
    color_by(material, group)
    coordinates.object.location.x = 3
    return lambda: bpy.data.objects.remove(coordinates.object)


def edit_image(material: bpy.types.Material) -> Callable[[], None]:
    image = bpy.data.images.new("Painted", 2, 2)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(node.outputs["Color"], base_color(material))

    def paint() -> None:
        image.pixels.foreach_set(np.ones(16, np.float32))
        image.update()
        image.update_tag()

    return paint


def edit_pass_index(material: bpy.types.Material) -> Callable[[], None]:
    node = material.node_tree.nodes.new("ShaderNodeObjectInfo")
    material.node_tree.links.new(node.outputs["Material Index"], base_color(material))
    return lambda: setattr(material, "pass_index", 3)


def edit_correction(material: bpy.types.Material) -> Callable[[], None]:
    def edit() -> None:
        material.cycles.use_bump_map_correction = False
        material.update_tag()  # as the interface does

    return edit


EDITS = [edit_group, edit_image, edit_pass_index, edit_correction]
REMOVALS = [remove_inner_group, remap_inner_group, remap_image_in_group, remove_object_that_a_group_names]


@pytest.mark.parametrize("prepare", EDITS + REMOVALS)
def test_an_edit_of_what_it_reads_is_followed(watched, prepare) -> None:
    material = new_material()
    edit = prepare(material)
    watched.after(lambda: on_the_mesh(material))
    before = watched.live.builder.described()
    watched.after(edit)
    assert watched.live.builder.described() != before
    watched.expect_truth()


def test_an_attribute_that_it_asks_for_is_exported(watched) -> None:
    material = new_material()
    watched.after(lambda: on_the_mesh(material))
    bpy.data.meshes["Bare"].color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    node = material.node_tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = "Paint"
    material.node_tree.links.new(node.outputs["Color"], base_color(material))
    watched.after(lambda: None)
    meshes = watched.live.builder.stored["mesh"].values()
    assert any(attribute[0] == "Paint" for mesh in meshes for attribute in mesh["attributes"])
    watched.expect_truth()


def test_a_material_that_is_edited_as_it_goes_is_forgotten(watched) -> None:
    material = new_material()
    watched.after(lambda: on_the_mesh(material))

    def edit_and_delete() -> None:
        base_color(material).default_value = (1, 0, 0, 1)
        bpy.data.objects.remove(bpy.data.objects["Bare"])

    watched.after(edit_and_delete)
    assert material.session_uid not in watched.live._kept.materials.compiled
    watched.expect_truth()
