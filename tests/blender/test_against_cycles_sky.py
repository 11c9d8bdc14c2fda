"""The Sky Texture node against Cycles in the same process: as it is seen, and as it lights a scene.

Seen straight both engines draw the same smooth picture but for the places of their samples in a pixel: 97 % of the
pixels are compared each by itself, and the rest (rims, which those places decide) with the brightest one. Light is
compared as in test_against_cycles_lights. Each has planted bugs beside it.
"""

import math
from collections.abc import Callable

import bpy
import numpy as np
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles, prepare, render

pytestmark = pytest.mark.usefixtures("registered_addon")

IS_OLD = "NISHITA" in {item.identifier for item in bpy.types.ShaderNodeTexSky.bl_rna.properties["sky_type"].enum_items}
SINGLE = "NISHITA" if IS_OLD else "SINGLE_SCATTERING"
MODELS = [SINGLE] if IS_OLD else [SINGLE, "MULTIPLE_SCATTERING"]
AEROSOL = "dust_density" if IS_OLD else "aerosol_density"
WIDE_SUN = 0.2  # radians: many pixels

SETTINGS = {
    "default": {"sun_size": WIDE_SUN},
    "low": {"sun_elevation": 0.03, "sun_rotation": 0.4, "sun_size": WIDE_SUN},
    "set": {"sun_elevation": -0.06, "sun_rotation": -0.2, "sun_disc": False},
    "high and hazy": {
        "sun_elevation": 1.2,
        "altitude": 3000.0,
        AEROSOL: 3.0,
        "air_density": 0.5,
        "ozone_density": 2.0,
        "sun_disc": False,
    },
    "past the zenith": {"sun_elevation": 2.9, "sun_rotation": 2.6, "sun_size": WIDE_SUN, "sun_intensity": 0.3},
    "flying": {"sun_elevation": -0.02, "sun_size": WIDE_SUN, "altitude": 20000.0},
}
SEEN = [(MODELS[-1], case) for case in SETTINGS] + [(SINGLE, "default"), (SINGLE, "low")][: 2 * len(MODELS) - 2]


def add_sky(scene: bpy.types.Scene, kind: str, **settings: object) -> bpy.types.Node:
    """The sky as the world's background; its node."""
    world = build.set_world(scene, strength=1.0)
    world.cycles.sampling_method = "MANUAL"  # else Cycles makes a map of 8 million pixels for skies without a sun
    world.cycles.sample_map_resolution = 512
    tree = world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = kind
    for name, value in settings.items():
        setattr(sky, name, value)
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    tree.links.new(sky.outputs["Color"], background.inputs["Color"])
    return sky


def look_north(scene: bpy.types.Scene) -> None:
    """From 36 degrees below the horizon to 54 above, where the sun is without a rotation."""
    build.add_camera(scene, (0, 0, 0), (math.radians(99), 0.0, 0.0), lens=18.0)


def differences(scene: bpy.types.Scene, plant: Callable[[], None] | None = None) -> tuple[float, float]:
    """Of pixels: 97th percentile of relative ones (of dim pixels to 1 % of the brightest), and the largest to that."""
    prepare(scene, 48, 48)
    ours = render(scene, "CISTERN", 64, 1)[..., :3]
    if plant:
        plant()
    theirs = render(scene, "CYCLES", 64, 1)[..., :3]
    apart, brightest = np.abs(ours - theirs).max(axis=2), theirs.max()
    relative = apart / np.maximum(theirs.max(axis=2), 0.01 * brightest)
    return float(np.quantile(relative, 0.97)), float(apart.max() / brightest)


def agrees(result: tuple[float, float]) -> bool:
    return result[0] < 0.01 and result[1] < 0.05


@pytest.mark.parametrize(("model", "case"), SEEN)
def test_sky_seen(empty_scene: bpy.types.Scene, model: str, case: str) -> None:
    add_sky(empty_scene, model, **SETTINGS[case])
    look_north(empty_scene)
    result = differences(empty_scene)
    assert agrees(result), result


@pytest.mark.parametrize("direction", [(0.3, 0.8, 0.4), (0.0, 0.0, 1.0)])
def test_preetham_seen(empty_scene: bpy.types.Scene, direction: tuple) -> None:
    add_sky(empty_scene, "PREETHAM", sun_direction=direction, turbidity=4.0)
    look_north(empty_scene)
    result = differences(empty_scene)
    assert agrees(result), result


HOSEK_WILKIE = {
    "default": {"sun_direction": (0.3, 0.8, 0.4)},
    "clear, over snow": {"sun_direction": (0.0, 0.0, 1.0), "turbidity": 1.0, "ground_albedo": 1.0},
    "thick, low": {"sun_direction": (-0.2, 1.0, 0.05), "turbidity": 9.6, "ground_albedo": 0.2},
    "set": {"sun_direction": (0.5, 0.8, -0.3), "turbidity": 4.5, "ground_albedo": 0.7},
}


@pytest.mark.parametrize("case", HOSEK_WILKIE)
def test_hosek_and_wilkie_seen(empty_scene: bpy.types.Scene, case: str) -> None:
    add_sky(empty_scene, "HOSEK_WILKIE", **HOSEK_WILKIE[case])
    look_north(empty_scene)
    result = differences(empty_scene)
    assert agrees(result), result


@pytest.mark.parametrize(("setting", "value"), [("turbidity", 2.3), ("ground_albedo", 0.4)])
def test_another_sky_of_hosek_and_wilkie_is_seen(empty_scene: bpy.types.Scene, setting: str, value: float) -> None:
    """Planted: settings that were 2.2 and 0.3."""
    sky = add_sky(empty_scene, "HOSEK_WILKIE", **HOSEK_WILKIE["default"])
    look_north(empty_scene)
    assert not agrees(differences(empty_scene, lambda: setattr(sky, setting, value)))


def other_way_round(sky: bpy.types.Node) -> None:
    sky.sun_rotation = -sky.sun_rotation


def without_sun(sky: bpy.types.Node) -> None:
    sky.sun_disc = False


def denser(sky: bpy.types.Node) -> None:
    sky.air_density *= 1.05


@pytest.mark.parametrize("plant", [other_way_round, without_sun, denser])
def test_planted_bugs_seen(empty_scene: bpy.types.Scene, plant) -> None:
    sky = add_sky(empty_scene, MODELS[-1], **SETTINGS["low"])
    look_north(empty_scene)
    result = differences(empty_scene, lambda: plant(sky))
    assert not agrees(result), result


def mixed(sky: bpy.types.Node, scene: bpy.types.Scene) -> bpy.types.Node:
    """Puts a mix with a colour between the sky and its background, which it makes brighter."""
    tree = scene.world.node_tree
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    mix = build.shader(tree, "ShaderNodeMixRGB", Fac=0.3, Color1=sky.outputs["Color"], Color2=(0.9, 0.2, 0.1, 1.0))
    tree.links.new(mix.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = 1.7
    return mix


def test_sky_behind_other_nodes(empty_scene: bpy.types.Scene) -> None:
    """Turned, with its disc, by the texture's own mapping; mixed with a colour, and brightened."""
    sky = add_sky(empty_scene, SINGLE, sun_elevation=0.2, sun_size=WIDE_SUN)
    sky.texture_mapping.rotation = (0.3, 0.0, 0.2)
    mixed(sky, empty_scene)
    look_north(empty_scene)
    result = differences(empty_scene)
    assert agrees(result), result


@pytest.mark.parametrize(
    "mapping", [{"Rotation": (0.3, 0.0, 0.2)}, {"Scale": (2.0, 2.0, 2.0)}, {"Location": (0, 0, 0.3)}]
)
def test_sky_through_a_mapping(empty_scene: bpy.types.Scene, mapping: dict) -> None:
    """Its Vector is open to links without a disc alone, and need not have a length of 1. Planted bug: no Mapping."""
    sky = add_sky(empty_scene, MODELS[-1], sun_elevation=0.2, sun_disc=False)
    tree = empty_scene.world.node_tree
    vector = next(s for s in sky.inputs if s.name == "Vector")
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    mapped = build.shader(tree, "ShaderNodeMapping", Vector=coordinates.outputs["Generated"], **mapping)
    tree.links.new(mapped.outputs[0], vector)
    look_north(empty_scene)
    result = differences(empty_scene)
    assert agrees(result), result
    assert not agrees(differences(empty_scene, lambda: tree.links.remove(vector.links[0])))


def test_animated_elevation(empty_scene: bpy.types.Scene) -> None:
    """Each frame has its own sky. Planted bug: Cycles renders another frame."""
    sky = add_sky(empty_scene, MODELS[-1], sun_disc=False)
    for frame, elevation in ((1, 0.05), (10, 0.6)):
        sky.sun_elevation = elevation
        sky.keyframe_insert("sun_elevation", frame=frame)
    look_north(empty_scene)
    for frame in (1, 7):
        empty_scene.frame_set(frame)
        result = differences(empty_scene)
        assert agrees(result), (frame, result)
    assert not agrees(differences(empty_scene, lambda: empty_scene.frame_set(8)))


def lit_stage(scene: bpy.types.Scene) -> None:
    """A ball and its shadow on a floor that fills the picture."""
    build.add_floor(scene, half=50.0)
    build.add_sphere(scene, build.principled("ball", Base_Color=(0.7, 0.5, 0.4, 1), Roughness=0.6))
    build.add_camera(scene, (0.0, -3.5, 3.5), (math.radians(45), 0.0, 0.0))


LIGHT = {"size": (24, 24), "samples": 48, "floor": 1e-3}  # what tables are off, of radiances of 1 and more
LIT = {
    "sun": (SINGLE, {"sun_elevation": 0.5, "sun_rotation": -0.7}),
    "low sun": (MODELS[-1], {"sun_elevation": 0.1, "sun_rotation": -0.7}),
    "no disc": (MODELS[-1], {"sun_disc": False, "sun_rotation": 1.0}),
    "Preetham": ("PREETHAM", {"sun_direction": (0.5, 0.5, 0.4)}),
    "Hosek and Wilkie": ("HOSEK_WILKIE", {"sun_direction": (0.5, 0.5, 0.4)}),
}


@pytest.mark.parametrize("case", LIT)
def test_light_of_sky(empty_scene: bpy.types.Scene, case: str) -> None:
    kind, settings = LIT[case]
    add_sky(empty_scene, kind, **settings)
    lit_stage(empty_scene)
    result = compare_with_cycles(empty_scene, **LIGHT)
    assert result.agrees, result


def larger_sun(sky: bpy.types.Node) -> None:
    sky.sun_size *= 30.0


def weaker_sun(sky: bpy.types.Node) -> None:
    sky.sun_intensity *= 0.95


@pytest.mark.parametrize("plant", [other_way_round, larger_sun, weaker_sun])
def test_planted_bugs_in_light(empty_scene: bpy.types.Scene, plant) -> None:
    sky = add_sky(empty_scene, *LIT["sun"][:1], **LIT["sun"][1])
    lit_stage(empty_scene)
    result = compare_with_cycles(empty_scene, count=4, plant=lambda scene: plant(sky), **LIGHT)
    assert not result.agrees, result
