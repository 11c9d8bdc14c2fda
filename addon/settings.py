"""Blender's settings of one view layer as the core's `Settings`."""

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import bpy
import numpy as np

from . import denoise, properties, view_modes
from .passes import CELL_PASSES, RenderPass
from .shadow_catchers import SHADOW_PASS
from .sync import versions
from .techniques import (
    CELL_PARAMETERS,
    NO_REUSE,
    REFERENCE,
    is_reference,
    settings_in_force,
    used_parameters,
    viewport_settings_in_force,
    works_with_cells,
)

# Material, light and world icons are small and are drawn often.
PREVIEW_SAMPLES = 32

# Odd, so that multiplying by it permutes the integers modulo 2^31: every frame number gets a seed of its own.
FRAME_SEED_STEP = 0x3C6EF373

FULL_FILTER_WIDTHS = {"BLACKMAN_HARRIS": 2.0, "GAUSSIAN": 3.0}

MIST_POWERS = {"QUADRATIC": 2.0, "LINEAR": 1.0, "INVERSE_QUADRATIC": 0.5}
MIST_WITHOUT_WORLD = (0.0, 100.0, 1.0)  # as in Cycles


class SettingsError(RuntimeError):
    """A setting that cannot be obeyed; the text names the scene and the setting."""


@dataclass(frozen=True)
class Region:
    """The rendered part of the full frame in pixels, y up."""

    x: int
    y: int
    width: int
    height: int


def full_filter_width(settings: properties.CisternSceneSettings) -> float:
    """In pixels, from edge to edge. What users set is that of Cycles, whose tails are cut off further out."""
    if settings.pixel_filter == "BOX":
        return 1.0
    return FULL_FILTER_WIDTHS[settings.pixel_filter] * settings.filter_width


def render_region(render: bpy.types.RenderSettings, width: int, height: int) -> Region:
    """The border of a frame of the given size, or all of it. Follows Blender, which cuts off (float32) fractions."""
    if not render.use_border:
        return Region(0, 0, width, height)

    def pixel(fraction: float, size: int) -> int:
        return int(np.float32(fraction) * np.float32(size))

    left, right = pixel(render.border_min_x, width), pixel(render.border_max_x, width)
    bottom, top = pixel(render.border_min_y, height), pixel(render.border_max_y, height)
    return Region(left, bottom, max(right - left, 1), max(top - bottom, 1))


def frame_seed(settings: properties.CisternSceneSettings, frame: float) -> int:
    """The seed of a frame, or of a part of one; the same for all frames unless the seed is animated."""
    if not settings.use_animated_seed:
        return settings.seed
    return (settings.seed + int(frame * FRAME_SEED_STEP)) & properties.MAX_INT


def sample_count(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, is_preview: bool) -> int:
    """Samples per pixel: the view layer's own number where it has one, few for icons."""
    if is_preview:
        return PREVIEW_SAMPLES
    return view_layer.samples or scene.cistern.samples


def check_choices(scene: bpy.types.Scene) -> None:
    """Raises SettingsError for a choice that a later version of this add-on stored, of which Blender says nothing."""
    for prop in scene.cistern.bl_rna.properties:
        if prop.type == "ENUM" and not getattr(scene.cistern, prop.identifier):
            raise SettingsError(
                f"Scene '{scene.name}': what was chosen for {prop.name} ({prop.identifier}) is unknown to this version "
                "of Cistern; choose anew"
            )


def view_mode(scene: bpy.types.Scene, is_preview: bool) -> str:
    """What Combined shows; icons always show the render."""
    return "COMBINED" if is_preview else scene.cistern.view


def thread_count(scene: bpy.types.Scene) -> int:
    """Threads to work with; 0: one for each core."""
    return scene.render.threads if scene.render.threads_mode == "FIXED" else 0


def is_denoised(scene: bpy.types.Scene, layer: bpy.types.ViewLayer, is_preview: bool) -> bool:
    """Whether Combined is to be denoised: not where it shows something else than the render. Layers have a switch of
    their own, with Cycles."""
    is_wanted = scene.cistern.use_denoising and versions.cycles_setting(layer, "use_denoising", True)
    return is_wanted and not is_preview and scene.cistern.view == "COMBINED"


def is_viewport_denoised(scene: bpy.types.Scene) -> bool:
    """The same for 3D viewports."""
    return scene.cistern.use_viewport_denoising and scene.cistern.viewport_view == "COMBINED"


def techniques_in_force(scene: bpy.types.Scene, layer: bpy.types.ViewLayer, is_preview: bool = False) -> dict[str, Any]:
    """Techniques and parameters of a final render; icons, being small, reuse nothing."""
    in_force: dict[str, Any] = dict(settings_in_force(scene.cistern))
    if is_preview:
        in_force |= NO_REUSE
    if is_denoised(scene, layer, is_preview):
        in_force |= denoise.TECHNIQUES
    return in_force


def technique_arguments(in_force: dict[str, Any], core: ModuleType) -> dict[str, Any]:
    """The answers in force, and by the core's names the parameters that they use."""
    arguments = {name: in_force[name] for name in REFERENCE}
    arguments["light_sampling"] = core.LightSampling[in_force["light_sampler"]]
    if in_force["guiding"] != "OFF":
        arguments["guiding"] = in_force["guiding"]
    if not is_reference(in_force):
        arguments["bias"] = in_force["bias"]
    return arguments | {parameter.core_name: in_force[parameter.name] for parameter in used_parameters(in_force)}


def cell_settings(scene: bpy.types.Scene, technique: dict[str, Any], core_passes: list[str]) -> dict[str, Any]:
    """Size and shape of the cells, by the core's names, where reuse works with cells or a pass shows them."""
    if not works_with_cells(technique) and not CELL_PASSES & set(core_passes):
        return {}
    return {parameter.core_name: getattr(scene.cistern, parameter.name) for parameter in CELL_PARAMETERS}


def mist_settings(depsgraph: bpy.types.Depsgraph) -> dict[str, tuple[float, float, float]]:
    """Where Mist begins, how deep it is, and the power of the fraction in between."""
    world = depsgraph.view_layer_eval.world_override or depsgraph.scene_eval.world
    if world is None:
        return {"mist_range": MIST_WITHOUT_WORLD}
    mist = world.mist_settings
    return {"mist_range": (mist.start, mist.depth, MIST_POWERS[mist.falloff])}


def pass_names(render_passes: list[RenderPass], view: str) -> list[str]:
    """The core's passes to ask for besides Combined: those of the layer, and what the view shows."""
    ours = ("Combined", denoise.NOISY_PASS, SHADOW_PASS)
    names = [render_pass.core_name for render_pass in render_passes if render_pass.core_name not in ours]
    return list(dict.fromkeys(names + view_modes.core_passes(view)))


def core_settings(
    core: ModuleType,
    depsgraph: bpy.types.Depsgraph,
    size: tuple[int, int],
    region: Region,
    render_passes: list[RenderPass],
    is_preview: bool,
) -> dict[str, Any]:
    """The keyword arguments of the core's `Settings`; `size` is the full frame's."""
    scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    check_choices(scene)
    technique = technique_arguments(techniques_in_force(scene, layer, is_preview), core)
    core_passes = pass_names(render_passes, view_mode(scene, is_preview))
    sequence = "SOBOL"
    if is_denoised(scene, layer, is_preview):
        core_passes = denoise.with_needed_passes(core_passes)
        sequence = denoise.SEQUENCE
    return {
        "sequence": sequence,
        "width": size[0],
        "height": size[1],
        "region": (region.x, region.y, region.width, region.height),
        "samples": sample_count(scene, layer, is_preview),
        "time_limit": scene.cistern.time_limit,
        **noise_settings(scene, 0.0 if is_preview else scene.cistern.noise_threshold),
        "adaptive_sampling": scene.cistern.use_adaptive_sampling,
        **scene_settings(core, scene, technique, core_passes),
        **(mist_settings(depsgraph) if "Mist" in core_passes else {}),
        **(occlusion_settings(depsgraph) if "Ambient Occlusion" in core_passes else {}),
        # Cycles looks at the sky there for the pass Environment alone.
        "groups_behind_film": depsgraph.view_layer_eval.use_pass_environment,
    }


def bake_settings(
    core: ModuleType, depsgraph: bpy.types.Depsgraph, size: tuple[int, int], core_passes: list[str]
) -> dict[str, Any]:
    """The keyword arguments of the core's `Settings` for an image of that size to be baked: those of the final render
    but for what a camera has to do with, and without history, which knows pixels only by what a camera sees."""
    scene = depsgraph.scene_eval
    check_choices(scene)
    technique = technique_arguments(dict(settings_in_force(scene.cistern)), core)
    if "temporal_reuse" in technique:
        technique["temporal_reuse"] = False
    return {
        **scene_settings(core, scene, technique, core_passes),
        "width": size[0],
        "height": size[1],
        "samples": sample_count(scene, depsgraph.view_layer_eval, is_preview=False),
        "pixel_filter": core.PixelFilter["BOX"],
        "filter_width": 1.0,
        "film_transparent": False,
        "film_transparent_glass": False,
        **occlusion_settings(depsgraph),
    }


def occlusion_settings(depsgraph: bpy.types.Depsgraph) -> dict[str, float]:
    """How far away is what occludes, of Ambient Occlusion."""
    world = depsgraph.view_layer_eval.world_override or depsgraph.scene_eval.world
    return {} if world is None else {"occlusion_distance": world.light_settings.distance}


def noise_settings(scene: bpy.types.Scene, threshold: float) -> dict[str, Any]:
    """How little noise ends a render. What shows depends on the exposure, which is none of its business otherwise."""
    return {
        "noise_threshold": threshold,
        "display_exposure": 2.0**scene.view_settings.exposure if threshold > 0.0 else 1.0,
    }


def take_out_deaf_threshold(
    core: ModuleType, scene: bpy.types.Scene, arguments: dict[str, Any], limits: dict[str, Any]
) -> str | None:
    """Do without the threshold in `limits` where samples by such settings do not tell their noise; return a warning."""
    if limits["noise_threshold"] == 0.0:
        return None
    if core.Settings(**{"width": 1, "height": 1, **arguments, **limits}).tells_noise:
        return None
    limits["noise_threshold"] = 0.0
    return (
        f"Scene '{scene.name}': the noise threshold does nothing, since samples that take up earlier ones do not tell "
        "how noisy they are; Final, Interactive and Path Tracing have it"
    )


def viewport_limits(scene: bpy.types.Scene) -> dict[str, Any]:
    """Keyword arguments of the core's `Settings` for the finest picture of a 3D viewport: what ends it."""
    return {
        "samples": scene.cistern.viewport_samples,
        "time_limit": scene.cistern.viewport_time_limit,
        "adaptive_sampling": True,
        **noise_settings(scene, scene.cistern.viewport_noise_threshold),
    }


def viewport_settings(core: ModuleType, scene: bpy.types.Scene, has_catchers: bool = False) -> dict[str, Any]:
    """The same for a 3D viewport, save what depends on the size of its pixels. With shadow catchers nothing is reused:
    shadows are quotients of two pictures by the same random numbers."""
    check_choices(scene)
    in_force = viewport_settings_in_force(scene.cistern)
    if has_catchers:
        in_force |= NO_REUSE
    if is_viewport_denoised(scene):
        in_force |= denoise.TECHNIQUES
    technique = technique_arguments(in_force, core)
    # Photons would delay each picture.
    kept: dict[str, Any] = {"keep_history": True, "keep_instances": True, "caustic_guide": False}
    # Before the first sample a trial would delay each picture; with history for that sample alone it comes later.
    on_trial = all(technique.get(name) for name in ("share_trial", "temporal_reuse", "first_frame_history"))
    passes = pass_names([], scene.cistern.viewport_view)
    if is_viewport_denoised(scene):
        passes = denoise.with_quick_passes(passes)
        kept["sequence"] = denoise.SEQUENCE
    if has_catchers:
        kept["find_openings"] = False
    return scene_settings(core, scene, technique, passes) | kept | {"share_trial": on_trial}


def scene_settings(
    core: ModuleType, scene: bpy.types.Scene, technique: dict[str, Any], core_passes: list[str]
) -> dict[str, Any]:
    """What final renders and viewports have in common."""
    settings = scene.cistern
    return {
        "seed": frame_seed(settings, scene.frame_current + scene.frame_subframe),
        "threads": thread_count(scene),
        "pixel_filter": core.PixelFilter[settings.pixel_filter],
        "filter_width": full_filter_width(settings),
        "film_exposure": settings.film_exposure,
        "max_bounces": settings.max_bounces,
        "max_diffuse_bounces": settings.max_diffuse_bounces,
        "max_glossy_bounces": settings.max_glossy_bounces,
        "max_transmission_bounces": settings.max_transmission_bounces,
        "max_volume_bounces": settings.max_volume_bounces,
        "max_transparent_bounces": settings.max_transparent_bounces,
        "min_bounces": settings.min_bounces,
        "find_openings": settings.find_openings,
        "light_through_panes": settings.light_through_panes,
        "film_transparent": scene.render.film_transparent,
        "film_transparent_glass": scene.render.film_transparent and settings.film_transparent_glass,
        "clamp_direct": settings.clamp_direct,
        "clamp_indirect": settings.clamp_indirect,
        "filter_glossy": settings.filter_glossy,
        "caustics_reflective": settings.caustics_reflective,
        "caustics_refractive": settings.caustics_refractive,
        "passes": core_passes,
        **technique,
        **cell_settings(scene, technique, core_passes),
    }
