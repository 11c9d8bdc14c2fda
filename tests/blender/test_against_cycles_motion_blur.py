"""Motion blur against Cycles; method and false-alarm rate as in test_against_cycles_lights."""

import functools
import math

import bpy
import numpy as np
import pytest
from animated_images import image_node, write_sequence

import addon
from tests.support import blender_scenes as build
from tests.support import pass_scenes
from tests.support.engines import compare_with_cycles, prepare, render, replicas
from tests.support.motion_scenes import animate, put_in_motion, resting
from tests.support.statistics import block_means, compare_replicas

pytestmark = pytest.mark.usefixtures("registered_addon")


def flying(scene, ball):
    animate(ball, "location", -0.6, 0.0, 1.0, index=0)


def turning(scene, ball):
    """An uneven object that turns by a quarter about a leaning axis."""
    ball.scale, ball.rotation_euler = (1.2, 0.5, 0.3), (0.4, 0.3, 0.0)
    animate(ball, "rotation_euler", -math.pi / 2, 0.0, math.pi / 2, index=2)


def growing(scene, ball):
    animate(ball, "scale", 0.5, 1.0, 1.4, index=2)


def panning(scene, ball):
    animate(scene.camera, "rotation_euler", -0.3, 0.0, 0.2, index=2)


def zooming(scene, ball):
    animate(scene.camera.data, "lens", 40.0, 60.0, 90.0)


def bending(scene, ball):
    """Points move, and normals with them."""
    ball.shape_key_add(name="Basis")
    key = ball.shape_key_add(name="Bent")
    for point in key.data:
        point.co.x += 0.8 * point.co.z
    animate(key, "value", 0.0, 0.5, 1.0)


def glowing(scene, ball):
    """What lights the scene moves."""
    flying(scene, ball)
    ball.data.materials[0] = build.material(
        "glow", lambda tree: build.shader(tree, "ShaderNodeEmission", Strength=3.0).outputs[0]
    )


def instanced(scene, ball):
    """In a collection that moves."""
    group = bpy.data.collections.new("group")
    scene.collection.objects.unlink(ball)
    group.objects.link(ball)
    empty = bpy.data.objects.new("empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    scene.collection.objects.link(empty)
    flying(scene, empty)


MOTIONS = [flying, turning, growing, panning, zooming, bending, instanced, resting]


@pytest.fixture
def moving(empty_scene):
    return functools.partial(put_in_motion, empty_scene)


@pytest.mark.parametrize("motion", MOTIONS)
def test_motion(moving, motion):
    # In a block Cycles is 0.2 and 0.4 % off the mean of its own stills at 96 and 64 moments; we are not.
    result = compare_with_cycles(moving(motion), floor=0.002 if motion in (zooming, growing) else 0.0)
    assert result.agrees, result


def driving(scene, ball):
    animate(scene.camera, "location", -0.5, 0.0, 0.4, index=0)


@pytest.mark.parametrize("motion", [panning, driving])
@pytest.mark.parametrize("output", ["Window", "Camera"])
def test_coordinates_of_a_moving_camera(moving, motion, output):
    """Those of the middle of the exposure: by those of each moment blocks are 2 to 7 % off."""
    scene = moving(motion)

    def glow(tree):
        place = tree.nodes.new("ShaderNodeTexCoord").outputs[output]
        scaled = build.shader(tree, "ShaderNodeVectorMath", Vector=place)
        scaled.operation = "ABSOLUTE"
        return build.shader(tree, "ShaderNodeEmission", Color=scaled.outputs[0]).outputs[0]

    ball = next(obj for obj in scene.objects if obj.type == "MESH" and obj.name != "floor")
    ball.data.materials[0] = build.material("glow", glow)
    result = compare_with_cycles(scene)
    assert result.agrees, result


@pytest.mark.parametrize("position", ["START", "END"])
def test_position_of_the_shutter(moving, position):
    result = compare_with_cycles(moving(flying, position, 0.8))
    assert result.agrees, result


def open_slowly(scene):
    """The shutter, and close it at once."""
    points = scene.render.motion_blur_shutter_curve.curves[0].points
    points[0].location, points[-1].location = (0.0, 0.0), (1.0, 1.0)
    scene.render.motion_blur_shutter_curve.update()


# Cycles' table leaves out the last 0.4 % of the light, which of a ROUND shutter is that of its last 3 % of time, of a
# LINE of its last 4 %: with that it is 0.6 % off the mean of its own stills in a block, and we 0.2 %.
CURVE_FLOORS = {"ROUND": 0.005, "LINE": 0.001}


@pytest.mark.parametrize("shape", ["LINE", "ROUND", "slow"])
def test_curve_of_the_shutter(moving, shape):
    scene = moving(flying)
    open_slowly(scene) if shape == "slow" else bpy.ops.render.shutter_curve_preset(shape=shape)
    result = compare_with_cycles(scene, floor=CURVE_FLOORS.get(shape, 0.0))
    assert result.agrees, result


@pytest.mark.parametrize("shape", CURVE_FLOORS)
def test_another_curve_is_seen(moving, shape):
    """Planted: for Cycles, the shutter is all open."""

    def plant(scene):
        bpy.ops.render.shutter_curve_preset(shape="MAX")

    scene = moving(flying)
    bpy.ops.render.shutter_curve_preset(shape=shape)
    assert not compare_with_cycles(scene, plant=plant, floor=CURVE_FLOORS[shape]).agrees


def test_a_shutter_that_never_opens_counts_as_open(moving):
    """As in Cycles."""
    scene = moving(flying)
    prepare(scene, 16, 16)
    expected = render(scene, "CISTERN", 4, 1)
    for point in scene.render.motion_blur_shutter_curve.curves[0].points:
        point.location[1] = 0.0
    scene.render.motion_blur_shutter_curve.update()
    assert np.array_equal(render(scene, "CISTERN", 4, 1), expected)


@pytest.mark.parametrize("motion", [flying, panning])
def test_final(moving, motion):
    """With shared paths."""
    result = compare_with_cycles(moving(motion), preset="FINAL", samples=48)
    assert result.agrees, result


REPLICAS, BLOCKS = 6, 4


def value_at(scene, owner, path, time):
    scene.frame_set(math.floor(time), subframe=time % 1.0)
    return np.array(getattr(owner, path))


def means_of_stills(scene, owner, path, length=1.0, moments=24, samples=4):
    """Blocks of pictures by Cycles, each the mean of stills at random moments, one of every part of the time that a
    shutter is open for `length` frames. What is at `path` goes straight from its opening to the middle and on to its
    closing, as blur has it."""
    keys = [value_at(scene, owner, path, time) for time in (0.5, 1.0, 1.5)]
    owner.animation_data_clear()
    scene.render.use_motion_blur = False
    scene.frame_set(1)
    random = np.random.default_rng(1)

    def still(moment, seed):
        time = length * ((moment + random.random()) / moments - 0.5)
        end = keys[0 if time < 0.0 else 2]
        setattr(owner, path, keys[1] + 2.0 * abs(time) * (end - keys[1]))
        return render(scene, "CYCLES", samples, seed)

    means = []
    for seed in range(2001, 2001 + REPLICAS):
        means.append(block_means(np.mean([still(moment, seed) for moment in range(moments)], axis=0), BLOCKS, BLOCKS))
    return np.array(means)


def compare_with_stills(scene, motion, preset="PATH_TRACING", **stills):
    owner = scene.camera if motion is panning else bpy.data.objects["sphere"]
    path = {panning: "rotation_euler", growing: "scale"}.get(motion, "location")
    prepare(scene, 48, 48)
    scene.cistern.preset = preset
    blurred = replicas(scene, "CISTERN", REPLICAS, 48, BLOCKS)
    return compare_replicas(blurred, means_of_stills(scene, owner, path, **stills))


@pytest.mark.parametrize(
    ("motion", "preset"),
    [
        (glowing, "PATH_TRACING"),
        (glowing, "FINAL"),
        *(pytest.param(motion, "PATH_TRACING", marks=pytest.mark.slow) for motion in (flying, growing, panning)),
    ],
)
def test_blur_is_the_mean_of_stills(moving, motion, preset):
    """Of what glows and moves, Cycles' own blur is not: it is off by up to 0.8 % of the mean in blocks of 8 x 8."""
    result = compare_with_stills(moving(motion), motion, preset)
    assert result.agrees, result


def test_stills_of_another_shutter_are_seen(moving):
    """Planted: they leave out a quarter of the time."""
    assert not compare_with_stills(moving(glowing), glowing, length=0.75).agrees


@pytest.mark.parametrize("motion", [flying, panning, bending])
def test_another_shutter_is_seen(moving, motion):
    """Planted: Cycles' shutter is open longer by a third."""

    def plant(scene):
        scene.render.motion_blur_shutter *= 4.0 / 3.0

    assert not compare_with_cycles(moving(motion), plant=plant).agrees


@pytest.mark.parametrize("position", ["START", "CENTER", "END"])
def test_materials_and_worlds_are_those_of_the_frame(moving, position):
    """Whenever the shutter is open, as in Cycles."""
    scene = moving(resting, position)
    ball = bpy.data.objects["sphere"]
    tree = build.material("glow", lambda tree: build.shader(tree, "ShaderNodeEmission").outputs[0]).node_tree
    ball.data.materials[0] = bpy.data.materials["glow"]
    for owner, kind in ((tree, "EMISSION"), (scene.world.node_tree, "BACKGROUND")):
        strength = next(n for n in owner.nodes if n.type == kind).inputs["Strength"]
        animate(strength, "default_value", 0.5, 1.0, 4.0)
    scene.frame_set(1)
    result = compare_with_cycles(scene)
    assert result.agrees, result


@pytest.mark.parametrize("position", ["START", "END"])
def test_sequences_show_the_frame_that_is_rendered(moving, tmp_path, position):
    """Whenever the shutter is open, as in Cycles."""
    scene = moving(flying, position, 1.0)
    image = write_sequence(tmp_path)

    def screen(tree):
        return build.shader(tree, "ShaderNodeEmission", Color=image_node(tree, image).outputs["Color"]).outputs[0]

    bpy.data.objects["floor"].data.materials[0] = build.material("screen", screen)
    result = compare_with_cycles(scene)
    assert result.agrees, result


def test_the_scene_is_back_at_its_frame(moving):
    scene = moving(flying, "END", 0.7)
    prepare(scene, 8, 8)
    scene.cistern.preset = "PATH_TRACING"
    render(scene, "CISTERN", 1, 1)
    assert (scene.frame_current, scene.frame_subframe) == (1, 0.0)


@pytest.mark.parametrize("position", ["START", "CENTER", "END"])
def test_the_scene_is_evaluated_as_often_as_by_cycles(moving, position):
    scene = moving(flying, position)
    prepare(scene, 8, 8)
    visited = []

    def visit(visited_scene, _):
        visited.append(visited_scene.frame_float)

    bpy.app.handlers.frame_change_post.append(visit)
    counts = []
    for engine in ("CISTERN", "CYCLES"):
        visited.clear()
        render(scene, engine, 1, 1)
        counts.append(len(visited))
    bpy.app.handlers.frame_change_post.remove(visit)
    assert counts[0] == counts[1]
    assert scene.frame_float == 1.0


@pytest.mark.parametrize("vector", [False, True], ids=["blur", "vector"])
def test_the_scene_is_back_before_frame_zero(moving, vector):
    """Blender has -3.75 as frame -3 and subframe -0.75."""
    scene = moving(flying)
    scene.render.use_motion_blur, scene.view_layers[0].use_pass_vector = not vector, vector
    prepare(scene, 8, 8)
    scene.cistern.preset = "PATH_TRACING"
    scene.frame_set(-4, subframe=0.25)
    assert scene.frame_float == -3.75
    render(scene, "CISTERN", 1, 1)
    assert scene.frame_float == -3.75


def test_techniques_that_keep_samples_say_that_there_is_none(moving):
    scene = moving(flying)
    prepare(scene, 16, 16)
    scene.cistern.preset = "RESTIR_GI"
    blurred = render(scene, "CISTERN", 4, 1)
    assert [w for line in addon.report.last for w in line.warnings if "motion blur" in w]
    scene.render.use_motion_blur = False
    assert np.array_equal(blurred, render(scene, "CISTERN", 4, 1))


def test_a_rolling_shutter_is_named(moving):
    scene = moving(flying)
    prepare(scene, 8, 8)
    scene.cycles.rolling_shutter_type = "TOP"
    render(scene, "CISTERN", 1, 1)
    assert [w for line in addon.report.last for w in line.warnings if "rolling shutter" in w]


def spinning(scene, ball):
    """An uneven object that turns about twice, too far to be told from three moments."""
    ball.scale, ball.rotation_euler = (1.2, 0.5, 0.3), (0.4, 0.3, 0.0)
    animate(ball, "rotation_euler", -4.0, 0.5, 6.0, index=2)


def waving(scene, ball):
    """Points that swing far to one side and back between moments of the middle and the ends."""
    bending(scene, ball)
    curve = ball.data.shape_keys.animation_data.action.layers[0].strips[0].channelbags[0].fcurves[0]
    for frame, value in ((0.4, 1.0), (1.0, 0.0), (1.6, 1.0)):
        curve.keyframe_points.insert(frame, value)


def spinning_beside(scene, ball):
    """Another ball is looked at less often."""
    spinning(scene, ball)
    other = bpy.data.objects.new("other", ball.data)
    scene.collection.objects.link(other)
    other.location.x = 1.0
    animate(other, "location", 0.0, 1.0, 0.5, index=2)


@pytest.mark.parametrize(
    "motion",
    [
        spinning_beside,
        pytest.param(spinning, marks=pytest.mark.slow),
        *([pytest.param(waving, marks=pytest.mark.slow)] if bpy.app.version >= (5, 0) else ()),
    ],
)
def test_motion_steps(moving, motion):
    scene = moving(motion)
    bpy.data.objects["sphere"].cycles.motion_steps = 4
    result = compare_with_cycles(scene)
    assert result.agrees, result


def test_other_motion_steps_are_seen(moving):
    """Planted: Cycles looks at three moments."""

    def plant(scene):
        bpy.data.objects["sphere"].cycles.motion_steps = 1

    scene = moving(spinning)
    bpy.data.objects["sphere"].cycles.motion_steps = 4
    assert not compare_with_cycles(scene, plant=plant).agrees


def flying_and_bending(scene, ball):
    flying(scene, ball)
    bending(scene, ball)


UNBLURRED = [
    pytest.param(flying_and_bending, "sphere", "use_motion_blur", marks=pytest.mark.slow),
    (flying_and_bending, "sphere", "use_deform_motion"),
    pytest.param(instanced, "sphere", "use_motion_blur", marks=pytest.mark.slow),
    (instanced, "empty", "use_motion_blur"),
]


def fly_by(scene):
    """The camera, so that what rests in the world is blurred."""
    panning(scene, None)


@pytest.mark.parametrize(("motion", "name", "switch"), UNBLURRED)
def test_objects_that_are_not_blurred(moving, motion, name, switch):
    scene = moving(motion)
    fly_by(scene)
    setattr(bpy.data.objects[name].cycles, switch, False)
    result = compare_with_cycles(scene)
    assert result.agrees, result


def test_a_camera_that_is_not_blurred(moving):
    scene = moving(flying)
    fly_by(scene)
    scene.camera.cycles.use_motion_blur = False
    result = compare_with_cycles(scene)
    assert result.agrees, result


@pytest.mark.parametrize("switch", [pytest.param("use_motion_blur", marks=pytest.mark.slow), "use_deform_motion"])
def test_blur_that_is_switched_off_is_seen(moving, switch):
    """Planted: for Cycles it is on."""

    def plant(scene):
        setattr(bpy.data.objects["sphere"].cycles, switch, True)

    scene = moving(flying_and_bending)
    setattr(bpy.data.objects["sphere"].cycles, switch, False)
    assert not compare_with_cycles(scene, plant=plant).agrees


def test_with_blur_there_are_no_vectors(moving):
    """As in Cycles."""
    scene = moving(flying)
    scene.view_layers[0].use_pass_vector = True
    pass_scenes.prepare_layers(scene, "PATH_TRACING")
    found = {}
    for engine in ("CISTERN", "CYCLES"):
        channels, _ = pass_scenes.render_layers(scene, engine, 4)
        found[engine] = channels["ViewLayer.Vector.X"]
    assert not found["CISTERN"].any() and not found["CYCLES"].any()
    scene.render.use_motion_blur = False
    channels, _ = pass_scenes.render_layers(scene, "CISTERN", 4)
    assert channels["ViewLayer.Vector.X"].any()


@pytest.mark.parametrize("preset", ["PATH_TRACING", "FINAL"])
def test_where_nothing_moves_the_picture_is_that_without_blur(moving, preset):
    scene = moving(resting)
    prepare(scene, 16, 16)
    scene.cistern.preset = preset
    blurred = render(scene, "CISTERN", 4, 1)
    scene.render.use_motion_blur = False
    assert np.array_equal(blurred, render(scene, "CISTERN", 4, 1))


def test_stereo_blurs_what_moves_before_resting_cameras(moving):
    scene = moving(flying)
    prepare(scene, 24, 24)
    scene.cistern.preset = "PATH_TRACING"
    scene.render.use_multiview = True
    scene.render.image_settings.views_format = "STEREO_3D"
    animate(scene.camera, "location", -5.0, 0.0, 5.0, index=0)
    scene.frame_set(1)
    with_pan = render(scene, "CISTERN", 8, 1)
    scene.camera.animation_data_clear()
    assert np.array_equal(with_pan, render(scene, "CISTERN", 8, 1))
    scene.render.use_motion_blur = False
    assert not np.array_equal(with_pan, render(scene, "CISTERN", 8, 1))
