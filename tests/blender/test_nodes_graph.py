"""Groups, reroutes, muted nodes, shader mixing, and the blocks around a tree."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest
from node_trees import Context, Tree, emission_color, shown_as_colour, socket

from addon.sync import versions
from addon.sync.nodes import _DEEP_RECURSION, RECURSION_LIMIT, compile_light, compile_material, compile_world
from addon.sync.nodes.enums import PHASE_FUNCTIONS
from addon.sync.nodes.graph import Scope, all_groups, is_foreign, is_group
from addon.sync.nodes.volumes import PHASE_INPUTS

SCENES = "CISTERN_TEST_SCENES"


def tinting_group(name: str) -> bpy.types.NodeTree:
    """A group with input Tint (default red) and output Result; nothing inside is linked yet."""
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    tint = group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    tint.default_value = (1.0, 0.0, 0.0, 1.0)
    group.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketColor")
    group.nodes.new("NodeGroupInput")
    group.nodes.new("NodeGroupOutput")
    return group


def ends(group: bpy.types.NodeTree) -> tuple[bpy.types.NodeSocket, bpy.types.NodeSocket]:
    inner = next(node for node in group.nodes if node.bl_idname == "NodeGroupInput")
    outer = next(node for node in group.nodes if node.bl_idname == "NodeGroupOutput")
    return inner.outputs[0], outer.inputs[0]


def test_nested_groups_reroutes_and_group_defaults(empty_scene):
    inner, outer = tinting_group("Inner"), tinting_group("Outer")
    source, target = ends(inner)
    reroute = inner.nodes.new("NodeReroute")
    inner.links.new(reroute.inputs[0], source)
    gamma = inner.nodes.new("ShaderNodeGamma")
    gamma.inputs["Gamma"].default_value = 2.0
    inner.links.new(gamma.inputs["Color"], reroute.outputs[0])
    inner.links.new(target, gamma.outputs[0])
    source, target = ends(outer)
    use = outer.nodes.new("ShaderNodeGroup")
    use.node_tree = inner
    outer.links.new(use.inputs[0], source)
    outer.links.new(target, use.outputs[0])

    tree = Tree()
    first, second = tree.node("ShaderNodeGroup", node_tree=outer), tree.node("ShaderNodeGroup", node_tree=outer)
    second.inputs[0].default_value = (0.5, 0.0, 0.0, 1.0)
    add = tree.node("ShaderNodeMix", data_type="RGBA", blend_type="ADD")
    tree.set(add, Factor_Float=1.0)
    tree.tree.links.new(socket(add.inputs, "A_Color"), first.outputs[0])
    tree.tree.links.new(socket(add.inputs, "B_Color"), second.outputs[0])
    tree.shown(add, "Result_Color")
    assert emission_color(tree) == pytest.approx((1.25, 0.0, 0.0))


def test_constants_reach_inputs_with_a_default_of_their_own(empty_scene):
    """From 5.2 on Blender hands them over as nodes that it makes itself."""
    tree = Tree()
    place = tree.set(tree.node("ShaderNodeCombineXYZ"), X=0.25, Y=0.5, Z=0.75)
    portal = tree.node("ShaderNodeBsdfRayPortal")
    tree.link(place, "Vector", portal, "Position")
    tree.link(portal, "BSDF", tree.output, "Surface")
    context = Context()
    [closure] = tree.compile(context).closures
    assert closure.inputs[2] == (0.25, 0.5, 0.75)
    assert context.warnings == []


def test_group_socket_converts_what_passes(empty_scene):
    """Only before Blender 5.0, which joins the links: what they carry then keeps its colour."""
    group = bpy.data.node_groups.new("Grey", "ShaderNodeTree")
    group.interface.new_socket("Amount", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketColor")
    group.links.new(group.nodes.new("NodeGroupOutput").inputs[0], group.nodes.new("NodeGroupInput").outputs[0])
    tree = Tree()
    use, rgb = tree.node("ShaderNodeGroup", node_tree=group), tree.node("ShaderNodeRGB")
    rgb.outputs[0].default_value = (0.0, 1.0, 0.0, 1.0)
    tree.tree.links.new(use.inputs[0], rgb.outputs[0])
    tree.tree.links.new(tree.shown(rgb, "Color").inputs["Color"], use.outputs[0])
    joins = hasattr(bpy.types.Material, "inline_shader_nodes")
    assert emission_color(tree) == pytest.approx((0.0, 1.0, 0.0) if joins else (0.7152,) * 3, rel=1e-4)


def test_muted_nodes_and_links(empty_scene):
    tree = Tree()
    rgb, invert = tree.node("ShaderNodeRGB"), tree.node("ShaderNodeInvert")
    rgb.outputs[0].default_value = (0.25, 0.25, 0.25, 1.0)
    link = tree.link(rgb, "Color", invert, "Color")
    tree.shown(invert, "Color")
    assert emission_color(tree) == pytest.approx((0.75,) * 3)
    invert.mute = True
    assert emission_color(tree) == pytest.approx((0.25,) * 3)
    invert.mute = False
    link.is_muted = True
    assert emission_color(tree) == pytest.approx((1.0,) * 3)


@pytest.mark.parametrize("idname", ["ShaderNodeGamma", "ShaderNodeInvert", "ShaderNodeMath"])
def test_a_muted_node_without_a_link_counts_as_no_link(empty_scene, idname):
    """Before Blender 5.0 it reads 0."""
    kept = (0.125, 0.25, 0.5) if versions.joins_links() else (0.0, 0.0, 0.0)
    tree = Tree()
    muted = tree.node(idname)
    muted.mute = True
    emission = shown_as_colour(tree, muted)
    emission.inputs["Color"].default_value = (0.125, 0.25, 0.5, 1.0)
    assert emission_color(tree) == pytest.approx(kept)
    reroute = tree.node("NodeReroute")
    tree.tree.links.new(reroute.inputs[0], muted.outputs[0])
    tree.tree.links.new(emission.inputs["Color"], reroute.outputs[0])
    assert emission_color(tree) == pytest.approx(kept)


def test_a_muted_normal_map_keeps_the_normal(empty_scene):
    """Blender leads its unlinked Strength to Normal."""
    tree = Tree()
    muted = tree.node("ShaderNodeNormalMap")
    muted.mute = True
    diffuse = tree.node("ShaderNodeBsdfDiffuse")
    tree.link(tree.node("ShaderNodeTexNoise"), "Color", muted, "Color")
    tree.link(muted, "Normal", diffuse, "Normal")
    tree.link(diffuse, "BSDF", tree.output, "Surface")
    muted_program = tree.compile()
    tree.tree.nodes.remove(muted)
    assert muted_program.closures == tree.compile().closures


def test_a_muted_node_converts_nothing(empty_scene):
    tree = Tree()
    rgb, muted = tree.node("ShaderNodeRGB"), tree.node("ShaderNodeMath")
    rgb.outputs[0].default_value = (0.125, 0.25, 0.5, 1.0)
    muted.mute = True
    tree.tree.links.new(muted.inputs[0], rgb.outputs[0])
    shown_as_colour(tree, muted)
    joins = hasattr(bpy.types.Material, "inline_shader_nodes")
    assert emission_color(tree) == pytest.approx((0.125, 0.25, 0.5) if joins else (0.241475,) * 3, rel=1e-4)


@pytest.mark.skipif(not versions.joins_links(), reason="Cycles converts at each socket there")
def test_trees_that_blender_does_not_resolve_convert_nothing_on_the_way(empty_scene):
    """Here because a group has lost its tree; from 5.1 on outputs for Cycles alone are another reason."""
    tree = Tree()
    tree.node("ShaderNodeGroup")
    rgb, muted, reroute = tree.node("ShaderNodeRGB"), tree.node("ShaderNodeMath"), tree.node("NodeReroute")
    rgb.outputs[0].default_value = (0.125, 0.25, 0.5, 1.0)
    muted.mute, reroute.socket_idname = True, "NodeSocketFloat"
    tree.tree.links.new(muted.inputs[0], rgb.outputs[0])
    tree.tree.links.new(reroute.inputs[0], muted.outputs[0])
    shown_as_colour(tree, reroute)
    assert emission_color(tree) == pytest.approx((0.125, 0.25, 0.5))


def test_group_inside_itself_is_found_at_any_depth(empty_scene):
    """Blender refuses to build one, but broken files hold it: a stand-in node leads back to its own group."""
    tree, group = Tree(), tinting_group("Snake")
    use = tree.node("ShaderNodeGroup", node_tree=group)
    homeward = SimpleNamespace(name="Loop", node_tree=group)
    inside = Scope(tree.tree).child(use)
    assert inside is not None and inside.child(homeward) is None
    deeper = inside.child(SimpleNamespace(name="Other", node_tree=tinting_group("Between")))
    assert deeper is not None and deeper.child(homeward) is None


def test_self_containing_group_compiles_to_its_default(empty_scene, monkeypatch):
    tree = Tree()
    group = tinting_group("Snake")
    use = tree.node("ShaderNodeGroup", node_tree=group)
    tree.tree.links.new(tree.shown(tree.node("ShaderNodeRGB"), "Color").inputs["Color"], use.outputs[0])
    use.outputs[0].default_value = (0.2, 0.4, 0.6, 1.0)
    monkeypatch.setattr(Scope, "_is_inside", lambda self, other: True)
    context = Context()
    assert emission_color(tree, context) == pytest.approx((0.2, 0.4, 0.6))
    assert [warning for warning in context.warnings if "'Snake' contains itself" in warning]


def test_group_without_tree_is_harmless(empty_scene):
    tree = Tree()
    tree.node("ShaderNodeGroup")
    assert tree.compile().closures == []


def test_worlds_have_no_tangent(empty_scene):
    """As in Cycles."""
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    tree = world.node_tree
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    tree.links.new(background.inputs["Color"], tree.nodes.new("ShaderNodeNewGeometry").outputs["Tangent"])
    (closure,) = compile_world(world, Context()).closures
    assert closure.inputs[1] == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("thickness", [0.0, 300.0])
def test_thin_film(empty_scene, thickness):
    tree = Tree()
    node = tree.node("ShaderNodeBsdfPrincipled")
    node.inputs["Thin Film Thickness"].default_value, node.inputs["Thin Film IOR"].default_value = thickness, 1.5
    tree.link(node, "BSDF", tree.output, "Surface")
    context = Context()
    (closure,) = tree.compile(context).closures
    assert [value[0] for value in closure.inputs[29:31]] == pytest.approx([thickness, 1.5 if thickness else 1.0])
    assert bool(closure.parameters[2] & 1) == versions.films_cover_metal() and not context.warnings


@pytest.mark.parametrize(("strength", "emitted"), [(-0.3, 0.0), (0.0, 0.0), (2.5, 2.5)])
def test_principled_emits_nothing_below_zero(empty_scene, strength, emitted):
    tree = Tree()
    node = tree.node("ShaderNodeBsdfPrincipled")
    node.inputs["Emission Strength"].default_value = strength
    tree.link(node, "BSDF", tree.output, "Surface")
    (closure,) = tree.compile().closures
    assert closure.inputs[24] == (emitted, 0.0, 0.0)


def test_principled_does_not_clamp_a_textured_emission(empty_scene):
    tree = Tree()
    node = tree.node("ShaderNodeBsdfPrincipled")
    tree.link(tree.node("ShaderNodeTexNoise"), "Fac", node, "Emission Strength")
    tree.link(node, "BSDF", tree.output, "Surface")
    (closure,) = tree.compile().closures
    assert closure.inputs[24].op != "MATH"
    tree = Tree()
    node = tree.node("ShaderNodeBsdfPrincipled")
    node.inputs["Emission Strength"].default_value = -1.0
    tree.link(node, "BSDF", tree.output, "Surface")
    (closure,) = tree.compile().closures
    assert closure.inputs[24] == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("component", ["DIFFUSE", "GLOSSY"])
def test_toon(empty_scene, component):
    tree = Tree()
    tree.link(tree.node("ShaderNodeBsdfToon", component=component), "BSDF", tree.output, "Surface")
    (closure,) = tree.compile().closures
    assert (closure.op, tuple(closure.parameters)) == ("CLOSURE_TOON", (int(component == "GLOSSY"),))


def mixed(factor: float | None) -> Tree:
    """mix(factor, Diffuse, Add(Emission, Transparent)); None links a texture to the factor."""
    tree = Tree()
    mix, add = tree.node("ShaderNodeMixShader"), tree.node("ShaderNodeAddShader")
    if factor is None:
        tree.link(tree.node("ShaderNodeTexNoise"), "Fac", mix, "Fac")
    else:
        tree.set(mix, Fac=factor)
    tree.link(tree.node("ShaderNodeBsdfDiffuse"), "BSDF", mix, "Shader")
    tree.link(tree.node("ShaderNodeEmission"), "Emission", add, "Shader")
    tree.link(tree.node("ShaderNodeBsdfTransparent"), "BSDF", add, "Shader_001")
    tree.link(add, "Shader", mix, "Shader_001")
    tree.link(mix, "Shader", tree.output, "Surface")
    return tree


@pytest.mark.parametrize(
    ("factor", "weights"),
    [
        (0.25, {"DIFFUSE": 0.75, "EMISSION": 0.25, "TRANSPARENT": 0.25}),
        (0.0, {"DIFFUSE": 1.0}),
        (1.0, {"EMISSION": 1.0, "TRANSPARENT": 1.0}),
    ],
)
def test_mix_shader_weights(empty_scene, factor, weights):
    closures = mixed(factor).compile().closures
    assert {c.op.removeprefix("CLOSURE_"): c.inputs[0][0] for c in closures} == pytest.approx(weights)


def test_mix_shader_clamps_a_textured_factor(empty_scene):
    diffuse, emission, transparent = mixed(None).compile().closures
    assert emission.inputs[0] is transparent.inputs[0]
    assert emission.inputs[0].op == "CLAMP" and emission.inputs[0].inputs[1:] == [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]
    assert diffuse.inputs[0].op == "MATH" and diffuse.inputs[0].inputs[1] is emission.inputs[0]


def test_values_in_shader_sockets_glow_and_shaders_in_values_are_ignored(empty_scene):
    tree = Tree()
    tree.link(tree.node("ShaderNodeRGB"), "Color", tree.output, "Surface")
    assert [closure.op for closure in tree.compile().closures] == ["CLOSURE_EMISSION"]
    tree = Tree()
    shader, gamma = tree.node("ShaderNodeBsdfDiffuse"), tree.node("ShaderNodeGamma")
    tree.link(shader, "BSDF", gamma, "Color")
    tree.shown(gamma, "Color")
    assert emission_color(tree) == (1.0, 1.0, 1.0)


def test_output_for_cycles_wins_and_eevee_never_counts(empty_scene):
    tree = Tree()
    tree.output.target = "EEVEE"
    tree.link(tree.node("ShaderNodeBsdfDiffuse"), "BSDF", tree.output, "Surface")
    assert tree.compile().closures == []
    for target, idname in (("ALL", "ShaderNodeBsdfGlass"), ("CYCLES", "ShaderNodeBsdfTranslucent")):
        output = tree.node("ShaderNodeOutputMaterial", target=target)
        tree.link(tree.node(idname), "BSDF", output, "Surface")
    assert [closure.op for closure in tree.compile().closures] == ["CLOSURE_TRANSLUCENT"]


def test_volume_without_surface_is_a_boundary(empty_scene):
    tree = Tree()
    tree.link(tree.node("ShaderNodeVolumeScatter"), "Volume", tree.output, "Volume")
    context = Context()
    program = tree.compile(context)
    assert [closure.op for closure in program.closures] == ["CLOSURE_TRANSPARENT", "CLOSURE_VOLUME"]
    assert program.is_boundary and context.warnings == []
    tree.link(tree.node("ShaderNodeBsdfGlass"), "BSDF", tree.output, "Surface")
    program = tree.compile(context)
    assert [closure.op for closure in program.closures] == ["CLOSURE_GLASS", "CLOSURE_VOLUME"]
    assert not program.is_boundary and context.warnings == []


def test_volume_of_a_world_that_varies(empty_scene):
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    tree = world.node_tree
    scatter, noise = (tree.nodes.new(kind) for kind in ("ShaderNodeVolumeScatter", "ShaderNodeTexNoise"))
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(noise.outputs[0], scatter.inputs["Density"])
    tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    context = Context()
    assert [closure.op for closure in compile_world(world, context).closures][-1] == "CLOSURE_VOLUME"
    assert context.warnings == []


def test_surfaces_are_nothing_in_a_volume(empty_scene):
    tree = Tree()
    tree.link(tree.node("ShaderNodeBsdfDiffuse"), "BSDF", tree.output, "Volume")
    context = Context()
    assert [closure.op for closure in tree.compile(context).closures] == ["CLOSURE_TRANSPARENT"]
    assert context.warnings == []


@pytest.mark.parametrize(
    "idname", ["ShaderNodeVolumeAbsorption", "ShaderNodeVolumeScatter", "ShaderNodeVolumePrincipled"]
)
def test_volumes_are_nothing_on_a_surface(empty_scene, idname):
    """As in Cycles; importers of glTF add them there."""
    tree = Tree()
    add = tree.node("ShaderNodeAddShader")
    tree.link(tree.node("ShaderNodeBsdfDiffuse"), "BSDF", add, "Shader")
    tree.link(tree.node(idname), "Volume", add, "Shader_001")
    tree.link(add, "Shader", tree.output, "Surface")
    context = Context()
    assert [closure.op for closure in tree.compile(context).closures] == ["CLOSURE_DIFFUSE"]
    assert not context.warnings


@pytest.mark.parametrize("idname", ["ShaderNodeVolumeScatter", "ShaderNodeVolumeCoefficients"])
@pytest.mark.parametrize("phase", PHASE_INPUTS)
def test_phase_functions_take_what_they_depend_on(empty_scene, idname, phase):
    if not hasattr(bpy.types, idname) or "phase" not in bpy.types.ShaderNodeVolumeScatter.bl_rna.properties:
        pytest.skip("this Blender has no such node, or one phase function")
    tree = Tree()
    node = tree.node(idname, phase=phase)
    expected = [0.25, 0.375][: len(PHASE_INPUTS[phase])]
    for name, value in zip(PHASE_INPUTS[phase], expected, strict=True):
        node.inputs[name].default_value = value
    tree.link(node, "Volume", tree.output, "Volume")
    context = Context()
    medium = next(closure for closure in tree.compile(context).closures if closure.op == "CLOSURE_VOLUME")
    assert list(medium.parameters) == [PHASE_FUNCTIONS.index(phase)]
    assert [value[0] for value in medium.inputs[4:6]] == [*expected, 0.0, 0.0][:2]
    assert not context.warnings


def test_object_without_material_is_as_cycles_has_it(empty_scene):
    (closure,) = compile_material(None, Context()).closures
    if versions.materials_are_trees():
        (new,) = compile_material(bpy.data.materials.new("New"), Context()).closures
        assert closure.op == "CLOSURE_PRINCIPLED"
        for ours, theirs in zip(closure.inputs, new.inputs, strict=True):
            assert ours.op == theirs.op if hasattr(theirs, "op") else ours == pytest.approx(theirs)
    else:
        assert closure.op == "CLOSURE_DIFFUSE" and closure.inputs[1] == (0.8, 0.8, 0.8)


def test_world_reads_directions(empty_scene):
    world = bpy.data.worlds.new("Sky")
    world.use_nodes = True
    tree = world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.new("sky", 4, 2)
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    tree.links.new(background.inputs["Color"], texture.outputs[0])
    (closure,) = compile_world(world, Context()).closures
    assert closure.inputs[1].op == "ENVIRONMENT_IMAGE" and closure.inputs[1].inputs[0].op == "GENERATED"
    assert compile_world(None, Context()) is None


def test_plain_light_needs_no_program(empty_scene):
    light = bpy.data.lights.new("Lamp", "POINT")
    light.use_nodes = True
    assert compile_light(light, Context()) is None
    emission = next(node for node in light.node_tree.nodes if node.bl_idname == "ShaderNodeEmission")
    emission.inputs["Strength"].default_value = 2.0
    (closure,) = compile_light(light, Context()).closures
    assert closure.op == "CLOSURE_EMISSION" and closure.inputs[2][0] == 2.0
    light.node_tree.links.clear()
    assert compile_light(light, Context()).closures == []


@pytest.mark.parametrize(("kind", "has_map"), [("AREA", True), ("SPOT", False)])
def test_what_lamps_do_not_have_is_named(kind: str, has_map: bool) -> None:
    light = bpy.data.lights.new("Bulb", kind)
    light.use_nodes = True
    tree = light.node_tree
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["UV"], emission.inputs["Color"])
    tree.links.new(tree.nodes.new("ShaderNodeObjectInfo").outputs["Random"], emission.inputs["Strength"])
    context = Context()
    compile_light(light, context)
    warnings = "\n".join(context.warnings)
    assert f"Light '{light.name}': nodes replaced by their defaults: Object Info (Random)" in warnings
    assert ("only area lamps have UV coordinates" in warnings) != has_map


def test_coordinates_of_another_object(empty_scene):
    other = bpy.data.objects.new("Other", None)
    other.location = (1.0, 2.0, 3.0)
    empty_scene.collection.objects.link(other)
    bpy.context.view_layer.update()
    tree = Tree()
    tree.shown(tree.node("ShaderNodeTexCoord", object=other), "Object")
    shifted = emission_color(tree)
    assert shifted.op == "VECTOR_MATH" and shifted.inputs[1] == pytest.approx((-1.0, -2.0, -3.0))
    assert all(math.isfinite(x) for row in shifted.inputs[0].inputs for x in row.inputs[1])


def test_materials_of_real_scenes(empty_scene):
    folder = os.environ.get(SCENES)
    if not folder:
        pytest.skip(f"{SCENES} does not name a folder of .blend files")
    if bpy.app.version < (4, 5, 0):
        pytest.skip("Blender 4.2 does not read the files of Blender 5")
    files = sorted(Path(folder).glob("*.blend"))
    assert files
    for file in files:
        bpy.ops.wm.open_mainfile(filepath=str(file))
        context = Context()
        programs = [compile_material(material, context) for material in bpy.data.materials]
        print(file.name, len(programs), "materials;", *context.warnings, sep="\n  ")


def test_groups_of_python_add_ons_are_groups(empty_scene):
    class Custom(bpy.types.ShaderNodeCustomGroup):
        bl_idname, bl_label = "TestCustomGroup", "Custom"

    bpy.utils.register_class(Custom)
    try:
        tree = Tree()
        use = tree.node("TestCustomGroup", node_tree=tinting_group("Tint"))
        assert is_group(use) and not is_foreign(use)
        assert use.node_tree in set(all_groups([tree.tree]))
        tree.tree.links.new(tree.shown(tree.node("ShaderNodeRGB"), "Color").inputs["Color"], use.outputs[0])
        context = Context()
        tree.compile(context)
        assert not context.warnings
    finally:
        bpy.utils.unregister_class(Custom)


def test_threads_that_compile_leave_each_other_room():
    limit = sys.getrecursionlimit()
    with _DEEP_RECURSION:
        with _DEEP_RECURSION:
            pass
        assert sys.getrecursionlimit() >= RECURSION_LIMIT
    assert sys.getrecursionlimit() == limit
