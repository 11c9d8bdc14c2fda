"""Instances of every kind: where they are, and what they share."""

import gc
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
import pytest
from recorded_calls import instances, places
from small_objects import grid_with_cubes, link, triangle

from addon.sync import motion
from addon.sync.placements import Surface, instance_keys


def test_an_object_is_placed_by_its_row_major_matrix(camera_scene, recorded_sync) -> None:
    obj = link("Thing", triangle(), location=(1, 2, 3))
    obj.rotation_euler, obj.scale = (0.1, 0.2, 0.3), (1, -2, 3)
    builder, _ = recorded_sync()
    assert instances(builder)["object_to_world"][0] == pytest.approx(np.array(obj.matrix_world), abs=1e-6)
    assert builder.of("add_object_name") == [{"name": "Thing", "pass_index": 0, "asset": "Thing"}]


@pytest.mark.parametrize(("axis", "scale"), [(0, (0, 2, 3)), (1, (2, 0, 3)), (2, (2, 3, 0)), (2, (2, -3, 0))])
def test_a_flat_mesh_keeps_an_invertible_matrix(camera_scene, recorded_sync, axis, scale) -> None:
    mesh = bpy.data.meshes.new("Flat")
    corners = np.insert(np.array([(0, 0), (1, 0), (0, 1)], float), axis, 0.0, axis=1)
    mesh.from_pydata(corners.tolist(), [], [(0, 1, 2)])
    obj = link("Flat", mesh)
    obj.scale, obj.rotation_euler = scale, (0.1, 0.2, 0.3)
    matrix = instances(recorded_sync()[0])["object_to_world"][0].astype(float)
    assert abs(np.linalg.det(matrix[:3, :3])) == pytest.approx(6.0, rel=1e-5)
    assert matrix[:3, :3] @ corners.T == pytest.approx(np.array(obj.matrix_world)[:3, :3] @ corners.T, abs=1e-6)


def test_objects_share_the_mesh_they_share_in_blender(camera_scene, recorded_sync) -> None:
    shared = triangle()
    link("A", shared)
    link("B", shared, location=(1, 0, 0))
    changed = link("C", shared, location=(2, 0, 0))
    changed.modifiers.new("Cut", "SUBSURF")
    builder, _ = recorded_sync()
    assert len(builder.of("add_mesh")) == 2
    assert len(set(instances(builder)["mesh"].tolist())) == 2 and len(instances(builder)["mesh"]) == 3


def test_instanced_collections_bring_objects_and_lamps(camera_scene, recorded_sync) -> None:
    collection = bpy.data.collections.new("Set")
    link("Thing", triangle(), collection, (0, 0, 1))
    link("Lamp", bpy.data.lights.new("Lamp", "POINT"), collection, (0, 0, 2))
    for x in (3, 5):
        empty = link(f"Empty {x}", None, location=(x, 0, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
    builder, _ = recorded_sync()
    assert places(builder) == [(3, 0, 1), (5, 0, 1)]
    assert len(builder.of("add_mesh")) == 1
    assert [light["position"] for light in builder.of("add_point_light")] == [(3, 0, 2), (5, 0, 2)]


def test_instances_on_vertices_hide_their_source(camera_scene, recorded_sync) -> None:
    parent = link("Parent", triangle())
    child = link("Child", triangle("Child"))
    child.parent, parent.instance_type, parent.show_instancer_for_render = parent, "VERTS", False
    builder, _ = recorded_sync()
    assert places(builder) == [(0, 0, 0), (0, 1, 0), (1, 0, 0)]


def test_particles(camera_scene, recorded_sync) -> None:
    emitter = link("Emitter", triangle())
    emitter.show_instancer_for_render = False
    emitter.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.type, settings.count, settings.render_type = "HAIR", 7, "OBJECT"
    settings.use_advanced_hair, settings.instance_object = True, link("Leaf", triangle("Leaf"), location=(9, 9, 9))
    builder, _ = recorded_sync()
    assert len(instances(builder)["mesh"]) == 7 + 1
    assert len(builder.of("add_mesh")) == 1
    assert len(set(instances(builder)["random"].tolist())) == 8


def test_geometry_nodes_instances_share_one_mesh_and_its_material(camera_scene, recorded_sync) -> None:
    grid_with_cubes(4, bpy.data.materials.new("Paint"))
    builder, _ = recorded_sync()
    values = instances(builder)
    assert len(values["mesh"]) == 16 and len(builder.of("add_mesh")) == 1
    assert len(np.unique(values["object_to_world"][:, :3, 3], axis=0)) == 16
    assert [call["program"].name for call in builder.of("add_material")] == ["default", "Paint"]
    assert len(set(values["random"].tolist())) == 16
    assert (values["random"] >= 0).all() and (values["random"] < 1).all()


@pytest.mark.parametrize(
    ("add", "surfaces"),
    [
        ("curve.primitive_bezier_circle_add", 2),
        ("surface.primitive_nurbs_surface_sphere_add", 2),
        ("object.text_add", 2),
        ("object.metaball_add", 1),  # one for the whole family
    ],
)
def test_everything_with_a_surface_shows_once(camera_scene, recorded_sync, add, surfaces) -> None:
    category, operator = add.split(".")
    for x in (0, 10):
        getattr(getattr(bpy.ops, category), operator)(location=(x, 0, 0))
        if bpy.context.object.type == "CURVE":
            bpy.context.object.data.bevel_depth = 0.1
    builder, report = recorded_sync()
    assert len(instances(builder)["mesh"]) == len(builder.of("add_mesh")) == surfaces
    assert report.warnings == []


@pytest.mark.parametrize("polygons", [[], [(0, 1, 2)]])
def test_meshes_without_polygons_and_bare_curves_show_nothing(camera_scene, recorded_sync, polygons) -> None:
    bpy.ops.curve.primitive_bezier_curve_add()
    mesh = bpy.data.meshes.new("Shape")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 1)], [(0, 3)], polygons)
    link("Shape", mesh)
    builder, report = recorded_sync()
    assert len(builder.of("add_mesh")) == len(builder.of("add_instances")) == len(polygons)
    assert report.warnings == []


def test_meshes_that_nodes_make_of_curves(camera_scene, recorded_sync) -> None:
    """Such an object is shown once for each kind of geometry, under one address in turn."""
    tree = bpy.data.node_groups.new("Both", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    join, cube = tree.nodes.new("GeometryNodeJoinGeometry"), tree.nodes.new("GeometryNodeMeshCube")
    tree.links.new(start.outputs[0], join.inputs[0])
    tree.links.new(cube.outputs[0], join.inputs[0])
    tree.links.new(join.outputs[0], end.inputs[0])
    for x in (0, 10):
        bpy.ops.curve.primitive_bezier_circle_add(location=(x, 0, 0))
        bpy.context.object.modifiers.new("Both", "NODES").node_group = tree
    builder, _ = recorded_sync()
    cubes = [call for call in builder.of("add_mesh") if len(call["corner_vertices"]) == 24]
    assert len(cubes) == len(builder.of("add_mesh")) == 2
    assert places(builder) == [(0, 0, 0), (10, 0, 0)]


@contextmanager
def watched_memory(file: str) -> Iterator[list[tracemalloc.StatisticDiff]]:
    """What lines of a file of the add-on left behind, once it is over."""
    left: list[tracemalloc.StatisticDiff] = []
    gc.collect()
    tracemalloc.start()
    try:
        before = tracemalloc.take_snapshot()
        yield left
        gc.collect()
        differences = tracemalloc.take_snapshot().compare_to(before, "lineno")
    finally:
        tracemalloc.stop()
    left += [line for line in differences if Path(line.traceback[0].filename).name == file and line.count_diff > 0]


def test_items_leave_nothing_behind(camera_scene, recorded_sync, with_render_depsgraph) -> None:
    """Blender never frees what stands for the `object` of an instance in Python."""
    grid_with_cubes(30)
    recorded_sync()
    with watched_memory("instances.py") as left:
        recorded_sync()
    assert sum(line.count_diff for line in left) < 200
    with watched_memory("motion.py") as left:
        assert len(with_render_depsgraph(motion._identities)) >= 900
    assert sum(line.count_diff for line in left) < 200


def test_instances_are_known_whatever_comes_and_goes_beside_them():
    """Two geometries of one object, of which an instance of the second comes first later on."""

    def surface(mesh, geometry):
        return Surface(mesh, 0, 0, 63, False, False, 0.5, key=(7, 8, geometry))

    ids = np.array([11, 12, 13], np.int32)
    before = instance_keys([surface(4, 100), surface(5, 200)], np.array([0, 1, 0]), ids)
    after = instance_keys([surface(9, 201), surface(3, 101)], np.array([0, 1, 0, 1]), np.array([10, *ids], np.int32))
    assert list(before) == list(after[1:])
    assert len({0, *before}) == 4


def test_geometries_with_one_random_id_are_told_apart_and_their_twins_have_no_key():
    prototypes = [Surface(mesh, 0, 0, 63, False, False, 0.5, key=(7, 8, mesh)) for mesh in (0, 1)]
    ids = np.array([5, 5, 5], np.int32)
    assert len({0, *instance_keys(prototypes, np.array([0, 1]), ids[:2])}) == 3
    first, second, twin = instance_keys(prototypes, np.array([0, 1, 1]), ids)
    assert first != 0 and second == twin == 0
