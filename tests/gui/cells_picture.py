"""Takes the README's picture of cells: the demo scene through its camera, every cell in a colour of its own.

Leaves a screenshot, `viewport_cells.png`; `convert viewport_cells.png -quality 72 examples/viewport_cells.jpg` is what
the README shows.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver
from driver import in_view3d, wait_until

sys.path.append(str(driver.ROOT / "examples"))
from cistern_hall import hall

PATIENCE = 200.0  # seconds, for half a million triangles and the window's own drawing of them, in software


def scenario() -> Iterator[float]:
    scene = bpy.context.scene
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    hall.build(scene)
    scene.render.engine = "CISTERN"
    scene.cistern.viewport_view, scene.cistern.viewport_samples = "CELLS", 1
    show_camera_view(scene.camera.data)
    yield 1.0
    driver.shade("RENDERED")
    yield from driver.wait_for_picture(0, "first picture")
    yield from wait_until(lambda: driver.finest()[0] >= 0.9 * driver.view3d().width, "a sharp picture", PATIENCE)
    yield 3.0
    driver.screenshot("viewport_cells")
    driver.shade("SOLID")
    yield 1.0


def show_camera_view(camera: bpy.types.Camera) -> None:
    """As large as it fits, without lines over it."""
    camera.show_passepartout = False
    space = driver.space()
    space.overlay.show_extras = space.overlay.show_relationship_lines = False
    space.region_3d.view_perspective = "CAMERA"
    with in_view3d():
        bpy.ops.view3d.view_center_camera()


driver.start(scenario)
