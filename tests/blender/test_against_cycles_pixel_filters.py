"""Pixel filters against Cycles, pixel by pixel: how thin lines and edges are smoothed."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support import engines

pytestmark = pytest.mark.usefixtures("registered_addon")

SIDE = 16


@pytest.fixture
def lines(empty_scene) -> bpy.types.Scene:
    """Shining strips, a third of a pixel wide and wider, across the pixels."""
    glow = build.material("glow", lambda tree: build.shader(tree, "ShaderNodeEmission").outputs[0])
    for x, width in ((-3.0, 0.3), (2.0, 3.0)):
        points = [(x, -9, 0), (x + width, -9, 0), (x + width + 2.0, 9, 0), (x + 2.0, 9, 0)]
        build.add_mesh(empty_scene, "strip", points, [(0, 1, 2, 3)], glow)
    camera = build.add_camera(empty_scene, (0.0, 0.0, 5.0), (0.0, 0.0, 0.0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", float(SIDE)
    empty_scene.render.film_transparent = True
    return empty_scene


def agrees(scene: bpy.types.Scene, monkeypatch, kind: str, width: float, ours: float) -> bool:
    monkeypatch.setitem(engines.CYCLES, "pixel_filter_type", kind)
    monkeypatch.setitem(engines.CYCLES, "filter_width", width)
    monkeypatch.setitem(engines.CISTERN, "pixel_filter", kind)
    monkeypatch.setitem(engines.CISTERN, "filter_width", ours)
    return engines.compare_with_cycles(scene, (SIDE, SIDE), 256, blocks=SIDE).agrees


@pytest.mark.parametrize(
    ("kind", "width"),
    [("BLACKMAN_HARRIS", 1.5), ("BLACKMAN_HARRIS", 0.8), ("BLACKMAN_HARRIS", 10.0), ("GAUSSIAN", 1.5), ("BOX", 1.5)],
)
def test_pixels_are_as_wide(lines, monkeypatch, kind, width):
    assert agrees(lines, monkeypatch, kind, width, width)


def test_a_filter_half_as_wide_is_seen(lines, monkeypatch):
    assert not agrees(lines, monkeypatch, "BLACKMAN_HARRIS", 1.5, 0.75)
    assert not agrees(lines, monkeypatch, "GAUSSIAN", 1.5, 0.5)
