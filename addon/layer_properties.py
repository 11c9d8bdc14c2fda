"""Blender's properties of a view layer: which passes of ours it keeps, `view_layer.cistern`."""

from typing import Any

import bpy
from bpy.props import BoolProperty


def show_passes(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """Give the nodes of the scene's compositor their sockets, as Blender's own switches do."""
    for layer in settings.id_data.view_layers:
        layer.update_render_passes()


# In the bpy module of Blender 4.2 one callback is enough to crash Python as it exits; a script has to ask for sockets.
CALLBACKS = {"update": show_passes} if bpy.app.binary_path else {}


def pass_switch(name: str, description: str, default: bool = False) -> Any:  # noqa: ANN401  (deferred by Blender)
    return BoolProperty(name=name, description=description, default=default, **CALLBACKS)


class CisternViewLayerSettings(bpy.types.PropertyGroup):
    """`view_layer.cistern`"""

    use_pass_direct: pass_switch(
        name="Direct",
        description="Light that reaches the visible point straight from a light, in scene-linear radiance",
        default=True,
    )
    use_pass_indirect: pass_switch(
        name="Indirect",
        description="Light that reaches the visible point by way of other surfaces, in scene-linear radiance",
        default=True,
    )
    use_pass_shadow_catcher: pass_switch(
        name="Shadow Catcher",
        description=(
            "Share of light that other objects leave to shadow catchers, to multiply footage by; 1 where there is no "
            "shadow. Combined then shows neither catchers nor shadows"
        ),
    )
    use_pass_volume_direct: pass_switch(
        name="Volume Direct",
        description="Light that a volume scattered and nothing else, in scene-linear radiance",
    )
    use_pass_volume_indirect: pass_switch(
        name="Volume Indirect",
        description="Light that a volume scattered last, after something else had, in scene-linear radiance",
    )
    use_pass_noisy: pass_switch(
        name="Noisy Image",
        description="Combined as it was before it was denoised",
    )
    use_pass_cells: pass_switch(
        name="Cells",
        description=(
            "A colour for each cell of reuse, each channel 0.1 to 1, black where there is none; from the first sample"
        ),
    )
    use_pass_cell_occupancy: pass_switch(
        name="Cell Occupancy",
        description="Number of pixels whose visible point lies in the same cell; from the first sample",
    )
    use_pass_cell_level: pass_switch(
        name="Cell Level",
        description=(
            "1 for the smallest cells, 1 more each time they are doubled, 0 where there is none; from the first sample"
        ),
    )
    use_pass_normal_bin: pass_switch(
        name="Normal Bin",
        description=(
            "A colour for each direction that cells are divided by, each channel 0.1 to 1, black where there is none; "
            "from the first sample"
        ),
    )
    use_pass_reservoir_confidence: pass_switch(
        name="Reservoir Confidence",
        description=(
            "How many batches of light candidates the pixel's choice stands for: 1 without reuse, 0 where there is "
            "none; from the last sample"
        ),
    )
    use_pass_reservoir_weight: pass_switch(
        name="Reservoir Weight",
        description=(
            "Weight of the pixel's light sample: about the reciprocal of the probability it was chosen with, 0 where "
            "there is none; from the last sample"
        ),
    )
    use_pass_reuse_count: pass_switch(
        name="Reuse Count",
        description=(
            "How many samples of other points, or of the sample before, the pixel was handed for its light: 0 without "
            "reuse; from the last sample"
        ),
    )
    use_pass_sample_count: pass_switch(
        name="Sample Count",
        description="Samples of each pixel, of which adaptive sampling gives fewer to those without much noise",
    )
    use_pass_light_choice_entropy: pass_switch(
        name="Light Choice Entropy",
        description=(
            "How evenly lights share in what reaches the cell of the visible point, in nats: e to this power is how "
            "many matter. 0 where nothing was learned; after the last sample"
        ),
    )
    use_pass_light_choice_samples: pass_switch(
        name="Light Choice Samples",
        description=(
            "Effective number of light samples that the choice of lights is learned from in the cell of the visible "
            "point: 0 where nothing was learned; after the last sample"
        ),
    )
    use_pass_guided: pass_switch(
        name="Guided",
        description="1 where bounces from the visible point are guided, else 0; after the last sample",
    )
    use_pass_denoising_albedo: pass_switch(
        name="Denoising Albedo",
        description="Share of light (0 to 1) that the visible surface reflects, for denoisers",
    )
    use_pass_denoising_normal: pass_switch(
        name="Denoising Normal",
        description="Unit shading normal of the visible surface, for denoisers",
    )
