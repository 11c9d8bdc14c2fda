"""How far pictures are from the truth after an edit: our 1st, 4th and 16th, and what Cycles' viewport shows by then.

The scene of half a million triangles and 2,000 lamps, a part of the viewport, both engines at their factory settings
for viewports. Pictures are read from the frame buffer whenever Blender draws. The truth is the preset Final after many
samples. Errors are root mean squares of displayed values (the curve of sRGB, 0 to 255, clipped), so a few bright dots
count for what is seen of them. Where Cycles has not drawn a new picture by then, the old one is what it shows: marked
by a star.

`CISTERN_GUI_ROUNDS` edits of each kind, 3 unless set; medians.
"""

import math
import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import gpu
import numpy as np
from mathutils import Quaternion
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver
from driver import wait_until
from many_lamps import PITCH, SIDE, build_scene

ROUNDS = int(os.environ.get("CISTERN_GUI_ROUNDS", 3))
PICTURES = (1, 4, 16)
BORDER = (0.35, 0.35, 0.65, 0.65)  # of the viewport
SETTLING_SECONDS, WATCHED_SECONDS = 3.0, 12.0
TRUTH_SAMPLES, TRUTH_SEED = 128, 4711
TRUTH_PATIENCE_SECONDS = 400.0

Pixels = NDArray[np.float32]  # (height, width, 3), scene-linear


@dataclass(frozen=True)
class Shown:
    """What was on the screen from a moment on."""

    seconds: float
    request: int
    """Of our engine; 0 for Cycles."""
    number: int
    pixels: Pixels


class Recorder:
    """Reads the frame buffer each time Blender has drawn the viewport."""

    def __init__(self) -> None:
        self.shown: list[Shown] = []
        self.is_recording = False
        self._frame_buffer = None
        add = bpy.types.SpaceView3D.draw_handler_add
        add(self._before, (), "WINDOW", "PRE_VIEW")  # later on overlays have a frame buffer of their own
        add(self._after, (), "WINDOW", "POST_PIXEL")

    def _before(self) -> None:
        self._frame_buffer = gpu.state.active_framebuffer_get()

    def _after(self) -> None:
        if not self.is_recording:
            return
        _, _, width, height = gpu.state.viewport_get()
        left, bottom, right, top = (round(edge * size) for edge, size in zip(BORDER, (width, height) * 2, strict=True))
        with self._frame_buffer.bind():
            pixels = self._frame_buffer.read_color(left, bottom, right - left, top - bottom, 4, 0, "FLOAT")
        picture = next((render.picture for render in driver.renders() if render.picture is not None), None)
        request, number = (picture.request, picture.number) if picture is not None else (0, 0)
        colors = np.array(pixels, np.float32).reshape(top - bottom, right - left, 4)[..., :3]
        self.shown.append(Shown(time.perf_counter(), request, number, colors))

    def start(self) -> None:
        self.shown.clear()
        self.is_recording = True


def turn_camera(is_edited: bool) -> None:
    angle = math.radians(4.0 if is_edited else 0.0)
    driver.space().region_3d.view_rotation = Quaternion((0.0, 0.0, 1.0), angle) @ START_ROTATION


def light_lamp(is_edited: bool) -> None:
    lamp = bpy.data.objects["Lamp 1000"]
    lamp.data.energy = 3000.0 if is_edited else 3.0


def raise_object(is_edited: bool) -> None:
    bpy.data.objects[f"Lump {SIDE * SIDE // 2 + SIDE // 2}"].location.z = 1.5 if is_edited else 0.0


EDITS = {"camera": turn_camera, "lamp": light_lamp, "object": raise_object}
START_ROTATION = Quaternion((0.85, 0.35, 0.15, 0.36)).normalized()


def displayed(pixels: Pixels) -> NDArray[np.float64]:
    """0 to 255 [IEC 61966-2-1]."""
    linear = np.clip(pixels.astype(np.float64), 0.0, 1.0)
    return 255.0 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def error(pixels: Pixels, truth: Pixels) -> float:
    return float(np.sqrt(np.mean((displayed(pixels) - displayed(truth)) ** 2)))


def use(engine: str, preset: str = "INTERACTIVE", samples: int = 1024, seed: int = 0) -> Iterator[float]:
    driver.shade("SOLID")
    yield 0.3
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.cistern.viewport_preset, scene.cistern.viewport_samples, scene.cistern.seed = preset, samples, seed
    driver.shade("RENDERED")
    yield SETTLING_SECONDS


def has_all_samples() -> bool:
    pictures = [render.picture for render in driver.renders() if render.picture is not None]
    return any(f"Sample {TRUTH_SAMPLES}/{TRUTH_SAMPLES}" in picture.status for picture in pictures)


def truths(recorder: Recorder) -> Iterator[float]:
    """After each edit; the generator's value is a dictionary."""
    yield from use("CISTERN", "FINAL", TRUTH_SAMPLES, TRUTH_SEED)
    found: dict[str, Pixels] = {}
    for name, edit in EDITS.items():
        edit(True)
        recorder.start()
        yield 1.0
        yield from wait_until(has_all_samples, f"the truth of {name}", TRUTH_PATIENCE_SECONDS)
        driver.redraw()
        yield 1.0
        found[name] = recorder.shown[-1].pixels
        recorder.is_recording = False
        edit(False)
        yield 0.5
    return found


def watch(recorder: Recorder, edit: Callable[[bool], None]) -> Iterator[float]:
    """Everything shown after an edit, with seconds since then; the first entry is the picture before."""
    edit(False)
    yield SETTLING_SECONDS
    recorder.start()
    driver.redraw()
    yield 0.3
    before = recorder.shown[-1]
    recorder.start()
    start = time.perf_counter()
    edit(True)
    driver.redraw()
    yield WATCHED_SECONDS
    recorder.is_recording = False
    edit(False)
    after = [Shown(s.seconds - start, s.request, s.number, s.pixels) for s in recorder.shown]
    return [Shown(0.0, before.request, before.number, before.pixels), *after]


def our_pictures(shown: list[Shown]) -> list[Shown]:
    """Those that show the edit, each when it was first drawn."""
    found: dict[int, Shown] = {}
    for picture in shown[1:]:
        if picture.request > shown[0].request:
            found.setdefault(picture.number, picture)
    return list(found.values())


def report(name: str, truth: Pixels, ours: list[list[Shown]], theirs: list[list[Shown]]) -> None:
    for count in PICTURES:
        rounds = [pictures[count - 1] for pictures in map(our_pictures, ours) if len(pictures) >= count]
        if not rounds:
            driver.say(f"ERROR {name}: no picture {count} within {WATCHED_SECONDS:.0f} s")
            continue
        seconds = statistics.median(picture.seconds for picture in rounds)
        by_then = [[s for s in shown if s.seconds <= seconds][-1] for shown in theirs]
        is_old = any(np.array_equal(s.pixels, shown[0].pixels) for s, shown in zip(by_then, theirs, strict=True))
        our_error = statistics.median(error(picture.pixels, truth) for picture in rounds)
        their_error = statistics.median(error(picture.pixels, truth) for picture in by_then)
        driver.say(
            f"ERROR {name}: picture {count} after {1e3 * seconds:.0f} ms: {our_error:.2f}, "
            f"Cycles by then {their_error:.2f}{'*' if is_old else ''}"
        )
    news = [next((s for s in shown[1:] if not np.array_equal(s.pixels, shown[0].pixels)), None) for shown in theirs]
    if all(news):
        seconds = statistics.median(s.seconds for s in news)
        first = statistics.median(error(s.pixels, truth) for s in news)
        driver.say(f"ERROR {name}: Cycles' first picture after {1e3 * seconds:.0f} ms: {first:.2f}")


def scenario() -> Iterator[float]:
    build_scene()
    scene = bpy.context.scene
    scene.view_settings.view_transform = "Standard"
    space = driver.space()
    space.overlay.show_overlays = False
    space.use_render_border = True
    space.render_border_min_x, space.render_border_min_y, space.render_border_max_x, space.render_border_max_y = BORDER
    region = space.region_3d
    region.view_location, region.view_distance = (PITCH * SIDE / 2, PITCH * SIDE / 2, 0.0), 30.0
    turn_camera(False)
    recorder = Recorder()
    truth = yield from truths(recorder)
    found: dict[tuple[str, str], list[list[Shown]]] = {}
    for _ in range(ROUNDS):
        for engine in ("CISTERN", "CYCLES"):
            yield from use(engine)
            for name, edit in EDITS.items():
                shown = yield from watch(recorder, edit)
                found.setdefault((name, engine), []).append(shown)
            driver.screenshot(f"edit_error_{engine.lower()}")
    for name in EDITS:
        report(name, truth[name], found[name, "CISTERN"], found[name, "CYCLES"])
    driver.say("LOAD of the machine", *os.getloadavg(), "on", os.cpu_count(), "cores")


if __name__ == "__main__":
    driver.start(scenario)
