"""The live scene of a viewport when the frame changes: sequences and movies, and what is keyframed or driven."""

import bpy
import pytest
from animated_images import image_node, write_movie, write_sequence
from small_objects import grid_with_cubes
from watched_scene import base_color

from addon.sync.live import Exported


def show_in_a_material(image: bpy.types.Image) -> None:
    material = bpy.data.materials["Material 1"]
    node = image_node(material.node_tree, image)
    material.node_tree.links.new(node.outputs["Color"], base_color(material))


def show_in_a_group(image: bpy.types.Image) -> None:
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    output = group.nodes.new("NodeGroupOutput")
    group.links.new(image_node(group, image).outputs["Color"], output.inputs[0])
    material = bpy.data.materials["Material 1"]
    node = material.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    material.node_tree.links.new(node.outputs[0], base_color(material))


def show_in_the_world(image: bpy.types.Image) -> None:
    world = bpy.context.scene.world
    world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    node = image_node(world.node_tree, image, "ShaderNodeTexEnvironment")
    world.node_tree.links.new(node.outputs["Color"], background.inputs["Color"])


def show_in_a_lamp(image: bpy.types.Image) -> None:
    light = bpy.data.lights["AREA Lamp"]
    light.use_nodes = True
    emission = next(node for node in light.node_tree.nodes if node.type == "EMISSION")
    light.node_tree.links.new(image_node(light.node_tree, image).outputs["Color"], emission.inputs["Color"])


def painted_cubes() -> bpy.types.Material:
    """A material that only geometry nodes give away."""
    material = bpy.data.materials.new("Painted")
    material.use_nodes = True
    grid_with_cubes(2, material)
    return material


def show_on_instances(image: bpy.types.Image) -> None:
    material = painted_cubes()
    node = image_node(material.node_tree, image)
    material.node_tree.links.new(node.outputs["Color"], base_color(material))


PLACES = {f.__name__.removeprefix("show_"): f for f in (show_in_a_material, show_in_a_group, show_in_the_world)}
PLACES |= {f.__name__.removeprefix("show_"): f for f in (show_in_a_lamp, show_on_instances)}


@pytest.fixture(scope="module")
def movie(tmp_path_factory):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return write_movie(tmp_path_factory.mktemp("movie"))


def expect_to_follow(watched) -> None:
    for frame in (2, 4, 3):
        before = watched.live.builder.described()
        assert watched.after(lambda frame=frame: bpy.context.scene.frame_set(frame)).materials == 1
        assert watched.live.builder.described() != before
        watched.expect_truth()
    assert len(watched.live.builder.stored["image"]) <= 2, "handles of frames that went are given to others"


@pytest.mark.parametrize("place", PLACES)
def test_a_sequence_follows_the_frame(watched, tmp_path, place) -> None:
    watched.after(lambda: PLACES[place](write_sequence(tmp_path)))
    watched.expect_truth()
    expect_to_follow(watched)


def test_a_movie_follows_the_frame(watched, movie) -> None:
    watched.after(lambda: show_in_a_material(bpy.data.images.load(str(movie))))
    expect_to_follow(watched)


def test_two_materials_may_show_two_frames_of_a_movie(watched, movie) -> None:
    image = bpy.data.images.load(str(movie))
    watched.after(lambda: (show_in_a_material(image), show_on_instances(image)))
    user = next(n for n in bpy.data.materials["Painted"].node_tree.nodes if n.type == "TEX_IMAGE").image_user
    watched.after(lambda: setattr(user, "frame_offset", 2))
    watched.after(lambda: bpy.context.scene.frame_set(2))
    images = [stored["pixels"][0, 0, :3] for stored in watched.live.builder.stored["image"].values()]
    assert {tuple((pixel > 127).tolist()) for pixel in images} >= {(False, True, False), (True, True, False)}
    watched.expect_truth()


def test_a_sequence_that_shows_the_same_file_exports_nothing(watched, tmp_path) -> None:
    watched.after(lambda: show_in_a_material(write_sequence(tmp_path)))
    watched.after(lambda: bpy.context.scene.frame_set(7))
    assert watched.after(lambda: bpy.context.scene.frame_set(8)) == Exported()


def test_a_sequence_without_auto_refresh_stays(watched, tmp_path) -> None:
    watched.after(lambda: show_in_a_material(write_sequence(tmp_path)))
    node = next(n for n in bpy.data.materials["Material 1"].node_tree.nodes if n.type == "TEX_IMAGE")
    watched.after(lambda: setattr(node.image_user, "use_auto_refresh", False))
    assert watched.after(lambda: bpy.context.scene.frame_set(3)) == Exported()


def test_a_sequence_follows_the_frame_beside_what_moves(watched, tmp_path) -> None:
    watched.after(lambda: show_in_a_material(write_sequence(tmp_path)))
    obj = bpy.data.objects["Object 2"]
    for frame in (1, 5):
        obj.location.x = frame
        obj.keyframe_insert("location", frame=frame)
    exported = watched.after(lambda: bpy.context.scene.frame_set(3))
    assert exported.materials == 1 and exported.instances
    watched.expect_truth()


def test_what_is_read_of_the_scene_follows_the_frame_beside_what_moves(watched) -> None:
    def show_frame() -> None:
        tree = bpy.data.materials["Material 1"].node_tree
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_type, node.attribute_name = "VIEW_LAYER", "frame_current"
        tree.links.new(node.outputs["Color"], base_color(bpy.data.materials["Material 1"]))

    def move_with_the_frame() -> None:
        obj = bpy.data.objects["Object 2"]
        for frame in (1, 5):
            obj.location.x = frame
            obj.keyframe_insert("location", frame=frame)

    watched.after(show_frame)
    watched.after(move_with_the_frame)
    for frame in (3, 4):
        exported = watched.after(lambda frame=frame: bpy.context.scene.frame_set(frame))
        assert exported.materials == 1 and exported.instances
        watched.expect_truth()


@pytest.mark.parametrize("kind", ["keyframes", "driver"])
def test_what_animates_a_material_of_geometry_nodes_is_followed(watched, kind) -> None:
    material = painted_cubes()
    roughness = base_color(material).node.inputs["Roughness"]
    if kind == "driver":
        roughness.driver_add("default_value").driver.expression = "frame / 10"
    for frame in (1, 5) if kind == "keyframes" else ():
        roughness.default_value = frame / 10
        roughness.keyframe_insert("default_value", frame=frame)
    watched.after(lambda: bpy.context.scene.frame_set(1))
    for frame in (2, 3):
        assert watched.after(lambda frame=frame: bpy.context.scene.frame_set(frame)).materials == 1
        watched.expect_truth()
