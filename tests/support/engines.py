"""Renders the open Blender scene with Cistern and with Cycles under settings that mean the same."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO
from numpy.typing import NDArray

import addon

from .statistics import Comparison, block_means, compare_replicas

BOUNCES = 8

CYCLES = {
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 0.0,
    "blur_glossy": 0.0,
    "light_sampling_threshold": 0.0,
    "pixel_filter_type": "BOX",
    "caustics_reflective": True,
    "caustics_refractive": True,
    "use_light_tree": True,
    "device": "CPU",
    "use_auto_tile": False,
    "min_light_bounces": 0,
    "min_transparent_bounces": 0,
    "transparent_max_bounces": BOUNCES,
}
CISTERN = {
    "preset": "PATH_TRACING",
    "pixel_filter": "BOX",
    "filter_width": 1.0,
    "clamp_direct": 0.0,
    "clamp_indirect": 0.0,
    "min_bounces": 1,
    "max_transparent_bounces": BOUNCES,
}


def prepare(scene: bpy.types.Scene, width: int, height: int, bounces: int = BOUNCES) -> None:
    """Equal settings of both engines; float EXR output without compositing."""
    for settings, values in ((scene.cycles, CYCLES), (scene.cistern, CISTERN)):
        for name, value in values.items():
            setattr(settings, name, value)
        settings.max_bounces = bounces
    for kind in ("diffuse", "glossy", "transmission", "volume"):
        setattr(scene.cycles, f"{kind}_bounces", bounces)
        setattr(scene.cistern, f"max_{kind}_bounces", bounces)
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.use_border = render.use_compositing = render.use_sequencer = render.use_persistent_data = False
    image = render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGBA", "32"


def render(scene: bpy.types.Scene, engine: str, samples: int, seed: int) -> NDArray[np.float32]:
    """Combined (height, width, 4), row 0 at the bottom. Raises with Cistern's own words when its render failed."""
    scene.render.engine = engine
    settings = scene.cycles if engine == "CYCLES" else scene.cistern
    settings.samples, settings.seed = samples, seed
    addon.report.last.clear()
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "picture.exr")
        bpy.ops.render.render(write_still=True)
        if engine == "CISTERN":
            errors = [line.error for line in addon.report.last if line.error]
            assert addon.report.last and not errors, errors
        source = OpenImageIO.ImageInput.open(scene.render.filepath)
        pixels = source.read_image("float")
        source.close()
    return np.ascontiguousarray(pixels[::-1])


def replicas(
    scene: bpy.types.Scene, engine: str, count: int, samples: int, blocks: int, first_seed: int = 1
) -> NDArray:
    """Block means of RGB and alpha of `count` renders with different seeds: (count, blocks * blocks * 4)."""
    return np.array([block_means(render(scene, engine, samples, first_seed + k), blocks, blocks) for k in range(count)])


SAMPLES, SAMPLES_OF_PLANTED = 48 if os.environ.get("CISTERN_FULL_TESTS") else 24, 16
"""Of each replica. A planted bug that fewer samples show is seen by all of them the more."""


def compare_with_cycles(
    scene: bpy.types.Scene,
    size: tuple[int, int] = (48, 48),
    samples: int | None = None,
    count: int = 6,
    blocks: int = 4,
    plant: Callable[[bpy.types.Scene], None] | None = None,
    floor: float = 0.0,
    preset: str = "PATH_TRACING",
    bounces: int = BOUNCES,
) -> Comparison:
    """Cistern against Cycles. `plant` changes the scene before Cycles renders it: a planted bug."""
    samples = samples or (SAMPLES_OF_PLANTED if plant else SAMPLES)
    prepare(scene, *size, bounces)
    scene.cistern.preset = preset
    ours = replicas(scene, "CISTERN", count, samples, blocks)
    if plant:
        plant(scene)
    theirs = replicas(scene, "CYCLES", count, samples, blocks, first_seed=1001)
    return compare_replicas(ours, theirs, floor=floor)
