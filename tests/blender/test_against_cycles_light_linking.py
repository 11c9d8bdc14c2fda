"""Light and shadow linking against Cycles in the same process.

Means of 4x4 blocks and 4 channels over 6 replicas of each engine, Welch's t-test, false-alarm rate 1 % per case (Šidák
over the 64 values). `test_planted_bugs` shows what the comparison sees.
"""

from collections.abc import Callable

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support import linked_scenes as linked
from tests.support.engines import compare_with_cycles
from tests.support.linked_scenes import key_lamp, key_panel, links, shade, stage
from tests.support.slow_cases import marked

pytestmark = pytest.mark.usefixtures("registered_addon")

SIZE, SAMPLES = (24, 24), 64
Scene = bpy.types.Scene
KINDS = (*linked.LAMPS, "MESH")


def thing(name: str) -> bpy.types.Object:
    return bpy.data.objects[name]


def key(scene: Scene, kind: str) -> bpy.types.Object:
    stage(scene)
    return key_panel(scene) if kind == "MESH" else key_lamp(scene, kind)


def paint(name: str, kind: str, **inputs: object) -> None:
    thing(name).data.materials[0] = build.material(
        f"{name}'s", lambda tree: build.shader(tree, kind, **inputs).outputs[0]
    )


# --- receivers --------------------------------------------------------------------------------------------------------


def included(scene: Scene, kind: str) -> None:
    linked.light_only(key(scene, kind), thing("left"), thing("floor"))


def excluded(scene: Scene, kind: str) -> None:
    linked.light_all_but(key(scene, kind), thing("right"))


def nested(scene: Scene) -> None:
    """An included collection, of which one object is excluded and what the collection below says counts for nothing."""
    lamp = key(scene, "AREA")
    inner = links("inner", exclude=[thing("left")])
    outer = bpy.data.collections.new("outer")
    outer.children.link(inner)
    outer.objects.link(thing("floor"))
    lamp.light_linking.receiver_collection = links("all", include=[outer], exclude=[thing("floor")])


def several_lamps(scene: Scene) -> None:
    """Each with its own objects, some objects with several lamps."""
    stage(scene)
    first, second, third = key_lamp(scene, "POINT", (-1, -1, 2)), key_lamp(scene, "AREA"), key_panel(scene)
    linked.light_only(first, thing("left"), thing("wall"))
    linked.light_all_but(second, thing("left"))
    third.location = (0.9, -0.9, 1.2)
    linked.light_only(third, thing("floor"), thing("right"))


def instances(scene: Scene) -> None:
    """Of a collection that two empties bring, one of them linked, and of a ball in it that is."""
    stage(scene)
    parts = bpy.data.collections.new("parts")
    for name, place in (("small", (-0.3, -1.3, 0)), ("other", (0.1, -1.1, 0))):
        part = linked.ball(scene, name, place, 0.2)
        scene.collection.objects.unlink(part)
        parts.objects.link(part)
    for k in range(2):
        empty = bpy.data.objects.new(f"empty {k}", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", parts, (0.6 * k - 0.2, 0, 0)
        scene.collection.objects.link(empty)
    linked.light_only(key_lamp(scene, "AREA"), thing("small"), thing("empty 1"), thing("wall"))


def smooth(scene: Scene) -> None:
    """A mirror that is lit, glass that is not, before things of which it is the other way round."""
    stage(scene)
    paint("right", "ShaderNodeBsdfGlossy", Roughness=0.0)
    paint("left", "ShaderNodeBsdfGlass", IOR=1.4, Roughness=0.0)
    linked.light_only(key_lamp(scene, "AREA"), thing("right"), thing("wall"))
    panel = key_panel(scene)
    panel.location = (-0.2, -1.2, 1.4)
    linked.light_all_but(panel, thing("right"), thing("wall"))


def transparent(scene: Scene) -> None:
    """A tinted pane is no receiver of what passes it."""
    pane = build.material(
        "pane", lambda tree: build.shader(tree, "ShaderNodeBsdfTransparent", Color=(0.3, 0.8, 0.4, 1)).outputs[0]
    )
    lamp = key(scene, "MESH")
    linked.light_all_but(lamp, shade(scene, pane), thing("right"))


def sky_and_links(scene: Scene) -> None:
    """The sky lights everything; a lamp that lights nothing."""
    lamp = key(scene, "AREA")
    build.set_world(scene, strength=1.0)
    linked.light_only(lamp, bpy.data.objects.new("elsewhere", None))


def skin(scene: Scene) -> None:
    lamp = key(scene, "AREA")
    inputs = {"Base_Color": (0.8, 0.6, 0.5, 1), "Subsurface_Weight": 1.0, "Subsurface_Scale": 0.3}
    thing("left").data.materials[0] = build.principled("skin", **inputs)
    linked.light_only(lamp, thing("left"))


RECEIVERS: dict[str, Callable[[Scene], None]] = {
    **{f"{kind} included": (lambda scene, kind=kind: included(scene, kind)) for kind in KINDS},
    **{f"{kind} excluded": (lambda scene, kind=kind: excluded(scene, kind)) for kind in KINDS},
    "nested": nested,
    "several lamps": several_lamps,
    "instances": instances,
    "smooth": smooth,
    "transparent": transparent,
    "sky": sky_and_links,
    "skin": skin,
}

# --- blockers ---------------------------------------------------------------------------------------------------------


def passed(scene: Scene, kind: str) -> None:
    """A board lets the light of one lamp pass."""
    linked.blocked_by_all_but(key(scene, kind), shade(scene))


def blocked_by_one(scene: Scene, kind: str) -> None:
    """A ball throws the only shadow, besides itself. Found by light samples alone: where rays that surfaces scatter
    meet something that no emitter tells from others, Cycles looks no further for emitters that it does not block."""
    lamp = key(scene, kind)
    shade(scene)
    lamp.data.cycles.use_multiple_importance_sampling = False
    linked.blocked_only(lamp, thing("left"))


def passed_and_seen_in_mirrors(scene: Scene) -> None:
    smooth(scene)
    board = shade(scene)
    for name in ("key", "key.001"):
        linked.blocked_by_all_but(thing(name), board, thing("left"))


def pane_in_the_way(scene: Scene) -> None:
    """A tinted pane that dims the light of one lamp, and lets that of another pass."""
    pane = build.material(
        "pane", lambda tree: build.shader(tree, "ShaderNodeBsdfTransparent", Color=(0.3, 0.8, 0.4, 1)).outputs[0]
    )
    panel, board = key(scene, "MESH"), shade(scene, pane)
    linked.blocked_by_all_but(panel, board)
    linked.blocked_by_all_but(key_lamp(scene, "POINT", (0.3, 0.0, 2.2)), thing("left"))


def both(scene: Scene) -> None:
    """Light and shadow linking at once, of two emitters."""
    lamp, board = key(scene, "AREA"), shade(scene)
    linked.light_all_but(lamp, thing("wall"))
    linked.blocked_by_all_but(lamp, board)
    panel = key_panel(scene)
    panel.location = (0.3, -0.8, 1.6)
    linked.light_only(panel, thing("floor"), thing("left"))
    linked.blocked_by_all_but(panel, thing("left"), board)


BLOCKERS: dict[str, Callable[[Scene], None]] = {
    **{f"{kind} passed": (lambda scene, kind=kind: passed(scene, kind)) for kind in KINDS},
    **{f"{kind} blocked by one": (lambda scene, kind=kind: blocked_by_one(scene, kind)) for kind in linked.LAMPS},
    "mirrors": passed_and_seen_in_mirrors,
    "pane": pane_in_the_way,
    "both": both,
}
CASES = RECEIVERS | BLOCKERS
SLOW = {f"{kind} {case}" for kind in ("POINT", "SPOT", "SUN") for case in ("included", "passed")}


@pytest.mark.parametrize("case", marked(CASES, SLOW - {"SUN passed", "POINT included"}))
def test_linking(empty_scene: Scene, case: str) -> None:
    CASES[case](empty_scene)
    result = compare_with_cycles(empty_scene, SIZE, SAMPLES)
    assert result.agrees, result


PRESETS = ("FINAL", "RIS", "RESTIR_DI", "CELL_RESERVOIRS", "RESTIR_GI", "WORLD_PATHS")


QUICK = {("both", "RESTIR_DI"), ("several lamps", "FINAL")}
REUSE = [
    pytest.param(case, preset, marks=() if (case, preset) in QUICK else pytest.mark.slow)
    for case in ("both", "several lamps")
    for preset in PRESETS
]


@pytest.mark.parametrize(("case", "preset"), REUSE)
def test_reuse(empty_scene: Scene, case: str, preset: str) -> None:
    """Light that is passed on is judged for those who take it. With more samples: few have tails too long for Welch's
    test."""
    CASES[case](empty_scene)
    result = compare_with_cycles(empty_scene, SIZE, 4 * SAMPLES, preset=preset)
    assert result.agrees, result


# --- media ------------------------------------------------------------------------------------------------------------

SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def cube(scene: Scene, name: str, kind: str, place: tuple, half: float, **inputs: object) -> bpy.types.Object:
    """A medium and nothing else."""
    medium = bpy.data.materials.new(name)
    medium.use_nodes = True
    tree = medium.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(build.shader(tree, kind, **inputs).outputs[0], output.inputs["Volume"])
    corners = [(half * x, half * y, half * z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    result = build.add_mesh(scene, name, corners, SIDES, medium)
    result.location = place
    return result


def fogs(scene: Scene) -> bpy.types.Object:
    """Two cubes of fog, and a lamp that is found by light samples alone (see test_against_cycles_volumes)."""
    build.add_floor(scene)
    build.add_camera(scene)
    build.set_world(scene, strength=0.2)
    cube(scene, "large", "ShaderNodeVolumeScatter", (0, 0, 1), 0.6, Density=1.5)
    cube(scene, "small", "ShaderNodeVolumeScatter", (1.2, 0, 0.5), 0.3, Density=1.5)
    lamp = build.add_light(scene, "POINT", (1.0, -1.0, 2.5), energy=100.0, shadow_soft_size=0.1)
    lamp.data.cycles.use_multiple_importance_sampling = False
    return lamp


def lit_fog(scene: Scene) -> None:
    linked.light_only(fogs(scene), thing("large"))


def floor_below_fog(scene: Scene) -> None:
    linked.light_all_but(fogs(scene), thing("large"))


def fog_without_shadow(scene: Scene) -> None:
    linked.blocked_by_all_but(fogs(scene), thing("large"))


def linked_fire(scene: Scene) -> None:
    """The camera sees it, whatever it is linked to."""
    build.add_floor(scene)
    build.add_camera(scene)
    linked.ball(scene, "left", (-1.0, 0.0, 0.0))
    fire = cube(scene, "fire", "ShaderNodeEmission", (0, 0, 1), 0.6, Color=(1, 0.5, 0.2, 1), Strength=0.8)
    linked.light_only(fire, thing("floor"))


@pytest.mark.parametrize("case", [lit_fog, floor_below_fog, fog_without_shadow, linked_fire])
def test_media(empty_scene: Scene, case: Callable) -> None:
    if case is linked_fire and bpy.app.version < (5, 2, 0):
        pytest.skip("Cycles before 5.2 hides it from the camera")
    case(empty_scene)
    result = compare_with_cycles(empty_scene, SIZE, SAMPLES)
    assert result.agrees, result


# --- planted bugs -----------------------------------------------------------------------------------------------------


def without_receivers(scene: Scene) -> None:
    for obj in scene.objects:
        obj.light_linking.receiver_collection = None


def without_blockers(scene: Scene) -> None:
    for obj in scene.objects:
        obj.light_linking.blocker_collection = None


def turned_over(scene: Scene) -> None:
    """One object more, or one less."""
    entry = thing("key").light_linking.receiver_collection.collection_objects[0].light_linking
    entry.link_state = "EXCLUDE" if entry.link_state == "INCLUDE" else "INCLUDE"


PLANTED = [
    ("AREA included", without_receivers),
    ("MESH excluded", without_receivers),
    ("several lamps", turned_over),
    ("smooth", without_receivers),
    ("nested", turned_over),
    ("MESH passed", without_blockers),
    ("SUN blocked by one", without_blockers),
    ("mirrors", without_blockers),
    ("pane", without_blockers),
]


@pytest.mark.parametrize(("case", "plant"), PLANTED)
def test_planted_bugs(empty_scene: Scene, case: str, plant: Callable) -> None:
    CASES[case](empty_scene)
    result = compare_with_cycles(empty_scene, SIZE, SAMPLES, plant=plant)
    assert not result.agrees, result


@pytest.mark.parametrize("plant", [without_receivers, without_blockers])
def test_planted_bugs_in_media(empty_scene: Scene, plant: Callable) -> None:
    (lit_fog if plant is without_receivers else fog_without_shadow)(empty_scene)
    result = compare_with_cycles(empty_scene, SIZE, SAMPLES, plant=plant)
    assert not result.agrees, result
