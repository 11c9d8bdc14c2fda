"""What guides towards caustics are worth, to look at: small lamps by way of smooth surfaces, for equal CPU time.

  python -m tests.benchmark.caustics [--seconds 20] [--size 360 270] [--output tests/benchmark/plots]

Writes caustics.jpg: a street that windows across it light with the sun, a mirror in the beam of a spot, and a ball of
glass in the sun; by Cycles, by Final without the guide, and by Final. One thread; `--seconds` are those of the samples,
told from two short renders.
"""

from __future__ import annotations

from collections.abc import Callable
from math import radians

import bpy
import mathutils

from tests.benchmark.equal_time import Picture, run
from tests.benchmark.everyday.scenes import PLASTER, Place, add, camera, lamp, world

GLAZING = {"Base Color": (0.04, 0.05, 0.06, 1.0), "Roughness": 0.05}


def look(at: Place, target: Place) -> None:
    towards = mathutils.Vector(target) - mathutils.Vector(at)
    camera(at, towards.to_track_quat("-Z", "Y").to_euler())


def street() -> None:
    """Panes of a house that stands in the sun, and a wall in the shade across the street."""
    cube = bpy.ops.mesh.primitive_cube_add
    add(cube, (0, 0, -0.1), (30, 30, 0.1), PLASTER)
    add(cube, (0, 5, 3), (8, 1, 3), {"Base Color": (0.5, 0.25, 0.18, 1.0), "Roughness": 0.9})
    add(cube, (0, -5, 3), (8, 1, 3), PLASTER)
    for x in (-6, -3, 0, 3, 6):
        for z in (1.6, 4.2):
            add(cube, (x, 3.98, z), (0.7, 0.04, 0.9), GLAZING)
    lamp("SUN", (0, 0, 30), 4.0, (radians(48), 0.0, radians(12)), angle=radians(0.53))
    world(0.4)
    look((-8.0, -3.0, 6.0), (0.0, 1.0, 0.3))


def mirror() -> None:
    cube = bpy.ops.mesh.primitive_cube_add
    add(cube, (0, 0, -0.1), (10, 10, 0.1), PLASTER)
    add(cube, (0, 4, 3), (10, 0.1, 3), PLASTER)
    add(cube, (0.0, 0, 0.9), (0.8, 0.02, 0.8), {"Metallic": 1.0, "Roughness": 0.05}, rotation=(0.2, 0.0, 0.35))
    lamp("SPOT", (1.5, 3.5, 3.2), 400.0, (radians(-58), 0.0, radians(-22)), spot_size=0.6, shadow_soft_size=0.02)
    world(0.03)
    look((5.0, -1.5, 3.0), (0.5, 1.5, 0.6))


def glass() -> None:
    add(bpy.ops.mesh.primitive_plane_add, (0, 0, 0), 10.0, PLASTER)
    add(bpy.ops.mesh.primitive_uv_sphere_add, (0, 0, 0.8), 0.7, {"Transmission Weight": 1.0, "Roughness": 0.0},
        segments=128, ring_count=64)  # fmt: skip
    lamp("SUN", (0, 0, 5), 3.0, (radians(50), 0.0, radians(-40)), angle=radians(0.53))
    world(0.3)
    look((0.0, -5.0, 3.0), (0.3, 0.3, 0.4))


def row(scene: Callable[[], None]) -> tuple[Picture, ...]:
    return (
        Picture("Cycles", "CYCLES", scene, {}),
        Picture("Final without guide", "CISTERN", scene, {"use_caustic_guide": False}),
        Picture("Final", "CISTERN", scene, {}),
    )


ROWS = {"windows in the sun": row(street), "mirror and spot": row(mirror), "glass in the sun": row(glass)}


if __name__ == "__main__":
    run(__doc__, ROWS, "caustics.jpg")
