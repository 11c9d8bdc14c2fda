"""Scenes made by others against Cycles, from the folder CISTERN_TEST_SCENES; see test_against_cycles_lights.

By the Final preset: what a user gets who chooses nothing. Each comparison raises a false alarm with probability
0.01. What it can see is stated too: the standard error of the ratio of both pictures' means must be below the scene's
`precision`, or the test has too few samples to say anything.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import bmesh
import bpy
import pytest

from tests.support.engines import compare_with_cycles
from tests.support.slow_cases import marked

FOLDER = os.environ.get("CISTERN_TEST_SCENES", "")


@dataclass(frozen=True)
class Budget:
    """Samples per pixel of each of six replicas, blocks per side, and the largest standard error accepted."""

    samples: int = 64
    blocks: int = 4
    precision: float = 0.005


SCENES = {
    "cbox": Budget(),
    "veach_mi": Budget(),
    "matpreview": Budget(),
    "sponza": Budget(),
    # Light through a slit and off metal comes in rare bright samples: t-tests need many of them in each value.
    "veach_ajar": Budget(samples=192, blocks=2, precision=0.02),
    "tp_engineer_bedroom": Budget(),
}

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(not FOLDER, reason="CISTERN_TEST_SCENES is not set"),
    pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="the scenes are files of Blender 5.0"),
]


def load(name: str) -> bpy.types.Scene:
    bpy.ops.wm.open_mainfile(filepath=str(Path(FOLDER) / f"{name}.blend"))
    remove_coincident_faces()
    return bpy.context.scene


def remove_coincident_faces() -> None:
    """Faces that lie twice in one mesh. In Cycles such twins shadow each other at random; Cistern lights them fully."""
    for mesh in bpy.data.meshes:
        edited = bmesh.new()
        edited.from_mesh(mesh)
        seen: set[frozenset] = set()
        twins = []
        for face in edited.faces:
            corners = frozenset(vertex.co.to_tuple(5) for vertex in face.verts)
            (twins.append(face) if corners in seen else seen.add(corners))
        if twins:
            bmesh.ops.delete(edited, geom=twins, context="FACES")
            edited.to_mesh(mesh)
        edited.free()


@pytest.mark.parametrize("name", marked(SCENES, {"matpreview", "sponza", "veach_ajar", "tp_engineer_bedroom"}))
def test_scene(name: str) -> None:
    scene, budget = load(name), SCENES[name]
    aspect = scene.render.resolution_y / scene.render.resolution_x
    size = (80, round(80 * aspect))
    result = compare_with_cycles(scene, size, budget.samples, blocks=budget.blocks, preset="FINAL")
    assert result.agrees, result
    assert result.ratio_error < budget.precision, result


def test_planted_bug() -> None:
    """Cycles' Cornell box has walls 2 % brighter."""

    def plant(_scene: bpy.types.Scene) -> None:
        for surface in bpy.data.materials:
            for node in surface.node_tree.nodes:
                if node.type == "BSDF_PRINCIPLED":
                    color = node.inputs["Base Color"].default_value
                    node.inputs["Base Color"].default_value = [c * 1.02 for c in color]

    assert not compare_with_cycles(load("cbox"), size=(80, 80), samples=64, plant=plant).agrees
