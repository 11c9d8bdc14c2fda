"""Cameras, lamps and sizes that no scene should have, through Blender to the picture: a message that names the
data-block, or correct output; never a crash, never a black frame without a word. Needs `cistern_core`.
"""

import math

import bpy
import numpy as np
import pytest

import addon
from addon import passes, settings, techniques
from tests.blender.bad_input import (
    HEIGHT,
    WIDTH,
    Change,
    camera,
    cube,
    lens,
    light,
    object_,
    picture_of,
    set_members,
    surface,
    tree,
)
from tests.blender.engine_fakes import fresh_scene, store_choice

pytestmark = pytest.mark.usefixtures("registered_addon", "built_core")


FAILURES = {
    "matrix nan": (object_(location=(math.nan, 0, 0)), "Cube"),
    "scale nan": (object_(scale=(math.nan, 1, 1)), "Cube"),
    "rotation nan": (object_(rotation_euler=(math.nan, 0, 0)), "Cube"),
    "camera matrix nan": (set_members(lambda s: s.camera, location=(math.nan, 0, 0)), "Camera"),
    "camera scale 0": (set_members(lambda s: s.camera, scale=(0, 0, 0)), "Camera"),
    "clip": (camera(clip_start=100.0, clip_end=1.0), "Camera: clip end"),
    "clip nan": (camera(clip_start=math.nan), "Camera: clip start"),
    "focal length nan": (camera(lens=math.nan), "Camera"),
    "sensor nan": (camera(sensor_width=math.nan), "Camera"),
    "shift nan": (camera(shift_x=math.nan), "Camera"),
    "shift far": (camera(shift_x=1e10), "Camera"),
    "fisheye without lens": (
        camera(type="PANO", panorama_type="FISHEYE_EQUISOLID", fisheye_lens=math.nan),
        "Camera: lens of the fisheye",
    ),
    "panorama nan": (camera(type="PANO", longitude_min=math.nan), "Camera: start of a range of the panorama"),
    "ortho scale 0": (camera(type="ORTHO", ortho_scale=0.0), "Camera"),
    "focus nan": (lens(focus_distance=math.nan), "Camera: focus distance"),
    "aperture nan": (lens(aperture_fstop=math.nan), "Camera: aperture radius"),
    "blades nan": (lens(aperture_rotation=math.nan), "Camera: blade rotation"),
    "ratio nan": (lens(aperture_ratio=math.nan), "Camera: aperture ratio"),
    "point nan": (light(energy=math.nan), "Light: energy"),
    "point inf": (light(energy=math.inf), "Light: energy"),
    "sun nan": (light("SUN", energy=math.nan), "Light: energy"),
    "spot nan": (light("SPOT", energy=math.nan), "Light: energy"),
    "area nan": (light("AREA", energy=math.nan), "Light: energy"),
    "area size nan": (light("AREA", size=math.nan), "Light"),
    "radius nan": (light(shadow_soft_size=math.nan), "Light: radius"),
    "color nan": (light(color=(math.nan, 1, 1)), "Light: energy"),
    "sun angle nan": (light("SUN", angle=math.nan), "Light: angle"),
    "light nowhere": (set_members(lambda s: bpy.data.objects["Light"], location=(math.nan, 0, 0)), "Light: position"),
}


@pytest.mark.parametrize("name", FAILURES)
def test_what_cannot_be_rendered_is_named(name, tmp_path) -> None:
    change, message = FAILURES[name]
    scene = fresh_scene(WIDTH, HEIGHT)
    change(scene)
    scene.render.filepath = str(tmp_path / "failed.exr")
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.render.render(write_still=True)
    assert message in addon.report.last_report().error


def test_an_index_out_of_range_is_named(tmp_path) -> None:
    fresh_scene(WIDTH, HEIGHT)
    cube().data.attributes[".corner_vert"].data[0].value = 1000
    with pytest.raises(RuntimeError, match="Cube: vertex of corner 0 is 1000"):
        bpy.ops.render.render()


def test_no_camera_is_refused_by_blender(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    scene.camera = None
    with pytest.raises(RuntimeError, match="camera"):
        bpy.ops.render.render()


def flat_lamp(kind: str) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        light(kind)(scene)
        bpy.data.objects["Light"].scale = (0, 0, 0)

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(light("AREA", size=0.0), "Light", id="area without size"),
        pytest.param(flat_lamp("AREA"), "Light", id="area scaled to 0"),
        pytest.param(flat_lamp("SPOT"), "Light", id="spot scaled to 0"),
        pytest.param(light(energy=3e38), "not finite", id="energy beyond range"),
        pytest.param(
            lambda scene: setattr(surface().inputs["Emission Strength"], "default_value", math.inf),
            "not finite",
            id="emission beyond range",
        ),
    ],
)
def test_odd_things_are_rendered_with_a_warning(change: Change, message: str, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    change(scene)
    pixels, report = picture_of(scene, tmp_path)
    assert any(message in warning for warning in report.warnings), report.warnings
    assert pixels.max() > 0.0


def material_index_of_no_slot(scene: bpy.types.Scene) -> None:
    for polygon in cube().data.polygons:
        polygon.material_index = 500


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(flat_lamp("POINT"), id="point scaled to 0"),
        pytest.param(flat_lamp("SUN"), id="sun scaled to 0"),
        pytest.param(light("SPOT", spot_size=0.0), id="spot of no cone"),
        pytest.param(light(shadow_soft_size=1e-20), id="radius whose square is no number"),
        pytest.param(light(energy=-10.0), id="negative light"),
        pytest.param(camera(lens=0.0), id="lens clamped by Blender"),
        pytest.param(camera(clip_end=math.inf), id="endless clip"),
        pytest.param(lens(focus_distance=0.0), id="focus at the lens"),
        pytest.param(lens(aperture_fstop=0.0), id="f-stop 0"),
        pytest.param(lambda scene: cube().data.materials.clear(), id="no slots"),
        pytest.param(lambda scene: cube().data.materials.__setitem__(0, None), id="empty slot"),
        pytest.param(material_index_of_no_slot, id="index of no slot"),
        pytest.param(lambda scene: tree().nodes.clear(), id="no output node"),
        pytest.param(lambda scene: setattr(surface().inputs["IOR"], "default_value", 0.0), id="index of refraction 0"),
        pytest.param(lambda scene: setattr(surface().inputs["Roughness"], "default_value", math.nan), id="nan input"),
    ],
)
def test_odd_things_are_rendered(change: Change, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    change(scene)
    pixels, report = picture_of(scene, tmp_path)
    assert report.warnings == [] and pixels.max() > 0.0


def remove_light(scene: bpy.types.Scene) -> None:
    bpy.data.objects.remove(bpy.data.objects["Light"])
    scene.world = None


def hide_light(scene: bpy.types.Scene) -> None:
    bpy.data.objects["Light"].hide_render = True
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 0.0


@pytest.mark.parametrize("change", [remove_light, hide_light])
def test_no_light_is_black_and_said(change: Change, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    change(scene)
    pixels, report = picture_of(scene, tmp_path)
    assert pixels.max() == 0.0
    assert any("Scene 'Scene'" in warning and "black" in warning for warning in report.warnings)


@pytest.mark.parametrize(("width", "height"), [(1, 1), (8192, 1), (1, 4096)])
def test_extreme_sizes(width, height, tmp_path) -> None:
    """Blender itself makes no side smaller than 4 pixels, save by its percentage or border: see test_engine_core."""
    scene = fresh_scene(width, height, samples=1)
    pixels, _ = picture_of(scene, tmp_path)
    assert pixels.shape[:2] == (max(height, 4), max(width, 4))
    assert pixels.max() > 0.0


@pytest.mark.parametrize("is_cropped", [True, False])
def test_a_border_of_one_pixel(is_cropped, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    border = scene.render
    border.use_border, border.use_crop_to_border = True, is_cropped
    border.border_min_x, border.border_max_x = 0.5, 0.5 + 1.01 / WIDTH
    border.border_min_y, border.border_max_y = 0.5, 0.5 + 1.01 / HEIGHT
    pixels, _ = picture_of(scene, tmp_path)
    assert pixels.shape[:2] == ((1, 1) if is_cropped else (HEIGHT, WIDTH))
    assert np.count_nonzero(pixels.max(axis=2)) == 1


def test_a_border_of_nothing_is_refused_by_blender(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    scene.render.use_border = True
    scene.render.border_min_x = scene.render.border_max_x = 0.5
    with pytest.raises(RuntimeError, match="small"):
        bpy.ops.render.render()


def test_zero_samples_are_one(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    scene.cistern.samples = 0
    _, report = picture_of(scene, tmp_path)
    assert report.samples == 1


def numbers(group: bpy.types.PropertyGroup) -> list[bpy.types.Property]:
    return [prop for prop in group.bl_rna.properties if prop.type in {"INT", "FLOAT"}]


@pytest.mark.parametrize("preset", [item[0] for item in techniques.PRESET_ITEMS])
def test_the_core_takes_both_ends_of_every_range(preset, built_core) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    scene.cistern.preset = preset
    scene.view_layers[0].cistern.use_pass_cells = True
    depsgraph = bpy.context.evaluated_depsgraph_get()
    region = settings.Region(0, 0, WIDTH, HEIGHT)
    layer_passes = passes.enabled_passes(depsgraph.view_layer_eval)
    for prop in numbers(scene.cistern):
        for end in (prop.hard_min, prop.hard_max):
            setattr(scene.cistern, prop.identifier, end)
            depsgraph.update()
            arguments = settings.core_settings(
                built_core, depsgraph, (WIDTH, HEIGHT), region, layer_passes, is_preview=False
            )
            built_core.Settings(**arguments)
            arguments = settings.viewport_settings(built_core, scene)
            limits = settings.viewport_limits(scene)
            built_core.Settings(**arguments | limits | {"width": WIDTH, "height": HEIGHT})
        scene.cistern.property_unset(prop.identifier)


@pytest.mark.parametrize("name", ["preset", "direct", "pixel_filter", "viewport_preset"])
def test_choices_of_a_later_version_are_named(name) -> None:
    """Blender reads a number that no item has as no choice at all."""
    scene = fresh_scene(WIDTH, HEIGHT)
    store_choice(scene, name, 77)
    message = f"Scene 'Scene': what was chosen for .* \\({name}\\) is unknown"
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.render.render()
    with pytest.raises(settings.SettingsError, match=message):
        settings.viewport_settings(None, scene)
