"""Lines of Freestyle, whose strokes the engine itself renders: without a display, too."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import prepare, render

pytestmark = pytest.mark.usefixtures("registered_addon")


@pytest.mark.skipif(not bpy.app.build_options.freestyle, reason="this Blender has no Freestyle")
def test_strokes_are_as_with_cycles(empty_scene: bpy.types.Scene) -> None:
    build.stage(empty_scene, build.principled("ball", Base_Color=(0.8, 0.1, 0.1, 1.0)))
    prepare(empty_scene, 64, 64)
    empty_scene.render.use_freestyle = empty_scene.view_layers[0].use_freestyle = True
    style = bpy.data.linestyles.new("green")
    style.thickness, style.color = 4.0, (0.0, 1.0, 0.0)
    empty_scene.view_layers[0].freestyle_settings.linesets[0].linestyle = style
    green = {}
    for engine in ("CYCLES", "CISTERN"):
        pixels = render(empty_scene, engine, 8, 1)
        green[engine] = (pixels[..., 1] > 0.9) & (pixels[..., 0] < 0.3)
    assert green["CYCLES"].sum() > 100
    assert (green["CISTERN"] != green["CYCLES"]).mean() < 0.02
