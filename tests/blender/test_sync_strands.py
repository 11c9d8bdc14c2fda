"""Hair curves and particle hair to arrays of the core."""

import bpy
import numpy as np
import pytest
from recorded_calls import instances
from small_objects import link, triangle

from addon.sync import versions
from tests.support.hair_scenes import CAN_MAKE_CURVES, add_particle_hair, hair_curves, make_poly

pytestmark = pytest.mark.skipif(not CAN_MAKE_CURVES, reason="scripts cannot make hair curves")

KEYS = np.array([[(0, 0, 0), (0, 0, 1), (0, 0, 3)], [(1, 0, 0), (1, 0, 2), (1, 0, 4)]], np.float32)
WIDTHS = np.array([[0.3, 0.2, 0.1], [0.6, 0.4, 0.2]], np.float32)


def read_hair_info(*outputs: str) -> bpy.types.Material:
    material = bpy.data.materials.new("Reads")
    material.use_nodes = True
    tree = material.node_tree
    principled = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    node = tree.nodes.new("ShaderNodeHairInfo")
    for output, socket in zip(outputs, ("Roughness", "Metallic", "IOR", "Alpha", "Coat Weight"), strict=False):
        tree.links.new(node.outputs[output], principled.inputs[socket])
    return material


def attributes_of(call: dict) -> dict[str, list]:
    return {name: values.tolist() for name, _, values in call["attributes"]}


def test_curves_come_with_their_keys_and_radii(camera_scene, recorded_sync) -> None:
    link("Hair", hair_curves("Hair", KEYS, WIDTHS), location=(1, 2, 3))
    builder, report = recorded_sync()
    call = builder.of("add_strands")[0]
    assert (call["positions"] == KEYS.reshape(-1, 3)).all() and (call["radii"] == WIDTHS.ravel()).all()
    assert call["strand_offsets"].tolist() == [0, 3, 6] and call["shape"] == "SPLINES"
    assert call["attributes"] == [] and report.warnings == []
    assert instances(builder)["object_to_world"][0][:3, 3].tolist() == [1, 2, 3]


def test_curves_without_radii_are_as_wide_as_in_cycles(camera_scene, recorded_sync) -> None:
    curves = bpy.data.hair_curves.new("Bare")
    curves.add_curves([2])
    link("Bare", curves)
    assert recorded_sync()[0].of("add_strands")[0]["radii"].tolist() == pytest.approx([0.005, 0.005])


@pytest.mark.parametrize(("first", "end"), [(0, 2), (0, 1), (1, 2), (2, 2)])
def test_the_first_curve_says_whether_all_are_straight(camera_scene, recorded_sync, first, end) -> None:
    make_poly(link("Hair", hair_curves("Hair", KEYS, WIDTHS)), first, end)
    is_straight = first == 0 and versions.poly_curves_are_straight()
    assert recorded_sync()[0].of("add_strands")[0]["shape"] == ("LINES" if is_straight else "SPLINES")


def test_what_hair_info_reads(camera_scene, recorded_sync) -> None:
    curves = hair_curves("Hair", KEYS, WIDTHS)
    curves.materials.append(read_hair_info("Is Strand", "Intercept", "Length", "Thickness", "Random"))
    link("Hair", curves)
    found = attributes_of(recorded_sync()[0].of("add_strands")[0])
    assert np.ravel(found["INFO:intercept"]).tolist() == pytest.approx([0, 1 / 3, 1, 0, 0.5, 1])
    assert found["INFO:length"] == [[3], [4]] and found["INFO:strand"] == [[1], [1]]
    assert np.ravel(found["INFO:thickness"]).tolist() == pytest.approx((2 * WIDTHS).ravel().tolist())
    random = np.ravel(found["INFO:random"])
    assert ((random >= 0) & (random <= 1)).all() and random[0] != random[1]


def test_the_first_pair_of_numbers_is_the_uv_map(camera_scene, recorded_sync) -> None:
    curves = hair_curves("Hair", KEYS, WIDTHS)
    curves.attributes.new("surface_uv", "FLOAT2", "CURVE").data.foreach_set("vector", np.float32([0.1, 0.2, 0.3, 0.4]))
    link("Hair", curves)
    (name, domain, values), *rest = recorded_sync()[0].of("add_strands")[0]["attributes"]
    assert (name, domain, rest) == ("surface_uv", "FACE", [])
    assert values == pytest.approx(np.array([[0.1, 0.2], [0.3, 0.4]]))


def test_pairs_of_points_are_no_uv_map(camera_scene, recorded_sync) -> None:
    """Though a material reads them: the core takes the first attribute if that is pairs."""
    curves = hair_curves("Hair", KEYS, WIDTHS)
    curves.attributes.new("pairs", "FLOAT2", "POINT")
    curves.materials.append(bpy.data.materials.new("By pairs"))
    curves.materials[0].use_nodes = True
    curves.materials[0].node_tree.nodes.new("ShaderNodeAttribute").attribute_name = "pairs"
    link("Hair", curves)

    def names() -> list[str]:
        return [name for name, *_ in recorded_sync()[0].of("add_strands")[0]["attributes"]]

    assert names() == ["INFO:strand", "pairs"]
    curves.attributes.new("surface_uv", "FLOAT2", "CURVE")
    assert names() == ["surface_uv", "pairs"]


def test_normals_of_cross_sections(camera_scene, recorded_sync) -> None:
    """For Principled Hair by Huang alone, across the strands."""
    curves = hair_curves("Hair", KEYS, WIDTHS)
    material = bpy.data.materials.new("Facets")
    material.use_nodes = True
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    tree.links.new(node.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Surface"])
    curves.materials.append(material)
    link("Hair", curves)
    assert "INFO:strand normal" not in attributes_of(recorded_sync()[0].of("add_strands")[0])
    node.model = "HUANG"
    builder, report = recorded_sync()
    normals = np.array(attributes_of(builder.of("add_strands")[0])["INFO:strand normal"])
    assert report.warnings == [] and np.linalg.norm(normals[-1]) == pytest.approx(1.0)
    last = KEYS[:, -1] - KEYS[:, -2]
    assert (normals.reshape(KEYS.shape)[:, -1] * last).sum(axis=1) == pytest.approx(np.zeros(len(last)), abs=1e-5)


def test_empty_curves_show_nothing(camera_scene, recorded_sync) -> None:
    link("Empty", bpy.data.hair_curves.new("Empty"))
    builder, _ = recorded_sync()
    assert builder.of("add_strands") == [] and builder.of("add_instances") == []


def test_single_keys_are_named(camera_scene, recorded_sync) -> None:
    curves = bpy.data.hair_curves.new("Dots")
    curves.add_curves([1, 3])
    link("Dots", curves)
    _, report = recorded_sync()
    assert report.warnings == ["Curves 'Dots': strands with fewer than two keys are left out"]


def test_particle_hair_is_an_instance_beside_its_mesh(camera_scene, recorded_sync) -> None:
    obj = link("Head", triangle(), location=(1, 2, 3))
    obj.scale = (2, 2, 2)
    add_particle_hair(obj, count=5, hair_length=0.5, render_step=2, tip_radius=0.5, radius_scale=0.1)
    builder, report = recorded_sync()
    call = builder.of("add_strands")[0]
    assert call["strand_offsets"].tolist() == list(range(0, 26, 5)) and report.warnings == []
    keys = call["positions"].reshape(5, 5, 3)
    assert keys[:, 0, 2] == pytest.approx(np.zeros(5), abs=1e-5), "roots lie on the triangle, in its own space"
    assert call["radii"].reshape(5, 5)[:, [0, -1]] == pytest.approx(np.tile([0.05, 0.025], (5, 1)), rel=1e-4)
    placed = instances(builder)
    assert len(set(placed["mesh"].tolist())) == 2 and len(set(placed["keys"].tolist())) == 2
    assert (placed["object_to_world"][0] == placed["object_to_world"][1]).all()


def test_children_hide_their_parents(camera_scene, recorded_sync) -> None:
    obj = link("Head", triangle())
    add_particle_hair(obj, count=3, child_type="SIMPLE", rendered_child_count=4)
    assert len(recorded_sync()[0].of("add_strands")[0]["strand_offsets"]) == 12 + 1


def test_shortened_children_end_where_their_last_key_is(camera_scene, recorded_sync) -> None:
    """Blender has zeros for the keys that they lack: strands went on to the world's origin."""
    obj = link("Head", triangle(), location=(5, 5, 5))
    add_particle_hair(obj, count=3, hair_length=1.0, child_type="SIMPLE", rendered_child_count=4, child_length=0.5)
    keys = recorded_sync()[0].of("add_strands")[0]["positions"]
    assert np.abs(keys).max() < 2.0, "in the space of the object"


def test_hair_is_seen_without_its_emitter_and_the_other_way_round(camera_scene, recorded_sync) -> None:
    obj = link("Head", triangle())
    add_particle_hair(obj, count=3)
    obj.show_instancer_for_render = False
    builder, _ = recorded_sync()
    assert len(builder.of("add_strands")) == len(instances(builder)["mesh"]) == 1
    obj.show_instancer_for_render = True
    obj.modifiers[0].show_render = False
    builder, _ = recorded_sync()
    assert builder.of("add_strands") == [] and len(instances(builder)["mesh"]) == 1


def test_instances_share_particle_hair(camera_scene, recorded_sync) -> None:
    inside = bpy.data.collections.new("Inside")
    add_particle_hair(link("Head", triangle(), inside), count=3)
    for x in (3, 5):
        empty = link(f"Empty {x}", None, location=(x, 0, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", inside
    builder, _ = recorded_sync()
    assert len(builder.of("add_strands")) == 1 and len(instances(builder)["mesh"]) == 4
    assert sorted(instances(builder)["object_to_world"][:, 0, 3].tolist()) == [3, 3, 5, 5]


def test_layers_without_hair_have_none(camera_scene, recorded_sync) -> None:
    add_particle_hair(link("Head", triangle()), count=3)
    link("Hair", hair_curves("Hair", KEYS, WIDTHS))
    camera_scene.view_layers[0].use_strand = False
    builder, _ = recorded_sync()
    assert builder.of("add_strands") == [] and len(instances(builder)["mesh"]) == 1


def test_particle_hair_has_uv_maps_and_colours_of_its_roots(camera_scene, recorded_sync) -> None:
    obj = link("Head", triangle())
    for name, value in (("First", 0.25), ("Shown", 0.75)):
        layer = obj.data.uv_layers.new(name=name)
        layer.data.foreach_set("uv", np.full(6, value, np.float32))
    obj.data.uv_layers["Shown"].active_render = True
    colors = obj.data.color_attributes.new("Tint", "BYTE_COLOR", "CORNER")
    colors.data.foreach_set("color_srgb", np.tile(np.float32([1, 0, 1, 1]), 3))
    material = bpy.data.materials.new("Reads")
    material.use_nodes = True
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "Tint"
    principled = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    tree.links.new(node.outputs["Color"], principled.inputs["Base Color"])
    obj.data.materials.append(material)
    add_particle_hair(obj, count=2, child_type="INTERPOLATED", rendered_child_count=3)
    (first, _, shown), (second, _, other), (third, domain, tint) = recorded_sync()[0].of("add_strands")[0]["attributes"]
    assert (first, second, third, domain) == ("Shown", "First", "Tint", "FACE")
    assert shown == pytest.approx(np.full((6, 2), 0.75)) and other == pytest.approx(np.full((6, 2), 0.25))
    assert tint == pytest.approx(np.tile([1.0, 0.0, 1.0], (6, 1)), abs=0.01)


def test_hair_has_the_flags_of_its_object(camera_scene, recorded_sync) -> None:
    obj = link("Head", triangle())
    obj.visible_shadow, obj.is_holdout, obj.pass_index = False, True, 3
    add_particle_hair(obj, count=3)
    curves = link("Hair", hair_curves("Hair", KEYS, WIDTHS))
    curves.visible_camera = False
    builder, _ = recorded_sync()
    placed = instances(builder)
    assert placed["visibility"].tolist() == [47, 62, 47] and placed["holdout"].tolist() == [1, 0, 1]
    assert placed["object"][0] == placed["object"][2] != placed["object"][1]
    obj.visible_camera = obj.visible_diffuse = obj.visible_glossy = False
    obj.visible_transmission = obj.visible_volume_scatter = False
    assert len(recorded_sync()[0].of("add_strands")) == 1, "of what no ray sees there is no hair"


def combed(**members) -> bpy.types.Object:
    """A plane with hair that Blender keeps beside its mesh."""
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    add_particle_hair(plane, count=4, **members)
    bpy.ops.object.mode_set(mode="PARTICLE_EDIT")
    bpy.ops.particle.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    return plane


def test_combed_hair_of_a_mesh_in_edit_mode_is_left_out(camera_scene, recorded_sync) -> None:
    """Blender does not evaluate it then, and would end at the question for its UV coordinates or colours."""
    plane = combed()
    plane.data.vertex_colors.new(name="Tint")
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        builder, report = recorded_sync()
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    assert builder.of("add_strands") == [] and report.warnings == []
    builder, _ = recorded_sync()
    assert len(builder.of("add_strands")) == 1


def geometry_nodes(plane, name: str, node_type: str, **members) -> bpy.types.NodesModifier:
    """A modifier of one node, which has this name."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, finish, node = map(tree.nodes.new, ("NodeGroupInput", "NodeGroupOutput", node_type))
    for member, value in members.items():
        setattr(node, member, value)
    node.inputs["Name"].default_value = name
    if node_type == "GeometryNodeStoreNamedAttribute":
        value = next(socket for socket in node.inputs if socket.name == "Value" and socket.enabled)
        value.default_value[:2] = 0.375, 0.625
    tree.links.new(start.outputs[0], node.inputs[0])
    tree.links.new(node.outputs[0], finish.inputs[0])
    modifier = plane.modifiers.new(name, "NODES")
    modifier.node_group = tree
    return modifier


def stored_uv_map(plane, name: str) -> bpy.types.NodesModifier:
    """Of one value, (0.375, 0.625)."""
    return geometry_nodes(plane, name, "GeometryNodeStoreNamedAttribute", data_type="FLOAT2", domain="CORNER")


def test_hair_has_the_uv_maps_that_its_modifier_finds(camera_scene, recorded_sync) -> None:
    """Blender looks them up by numbers, and ends where there are fewer."""
    plane = combed()
    stored_uv_map(plane, "Later")
    builder, report = recorded_sync()
    (call,) = builder.of("add_strands")
    assert [name for name, _, _ in call["attributes"]] == ["UVMap"] and report.warnings == []
    (mesh,) = builder.of("add_mesh")
    assert {name for name, _, _ in mesh["attributes"]} >= {"UVMap", "Later"}


def test_hair_has_the_uv_maps_that_modifiers_before_its_own_leave(camera_scene, recorded_sync) -> None:
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    plane.data.uv_layers.new(name="Last").data.foreach_set("uv", np.full(8, 0.25, np.float32))
    geometry_nodes(plane, "UVMap", "GeometryNodeRemoveAttribute")
    stored_uv_map(plane, "Earlier")
    add_particle_hair(plane, count=4)
    builder, report = recorded_sync()
    (call,) = builder.of("add_strands")
    found = {name: values for name, _, values in call["attributes"]}
    assert set(found) == {"Last", "Earlier"} and report.warnings == []
    np.testing.assert_allclose(found["Last"], np.full((4, 2), 0.25), rtol=1e-5)
    np.testing.assert_allclose(found["Earlier"], np.tile((0.375, 0.625), (4, 1)), rtol=1e-5)
    stored_uv_map(plane, "Later")
    builder, _ = recorded_sync()
    (call,) = builder.of("add_strands")
    assert not {name for name, _, _ in call["attributes"]} & {"Last", "Earlier", "Later"}, "numbers are not known"
