"""Final renders in windows: grease pencil lies over them, Esc ends one; data goes while one runs, and the add-on."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver
from driver import in_view3d, say, screenshot, wait_until

MANY_SAMPLES = 1_000_000


def scenario() -> Iterator[float]:
    render = bpy.context.scene.render
    render.engine, render.preview_pixel_size = "CISTERN", "4"
    render.resolution_x, render.resolution_y = 320, 180
    yield from grease_pencil()
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


def grease_pencil() -> Iterator[float]:
    """Blender draws it over the picture."""
    shares = []
    for is_shown in (False, True):
        with in_view3d():
            if is_shown:
                bpy.ops.object.grease_pencil_add(type="MONKEY", location=(2.0, -2.0, 1.5))
        yield from begin(100)
        yield from wait_until(lambda: not is_rendering(), "end of a final render with grease pencil", 120.0)
        yield 1.0
        driver.expect(not reports()[-1].warnings, f"{reports()[-1]}")
        shares.append(share_of_skin(driver.OUT / "grease_pencil.png"))
    bpy.data.objects.remove(bpy.context.object)
    driver.expect(shares[0] == 0.0 and shares[1] > 0.01, f"pixels of the monkey's colour: {shares}")
    say("DONE grease_pencil", shares)


def share_of_skin(file: Path) -> float:
    """Of the last picture, how much has the colour of Blender's grease pencil monkey."""
    bpy.data.images["Render Result"].save_render(str(file))
    image = bpy.data.images.load(str(file))
    pixels = np.array(image.pixels).reshape(-1, 4)[:, :3]
    bpy.data.images.remove(image)
    return float((pixels[:, 0] > 1.5 * pixels[:, 2]).mean())


def escape() -> Iterator[float]:
    yield from begin()
    yield from end()
    report = reports()[-1]
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
