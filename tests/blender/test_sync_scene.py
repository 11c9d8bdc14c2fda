"""The sync of a whole scene: lamps, the world, and what is said of things that are left out."""

import bpy
from small_objects import grid_with_cubes, link

from addon.sync.instances import RAY_BITS

ALL_RAYS = sum(RAY_BITS.values())


def test_lamps_keep_their_flags_and_portals_are_named(camera_scene, recorded_sync) -> None:
    lamp = link("Lamp", bpy.data.lights.new("Lamp", "SPOT"))
    lamp.visible_glossy, lamp.visible_camera = False, False
    portal = link("Portal", bpy.data.lights.new("Portal", "AREA"))
    portal.data.cycles.is_portal = True
    flat = link("Flat", bpy.data.lights.new("Flat", "AREA"))
    flat.scale = (0, 1, 1)
    builder, report = recorded_sync()
    assert builder.of("add_spot_light")[0]["visibility"] == ALL_RAYS - RAY_BITS["glossy"] - RAY_BITS["camera"]
    assert builder.of("add_area_light") == []
    assert any("'Portal'" in w for w in report.warnings) and any("'Flat'" in w for w in report.warnings)


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


def test_objects_without_surface_are_silent_and_unsupported_ones_named(camera_scene, recorded_sync) -> None:
    link("Empty", None)
    link("Bones", bpy.data.armatures.new("Bones"))
    link("Fog", bpy.data.volumes.new("Fog"))  # as yet without a file
    drawings = bpy.data.grease_pencils_v3 if hasattr(bpy.data, "grease_pencils_v3") else bpy.data.grease_pencils
    link("Drawing", drawings.new("Drawing"))
    builder, report = recorded_sync()
    assert builder.of("add_instances") == []
    assert [w for w in report.warnings if "Drawing" in w] and len(report.warnings) == 1


def test_a_scene_can_be_synced_again(camera_scene, recorded_sync) -> None:
    grid_with_cubes(3)
    first, second = recorded_sync()[0], recorded_sync()[0]
    assert [name for name, _ in first.calls] == [name for name, _ in second.calls]
