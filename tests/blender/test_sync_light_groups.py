"""Which light group an emitter is of, as the sync tells the core."""

import bpy
import numpy as np
import pytest
from recorded_calls import instances
from small_objects import link, triangle

from addon.sync.light_groups import group_of_object, group_of_world
from tests.support.group_scenes import add_groups

pytestmark = pytest.mark.usefixtures("empty_scene")


def lamp(name: str, group: str, collection: bpy.types.Collection | None = None) -> bpy.types.Object:
    result = link(name, bpy.data.lights.new(name, "POINT"), collection)
    result.lightgroup = group
    return result


def of_lamps(builder) -> dict[str, int]:
    return {call["name"]: call.get("light_group", -1) for call in builder.of("add_point_light")}


def of_objects(builder) -> dict[str, int]:
    names = [call["name"] for call in builder.of("add_object_name")]
    told = instances(builder)
    groups = told["light_group"].tolist() if "light_group" in told else [-1] * len(told["object"])
    return dict(zip((names[handle] for handle in told["object"]), groups, strict=True))


@pytest.fixture
def scene(empty_scene):
    scene = bpy.context.scene
    lamp("key", "warm")
    lamp("fill", "cold")
    lamp("other", "unknown")
    link("pane", triangle()).lightgroup = "cold"
    link("floor", triangle())
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.lightgroup = "sky"
    return scene


def test_numbers_are_those_of_the_list(scene, recorded_sync):
    add_groups(scene, "sky", "warm", "cold")
    builder, _ = recorded_sync()
    assert of_lamps(builder) == {"key": 1, "fill": 2, "other": -1}
    assert of_objects(builder) == {"pane": 2, "floor": -1}
    assert instances(builder)["light_group"].dtype == np.int16
    assert builder.of("set_environment")[0]["light_group"] == 0


def test_a_change_alone_is_followed(scene):
    """Blender does not evaluate it, so with Persistent Data a render would have the group before."""
    graph = bpy.context.evaluated_depsgraph_get()
    key, world = bpy.data.objects["key"].evaluated_get(graph), scene.world.evaluated_get(graph)
    bpy.data.objects["key"].lightgroup = scene.world.lightgroup = "new"
    assert group_of_object(key, None, {"new": 7}) == group_of_world(world, {"new": 7}) == 7


def test_nothing_is_told_without_groups(scene, recorded_sync):
    builder, _ = recorded_sync()
    assert set(of_lamps(builder).values()) == {-1} and "light_group" not in instances(builder)
    assert "light_group" not in builder.of("set_environment")[0]


def test_what_names_none_is_of_the_group_of_what_instances_it(scene, recorded_sync):
    add_groups(scene, "left", "right", "own")
    parts = bpy.data.collections.new("parts")
    lamp("part lamp", "", parts)
    link("part", triangle(), parts)
    link("own part", triangle(), parts).lightgroup = "own"
    for name in ("left", "right"):
        empty = link(name, None)
        empty.instance_type, empty.instance_collection, empty.lightgroup = "COLLECTION", parts, name
    builder, _ = recorded_sync()
    told = instances(builder)
    names = [call["name"] for call in builder.of("add_object_name")]
    pairs = sorted(zip((names[handle] for handle in told["object"]), told["light_group"].tolist(), strict=True))
    assert pairs == [("floor", -1), ("own part", 2), ("own part", 2), ("pane", -1), ("part", 0), ("part", 1)]
    lamps = [(call["name"], call.get("light_group", -1)) for call in builder.of("add_point_light")]
    assert sorted(pair for pair in lamps if pair[0] == "part lamp") == [("part lamp", 0), ("part lamp", 1)]
