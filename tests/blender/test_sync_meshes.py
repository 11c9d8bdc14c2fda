"""Meshes of every shape against what Blender's slow, obvious interfaces say."""

import bpy
import numpy as np
import pytest
from fake_core import SceneBuilder

from addon.sync.meshes import generated_coordinates, mesh_arrays
from addon.sync.nodes.value_names import RENDER_COLOR


def evaluated_object(data: bpy.types.ID) -> bpy.types.Object:
    obj = bpy.data.objects.new("Thing", data)
    bpy.context.scene.collection.objects.link(obj)
    return obj.evaluated_get(bpy.context.evaluated_depsgraph_get())


def mesh_of(points, polygons, edges=()) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("Shape")
    mesh.from_pydata(points, edges, polygons)
    return mesh


def arrays_of(mesh: bpy.types.Mesh, wanted=frozenset()):
    arrays = mesh_arrays(evaluated_object(mesh).data, wanted)
    SceneBuilder().add_mesh("Shape", **vars(arrays))  # checks every type, shape and length
    return arrays


SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def test_triangles_need_no_offsets(empty_scene) -> None:
    arrays = arrays_of(mesh_of(SQUARE, [(0, 1, 2), (0, 2, 3)]))
    assert arrays.polygon_offsets is None and arrays.triangle_corners is None
    assert arrays.corner_vertices.tolist() == [0, 1, 2, 0, 2, 3]
    assert arrays.positions.tolist() == [list(p) for p in SQUARE]


def test_triangles_and_quads_together(empty_scene) -> None:
    arrays = arrays_of(mesh_of([*SQUARE, (2, 0, 1)], [(0, 1, 2, 3), (1, 4, 2)]))
    assert arrays.polygon_offsets.tolist() == [0, 4, 7]
    assert arrays.triangle_corners is None


def test_as_many_corners_as_triangles_would_have_but_no_triangles(empty_scene) -> None:
    points = [(x, y, 0) for x in range(3) for y in range(3)]
    arrays = arrays_of(mesh_of(points, [(0, 3, 4, 1), (3, 6, 7, 8, 4)]))
    assert arrays.polygon_offsets.tolist() == [0, 4, 9]


def test_large_and_concave_polygons_are_cut_by_blender(empty_scene) -> None:
    arrow = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 0.5, 0), (0, 2, 0)]
    arrays = arrays_of(mesh_of(arrow, [(0, 1, 2, 3, 4)]))
    assert arrays.triangle_polygons.tolist() == [0, 0, 0]
    corners = arrays.positions[arrays.corner_vertices[arrays.triangle_corners]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (cross[:, 2] > 0).all()  # none folded over
    assert 0.5 * cross[:, 2].sum() == pytest.approx(4 - 1.5)  # the square less the notch


@pytest.mark.parametrize("data", [([], []), (SQUARE, [])])
def test_meshes_without_polygons(empty_scene, data) -> None:
    mesh = mesh_of(*data, edges=[(0, 1)] if data[0] else ())
    arrays = arrays_of(mesh)
    assert len(arrays.positions) == len(data[0]) and len(arrays.corner_vertices) == 0


def test_loose_edges_beside_a_polygon(empty_scene) -> None:
    arrays = arrays_of(mesh_of([*SQUARE, (5, 5, 5), (6, 6, 6)], [(0, 1, 2)], edges=[(4, 5)]))
    assert len(arrays.positions) == 6 and arrays.corner_vertices.tolist() == [0, 1, 2]


def test_normals_come_in_the_smallest_domain(empty_scene) -> None:
    bpy.ops.mesh.primitive_cube_add()
    mesh = bpy.context.object.data
    mesh.shade_flat()
    assert arrays_of(mesh).normals_domain == "FACE"
    mesh.shade_smooth()
    smooth = arrays_of(mesh)
    assert smooth.normals_domain == "POINT"
    assert smooth.normals == pytest.approx(smooth.positions / np.sqrt(3), abs=1e-6)
    mesh.polygons[0].use_smooth = False
    mixed = arrays_of(mesh)
    assert mixed.normals_domain == "POINT" and mixed.sharp_faces.tolist() == [1, 0, 0, 0, 0, 0]
    assert mixed.normals == pytest.approx(smooth.normals)
    mesh.edges[0].use_edge_sharp = True
    parted = arrays_of(mesh)
    assert parted.normals_domain == "CORNER"
    assert parted.normals == pytest.approx(np.array([c.vector for c in mesh.corner_normals]))
    assert parted.normals[0] == pytest.approx(np.array(mesh.polygons[0].normal))


def test_the_active_render_uv_map_comes_first(empty_scene) -> None:
    mesh = mesh_of(SQUARE, [(0, 1, 2, 3)])
    for index, name in enumerate(("First", "Second", "Third")):
        layer = mesh.uv_layers.new(name=name)
        layer.data.foreach_set("uv", np.arange(8, dtype=np.float32) + 10 * index)
    mesh.uv_layers["Second"].active_render = True
    arrays = arrays_of(mesh)
    assert [name for name, _, _ in arrays.attributes] == ["Second", "First", "Third"]
    assert arrays.attributes[0][2].ravel().tolist() == list(range(10, 18))
    assert {domain for _, domain, _ in arrays.attributes} == {"CORNER"}


def test_other_attributes_come_when_wanted(empty_scene) -> None:
    mesh = mesh_of(SQUARE, [(0, 1, 2, 3)])
    kinds = {"FLOAT": 1, "INT": 1, "FLOAT_VECTOR": 3, "FLOAT_COLOR": 4, "BYTE_COLOR": 4, "FLOAT2": 2}
    for kind in kinds:
        mesh.attributes.new(kind, kind, "POINT")
    mesh.attributes.new("Text", "STRING", "POINT")
    mesh.attributes["INT"].data.foreach_set("value", (4, 5, 6, 7))
    assert arrays_of(mesh).attributes == []
    arrays = arrays_of(mesh, frozenset(kinds) | {"Text", "Absent"})
    assert {name: values.shape[1] for name, _, values in arrays.attributes} == kinds
    assert {domain for _, domain, _ in arrays.attributes} == {"POINT"}
    assert next(v for n, _, v in arrays.attributes if n == "INT").ravel().tolist() == [4, 5, 6, 7]


def test_values_of_edges_are_averaged_at_points(empty_scene) -> None:
    mesh = mesh_of([*SQUARE, (5, 5, 5)], [(0, 1, 2, 3)])
    edge_values = {(0, 1): 1.0, (1, 2): 2.0, (2, 3): 4.0, (0, 3): 8.0}
    values = [edge_values[tuple(sorted(edge.vertices))] for edge in mesh.edges]
    mesh.attributes.new("Crease", "FLOAT", "EDGE").data.foreach_set("value", values)
    mesh.attributes.new("Bevel", "FLOAT_VECTOR", "EDGE").data.foreach_set("vector", np.repeat(values, 3))
    arrays = arrays_of(mesh, {"Crease", "Bevel"})
    assert [(name, domain) for name, domain, _ in arrays.attributes] == [("Crease", "POINT"), ("Bevel", "POINT")]
    for _, _, means in arrays.attributes:
        assert (means.T == [4.5, 1.5, 3.0, 6.0, 0.0]).all()


def test_edges_mix_by_type(empty_scene) -> None:
    mesh = mesh_of(SQUARE, [(0, 1, 2, 3)])
    is_first = [tuple(sorted(edge.vertices)) == (0, 1) for edge in mesh.edges]
    mesh.attributes.new("Flag", "BOOLEAN", "EDGE").data.foreach_set("value", is_first)
    mesh.attributes.new("Count", "INT", "EDGE").data.foreach_set("value", [-3 if first else 0 for first in is_first])
    colours = [(1.0, 1.0, 1.0, 1.0) if first else (0.0, 0.0, 0.0, 0.0) for first in is_first]
    mesh.attributes.new("Paint", "BYTE_COLOR", "EDGE").data.foreach_set("color_srgb", np.ravel(colours))
    values = {name: values for name, _, values in arrays_of(mesh, {"Flag", "Count", "Paint"}).attributes}
    assert values["Flag"].ravel().tolist() == [1, 1, 0, 0]
    assert values["Count"].ravel().tolist() == [-2, -2, 0, 0]
    assert values["Paint"][0] == pytest.approx((0.214, 0.214, 0.214, 0.5), abs=1e-3)


def test_byte_colours_are_linear(empty_scene) -> None:
    mesh = mesh_of(SQUARE, [(0, 1, 2, 3)])
    layer = mesh.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    layer.data.foreach_set("color", np.tile(np.float32((0.5, 0.25, 0.0, 1.0)), 4))
    _, domain, values = arrays_of(mesh, {"Paint"}).attributes[0]
    assert domain == "CORNER" and values[0] == pytest.approx((0.5, 0.25, 0, 1), abs=0.01)


def test_a_nameless_colour_is_the_active_render_one(empty_scene) -> None:
    mesh = mesh_of(SQUARE, [(0, 1, 2, 3)])
    for name, value in (("First", 0.25), ("Second", 0.75)):
        layer = mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT")
        layer.data.foreach_set("color", np.full(16, value, np.float32))
    mesh.color_attributes.render_color_index = 1
    assert not arrays_of(mesh, {"Color"}).attributes
    name, domain, values = arrays_of(mesh, {RENDER_COLOR}).attributes[0]
    assert (name, domain) == (RENDER_COLOR, "POINT") and (values == 0.75).all()


def test_material_indices(empty_scene) -> None:
    mesh = mesh_of(SQUARE, [(0, 1, 2), (0, 2, 3)])
    assert arrays_of(mesh).material_indices is None
    mesh.materials.append(bpy.data.materials.new("A"))
    mesh.materials.append(bpy.data.materials.new("B"))
    mesh.polygons[1].material_index = 1
    assert arrays_of(mesh).material_indices.tolist() == [0, 1]


def test_modifiers_are_applied(empty_scene) -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.modifiers.new("Smooth", "SUBSURF").levels = 2
    evaluated = bpy.context.object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert len(mesh_arrays(evaluated.data).positions) == 98


def test_generated_coordinates_are_left_to_the_core_where_they_are_the_bounds(empty_scene) -> None:
    assert generated_coordinates(mesh_of(SQUARE, [(0, 1, 2, 3)])) is None


def test_generated_coordinates_in_a_texture_space_of_its_own(empty_scene) -> None:
    mesh = mesh_of(SQUARE, [(0, 1, 2, 3)])
    mesh.use_auto_texspace = False
    mesh.texspace_location, mesh.texspace_size = (1.0, 0.0, 0.0), (2.0, 4.0, 1.0)
    expected = (np.array(SQUARE) - (1.0, 0.0, 0.0)) / (4.0, 8.0, 2.0) + 0.5
    assert generated_coordinates(mesh) == pytest.approx(expected, abs=1e-6)
