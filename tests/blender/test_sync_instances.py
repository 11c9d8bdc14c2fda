"""Instances of every kind, the flags of objects and collections, and Cycles' random numbers."""

from collections.abc import Callable

import bpy
import fake_core
import numpy as np
import pytest
from cycles_pixel import cycles_pixel
from small_objects import link, triangle

from addon.sync import SyncReport, materials
from addon.sync.instances import RAY_BITS
from addon.sync.placements import name_random, random_fraction
from addon.sync.scene import sync_scene

ALL_RAYS = sum(RAY_BITS.values())


@pytest.fixture
def scene(empty_scene, monkeypatch) -> bpy.types.Scene:
    """A scene with a camera, and material programs that are empty but for their name."""

    def named(material, context) -> fake_core.MaterialProgram:
        return context.core.MaterialProgram(material.name if material else "default")

    monkeypatch.setattr(materials, "compile_material", named)
    monkeypatch.setattr(materials, "compile_world", named)
    monkeypatch.setattr(materials, "compile_light", lambda light, context: None)
    empty_scene.camera = link("Eye", bpy.data.cameras.new("Eye"))
    return empty_scene


@pytest.fixture
def sync(scene, with_render_depsgraph) -> Callable[[], tuple[fake_core.SceneBuilder, SyncReport]]:
    """Syncs the scene as a final render would, into a builder that records."""

    def run() -> tuple[fake_core.SceneBuilder, SyncReport]:
        builder = fake_core.SceneBuilder()
        return builder, with_render_depsgraph(lambda graph: sync_scene(graph, builder, core=fake_core.CORE))

    return run


def instances(builder: fake_core.SceneBuilder) -> dict[str, np.ndarray]:
    calls = builder.of("add_instances")
    assert len(calls) == 1
    return calls[0]


def places(builder: fake_core.SceneBuilder) -> list[tuple[float, ...]]:
    return sorted(tuple(np.round(matrix[:3, 3], 4).tolist()) for matrix in instances(builder)["object_to_world"])


def test_an_object_is_placed_by_its_row_major_matrix(scene, sync) -> None:
    obj = link("Thing", triangle(), location=(1, 2, 3))
    obj.rotation_euler, obj.scale = (0.1, 0.2, 0.3), (1, -2, 3)
    builder, _ = sync()
    assert instances(builder)["object_to_world"][0] == pytest.approx(np.array(obj.matrix_world), abs=1e-6)
    assert builder.of("add_object_name") == [{"name": "Thing"}]


@pytest.mark.parametrize(("axis", "scale"), [(0, (0, 2, 3)), (1, (2, 0, 3)), (2, (2, 3, 0)), (2, (2, -3, 0))])
def test_a_flat_mesh_keeps_an_invertible_matrix(scene, sync, axis, scale) -> None:
    mesh = bpy.data.meshes.new("Flat")
    corners = np.insert(np.array([(0, 0), (1, 0), (0, 1)], float), axis, 0.0, axis=1)
    mesh.from_pydata(corners.tolist(), [], [(0, 1, 2)])
    obj = link("Flat", mesh)
    obj.scale, obj.rotation_euler = scale, (0.1, 0.2, 0.3)
    matrix = instances(sync()[0])["object_to_world"][0].astype(float)
    assert abs(np.linalg.det(matrix[:3, :3])) == pytest.approx(6.0, rel=1e-5)
    assert matrix[:3, :3] @ corners.T == pytest.approx(np.array(obj.matrix_world)[:3, :3] @ corners.T, abs=1e-6)


def test_objects_share_the_mesh_they_share_in_blender(scene, sync) -> None:
    shared = triangle()
    link("A", shared)
    link("B", shared, location=(1, 0, 0))
    changed = link("C", shared, location=(2, 0, 0))
    changed.modifiers.new("Cut", "SUBSURF")
    builder, _ = sync()
    assert len(builder.of("add_mesh")) == 2
    assert len(set(instances(builder)["mesh"].tolist())) == 2 and len(instances(builder)["mesh"]) == 3


def test_instanced_collections_bring_objects_and_lamps(scene, sync) -> None:
    collection = bpy.data.collections.new("Set")
    link("Thing", triangle(), collection, (0, 0, 1))
    link("Lamp", bpy.data.lights.new("Lamp", "POINT"), collection, (0, 0, 2))
    for x in (3, 5):
        empty = link(f"Empty {x}", None, location=(x, 0, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
    builder, _ = sync()
    assert places(builder) == [(3, 0, 1), (5, 0, 1)]
    assert len(builder.of("add_mesh")) == 1
    assert [light["position"] for light in builder.of("add_point_light")] == [(3, 0, 2), (5, 0, 2)]


def test_instances_on_vertices_hide_their_source(scene, sync) -> None:
    parent = link("Parent", triangle())
    child = link("Child", triangle("Child"))
    child.parent, parent.instance_type, parent.show_instancer_for_render = parent, "VERTS", False
    builder, _ = sync()
    assert places(builder) == [(0, 0, 0), (0, 1, 0), (1, 0, 0)]


def test_particles(scene, sync) -> None:
    emitter = link("Emitter", triangle())
    emitter.show_instancer_for_render = False
    emitter.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.type, settings.count, settings.render_type = "HAIR", 7, "OBJECT"
    settings.use_advanced_hair, settings.instance_object = True, link("Leaf", triangle("Leaf"), location=(9, 9, 9))
    builder, _ = sync()
    assert len(instances(builder)["mesh"]) == 7 + 1
    assert len(builder.of("add_mesh")) == 1
    assert len(set(instances(builder)["random"].tolist())) == 8


def grid_with_cubes(size: int, material: bpy.types.Material | None = None) -> bpy.types.Object:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=size - 1, y_subdivisions=size - 1, size=size)
    tree = bpy.data.node_groups.new("Cubes", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    place, cube = tree.nodes.new("GeometryNodeInstanceOnPoints"), tree.nodes.new("GeometryNodeMeshCube")
    paint = tree.nodes.new("GeometryNodeSetMaterial")
    paint.inputs["Material"].default_value = material
    tree.links.new(start.outputs[0], place.inputs["Points"])
    tree.links.new(cube.outputs[0], paint.inputs["Geometry"])
    tree.links.new(paint.outputs[0], place.inputs["Instance"])
    tree.links.new(place.outputs[0], end.inputs[0])
    bpy.context.object.modifiers.new("Cubes", "NODES").node_group = tree
    return bpy.context.object


def test_geometry_nodes_instances_share_one_mesh_and_its_material(scene, sync) -> None:
    grid_with_cubes(4, bpy.data.materials.new("Paint"))
    builder, _ = sync()
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
def test_everything_with_a_surface_shows_once(scene, sync, add, surfaces) -> None:
    category, operator = add.split(".")
    for x in (0, 10):
        getattr(getattr(bpy.ops, category), operator)(location=(x, 0, 0))
        if bpy.context.object.type == "CURVE":
            bpy.context.object.data.bevel_depth = 0.1
    builder, report = sync()
    assert len(instances(builder)["mesh"]) == len(builder.of("add_mesh")) == surfaces
    assert report.warnings == []


@pytest.mark.parametrize("polygons", [[], [(0, 1, 2)]])
def test_meshes_without_polygons_and_bare_curves_show_nothing(scene, sync, polygons) -> None:
    bpy.ops.curve.primitive_bezier_curve_add()
    mesh = bpy.data.meshes.new("Shape")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 1)], [(0, 3)], polygons)
    link("Shape", mesh)
    builder, report = sync()
    assert len(builder.of("add_mesh")) == len(builder.of("add_instances")) == len(polygons)
    assert report.warnings == []


def test_meshes_that_nodes_make_of_curves(scene, sync) -> None:
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
    builder, _ = sync()
    cubes = [call for call in builder.of("add_mesh") if len(call["corner_vertices"]) == 24]
    assert len(cubes) == len(builder.of("add_mesh")) == 2
    assert places(builder) == [(0, 0, 0), (10, 0, 0)]


@pytest.mark.parametrize("flag", RAY_BITS)
def test_ray_visibility(scene, sync, flag) -> None:
    setattr(link("Thing", triangle()), f"visible_{flag}", False)
    builder, _ = sync()
    assert instances(builder)["visibility"].tolist() == [ALL_RAYS - RAY_BITS[flag]]


def test_an_object_hidden_from_every_ray_is_left_out(scene, sync) -> None:
    obj = link("Thing", triangle())
    for flag in RAY_BITS:
        setattr(obj, f"visible_{flag}", False)
    builder, _ = sync()
    assert builder.of("add_instances") == [] and builder.of("add_mesh") == []


def test_instances_inherit_what_their_instancer_hides(scene, sync) -> None:
    collection = bpy.data.collections.new("Set")
    link("Thing", triangle(), collection).visible_glossy = False
    empty = link("Empty", None)
    empty.instance_type, empty.instance_collection, empty.visible_shadow = "COLLECTION", collection, False
    builder, _ = sync()
    assert instances(builder)["visibility"].tolist() == [ALL_RAYS - RAY_BITS["glossy"] - RAY_BITS["shadow"]]


def test_holdout_of_objects_and_of_layer_collections(scene, sync) -> None:
    link("Plain", triangle())
    link("Held", triangle()).is_holdout = True
    collection = bpy.data.collections.new("Set")
    scene.collection.children.link(collection)
    link("Held by collection", triangle(), collection)
    bpy.context.view_layer.layer_collection.children["Set"].holdout = True
    builder, _ = sync()
    names = [call["name"] for call in builder.of("add_object_name")]
    values = instances(builder)
    held = {names[o]: bool(h) for o, h in zip(values["object"], values["holdout"], strict=True)}
    assert held == {"Plain": False, "Held": True, "Held by collection": True}


def test_indirect_only_collections_are_hidden_from_the_camera(scene, sync) -> None:
    collection = bpy.data.collections.new("Set")
    scene.collection.children.link(collection)
    link("Thing", triangle(), collection)
    bpy.context.view_layer.layer_collection.children["Set"].indirect_only = True
    builder, _ = sync()
    assert instances(builder)["visibility"].tolist() == [ALL_RAYS - RAY_BITS["camera"]]


def test_slots_linked_to_the_object_make_a_set_of_their_own(scene, sync) -> None:
    mesh = triangle()
    mesh.materials.append(bpy.data.materials.new("Of data"))
    link("A", mesh)
    b = link("B", mesh)
    b.material_slots[0].link = "OBJECT"
    b.material_slots[0].material = bpy.data.materials.new("Of object")
    link("C", mesh)
    builder, _ = sync()
    assert {c["program"].name for c in builder.of("add_material")} == {"Of data", "Of object"}
    assert len(builder.of("add_material_set")) == 2 and len(builder.of("add_mesh")) == 1
    sets = instances(builder)["material_set"].tolist()
    assert sorted(sets.count(s) for s in set(sets)) == [1, 2]


def test_empty_slots_get_the_default_and_the_override_wins(scene, sync) -> None:
    mesh = triangle()
    mesh.materials.append(None)
    link("A", mesh)
    builder, _ = sync()
    assert [c["program"].name for c in builder.of("add_material")] == ["default"]
    bpy.context.view_layer.material_override = bpy.data.materials.new("Override")
    builder, _ = sync()
    assert [c["program"].name for c in builder.of("add_material")] == ["Override"]


def test_lamps_keep_their_flags_and_portals_are_named(scene, sync) -> None:
    lamp = link("Lamp", bpy.data.lights.new("Lamp", "SPOT"))
    lamp.visible_glossy, lamp.visible_camera = False, False
    portal = link("Portal", bpy.data.lights.new("Portal", "AREA"))
    portal.data.cycles.is_portal = True
    flat = link("Flat", bpy.data.lights.new("Flat", "AREA"))
    flat.scale = (0, 1, 1)
    builder, report = sync()
    assert builder.of("add_spot_light")[0]["visibility"] == ALL_RAYS - RAY_BITS["glossy"] - RAY_BITS["camera"]
    assert builder.of("add_area_light") == []
    assert any("'Portal'" in w for w in report.warnings) and any("'Flat'" in w for w in report.warnings)


def test_world_override_visibility_and_sampling(scene, sync) -> None:
    scene.world = bpy.data.worlds.new("Day")
    scene.world.cycles_visibility.glossy = False
    scene.world.cycles.sampling_method, scene.world.cycles.sample_map_resolution = "MANUAL", 512
    builder, _ = sync()
    environment = builder.of("set_environment")[0]
    assert environment["visibility"] == ALL_RAYS - RAY_BITS["glossy"]
    assert (environment["importance_width"], environment["importance_sampling"]) == (512, True)
    if "world_override" in bpy.types.ViewLayer.bl_rna.properties:
        bpy.context.view_layer.world_override = bpy.data.worlds.new("Night")
        builder, _ = sync()
        assert [c["program"].name for c in builder.of("add_material")] == ["Night"]
    bpy.context.view_layer.use_sky = False
    assert sync()[0].of("set_environment") == [{"material": -1}]


def test_objects_without_surface_are_silent_and_unsupported_ones_named(scene, sync) -> None:
    link("Empty", None)
    link("Bones", bpy.data.armatures.new("Bones"))
    link("Fog", bpy.data.volumes.new("Fog"))
    builder, report = sync()
    assert builder.of("add_instances") == []
    assert [w for w in report.warnings if "Fog" in w] and len(report.warnings) == 1


def test_a_scene_can_be_synced_again(scene, sync) -> None:
    grid_with_cubes(3)
    first, second = sync()[0], sync()[0]
    assert [name for name, _ in first.calls] == [name for name, _ in second.calls]


def test_random_is_an_unsigned_fraction_below_one() -> None:
    ids = np.array((0, -(2**31), -1), np.int32)
    assert random_fraction(ids)[:2] == pytest.approx((0.0, 0.5))
    assert random_fraction(ids)[2] < 1.0


@pytest.mark.parametrize("name", ["Cube", "Ünïcode.001"])
def test_random_of_an_object_is_that_of_cycles(empty_scene, tmp_path, name) -> None:
    """One pixel of an emissive plane coloured by Object Info > Random."""
    bpy.ops.mesh.primitive_plane_add(size=4)
    bpy.context.object.name = name
    material = bpy.data.materials.new("Random")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    info, emission, output = (nodes.new(f"ShaderNode{kind}") for kind in ("ObjectInfo", "Emission", "OutputMaterial"))
    material.node_tree.links.new(info.outputs["Random"], emission.inputs["Color"])
    material.node_tree.links.new(emission.outputs[0], output.inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    camera = link("Eye", bpy.data.cameras.new("Eye"), location=(0, 0, 2))
    assert cycles_pixel(camera, tmp_path)[0] == pytest.approx(name_random(name), abs=1e-5)


@pytest.mark.parametrize("where", ["object", "instancer"])
def test_holdout_of_instances_is_that_of_cycles(scene, sync, tmp_path, where) -> None:
    """A plane in an instanced collection, held out itself or by the empty that brings it."""
    collection = bpy.data.collections.new("Set")
    bpy.ops.mesh.primitive_plane_add(size=4)
    plane = bpy.context.object
    scene.collection.objects.unlink(plane)
    collection.objects.link(plane)
    empty = link("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    (plane if where == "object" else empty).is_holdout = True
    builder, _ = sync()
    scene.camera.location, scene.render.film_transparent = (0, 0, 2), True
    is_held_out = cycles_pixel(scene.camera, tmp_path)[3] == 0.0
    assert instances(builder)["holdout"].tolist() == [is_held_out]


def test_what_is_ignored_is_said_once_for_each_object(scene, sync) -> None:
    linked, caught, hairy = (link(name, triangle(name)) for name in ("Linked", "Caught", "Hairy"))
    linked.light_linking.receiver_collection = bpy.data.collections.new("Receivers")
    caught.is_shadow_catcher = True
    hairy.modifiers.new("Hair", "PARTICLE_SYSTEM")
    hairy.particle_systems[0].settings.type = "HAIR"
    scene.render.use_motion_blur = True
    _, report = sync()
    for name in ("'Linked': light linking", "'Caught': shadow catchers", "'Hairy': hair", "motion blur"):
        assert len([w for w in report.warnings if name in w]) == 1
    assert len(report.warnings) == 4
