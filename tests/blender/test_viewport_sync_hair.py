"""The live scene of a viewport when hair changes."""

import bpy
import numpy as np
import pytest
from small_objects import grid_with_cubes, link

from addon.sync.live import Exported
from tests.support.hair_scenes import CAN_MAKE_CURVES, add_particle_hair, hair_curves, scale_radii

pytestmark = pytest.mark.skipif(not CAN_MAKE_CURVES, reason="scripts cannot make hair curves")

KEYS = np.array([[(0, 0, 0), (0, 0, 1), (0, 0, 3)], [(1, 0, 0), (1, 0, 2), (1, 0, 4)]], np.float32)


@pytest.fixture
def hairy(watched):
    """With curves, and an object of particle hair that is not there from the start."""
    curves = hair_curves("Fur", KEYS, np.full((2, 3), 0.1))
    watched.after(lambda: link("Fur", curves))
    watched.after(lambda: add_particle_hair(bpy.data.objects["Object 1"], count=4))
    watched.expect_truth()
    return watched


def stored_radii(watched) -> list[float]:
    meshes = watched.live.builder.stored["mesh"].values()
    return sorted(float(m["radii"].max()) for m in meshes if m["is_there"] and "radii" in m)


def test_hair_that_comes_is_exported(hairy) -> None:
    assert stored_radii(hairy) == pytest.approx([0.006, 0.1])


def test_curves_that_change_are_exported_alone(hairy) -> None:
    exported = hairy.after(lambda: scale_radii(bpy.data.hair_curves["Fur"], 2.0))
    assert exported.meshes == 1 and stored_radii(hairy) == pytest.approx([0.006, 0.2])
    hairy.expect_truth()


def test_particle_settings_that_change_are_exported(hairy) -> None:
    settings = bpy.data.objects["Object 1"].particle_systems[0].settings
    hairy.after(lambda: setattr(settings, "radius_scale", 0.06))
    assert stored_radii(hairy) == pytest.approx([0.03, 0.1])
    hairy.expect_truth()


def test_moves_take_hair_along(hairy) -> None:
    """Blender makes the particles of an object anew where it moves, and its mesh with them."""
    for name, meshes in (("Object 1", 2), ("Fur", 0)):
        exported = hairy.after(lambda name=name: setattr(bpy.data.objects[name], "location", (1, 2, 3)))
        assert (exported.meshes, exported.instances) == (meshes, True)
        hairy.expect_truth()


def test_what_else_changes_leaves_hair_as_it_is(hairy) -> None:
    exported = hairy.after(lambda: setattr(bpy.data.objects["SUN Lamp"].data, "energy", 2.0))
    assert exported == Exported(lamps=1)
    exported = hairy.after(lambda: setattr(bpy.data.objects["Object 2"], "location", (1, 2, 3)))
    assert exported == Exported(instances=True)
    hairy.expect_truth()


@pytest.mark.parametrize("name", ["Object 1", "Fur"])
def test_hair_that_goes_is_forgotten(hairy, name) -> None:
    hairy.after(lambda: bpy.data.objects.remove(bpy.data.objects[name]))
    assert len(stored_radii(hairy)) == 1
    hairy.expect_truth()


def test_hair_that_is_hidden_and_shown_again(hairy) -> None:
    for is_shown in (False, True):
        hairy.after(
            lambda is_shown=is_shown: setattr(bpy.data.objects["Object 1"].modifiers[-1], "show_viewport", is_shown)
        )
        assert len(stored_radii(hairy)) == 1 + is_shown
        hairy.expect_truth()


def test_hair_beside_what_geometry_nodes_instance_keeps_its_material(hairy) -> None:
    """Blender gives what they instance the object's name and hair, but slots of its own."""
    tree = grid_with_cubes(2, None).modifiers[0].node_group
    source = tree.nodes.new("GeometryNodeObjectInfo")
    source.inputs["Object"].default_value = bpy.data.objects["Object 2"]
    bpy.data.meshes["Own"].materials.append(None)
    bpy.data.meshes["Own"].materials[0] = bpy.data.materials.new("Instanced")
    bpy.data.objects["Object 2"].material_slots[0].link = "DATA"
    place = next(node for node in tree.nodes if node.bl_idname == "GeometryNodeInstanceOnPoints")
    tree.links.new(source.outputs["Geometry"], place.inputs["Instance"])
    join = tree.nodes.new("GeometryNodeJoinGeometry")
    output = next(node for node in tree.nodes if node.bl_idname == "NodeGroupOutput")
    start = next(node for node in tree.nodes if node.bl_idname == "NodeGroupInput")
    for socket in (start.outputs[0], place.outputs[0]):
        tree.links.new(socket, join.inputs[0])
    tree.links.new(join.outputs[0], output.inputs[0])
    bpy.data.objects["Object 1"].modifiers.new("Cubes", "NODES").node_group = tree
    hairy.after(lambda: bpy.data.collections["Set"].objects.link(bpy.data.objects["Object 1"]))
    hairy.expect_truth()
    hairy.after(lambda: setattr(bpy.data.objects["Object 0"], "visible_camera", False))
    hairy.expect_truth()


@pytest.mark.parametrize("name", ["Object 1", "Fur"])
def test_hair_that_collections_instance_is_not_kept_for_ever(hairy, name) -> None:
    collection = bpy.data.collections.new("Hairy")
    collection.objects.link(bpy.data.objects[name])
    empties = [link(f"Instancer {k}", None) for k in range(2)]
    for empty in empties:
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
    bpy.context.view_layer.update()
    counts = []
    for edit in range(8):
        empty = empties[edit % 2]
        hairy.after(lambda empty=empty: setattr(empty, "visible_camera", not empty.visible_camera))
        counts.append(len(stored_radii(hairy)))
        hairy.expect_truth()
    assert len(set(counts[1:])) == 1, counts
