"""Fifty times to rendered shading and back: memory must not grow beyond what the first ones take.

They fill the pools of allocators and drivers, in steps of 17 MB, which come and go; what leaks does not go."""

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver

TOGGLES = 50
FIRSTS = 10
LARGEST_GROWTH = 0.02


def scenario() -> Iterator[float]:
    scene = bpy.context.scene
    scene.render.engine = "CISTERN"
    scene.render.preview_pixel_size = "4"
    megabytes = []
    for toggle in range(TOGGLES):
        driver.shade("RENDERED")
        yield from driver.wait_for_picture(0, f"picture of toggle {toggle}")
        yield 0.2
        driver.shade("SOLID")
        yield from driver.wait_until(lambda: not driver.renders(), f"end of the thread of toggle {toggle}")
        yield 0.1
        megabytes.append(driver.resident_megabytes())
        driver.say("TOGGLE", toggle, f"{megabytes[-1]:.1f} MB")
    growth = min(megabytes[-FIRSTS:]) / min(megabytes[:FIRSTS]) - 1.0
    driver.say(f"MEMORY after {FIRSTS} and {TOGGLES} toggles: {growth:+.2%}")
    driver.expect(growth <= LARGEST_GROWTH, f"memory grew by {growth:.1%}")


driver.start(scenario)
