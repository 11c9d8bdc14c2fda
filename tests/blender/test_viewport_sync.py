"""The live scene of a viewport: edits touch what they edit, and lead to the scene that a fresh export gives."""

import gc
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import bpy
import fake_core
import mathutils
import numpy as np
import pytest
from bpy.app.handlers import persistent
from replay_builder import ReplayBuilder

from addon.sync.changes import EVERYTHING, UNLISTED, read_changes
from addon.sync.live import Exported, LiveSync
from addon.sync.placements import instance_keys

CORE = SimpleNamespace(**vars(fake_core.CORE) | {"SceneBuilder": ReplayBuilder})


class Watched:
    """A live scene that is synced after every evaluation, as Blender calls `view_update`."""

    def __init__(self) -> None:
        self.live = LiveSync(CORE)
        self.exported: list[Exported] = []

    def sync(self, depsgraph: bpy.types.Depsgraph) -> None:
        self.live.sync(depsgraph, read_changes(depsgraph))
        self.exported.append(self.live.exported)

    def after(self, edit: Callable[[], Any]) -> Exported:
        """All that was exported for an edit."""
        self.exported.clear()
        edit()
        bpy.context.view_layer.update()
        total = Exported()
        for one in self.exported:
            total.materials += one.materials
            total.meshes += one.meshes
            total.lamps += one.lamps
            total.instances |= one.instances
            total.environment |= one.environment
        return total

    def expect_truth(self) -> None:
        """What the builder holds is what an export from nothing gives."""
        fresh = LiveSync(CORE)
        try:
            fresh.sync(bpy.context.evaluated_depsgraph_get(), EVERYTHING)
            assert self.live.builder.described() == fresh.builder.described()
        finally:
            fresh.close()


@pytest.fixture
def watched(empty_scene):
    build_scene()
    watched = Watched()

    @persistent
    def update(_scene, depsgraph) -> None:
        watched.sync(depsgraph)

    watched.live.sync(bpy.context.evaluated_depsgraph_get(), EVERYTHING)
    bpy.app.handlers.depsgraph_update_post.append(update)
    bpy.app.handlers.frame_change_post.append(update)
    yield watched
    bpy.app.handlers.depsgraph_update_post.remove(update)
    bpy.app.handlers.frame_change_post.remove(update)
    watched.live.close()


def build_scene() -> None:
    """Two objects that share a mesh, one of its own, an instanced collection, and lamps."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("Day")
    shared = triangle("Shared")
    for index, mesh in enumerate((shared, shared, triangle("Own"))):
        obj = link(f"Object {index}", mesh, location=(2.0 * index, 0.0, 0.0))
        material = bpy.data.materials.new(f"Material {index}")
        material.use_nodes = True
        obj.material_slots or obj.data.materials.append(None)
        obj.material_slots[0].link = "OBJECT"
        obj.material_slots[0].material = material
    collection = bpy.data.collections.new("Set")
    link("Part", triangle("Part"), collection)
    link("Inner Lamp", bpy.data.lights.new("Inner Lamp", "SPOT"), collection)
    for x in (3, 5):
        empty = link(f"Empty {x}", None, location=(x, 1, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
    for kind in ("POINT", "SUN", "AREA"):
        link(f"{kind} Lamp", bpy.data.lights.new(f"{kind} Lamp", kind), location=(0, 0, 4))
    bpy.context.view_layer.update()


def link(name, data, collection=None, location=(0, 0, 0)) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    obj.location = location
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def triangle(name: str) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    return mesh


def base_color(material: bpy.types.Material):
    return next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled").inputs["Base Color"]


def test_the_first_sync_is_the_whole_scene(watched) -> None:
    assert watched.live.exported == Exported(materials=4, meshes=3, lamps=5, instances=True, environment=True)
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


def test_deleting_and_undoing(watched) -> None:
    bpy.ops.ed.undo_push(message="before")
    before = watched.live.builder.described()

    def delete() -> None:
        for name in ("Object 2", "SUN Lamp"):
            bpy.data.objects.remove(bpy.data.objects[name])

    exported = watched.after(delete)
    assert (exported.meshes, exported.materials) == (0, 0)
    assert len(watched.live.builder.instances) == 4
    watched.expect_truth()
    bpy.ops.ed.undo_push(message="deleted")
    bpy.ops.ed.undo()
    watched.after(lambda: None)
    assert watched.live.builder.described() == before
    watched.expect_truth()


def test_instances_and_lamps_keep_their_keys(watched) -> None:
    bpy.ops.ed.undo_push(message="before")

    def keys() -> dict[str, list[int]]:
        stored = watched.live.builder
        lamps = [light for light in stored.stored["light"].values() if light["is_there"]]
        return {
            "instances": sorted(int(instance["keys"]) for instance in stored.instances),
            "lamps": sorted(lamp["key"] for lamp in lamps),
        }

    before = keys()
    assert all(len(set(numbers) - {0}) == 5 for numbers in before.values())
    watched.after(lambda: setattr(bpy.data.objects["Object 1"], "location", (7, 8, 9)))
    watched.after(lambda: bpy.data.objects["Object 0"].data.update())
    assert keys() == before
    watched.after(lambda: bpy.data.objects.remove(bpy.data.objects["Object 2"]))
    assert set(keys()["instances"]) < set(before["instances"])
    bpy.ops.ed.undo_push(message="deleted")
    bpy.ops.ed.undo()
    watched.after(lambda: None)
    assert keys() == before


def test_what_is_deleted_leaves_its_handles_to_what_comes(watched) -> None:
    for round_number in range(5):
        mesh = triangle(f"New {round_number}")
        obj = link("New", mesh)
        obj.data.materials.append(bpy.data.materials.new(f"New {round_number}"))
        link("New Lamp", bpy.data.lights.new("New Lamp", "POINT"))
        bpy.context.view_layer.update()
        watched.expect_truth()
        for data_block in (mesh, bpy.data.lights["New Lamp"], bpy.data.materials[f"New {round_number}"]):
            bpy.data.batch_remove([data_block])
        bpy.context.view_layer.update()
        watched.expect_truth()
    stored = watched.live.builder.stored
    assert (len(stored["mesh"]), len(stored["light"])) == (4, 6)
    assert len(stored["material"]) <= 7


@pytest.mark.parametrize("member", ["hide_viewport", "exclude"])
def test_a_hidden_collection_is_gone_and_comes_back(watched, member) -> None:
    collection = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(collection)
    link("Hidden", triangle("Hidden"), collection)
    bpy.context.view_layer.update()
    layer = bpy.context.view_layer.layer_collection.children["Hidden"]
    owner = layer if member == "exclude" else collection
    for hidden, count in ((True, 5), (False, 6)):
        watched.after(lambda hidden=hidden: setattr(owner, member, hidden))
        assert len(watched.live.builder.instances) == count
        watched.expect_truth()


@pytest.mark.parametrize("member", ["is_holdout", "visible_camera", "hide_viewport", "name"])
def test_flags_of_an_object_are_followed(watched, member) -> None:
    obj = bpy.data.objects["Object 1"]
    value = "Other" if member == "name" else not getattr(obj, member)
    exported = watched.after(lambda: setattr(obj, member, value))
    assert (exported.materials, exported.lamps) == (0, 0)
    watched.expect_truth()


def test_a_frame_change_moves_what_is_animated(watched) -> None:
    obj = bpy.data.objects["Object 1"]
    for frame in (1, 10):
        obj.location.x = frame
        obj.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)
    exported = watched.after(lambda: bpy.context.scene.frame_set(7))
    assert exported == Exported(instances=True)
    watched.expect_truth()


def test_a_repainted_image_is_read_again(watched) -> None:
    image = bpy.data.images.new("Paint", 2, 2)
    tree = bpy.data.materials["Material 1"].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.links.new(node.outputs["Color"], base_color(bpy.data.materials["Material 1"]))
    watched.after(lambda: None)

    def paint() -> None:
        image.pixels = [1.0, 0.0, 0.0, 1.0] * 4
        image.update_tag()

    assert watched.after(paint).materials == 1
    watched.expect_truth()
    watched.after(lambda: tree.nodes.remove(node))
    pixels = [stored["pixels"].size for stored in watched.live.builder.stored["image"].values()]
    assert pixels == [1]


def test_another_scene_starts_anew(watched) -> None:
    builder = watched.live.builder
    other = bpy.data.scenes.new("Other")
    watched.live.sync(other.view_layers[0].depsgraph or bpy.context.evaluated_depsgraph_get(), EVERYTHING)
    bpy.context.window.scene = other
    watched.after(lambda: link("Alone", triangle("Alone")))
    assert watched.live.builder is not builder
    assert len(watched.live.builder.instances) == 1


def test_after_a_refused_scene_all_is_exported_anew(watched, monkeypatch) -> None:
    def refuse(self, **_) -> None:
        raise ValueError("refused")

    monkeypatch.setattr(ReplayBuilder, "do_clear_instances", refuse)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    watched.live._kept.instances.arrays["random"] += 1.0
    with pytest.raises(ValueError, match="refused"):
        watched.live.sync(depsgraph, UNLISTED)
    assert watched.live.builder is None
    monkeypatch.undo()
    watched.live.sync(depsgraph, UNLISTED)
    watched.expect_truth()


def test_no_reference_to_blenders_data_is_kept(watched) -> None:
    watched.after(lambda: setattr(bpy.data.objects["Object 1"], "location", (1, 1, 1)))
    pending, seen = [watched.live], set()
    while pending:
        thing = pending.pop()
        if id(thing) in seen or isinstance(thing, type | type(bpy)) or callable(thing):
            continue
        seen.add(id(thing))
        assert not isinstance(thing, bpy.types.bpy_struct | mathutils.Matrix | mathutils.Vector), thing
        pending += gc.get_referents(thing)
    assert len(seen) > 100
    assert not any(isinstance(thing, np.ndarray) and thing.dtype == object for thing in gc.get_objects())


def test_instances_that_cannot_be_told_apart_have_no_key() -> None:
    identities = np.array([5, 5, 6, 2**64 - 1], np.uint64)
    keys = instance_keys(identities, np.array([-1, -1, -1, 0], np.int32))
    assert keys[0] == keys[1] == 0 and len({*keys.tolist(), 0}) == 3
