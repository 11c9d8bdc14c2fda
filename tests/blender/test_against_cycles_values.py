"""What materials read of objects and instances, against Cycles: Object Info and Attribute nodes, one to a card.

Cards shine evenly, one to a block: what is compared are numbers, within `ROUNDING` of them."""

from collections.abc import Callable
from functools import partial

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")

ROUNDING = 1e-4
SIDE = 4
Read = Callable[[bpy.types.NodeTree], bpy.types.NodeSocket]


def info(output: str) -> Read:
    return lambda tree: tree.nodes.new("ShaderNodeObjectInfo").outputs[output]


def attribute(kind: str, name: str, output: str = "Color") -> Read:
    def read(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_type, node.attribute_name = kind, name
        return node.outputs[output]

    return read


OBJECT_READS = [
    *(info(output) for output in ("Color", "Alpha", "Object Index", "Material Index")),
    *(attribute("OBJECT", "tint", output) for output in ("Color", "Fac", "Vector", "Alpha")),
    *(attribute("OBJECT", name) for name in ("grey", "two", "of mesh", "location", "color", "missing")),
    attribute("OBJECT", "missing", "Alpha"),
    attribute("OBJECT", "two", "Alpha"),
]
INSTANCE_READS = [
    *(info(output) for output in ("Color", "Alpha", "Object Index")),
    *(attribute("INSTANCER", "tint", output) for output in ("Color", "Alpha")),
    *(attribute("OBJECT", "tint", output) for output in ("Color", "Fac")),
    *(attribute("INSTANCER", name) for name in ("grey", "two", "of mesh", "location", "color", "missing")),
    attribute("OBJECT", "color"),
    attribute("INSTANCER", "missing", "Alpha"),
    attribute("INSTANCER", "color", "Alpha"),
]
LAYER_READS = [
    *(attribute("VIEW_LAYER", "tint", output) for output in ("Color", "Fac", "Vector", "Alpha")),
    *(
        attribute("VIEW_LAYER", name)
        for name in ("of scene", "of world", "frame_current", "missing", "", "text", "five")
    ),
    attribute("VIEW_LAYER", "missing", "Alpha"),
]


MESH_VALUES = {
    "FLOAT": ("value", 0.35),
    "FLOAT2": ("vector", (0.3, 0.5)),
    "FLOAT_VECTOR": ("vector", (0.2, 0.7, 0.4)),
    "FLOAT_COLOR": ("color", (0.6, 0.1, 0.3, 0.7)),
}
MESH_READS = [
    attribute("GEOMETRY", f"a {kind}", output) for kind in MESH_VALUES for output in ("Color", "Fac", "Vector", "Alpha")
]


def add_cards(scene: bpy.types.Scene, collection: bpy.types.Collection, reads: list[Read]) -> None:
    for index, read in enumerate(reads):
        surface = build.material(
            f"card {index}",
            lambda tree, read=read: build.shader(tree, "ShaderNodeEmission", Color=read(tree)).outputs[0],
        )
        surface.pass_index = 1 + index % 3
        x, y = index % SIDE - SIDE / 2, index // SIDE - SIDE / 2
        card = build.add_mesh(scene, "card", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)], surface)
        card.location = (x, y, 0)
        scene.collection.objects.unlink(card)
        collection.objects.link(card)
        card.color, card.pass_index = (0.1 + 0.05 * index, 0.5, 0.3, 0.7), 2 + index % 3
        card["tint"], card["grey"], card["two"] = [0.2, 0.04 * index, 0.6, 0.4], 0.35, [0.3, 0.5]
        card.data["of mesh"] = 3


def look_down(scene: bpy.types.Scene) -> None:
    camera = build.add_camera(scene, (0, 0, 5), (0, 0, 0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", SIDE


def expect_equal(scene: bpy.types.Scene, plant: Callable[[bpy.types.Scene], None]) -> None:
    """And Cycles sees `plant`."""
    result = compare_with_cycles(scene, (16, 16), samples=4, count=3, blocks=SIDE, floor=ROUNDING)
    assert result.agrees, result
    assert not compare_with_cycles(scene, (16, 16), samples=4, count=3, blocks=SIDE, floor=ROUNDING, plant=plant).agrees


def other_tint(scene: bpy.types.Scene) -> None:
    for owner in (*scene.objects, *scene.view_layers):
        if "tint" in owner:
            owner["tint"] = [0.21, 0.1, 0.6, 0.4]


def test_objects(empty_scene) -> None:
    add_cards(empty_scene, empty_scene.collection, OBJECT_READS)
    look_down(empty_scene)
    expect_equal(empty_scene, other_tint)


def test_meshes(empty_scene) -> None:
    """The same in all corners or points."""
    add_cards(empty_scene, empty_scene.collection, MESH_READS)
    for index, card in enumerate(empty_scene.collection.objects):
        for kind, (part, value) in MESH_VALUES.items():
            layer = card.data.attributes.new(f"a {kind}", kind, ("CORNER", "POINT")[index % 2])
            for element in layer.data:
                setattr(element, part, value)
    look_down(empty_scene)

    def other_pair(scene: bpy.types.Scene) -> None:
        for card in scene.collection.objects:
            for element in card.data.attributes["a FLOAT2"].data if card.type == "MESH" else ():
                element.vector = (0.31, 0.5)

    expect_equal(empty_scene, other_pair)


def named(kind: str, member: str, name: str) -> Read:
    """The first output of such a node, one of whose members is a name."""

    def read(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        node = tree.nodes.new(kind)
        setattr(node, member, name)
        return node.outputs[0]

    return read


uv_map = partial(named, "ShaderNodeUVMap", "uv_map")
painted = partial(named, "ShaderNodeVertexColor", "layer_name")


def test_names_of_what_is_no_attribute_of_its_kind(empty_scene) -> None:
    """Vertex groups, UV maps that are none, and colours without a name, which are not those called Color. Planted bug:
    other weights."""
    reads = [
        attribute("GEOMETRY", "weights"),
        attribute("GEOMETRY", "weights", "Fac"),
        uv_map("a FLOAT_VECTOR"),
        uv_map("a FLOAT2"),
        uv_map("a FLOAT_COLOR"),
        painted(""),
        painted("Paint"),
        attribute("GEOMETRY", "Color"),
    ]
    add_cards(empty_scene, empty_scene.collection, reads)
    cards = [thing for thing in empty_scene.objects if thing.type == "MESH"]
    for index, card in enumerate(cards):
        card.vertex_groups.new(name="other")
        card.vertex_groups.new(name="weights").add(range(4), 0.3, "REPLACE")
        for kind, (member, value) in MESH_VALUES.items():
            values = card.data.attributes.new(f"a {kind}", kind, "POINT").data
            for element in values:
                setattr(element, member, value)
        for name, value in (("Paint", 0.7), *([("Color", 0.2)] if index < 6 else [])):
            layer = card.data.color_attributes.new(name, "FLOAT_COLOR", "POINT")
            layer.data.foreach_set("color", [value] * 16)
        card.data.color_attributes.render_color_index = card.data.color_attributes.find("Paint")
    look_down(empty_scene)

    def plant(scene: bpy.types.Scene) -> None:
        for card in cards:
            card.vertex_groups["weights"].add(range(4), 0.4, "REPLACE")

    expect_equal(empty_scene, plant)


def test_instances_of_a_collection(empty_scene) -> None:
    """Some have a property that their instancer has too."""
    collection = bpy.data.collections.new("cards")
    add_cards(empty_scene, collection, INSTANCE_READS)
    instancer = bpy.data.objects.new("instancer", None)
    instancer.instance_type, instancer.instance_collection = "COLLECTION", collection
    empty_scene.collection.objects.link(instancer)
    instancer["tint"], instancer.color, instancer.pass_index = [0.9, 0.05, 0.3, 0.2], (0.9, 0.8, 0.1, 0.5), 7
    look_down(empty_scene)
    expect_equal(empty_scene, other_tint)


def test_view_layers(empty_scene) -> None:
    add_cards(empty_scene, empty_scene.collection, LAYER_READS)
    build.set_world(empty_scene)["of world"] = 0.4
    empty_scene.view_layers[0]["tint"] = [0.5, 0.1, 0.2, 0.3]
    empty_scene["text"], empty_scene["five"] = "12", [0.1, 0.2, 0.3, 0.4, 0.5]
    empty_scene["of scene"], empty_scene.world["of scene"] = [0.1, 0.6, 0.2], 0.9
    look_down(empty_scene)
    expect_equal(empty_scene, other_tint)


def test_islands(empty_scene) -> None:
    """A mesh of 16 cards of 9 vertices each, some of which are triangles. Planted bug: two of the cards are joined."""
    surface = build.material(
        "islands",
        lambda tree: build.shader(
            tree, "ShaderNodeEmission", Color=tree.nodes.new("ShaderNodeNewGeometry").outputs["Random Per Island"]
        ).outputs[0],
    )
    points, polygons = [], []
    for card in range(SIDE * SIDE):
        corner = [3 * j + i + len(points) for j in range(2) for i in range(2)]
        points += [
            (card % SIDE - SIDE / 2 + 0.49 * i, card // SIDE - SIDE / 2 + 0.49 * j, 0)
            for j in range(3)
            for i in range(3)
        ]
        polygons += [(k, k + 1, k + 4, k + 3) for k in corner[1:]]
        polygons += [(corner[0] + 4, corner[0] + 3, corner[0]), (corner[0], corner[0] + 1, corner[0] + 4)]
    cards = build.add_mesh(empty_scene, "cards", points, polygons, surface)
    look_down(empty_scene)

    def join(_scene: bpy.types.Scene) -> None:
        cards.data.edges.add(1)
        cards.data.edges[-1].vertices = (20, 40)

    expect_equal(empty_scene, join)


def test_pointiness(empty_scene) -> None:
    """Of pyramids of different heights, some of whose sides are apart. Planted bug: one of them is 5 cm higher."""

    def shade(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        sharp = tree.nodes.new("ShaderNodeNewGeometry").outputs["Pointiness"]
        wide = build.shader(tree, "ShaderNodeMapRange", Value=sharp, From_Min=0.2, From_Max=0.8)
        return build.shader(tree, "ShaderNodeEmission", Color=wide.outputs[0]).outputs[0]

    surface = build.material("pointy", shade)
    for index in range(SIDE * SIDE):
        x, y, top = index % SIDE - SIDE / 2, index // SIDE - SIDE / 2, 0.1 * index - 0.7
        points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, top), (0.5, 0.5, top)]
        sides = [(0, 1, 4), (1, 2, 4), (2, 3, 4 + index % 2), (3, 0, 4 + index % 2)]
        pyramid = build.add_mesh(empty_scene, "pyramid", points, sides, surface, smooth=True)
        pyramid.location = (x, y, 0)
    look_down(empty_scene)

    def plant(_scene: bpy.types.Scene) -> None:
        for vertex in pyramid.data.vertices[4:]:
            vertex.co.z += 0.05

    expect_equal(empty_scene, plant)


def instances_on_points(
    scene: bpy.types.Scene, card: bpy.types.Object, data_type: str, has_mesh: bool
) -> bpy.types.Object:
    """Cards on a grid by geometry nodes, each with a random attribute "tint"."""
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    kinds = "NodeGroupInput NodeGroupOutput GeometryNodeMeshGrid GeometryNodeObjectInfo GeometryNodeInstanceOnPoints"
    begin, end, grid, source, scatter = map(tree.nodes.new, kinds.split())
    store, number, join = map(
        tree.nodes.new, ("GeometryNodeStoreNamedAttribute", "FunctionNodeRandomValue", "GeometryNodeJoinGeometry")
    )
    for name, value in {"Size X": 3, "Size Y": 3, "Vertices X": 4, "Vertices Y": 4}.items():
        grid.inputs[name].default_value = value
    source.inputs["Object"].default_value = card
    store.domain, store.data_type, number.data_type = "INSTANCE", data_type, "FLOAT_VECTOR"
    store.inputs["Name"].default_value = "tint"
    join_links = [(begin.outputs[0], join.inputs[0])] if has_mesh else []
    value_in = next(socket for socket in store.inputs if socket.name == "Value" and socket.enabled)
    for link in (
        (grid.outputs["Mesh"], scatter.inputs["Points"]),
        (source.outputs["Geometry"], scatter.inputs["Instance"]),
        (scatter.outputs[0], store.inputs[0]),
        (number.outputs[0], value_in),
        (store.outputs[0], join.inputs[0]),
        *join_links,
        (join.outputs[0], end.inputs[0]),
    ):
        tree.links.new(*link)
    holder = build.add_floor(scene, half=SIDE / 2)
    holder.location = (-0.5, -0.5, -0.5)
    holder["tint"] = 0.3
    holder.modifiers.new("scatter", "NODES").node_group = tree
    return holder


def in_collection(scene: bpy.types.Scene, obj: bpy.types.Object) -> bpy.types.Object:
    """An instance of a collection that has an object, and others before it."""
    collection = bpy.data.collections.new("around")
    for other in (bpy.data.objects.new("aside", None), bpy.data.objects.new("hidden", None), obj):
        collection.objects.link(other)
        other.hide_render = other.hide_viewport = other.name.startswith("hidden")
    if obj.name in scene.collection.objects:
        scene.collection.objects.unlink(obj)
    instancer = bpy.data.objects.new("instancer", None)
    instancer.instance_type, instancer.instance_collection = "COLLECTION", collection
    scene.collection.objects.link(instancer)
    return instancer


def in_geometry_nodes(scene: bpy.types.Scene, obj: bpy.types.Object, kind: str) -> bpy.types.Object:
    """Geometry nodes that instance an object (OBJECT) or its collection (COLLECTION), with attributes of their own."""
    shown = obj if kind == "OBJECT" else in_collection(scene, obj).instance_collection
    for linked in [member for member in scene.collection.objects if member.name.startswith("instancer")]:
        scene.collection.objects.unlink(linked)
    if obj.name in scene.collection.objects:
        scene.collection.objects.unlink(obj)
    tree = bpy.data.node_groups.new("around", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    end, source, points, scatter = map(
        tree.nodes.new,
        (
            "NodeGroupOutput",
            "GeometryNodeObjectInfo" if kind == "OBJECT" else "GeometryNodeCollectionInfo",
            "GeometryNodePoints",
            "GeometryNodeInstanceOnPoints",
        ),
    )
    source.inputs[0].default_value = shown
    source.transform_space = "RELATIVE"
    if kind == "OBJECT":
        source.inputs["As Instance"].default_value = True
    tree.links.new(source.outputs["Geometry" if kind == "OBJECT" else 0], scatter.inputs["Instance"])
    tree.links.new(points.outputs[0], scatter.inputs["Points"])
    last = scatter.outputs[0]
    for name, value in {"tint": (0.9, 0.1, 0.1, 1.0), "outer": (0.1, 0.7, 0.3, 1.0)}.items():
        store = tree.nodes.new("GeometryNodeStoreNamedAttribute")
        store.domain, store.data_type = "INSTANCE", "FLOAT_COLOR"
        store.inputs["Name"].default_value = name
        next(i for i in store.inputs if i.name == "Value" and i.enabled).default_value = value
        tree.links.new(last, store.inputs[0])
        last = store.outputs[0]
    tree.links.new(last, end.inputs[0])
    holder = build.add_floor(scene, half=0.1)
    holder.modifiers.new("around", "NODES").node_group = tree
    return holder


AROUND = {
    "collection": ("tint", in_collection),
    "collection in a collection": ("tint", lambda scene, obj: in_collection(scene, in_collection(scene, obj))),
    "object": ("tint", lambda scene, obj: in_geometry_nodes(scene, obj, "OBJECT")),
    "object, outer": ("outer", lambda scene, obj: in_geometry_nodes(scene, obj, "OBJECT")),
    "nodes' collection": ("tint", lambda scene, obj: in_geometry_nodes(scene, obj, "COLLECTION")),
    "nodes' collection in a collection": (
        "outer",
        lambda scene, obj: in_collection(scene, in_geometry_nodes(scene, obj, "COLLECTION")),
    ),
}


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="bpy tells nothing of instances of geometry nodes")
@pytest.mark.parametrize("has_mesh", [False, True])
@pytest.mark.parametrize("case", AROUND)
def test_instances_in_instances(empty_scene, case, has_mesh) -> None:
    """The innermost level that has the attribute counts."""
    name, put = AROUND[case]
    hidden = bpy.data.collections.new("hidden")
    add_cards(empty_scene, hidden, [attribute("INSTANCER", name)])
    card = hidden.objects[0]
    put(empty_scene, instances_on_points(empty_scene, card, "FLOAT_COLOR", has_mesh))
    look_down(empty_scene)

    def plant(_scene: bpy.types.Scene) -> None:
        node = next(n for n in card.data.materials[0].node_tree.nodes if n.bl_idname == "ShaderNodeAttribute")
        node.attribute_type = "OBJECT"

    expect_equal(empty_scene, plant)


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="bpy tells nothing of instances of geometry nodes")
@pytest.mark.parametrize("has_hidden", [False, True])
def test_instances_inside_of_children_warn(empty_scene, recorded_sync, has_hidden) -> None:
    """Also beside what an animation hides: the dependency graph has it, not evaluated."""
    hidden = bpy.data.collections.new("hidden")
    add_cards(empty_scene, hidden, [attribute("INSTANCER", "tint")])
    holder = instances_on_points(empty_scene, hidden.objects[0], "FLOAT_COLOR", False)
    parent = build.add_floor(empty_scene, half=1)
    parent.name, parent.instance_type, holder.parent = "parent", "VERTS", parent
    if has_hidden:
        other = build.add_floor(empty_scene)
        for switch in ("hide_render", "hide_viewport"):
            setattr(other, switch, True)
            other.keyframe_insert(switch)
    look_down(empty_scene)
    _, report = recorded_sync()
    assert [w for w in report.warnings if "tint" in w] == [
        "Object 'parent': attribute 'tint' that geometry nodes give instances inside of its particles or children is "
        "not supported"
    ]


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="bpy tells nothing of instances of geometry nodes")
@pytest.mark.parametrize(("data_type", "has_mesh"), [("FLOAT_COLOR", False), ("FLOAT_VECTOR", True), ("FLOAT", False)])
def test_instances_of_geometry_nodes(empty_scene, data_type, has_mesh) -> None:
    hidden = bpy.data.collections.new("hidden")
    add_cards(empty_scene, hidden, [attribute("INSTANCER", "tint")])
    card = hidden.objects[0]
    instances_on_points(empty_scene, card, data_type, has_mesh)
    look_down(empty_scene)
    empty_scene.camera.location = (0, 0, 5)

    def plant(_scene: bpy.types.Scene) -> None:
        node = next(n for n in card.data.materials[0].node_tree.nodes if n.bl_idname == "ShaderNodeAttribute")
        node.attribute_type = "OBJECT"

    expect_equal(empty_scene, plant)
