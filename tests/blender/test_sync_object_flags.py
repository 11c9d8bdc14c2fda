"""What an object says of itself besides its shape: visibility, holdout, materials, its random number."""

import bpy
import numpy as np
import pytest
from cycles_pixel import cycles_pixel
from recorded_calls import instances
from small_objects import link, triangle

from addon.sync.instances import RAY_BITS
from addon.sync.placements import name_random, random_fraction

ALL_RAYS = sum(RAY_BITS.values())


@pytest.mark.parametrize("flag", RAY_BITS)
def test_ray_visibility(camera_scene, recorded_sync, flag) -> None:
    setattr(link("Thing", triangle()), f"visible_{flag}", False)
    builder, _ = recorded_sync()
    assert instances(builder)["visibility"].tolist() == [ALL_RAYS - RAY_BITS[flag]]


def test_an_object_hidden_from_every_ray_is_left_out(camera_scene, recorded_sync) -> None:
    obj = link("Thing", triangle())
    for flag in RAY_BITS:
        setattr(obj, f"visible_{flag}", False)
    builder, _ = recorded_sync()
    assert builder.of("add_instances") == [] and builder.of("add_mesh") == []


def test_instances_inherit_what_their_instancer_hides(camera_scene, recorded_sync) -> None:
    collection = bpy.data.collections.new("Set")
    link("Thing", triangle(), collection).visible_glossy = False
    empty = link("Empty", None)
    empty.instance_type, empty.instance_collection, empty.visible_shadow = "COLLECTION", collection, False
    builder, _ = recorded_sync()
    assert instances(builder)["visibility"].tolist() == [ALL_RAYS - RAY_BITS["glossy"] - RAY_BITS["shadow"]]


def test_holdout_of_objects_and_of_layer_collections(camera_scene, recorded_sync) -> None:
    link("Plain", triangle())
    link("Held", triangle()).is_holdout = True
    collection = bpy.data.collections.new("Set")
    camera_scene.collection.children.link(collection)
    link("Held by collection", triangle(), collection)
    bpy.context.view_layer.layer_collection.children["Set"].holdout = True
    builder, _ = recorded_sync()
    names = [call["name"] for call in builder.of("add_object_name")]
    values = instances(builder)
    held = {names[o]: bool(h) for o, h in zip(values["object"], values["holdout"], strict=True)}
    assert held == {"Plain": False, "Held": True, "Held by collection": True}


@pytest.mark.parametrize("where", ["object", "instancer"])
def test_holdout_of_instances_is_that_of_cycles(camera_scene, recorded_sync, tmp_path, where) -> None:
    """A plane in an instanced collection, held out itself or by the empty that brings it."""
    collection = bpy.data.collections.new("Set")
    bpy.ops.mesh.primitive_plane_add(size=4)
    plane = bpy.context.object
    camera_scene.collection.objects.unlink(plane)
    collection.objects.link(plane)
    empty = link("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    (plane if where == "object" else empty).is_holdout = True
    builder, _ = recorded_sync()
    camera_scene.camera.location, camera_scene.render.film_transparent = (0, 0, 2), True
    is_held_out = cycles_pixel(camera_scene.camera, tmp_path)[3] == 0.0
    assert instances(builder)["holdout"].tolist() == [is_held_out]


def test_shadow_catchers_of_objects_and_instancers(camera_scene, recorded_sync) -> None:
    link("Plain", triangle())
    builder, _ = recorded_sync()
    assert "shadow_catcher" not in instances(builder)
    link("Catcher", triangle()).is_shadow_catcher = True
    collection = bpy.data.collections.new("Set")
    link("Of the set", triangle(), collection)
    empty = link("Empty", None)
    empty.instance_type, empty.instance_collection, empty.is_shadow_catcher = "COLLECTION", collection, True
    builder, _ = recorded_sync()
    assert instances(builder)["shadow_catcher"].tolist() == [0, 1, 1]


def test_indirect_only_collections_are_hidden_from_the_camera(camera_scene, recorded_sync) -> None:
    collection = bpy.data.collections.new("Set")
    camera_scene.collection.children.link(collection)
    link("Thing", triangle(), collection)
    bpy.context.view_layer.layer_collection.children["Set"].indirect_only = True
    builder, _ = recorded_sync()
    assert instances(builder)["visibility"].tolist() == [ALL_RAYS - RAY_BITS["camera"]]


def test_slots_linked_to_the_object_make_a_set_of_their_own(camera_scene, recorded_sync) -> None:
    mesh = triangle()
    mesh.materials.append(bpy.data.materials.new("Of data"))
    link("A", mesh)
    b = link("B", mesh)
    b.material_slots[0].link = "OBJECT"
    b.material_slots[0].material = bpy.data.materials.new("Of object")
    link("C", mesh)
    builder, _ = recorded_sync()
    assert {c["program"].name for c in builder.of("add_material")} == {"Of data", "Of object"}
    assert len(builder.of("add_material_set")) == 2 and len(builder.of("add_mesh")) == 1
    sets = instances(builder)["material_set"].tolist()
    assert sorted(sets.count(s) for s in set(sets)) == [1, 2]


def test_empty_slots_get_the_default_and_the_override_wins(camera_scene, recorded_sync) -> None:
    mesh = triangle()
    mesh.materials.append(None)
    link("A", mesh)
    builder, _ = recorded_sync()
    assert [c["program"].name for c in builder.of("add_material")] == ["default"]
    bpy.context.view_layer.material_override = bpy.data.materials.new("Override")
    builder, _ = recorded_sync()
    assert [c["program"].name for c in builder.of("add_material")] == ["Override"]


def test_random_is_an_unsigned_fraction_below_one() -> None:
    ids = np.array((0, -(2**31), -1), np.int32)
    assert random_fraction(ids)[:2] == pytest.approx((0.0, 0.5))
    assert random_fraction(ids)[2] < 1.0


@pytest.mark.parametrize("name", ["Cube", "Ünïcode.001"])
def test_random_of_an_object_is_that_of_cycles(empty_scene, tmp_path, name) -> None:
    """One pixel of an emissive plane coloured by Object Info > Random."""
    bpy.ops.mesh.primitive_plane_add(size=4)
    bpy.context.object.name = name
    material = bpy.data.materials.new("Random")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    info, emission, output = (nodes.new(f"ShaderNode{kind}") for kind in ("ObjectInfo", "Emission", "OutputMaterial"))
    material.node_tree.links.new(info.outputs["Random"], emission.inputs["Color"])
    material.node_tree.links.new(emission.outputs[0], output.inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    camera = link("Eye", bpy.data.cameras.new("Eye"), location=(0, 0, 2))
    assert cycles_pixel(camera, tmp_path)[0] == pytest.approx(name_random(name), abs=1e-5)
