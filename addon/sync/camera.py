"""The scene camera to the window, lens and matrix of the core."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from . import SyncError, SyncReport

# (left, right, bottom, top)
Window = tuple[float, float, float, float]

# f-stops below this would open the lens without bound; Blender's own slider ends at 0.1.
_SMALLEST_FSTOP = 1e-5
_SPOT_SIZE = math.radians(45.0)
CAMERA_TYPES = {"PERSP": "PERSPECTIVE", "ORTHO": "ORTHOGRAPHIC", "PANO": "PANORAMIC"}
PANORAMA_TYPES = {
    "EQUIRECTANGULAR": "EQUIRECTANGULAR",
    "EQUIANGULAR_CUBEMAP_FACE": "CUBEMAP_FACE",
    "MIRRORBALL": "MIRROR_BALL",
    "FISHEYE_EQUIDISTANT": "FISHEYE_EQUIDISTANT",
    "FISHEYE_EQUISOLID": "FISHEYE_EQUISOLID",
    "FISHEYE_LENS_POLYNOMIAL": "FISHEYE_POLYNOMIAL",
    "CENTRAL_CYLINDRICAL": "CENTRAL_CYLINDRICAL",
}

# Nothing can be in focus at the lens itself; Cycles' limit, in metres.
_SMALLEST_FOCUS_DISTANCE = 1e-5


@dataclass(frozen=True)
class LookThrough:
    """In place of a camera's data, for an object of another type that is the scene's camera; as in Cycles."""

    lens: float = 50.0
    type: str = "PERSP"
    sensor_width: float = 36.0
    sensor_height: float = 24.0
    sensor_fit: str = "AUTO"
    shift_x: float = 0.0
    shift_y: float = 0.0
    clip_start: float = 1e-5
    clip_end: float = 1e5
    dof: None = None
    stereo: None = None


def camera_data(camera_object: bpy.types.Object) -> bpy.types.Camera | LookThrough:
    """What the object sees with. Lamps see their cone, or that of a new spot."""
    if camera_object.type == "CAMERA":
        return camera_object.data
    if camera_object.type != "LIGHT":
        return LookThrough()
    angle = getattr(camera_object.data, "spot_size", _SPOT_SIZE)
    return LookThrough(lens=16.0 / math.tan(0.5 * angle)) if angle < math.pi else LookThrough()


def camera_arguments(
    scene: bpy.types.Scene,
    camera_object: bpy.types.Object | None,
    report: SyncReport,
    render: bpy.types.RenderSettings | None = None,
) -> dict[str, Any]:
    """Keyword arguments of `SceneBuilder.set_camera` for an evaluated camera object, which may be of any type. Raises
    SyncError without one.

    `render`: has the shape of the picture where that is not the scene's, as where the compositor of another scene asks
    for it."""
    render = scene.render if render is None else render
    if camera_object is None:
        raise SyncError(f"Scene '{scene.name}' has no camera")
    camera = camera_data(camera_object)
    if camera.type not in CAMERA_TYPES:
        report.warn(f"Camera '{camera_object.name}': type {camera.type} is not supported, rendered as perspective")
    is_flat = camera.type == "ORTHO" or camera.stereo is None
    if scene.render.use_multiview and not is_flat and camera.stereo.use_spherical_stereo:
        report.warn(f"Camera '{camera_object.name}': spherical stereo is not supported, the eyes look side by side")
    is_panorama = camera.type == "PANO"
    window = panorama_window(camera) if is_panorama else camera_window(camera, render)
    return {
        "name": camera_object.name,
        "type": CAMERA_TYPES.get(camera.type, "PERSPECTIVE"),
        "camera_to_world": rigid_matrix(camera_object.matrix_world),
        **window_arguments(window),
        "clip_start": camera.clip_start,
        "clip_end": camera.clip_end,
        **lens_arguments(camera_object),
        **({"panorama": panorama_arguments(camera, render)} if is_panorama else {}),
    }


def window_arguments(window: Window) -> dict[str, float]:
    return dict(zip(("left", "right", "bottom", "top"), window, strict=True))


def panorama_window(camera: bpy.types.Camera) -> Window:
    """Of the full frame: a shift is in widths and heights of the picture, whatever the fit of the sensor."""
    return camera.shift_x, camera.shift_x + 1.0, camera.shift_y, camera.shift_y + 1.0


def panorama_arguments(camera: bpy.types.Camera, render: bpy.types.RenderSettings) -> dict[str, Any]:
    """What a panoramic camera sees where; see native/scene/camera.h."""
    cylinder = {}
    if camera.panorama_type == "CENTRAL_CYLINDRICAL":
        radius = camera.central_cylindrical_radius
        cylinder = {
            "cylinder": (
                camera.central_cylindrical_range_v_min / radius,
                camera.central_cylindrical_range_v_max / radius,
            ),
            "longitude": (camera.central_cylindrical_range_u_min, camera.central_cylindrical_range_u_max),
        }
    return {
        "type": PANORAMA_TYPES[camera.panorama_type],
        "longitude": (camera.longitude_min, camera.longitude_max),
        "latitude": (camera.latitude_min, camera.latitude_max),
        "fov": camera.fisheye_fov,
        "lens": camera.fisheye_lens,
        "sensor": sensor_size(camera, render),
        "polynomial": tuple(getattr(camera, f"fisheye_polynomial_k{power}") for power in range(5)),
        **cylinder,
    }


def sensor_size(camera: bpy.types.Camera, render: bpy.types.RenderSettings) -> tuple[float, float]:
    """Of the full frame, in millimetres."""
    width = _pixels(render.resolution_x, render) * render.pixel_aspect_x
    height = _pixels(render.resolution_y, render) * render.pixel_aspect_y
    vertical = camera.sensor_fit == "VERTICAL" or (camera.sensor_fit == "AUTO" and width < height)
    side = camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
    per_pixel = side / (height if vertical else width)
    return width * per_pixel, height * per_pixel


def camera_window(camera: bpy.types.Camera | LookThrough, render: bpy.types.RenderSettings) -> Window:
    """Of the full frame: at unit distance, or in metres for an orthographic camera. Of a panorama, which has none, that
    of the perspective camera whose frame Blender draws."""
    width = _pixels(render.resolution_x, render) * render.pixel_aspect_x
    height = _pixels(render.resolution_y, render) * render.pixel_aspect_y
    vertical = camera.sensor_fit == "VERTICAL" or (camera.sensor_fit == "AUTO" and width < height)
    fitted_side = height if vertical else width
    if camera.type == "ORTHO":
        scale = camera.ortho_scale
    else:
        scale = (camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width) / camera.lens
    half_width, half_height = 0.5 * scale * width / fitted_side, 0.5 * scale * height / fitted_side
    center_x, center_y = camera.shift_x * scale, camera.shift_y * scale
    return center_x - half_width, center_x + half_width, center_y - half_height, center_y + half_height


def rigid_matrix(matrix: Matrix) -> NDArray[np.float32]:
    """The matrix with unit columns: scaling a camera object does not scale its picture."""
    rigid = np.array(matrix, np.float64)
    lengths = np.linalg.norm(rigid[:3, :3], axis=0)
    rigid[:3, :3] /= np.where(lengths > 0.0, lengths, 1.0)
    return np.ascontiguousarray(rigid, np.float32)


def lens_arguments(camera_object: bpy.types.Object) -> dict[str, Any]:
    """Aperture and focus; a pinhole when depth of field is off."""
    camera = camera_data(camera_object)
    dof = camera.dof
    if dof is None or not dof.use_dof:
        return {}
    focal_length = 1.0 if camera.type == "ORTHO" else camera.lens * 1e-3
    return {
        "aperture_radius": focal_length / (2.0 * max(dof.aperture_fstop, _SMALLEST_FSTOP)),
        "focus_distance": np.maximum(focus_distance(camera_object), _SMALLEST_FOCUS_DISTANCE),  # keeps nan: an error
        "blades": dof.aperture_blades,
        "blade_rotation": dof.aperture_rotation,
        "aperture_ratio": dof.aperture_ratio,
    }


def focus_distance(camera_object: bpy.types.Object) -> float:
    """Distance of the plane in focus along the view axis, in metres."""
    dof = camera_object.data.dof
    if dof.focus_object is None:
        return dof.focus_distance
    target = dof.focus_object.matrix_world
    if dof.focus_object.pose is not None and dof.focus_subtarget:
        bone = dof.focus_object.pose.bones.get(dof.focus_subtarget)
        target = target @ bone.matrix if bone is not None else target
    to_camera = camera_object.matrix_world.translation - target.translation
    return math.fabs(to_camera.dot(camera_object.matrix_world.col[2].to_3d().normalized()))


def picture_size(render: bpy.types.RenderSettings) -> tuple[int, int]:
    """Of the full frame, in pixels."""
    return _pixels(render.resolution_x, render), _pixels(render.resolution_y, render)


def _pixels(size: int, render: bpy.types.RenderSettings) -> int:
    return max(1, int(size * render.resolution_percentage / 100))
