"""Baking against Cycles: what the surface of a head looks like, in an image of its UV map.

What needs no light is compared pixel by pixel, but for the few at the edges of triangles: samples of a pixel spread
over all of it here, and over half of it in Cycles. Light is compared as in test_against_cycles_lights, by t-tests of
block means over replicas, which together fail in one run of a million; lamps that are brighter in Cycles' bakes are the
planted bug."""

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from tests.support import bake_scenes
from tests.support.bake_scenes import BakeScene
from tests.support.slow_cases import marked
from tests.support.statistics import block_means, compare_replicas

pytestmark = pytest.mark.usefixtures("registered_addon")

REPLICAS, SAMPLES, BLOCKS = 6, 32, 4
MEDIAN = 0.01  # difference of a pixel
EDGES = 0.002  # what is let go of block means for pixels at the edges of triangles, where these look elsewhere
PLANTED_WATTS = 1.1 * bake_scenes.LAMP_WATTS

LIGHT = {"DIRECT", "INDIRECT"}
# Type, options, and samples of Cycles, whose bakes of places and normals are good with one alone: in the middle.
SURFACES = {
    "emission": ("EMIT", {}, 4),
    "roughness": ("ROUGHNESS", {}, 4),
    "colour": ("DIFFUSE", {"pass_filter": {"COLOR"}}, 64),
    "gloss": ("GLOSSY", {"pass_filter": {"COLOR"}}, 64),
    "places": ("POSITION", {}, 1),
    "normals": ("NORMAL", {"normal_space": "TANGENT"}, 1),
    "normals of the object": ("NORMAL", {"normal_space": "OBJECT"}, 1),
}
LIGHTS = {
    "all": ("COMBINED", {}),
    "diffuse": ("DIFFUSE", {"pass_filter": LIGHT | {"COLOR"}}),
    "diffuse, white": ("DIFFUSE", {"pass_filter": LIGHT}),
    "diffuse, direct": ("DIFFUSE", {"pass_filter": {"DIRECT", "COLOR"}}),
    "glossy": ("GLOSSY", {"pass_filter": LIGHT | {"COLOR"}}),
    "transmission": ("TRANSMISSION", {"pass_filter": LIGHT | {"COLOR"}}),
}
QUICK = {"all", "diffuse, white"}


def differences(scene: BakeScene, case: str, plant: Callable[[], None] = lambda: None) -> np.ndarray:
    """Of the pixels that show something, the largest of a colour. `plant` comes before Cycles' bake."""
    bake_type, options, samples = SURFACES[case]
    ours = scene.bake("CISTERN", bake_type, 64, **options)
    plant()
    theirs = scene.bake("CYCLES", bake_type, samples, **options)
    shown = theirs[..., 3] > 0.0
    assert shown.sum() > 1000
    np.testing.assert_array_equal(ours[..., 3] > 0.0, shown)
    return np.abs(ours - theirs)[shown][:, :3].max(axis=1)


@pytest.mark.parametrize("case", SURFACES)
def test_surfaces(empty_scene, case):
    found = differences(BakeScene(empty_scene), case)
    assert np.median(found) < MEDIAN
    assert np.quantile(found, 0.98) < 0.05


def test_turned_head_is_seen(empty_scene):
    scene = BakeScene(empty_scene)

    def turn() -> None:
        scene.head.rotation_euler.z += 0.05

    assert np.median(differences(scene, "places", turn)) > 2.0 * MEDIAN


def replicas(scene: BakeScene, engine: str, case: str, first_seed: int) -> np.ndarray:
    bake_type, options = LIGHTS[case]
    seeds = range(first_seed, first_seed + REPLICAS)
    bakes = (scene.bake(engine, bake_type, SAMPLES, seed, **options) for seed in seeds)
    return np.array([block_means(bake[..., :3], BLOCKS, BLOCKS) for bake in bakes])


@pytest.mark.parametrize("case", marked(LIGHTS, LIGHTS.keys() - QUICK))
@pytest.mark.parametrize("preset", marked(["PATH_TRACING", "FINAL", "WORLD_PATHS"], {"FINAL", "WORLD_PATHS"}))
def test_light(empty_scene, case, preset):
    scene = BakeScene(empty_scene)
    empty_scene.cistern.preset = preset
    ours, theirs = replicas(scene, "CISTERN", case, 1), replicas(scene, "CYCLES", case, 1001)
    comparison = compare_replicas(ours, theirs, floor=EDGES)
    assert comparison.agrees, comparison


def test_brighter_lamp_is_seen(empty_scene):
    scene = BakeScene(empty_scene)
    ours = replicas(scene, "CISTERN", "all", 1)
    scene.lamp.data.energy = PLANTED_WATTS
    comparison = compare_replicas(ours, replicas(scene, "CYCLES", "all", 1001), floor=EDGES)
    assert not comparison.agrees, comparison


def test_light_towards_the_camera(empty_scene):
    scene = BakeScene(empty_scene)
    empty_scene.render.bake.view_from = "ACTIVE_CAMERA"
    ours, theirs = replicas(scene, "CISTERN", "all", 1), replicas(scene, "CYCLES", "all", 1001)
    comparison = compare_replicas(ours, theirs, floor=EDGES)
    assert comparison.agrees, comparison
    empty_scene.render.bake.view_from = "ABOVE_SURFACE"
    assert not compare_replicas(replicas(scene, "CISTERN", "all", 2001), theirs, floor=EDGES).agrees


def test_ambient_occlusion(empty_scene):
    scene = BakeScene(empty_scene)
    empty_scene.world.light_settings.distance = 1.0
    ours, theirs = (scene.bake(engine, "AO", 64) for engine in ("CISTERN", "CYCLES"))
    shown = theirs[..., 3] > 0.0
    assert abs(ours[shown].mean() / theirs[shown].mean() - 1.0) < 0.02
    assert np.median(np.abs(ours - theirs)[shown]) < 0.02
    empty_scene.world.light_settings.distance = 0.5
    assert abs(scene.bake("CISTERN", "AO", 64)[shown].mean() / theirs[shown].mean() - 1.0) > 0.03


def test_selected_to_active(empty_scene):
    """The head's colours and normals, on a plane behind it."""
    scene = BakeScene(empty_scene)
    bpy.ops.mesh.primitive_plane_add(size=3.0, location=(0.0, 0.5, 0.0), rotation=(1.5708, 0.0, 0.0))
    plane = bpy.context.object
    plane.data.materials.append(bpy.data.materials.new("plane"))
    plane.data.materials[0].use_nodes = True
    image = bake_scenes.add_target(plane.data.materials[0])
    bake_scenes.select(plane, scene.head)
    options = {"use_selected_to_active": True, "cage_extrusion": 2.0, "image": image}
    for bake_type, samples in (("EMIT", 4), ("NORMAL", 1)):
        ours, theirs = (
            scene.bake("CISTERN", bake_type, 64, **options),
            scene.bake("CYCLES", bake_type, samples, **options),
        )
        assert np.ptp(theirs[..., 0]) > 0.05
        difference = np.abs(ours - theirs)[..., :3].max(axis=2)
        assert np.quantile(difference, 0.95) < 0.02
