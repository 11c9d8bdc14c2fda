"""Camera windows against Blender's own projection matrix, and the lens."""

import itertools
import math

import bpy
import numpy as np
import pytest

from addon.sync import SyncError, SyncReport
from addon.sync.camera import camera_arguments, camera_window, focus_distance, sensor_size


@pytest.fixture
def camera(empty_scene) -> bpy.types.Object:
    obj = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    empty_scene.collection.objects.link(obj)
    empty_scene.camera = obj
    return obj


def evaluated(obj: bpy.types.Object) -> bpy.types.Object:
    return obj.evaluated_get(bpy.context.evaluated_depsgraph_get())


def window_of_matrix(projection: np.ndarray, is_orthographic: bool) -> tuple[float, ...]:
    """Where the four sides of the picture lie, read from a projection matrix."""
    shift = projection[:2, 3] if is_orthographic else -projection[:2, 2]
    low, high = (-1.0 - shift) / projection.diagonal()[:2], (1.0 - shift) / projection.diagonal()[:2]
    return low[0], high[0], low[1], high[1]


@pytest.mark.parametrize(
    ("kind", "fit", "resolution", "aspect"),
    list(
        itertools.product(
            ("PERSP", "ORTHO"), ("AUTO", "HORIZONTAL", "VERTICAL"), ((640, 360), (300, 500)), ((1.0, 1.0), (1.0, 2.5))
        )
    ),
)
def test_window_is_that_of_blenders_projection(camera, kind, fit, resolution, aspect) -> None:
    data, render = camera.data, bpy.context.scene.render
    data.type, data.sensor_fit = kind, fit
    data.lens, data.ortho_scale, data.sensor_width, data.sensor_height = 41.0, 7.0, 30.0, 21.0
    data.shift_x, data.shift_y = 0.13, -0.21
    render.resolution_x, render.resolution_y = resolution
    render.pixel_aspect_x, render.pixel_aspect_y = aspect
    depsgraph = bpy.context.evaluated_depsgraph_get()
    depsgraph.update()
    projection = camera.evaluated_get(depsgraph).calc_matrix_camera(
        depsgraph, x=resolution[0], y=resolution[1], scale_x=aspect[0], scale_y=aspect[1]
    )
    expected = window_of_matrix(np.array(projection), kind == "ORTHO")
    assert camera_window(camera.evaluated_get(depsgraph).data, render) == pytest.approx(expected, abs=2e-6)


def test_resolution_percentage_counts_whole_pixels(camera) -> None:
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 101, 51, 50
    left, right, bottom, top = camera_window(camera.data, render)
    assert (right - left) / (top - bottom) == pytest.approx(50 / 25)


def test_scale_of_the_camera_object_is_ignored(camera) -> None:
    camera.location, camera.scale, camera.rotation_euler = (1, 2, 3), (2, 3, -4), (0.4, 0.2, 0.1)
    matrix = camera_arguments(bpy.context.scene, evaluated(camera), SyncReport())["camera_to_world"]
    assert np.linalg.norm(matrix[:3, :3], axis=0) == pytest.approx(1.0)
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(-1.0)  # a mirrored camera stays mirrored
    assert matrix[:3, 3] == pytest.approx((1, 2, 3))


@pytest.mark.parametrize(("kind", "radius"), [("PERSP", 0.08 / (2 * 1.4)), ("ORTHO", 1 / (2 * 1.4))])
def test_lens(camera, kind, radius) -> None:
    camera.data.type, camera.data.lens = kind, 80.0
    dof = camera.data.dof
    dof.use_dof, dof.aperture_fstop, dof.focus_distance = True, 1.4, 3.5
    dof.aperture_blades, dof.aperture_rotation, dof.aperture_ratio = 5, 0.3, 2.0
    arguments = camera_arguments(bpy.context.scene, evaluated(camera), SyncReport())
    assert arguments["aperture_radius"] == pytest.approx(radius)
    assert arguments["focus_distance"] == pytest.approx(3.5)
    assert (arguments["blades"], arguments["blade_rotation"], arguments["aperture_ratio"]) == pytest.approx((5, 0.3, 2))


def test_without_depth_of_field_the_camera_is_a_pinhole(camera) -> None:
    assert "aperture_radius" not in camera_arguments(bpy.context.scene, evaluated(camera), SyncReport())


def test_focus_object_counts_along_the_view_axis(camera) -> None:
    target = bpy.data.objects.new("Target", None)
    bpy.context.scene.collection.objects.link(target)
    target.location, camera.rotation_euler, camera.scale = (5, 4, 3), (0, math.pi / 2, 0), (2, 2, 2)
    camera.data.dof.focus_object = target
    assert focus_distance(evaluated(camera)) == pytest.approx(5.0, abs=1e-5)  # the camera looks along -X


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="this Blender does not have them")
def test_camera_of_a_script_falls_back_with_a_warning(camera) -> None:
    camera.data.type = "CUSTOM"
    report = SyncReport()
    assert camera_arguments(bpy.context.scene, evaluated(camera), report)["type"] == "PERSPECTIVE"
    assert "'Eye'" in report.warnings[0] and "CUSTOM" in report.warnings[0]


@pytest.mark.parametrize(("kind", "multiview", "said"), [("PERSP", True, 1), ("PANO", True, 1), ("PANO", False, 0)])
def test_spherical_stereo_is_named_where_it_would_be_rendered(camera, kind, multiview, said) -> None:
    bpy.context.scene.render.use_multiview = multiview
    camera.data.type, camera.data.stereo.use_spherical_stereo = kind, True
    report = SyncReport()
    camera_arguments(bpy.context.scene, evaluated(camera), report)
    assert len([w for w in report.warnings if "'Eye': spherical stereo" in w]) == said


@pytest.mark.parametrize(
    ("fit", "resolution", "sensor"),
    [
        ("AUTO", (200, 100), (30.0, 15.0)),
        ("AUTO", (100, 200), (15.0, 30.0)),
        ("HORIZONTAL", (100, 200), (30.0, 60.0)),
        ("VERTICAL", (200, 100), (40.0, 20.0)),
    ],
)
def test_sensor_of_a_fisheye_is_fitted_as_that_of_other_cameras(camera, fit, resolution, sensor) -> None:
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = *resolution, 100
    camera.data.sensor_fit, camera.data.sensor_width, camera.data.sensor_height = fit, 30.0, 20.0
    assert sensor_size(camera.data, render) == pytest.approx(sensor)


def test_no_camera_is_an_error_that_names_the_scene(empty_scene) -> None:
    with pytest.raises(SyncError, match=f"Scene '{empty_scene.name}' has no camera"):
        camera_arguments(empty_scene, None, SyncReport())
