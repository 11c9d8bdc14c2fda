"""Node trees with more values than a program of the core has registers."""

from __future__ import annotations

import bpy
from node_trees import Context, Tree, socket


def chain(idname: str, count: int) -> Tree:
    tree = Tree()
    last = tree.node("ShaderNodeTexNoise")
    for _ in range(count):
        node = tree.node(idname)
        tree.link(last, "Color", node, "Color")
        last = node
    tree.shown(last, "Color")
    return tree


def test_long_chains(empty_scene):
    """Registers are taken again once nothing reads them."""
    context = Context()
    program = chain("ShaderNodeHueSaturation", 300).compile(context)
    assert len(program.instructions) == 302 and context.warnings == []
    assert len(program.registers) == 1


def total(tree: Tree, nodes: list[bpy.types.Node]) -> bpy.types.Node:
    """The sum of their first outputs."""
    last = nodes[0]
    for node in nodes[1:]:
        both = tree.node("ShaderNodeMath")
        for source, target in ((last, both.inputs[0]), (node, both.inputs[1])):
            tree.tree.links.new(source.outputs[0], target)
        last = both
    return last


def noises(tree: Tree, count: int, scale: float) -> list[bpy.types.Node]:
    return [tree.set(tree.node("ShaderNodeTexNoise"), Scale=scale + k) for k in range(count)]


def halved(tree: Tree, nodes: list[bpy.types.Node]) -> list[bpy.types.Node]:
    halves = [tree.node("ShaderNodeMath", operation="MULTIPLY") for _ in nodes]
    for node, half in zip(nodes, halves, strict=True):
        tree.tree.links.new(node.outputs[0], half.inputs[0])
    return halves


def shown_in_turn(tree: Tree, shaders: list[bpy.types.Node]) -> None:
    last = shaders[0]
    for shader in shaders[1:]:
        both = tree.node("ShaderNodeAddShader")
        for source, target in ((last, both.inputs[0]), (shader, both.inputs[1])):
            tree.tree.links.new(source.outputs[0], target)
        last = both
    tree.tree.links.new(last.outputs[0], socket(tree.output.inputs, "Surface"))


def kept_beyond_a_bump(count: int, bumps: int) -> Tree:
    """So many noises are read by the first shader and again by the last; of others there is a bump in between."""
    tree = Tree()
    kept = noises(tree, count, 1.0)
    shaders = [tree.node("ShaderNodeBsdfDiffuse") for _ in range(3)]
    bump = tree.node("ShaderNodeBump")
    tree.tree.links.new(total(tree, kept).outputs[0], shaders[0].inputs["Color"])
    tree.tree.links.new(total(tree, noises(tree, bumps, 100.0)).outputs[0], bump.inputs["Height"])
    tree.link(bump, "Normal", shaders[1], "Normal")
    tree.tree.links.new(total(tree, halved(tree, kept)).outputs[0], shaders[2].inputs["Color"])
    shown_in_turn(tree, shaders)
    return tree


def test_more_values_at_once_than_registers_become_grey(empty_scene, monkeypatch):
    monkeypatch.setattr("addon.sync.nodes.MAX_REGISTERS", 20)
    context = Context()
    program = kept_beyond_a_bump(10, 2).compile(context)
    assert len(program.closures) == 3 and context.warnings == []
    assert len(program.registers) <= 20 < len(program.instructions)
    (closure,) = kept_beyond_a_bump(30, 2).compile(context).closures
    assert closure.op == "CLOSURE_DIFFUSE"
    assert context.warnings == ["Material 'Test.001': the node tree is too large: plain grey is used"]


def test_too_large_a_tree_loses_its_bumps_first(empty_scene, monkeypatch):
    program = kept_beyond_a_bump(10, 2).compile()
    monkeypatch.setattr("addon.sync.nodes.MAX_REGISTERS", len(program.registers) - 1)
    context = Context()
    closures = kept_beyond_a_bump(10, 2).compile(context).closures
    assert [closure.inputs[3].op for closure in closures] == ["NORMAL"] * 3
    assert context.warnings == ["Material 'Test.001': the node tree is too large for bump, which is left out"]
