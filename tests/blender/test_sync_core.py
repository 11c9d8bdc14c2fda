"""The sync into the real builder: what the core accepts, and how its errors come back."""

import math

import bpy
import pytest

from addon.sync.scene import SceneSync

core = pytest.importorskip("cistern_core")


@pytest.fixture
def scene(empty_scene) -> bpy.types.Scene:
    bpy.ops.object.camera_add(location=(0, 0, 9))
    empty_scene.camera = bpy.context.object
    return empty_scene


@pytest.fixture
def sync(with_render_depsgraph):
    exporter = SceneSync()

    def run() -> tuple[SceneSync, list[str]]:
        return exporter, with_render_depsgraph(exporter.sync).warnings

    yield run
    exporter.close()


def test_a_scene_of_everything(scene, sync) -> None:
    scene.world = bpy.data.worlds.new("Day")
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.mesh.primitive_circle_add(vertices=7, fill_type="NGON")
    bpy.ops.object.text_add()
    for kind in ("POINT", "SPOT", "SUN", "AREA"):
        bpy.ops.object.light_add(type=kind)
    exporter, warnings = sync()
    snapshot = exporter.builder.snapshot()
    assert snapshot.instance_count == 3 and warnings == []
    assert snapshot.triangle_count > 12 + 5


def test_an_empty_scene(scene, sync) -> None:
    exporter, warnings = sync()
    assert exporter.builder.snapshot().instance_count == 0 and warnings == []


def test_a_line_is_left_out_and_flat_and_mirrored_objects_kept(scene, sync) -> None:
    for scale in ((1, 0, 0), (1, 1, 0), (-1, 1, 1)):
        bpy.ops.mesh.primitive_cube_add()
        bpy.context.object.scale = scale
    exporter, warnings = sync()
    assert exporter.builder.singular_instances == 1
    assert "scaled to a line" in warnings[0]


def test_a_plane_scaled_to_zero_across_itself_stays(scene, sync) -> None:
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.scale = (2, -3, 0)
    exporter, warnings = sync()
    assert exporter.builder.singular_instances == 0 and warnings == []


@pytest.mark.parametrize("energy", [math.nan, math.inf])
def test_a_lamp_whose_energy_is_no_number_is_named(scene, sync, energy) -> None:
    bpy.ops.object.light_add(type="POINT")
    bpy.context.object.name, bpy.context.object.data.energy = "Broken", energy
    with pytest.raises(core.Error, match="Broken"):
        sync()


def test_coordinates_that_are_no_numbers_are_dropped(scene, sync) -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.vertices[0].co.x = math.nan
    exporter, [warning] = sync()
    assert 0 < exporter.builder.mesh_statistics(0)["triangles"] < 12
    assert "'Cube'" in warning


def test_faces_without_area_are_dropped_in_silence(scene, sync) -> None:
    bpy.ops.mesh.primitive_cube_add()
    vertices = bpy.context.object.data.vertices
    vertices[1].co = vertices[0].co
    exporter, warnings = sync()
    assert exporter.builder.mesh_statistics(0)["dropped_triangles"] > 0 and warnings == []


def test_frame_after_frame_gives_the_same_scene(scene, sync) -> None:
    bpy.ops.mesh.primitive_cube_add()
    counts = {sync()[0].builder.snapshot().triangle_count for _ in range(3)}
    assert counts == {12}


def test_esc_stops_subdivision(scene, sync) -> None:
    bpy.ops.mesh.primitive_plane_add()
    modifier = bpy.context.object.modifiers.new("Subdivision", "SUBSURF")
    if hasattr(modifier, "use_adaptive_subdivision"):
        modifier.use_adaptive_subdivision = True
    else:
        scene.cycles.feature_set, bpy.context.object.cycles.use_adaptive_subdivision = "EXPERIMENTAL", True
    scene.cycles.dicing_rate = 0.1  # the picture has 4 x 4 pixels
    exporter, _ = sync()
    assert exporter.builder.snapshot(is_stopped=lambda: True) is None
    assert exporter.builder.snapshot(is_stopped=lambda: False).triangle_count > 100
