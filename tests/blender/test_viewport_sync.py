"""The live scene of a viewport: edits touch what they edit, and lead to the scene that a fresh export gives."""

import bpy
import numpy as np
import pytest
from small_objects import link, triangle
from watched_scene import base_color

from addon.sync.instances import InstanceSync
from addon.sync.live import Exported
from addon.sync.nodes import sky


def test_the_first_sync_is_the_whole_scene(watched) -> None:
    assert watched.live.exported == Exported(materials=5, meshes=3, lamps=5, instances=True, environment=True)
    watched.expect_truth()


def test_without_an_edit_nothing_is_exported(watched) -> None:
    assert not watched.after(lambda: None).is_anything


def test_selecting_exports_nothing(watched) -> None:
    assert not watched.after(lambda: bpy.data.objects["Object 1"].select_set(True)).is_anything


def test_a_moved_object_costs_its_matrix(watched) -> None:
    exported = watched.after(lambda: setattr(bpy.data.objects["Object 1"], "location", (7, 8, 9)))
    assert exported == Exported(instances=True)
    watched.expect_truth()


def test_a_moved_instancer_takes_its_content_along(watched) -> None:
    exported = watched.after(lambda: setattr(bpy.data.objects["Empty 3"], "location", (7, 8, 9)))
    assert exported == Exported(lamps=1, instances=True)
    watched.expect_truth()


def test_a_moved_lamp_is_the_only_one_replaced(watched) -> None:
    exported = watched.after(lambda: setattr(bpy.data.objects["POINT Lamp"], "location", (7, 8, 9)))
    assert exported == Exported(lamps=1)
    watched.expect_truth()


@pytest.mark.parametrize("edit", [("energy", 77.0), ("type", "AREA")])
def test_an_edited_lamp_is_the_only_one_replaced(watched, edit) -> None:
    assert watched.after(lambda: setattr(bpy.data.lights["POINT Lamp"], *edit)) == Exported(lamps=1)
    watched.expect_truth()


def edit_and_move(lamp: bpy.types.Object) -> None:
    lamp.data.energy, lamp.location = 77.0, (7, 8, 9)


def set_portal(lamp: bpy.types.Object, is_portal: bool = True) -> None:
    lamp.data.type = "AREA"
    lamp.data.cycles.is_portal = is_portal
    lamp.data.update_tag()


LAMP_EDITS = {
    "energy": lambda lamp: setattr(lamp.data, "energy", 77.0),
    "type": lambda lamp: setattr(lamp.data, "type", "AREA"),
    "place": lambda lamp: setattr(lamp, "location", (7, 8, 9)),
    "both": edit_and_move,
    "visibility": lambda lamp: setattr(lamp, "visible_camera", False),
    "nothing left": lambda lamp: setattr(lamp, "scale", (0, 0, 0)),
    "portal": set_portal,
}


@pytest.mark.parametrize("name", LAMP_EDITS)
def test_an_edited_lamp_costs_no_look_at_every_item(watched, name, monkeypatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(InstanceSync, "_place", lambda _: pytest.fail("every item was looked at"))
        watched.after(lambda: LAMP_EDITS[name](bpy.data.objects["POINT Lamp"]))
        watched.after(lambda: setattr(bpy.data.objects["SUN Lamp"], "location", (0, 0, 1)))
    watched.expect_truth()


def test_a_portal_comes_and_goes(watched) -> None:
    lamp = bpy.data.objects["POINT Lamp"]
    for edit in (set_portal, lambda lamp: set_portal(lamp, is_portal=False), set_portal, bpy.data.objects.remove):
        watched.after(lambda edit=edit: edit(lamp))
        watched.expect_truth()


LARGER_EDITS = {
    "lamp inside an instance": lambda: setattr(bpy.data.lights["Inner Lamp"], "energy", 77.0),
    "lamp hidden": lambda: bpy.data.objects["POINT Lamp"].hide_set(True),
    "lamp out of viewports": lambda: setattr(bpy.data.objects["POINT Lamp"], "hide_viewport", True),
    "lamp gets other data": lambda: setattr(bpy.data.objects["POINT Lamp"], "data", bpy.data.lights["SUN Lamp"]),
}


@pytest.mark.parametrize("name", LARGER_EDITS)
def test_what_is_more_than_an_edited_lamp_is_followed(watched, name) -> None:
    watched.after(LARGER_EDITS[name])
    watched.expect_truth()
    watched.after(lambda: LAMP_EDITS["energy"](bpy.data.objects["SUN Lamp"]))
    watched.expect_truth()


def test_an_edited_material_is_the_only_one_compiled(watched) -> None:
    material = bpy.data.materials["Material 1"]
    assert watched.after(lambda: setattr(base_color(material), "default_value", (1, 0, 0, 1))) == Exported(materials=1)
    watched.expect_truth()


def test_a_lamps_program_outlives_what_does_not_concern_it(watched) -> None:
    light = bpy.data.lights["POINT Lamp"]
    light.use_nodes = True
    emission = next(node for node in light.node_tree.nodes if node.bl_idname == "ShaderNodeEmission")
    assert watched.after(lambda: setattr(emission.inputs["Strength"], "default_value", 3.0)) != Exported()
    watched.expect_truth()
    watched.after(lambda: setattr(bpy.context.scene.render, "resolution_x", 500))
    assert not watched.live._kept.materials.free_handles
    obj = link("New", triangle("New"))
    obj.data.materials.append(bpy.data.materials.new("New"))
    watched.after(lambda: None)
    watched.expect_truth()


def test_a_group_inside_a_material_reaches_it(watched) -> None:
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    color, output = group.nodes.new("ShaderNodeRGB"), group.nodes.new("NodeGroupOutput")
    group.links.new(color.outputs[0], output.inputs[0])
    tree = bpy.data.materials["Material 1"].node_tree
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(node.outputs[0], base_color(bpy.data.materials["Material 1"]))
    bpy.context.view_layer.update()
    assert watched.after(lambda: setattr(color.outputs[0], "default_value", (0, 1, 0, 1))) == Exported(materials=1)
    watched.expect_truth()


def test_a_sky_is_computed_where_it_changes(watched, monkeypatch) -> None:
    tables = []
    monkeypatch.setattr(sky.Sky, "table", lambda self: tables.append(self) or np.ones((2, 4, 3), np.float32))
    world = bpy.context.scene.world
    world.use_nodes = True
    node = world.node_tree.nodes.new("ShaderNodeTexSky")
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    world.node_tree.links.new(node.outputs[0], background.inputs["Color"])
    bpy.context.view_layer.update()
    assert len(tables) == 1
    for edit in (
        lambda: setattr(background.inputs["Strength"], "default_value", 0.5),
        lambda: setattr(node, "sun_rotation", 1.0),
        lambda: setattr(node, "sun_intensity", 2.0),
    ):
        assert watched.after(edit).materials == 1
    assert len(tables) == 1
    assert watched.after(lambda: setattr(node, "sun_elevation", 0.8)).materials == 1
    assert len(tables) == 2
    watched.expect_truth()


def test_an_edited_mesh_is_the_only_one_read(watched) -> None:
    mesh = bpy.data.meshes["Own"]

    def edit() -> None:
        mesh.vertices[0].co.z = 3.0
        mesh.update()

    assert watched.after(edit) == Exported(meshes=1)
    watched.expect_truth()


def test_a_mesh_in_edit_mode_is_shown(watched) -> None:
    bpy.context.view_layer.objects.active = bpy.data.objects["Object 2"]

    def edit() -> None:
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.subdivide(number_cuts=1)

    watched.after(edit)
    assert len(watched.live.builder.instances) == 5
    bpy.ops.object.mode_set(mode="OBJECT")
    watched.after(lambda: None)
    watched.expect_truth()


def test_a_modifier_gives_an_object_a_mesh_of_its_own(watched) -> None:
    exported = watched.after(lambda: bpy.data.objects["Object 0"].modifiers.new("Smooth", "SUBSURF"))
    assert exported.meshes <= 2 and exported.materials == exported.lamps == 0
    watched.expect_truth()


def test_an_attribute_that_a_material_asks_for_is_exported(watched) -> None:
    colors = bpy.data.meshes["Own"].color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    assert colors is not None
    bpy.context.view_layer.update()
    tree = bpy.data.materials["Material 2"].node_tree
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = "Paint"
    tree.links.new(node.outputs["Color"], base_color(bpy.data.materials["Material 2"]))
    watched.after(lambda: None)
    meshes = watched.live.builder.stored["mesh"].values()
    assert any(attribute[0] == "Paint" for mesh in meshes for attribute in mesh["attributes"])
