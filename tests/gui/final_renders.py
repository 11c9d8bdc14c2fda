"""Final renders in windows: Esc ends one, data goes while it runs, and so does the add-on, then comes back."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver
from driver import in_view3d, say, screenshot, wait_until

MANY_SAMPLES = 1_000_000


def scenario() -> Iterator[float]:
    render = bpy.context.scene.render
    render.engine, render.preview_pixel_size = "CISTERN", "4"
    render.resolution_x, render.resolution_y = 320, 180
    yield from escape()
    yield from edit_meanwhile()
    yield from take_away_the_add_on()
    yield from replace_the_add_on()


def is_rendering() -> bool:
    return bpy.app.is_job_running("RENDER")


def begin(samples: int = MANY_SAMPLES) -> Iterator[float]:
    bpy.context.scene.cistern.samples = samples
    with in_view3d():
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield from wait_until(is_rendering, "begin of a final render")
    yield 1.0


def press_escape() -> None:
    """In every window: the render has one of its own."""
    subprocess.Popen(
        "for w in $(xdotool search --onlyvisible --class blender); do xdotool windowfocus $w; sleep .1; "
        "xdotool mousemove --window $w 100 100; sleep .1; xdotool mousemove --window $w 103 102; sleep .1; "
        "xdotool key Escape; sleep .2; done",
        shell=True,
    )


def end() -> Iterator[float]:
    press_escape()
    yield from wait_until(lambda: not is_rendering(), "end of a final render after Esc")
    yield 1.0


def reports() -> list:
    return driver.addon.report.last


def escape() -> Iterator[float]:
    yield from begin()
    yield from end()
    [report] = reports()
    driver.expect(report.error is None and report.samples < MANY_SAMPLES, f"stopped early: {report}")
    screenshot("escaped")
    say("DONE escape")


def edit_meanwhile() -> Iterator[float]:
    yield from begin(400)
    with in_view3d():
        bpy.data.materials.remove(bpy.data.objects["Cube"].active_material)
        bpy.data.meshes.remove(bpy.data.objects["Cube"].data)
        bpy.ops.mesh.primitive_monkey_add()
        bpy.ops.outliner.orphans_purge()
    yield from wait_until(lambda: not is_rendering(), "end of a final render whose data was deleted", 120.0)
    yield 1.0
    driver.expect(reports()[-1].error is None, f"{reports()[-1]}")
    say("DONE edit_meanwhile")


def take_away_the_add_on() -> Iterator[float]:
    """Blender would crash as the render ends, were the engine's class gone by then."""
    yield from begin()
    driver.shade("RENDERED")
    yield 1.0
    driver.addon.unregister()
    yield 1.0
    yield from end()
    driver.expect(driver.addon.engine.registered_class() is None, "the engine is gone once its render has ended")
    driver.addon.register()
    yield from render_and_view("taken_away")


def replace_the_add_on() -> Iterator[float]:
    """Modules that are loaded anew, as by an upgrade."""
    yield from begin()
    driver.addon.unregister()
    old = driver.addon.engine.CisternEngine
    for name in [name for name in sys.modules if name == "addon" or name.startswith("addon.")]:
        del sys.modules[name]
    driver.addon = __import__("addon")
    driver.viewport_render = __import__("addon.viewport_render").viewport_render
    driver.addon.register()
    new = driver.addon.engine.CisternEngine
    driver.expect(driver.addon.engine.registered_class() is old is not new, "the render keeps its engine")
    yield from end()
    driver.expect(driver.addon.engine.registered_class() is new, "the newer engine is there")
    yield from render_and_view("replaced")


def render_and_view(name: str) -> Iterator[float]:
    bpy.context.scene.render.engine = "CISTERN"
    before = len(reports())
    yield from begin(4)
    yield from wait_until(lambda: not is_rendering(), "a final render afterwards")
    yield 1.0
    driver.expect(len(reports()) > before and reports()[-1].error is None, f"{reports()}")
    driver.shade("SOLID")
    yield 0.5
    driver.shade("RENDERED")
    yield from driver.wait_for_picture(0, "a viewport afterwards")
    screenshot(name)
    say("DONE", name)


driver.start(scenario)
