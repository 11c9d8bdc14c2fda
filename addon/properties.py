"""The settings a user sees: `scene.cistern` and `view_layer.cistern`.

No property has a callback: in the bpy module of Blender 4.2 one is enough to crash Python as it exits.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty

from . import view_modes
from .bake_types import BAKE_ITEMS
from .layer_properties import CisternViewLayerSettings
from .reuse_properties import ReuseSettings
from .techniques import (
    BIAS_ITEMS,
    DIRECT_ITEMS,
    GUIDING_ITEMS,
    INDIRECT_ITEMS,
    LIGHT_SAMPLER_ITEMS,
    PRESET_ITEMS,
    SECONDARY_ITEMS,
    VIEWPORT_PRESET_ITEMS,
)

MAX_INT = 2**31 - 1
MAX_NUMBER = 1e9  # of time limits, noise thresholds and clamps, all of which the core takes
MAX_SAMPLES = 2**24
MAX_BOUNCES = 1024

FILTER_ITEMS = (
    ("BOX", "Box", "Every sample counts equally in the pixel it falls in"),
    ("GAUSSIAN", "Gaussian", "Gaussian pixel filter"),
    ("BLACKMAN_HARRIS", "Blackman-Harris", "Blackman-Harris pixel filter, the sharper of the smooth ones"),
)


class CisternSceneSettings(ReuseSettings, bpy.types.PropertyGroup):
    """`scene.cistern`"""

    samples: IntProperty(
        name="Samples",
        description="Number of samples per pixel of the final render",
        default=128,
        min=1,
        soft_max=4096,
        max=MAX_SAMPLES,
    )
    time_limit: FloatProperty(
        name="Time Limit",
        description="Stop after this many seconds with the samples done so far; 0 means no limit",
        default=0.0,
        min=0.0,
        max=MAX_NUMBER,
        unit="TIME_ABSOLUTE",
        subtype="TIME_ABSOLUTE",
        step=100,
        precision=2,
    )
    noise_threshold: FloatProperty(
        name="Noise Threshold",
        description=(
            "Stop once so little noise is left, before all samples are done: the error of pixels as a display shows "
            "them, where white is 1. 0.01 is hardly seen and takes 40 samples at least, 0.05 is for the denoiser; 0 "
            "means all samples"
        ),
        default=0.0,
        min=0.0,
        soft_max=1.0,
        max=MAX_NUMBER,
        step=1,
        precision=4,
    )
    use_adaptive_sampling: BoolProperty(
        name="Adaptive Sampling",
        description=(
            "With a noise threshold, parts of the picture that have reached it take no more samples, and the render "
            "goes on until all have. Otherwise it ends as a whole, once all but the noisiest twentieth have"
        ),
        default=True,
    )
    viewport_samples: IntProperty(
        name="Viewport Samples",
        description="Number of samples per pixel of the finest picture in a 3D viewport; then it rests",
        default=1024,
        min=1,
        soft_max=4096,
        max=MAX_SAMPLES,
    )
    viewport_time_limit: FloatProperty(
        name="Viewport Time Limit",
        description="A 3D viewport rests after this many seconds of its finest picture; 0 means no limit",
        default=0.0,
        min=0.0,
        max=MAX_NUMBER,
        unit="TIME_ABSOLUTE",
        subtype="TIME_ABSOLUTE",
        step=100,
        precision=2,
    )
    viewport_noise_threshold: FloatProperty(
        name="Viewport Noise Threshold",
        description=(
            "A 3D viewport rests once its finest picture has so little noise; parts of it that do so before take no "
            "more samples. See Noise Threshold; 0 means all samples"
        ),
        default=0.0,
        min=0.0,
        soft_max=1.0,
        max=MAX_NUMBER,
        step=1,
        precision=4,
    )
    viewport_preset: EnumProperty(
        name="Viewport Preset",
        description="Which techniques 3D viewports use",
        items=VIEWPORT_PRESET_ITEMS,
        default="INTERACTIVE",
    )
    use_viewport_denoising: BoolProperty(
        name="Denoise Viewport",
        description=(
            "Filter what 3D viewports show by Open Image Denoise, which Blender brings along, while samples are added: "
            "the picture of the 1st sample, the 2nd, the 4th and so on, and of the last"
        ),
        default=False,
    )
    viewport_view: EnumProperty(
        name="Viewport View",
        description="What 3D viewports show: the render, a part of its light, or what reuse works with",
        items=view_modes.VIEW_ITEMS,
        default="COMBINED",
    )
    bake_type: EnumProperty(
        name="Bake Type",
        description="What is baked into the images, or colours, of the selected objects",
        items=BAKE_ITEMS,
        default="COMBINED",
    )
    viewport_pause: BoolProperty(
        name="Pause",
        description="Stop rendering in 3D viewports; what they show stays as it is",
        default=False,
    )
    use_denoising: BoolProperty(
        name="Denoise",
        description=(
            "Filter the finished picture by Open Image Denoise, which Blender brings along, guided by the colours and "
            "normals of surfaces. Other passes stay as they are"
        ),
        default=False,
    )
    seed: IntProperty(
        name="Seed",
        description="Number that selects the noise pattern; equal seeds give bit-identical pictures",
        default=0,
        min=0,
        max=MAX_INT,
    )
    use_animated_seed: BoolProperty(
        name="Animate Seed",
        description="Change the noise pattern from frame to frame of an animation",
        default=True,
    )
    preset: EnumProperty(
        name="Preset",
        description="Which techniques are used; a technique that a script sets by itself wins over the preset",
        items=PRESET_ITEMS,
        default="FINAL",
    )
    direct: EnumProperty(
        name="Direct Light",
        description="How the light that reaches a visible point straight from a light is found",
        items=DIRECT_ITEMS,
        default="NEE",
    )
    secondary: EnumProperty(
        name="Secondary Light",
        description="How the light that reaches a later point of a path straight from a light is found",
        items=SECONDARY_ITEMS,
        default="NEE",
    )
    indirect: EnumProperty(
        name="Indirect Light",
        description="How the light that reaches a visible point by way of other surfaces is found",
        items=INDIRECT_ITEMS,
        default="PATH",
    )
    guiding: EnumProperty(
        name="Guiding",
        description="Whether paths bounce to where light was found before",
        items=GUIDING_ITEMS,
        default="OFF",
    )
    bias: EnumProperty(
        name="Bias",
        description="Whether speed may be bought with a systematic error",
        items=BIAS_ITEMS,
        default="UNBIASED",
    )
    light_sampler: EnumProperty(
        name="Light Sampler",
        description="How one of many lights is chosen for a light sample",
        items=LIGHT_SAMPLER_ITEMS,
        default="TREE",
    )
    find_openings: BoolProperty(
        name="Find Openings",
        description=(
            "Look for windows and other openings that the sky lights an interior through, and sample it through those, "
            "as through light portals, where that lowers the noise. Scenes with portals use them alone"
        ),
        default=True,
    )
    light_through_panes: BoolProperty(
        name="Light Through Panes",
        description=(
            "Sample the sky, lamps and objects that emit through flat panes of smooth glass, too. Without, only "
            "scattered rays find that light, which is noisy"
        ),
        default=True,
    )
    view: EnumProperty(
        name="View",
        description=(
            "What the picture of a final render shows: the render, a part of its light, or what reuse works with. "
            "Passes keep their own values"
        ),
        items=view_modes.VIEW_ITEMS,
        default="COMBINED",
    )
    max_bounces: IntProperty(
        name="Total",
        description="Largest number of bounces of a light path; 0 leaves direct light only",
        default=12,
        min=0,
        soft_max=64,
        max=MAX_BOUNCES,
    )
    max_diffuse_bounces: IntProperty(
        name="Diffuse",
        description="Largest number of diffuse bounces of a light path",
        default=12,
        min=0,
        soft_max=64,
        max=MAX_BOUNCES,
    )
    max_glossy_bounces: IntProperty(
        name="Glossy",
        description="Largest number of glossy bounces of a light path",
        default=12,
        min=0,
        soft_max=64,
        max=MAX_BOUNCES,
    )
    max_transmission_bounces: IntProperty(
        name="Transmission",
        description="Largest number of times a light path passes through glass",
        default=12,
        min=0,
        soft_max=64,
        max=MAX_BOUNCES,
    )
    max_volume_bounces: IntProperty(
        name="Volume",
        description="Largest number of times a light path is scattered inside of volumes after the first",
        default=12,
        min=0,
        soft_max=64,
        max=MAX_BOUNCES,
    )
    max_transparent_bounces: IntProperty(
        name="Transparent",
        description="Largest number of transparent surfaces a ray goes straight through",
        default=8,
        min=0,
        soft_max=64,
        max=MAX_BOUNCES,
    )
    min_bounces: IntProperty(
        name="Min Bounces",
        description="Number of bounces before a dim light path may be ended at random (without bias)",
        default=1,
        min=0,
        soft_max=64,
        max=MAX_BOUNCES,
    )
    clamp_direct: FloatProperty(
        name="Direct Light",
        description="Largest scene-linear value one sample of direct light may add to a pixel; 0 means no limit",
        default=0.0,
        min=0.0,
        soft_max=100.0,
        max=MAX_NUMBER,
    )
    clamp_indirect: FloatProperty(
        name="Indirect Light",
        description="Largest scene-linear value one sample of indirect light may add to a pixel; 0 means no limit",
        default=0.0,
        min=0.0,
        soft_max=100.0,
        max=MAX_NUMBER,
    )
    filter_glossy: FloatProperty(
        name="Filter Glossy",
        description=(
            "Soften reflections and refractions that light reaches by unlikely scatterings, which are noisy: by those "
            "of a lower density than this. With 1 the diffuse ones are among them; 0 means none"
        ),
        default=0.0,
        min=0.0,
        soft_max=10.0,
        max=MAX_NUMBER,
    )
    caustics_reflective: BoolProperty(
        name="Reflective",
        description="Light that glossy surfaces throw on diffuse ones; without it there is less noise, and less light",
        default=True,
    )
    caustics_refractive: BoolProperty(
        name="Refractive",
        description="Light that glass throws on diffuse surfaces; without it there is less noise, and less light",
        default=True,
    )
    pixel_filter: EnumProperty(
        name="Filter",
        description="How samples near a pixel are weighted",
        items=FILTER_ITEMS,
        default="BLACKMAN_HARRIS",
    )
    filter_width: FloatProperty(
        name="Width",
        description="Width of the pixel filter in pixels, as in Cycles; the box filter is always one pixel wide",
        default=1.5,
        min=0.01,
        max=10.0,
        subtype="PIXEL",
    )
    film_exposure: FloatProperty(
        name="Exposure",
        description="Multiplies all light in the picture and its passes, as Exposure in Cycles' Film panel does",
        default=1.0,
        min=0.0,
        soft_max=10.0,
        max=MAX_NUMBER,
    )
    film_transparent_glass: BoolProperty(
        name="Transparent Glass",
        description="Make the film transparent also where the world is seen through glass",
        default=False,
    )


CLASSES = (CisternSceneSettings, CisternViewLayerSettings)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.cistern = PointerProperty(type=CisternSceneSettings)
    bpy.types.ViewLayer.cistern = PointerProperty(type=CisternViewLayerSettings)


def unregister() -> None:
    del bpy.types.ViewLayer.cistern
    del bpy.types.Scene.cistern
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
