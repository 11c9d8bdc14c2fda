"""What node graphs make of links and of values at the edge of their range, against Cycles: one graph to a card.

Cards shine evenly enough that what is compared are numbers. Graphs that Blender could evaluate by itself, as it does
from 5.0 on with those of constants alone, are kept from it by adding `zero`, which it does not know to be 0."""

from collections.abc import Callable

import bpy
import pytest
from test_against_cycles_textures import byte_image
from test_against_cycles_values import add_cards, expect_equal, look_down

from tests.support import blender_scenes as build

pytestmark = pytest.mark.usefixtures("registered_addon")

Tree, Socket = bpy.types.NodeTree, bpy.types.NodeSocket
HAS_INTEGERS = bpy.app.version >= (5, 0, 0)
COLOR = (0.1, 0.6, 0.3)


def zero(tree: Tree) -> Socket:
    return tree.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]


def math(tree: Tree, operation: str, a: Socket | float, b: Socket | float) -> Socket:
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    for socket, value in zip(node.inputs, (a, b), strict=False):
        if isinstance(value, Socket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node.outputs[0]


def number(tree: Tree, value: float) -> Socket:
    return math(tree, "ADD", zero(tree), value)


def vector(tree: Tree, *xyz: float) -> Socket:
    channels = dict(zip("XYZ", (number(tree, value) for value in xyz), strict=True))
    return build.shader(tree, "ShaderNodeCombineXYZ", **channels).outputs[0]


def color(tree: Tree) -> Socket:
    channels = dict(zip(("Red", "Green", "Blue"), (number(tree, value) for value in COLOR), strict=True))
    return build.shader(tree, "ShaderNodeCombineColor", **channels).outputs[0]


def through_group(kind: str, source: Callable[[Tree], Socket]) -> Callable[[Tree], Socket]:
    """A value that goes in and out of a group by sockets of a type."""

    def read(tree: Tree) -> Socket:
        group = bpy.data.node_groups.new("group", "ShaderNodeTree")
        for direction in ("INPUT", "OUTPUT"):
            group.interface.new_socket("Value", in_out=direction, socket_type=f"NodeSocket{kind}")
        begin, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        group.links.new(begin.outputs[0], end.inputs[0])
        use = tree.nodes.new("ShaderNodeGroup")
        use.node_tree = group
        tree.links.new(source(tree), use.inputs[0])
        return use.outputs[0]

    return read


def muted(kind: str, name: str, source: Callable[[Tree], Socket]) -> Callable[[Tree], Socket]:
    def read(tree: Tree) -> Socket:
        node = build.shader(tree, kind, **{name: source(tree)})
        node.mute = True
        return node.outputs[0]

    return read


def group_default(kind: str, name: str) -> Callable[[Tree], Socket]:
    """Of a node in a group, one of whose inputs is that of the group, to which nothing is linked."""

    def read(tree: Tree) -> Socket:
        group = bpy.data.node_groups.new("default", "ShaderNodeTree")
        group.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketVector")
        group.interface.new_socket("Value", in_out="OUTPUT", socket_type="NodeSocketFloat")
        begin, end, node = map(group.nodes.new, ("NodeGroupInput", "NodeGroupOutput", kind))
        group.links.new(begin.outputs[0], node.inputs[name])
        group.links.new(node.outputs[0], end.inputs[0])
        use = tree.nodes.new("ShaderNodeGroup")
        use.node_tree = group
        return use.outputs[0]

    return read


def hue(tree: Tree) -> Socket:
    """More than once around."""
    node = build.shader(tree, "ShaderNodeCombineColor", Red=2.07, Green=0.5, Blue=0.3)
    node.mode = "HSL"
    return node.outputs[0]


def empty_range(data_type: str) -> Callable[[Tree], Socket]:
    def read(tree: Tree) -> Socket:
        node = tree.nodes.new("ShaderNodeMapRange")
        node.data_type = data_type
        values = {"Value": number(tree, 0.3)} if data_type == "FLOAT" else {"Vector": vector(tree, 0.3, 0.5, 0.7)}
        ends = {"From Min": 0.5, "From Max": 0.5, "To Min": 0.8, "To Max": 0.4}
        for socket in (socket for socket in node.inputs if socket.enabled and socket.name in ends):
            end = ends[socket.name]
            socket.default_value = end if data_type == "FLOAT" else (end, end, 0.7 * end)
        (name, source), *_ = values.items()
        tree.links.new(source, next(socket for socket in node.inputs if socket.enabled and socket.name == name))
        return next(socket for socket in node.outputs if socket.enabled)

    return read


def limited(tree: Tree) -> Socket:
    """By the texture mapping panel, whose limits do nothing."""
    node = tree.nodes.new("ShaderNodeTexGradient")
    node.texture_mapping.use_max, node.texture_mapping.max = True, (0.1, 0.1, 0.1)
    return node.outputs[0]


def flattened(tree: Tree) -> Socket:
    """By the same panel, which divides by a scale of 0."""
    node = tree.nodes.new("ShaderNodeTexNoise")
    node.texture_mapping.vector_type, node.texture_mapping.scale = "TEXTURE", (1.0, 0.0, 1.0)
    return node.outputs[0]


def faced(tree: Tree, **inputs: Socket) -> Socket:
    """What a bump leads to, by a node that takes its length for what it is."""
    bump = build.shader(tree, "ShaderNodeBump", **inputs).outputs[0]
    return build.shader(tree, "ShaderNodeVectorMath", Vector=bump).outputs[0]


def bumped_by_distance(tree: Tree) -> Socket:
    """To the camera: of that Cycles knows no slope."""
    return faced(tree, Height=tree.nodes.new("ShaderNodeCameraData").outputs["View Distance"])


def long_normal(tree: Tree) -> Socket:
    """Through a bump without a slope, but not without a height."""
    return faced(tree, Height=zero(tree), Normal=vector(tree, 0.3, 0.6, 2.0))


def clipped(tree: Tree) -> Socket:
    """An image without alpha, which it has at its border alone, where something reads that."""
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.extension = byte_image(alpha=True), "CLIP"
    node.image.alpha_mode = "NONE"
    both = tree.nodes.new("ShaderNodeVectorMath")
    for output, socket in zip(("Color", "Alpha"), both.inputs, strict=False):
        tree.links.new(node.outputs[output], socket)
    return both.outputs[0]


GRAPHS: list[Callable[[Tree], Socket]] = [
    *(through_group(kind, color) for kind in ("Float", "Vector")),
    *(through_group(kind, lambda tree: vector(tree, *COLOR)) for kind in ("Float", "Vector", "Color")),
    *([through_group("Int", lambda tree: tree.nodes.new("ShaderNodeValue").outputs[0])] if HAS_INTEGERS else []),  # 0.5
    muted("ShaderNodeMath", "Value", color),
    muted("ShaderNodeRGBToBW", "Color", lambda tree: vector(tree, *COLOR)),
    group_default("ShaderNodeFresnel", "Normal"),
    group_default("ShaderNodeLayerWeight", "Normal"),
    group_default("ShaderNodeTexGradient", "Vector"),
    lambda tree: tree.nodes.new("ShaderNodePointInfo").outputs["Position"],
    hue,
    empty_range("FLOAT"),
    empty_range("FLOAT_VECTOR"),
    limited,
    flattened,
    bumped_by_distance,
    long_normal,
    clipped,
]


def test_graphs(empty_scene) -> None:
    """Planted bug: ranges that are not empty."""
    add_cards(empty_scene, empty_scene.collection, GRAPHS)
    look_down(empty_scene)

    def plant(_scene: bpy.types.Scene) -> None:
        for card in bpy.data.materials:
            for node in card.node_tree.nodes:
                if node.bl_idname == "ShaderNodeMapRange":
                    next(s for s in node.inputs if s.enabled and s.name == "From Max").default_value = (
                        0.7 if node.data_type == "FLOAT" else (0.7, 0.7, 0.7)
                    )

    expect_equal(empty_scene, plant)


def test_world(empty_scene) -> None:
    """To a Camera Data node its direction is a place; it is no object. Planted bug: another output."""
    world = build.set_world(empty_scene)
    world.cycles.sampling_method, tree = "NONE", world.node_tree
    tree.nodes.clear()
    camera = tree.nodes.new("ShaderNodeCameraData")
    kinds = ("ShaderNodeObjectInfo", "ShaderNodeVectorMath", "ShaderNodeBackground", "ShaderNodeOutputWorld")
    info, total, background, output = map(tree.nodes.new, kinds)
    total.operation = "MULTIPLY_ADD"
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "missing"
    for source, target in (
        (camera.outputs["View Vector"], total.inputs[0]),
        (attribute.outputs["Alpha"], total.inputs[1]),
        (info.outputs["Color"], total.inputs[2]),
        (total.outputs[0], background.inputs["Color"]),
        (background.outputs[0], output.inputs["Surface"]),
    ):
        tree.links.new(source, target)
    build.add_camera(empty_scene, (3, 2, 5), (0, 0, 0))

    def plant(_scene: bpy.types.Scene) -> None:
        tree.links.new(camera.outputs["View Distance"], total.inputs[0])

    expect_equal(empty_scene, plant)
