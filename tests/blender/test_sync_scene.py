"""The sync of a whole scene: lamps, the world, and what is said of things that are left out."""

import bpy
import fake_core
import pytest
from small_objects import grid_with_cubes, link

from addon.sync import SyncReport, SyncStoppedError
from addon.sync.instances import RAY_BITS
from addon.sync.scene import sync_scene

ALL_RAYS = sum(RAY_BITS.values())


def test_lamps_keep_their_flags_and_flat_ones_are_named(camera_scene, recorded_sync) -> None:
    lamp = link("Lamp", bpy.data.lights.new("Lamp", "SPOT"))
    lamp.visible_glossy, lamp.visible_camera = False, False
    flat = link("Flat", bpy.data.lights.new("Flat", "AREA"))
    flat.scale = (0, 1, 1)
    builder, report = recorded_sync()
    assert builder.of("add_spot_light")[0]["visibility"] == ALL_RAYS - RAY_BITS["glossy"] - RAY_BITS["camera"]
    assert builder.of("add_area_light") == []
    assert any("'Flat'" in w for w in report.warnings)


def test_world_override_visibility_and_sampling(camera_scene, recorded_sync) -> None:
    camera_scene.world = bpy.data.worlds.new("Day")
    camera_scene.world.cycles_visibility.glossy = False
    camera_scene.world.cycles.sampling_method, camera_scene.world.cycles.sample_map_resolution = "MANUAL", 512
    builder, _ = recorded_sync()
    environment = builder.of("set_environment")[0]
    assert environment["visibility"] == ALL_RAYS - RAY_BITS["glossy"]
    assert (environment["importance_width"], environment["importance_sampling"]) == (512, True)
    if "world_override" in bpy.types.ViewLayer.bl_rna.properties:
        bpy.context.view_layer.world_override = bpy.data.worlds.new("Night")
        builder, _ = recorded_sync()
        assert [c["program"].name for c in builder.of("add_material")] == ["Night"]
    bpy.context.view_layer.use_sky = False
    assert recorded_sync()[0].of("set_environment") == [{"material": -1}]


def test_objects_without_surface_are_silent(camera_scene, recorded_sync) -> None:
    link("Empty", None)
    link("Bones", bpy.data.armatures.new("Bones"))
    link("Fog", bpy.data.volumes.new("Fog"))  # as yet without a file
    # Blender draws it itself, over the picture of any engine (tests/gui/final_renders.py).
    drawings = bpy.data.grease_pencils_v3 if hasattr(bpy.data, "grease_pencils_v3") else bpy.data.grease_pencils
    link("Drawing", drawings.new("Drawing"))
    builder, report = recorded_sync()
    assert builder.of("add_instances") == []
    assert report.warnings == []


def test_a_scene_can_be_synced_again(camera_scene, recorded_sync) -> None:
    grid_with_cubes(3)
    first, second = recorded_sync()[0], recorded_sync()[0]
    assert [name for name, _ in first.calls] == [name for name, _ in second.calls]


def mesh_objects(count: int) -> None:
    for number in range(count):
        mesh = bpy.data.meshes.new(f"Triangle {number}")
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        link(f"Triangle {number}", mesh)


def stopped_sync(with_render_depsgraph, looks: int) -> fake_core.SceneBuilder:
    """The builder of a sync that is stopped when it looks up for the `looks`-th time."""
    builder, asked = fake_core.SceneBuilder(), iter(range(looks))

    def sync(depsgraph: bpy.types.Depsgraph) -> None:
        with pytest.raises(SyncStoppedError):
            sync_scene(depsgraph, builder, core=fake_core.CORE, is_stopped=lambda: next(asked, None) is None)

    with_render_depsgraph(sync)
    return builder


def test_a_sync_can_be_stopped_between_meshes(camera_scene, with_render_depsgraph) -> None:
    mesh_objects(50)
    exported = [len(stopped_sync(with_render_depsgraph, looks).of("add_mesh")) for looks in (10, 20, 40)]
    assert 0 < exported[0] < exported[1] < exported[2] < 50


def test_a_sync_looks_up_now_and_then_among_instances(camera_scene, with_render_depsgraph, monkeypatch) -> None:
    monkeypatch.setattr("addon.sync.instances._ITEMS_BETWEEN_LOOKS", 10)
    grid_with_cubes(10)  # a hundred instances of one mesh
    assert stopped_sync(with_render_depsgraph, 8).of("add_instances") == []


class CountedText(str):
    comparisons = 0

    def __eq__(self, other: object) -> bool:
        CountedText.comparisons += 1
        return str.__eq__(self, other)

    __hash__ = str.__hash__


def test_warnings_are_not_compared_with_all_others() -> None:
    report = SyncReport()
    texts = [CountedText(f"Material {number}: grey") for number in range(1000)]
    for text in [*texts, *texts]:
        report.warn(text)
    assert report.warnings == texts
    assert CountedText.comparisons < 10_000
