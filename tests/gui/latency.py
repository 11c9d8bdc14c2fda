"""Times from an edit to the first picture that shows it, in a scene of half a million triangles and 2,000 lamps.

Without overlays, of which this scene has more than a software display can draw in time.
Prints for each kind of edit the median and the largest of ROUNDS rounds, and the CPU time spent meanwhile: on a machine
that does other things as well, that is the more telling number.
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

from addon import viewport_draw

ROUNDS = 15


@dataclass(frozen=True)
class Moment:
    """Seconds on the wall, of this process on all cores, and of the main thread."""

    wall: float
    cpu: float
    main: float

    @staticmethod
    def now() -> "Moment":
        return Moment(time.perf_counter(), time.process_time(), time.thread_time())

    def milliseconds_since(self, start: "Moment") -> tuple[float, float, float]:
        return tuple(1e3 * (getattr(self, name) - getattr(start, name)) for name in ("wall", "cpu", "main"))


class Watch:
    """When a picture of which request was drawn first."""

    def __init__(self) -> None:
        self.drawn: dict[int, Moment] = {}
        draw = viewport_draw.Screen.draw

        def draw_and_note(screen, engine, scene, picture, size) -> None:
            draw(screen, engine, scene, picture, size)
            self.drawn.setdefault(picture.request, Moment.now())

        viewport_draw.Screen.draw = draw_and_note

    def measure(
        self, edit: Callable[[int], None], step: int, times: list[tuple[float, float, float]]
    ) -> Iterator[float]:
        """Make an edit and wait until a picture of it is on the screen."""
        [render] = driver.renders()
        before = render.requests
        start = Moment.now()
        edit(step)
        driver.redraw()
        yield 0.0
        yield from wait_until(lambda: any(request > before for request in self.drawn), "a picture of the edit")
        end = min(
            (moment for request, moment in self.drawn.items() if request > before), key=lambda moment: moment.wall
        )
        times.append(end.milliseconds_since(start))


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
    times: dict[str, list[tuple[float, float, float]]] = {name: [] for name in edits}
    for step in range(ROUNDS):
        for name, edit in edits.items():
            yield from watch.measure(edit, step, times[name])
            yield 0.7
    for name, measured in times.items():
        wall, cpu, main = (statistics.median(column) for column in zip(*measured, strict=True))
        largest = max(measured)[0]
        driver.say(
            f"LATENCY {name}: median {wall:.0f} ms, largest {largest:.0f} ms; CPU {cpu:.0f} ms on all cores, "
            f"{main:.0f} ms of it Blender's main thread"
        )
    driver.say("LOAD of the machine", *os.getloadavg(), "on", os.cpu_count(), "cores")


if __name__ == "__main__":
    driver.start(scenario)
