"""Point clouds against Cycles: balls of several sizes, what materials read of them, instances of the whole."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")

SPREAD = (0.1, 0.45)


def by_point(output: str) -> bpy.types.Material:
    """Shines by an output of the Point Info node; ordinary paint for none."""

    def nodes(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        if not output:
            return build.shader(tree, "ShaderNodeBsdfPrincipled", Base_Color=(0.8, 0.3, 0.2, 1.0)).outputs[0]
        if output == "Weight":
            read = tree.nodes.new("ShaderNodeAttribute")
            read.attribute_name = output
            value = read.outputs["Fac"]
        else:
            value = tree.nodes.new("ShaderNodePointInfo").outputs[output]
        return build.shader(tree, "ShaderNodeEmission", Color=value).outputs[0]

    return build.material("points", nodes)


def scatter(scene: bpy.types.Scene, output: str = "", stretch: float = 1.0) -> bpy.types.Object:
    """A cloud with a point in each vertex of a grid over a floor, in an object that is turned and scaled, upwards by
    `stretch` times as much, seen under a lamp and the sky."""
    grid = build.add_mesh(scene, "Grid", [(x, y, 0.5) for x in range(4) for y in range(4)], [], None)
    grid.location, grid.rotation_euler, grid.scale = (-1.5, -1.0, 0.3), (0.0, 0.2, 0.4), (0.9, 0.9, 0.9 * stretch)
    tree = bpy.data.node_groups.new("cloud", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "GeometryNodeMeshToPoints", "GeometryNodeStoreNamedAttribute", "GeometryNodeSetMaterial")
    _, points, store, paint = nodes = [tree.nodes.new(kind) for kind in kinds]
    last = tree.nodes.new("NodeGroupOutput")
    for before, after in zip(nodes, [*nodes[1:], last], strict=True):
        tree.links.new(before.outputs[0], after.inputs[0])
    for node, socket, (low, high) in ((points, "Radius", SPREAD), (store, "Value", (0.0, 1.0))):
        random = tree.nodes.new("FunctionNodeRandomValue")
        floats = [s for s in random.inputs if s.enabled]
        floats[0].default_value, floats[1].default_value = low, high
        target = next(s for s in node.inputs if s.name == socket and s.enabled)
        tree.links.new(next(s for s in random.outputs if s.enabled), target)
    store.inputs["Name"].default_value = "Weight"
    paint.inputs["Material"].default_value = by_point(output)
    grid.modifiers.new("cloud", "NODES").node_group = tree
    build.add_floor(scene)
    build.add_light(scene, "POINT", (1.0, -1.5, 3.0), energy=150.0, shadow_soft_size=0.2)
    build.set_world(scene)
    build.add_camera(scene, (0.0, -6.0, 3.0), (1.13, 0.0, 0.0))
    return grid


def test_balls_are_round_and_shaded_smoothly(empty_scene):
    scatter(empty_scene)
    assert compare_with_cycles(empty_scene).agrees


@pytest.mark.parametrize("output", ["Position", "Radius", "Random", "Weight"])
def test_what_materials_read(empty_scene, output):
    scatter(empty_scene, output, stretch=1.4)
    assert compare_with_cycles(empty_scene).agrees


def test_points_that_share_their_paths(empty_scene):
    scatter(empty_scene)
    assert compare_with_cycles(empty_scene, preset="FINAL").agrees


def test_instances_of_a_cloud(empty_scene):
    cloud = scatter(empty_scene)
    collection = bpy.data.collections.new("Clouds")
    empty_scene.collection.objects.unlink(cloud)
    collection.objects.link(cloud)
    for x in (-1.0, 1.0):
        empty = bpy.data.objects.new("Empty", None)
        empty.location, empty.scale = (x, 0.0, 0.0), (0.5, 0.5, 0.5)
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        empty_scene.collection.objects.link(empty)
    assert compare_with_cycles(empty_scene).agrees


def test_balls_a_twentieth_too_large_are_seen(empty_scene):
    """Planted: in the picture of Cycles."""
    cloud = scatter(empty_scene)

    def grow(scene: bpy.types.Scene) -> None:
        tree = cloud.modifiers[0].node_group
        random = next(n for n in tree.nodes if n.bl_idname == "FunctionNodeRandomValue")
        for socket, value in zip((s for s in random.inputs if s.enabled), SPREAD, strict=False):
            socket.default_value = 1.05 * value
        tree.update_tag()

    assert not compare_with_cycles(empty_scene, plant=grow).agrees


@pytest.mark.parametrize("output", ["Object", "Generated"])
def test_textures_cover_balls(empty_scene, output):
    scatter(empty_scene, stretch=1.4)
    tree = bpy.data.materials["points"].node_tree
    coordinate = tree.nodes.new("ShaderNodeTexCoord").outputs[output]
    shine = build.shader(tree, "ShaderNodeEmission", Color=coordinate).outputs[0]
    tree.links.new(shine, next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Surface"])
    assert compare_with_cycles(empty_scene).agrees
