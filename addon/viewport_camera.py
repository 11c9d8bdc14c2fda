"""How a 3D viewport looks at the scene: its matrices, camera and border as plain numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import bpy

    from .sync.camera import Window

# left, bottom, right, top; of the region, as fractions of its size
Rectangle = tuple[float, float, float, float]
WHOLE: Rectangle = (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True)
class View:
    """The camera of a viewport and the part of its region to be rendered; equal views give equal pictures."""

    width: int
    """Of the region, in pixels."""
    height: int
    shown: Rectangle
    camera: tuple[tuple[str, Any], ...]
    """Arguments of `SceneBuilder.set_camera`."""

    def camera_arguments(self) -> dict[str, Any]:
        arguments = dict(self.camera)
        return arguments | {"camera_to_world": np.array(arguments["camera_to_world"], np.float32)}

    def frame(self, pixel_size: int) -> tuple[tuple[int, int], tuple[int, int, int, int]]:
        """Size of the full frame, and the rendered part (x, y, width, height), in pixels of that size."""
        width, height = math.ceil(self.width / pixel_size), math.ceil(self.height / pixel_size)
        left, right = round_out(self.shown[0], self.shown[2], width)
        bottom, top = round_out(self.shown[1], self.shown[3], height)
        return (width, height), (left, bottom, right - left, top - bottom)


def round_out(low: float, high: float, size: int) -> tuple[int, int]:
    """Whole pixels that cover a part of a side, at least one."""
    first = min(math.floor(low * size + 1e-6), size - 1)
    return first, max(math.ceil(high * size - 1e-6), first + 1)


def viewport_view(context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> View:
    """The present view of the context's 3D viewport."""
    from .sync.camera import rigid_matrix, window_arguments

    region, region_data, space = context.region, context.region_data, context.space_data
    camera = view_camera(context, depsgraph)
    projection = np.array(region_data.window_matrix, np.float64)
    matrix = rigid_matrix(region_data.view_matrix.inverted())
    is_perspective = projection[3, 3] == 0.0
    window = projected_window(projection, is_perspective)
    clip_start, clip_end = (
        (camera.data.clip_start, camera.data.clip_end) if camera else (space.clip_start, space.clip_end)
    )
    if not is_perspective and region_data.view_perspective != "CAMERA":
        # Such a viewport sees what lies behind its own place as well, half of the distance either way.
        matrix[:3, 3] += matrix[:3, 2] * (0.5 * clip_end)
        clip_start = 0.0
    arguments = {
        "name": camera.name if camera else "Viewport",
        "type": "PERSPECTIVE" if is_perspective else "ORTHOGRAPHIC",
        "camera_to_world": tuple(map(tuple, matrix.tolist())),
        **window_arguments(window),
        "clip_start": clip_start,
        "clip_end": clip_end,
        **(lens(camera) if camera else {}),
        **(panorama(camera, context.scene.render, window) if is_panorama(camera) else {}),
    }
    shown = shown_part(context, camera, window)
    return View(max(region.width, 1), max(region.height, 1), shown, tuple(sorted(arguments.items())))


def view_camera(context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> bpy.types.Object | None:
    """The evaluated camera that the viewport looks through, if any."""
    if context.region_data.view_perspective != "CAMERA":
        return None
    space = context.space_data
    camera = space.camera if space.use_local_camera else depsgraph.scene.camera
    return camera.evaluated_get(depsgraph) if camera is not None and camera.type == "CAMERA" else None


def lens(camera: bpy.types.Object) -> dict[str, Any]:
    from .sync.camera import lens_arguments

    return {name: float(value) if name != "blades" else value for name, value in lens_arguments(camera).items()}


def is_panorama(camera: bpy.types.Object | None) -> bool:
    return camera is not None and camera.data.type == "PANO"


def panorama(camera: bpy.types.Object, render: bpy.types.RenderSettings, window: Window) -> dict[str, Any]:
    """The panorama fills the frame that Blender draws for a perspective camera with that lens. Arguments that replace
    those of such a camera."""
    from .sync.camera import panorama_arguments, panorama_window, window_arguments

    left, bottom, right, top = camera_frame(camera, render, window)
    width, height = right - left, top - bottom
    shift_x, _, shift_y, _ = panorama_window(camera.data)
    around_frame = (
        shift_x - left / width,
        shift_x + (1.0 - left) / width,
        shift_y - bottom / height,
        shift_y + (1.0 - bottom) / height,
    )
    return {
        "type": "PANORAMIC",
        "panorama": panorama_arguments(camera.data, render),
        **window_arguments(around_frame),
    }


def projected_window(projection: np.ndarray, is_perspective: bool) -> Window:
    """Of what a projection matrix of OpenGL's kind shows: at unit distance, or in metres for
    an orthographic one."""

    def side(edge: float, row: int) -> float:
        if is_perspective:
            return (edge + projection[row, 2]) / projection[row, row]
        return (edge - projection[row, 3]) / projection[row, row]

    return side(-1.0, 0), side(1.0, 0), side(-1.0, 1), side(1.0, 1)


def shown_part(context: bpy.types.Context, camera: bpy.types.Object | None, window: Window) -> Rectangle:
    """The part of the region to be rendered: all of it, unless the user drew a border, the rest is painted over, or a
    panorama has nothing there."""
    render, space = context.scene.render, context.space_data
    if camera is None:
        if not space.use_render_border:
            return WHOLE
        return clipped(
            space.render_border_min_x, space.render_border_min_y, space.render_border_max_x, space.render_border_max_y
        )
    left, bottom, right, top = camera_frame(camera, render, window)
    if render.use_border:
        width, height = right - left, top - bottom
        left, right = left + render.border_min_x * width, left + render.border_max_x * width
        bottom, top = bottom + render.border_min_y * height, bottom + render.border_max_y * height
        return clipped(left, bottom, right, top)
    if is_panorama(camera):
        return within(left, bottom, right, top)
    covers_rest = camera.data.show_passepartout and camera.data.passepartout_alpha >= 1.0
    return clipped(left, bottom, right, top) if covers_rest else WHOLE


def camera_frame(camera: bpy.types.Object, render: bpy.types.RenderSettings, window: Window) -> Rectangle:
    """Where the picture of a final render lies in the region."""
    from .sync.camera import camera_window

    left, right, bottom, top = camera_window(camera.data, render)
    width, height = window[1] - window[0], window[3] - window[2]
    return (
        (left - window[0]) / width,
        (bottom - window[2]) / height,
        (right - window[0]) / width,
        (top - window[2]) / height,
    )


def clipped(*edges: float) -> Rectangle:
    """A rectangle within the region; all of the region where nothing is left."""
    left, bottom, right, top = within(*edges)
    return (left, bottom, right, top) if left < right and bottom < top else WHOLE


def within(*edges: float) -> Rectangle:
    """What of a rectangle is within the region, without width or height where nothing is."""
    left, bottom, right, top = (min(max(edge, 0.0), 1.0) for edge in edges)
    return left, bottom, right, top
