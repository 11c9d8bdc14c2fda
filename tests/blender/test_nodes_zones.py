"""Repeat zones, closures, bundles and menus of shader trees: Blender resolves them, and what is left is compiled."""

from __future__ import annotations

from typing import Any

import bpy
import pytest
from node_trees import Context, Tree

from addon.sync.nodes import compile_world

pytestmark = pytest.mark.skipif(
    not hasattr(bpy.types.Material, "inline_shader_nodes"), reason="shader trees have such nodes from Blender 5.0 on"
)


def grown(tree: bpy.types.NodeTree, times: int) -> bpy.types.NodeSocket:
    """0.25 with 0.25 added in each round of a repeat zone."""
    first, last = tree.nodes.new("GeometryNodeRepeatInput"), tree.nodes.new("GeometryNodeRepeatOutput")
    first.pair_with_output(last)
    last.repeat_items.clear()
    last.repeat_items.new("FLOAT", "Sum")
    first.inputs["Iterations"].default_value, first.inputs["Sum"].default_value = times, 0.25
    add = tree.nodes.new("ShaderNodeMath")
    add.inputs[1].default_value = 0.25
    tree.links.new(add.inputs[0], first.outputs["Sum"])
    tree.links.new(last.inputs["Sum"], add.outputs[0])
    return last.outputs["Sum"]


def doubled(tree: bpy.types.NodeTree, value: float) -> bpy.types.NodeSocket:
    """By a closure."""
    first, last = tree.nodes.new("NodeClosureInput"), tree.nodes.new("NodeClosureOutput")
    first.pair_with_output(last)
    evaluate = tree.nodes.new("NodeEvaluateClosure")
    for items in (last.input_items, last.output_items, evaluate.input_items, evaluate.output_items):
        items.new("FLOAT", "Value")
    twice = tree.nodes.new("ShaderNodeMath")
    twice.operation, twice.inputs[1].default_value = "MULTIPLY", 2.0
    tree.links.new(twice.inputs[0], first.outputs["Value"])
    tree.links.new(last.inputs["Value"], twice.outputs[0])
    tree.links.new(evaluate.inputs["Closure"], last.outputs["Closure"])
    evaluate.inputs["Value"].default_value = value
    return evaluate.outputs["Value"]


def bundled(tree: bpy.types.NodeTree, value: float) -> bpy.types.NodeSocket:
    combine, separate = tree.nodes.new("NodeCombineBundle"), tree.nodes.new("NodeSeparateBundle")
    for node in (combine, separate):
        node.bundle_items.new("FLOAT", "Value")
    combine.inputs["Value"].default_value = value
    tree.links.new(separate.inputs["Bundle"], combine.outputs["Bundle"])
    return separate.outputs["Value"]


def chosen(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    """0.5, the second of a menu's items."""
    switch = tree.nodes.new("GeometryNodeMenuSwitch")
    switch.data_type = "FLOAT"
    for socket, value in zip([s for s in switch.inputs if s.type == "VALUE"], (0.1, 0.5), strict=False):
        socket.default_value = value
    switch.inputs["Menu"].default_value = switch.enum_items[1].name
    return switch.outputs[0]


CASES = {
    "repeat": (lambda tree: grown(tree, 2), 0.75),
    "closure": (lambda tree: doubled(tree, 0.3), 0.6),
    "bundle": (lambda tree: bundled(tree, 0.4), 0.4),
    "menu": (chosen, 0.5),
}


def strength_of(tree: Tree) -> Any:  # noqa: ANN401
    """Of the one closure."""
    context = Context()
    (closure,) = tree.compile(context).closures
    assert context.warnings == []
    return closure.inputs[2]


@pytest.mark.parametrize("case", CASES)
def test_of_a_material(empty_scene, case):
    make, expected = CASES[case]
    tree = Tree()
    emission = tree.node("ShaderNodeEmission")
    tree.tree.links.new(emission.inputs["Strength"], make(tree.tree))
    tree.link(emission, "Emission", tree.output, "Surface")
    assert strength_of(tree) == pytest.approx((expected, 0.0, 0.0))


def test_beside_a_group_without_a_tree(empty_scene):
    tree = Tree()
    tree.node("ShaderNodeGroup")
    emission = tree.node("ShaderNodeEmission")
    tree.tree.links.new(emission.inputs["Strength"], grown(tree.tree, 2))
    tree.link(emission, "Emission", tree.output, "Surface")
    assert strength_of(tree) == pytest.approx((0.75, 0.0, 0.0))


def test_in_a_group(empty_scene):
    group = bpy.data.node_groups.new("Grown", "ShaderNodeTree")
    group.interface.new_socket("Sum", in_out="OUTPUT", socket_type="NodeSocketFloat")
    output = group.nodes.new("NodeGroupOutput")
    group.links.new(output.inputs[0], grown(group, 3))
    tree = Tree()
    node, emission = tree.node("ShaderNodeGroup", node_tree=group), tree.node("ShaderNodeEmission")
    tree.tree.links.new(emission.inputs["Strength"], node.outputs[0])
    tree.link(emission, "Emission", tree.output, "Surface")
    assert strength_of(tree) == pytest.approx((1.0, 0.0, 0.0))


def test_of_a_world(empty_scene):
    world = bpy.data.worlds.new("World")
    background = next(node for node in world.node_tree.nodes if node.bl_idname == "ShaderNodeBackground")
    world.node_tree.links.new(background.inputs["Strength"], grown(world.node_tree, 2))
    (closure,) = compile_world(world, Context()).closures
    assert closure.inputs[2] == pytest.approx((0.75, 0.0, 0.0))


def test_an_output_for_cycles_alone_counts(empty_scene):
    """Blender leaves it out of what it resolves, from 5.1 on; without its help there are no zones."""
    tree = Tree()
    tree.output.target = "CYCLES"
    tree.link(tree.node("ShaderNodeBsdfGlass"), "BSDF", tree.output, "Surface")
    context = Context()
    assert [closure.op for closure in tree.compile(context).closures] == ["CLOSURE_GLASS"]
    emission = tree.node("ShaderNodeEmission")
    tree.tree.links.new(grown(tree.tree, 2), emission.inputs["Strength"])
    tree.link(emission, "Emission", tree.output, "Surface")
    (closure,) = tree.compile(context).closures
    assert closure.op == "CLOSURE_EMISSION"
    is_resolved = closure.inputs[2] == pytest.approx((0.75, 0.0, 0.0))
    assert is_resolved or context.warnings == ["Material 'Test': nodes replaced by their defaults: Repeat Output"]
