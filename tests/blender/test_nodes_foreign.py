"""Nodes that nobody here knows: of EEVEE, of other programs, of other versions of Blender."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import pytest
from node_trees import Context, Tree, emission_color, shown_as_colour

from addon.sync.nodes.compiler import CLOSURE_NODES, VALUE_NODES, Compiler, NodeView, TreeKind
from addon.sync.nodes.enums import MAP_RANGE_TYPES


def test_unknown_nodes_make_one_warning(empty_scene, monkeypatch):
    for idname in ("ShaderNodeInvert", "ShaderNodeFresnel"):
        monkeypatch.delitem(VALUE_NODES, idname)
    tree = Tree("Exotic")
    mix = tree.node("ShaderNodeMix", data_type="RGBA", blend_type="ADD")
    tree.set(mix, Factor_Float=1.0)
    tree.link(tree.set(tree.node("ShaderNodeInvert"), Color=(0.5, 0.25, 0.0, 1.0)), "Color", mix, "A_Color")
    for _ in range(2):
        tree.link(tree.set(tree.node("ShaderNodeFresnel"), IOR=2.0), "Fac", mix, "B_Color")
    tree.shown(mix, "Result_Color")
    context = Context()
    assert emission_color(tree, context) == (2.5, 2.25, 2.0)
    assert context.warnings == ["Material 'Exotic': nodes replaced by their defaults: Invert Color, Fresnel"]


def test_a_node_that_cannot_be_read_costs_the_node_alone(empty_scene, monkeypatch):
    """Nodes of later versions and of other programs may lack what a handler reads."""

    def stumble(node, output):
        raise AttributeError("no default_value")

    monkeypatch.setitem(VALUE_NODES, "ShaderNodeInvert", stumble)
    tree = Tree("Foreign")
    tree.shown(tree.set(tree.node("ShaderNodeInvert"), Color=(0.5, 0.25, 0.0, 1.0)), "Color")
    context = Context()
    assert emission_color(tree, context) == (0.5, 0.25, 0.0)
    assert any("Foreign" in text and "no default_value" in text for text in context.warnings)


@pytest.mark.parametrize(("chosen", "said"), [("", "does not know"), ("FUTURE", "FUTURE is not supported")])
def test_choices_of_another_blender_become_the_default(empty_scene, chosen, said):
    """Files of other versions hold choices that read as '' here."""
    tree = Tree("Foreign")
    mapping = tree.node("ShaderNodeMapRange")
    compiler = Compiler("Foreign", "Material 'Foreign'", Context(), TreeKind.SURFACE)
    properties = SimpleNamespace(properties=mapping.bl_rna.properties)
    foreign = SimpleNamespace(name="Map", interpolation_type=chosen, bl_rna=properties)
    view = NodeView(compiler, SimpleNamespace(owner=None), foreign)
    assert view.choice("interpolation_type", MAP_RANGE_TYPES) == MAP_RANGE_TYPES.index("LINEAR")
    assert view.choice("interpolation_type", {"SMOOTHSTEP": 7}) == 7  # not even the default is known
    compiler.report()
    assert said in compiler.context.warnings[0] and "Foreign" in compiler.context.warnings[0]


def test_nodes_of_eevee_count_as_not_linked(empty_scene):
    """As in Cycles: the Emission node keeps its own colour, and a surface of EEVEE's shader is black."""
    tree = Tree()
    convert = tree.node("ShaderNodeShaderToRGB")
    tree.set(shown_as_colour(tree, convert), Color=(0.1, 0.2, 0.3, 1.0))
    tree.link(tree.node("ShaderNodeBsdfDiffuse"), "BSDF", convert, "Shader")
    context = Context()
    assert emission_color(tree, context) == pytest.approx((0.1, 0.2, 0.3))
    assert len(context.warnings) == 1 and "Shader to RGB" in context.warnings[0]
    tree.link(tree.node("ShaderNodeEeveeSpecular"), "BSDF", tree.output, "Surface")
    assert tree.compile(Context()).closures == []


def test_nodes_of_another_program_count_as_not_linked(empty_scene):
    """As in Cycles, whether the program is there or not."""

    class ForeignNode(bpy.types.ShaderNode):
        bl_idname, bl_label = "ForeignNode", "Foreign"

        def init(self, context):
            self.inputs.new("NodeSocketColor", "In")
            self.outputs.new("NodeSocketColor", "Out")

    bpy.utils.register_class(ForeignNode)
    tree = Tree()
    tree.set(shown_as_colour(tree, tree.node("ForeignNode")), Color=(0.1, 0.2, 0.3, 1.0))
    for _ in range(2):
        context = Context()
        assert emission_color(tree, context) == pytest.approx((0.1, 0.2, 0.3))
        assert len(context.warnings) == 1 and "another program" in context.warnings[0]
        if hasattr(bpy.types, "ForeignNode"):
            bpy.utils.unregister_class(ForeignNode)


def test_unknown_shader_becomes_diffuse_of_its_color(empty_scene, monkeypatch):
    monkeypatch.delitem(CLOSURE_NODES, "ShaderNodeBsdfHair")
    tree = Tree()
    hair = tree.set(tree.node("ShaderNodeBsdfHair"), Color=(0.1, 0.2, 0.3, 1.0))
    tree.link(hair, "BSDF", tree.output, "Surface")
    context = Context()
    (closure,) = tree.compile(context).closures
    assert closure.op == "CLOSURE_DIFFUSE" and closure.inputs[1] == pytest.approx((0.1, 0.2, 0.3))
    assert len(context.warnings) == 1 and "Hair" in context.warnings[0]
