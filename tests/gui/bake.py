"""Bakes in windows: Esc ends one and leaves what there is; another runs to its end beside a rendered viewport."""

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver
from driver import in_view3d, say, screenshot, wait_until

MANY_SAMPLES = 1_000_000
SIZE = 256


def scenario() -> Iterator[float]:
    bpy.context.scene.render.engine = "CISTERN"
    cube = bpy.data.objects["Cube"]
    image = bpy.data.images.new("Baked", SIZE, SIZE, float_buffer=True)
    tree = cube.active_material.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.nodes.active = node
    yield from stopped(image)
    yield from beside_a_viewport(image)


def is_baking() -> bool:
    return bpy.app.is_job_running("OBJECT_BAKE")


def begin(samples: int) -> Iterator[float]:
    bpy.context.scene.cistern.samples = samples
    with in_view3d():
        bpy.ops.object.bake("INVOKE_DEFAULT", type="COMBINED", use_clear=True)
    yield from wait_until(is_baking, "begin of a bake")
    yield 2.0


def brightest(image: bpy.types.Image) -> float:
    return max(image.pixels[:][0::4])


def stopped(image: bpy.types.Image) -> Iterator[float]:
    yield from begin(MANY_SAMPLES)
    driver.press("Escape")
    yield from wait_until(lambda: not is_baking(), "end of a bake after Esc")
    yield 1.0
    [report] = driver.addon.report.last
    driver.expect(report.error is None and 0 < report.samples < MANY_SAMPLES, f"stopped early: {report}")
    driver.expect(brightest(image) > 0.1, "what there is is in the image")
    say("DONE stopped")


def beside_a_viewport(image: bpy.types.Image) -> Iterator[float]:
    image.pixels.foreach_set([0.0] * (4 * SIZE * SIZE))
    driver.shade("RENDERED")
    yield 1.0
    yield from begin(16)
    yield from wait_until(lambda: not is_baking(), "end of a bake", 120.0)
    yield 1.0
    driver.expect(driver.addon.report.last[-1].samples == 16, f"{driver.addon.report.last[-1]}")
    driver.expect(brightest(image) > 0.1, "the bake is in the image")
    yield from driver.wait_for_picture(0, "a viewport afterwards")
    screenshot("baked")
    say("DONE beside_a_viewport")


driver.start(scenario)
