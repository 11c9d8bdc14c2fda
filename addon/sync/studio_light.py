"""What a viewport's Rendered shading puts in place of the scene's lighting: no lamps, and a picture for a world.

As Cycles does it: rays of the camera see the picture over the colour that the world has for other viewports, all others
see the picture alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from . import versions
from .colour import REC709_SPACE, image_colour, srgb_to_linear
from .images import finite, read_file
from .nodes.enums import (
    BLEND_TYPES,
    ENVIRONMENT_PROJECTIONS,
    INTERPOLATIONS,
    LIGHT_PATH_OUTPUTS,
    ROTATION_TYPES,
    VECTOR_MATH_OPERATIONS,
)
from .nodes.instructions import COLOR, InstructionList, constant
from .nodes.vector import vector_constant

if TYPE_CHECKING:
    from cistern_core import MaterialProgram

    from .materials import MaterialContext

_NAME = "studio light"
_MAGENTA = np.full((1, 1, 3), (1.0, 0.0, 1.0), np.float32)


@dataclass(frozen=True)
class StudioLight:
    path: str
    """Of a picture of all directions, one of Blender's or of the user's."""
    rotation: float
    """Radians around the Z axis."""
    intensity: float
    opacity: float
    """Of the picture before the colour of the world, for rays of the camera."""


@dataclass(frozen=True)
class ViewportLighting:
    has_lamps: bool = True
    studio: StudioLight | None = None
    """In place of the world."""


SCENE_LIGHTING = ViewportLighting()


def viewport_lighting(space: bpy.types.SpaceView3D | None) -> ViewportLighting:
    shading = getattr(space, "shading", None)
    if shading is None or shading.type != "RENDERED":
        return SCENE_LIGHTING
    if shading.use_scene_world_render:
        return ViewportLighting(shading.use_scene_lights_render)
    light = shading.selected_studio_light
    studio = StudioLight(
        light.path if light is not None else "",
        shading.studiolight_rotate_z,
        shading.studiolight_intensity,
        shading.studiolight_background_alpha,
    )
    return ViewportLighting(shading.use_scene_lights_render, studio)


def shown_in(space: bpy.types.SpaceView3D | None) -> Callable[[bpy.types.Object], bool]:
    """Whether a viewport shows an object; everything is shown without one."""
    if space is None:
        return lambda _: True
    has_lamps = viewport_lighting(space).has_lamps
    return lambda obj: (has_lamps or obj.type != "LIGHT") and obj.visible_in_viewport_get(space)


def compile_studio_light(
    studio: StudioLight, world_color: tuple[float, float, float], context: MaterialContext
) -> MaterialProgram:
    if not Path(studio.path).is_file():
        context.warn(f"Studio light {studio.path!r} cannot be read, shown magenta")
    code = InstructionList(context.core, _NAME)
    key = (_NAME, studio.path, versions.working_space())
    handle = context.table_handle(key, _NAME, lambda: _picture(studio.path))
    origin = vector_constant(0.0, 0.0, 0.0)
    turned = code.emit(
        "VECTOR_ROTATE",
        (code.emit("GENERATED", (), (0,)), origin, vector_constant(0.0, 0.0, 1.0), constant(studio.rotation), origin),
        (ROTATION_TYPES.index("Z_AXIS"), 0),
    )
    projection = ENVIRONMENT_PROJECTIONS.index("EQUIRECTANGULAR")
    parameters = (code.program.image(handle), INTERPOLATIONS["Linear"], projection)
    picture = code.emit("ENVIRONMENT_IMAGE", (turned,), parameters)
    scale = VECTOR_MATH_OPERATIONS.index("SCALE")
    light = code.emit("VECTOR_MATH", (picture, origin, origin, constant(studio.intensity)), (scale,))
    mix = (BLEND_TYPES.index("MIX"), 0, 0)
    seen = code.emit("MIX_COLOR", (constant(studio.opacity), constant(*world_color, COLOR), light), mix)
    is_seen = code.emit("LIGHT_PATH", (), (LIGHT_PATH_OUTPUTS["Is Camera Ray"],))
    color = code.emit("MIX_COLOR", (is_seen, light, seen), mix)
    code.closure("CLOSURE_EMISSION", (constant(1.0), color, constant(1.0)))
    return code.write()


def _picture(path: str) -> NDArray[np.float32]:
    """(height, width, 3) in the working space; magenta where there is none."""
    file = read_file(path) if path else None
    if file is None:
        return _MAGENTA
    pixels = file.pixels
    if np.issubdtype(pixels.dtype, np.integer):
        pixels = srgb_to_linear(pixels / np.iinfo(pixels.dtype).max)
    colors = np.broadcast_to(pixels[..., :3] if pixels.shape[2] >= 3 else pixels[..., :1], (*pixels.shape[:2], 3))
    matrix = image_colour(REC709_SPACE, versions.working_space()).matrix
    if matrix is not None:
        colors = colors @ np.reshape(matrix, (3, 3)).T
    return np.ascontiguousarray(finite(colors)[0], np.float32)
