"""The numbers by which .blend files keep choices: an item that comes later must not change what files mean."""

import bpy
import pytest

pytestmark = pytest.mark.usefixtures("registered_addon")

VIEWS = (
    "COMBINED DIRECT INDIRECT CELLS CELL_OCCUPANCY CELL_LEVEL NORMAL_BIN RESERVOIR_CONFIDENCE RESERVOIR_WEIGHT "
    "REUSE_COUNT LIGHT_CHOICE_ENTROPY LIGHT_CHOICE_SAMPLES SAMPLE_COUNT GUIDED"
)
PRESETS = (
    "FINAL INTERACTIVE PATH_TRACING RIS RESTIR_DI RESTIR_DI_FAST CELL_CACHE CELL_CACHE_UNBIASED CELL_RESERVOIRS "
    "RESTIR_GI RESTIR_GI_FAST WORLD_PATHS"
)
# By number, from 0 on. New items go at the end, or name their number in the list of items.
STORED = {
    "preset": f"{PRESETS} CUSTOM",
    "viewport_preset": f"RENDER {PRESETS}",
    "view": VIEWS,
    "viewport_view": VIEWS,
    "direct": "NEE LEARNED RIS RESTIR RESTIR_CACHE",
    "secondary": "NEE LEARNED RIS CELL_RESERVOIRS",
    "indirect": "PATH SCREEN_REUSE WORLD_REUSE CELL_SHARED",
    "guiding": "OFF ON AUTO",
    "bias": "UNBIASED FAST",
    "light_sampler": "UNIFORM POWER TREE",
    "path_source": "BSDF COSINE UNIFORM",
    "path_target": "REFLECTED RADIANCE",
    "pixel_filter": "BOX GAUSSIAN BLACKMAN_HARRIS",
    "bake_type": "COMBINED AO POSITION NORMAL UV ROUGHNESS EMIT DIFFUSE GLOSSY TRANSMISSION",
}


def choices() -> dict[str, bpy.types.EnumProperty]:
    return {prop.identifier: prop for prop in bpy.context.scene.cistern.bl_rna.properties if prop.type == "ENUM"}


def test_all_choices_are_listed() -> None:
    assert choices().keys() == STORED.keys()


@pytest.mark.parametrize("name", STORED)
def test_numbers_stay(name: str) -> None:
    now = {item.value: item.identifier for item in choices()[name].enum_items}
    assert now.items() >= dict(enumerate(STORED[name].split())).items()
