"""The factory scene and what can be wrong with it, for tests of bad input."""

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np

import addon
from tests.blender.engine_fakes import render

Change = Callable[[bpy.types.Scene], object]
WIDTH, HEIGHT = 24, 16


def cube() -> bpy.types.Object:
    return bpy.data.objects["Cube"]


def lamp() -> bpy.types.Light:
    return bpy.data.objects["Light"].data


def tree() -> bpy.types.NodeTree:
    return cube().material_slots[0].material.node_tree


def surface() -> bpy.types.Node:
    return tree().nodes["Principled BSDF"]


def set_members(target: Callable[[bpy.types.Scene], object], **members: object) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        for name, value in members.items():
            setattr(target(scene), name, value)

    return change


def object_(**members: object) -> Change:
    return set_members(lambda scene: cube(), **members)


def light(kind: str = "POINT", **members: object) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        lamp().type = kind
        set_members(lambda _: lamp(), **members)(scene)

    return change


def camera(**members: object) -> Change:
    return set_members(lambda scene: scene.camera.data, **members)


def lens(**members: object) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        scene.camera.data.dof.use_dof = True
        set_members(lambda _: scene.camera.data.dof, **members)(scene)

    return change


def picture_of(scene: bpy.types.Scene, folder: Path) -> tuple[np.ndarray, addon.report.RenderReport]:
    """Combined RGB of a render that must succeed with finite pixels."""
    channels, [report] = render(scene, folder)
    assert report.error is None
    pixels = np.stack([channels[f"ViewLayer.Combined.{c}"] for c in "RGB"], -1)
    assert np.isfinite(pixels).all()
    return pixels, report
