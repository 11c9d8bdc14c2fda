"""Times from an edit to the first picture that shows it, in a scene of half a million triangles and 2,000 lamps.

Prints the median and the largest of ROUNDS rounds for each kind of edit, in milliseconds, and what Blender itself needs
meanwhile: the time from the edit to its first redraw.
"""

import math
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
from mathutils import Quaternion

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver
from driver import wait_until
from many_lamps import PITCH, SIDE, build_scene

from addon import viewport_draw

ROUNDS = 15


class Watch:
    """When which request was drawn first."""

    def __init__(self) -> None:
        self.drawn: dict[int, float] = {}
        self.draws: list[float] = []
        draw = viewport_draw.Screen.draw

        def draw_and_note(screen, engine, scene, picture, size) -> None:
            draw(screen, engine, scene, picture, size)
            now = time.perf_counter()
            self.draws.append(now)
            self.drawn.setdefault(picture.request, now)

        viewport_draw.Screen.draw = draw_and_note

    def measure(
        self, edit: Callable[[int], None], round_number: int, times: list[tuple[float, float]]
    ) -> Iterator[float]:
        """Make an edit and wait until a picture of it is on the screen."""
        [render] = driver.renders()
        before = render.requests
        start = time.perf_counter()
        edit(round_number)
        driver.redraw()
        yield 0.0
        yield from wait_until(lambda: any(request > before for request in self.drawn), "a picture of the edit")
        end = min(drawn for request, drawn in self.drawn.items() if request > before)
        first_draw = min(drawn for drawn in self.draws if drawn > start)
        times.append((1e3 * (end - start), 1e3 * (first_draw - start)))


def move_camera(step: int) -> None:
    region = driver.space().region_3d
    region.view_rotation = Quaternion((0.0, 0.0, 1.0), math.radians(2.0 + step % 3)) @ region.view_rotation


def edit_lamp(step: int) -> None:
    bpy.data.lights["Lamp 1000"].energy = 100.0 + 50.0 * step


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
    driver.shade("RENDERED")
    yield from driver.wait_for_picture(0, "first picture")
    yield 5.0
    driver.screenshot("latency")
    edits = {"camera": move_camera, "lamp": edit_lamp, "object": move_object, "material": edit_material}
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in edits}
    for round_number in range(ROUNDS):
        for name, edit in edits.items():
            yield from watch.measure(edit, round_number, times[name])
            yield 0.7
    for name, pairs in times.items():
        first, blender = zip(*pairs, strict=True)
        driver.say(
            f"LATENCY {name}: median {statistics.median(first):.0f} ms, largest {max(first):.0f} ms;"
            f" Blender's own redraw {statistics.median(blender):.0f} ms"
        )


driver.start(scenario)
