"""The three questions and their answers, the papers' parameters, and the presets that choose among them.

Everything here works on names and values: `properties` makes Blender's properties of it, `ui` the panels.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .properties import CisternSceneSettings

Value = str | int | float | bool

NEXT_EVENT_ITEM = ("NEE", "Next Event", "One light sample and one BSDF sample at every point, nothing is reused")
LEARNED_ITEM = (
    "LEARNED",
    "Learned",
    "As Next Event, and lights are chosen by what earlier samples saw of them nearby. For many lights and walls",
)
DIRECT_ITEMS = (
    NEXT_EVENT_ITEM,
    LEARNED_ITEM,
    (
        "RIS",
        "RIS",
        "The best of several light samples, chosen by what they would send to the point without shadows [Talbot 2005]",
    ),
    (
        "RESTIR",
        "ReSTIR",
        "As RIS, and pixels pass their choices on to their neighbours and to the next sample [Bitterli 2020]",
    ),
    (
        "RESTIR_CACHE",
        "ReSTIR with Cell Cache",
        "As ReSTIR, and cells of the scene offer light samples prepared before the first sample [Stefanescu 2025]",
    ),
)
SECONDARY_ITEMS = (
    NEXT_EVENT_ITEM,
    LEARNED_ITEM,
    (
        "RIS",
        "RIS",
        "The best of 16 light samples, chosen by what they would send to the point without shadows [Talbot 2005]",
    ),
    (
        "CELL_RESERVOIRS",
        "Cell Reservoirs",
        "As RIS, and points in the same cell of the scene share their choices, also with the next sample [Boissé 2021]",
    ),
)
INDIRECT_ITEMS = (
    ("PATH", "Path Tracing", "Each pixel uses only the light paths it traced itself"),
    (
        "SCREEN_REUSE",
        "ReSTIR GI",
        "Pixels pass the light paths they found on to their neighbours and to the next sample [Ouyang 2021]",
    ),
    (
        "WORLD_REUSE",
        "World-Space Paths",
        "Pixels take light paths from their own previous sample, and from all that met their cell of the scene then "
        "[Zhang 2023]",
    ),
    (
        "CELL_SHARED",
        "Cell Sharing",
        "Groups of points in the same cell of the scene hand each other the light paths they found; samples stay "
        "independent",
    ),
)
PATH_SOURCE_ITEMS = (
    ("BSDF", "BSDF", "As the surface scatters light"),
    ("COSINE", "Cosine", "By the cosine to the normal"),
    ("UNIFORM", "Uniform", "Evenly over the hemisphere: more grazing light found, less of what glossy surfaces show"),
)
PATH_TARGET_ITEMS = (
    ("REFLECTED", "Reflected", "By the light that the pixel's own surface reflects of a path [Ouyang 2021, Eq. 9]"),
    (
        "RADIANCE",
        "Radiance",
        "By the light that a path brings, whatever the surface: noisier here, of more use to others "
        "[Ouyang 2021, Eq. 10]",
    ),
)
GUIDING_ITEMS = (
    ("OFF", "Off", "Paths go on as surfaces scatter light"),
    (
        "ON",
        "On",
        "Half of the bounces go where light came from in earlier samples. For light that comes by narrow ways",
    ),
    (
        "AUTO",
        "Automatic",
        "On unless a few samples show that it does not pay. Tried once 400,000 paths have been seen, if half of the "
        "samples are left by then",
    ),
)
BIAS_ITEMS = (
    ("UNBIASED", "Unbiased", "The expected picture is exactly the true one"),
    ("FAST", "Fast", "Cheaper weights as first published: edges and shadows come out too dark, and cells may show"),
)
LIGHT_SAMPLER_ITEMS = (
    ("UNIFORM", "Uniform", "Every light is chosen equally often"),
    ("POWER", "Power", "Lights are chosen in proportion to the power they send out"),
    ("TREE", "Light Tree", "Lights are chosen by an estimate of what they send to the shaded point"),
)

TECHNIQUES = ("direct", "secondary", "indirect", "guiding", "bias", "light_sampler")
REFERENCE = {"direct": "NEE", "secondary": "NEE", "indirect": "PATH"}  # the path tracer without reuse
NO_REUSE: dict[str, Value] = {**REFERENCE, "guiding": "OFF", "use_caustic_guide": False}


@dataclass(frozen=True)
class Parameter:
    """A number or switch of the papers. For each answer to `direct` that uses it, `defaults` has what it is there: what
    0 stands for in the case of numbers."""

    name: str  # in `scene.cistern`
    defaults: dict[str, Value]
    others: frozenset[str] = frozenset()  # answers to `secondary` and `indirect` that use it
    default: Value = 0  # there

    @property
    def core_name(self) -> str:
        return CORE_NAMES.get(self.name, self.name.removeprefix("use_"))

    @property
    def is_switch(self) -> bool:
        return self.name.startswith("use_")

    def is_used(self, in_force: dict[str, Value]) -> bool:
        return in_force["direct"] in self.defaults or bool({in_force["secondary"], in_force["indirect"]} & self.others)


# Where the core's name is another one.
CORE_NAMES = {"cache_reservoirs": "cache_merged"}

ON = dict.fromkeys(("RESTIR", "RESTIR_CACHE"), True)
OFF = dict.fromkeys(("RESTIR", "RESTIR_CACHE"), False)
CELL_SHARED = frozenset({"CELL_SHARED"})
SCREEN_REUSE = frozenset({"SCREEN_REUSE"})
PATH_REUSE = frozenset({"SCREEN_REUSE", "WORLD_REUSE"})
CELL_REUSE = frozenset({"RESTIR_CACHE", "CELL_RESERVOIRS", "WORLD_REUSE"})  # work with cells of the scene

PARAMETERS = (
    Parameter("light_samples", {"NEE": 1}),
    Parameter("use_caustic_guide", {"NEE": False, "LEARNED": False}),
    Parameter("light_candidates", {"RIS": 8, "RESTIR": 32, "RESTIR_CACHE": 8}),
    Parameter("use_temporal_reuse", ON, PATH_REUSE | CELL_SHARED | {"CELL_RESERVOIRS"}),
    Parameter("confidence_cap", {"RESTIR": 20, "RESTIR_CACHE": 10}),
    Parameter("use_spatial_reuse", ON),
    Parameter("spatial_neighbours", {"RESTIR": 5, "RESTIR_CACHE": 8}),
    Parameter("spatial_radius", {"RESTIR": 30.0, "RESTIR_CACHE": 5.0}),
    Parameter("spatial_rounds", {"RESTIR": 1, "RESTIR_CACHE": 1}),
    Parameter("use_visibility_reuse", OFF),
    Parameter("use_path_spatial_reuse", {}, PATH_REUSE),
    Parameter("path_target", {}, PATH_REUSE, "REFLECTED"),
    Parameter("path_source", {}, SCREEN_REUSE, "BSDF"),
    Parameter("path_multi_bounce", {}, SCREEN_REUSE, 1),
    Parameter("path_validation", {}, SCREEN_REUSE),
    Parameter("use_first_frame_history", {}, CELL_SHARED),
    Parameter("share_visible", {}, CELL_SHARED, 64),
    Parameter("share_deep", {}, CELL_SHARED, 256),
    Parameter("use_share_for_denoiser", {}, CELL_SHARED, False),
    Parameter("use_share_trial", {}, CELL_SHARED, True),
    Parameter("cache_reservoirs", {"RESTIR_CACHE": 4}),
    Parameter("cache_candidates", {"RESTIR_CACHE": 1024}),
    Parameter("cache_refresh", {"RESTIR_CACHE": 32}),
)
# Of every answer: passes and views show cells whether or not reuse works with them.
CELL_PARAMETERS = (
    Parameter("cell_pixels", {}),
    Parameter("min_cell_size", {}),
    Parameter("use_normal_cells", {}),
)
SETTINGS = (*TECHNIQUES, *(parameter.name for parameter in PARAMETERS))

PRESET_ITEMS = (
    (
        "FINAL",
        "Final",
        "Samples that average to the true picture; light paths are shared in the cells of the scene, and bounces "
        "guided, where that pays",
    ),
    (
        "INTERACTIVE",
        "Interactive",
        "Final, where the first sample of each view also takes up light paths of the views before",
    ),
    ("PATH_TRACING", "Path Tracing", "Each pixel by itself, as the reference that all else is measured against"),
    ("RIS", "RIS [Talbot 2005]", "Resampled importance sampling: the best of 8 light samples, nothing is reused"),
    ("RESTIR_DI", "ReSTIR DI [Bitterli 2020]", "Reuse between pixels and samples, with the unbiased weights"),
    (
        "RESTIR_DI_FAST",
        "ReSTIR DI, Biased [Bitterli 2020]",
        "Reuse between pixels and samples, with the cheap weights, visibility reuse and two rounds of neighbours",
    ),
    ("CELL_CACHE", "Cell Cache [Stefanescu 2025]", "ReSTIR with a cell cache of light samples, as published: biased"),
    ("CELL_CACHE_UNBIASED", "Cell Cache, Unbiased", "ReSTIR with a cell cache of light samples, with unbiased weights"),
    (
        "CELL_RESERVOIRS",
        "Cell Reservoirs [Boissé 2021]",
        "Light samples shared in the cells of the scene at all points after the visible one, with unbiased weights",
    ),
    ("RESTIR_GI", "ReSTIR GI [Ouyang 2021]", "Light paths reused between pixels and samples, with unbiased weights"),
    (
        "RESTIR_GI_FAST",
        "ReSTIR GI, Biased [Ouyang 2021]",
        "As published: the cheap weights, directions drawn evenly, a quarter of the tiles with more than one bounce",
    ),
    (
        "WORLD_PATHS",
        "World-Space Paths [Zhang 2023]",
        "Light paths reused between samples and in the cells of the scene, with unbiased weights",
    ),
    ("CUSTOM", "Custom", "The techniques chosen below"),
)

_PATHS = {
    "direct": "NEE",
    "secondary": "NEE",
    "indirect": "PATH",
    "guiding": "OFF",
    "bias": "UNBIASED",
    "light_sampler": "TREE",
    "use_temporal_reuse": False,  # or the samples would not be independent
}
_OURS = {"indirect": "CELL_SHARED", "light_samples": 2, "use_caustic_guide": True}
_FINAL = _PATHS | _OURS | {"guiding": "AUTO"}
_HISTORY = _PATHS | {"use_temporal_reuse": True}
_INTERACTIVE = _HISTORY | _OURS | {"use_first_frame_history": True}
_REUSING = _HISTORY | {"light_sampler": "POWER"}

# What each preset chooses; what it does not name keeps its default.
PRESETS: dict[str, dict[str, Value]] = {
    "FINAL": _FINAL,
    "INTERACTIVE": _INTERACTIVE,
    "PATH_TRACING": _PATHS,
    "RIS": _PATHS | {"direct": "RIS", "light_sampler": "POWER"},
    "RESTIR_DI": _REUSING | {"direct": "RESTIR"},
    "RESTIR_DI_FAST": _REUSING | {"direct": "RESTIR", "bias": "FAST", "use_visibility_reuse": True},
    "CELL_CACHE": _REUSING
    | {"direct": "RESTIR_CACHE", "bias": "FAST", "light_sampler": "UNIFORM", "use_visibility_reuse": True},
    "CELL_CACHE_UNBIASED": _REUSING | {"direct": "RESTIR_CACHE"},
    "CELL_RESERVOIRS": _HISTORY | {"secondary": "CELL_RESERVOIRS"},
    "RESTIR_GI": _HISTORY | {"indirect": "SCREEN_REUSE"},
    "RESTIR_GI_FAST": _HISTORY
    | {
        "indirect": "SCREEN_REUSE",
        "bias": "FAST",
        "path_source": "UNIFORM",
        "path_multi_bounce": 0.25,
        "path_validation": 6,
    },
    "WORLD_PATHS": _HISTORY | {"indirect": "WORLD_REUSE"},
}

VIEWPORT_PRESET_ITEMS = (
    ("RENDER", "As Final Render", "The techniques of the final render"),
    *(item for item in PRESET_ITEMS if item[0] != "CUSTOM"),
)


def settings_in_force(settings: "CisternSceneSettings") -> dict[str, Value]:
    """The techniques and parameters in force: what the preset says, except where one was set by hand."""
    preset = PRESETS.get(settings.preset, {})
    return {
        name: getattr(settings, name) if settings.is_property_set(name) else preset.get(name, getattr(settings, name))
        for name in SETTINGS
    }


def viewport_settings_in_force(settings: "CisternSceneSettings") -> dict[str, Value]:
    """The same for 3D viewports: those of the final render, or a preset's alone."""
    if settings.viewport_preset == "RENDER":
        return settings_in_force(settings)
    preset = PRESETS[settings.viewport_preset]
    defaults = {name: settings.bl_rna.properties[name].default for name in SETTINGS}
    return defaults | preset


def choose_preset(settings: "CisternSceneSettings", preset: str) -> None:
    """Take over a preset whole; CUSTOM starts from the techniques and parameters in force."""
    in_force = settings_in_force(settings)
    settings.preset = preset
    for name in SETTINGS:
        if preset == "CUSTOM":
            setattr(settings, name, in_force[name])
        else:
            settings.property_unset(name)


def is_changed(settings: "CisternSceneSettings") -> bool:
    """Whether anything that a preset decides was set by hand besides."""
    return settings.preset != "CUSTOM" and any(settings.is_property_set(name) for name in SETTINGS)


def effective_value(parameter: Parameter, in_force: dict[str, Value]) -> Value:
    """What the core will use: the number in force, or for 0 the default of the system that is."""
    value = in_force[parameter.name]
    if parameter.is_switch or value:
        return value
    if parameter.name == "spatial_rounds" and in_force["direct"] == "RESTIR" and in_force["bias"] == "FAST":
        return 2
    return parameter.defaults.get(str(in_force["direct"]), parameter.default)


def used_parameters(in_force: dict[str, Value]) -> list[Parameter]:
    """Those that the answers in force look at."""
    return [parameter for parameter in PARAMETERS if parameter.is_used(in_force)]


def works_with_cells(in_force: dict[str, Value]) -> bool:
    """Whether any answer in force reuses light by the cells of the scene."""
    return not CELL_REUSE.isdisjoint(in_force[name] for name in REFERENCE)


def may_find_openings(in_force: dict[str, Value]) -> bool:
    """Whether light samples are weighed against the BSDF's everywhere, so that they may leave some light to those."""
    return all(in_force[name] in ("NEE", "LEARNED") for name in ("direct", "secondary"))


def may_seek_through_panes(in_force: dict[str, Value]) -> bool:
    """Whether no reservoirs take part, which know light samples by straight lines alone."""
    return may_find_openings(in_force) and in_force["indirect"] in ("PATH", "CELL_SHARED")


def is_reference(in_force: dict[str, Value]) -> bool:
    """Whether nothing is reused, so that there is nothing to be biased."""
    return all(in_force[name] in (answer, "LEARNED") for name, answer in REFERENCE.items())
