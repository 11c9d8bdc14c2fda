"""Times from an edit to the first picture that shows it, in a scene of half a million triangles and 2,000 lamps.

Without overlays, of which this scene has more than a software display can draw in time.
Prints for each kind of edit the medians of ROUNDS rounds: until the scene was exported and the request submitted, until
its picture was made, until it was drawn. Beside wall-clock times stands that of the CPU on all cores, and on Blender's
main thread, which tell more on a machine that does other things as well.
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
from mathutils import Quaternion

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver
from driver import wait_until
from many_lamps import PITCH, SIDE, build_scene

from addon import viewport_draw, viewport_render

ROUNDS = int(os.environ.get("CISTERN_GUI_ROUNDS", 15))


@dataclass(frozen=True)
class Moment:
    """Seconds on the wall, of this process on all cores, and of the calling thread."""

    wall: float
    cpu: float
    thread: float

    @staticmethod
    def now() -> "Moment":
        return Moment(time.perf_counter(), time.process_time(), time.thread_time())

    def milliseconds_since(self, start: "Moment") -> tuple[float, float, float]:
        return tuple(1e3 * (getattr(self, name) - getattr(start, name)) for name in ("wall", "cpu", "thread"))


# Milliseconds since the edit, by step: on the wall, of CPU on all cores, and of the thread.
Round = dict[str, tuple[float, float, float]]
STEPS = ("exported", "rendered", "drawn")


class Watch:
    """When which request was submitted, its first picture made, and that drawn."""

    def __init__(self) -> None:
        self.moments: dict[str, dict[int, Moment]] = {step: {} for step in STEPS}
        self._after(viewport_render.ViewportRender, "submit", "exported", lambda render, job: render.requests)
        self._after(viewport_render.ViewportRender, "_put", "rendered", lambda render, *stage: render.picture.request)
        self._after(viewport_draw.Screen, "draw", "drawn", lambda screen, engine, scene, picture, size: picture.request)

    def _after(self, cls: type, method: str, step: str, request_of: Callable[..., int]) -> None:
        """Note when a method has returned."""
        original = getattr(cls, method)

        def call_and_note(*arguments: object) -> None:
            original(*arguments)
            self.moments[step].setdefault(request_of(*arguments), Moment.now())

        setattr(cls, method, call_and_note)

    def measure(self, edit: Callable[[int], None], step: int, rounds: list[Round]) -> Iterator[float]:
        """Make an edit and wait until a picture of it is on the screen."""
        [render] = driver.renders()
        before = render.requests
        start = Moment.now()
        edit(step)
        driver.redraw()
        yield 0.0
        drawn = self.moments["drawn"]
        yield from wait_until(lambda: any(request > before for request in drawn), "a picture of the edit")
        request = min(request for request in drawn if request > before)
        rounds.append({name: self.moments[name][request].milliseconds_since(start) for name in STEPS})


def move_camera(step: int) -> None:
    region = driver.space().region_3d
    region.view_rotation = Quaternion((0.0, 0.0, 1.0), math.radians(2.0 + step % 3)) @ region.view_rotation


def edit_lamp(step: int) -> None:
    bpy.data.lights["Lamp 1000"].energy = 10.0 + 5.0 * step


def move_object(step: int) -> None:
    bpy.data.objects["Lump 100"].location.z = 0.1 * (step + 1)


def edit_material(step: int) -> None:
    color = bpy.data.materials["Stone"].node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    color.default_value = (0.3 + 0.02 * step, 0.4, 0.5, 1.0)


def scenario() -> Iterator[float]:
    watch = Watch()
    build_scene()
    scene = bpy.context.scene
    scene.render.engine = "CISTERN"
    bpy.data.materials["Stone"].use_nodes = True
    region = driver.space().region_3d
    region.view_location, region.view_distance = (PITCH * SIDE / 2, PITCH * SIDE / 2, 0.0), 45.0
    triangles = sum(len(mesh.loop_triangles) or 2 * len(mesh.polygons) for mesh in bpy.data.meshes)
    driver.say("SCENE", triangles, "triangles or more", len(bpy.data.lights), "lamps")
    # 2,000 symbols of lamps, and all triangles once more for their depth: a software display draws little else.
    driver.space().overlay.show_overlays = False
    driver.shade("RENDERED")
    yield from driver.wait_for_picture(0, "first picture")
    yield 5.0
    driver.screenshot("latency")
    edits = {"camera": move_camera, "lamp": edit_lamp, "object": move_object, "material": edit_material}
    rounds: dict[str, list[Round]] = {name: [] for name in edits}
    for step in range(ROUNDS):
        for name, edit in edits.items():
            yield from watch.measure(edit, step, rounds[name])
            yield 0.7
    for name, measured in rounds.items():
        driver.say(f"LATENCY {name}: {report(measured)}")
    driver.say("LOAD of the machine", *os.getloadavg(), "on", os.cpu_count(), "cores")


def report(rounds: list[Round]) -> str:
    """Medians up to each step."""
    parts = []
    for step in STEPS:
        wall, cpu, main = (statistics.median(column) for column in zip(*(r[step] for r in rounds), strict=True))
        of_main = "" if step == "rendered" else f", main thread {main:.0f}"  # noted on another thread
        parts.append(f"{step} after {wall:.0f} ms (CPU {cpu:.0f}{of_main})")
    return f"{', '.join(parts)}; at worst {max(r['drawn'][0] for r in rounds):.0f} ms"


if __name__ == "__main__":
    driver.start(scenario)
