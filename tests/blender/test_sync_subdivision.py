"""Adaptive subdivision on its way to the core, in final renders and viewports."""

from collections.abc import Iterator

import bpy
import numpy as np
import pytest
from bpy.app.handlers import persistent

from addon.sync.changes import EVERYTHING, read_changes
from addon.sync.live import LiveSync
from addon.sync.meshes import mesh_arrays
from addon.sync.scene import sync_scene
from addon.sync.subdivision import Subdivision, subdivision_of
from tests.blender import fake_core
from tests.support import blender_scenes as build

SMOOTH = Subdivision("CATMULL_CLARK", "BOUNDARIES", False, True, 1.0, 0.0)


@pytest.fixture
def cube(empty_scene: bpy.types.Scene) -> bpy.types.Object:
    bpy.ops.mesh.primitive_cube_add()
    build.add_camera(empty_scene, (0.0, -6.0, 0.0), (1.57, 0.0, 0.0))
    return bpy.context.object


def subdivide(obj: bpy.types.Object, is_on: bool = True) -> bpy.types.SubsurfModifier:
    modifier = obj.modifiers.new("Subdivision", "SUBSURF")
    switch(obj, is_on)
    return modifier


def switch(obj: bpy.types.Object, is_on: bool) -> None:
    if bpy.app.version < (5, 0, 0):
        bpy.context.scene.cycles.feature_set = "EXPERIMENTAL"
    modifier = obj.modifiers["Subdivision"]
    owner = modifier if hasattr(modifier, "use_adaptive_subdivision") else obj.cycles
    owner.use_adaptive_subdivision = is_on


def found(obj: bpy.types.Object, is_render: bool = True) -> Subdivision | None:
    return subdivision_of(obj, bpy.context.scene, is_render)


def test_the_last_modifier_alone_counts(cube: bpy.types.Object) -> None:
    assert found(cube) is None
    modifier = subdivide(cube)
    assert found(cube) == SMOOTH
    modifier.show_render = False
    assert found(cube) is None and found(cube, is_render=False) == SMOOTH
    modifier.show_render, modifier.show_viewport = True, False
    assert found(cube) == SMOOTH and found(cube, is_render=False) is None
    switch(cube, False)
    assert found(cube) is None
    switch(cube, True)
    cube.modifiers.new("Bevel", "BEVEL")
    assert found(cube) is None


@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="a feature like others from Blender 5.0 on")
def test_before_5_0_it_is_experimental(cube: bpy.types.Object) -> None:
    subdivide(cube)
    bpy.context.scene.cycles.feature_set = "SUPPORTED"
    assert found(cube) is None


def test_settings_of_the_modifier(cube: bpy.types.Object) -> None:
    modifier = subdivide(cube)
    modifier.subdivision_type, modifier.uv_smooth = "SIMPLE", "SMOOTH_ALL"
    modifier.boundary_smooth, modifier.use_creases = "PRESERVE_CORNERS", False
    if bpy.app.version >= (5, 0, 0):
        modifier.adaptive_pixel_size = 3.0
        assert found(cube) == Subdivision("LINEAR", "ALL", True, False, 3.0, 0.0)
        modifier.adaptive_space, modifier.adaptive_object_edge_length = "OBJECT", 0.5
        assert found(cube).length == 0.5
    else:
        cube.cycles.dicing_rate = 3.0
        assert found(cube) == Subdivision("LINEAR", "ALL", True, False, 3.0, 0.0)


def test_creases(cube: bpy.types.Object) -> None:
    mesh = cube.data
    arguments = mesh_arrays(mesh, subdivision=SMOOTH).subdivision
    assert arguments["uv_maps"] == 1 and "creases" not in arguments
    creases = np.zeros(12, np.float32)
    creases[[3, 7]] = 0.5, 2.0
    mesh.attributes.new("crease_edge", "FLOAT", "EDGE").data.foreach_set("value", creases)
    mesh.attributes.new("crease_vert", "FLOAT", "POINT").data.foreach_set("value", np.arange(8, dtype=np.float32) == 5)
    arguments = mesh_arrays(mesh, subdivision=SMOOTH).subdivision
    assert [tuple(edge) for edge in arguments["creases"]] == [tuple(mesh.edges[i].vertices) for i in (3, 7)]
    assert arguments["crease_sharpness"].tolist() == [5.0, 10.0]
    assert (arguments["sharp_vertices"].tolist(), arguments["vertex_sharpness"].tolist()) == ([5], [10.0])
    without = Subdivision("CATMULL_CLARK", "BOUNDARIES", False, False, 1.0, 0.0)
    assert "creases" not in mesh_arrays(mesh, subdivision=without).subdivision


def test_byte_colours_of_corners_are_named(cube: bpy.types.Object) -> None:
    layers = cube.data.color_attributes
    for name, kind, domain in (
        ("a", "BYTE_COLOR", "CORNER"),
        ("b", "BYTE_COLOR", "POINT"),
        ("c", "FLOAT_COLOR", "CORNER"),
    ):
        layers.new(name, kind, domain)
    layers.render_color_index = layers.find("b")
    assert mesh_arrays(cube.data, subdivision=SMOOTH).subdivision["encoded_colors"] == ["a"]
    layers.render_color_index = layers.find("a")
    assert mesh_arrays(cube.data, subdivision=SMOOTH).subdivision["encoded_colors"] == ["a", "INFO:render color"]


class Live:
    def __init__(self) -> None:
        self.sync = LiveSync(fake_core)

    def meshes(self) -> list[dict]:
        return self.sync.builder.of("add_mesh")


@pytest.fixture
def live(cube: bpy.types.Object) -> Iterator[Live]:
    subdivide(cube)
    found = Live()
    found.sync.sync(bpy.context.evaluated_depsgraph_get(), EVERYTHING)

    @persistent
    def follow(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        found.sync.sync(depsgraph, read_changes(depsgraph))

    bpy.app.handlers.depsgraph_update_post.append(follow)
    yield found
    bpy.app.handlers.depsgraph_update_post.remove(follow)
    found.sync.close()


def test_viewports_know_what_is_to_be_subdivided(live: Live, cube: bpy.types.Object) -> None:
    assert live.meshes()[0]["subdivision"]["pixels"] == 1.0
    has_base = bpy.app.version >= (4, 5, 0)  # before, the levels of the modifier come first
    assert len(live.meshes()[0]["positions"]) == (8 if has_base else 26)
    cube.location.x = 1.0
    bpy.context.view_layer.update()
    assert len(live.meshes()) == 1
    cube.data.vertices[0].co.x = 2.0
    cube.data.update()
    bpy.context.view_layer.update()
    assert len(live.meshes()) == 2
    cube.modifiers.new("Bevel", "BEVEL").show_viewport = False
    bpy.context.view_layer.update()
    assert len(live.meshes()) == 3 and live.meshes()[-1]["subdivision"] is None


def test_a_mesh_that_is_shared_is_exported_both_ways(live: Live, cube: bpy.types.Object) -> None:
    """Levels of 0 leave the mesh itself."""
    cube.modifiers[0].levels = 0
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Plain", cube.data))
    bpy.context.view_layer.update()
    count = len(live.meshes())
    assert {mesh["subdivision"] is None for mesh in live.meshes()[-2:]} == {True, False}
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Empty", None))
    bpy.context.view_layer.update()
    assert len(live.meshes()) == count


def test_what_is_edited_is_subdivided_by_its_levels(cube: bpy.types.Object) -> None:
    subdivide(cube)
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        builder = fake_core.SceneBuilder()
        report = sync_scene(bpy.context.evaluated_depsgraph_get(), builder, core=fake_core)
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    [mesh] = builder.of("add_mesh")
    assert mesh["subdivision"] is None and len(mesh["positions"]) == 26
    assert any("'Cube'" in warning and "edited" in warning for warning in report.warnings)


def test_without_a_camera_levels_count(cube: bpy.types.Object) -> None:
    """As for bakes, whose sheets lie on the mesh as Blender has it."""
    subdivide(cube)
    builder = fake_core.SceneBuilder()
    sync_scene(bpy.context.evaluated_depsgraph_get(), builder, core=fake_core, needs_camera=False)
    [mesh] = builder.of("add_mesh")
    assert mesh["subdivision"] is None and len(mesh["positions"]) == 26
    assert not builder.of("set_dicing")
