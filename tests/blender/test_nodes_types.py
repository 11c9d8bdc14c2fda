"""Every supported node type compiles to instructions the core accepts, in every mode and for every output."""

from __future__ import annotations

import contextlib

import bpy
import numpy as np
import pytest
from node_trees import Context, Tree, shown_value

from addon.sync.nodes.compiler import CLOSURE_NODES, VALUE_NODES

MODES = {  # enum members that select what a node computes
    "operation", "blend_type", "data_type", "factor_mode", "mode", "clamp_type", "interpolation_type", "vector_type",
    "rotation_type", "convert_from", "convert_to", "space", "direction_type", "axis", "distribution", "interpolation",
    "extension", "projection", "gradient_type", "noise_dimensions", "noise_type", "voronoi_dimensions", "distance",
    "feature", "gabor_type", "wave_type", "bands_direction", "rings_direction", "wave_profile", "fresnel_type",
    "component",
}  # fmt: skip
PARTLY_SUPPORTED = {  # outputs that become defaults with a warning
    ("ShaderNodeNewGeometry", "Parametric"), ("ShaderNodeHairInfo", "Tangent Normal"),
    ("ShaderNodeTexVoronoi", "W"), ("ShaderNodeMix", "Result_Rotation"),
}  # fmt: skip


FROM_5_3 = ("FunctionNodeIntegerMath", "FunctionNodeBooleanMath", "FunctionNodeGetVectorComponent")


def exists(idname: str) -> bool:
    """Nodes of other editors are nodes of shaders, too, from Blender 5.2 on, and more of them from 5.3 on."""
    is_of_shaders = idname.startswith("ShaderNode") or bpy.app.version >= ((5, 3) if idname in FROM_5_3 else (5, 2))
    return hasattr(bpy.types, idname) and is_of_shaders


def mode_settings(node: bpy.types.Node):
    """One (member, value) at a time, from all enum members that select a mode; (None, None) first."""
    yield None, None
    for member in node.bl_rna.properties:
        if member.identifier in MODES and member.type == "ENUM":
            for item in member.enum_items:
                with contextlib.suppress(TypeError):  # listed for other editors only
                    setattr(node, member.identifier, item.identifier)
                    yield member.identifier, item.identifier


@pytest.mark.parametrize("idname", sorted(filter(exists, VALUE_NODES)))
def test_value_node_compiles_in_every_mode(empty_scene, idname):
    probe = Tree("Probe").node(idname)
    for member, value in list(mode_settings(probe)):
        tree = Tree()
        node = tree.node(idname)
        if hasattr(node, "image"):
            node.image = bpy.data.images.new("picture", 4, 4)
        if member:
            setattr(node, member, value)
        for output in [socket for socket in node.outputs if socket.enabled and socket.identifier != "__extend__"]:
            tree.shown(node, output.identifier)
            context = Context()
            program = tree.compile(context)
            assert [closure.op for closure in program.closures] in (["CLOSURE_EMISSION"], [])
            if (output.identifier, value) == ("W", "1D"):
                continue  # Blender resolves this link to none from 5.0 on
            replaced = any("replaced by their defaults" in warning for warning in context.warnings)
            assert replaced == ((idname, output.identifier) in PARTLY_SUPPORTED), (member, value, context.warnings)


def test_alpha_where_a_mesh_lacks_the_attribute(empty_scene):
    """As in Cycles: 0 of a Color Attribute node, 1 of an Attribute node, with a name and without."""
    coloured = shown_value(lambda tree: (tree.node("ShaderNodeVertexColor", layer_name="Paint"), "Alpha"))
    assert (coloured.op, coloured.parameters) == ("ATTRIBUTE_ALPHA", [0, 0, 0])
    named = shown_value(lambda tree: (tree.node("ShaderNodeAttribute", attribute_name="Paint"), "Alpha"))
    assert (named.op, named.parameters) == ("ATTRIBUTE_ALPHA", [0, 1, 0])
    assert shown_value(lambda tree: (tree.node("ShaderNodeAttribute"), "Alpha"))[0] == 1.0


@pytest.mark.parametrize("idname", sorted(filter(exists, CLOSURE_NODES)))
def test_closure_node_compiles_in_every_mode(empty_scene, idname):
    probe = Tree("Probe").node(idname)
    for member, value in list(mode_settings(probe)):
        tree = Tree()
        node = tree.node(idname)
        if member:
            setattr(node, member, value)
        for shader in [socket for socket in node.inputs if socket.type == "SHADER"]:
            tree.tree.links.new(shader, tree.node("ShaderNodeBsdfDiffuse").outputs[0])
        tree.link(node, node.outputs[0].identifier, tree.output, "Surface")
        context = Context()
        assert tree.compile(context).closures
        assert not any("replaced" in warning for warning in context.warnings)


def test_the_core_accepts_every_node(empty_scene):
    """The stand-in's checks are the core's: what passes there is taken by a scene builder here."""
    core = pytest.importorskip("cistern_core", exc_type=ImportError)
    builder = core.SceneBuilder()
    context = Context(builder.add_image("picture", np.zeros((4, 4, 4), np.uint8)))
    context.core = core
    for idname in filter(exists, [*VALUE_NODES, *CLOSURE_NODES]):
        for member, value in list(mode_settings(Tree("Probe").node(idname))):
            tree = Tree()
            node = tree.node(idname)
            if hasattr(node, "image"):
                node.image = bpy.data.images.new("picture", 4, 4)
            if member:
                setattr(node, member, value)
            for output in [socket for socket in node.outputs if socket.enabled]:
                if output.type == "SHADER":
                    tree.link(node, output.identifier, tree.output, "Surface")
                else:
                    tree.shown(node, output.identifier)
                builder.add_material(tree.compile(context))


def test_texture_mapping_panel(empty_scene):
    tree = Tree()
    node = tree.node("ShaderNodeTexChecker")
    node.texture_mapping.translation = (1.0, 2.0, 3.0)
    node.texture_mapping.mapping_x = "Z"
    tree.shown(node, "Color")
    mapping = tree.compile().closures[0].inputs[1].inputs[0]
    assert mapping.op == "MAPPING" and mapping.inputs[1] == (1.0, 2.0, 3.0)
    assert mapping.inputs[0].op == "COMBINE_XYZ" and mapping.inputs[0].inputs[0].op == "SEPARATE_Z"


def test_anisotropic_principled_reads_the_radial_tangent(empty_scene):
    tree = Tree()
    node = tree.node("ShaderNodeBsdfPrincipled")
    tree.link(node, "BSDF", tree.output, "Surface")
    assert [instruction.op for instruction in tree.compile().instructions] == ["NORMAL"]
    tree.set(node, Anisotropic=0.5)
    ops = [instruction.op for instruction in tree.compile().instructions]
    assert {"GENERATED", "VECTOR_TRANSFORM", "VECTOR_MATH"} <= set(ops)


def test_bump_compiles_its_height_at_three_places_and_nests(empty_scene):
    tree = Tree()
    outer, inner, noise, picture = (
        tree.node(name) for name in ("ShaderNodeBump", "ShaderNodeBump", "ShaderNodeTexNoise", "ShaderNodeTexChecker")
    )
    tree.link(noise, "Fac", inner, "Height")
    tree.link(picture, "Fac", outer, "Height")
    tree.link(inner, "Normal", outer, "Normal")
    shader = tree.node("ShaderNodeBsdfDiffuse")
    tree.link(outer, "Normal", shader, "Normal")
    tree.link(shader, "BSDF", tree.output, "Surface")
    program = tree.compile()
    (closure,) = program.closures
    bump = closure.inputs[3]
    assert bump.op == "BUMP" and bump.inputs[5].op == "BUMP" and bump.inputs[5].inputs[5].op == "NORMAL"
    shifts = [height.inputs[0].parameters[-1] for height in bump.inputs[:3]]
    width = 4 * (100 if "Filter Width" in outer.inputs else 1000)  # its default, or before there was one
    assert shifts == [width, width + 1, width + 2]
    assert bump.parameters[1] == width
    assert sum(instruction.op == "GENERATED" for instruction in program.instructions) == 3  # shared by both heights


def test_bump_of_a_constant_height_is_no_bump(empty_scene):
    tree = Tree()
    bump, shader = tree.node("ShaderNodeBump"), tree.node("ShaderNodeBsdfDiffuse")
    tree.link(tree.node("ShaderNodeValue"), "Value", bump, "Height")
    tree.link(bump, "Normal", shader, "Normal")
    tree.link(shader, "BSDF", tree.output, "Surface")
    assert tree.compile().closures[0].inputs[3].op == "NORMAL"


def test_missing_image_is_magenta_and_opaque(empty_scene):
    for handle, image in ((-1, bpy.data.images.new("lost", 1, 1)), (3, None)):
        tree = Tree()
        node = tree.node("ShaderNodeTexImage", image=image)
        tree.shown(node, "Color")
        context = Context(handle)
        assert tree.compile(context).closures[0].inputs[1] == (1.0, 0.0, 1.0)
        assert image or "node 'Image Texture' has no image: it is magenta" in context.warnings[0]
        tree.shown(node, "Alpha")
        assert tree.compile(Context(handle)).closures[0].inputs[2] == (1.0, 0.0, 0.0)
