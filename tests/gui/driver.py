"""Drives a Blender with windows step by step from a timer, and watches its 3D viewport.

A scenario is a generator: it does something and yields the seconds to wait. Its last line on standard output is
`GUI PASSED` or `GUI FAILED`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
OUT = Path(os.environ.get("CISTERN_GUI_OUT", "."))
sys.path[:0] = [str(ROOT), *filter(None, [os.environ.get("CISTERN_CORE")])]

import addon  # noqa: E402
from addon import viewport_render  # noqa: E402

Scenario = Callable[[], Iterator[float]]
# Long enough for a loaded machine that compiles its shaders in software.
PATIENCE_SECONDS = 60.0
STEP_SECONDS = 0.05


class GuiError(AssertionError):
    """What a scenario expected did not happen."""


def say(*words: object) -> None:
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


def start(scenario: Scenario, quits: bool = True) -> None:
    """Register the add-on and run the scenario once Blender's window is there."""
    bpy.context.preferences.view.show_splash = False  # it would swallow the first input
    addon.register()
    steps = scenario()

    def step() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            say("GUI PASSED")
        except Exception:
            traceback.print_exc()
            screenshot("failed")
            say("GUI FAILED")
        if quits:
            bpy.app.timers.register(quit_blender)
        return None

    bpy.app.timers.register(step, first_interval=1.0, persistent=True)


def quit_blender() -> float | None:
    """A timer: as a render ends, Blender refuses to quit for a moment."""
    try:
        bpy.ops.wm.quit_blender()
    except RuntimeError:
        return STEP_SECONDS
    return None


def window() -> bpy.types.Window:
    """The main window: another one may show a final render."""
    return max(bpy.context.window_manager.windows, key=lambda window: window.width * window.height)


def subdivide(obj: bpy.types.Object) -> None:
    """Adaptively."""
    modifier = obj.modifiers.new("Subdivision", "SUBSURF")
    if hasattr(modifier, "use_adaptive_subdivision"):
        modifier.use_adaptive_subdivision = True
    else:
        bpy.context.scene.cycles.feature_set, obj.cycles.use_adaptive_subdivision = "EXPERIMENTAL", True


def view3d() -> bpy.types.Area:
    return max((a for a in window().screen.areas if a.type == "VIEW_3D"), key=lambda area: area.width * area.height)


def space() -> bpy.types.SpaceView3D:
    return view3d().spaces.active


def in_view3d() -> object:
    """The context of the 3D viewport, for operators."""
    area = view3d()
    region = next(region for region in area.regions if region.type == "WINDOW")
    return bpy.context.temp_override(window=window(), area=area, region=region, space_data=area.spaces.active)


def shade(kind: str) -> None:
    space().shading.type = kind


def redraw() -> None:
    view3d().tag_redraw()


def push_undo(message: str) -> None:
    with in_view3d():
        bpy.ops.ed.undo_push(message=message)


def screenshot(name: str) -> None:
    """Of the whole display: Blender's own operator gives a black picture under Xvfb."""
    subprocess.run(["import", "-window", "root", str(OUT / f"{name}.png")], check=False, timeout=60)


def press(key: str) -> None:
    """A real key in the 3D viewport; does not wait, because Blender has to answer the display meanwhile."""
    area = view3d()
    x, y = area.x + area.width // 2, window().height - area.y - area.height // 2
    subprocess.Popen(
        f"w=$(xdotool search --onlyvisible --class blender | tail -1); xdotool windowfocus $w; "
        f"xdotool mousemove --window $w {x} {y}; sleep .1; xdotool mousemove --window $w {x + 3} {y + 2}; sleep .1; "
        f"xdotool key {key}",
        shell=True,
    )


def renders() -> list[viewport_render.ViewportRender]:
    """The rendering threads that are alive."""
    return [render for render in viewport_render.running() if render.is_alive]


def pictures() -> int:
    """Number of the newest picture, 0 before the first."""
    return max((render.picture.number for render in renders() if render.picture is not None), default=0)


def finest() -> tuple[int, int]:
    """Width and height of the newest picture."""
    shapes = [render.picture.pixels.shape[:2] for render in renders() if render.picture is not None]
    return max(((width, height) for height, width in shapes), default=(0, 0))


def wait_until(condition: Callable[[], bool], what: str, seconds: float = PATIENCE_SECONDS) -> Iterator[float]:
    """Yields until the condition holds. Raises GuiError."""
    end = time.perf_counter() + seconds
    while not condition():
        if time.perf_counter() > end:
            raise GuiError(f"{what}: not within {seconds:.0f} s")
        yield STEP_SECONDS


def wait_for_picture(after: int, what: str) -> Iterator[float]:
    """Yields until a picture newer than number `after` is there. Raises GuiError, also for an error of the core."""

    def is_there() -> bool:
        expect_no_error(what)
        return pictures() > after

    yield from wait_until(is_there, what)


def expect_no_error(what: str) -> None:
    errors = [render.error for render in renders() if render.error]
    expect(not errors, f"{what}: {errors}")


def expect(condition: bool, what: str) -> None:
    if not condition:
        raise GuiError(what)


def resident_megabytes() -> float:
    """Memory of this process in use, after freeing what can be."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
