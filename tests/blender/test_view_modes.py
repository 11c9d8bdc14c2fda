"""What the picture shows: the render, a part of its light, cells, or numbers through the colour scale."""

import numpy as np
import pytest

from addon import settings, view_modes
from tests.blender.engine_fakes import CONSTANTS, fresh_scene, install, render

pytestmark = pytest.mark.usefixtures("registered_addon")


@pytest.fixture
def core(monkeypatch):
    return install(monkeypatch)


def combined(channels):
    return np.stack([channels[f"ViewLayer.Combined.{channel}"] for channel in "RGBA"], axis=2)


@pytest.mark.parametrize("view", ["DIRECT", "INDIRECT", "CELLS", "NORMAL_BIN"])
def test_colours_are_shown_as_they_are_and_passes_keep_their_own(core, tmp_path, view):
    scene = fresh_scene()
    scene.cistern.view = view
    channels, _ = render(scene, tmp_path)
    source = view_modes.SOURCES[view][0]
    np.testing.assert_array_equal(combined(channels), np.broadcast_to((*CONSTANTS[source], 1.0), (6, 8, 4)))
    assert channels["ViewLayer.Direct.R"][0, 0] == CONSTANTS["Direct"][0]
    assert core.settings[-1].passes == ["Direct", "Indirect"] + ([source] if view in {"CELLS", "NORMAL_BIN"} else [])


def test_what_viewports_show_is_not_what_final_renders_show(core, tmp_path):
    scene = fresh_scene()
    scene.cistern.viewport_view = "CELLS"
    channels, _ = render(scene, tmp_path)
    assert core.settings[-1].passes == ["Direct", "Indirect"]
    assert channels["ViewLayer.Combined.R"][0].tolist() == list(range(8))  # columns, the stand-in's own picture


@pytest.mark.parametrize(
    "view",
    [
        "CELL_OCCUPANCY",
        "CELL_LEVEL",
        "RESERVOIR_CONFIDENCE",
        "RESERVOIR_WEIGHT",
        "REUSE_COUNT",
        "SAMPLE_COUNT",
        "LIGHT_CHOICE_ENTROPY",
        "LIGHT_CHOICE_SAMPLES",
        "GUIDED",
    ],
)
def test_numbers_go_through_the_scale(core, tmp_path, view):
    """The stand-in's numbers lie in the middle of their scales, at green."""
    scene = fresh_scene()
    scene.cistern.view = view
    scene.view_layers[0].cistern.use_pass_direct = scene.view_layers[0].cistern.use_pass_indirect = False
    channels, _ = render(scene, tmp_path)
    np.testing.assert_allclose(combined(channels), np.broadcast_to((*view_modes.RAMP[2], 1.0), (6, 8, 4)), rtol=1e-5)
    assert core.settings[-1].passes == [view_modes.SOURCES[view][0]]


def test_scale_is_logarithmic_with_black_for_nothing():
    scale = view_modes.LogScale(1.0, 256.0)
    numbers = np.float32([[0.0, np.nan, np.inf, -1.0, 0.5, 1.0, 4.0, 16.0, 64.0, 256.0, 1e9]])[..., None]
    colors = view_modes.ramp_colors(numbers, scale)[0]
    np.testing.assert_array_equal(colors[:4], 0.0)
    np.testing.assert_allclose(colors[4:], view_modes.RAMP[[0, 0, 1, 2, 3, 4, 4]], rtol=1e-5, atol=1e-6)
    assert colors.dtype == np.float32


def test_each_step_of_the_scale_is_brighter():
    luminance = view_modes.RAMP @ (0.2126, 0.7152, 0.0722)
    assert np.all(np.diff(luminance) > 0.02)


def test_every_view_but_the_render_has_a_source_and_a_sentence():
    identifiers = {identifier for identifier, _, _ in view_modes.VIEW_ITEMS}
    assert identifiers == set(view_modes.SOURCES) | {"COMBINED"}


def test_icons_show_the_render():
    scene = fresh_scene()
    scene.cistern.view = "CELLS"
    assert settings.view_mode(scene, is_preview=True) == "COMBINED"
    assert settings.view_mode(scene, is_preview=False) == "CELLS"
