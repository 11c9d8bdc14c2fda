"""Blender is quit in the middle of a viewport's picture: it must end by itself, without a crash."""

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver


def scenario() -> Iterator[float]:
    bpy.context.scene.render.engine = "CISTERN"
    bpy.context.scene.cistern.viewport_samples = 100_000
    driver.shade("RENDERED")
    yield from driver.wait_for_picture(0, "first picture")
    yield 0.3


driver.start(scenario)
