"""Scenes made by others against Cycles, from the folder CISTERN_TEST_SCENES; see test_against_cycles_lights."""

import os
from pathlib import Path

import bpy
import pytest

from tests.support.engines import compare_with_cycles

FOLDER = os.environ.get("CISTERN_TEST_SCENES", "")
SCENES = ["cbox", "veach_mi", "matpreview", "sponza", "veach_ajar", "tp_engineer_bedroom"]

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(not FOLDER, reason="CISTERN_TEST_SCENES is not set"),
    pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="the scenes are files of Blender 5.0"),
]


def load(name: str) -> bpy.types.Scene:
    bpy.ops.wm.open_mainfile(filepath=str(Path(FOLDER) / f"{name}.blend"))
    return bpy.context.scene


@pytest.mark.parametrize("name", SCENES)
def test_scene(name: str) -> None:
    scene = load(name)
    aspect = scene.render.resolution_y / scene.render.resolution_x
    result = compare_with_cycles(scene, size=(80, round(80 * aspect)), samples=64)
    assert result.agrees, result


def test_planted_bug() -> None:
    """Cycles' Cornell box has walls 2 % brighter."""

    def plant(_scene: bpy.types.Scene) -> None:
        for surface in bpy.data.materials:
            for node in surface.node_tree.nodes:
                if node.type == "BSDF_PRINCIPLED":
                    color = node.inputs["Base Color"].default_value
                    node.inputs["Base Color"].default_value = [c * 1.02 for c in color]

    assert not compare_with_cycles(load("cbox"), size=(80, 80), samples=64, plant=plant).agrees
