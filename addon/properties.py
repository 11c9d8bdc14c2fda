"""The settings a user sees: `scene.cistern` and `view_layer.cistern`.

No property has a callback: in the bpy module of Blender 4.2 one is enough to crash Python as it exits.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty

MAX_INT = 2**31 - 1
MAX_SAMPLES = 2**24
MAX_BOUNCES = 1024

PRESET_ITEMS = (
    ("FINAL", "Final", "Independent frames that average to the true picture"),
    ("INTERACTIVE", "Interactive", "The best picture after a short time"),
    ("CUSTOM", "Custom", "The techniques chosen below"),
)
NEXT_EVENT_ITEM = (
    "NEE",
    "Next Event",
    "One light sample and one BSDF sample, weighted by multiple importance sampling",
)
DIRECT_ITEMS = (NEXT_EVENT_ITEM,)
SECONDARY_ITEMS = (NEXT_EVENT_ITEM,)
INDIRECT_ITEMS = (("PATH", "Path Tracing", "Each pixel uses only the light paths it traced itself"),)
BIAS_ITEMS = (("UNBIASED", "Unbiased", "The expected picture is exactly the true one"),)
LIGHT_SAMPLER_ITEMS = (
    ("UNIFORM", "Uniform", "Every light is chosen equally often"),
    ("POWER", "Power", "Lights are chosen in proportion to the power they send out"),
    ("TREE", "Light Tree", "Lights are chosen by an estimate of what they send to the shaded point"),
)
FILTER_ITEMS = (
    ("BOX", "Box", "Every sample counts equally in the pixel it falls in"),
    ("GAUSSIAN", "Gaussian", "Gaussian pixel filter"),
    ("BLACKMAN_HARRIS", "Blackman-Harris", "Blackman-Harris pixel filter, the sharper of the smooth ones"),
)

TECHNIQUES = ("direct", "secondary", "indirect", "bias", "light_sampler")

# What each preset chooses, in the order of TECHNIQUES.
PRESETS = {
    "FINAL": ("NEE", "NEE", "PATH", "UNBIASED", "TREE"),
    "INTERACTIVE": ("NEE", "NEE", "PATH", "UNBIASED", "TREE"),
}


def techniques(settings: "CisternSceneSettings") -> dict[str, str]:
    """The techniques in force: what the preset says, except where a technique was set by hand."""
    preset = dict(zip(TECHNIQUES, PRESETS.get(settings.preset, ()), strict=False))
    return {
        name: getattr(settings, name) if settings.is_property_set(name) else preset.get(name, getattr(settings, name))
        for name in TECHNIQUES
    }


def choose_preset(settings: "CisternSceneSettings", preset: str) -> None:
    """Take over a preset whole; CUSTOM starts from the techniques in force."""
    in_force = techniques(settings)
    settings.preset = preset
    for name in TECHNIQUES:
        if preset == "CUSTOM":
            setattr(settings, name, in_force[name])
        else:
            settings.property_unset(name)


class CisternSceneSettings(bpy.types.PropertyGroup):
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
        unit="TIME_ABSOLUTE",
        subtype="TIME_ABSOLUTE",
        step=100,
        precision=2,
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
        default=0,
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
    )
    clamp_indirect: FloatProperty(
        name="Indirect Light",
        description="Largest scene-linear value one sample of indirect light may add to a pixel; 0 means no limit",
        default=0.0,
        min=0.0,
        soft_max=100.0,
    )
    pixel_filter: EnumProperty(
        name="Filter",
        description="How samples near a pixel are weighted",
        items=FILTER_ITEMS,
        default="BLACKMAN_HARRIS",
    )
    filter_width: FloatProperty(
        name="Width",
        description="Width of the pixel filter in pixels; the box filter is always one pixel wide",
        default=1.5,
        min=0.01,
        max=10.0,
        subtype="PIXEL",
    )
    film_transparent_glass: BoolProperty(
        name="Transparent Glass",
        description="Make the film transparent also where the world is seen through glass",
        default=False,
    )


class CisternViewLayerSettings(bpy.types.PropertyGroup):
    """`view_layer.cistern`"""

    use_pass_direct: BoolProperty(
        name="Direct",
        description="Light that reaches the visible point straight from a light, in scene-linear radiance",
        default=True,
    )
    use_pass_indirect: BoolProperty(
        name="Indirect",
        description="Light that reaches the visible point by way of other surfaces, in scene-linear radiance",
        default=True,
    )
    use_pass_denoising_albedo: BoolProperty(
        name="Denoising Albedo",
        description="Share of light (0 to 1) that the visible surface reflects, for denoisers",
        default=False,
    )
    use_pass_denoising_normal: BoolProperty(
        name="Denoising Normal",
        description="Unit shading normal of the visible surface, for denoisers",
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
