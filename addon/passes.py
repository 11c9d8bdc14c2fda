"""The render passes: one table of Blender's name, channels and switch, and the core's name for the same picture."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from .denoise import NOISY_PASS
from .shadow_catchers import SHADOW_PASS
from .sync import MATTE_KINDS
from .sync.light_groups import group_numbers

# Since 5.0 Blender spells these passes out.
HAS_LONG_NAMES = bpy.app.version >= (5, 0, 0)

MOST_MATTES = 16


@dataclass(frozen=True)
class RenderPass:
    name: str  # as Blender of this version calls it, in the compositor and in files
    core_name: str
    channel_ids: str
    kind: str  # COLOR, VECTOR or VALUE
    is_enabled: Callable[[bpy.types.ViewLayer], bool]

    @property
    def channels(self) -> int:
        return len(self.channel_ids)


PASSES = (
    RenderPass("Combined", "Combined", "RGBA", "COLOR", lambda layer: True),
    RenderPass("Depth", "Depth", "Z", "VALUE", lambda layer: layer.use_pass_z),
    RenderPass("Position", "Position", "XYZ", "VECTOR", lambda layer: layer.use_pass_position),
    RenderPass("Normal", "Normal", "XYZ", "VECTOR", lambda layer: layer.use_pass_normal),
    RenderPass("Mist", "Mist", "Z", "VALUE", lambda layer: layer.use_pass_mist),
    RenderPass("Vector", "Vector", "XYZW", "VECTOR", lambda layer: layer.use_pass_vector),
    RenderPass("UV", "UV", "UVA", "VECTOR", lambda layer: layer.use_pass_uv),
    RenderPass(
        "Ambient Occlusion" if HAS_LONG_NAMES else "AO",
        "Ambient Occlusion",
        "RGB",
        "COLOR",
        lambda layer: layer.use_pass_ambient_occlusion,
    ),
    RenderPass(
        "Object Index" if HAS_LONG_NAMES else "IndexOB",
        "Object Index",
        "X",
        "VALUE",
        lambda layer: layer.use_pass_object_index,
    ),
    RenderPass(
        "Material Index" if HAS_LONG_NAMES else "IndexMA",
        "Material Index",
        "X",
        "VALUE",
        lambda layer: layer.use_pass_material_index,
    ),
    RenderPass("Direct", "Direct", "RGB", "COLOR", lambda layer: layer.cistern.use_pass_direct),
    RenderPass("Indirect", "Indirect", "RGB", "COLOR", lambda layer: layer.cistern.use_pass_indirect),
    RenderPass("Emission" if HAS_LONG_NAMES else "Emit", "Emission", "RGB", "COLOR", lambda layer: layer.use_pass_emit),
    RenderPass(
        "Environment" if HAS_LONG_NAMES else "Env",
        "Environment",
        "RGB",
        "COLOR",
        lambda layer: layer.use_pass_environment,
    ),
    RenderPass(SHADOW_PASS, SHADOW_PASS, "RGB", "COLOR", lambda layer: layer.cistern.use_pass_shadow_catcher),
    RenderPass(NOISY_PASS, NOISY_PASS, "RGBA", "COLOR", lambda layer: layer.cistern.use_pass_noisy),
    RenderPass("Cells", "Cells", "RGB", "COLOR", lambda layer: layer.cistern.use_pass_cells),
    RenderPass("Cell Occupancy", "Cell Occupancy", "X", "VALUE", lambda layer: layer.cistern.use_pass_cell_occupancy),
    RenderPass("Cell Level", "Cell Level", "X", "VALUE", lambda layer: layer.cistern.use_pass_cell_level),
    RenderPass("Normal Bin", "Normal Bin", "RGB", "COLOR", lambda layer: layer.cistern.use_pass_normal_bin),
    RenderPass(
        "Reservoir Confidence",
        "Reservoir Confidence",
        "X",
        "VALUE",
        lambda layer: layer.cistern.use_pass_reservoir_confidence,
    ),
    RenderPass(
        "Reservoir Weight", "Reservoir Weight", "X", "VALUE", lambda layer: layer.cistern.use_pass_reservoir_weight
    ),
    RenderPass("Reuse Count", "Reuse Count", "X", "VALUE", lambda layer: layer.cistern.use_pass_reuse_count),
    RenderPass(
        "Light Choice Entropy",
        "Light Choice Entropy",
        "X",
        "VALUE",
        lambda layer: layer.cistern.use_pass_light_choice_entropy,
    ),
    RenderPass(
        "Light Choice Samples",
        "Light Choice Samples",
        "X",
        "VALUE",
        lambda layer: layer.cistern.use_pass_light_choice_samples,
    ),
    RenderPass("Sample Count", "Sample Count", "X", "VALUE", lambda layer: layer.cistern.use_pass_sample_count),
    RenderPass("Guided", "Guided", "X", "VALUE", lambda layer: layer.cistern.use_pass_guided),
    RenderPass(
        "Denoising Normal",
        "Denoising Normal",
        "XYZ",
        "VECTOR",
        lambda layer: layer.cistern.use_pass_denoising_normal,
    ),
    RenderPass(
        "Denoising Albedo",
        "Denoising Albedo",
        "RGB",
        "COLOR",
        lambda layer: layer.cistern.use_pass_denoising_albedo,
    ),
)


def kind_pass(kind: str, part: str) -> RenderPass:
    """Light by the kind of its first scattering, as Cycles has it; switches of volumes are each engine's own."""
    short_kinds = {"Diffuse": "Diff", "Glossy": "Gloss", "Transmission": "Trans", "Volume": "Volume"}
    short_parts = {"Direct": "Dir", "Indirect": "Ind", "Color": "Col"}
    switch = f"use_pass_{kind.lower()}_{part.lower()}"
    return RenderPass(
        f"{kind} {part}" if HAS_LONG_NAMES else short_kinds[kind] + short_parts[part],
        f"{kind} {part}",
        "RGB",
        "COLOR",
        lambda layer: getattr(layer.cistern if kind == "Volume" else layer, switch),
    )


# Light / Color of kinds of surfaces, and light of volumes; with Emission and Environment they add up to Combined.
KIND_PASSES = (
    *(
        kind_pass(kind, part)
        for kind in ("Diffuse", "Glossy", "Transmission")
        for part in ("Direct", "Indirect", "Color")
    ),
    kind_pass("Volume", "Direct"),
    kind_pass("Volume", "Indirect"),
)
# What Emission and Environment hold beside these, by the core's names: what is seen straight alone. In mirrors it is
# glossy light.
BESIDE_KINDS = {"Emission": "Unscattered Emission", "Environment": "Unscattered Environment"}

MOST_NAME_BYTES = 63

# Those that show cells, by the core's names.
CELL_PASSES = frozenset({"Cells", "Cell Occupancy", "Cell Level", "Normal Bin"})


def enabled_passes(view_layer: bpy.types.ViewLayer) -> list[RenderPass]:
    """The passes that this view layer asks for, Combined first, without AOVs whose name another one has."""
    fixed = [render_pass for render_pass in PASSES if render_pass.is_enabled(view_layer)]
    kinds = [render_pass for render_pass in KIND_PASSES if render_pass.is_enabled(view_layer)]
    if kinds:
        fixed = [replace(p, core_name=BESIDE_KINDS.get(p.core_name, p.core_name)) for p in fixed]
    mattes, groups = matte_passes(view_layer), light_group_passes(view_layer)
    taken = {render_pass.name for render_pass in fixed + kinds + mattes + groups}
    aovs = [render_pass for render_pass in aov_passes(view_layer) if render_pass.name not in taken]
    return fixed + kinds + mattes + aovs + groups


def matte_kinds(view_layer: bpy.types.ViewLayer) -> list[str]:
    """Of MATTE_KINDS, those that the view layer keeps mattes of."""
    return [kind for kind in MATTE_KINDS if getattr(view_layer, f"use_pass_cryptomatte_{kind}")]


def matte_layer_name(kind: str) -> str:
    return f"Crypto{kind.title()}"


def matte_passes(view_layer: bpy.types.ViewLayer) -> list[RenderPass]:
    """Cryptomatte's: two ids with their coverage in each. Small letters keep their compression lossless."""
    levels = (min(view_layer.pass_cryptomatte_depth, MOST_MATTES) + 1) // 2
    names = [f"{matte_layer_name(kind)}{level:02}" for kind in matte_kinds(view_layer) for level in range(levels)]
    return [RenderPass(name, name, "rgba", "COLOR", lambda layer: True) for name in names]


def aov_core_name(aov: bpy.types.AOV) -> str:
    return f"AOV {aov.type} {aov.name}"


def aov_passes(view_layer: bpy.types.ViewLayer) -> list[RenderPass]:
    """What materials write themselves, under the user's names. Blender marks names that conflict only when it next asks
    for the passes of an engine, so these may be among them."""
    return [
        RenderPass(aov.name, aov_core_name(aov), "X" if aov.type == "VALUE" else "RGBA", aov.type, lambda layer: True)
        for aov in view_layer.aovs
        if aov.is_valid
    ]


def aovs_left_out(view_layer: bpy.types.ViewLayer) -> list[str]:
    """Names of AOVs that other passes have."""
    kept = {render_pass.core_name for render_pass in enabled_passes(view_layer)}
    return [aov.name for aov in view_layer.aovs if aov_core_name(aov) not in kept]


def cut_name(name: str) -> str:
    """That of a pass as Blender keeps it: 63 bytes, in whole characters."""
    return name.encode()[:MOST_NAME_BYTES].decode(errors="ignore")


def light_group_passes(view_layer: bpy.types.ViewLayer) -> list[RenderPass]:
    """What emitters of each group bring to Combined, by Cycles' names as Blender cuts them."""
    return [
        RenderPass(cut_name(f"Combined_{name}"), f"Light Group {number}", "RGB", "COLOR", lambda layer: True)
        for name, number in group_numbers(view_layer).items()
    ]


def register_passes(engine: bpy.types.RenderEngine, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
    """Announce the passes, so that they appear as sockets in the compositor and as layers in files.

    AOVs that are left out come last: Blender keeps the first of a name, and marks an AOV whose name it hears twice."""
    enabled = enabled_passes(view_layer)
    kept = {render_pass.core_name for render_pass in enabled}
    for render_pass in enabled + [aov for aov in aov_passes(view_layer) if aov.core_name not in kept]:
        engine.register_pass(
            scene,
            view_layer,
            render_pass.name,
            render_pass.channels,
            render_pass.channel_ids,
            render_pass.kind,
        )


def flat_pixels(render_pass: RenderPass, pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Flat pixels for Blender, from the core's (height, width, channels).

    Raises ValueError when the core's picture has another number of channels."""
    if pixels.shape[2] != render_pass.channels:
        raise ValueError(
            f"Pass {render_pass.name}: the core gave {pixels.shape[2]} channels, {render_pass.channels} are needed"
        )
    return pixels.ravel()


def write_passes(
    layer: bpy.types.RenderLayer,
    view: str,
    render_passes: list[RenderPass],
    read: Callable[[str], NDArray[np.float32]],
) -> None:
    """Fill the passes of a render result's layer; `read` gives the core's picture by the core's name."""
    for render_pass in render_passes:
        target = layer.passes.find_by_name(render_pass.name, view)
        if target is not None:
            target.rect.foreach_set(flat_pixels(render_pass, read(render_pass.core_name)))
