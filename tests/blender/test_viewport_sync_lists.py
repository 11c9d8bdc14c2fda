"""The live scene of a viewport when things come, go, hide, or are all new: what was kept stays what it was."""

import gc

import bpy
import mathutils
import numpy as np
import pytest
from replay_builder import ReplayBuilder
from small_objects import link, triangle
from watched_scene import base_color

from addon.sync.changes import EVERYTHING, UNLISTED
from addon.sync.live import Exported
from tests.support.blender_scenes import save_tile, tile_pixels, tiled_image


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


@pytest.mark.parametrize("member", ["is_holdout", "visible_camera", "is_shadow_catcher"])
def test_flags_that_are_driven_as_the_object_moves_are_followed(watched, member) -> None:
    bpy.data.objects["Object 1"].parent = bpy.data.objects["Empty 3"]
    variable = (driver := bpy.data.objects["Object 1"].driver_add(member).driver).variables.new()
    driver.type, variable.type, variable.targets[0].id = "SUM", "TRANSFORMS", bpy.data.objects["Empty 3"]
    watched.after(lambda: setattr(bpy.data.objects["Empty 3"], "location", (0, 1, 0)))
    for x in (1.0, 0.0):
        watched.after(lambda x=x: setattr(bpy.data.objects["Empty 3"].location, "x", x))
        watched.expect_truth()


def test_objects_that_take_turns_as_they_move_are_told_apart(watched) -> None:
    """There are as many as before, and both of them move."""
    names = ("Object 1", "Object 2")
    for frame in (1, 10):
        for name, is_hidden in zip(names, (frame == 1, frame != 1), strict=True):
            obj = bpy.data.objects[name]
            obj.location.x, obj.hide_viewport = frame, is_hidden
            obj.keyframe_insert("location", frame=frame)
            obj.keyframe_insert("hide_viewport", frame=frame)
    for frame in (1, 10, 1, 10):
        watched.after(lambda frame=frame: bpy.context.scene.frame_set(frame))
        watched.expect_truth()


def test_an_object_that_is_moved_and_renamed_in_one_go_has_its_new_name(watched) -> None:
    obj = bpy.data.objects["Object 1"]
    watched.after(lambda: (setattr(obj, "location", (7, 8, 9)), setattr(obj, "name", "Other")))
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


def test_tiles_follow_edits(watched, tmp_path) -> None:
    save_tile(str(tmp_path / "t.1001.png"), 1001)
    image = tiled_image(str(tmp_path / "t.<UDIM>.png"), (1001,))
    tree = bpy.data.materials["Material 1"].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.links.new(node.outputs["Color"], base_color(bpy.data.materials["Material 1"]))
    stored = watched.live.builder.stored["image"]
    watched.after(lambda: None)
    assert len(stored) == 1

    def add() -> None:
        save_tile(str(tmp_path / "t.1002.png"), 1002)
        image.tiles.new(1002)
        image.update_tag()

    assert watched.after(add).materials == 1
    watched.expect_truth()
    assert len(stored) == 2

    def repaint() -> None:
        save_tile(str(tmp_path / "t.1002.png"), 1003)
        image.reload()
        image.update_tag()

    watched.after(repaint)
    watched.expect_truth()
    assert any(np.array_equal(image["pixels"], tile_pixels(1003)) for image in stored.values())


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
