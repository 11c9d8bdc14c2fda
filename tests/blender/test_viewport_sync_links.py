"""The live scene of a viewport when light and shadow linking are edited."""

import bpy

from tests.support.linked_scenes import links


def linked_lamp(watched, **members) -> tuple[bpy.types.Object, bpy.types.Collection]:
    lamp = bpy.data.objects["POINT Lamp"]
    collection = links("links", include=[bpy.data.objects["Object 0"]])
    watched.after(lambda: setattr(lamp.light_linking, "receiver_collection", collection))
    return lamp, collection


def lit_sets(watched) -> list[int]:
    lights = watched.live.builder.stored["light"].values()
    return [light["lit_sets"] for light in lights if light["is_there"] and light.get("lit_sets") is not None]


def test_linking_a_lamp_and_unlinking_it(watched) -> None:
    lamp, _ = linked_lamp(watched)
    assert len(lit_sets(watched)) == 1
    watched.expect_truth()
    watched.after(lambda: setattr(lamp.light_linking, "receiver_collection", None))
    assert not lit_sets(watched)
    watched.expect_truth()


def test_editing_the_collection(watched) -> None:
    _, collection = linked_lamp(watched)
    before = lit_sets(watched)
    entry = collection.collection_objects[0].light_linking
    exported = watched.after(lambda: setattr(entry, "link_state", "EXCLUDE"))
    assert exported.lamps == 1 and exported.meshes == 0 and exported.materials == 0
    assert lit_sets(watched) != before
    watched.expect_truth()
    exported = watched.after(lambda: collection.objects.link(bpy.data.objects["Object 1"]))
    assert exported.instances
    watched.expect_truth()
    watched.after(lambda: collection.objects.unlink(bpy.data.objects["Object 0"]))
    watched.expect_truth()
    child = bpy.data.collections.new("child")
    child.objects.link(bpy.data.objects["Object 2"])
    watched.after(lambda: collection.children.link(child))
    watched.expect_truth()
    watched.after(lambda: setattr(collection.collection_children[0].light_linking, "link_state", "EXCLUDE"))
    watched.expect_truth()
    watched.after(lambda: child.objects.link(bpy.data.objects["Empty 3"]))
    watched.expect_truth()
    watched.after(lambda: bpy.data.collections.remove(collection))
    assert not lit_sets(watched)
    watched.expect_truth()


def test_blockers_and_emissive_meshes(watched) -> None:
    thing = bpy.data.objects["Object 1"]
    collection = links("links", exclude=[bpy.data.objects["Object 0"]])
    exported = watched.after(lambda: setattr(thing.light_linking, "blocker_collection", collection))
    assert exported.instances and not exported.lamps
    assert "links" in watched.live.builder.instances[0]
    watched.expect_truth()
    watched.after(lambda: setattr(thing.light_linking, "blocker_collection", None))
    assert "links" not in watched.live.builder.instances[0]
    watched.expect_truth()


def test_linked_things_move_and_change(watched) -> None:
    lamp, _ = linked_lamp(watched)
    before = lit_sets(watched)
    exported = watched.after(lambda: setattr(lamp, "location", (1, 2, 3)))
    assert exported.lamps == 1
    watched.expect_truth()
    watched.after(lambda: setattr(lamp.data, "energy", 77.0))
    watched.expect_truth()
    watched.after(lambda: setattr(bpy.data.objects["Object 0"], "location", (1, 2, 3)))
    watched.expect_truth()
    watched.after(lambda: setattr(bpy.data.objects["SUN Lamp"], "location", (1, 2, 3)))
    watched.expect_truth()
    assert lit_sets(watched) == before


def test_undo(watched) -> None:
    linked_lamp(watched)
    bpy.ops.ed.undo_push(message="linked")
    described = watched.live.builder.described()
    entry = bpy.data.collections["links"].collection_objects[0].light_linking
    watched.after(lambda: setattr(entry, "link_state", "EXCLUDE"))
    bpy.ops.ed.undo_push(message="excluded")
    bpy.ops.ed.undo()
    watched.after(lambda: None)
    assert watched.live.builder.described() == described
    watched.expect_truth()
