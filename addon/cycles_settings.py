"""Takes over what a file has set for Cycles, so that a scene that was made for it renders alike at once.

Settings that both engines have are copied, once, when the user asks for it: afterwards the two are independent again.
"""

from typing import Any

import bpy

from .properties import MAX_SAMPLES

# Cistern's name and Cycles'. They mean the same, in the same units.
COPIED = (
    ("samples", "samples"),
    ("time_limit", "time_limit"),
    ("seed", "seed"),
    ("use_animated_seed", "use_animated_seed"),
    ("use_denoising", "use_denoising"),
    ("use_viewport_denoising", "use_preview_denoising"),
    ("max_bounces", "max_bounces"),
    ("max_diffuse_bounces", "diffuse_bounces"),
    ("max_glossy_bounces", "glossy_bounces"),
    ("max_transmission_bounces", "transmission_bounces"),
    ("max_volume_bounces", "volume_bounces"),
    ("max_transparent_bounces", "transparent_max_bounces"),
    ("clamp_direct", "sample_clamp_direct"),
    ("clamp_indirect", "sample_clamp_indirect"),
    ("filter_glossy", "blur_glossy"),
    ("caustics_reflective", "caustics_reflective"),
    ("caustics_refractive", "caustics_refractive"),
    ("pixel_filter", "pixel_filter_type"),
    ("filter_width", "filter_width"),
    ("film_exposure", "film_exposure"),
    ("film_transparent_glass", "film_transparent_glass"),
)
COPIED_OF_LAYERS = (
    ("use_pass_shadow_catcher", "use_pass_shadow_catcher"),
    ("use_pass_volume_direct", "use_pass_volume_direct"),
    ("use_pass_volume_indirect", "use_pass_volume_indirect"),
    ("use_pass_sample_count", "pass_debug_sample_count"),
    ("use_pass_denoising_albedo", "denoising_store_passes"),
    ("use_pass_denoising_normal", "denoising_store_passes"),
)

# What Cycles takes for its threshold where that is 0: one over the samples, but at least this.
LEAST_AUTOMATIC_THRESHOLD = 1e-3
# Cycles lets no path end at random before so many bounces more than its setting says.
SURE_BOUNCES = 1
GLASS_ROUGHNESS = 0.1  # up to which the film is transparent behind glass here


def is_there(scene: bpy.types.Scene) -> bool:
    """Whether Cycles is enabled, which keeps these settings."""
    return hasattr(scene, "cycles")


def take_over(scene: bpy.types.Scene) -> list[str]:
    """Give Cistern the values that the scene and its view layers have for Cycles.

    Returns what else is set there that changes pictures and has no like here, each in a few words."""
    copy(scene.cycles, scene.cistern, COPIED)
    scene.cistern.viewport_samples = scene.cycles.preview_samples or MAX_SAMPLES  # 0: without end
    scene.cistern.noise_threshold = noise_threshold(scene.cycles, "")
    scene.cistern.viewport_noise_threshold = noise_threshold(scene.cycles, "preview_")
    scene.cistern.min_bounces = scene.cycles.min_light_bounces + SURE_BOUNCES
    for layer in scene.view_layers:
        copy(layer.cycles, layer.cistern, COPIED_OF_LAYERS)
        layer.cistern.use_pass_noisy = scene.cycles.use_denoising and layer.cycles.use_denoising
    return left_out(scene)


def copy(source: Any, target: Any, names: tuple[tuple[str, str], ...]) -> None:  # noqa: ANN401
    """Those that this version of Cycles has."""
    for ours, theirs in names:
        if hasattr(source, theirs):
            setattr(target, ours, getattr(source, theirs))


def noise_threshold(cycles: Any, kind: str) -> float:  # noqa: ANN401
    """Of renders ("") or viewports ("preview_"). Both mean errors as a display shows them; Cycles looks at each pixel,
    we at blocks of them."""
    if not getattr(cycles, f"use_{kind}adaptive_sampling"):
        return 0.0
    threshold, samples = getattr(cycles, f"{kind}adaptive_threshold"), getattr(cycles, f"{kind}samples")
    automatic = 1.0 / samples if samples > 0 else 0.0
    return threshold or max(automatic, LEAST_AUTOMATIC_THRESHOLD)


def left_out(scene: bpy.types.Scene) -> list[str]:
    """See `take_over`."""
    cycles = scene.cycles
    culls = scene.render.use_simplify and (cycles.use_camera_cull or cycles.use_distance_cull)
    has_layer_samples = any(layer.samples > 0 for layer in scene.view_layers)
    other_samples = has_layer_samples and cycles.use_layer_samples != "USE"
    other_glass = cycles.film_transparent_glass and abs(cycles.film_transparent_roughness - GLASS_ROUGHNESS) > 1e-6
    found = (
        (cycles.use_fast_gi, "no Fast GI Approximation"),
        (culls, "no Culling (Simplify)"),
        (other_samples, "view layers have samples of their own"),
        (other_glass, f"glass is transparent up to a roughness of {GLASS_ROUGHNESS:g}"),
    )
    return [words for is_set, words in found if is_set]
