"""One pixel of the current scene as Cycles sees it, for facts that only a render can tell."""

from pathlib import Path

import bpy
import numpy as np

_SIDE = 4


def cycles_pixel(camera: bpy.types.Object, folder: Path, samples: int = 1) -> np.ndarray:
    """The linear RGBA in the middle of a small square picture."""
    scene = bpy.context.scene
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = samples, False, False
    scene.render.resolution_x = scene.render.resolution_y = _SIDE
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
    scene.render.filepath = str(folder / "pixel.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(_SIDE * _SIDE * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(_SIDE, _SIDE, -1)[_SIDE // 2, _SIDE // 2]
