"""Which objects an emitter lights, and which throw shadows in its light, as the sync tells the core."""

from typing import Any

import bpy
import pytest
from recorded_calls import instances
from small_objects import link, triangle

from tests.support.linked_scenes import links

ALL_SETS = 2**64 - 1
NAMES = ("A", "B", "C")


def lamp() -> bpy.types.Object:
    return link("Lamp", bpy.data.lights.new("Lamp", "POINT"))


def things() -> dict[str, bpy.types.Object]:
    return {name: link(name, triangle(name)) for name in NAMES}


def told(builder: Any, kind: str) -> tuple[list[tuple[str, int]], list[tuple[str, int]]]:  # noqa: ANN401
    """Of all instances name and set, of all emitters name and mask, as receivers (`lit`) or blockers."""
    number = ("lit", "blocker").index(kind)
    names = [call["name"] for call in builder.of("add_object_name")]
    values = instances(builder)
    objects = [names[handle] for handle in values["object"]]
    if "links" not in values:
        sets, masks = [0] * len(objects), [ALL_SETS] * len(objects)
    else:
        sets, masks = values["link_sets"][:, number].tolist(), values["links"][:, number].tolist()
    emitters = list(zip(objects, masks, strict=True))
    emitters += [(call["name"], call.get(f"{kind}_sets", ALL_SETS)) for call in builder.of("add_point_light")]
    return list(zip(objects, sets, strict=True)), emitters


def reached(builder: Any, emitter: str, kind: str = "lit") -> list[str]:  # noqa: ANN401
    """Objects that the emitter lights, or that block its light."""
    sets, masks = told(builder, kind)
    mask = dict(masks)[emitter]
    return [name for name, number in sets if (mask >> number) & 1]


def collection(name: str, *objects: bpy.types.Object) -> bpy.types.Collection:
    result = bpy.data.collections.new(name)
    for obj in objects:
        result.objects.link(obj)
    return result


def overruled(t: dict[str, bpy.types.Object]) -> bpy.types.Collection:
    """What is said of an object goes before what is said of its collection, and later ones before earlier ones."""
    early, late = collection("early", t["A"], t["B"], t["C"]), collection("late", t["B"])
    result = links("rules", include=[early, t["A"]], exclude=[late])
    assert [child.name for child in result.children] == ["early", "late"]
    result.collection_objects[0].light_linking.link_state = "EXCLUDE"
    return result


def deep(t: dict[str, bpy.types.Object]) -> bpy.types.Collection:
    """What is said of things in collections further down counts for nothing."""
    middle = bpy.data.collections.new("middle")
    middle.children.link(links("inner", exclude=[t["A"]]))
    return links("outer", include=[middle])


CASES = {
    "included": (lambda t: links("l", include=[t["A"], t["B"]]), "AB"),
    "excluded": (lambda t: links("l", exclude=[t["A"]]), "BC"),
    "both": (lambda t: links("l", include=[t["A"]], exclude=[t["B"]]), "A"),
    "empty": (lambda t: links("l"), "ABC"),
    "collection": (lambda t: links("l", include=[collection("c", t["B"], t["C"])]), "BC"),
    "overruled": (overruled, "C"),
    "deep": (deep, "A"),
    "not shown": (lambda t: links("l", include=[bpy.data.objects.new("hidden", None)]), ""),
    "nothing inside": (lambda t: links("l", include=[bpy.data.collections.new("c")]), "ABC"),
}


@pytest.mark.parametrize("kind", ["lit", "blocker"])
@pytest.mark.parametrize("case", CASES)
def test_rules(camera_scene, recorded_sync, case: str, kind: str) -> None:
    """Beside a lamp without links, and one with the opposite ones."""
    t, emitter = things(), lamp()
    link("Plain", bpy.data.lights.new("Plain", "POINT"))
    other = link("Other", bpy.data.lights.new("Other", "POINT"))
    make, expected = CASES[case]
    member = {"lit": "receiver_collection", "blocker": "blocker_collection"}[kind]
    setattr(emitter.light_linking, member, make(t))
    setattr(other.light_linking, member, links("other", exclude=[t["B"], t["C"]]))
    builder, report = recorded_sync()
    assert reached(builder, "Lamp", kind) == list(expected)
    assert reached(builder, "Plain", kind) == list(NAMES)
    assert reached(builder, "Other", kind) == ["A"]
    kinds = {"lit", "blocker"} - {kind}
    assert reached(builder, "Lamp", kinds.pop()) == list(NAMES)
    assert report.warnings == []


def test_scenes_without_links_say_nothing_of_them(camera_scene, recorded_sync) -> None:
    things(), lamp()
    builder, _ = recorded_sync()
    assert "links" not in instances(builder)
    assert "lit_sets" not in builder.of("add_point_light")[0]


def test_meshes_are_emitters_too(camera_scene, recorded_sync) -> None:
    t = things()
    t["A"].light_linking.receiver_collection = links("l", exclude=[t["A"], t["B"]])
    builder, _ = recorded_sync()
    assert reached(builder, "A") == ["C"]
    assert reached(builder, "B") == list(NAMES)


def instanced(name: str, *parts: bpy.types.Object) -> bpy.types.Object:
    empty = link(name, None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection(f"{name}'s", *parts)
    return empty


def test_instances_are_linked_by_what_instances_them_or_by_their_object(camera_scene, recorded_sync) -> None:
    parts = [bpy.data.objects.new(name, triangle(name)) for name in ("P", "Q")]
    first, second = instanced("First", *parts), instanced("Second", *parts)
    emitter = lamp()
    emitter.light_linking.receiver_collection = links("l", include=[first, parts[1]])
    builder, _ = recorded_sync()
    assert reached(builder, "Lamp") == ["P", "Q", "Q"]
    emitter.light_linking.receiver_collection = links("m", include=[parts[1]], exclude=[second])
    builder, _ = recorded_sync()
    assert reached(builder, "Lamp") == ["Q"], "of the first alone"


def test_lamps_that_are_instanced_keep_their_links(camera_scene, recorded_sync) -> None:
    t = things()
    light = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    light.light_linking.receiver_collection = links("l", include=[t["C"]])
    instanced("First", light), instanced("Second", light)
    builder, _ = recorded_sync()
    assert len(builder.of("add_point_light")) == 2
    assert reached(builder, "Lamp") == ["C"]


def test_objects_that_all_emitters_treat_alike_are_one_set(camera_scene, recorded_sync) -> None:
    many = [link(f"Thing {k}", triangle()) for k in range(100)]
    for k in range(3):
        emitter = link(f"Lamp {k}", bpy.data.lights.new(f"Lamp {k}", "POINT"))
        emitter.light_linking.receiver_collection = links(f"l{k}", include=many[10 * k :])
    builder, _ = recorded_sync()
    assert len({number for _, number in told(builder, "lit")[0]}) == 3
    assert len(reached(builder, "Lamp 0")) == 100
    assert len(reached(builder, "Lamp 2")) == 80


def test_more_sets_than_there_are_bits(camera_scene, recorded_sync) -> None:
    """Lamps that light an object each: what is beyond is lit by those without links alone, as in Cycles."""
    for k in range(70):
        thing = link(f"Thing {k}", triangle())
        emitter = link(f"Lamp {k}", bpy.data.lights.new(f"Lamp {k}", "POINT"))
        emitter.light_linking.receiver_collection = links(f"l{k}", include=[thing])
    builder, report = recorded_sync()
    lit = [reached(builder, f"Lamp {k}") == [f"Thing {k}"] for k in range(70)]
    assert sum(lit) == 63
    assert [reached(builder, f"Lamp {k}") for k in range(70) if not lit[k]] == [[]] * 7
    assert len(report.warnings) == 1 and "70 groups" in report.warnings[0]
