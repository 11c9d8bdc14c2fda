"""Ambient Occlusion and Bevel nodes as instructions, and as what they are where no ray can be traced."""

import bpy
import pytest
from node_trees import Context, Tree, shown_value

from addon.sync.instance_values import layer_value
from addon.sync.nodes import compile_light, compile_world
from addon.sync.nodes.value_names import OCCLUSION_DISTANCE


def occlusion(tree: Tree, distance: float = 1.0, **members: object) -> bpy.types.Node:
    return tree.set(tree.node("ShaderNodeAmbientOcclusion", **members), Distance=distance)


def test_occlusion_has_its_settings():
    value = shown_value(lambda tree: (occlusion(tree, 0.5, samples=7, inside=True), "AO"))
    assert (value.op, value.parameters) == ("AMBIENT_OCCLUSION", [7, 1, 0])
    assert value.inputs[0][0] == 0.5 and value.inputs[1].op == "NORMAL"
    assert shown_value(lambda tree: (occlusion(tree, only_local=True), "AO")).parameters == [16, 0, 1]


def test_colour_is_multiplied_by_what_is_open():
    def colored(tree: Tree) -> tuple[bpy.types.Node, str]:
        return tree.set(occlusion(tree), Color=(0.5, 0.25, 1.0, 1.0)), "Color"

    product = shown_value(colored)
    assert product.op == "VECTOR_MATH"
    assert product.inputs[0] == pytest.approx((0.5, 0.25, 1.0)) and product.inputs[1].op == "BROADCAST"


def test_outputs_of_a_node_trace_once():
    tree = Tree()
    node = occlusion(tree)
    emission = tree.shown(node, "AO")
    tree.link(node, "Color", emission, "Color")
    ops = [instruction.op for instruction in tree.compile().instructions]
    assert ops.count("AMBIENT_OCCLUSION") == 1


@pytest.mark.parametrize(("shown", "asked"), [((0.25, 0.25, 0.25, 1.0), 0.25), ((0.0, 0.0, 0.0, 0.0), 10.0)])
def test_a_distance_of_0_is_the_worlds(shown, asked):
    """Without a world, Cycles' own."""

    class WithWorld(Context):
        def layer_value(self, name: str) -> tuple[float, float, float, float]:
            assert name == "light_settings.distance"
            return shown

    tree = Tree()
    tree.shown(occlusion(tree, 0.0), "AO")
    (closure,) = tree.compile(WithWorld()).closures
    assert closure.inputs[2].inputs[0][0] == asked


@pytest.mark.skipif(bpy.app.version >= (5, 3, 0), reason="from 5.3 on it is a constant to Blender, too")
def test_a_linked_distance_of_0_is_one():
    tree = Tree()
    node, zero = occlusion(tree), tree.node("ShaderNodeMath", operation="MULTIPLY")
    tree.link(tree.node("ShaderNodeCameraData"), "View Distance", zero, "Value")  # no constant to Blender, but to us
    tree.set(zero, Value_001=0.0)
    tree.link(zero, "Value", node, "Distance")
    tree.shown(node, "AO")
    (closure,) = tree.compile().closures
    assert closure.inputs[2].inputs[0][0] == 0.0


def test_bevels_bend_the_shading_normal():
    def bevelled(tree: Tree) -> tuple[bpy.types.Node, str]:
        return tree.set(tree.node("ShaderNodeBevel", samples=6), Radius=0.1), "Normal"

    value = shown_value(bevelled)
    assert (value.op, value.parameters) == ("BEVEL", [6])
    assert value.inputs[0][0] == pytest.approx(0.1) and value.inputs[1].op == "NORMAL"


def test_bevels_keep_what_bends_a_given_normal():
    def bevelled(tree: Tree) -> tuple[bpy.types.Node, str]:
        node, bent = tree.node("ShaderNodeBevel"), tree.node("ShaderNodeNormalMap")
        tree.set(bent, Color=(0.6, 0.5, 1.0, 1.0))
        tree.link(bent, "Normal", node, "Normal")
        return node, "Normal"

    total = shown_value(bevelled).inputs[0]  # of the normalisation
    assert [operand.op for operand in total.inputs[:2]] == ["NORMAL_MAP", "VECTOR_MATH"]
    assert [operand.op for operand in total.inputs[1].inputs[:2]] == ["BEVEL", "NORMAL"]


def worlds_and_lamps() -> list:
    world, lamp = bpy.data.worlds.new("World"), bpy.data.lights.new("Lamp", "POINT")
    trees = []
    for owner, compiled, kind in ((world, compile_world, "BACKGROUND"), (lamp, compile_light, "EMISSION")):
        owner.use_nodes = True
        tree = owner.node_tree
        shader = next(node for node in tree.nodes if node.type == kind)
        shader.inputs["Strength"].default_value = 2.0
        node = tree.nodes.new("ShaderNodeAmbientOcclusion")
        node.inputs["Color"].default_value = (0.5, 0.25, 1.0, 1.0)
        tree.links.new(node.outputs["Color"], shader.inputs["Color"])
        trees.append((owner, compiled))
    return trees


def test_worlds_and_lamps_are_open(empty_scene):
    for owner, compiled in worlds_and_lamps():
        program = compiled(owner, Context())
        (closure,) = program.closures
        assert closure.inputs[1] == pytest.approx((0.5, 0.25, 1.0)) and not program.instructions


def test_nothing_warns():
    context, tree = Context(), Tree()
    tree.shown(occlusion(tree), "AO")
    tree.compile(context)
    assert context.warnings == []


def test_a_distance_of_0_is_that_of_the_view_layers_world(empty_scene):
    """As in the pass; Attribute nodes look past it."""
    empty_scene.world, other = bpy.data.worlds.new("World"), bpy.data.worlds.new("Other")
    empty_scene.world.light_settings.distance, other.light_settings.distance = 1.0, 2.0
    for override, expected in ((None, 1.0), (other, 2.0)):
        empty_scene.view_layers[0].world_override = override
        depsgraph = bpy.context.evaluated_depsgraph_get()
        depsgraph.update()
        assert layer_value(depsgraph, OCCLUSION_DISTANCE)[0] == expected
