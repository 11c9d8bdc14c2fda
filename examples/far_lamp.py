"""Builds Far Lamp: a gallery lit by one small lamp in a deep hood near its far end, which shines on the end wall.

.venv/bin/python examples/far_lamp.py [FILE.blend]

The lamp sees one patch of the wall and nothing else; all other light has bounced there. A path has to find the patch,
far away and small as seen from most of the gallery.
"""

import bpy
import numpy as np

import scene_tools as tools
from cistern_hall import textures
from cistern_hall.materials import principled, textured
from cistern_hall.shapes import TAU, Shape, box, joined, lathe, sphere, to_mesh

HALF_WIDTH, LENGTH, HEIGHT = 2.2, 13.0, 3.4
BAY = 3.0
LAMP = (-0.4, 10.4, 2.4)  # of the bulb
BULB_RADIUS, BULB_POWER_W = 0.025, 4000.0


def pier() -> Shape:
    """A pilaster against the left wall, with a moulded cap."""
    shaft = tools.block((0.0, -0.25, 0.0), (0.35, 0.25, HEIGHT))
    foot = tools.block((0.0, -0.32, 0.0), (0.42, 0.32, 0.3))
    return joined([shaft, foot, tools.block((0.0, -0.32, HEIGHT - 0.3), (0.42, 0.32, HEIGHT - 0.1))])


def rib() -> Shape:
    return tools.block((-HALF_WIDTH, -0.2, HEIGHT - 0.25), (HALF_WIDTH, 0.2, HEIGHT))


def hood() -> Shape:
    """A can, open towards +Z, that lets the bulb on its axis shine in a cone of some 25 degrees."""
    outside = [(0.001, -0.10), (0.14, -0.10), (0.16, 0.34)]
    return lathe([*outside, (0.15, 0.34), (0.13, -0.08), (0.001, -0.08)], 48)


def shell() -> Shape:
    """Four walls that face inwards."""
    long = tools.upright_quad((0.0, 0.0, 0.0), LENGTH, HEIGHT, tile=1.6)
    short = tools.upright_quad((-HALF_WIDTH, 0.0, 0.0), 2.0 * HALF_WIDTH, HEIGHT, tile=1.6)
    return joined(
        [
            long.moved((HALF_WIDTH, LENGTH, 0.0), -0.25 * TAU),
            long.moved((-HALF_WIDTH, 0.0, 0.0), 0.25 * TAU),
            short.moved((0.0, LENGTH, 0.0)),
            short.moved((0.0, 0.0, 0.0), 0.5 * TAU),
        ]
    )


def build_gallery(scene: bpy.types.Scene) -> None:
    stone, relief = textures.limestone()
    stone_image = textures.to_image("limestone", stone, "sRGB")
    paving = textured("Paving", stone_image, textures.to_image("relief", relief, "Non-Color"), roughness=0.6)
    wash = textured("Whitewash", textures.to_image("marble", textures.marble(), "sRGB"), roughness=0.9)
    plaster = tools.matt("Plaster", (0.76, 0.73, 0.66))
    floor = tools.ground((-HALF_WIDTH, 0.0), (HALF_WIDTH, LENGTH), tile=2.0)
    tools.place(scene, "Floor", to_mesh("Floor", floor, [paving]), (0, 0, 0))
    ceiling = tools.ground((-HALF_WIDTH, -LENGTH), (HALF_WIDTH, 0.0)).moved(scale=(1.0, -1.0, 1.0))
    tools.place(scene, "Ceiling", to_mesh("Ceiling", ceiling, [plaster]), (0, 0, HEIGHT))
    tools.place(scene, "Walls", to_mesh("Walls", shell(), [wash]), (0, 0, 0))
    left, across = to_mesh("Pier", pier(), [plaster]), to_mesh("Rib", rib(), [plaster])
    for y in np.arange(BAY, LENGTH - 0.5, BAY):
        tools.place(scene, "Pier", left, (-HALF_WIDTH, y, 0.0))
        tools.place(scene, "Pier", left, (HALF_WIDTH, y, 0.0), 0.5 * TAU)
        tools.place(scene, "Rib", across, (0, y, 0))


def build_things(scene: bpy.types.Scene) -> None:
    wood = textured("Wood", textures.to_image("wood", textures.wood(), "sRGB"), roughness=0.5)
    glaze_image = textures.to_image("glaze", textures.glaze(), "sRGB")
    glaze = textured("Glaze", glaze_image, roughness=0.4, coat_weight=1.0, coat_roughness=0.05)
    crate = to_mesh("Crate", box((0.8, 0.6, 0.5), 0.02), [wood])
    for x, y, z, turn in (
        (1.3, 4.1, 0.25, 0.3),
        (1.35, 4.2, 0.75, -0.1),
        (-1.4, 7.0, 0.25, 1.2),
        (1.2, 8.4, 0.25, 0.7),
    ):
        tools.place(scene, "Crate", crate, (x, y, z), turn)
    jar = to_mesh(
        "Jar", lathe([(0.001, 0.0), (0.2, 0.0), (0.33, 0.4), (0.3, 0.7), (0.15, 0.9), (0.2, 1.0)], 48), [glaze]
    )
    for x, y in ((-1.3, 4.6), (-0.8, 5.2), (0.9, 6.6), (-1.2, 10.4)):
        tools.place(scene, "Jar", jar, (x, y, 0.0), x)


def build_lamp(scene: bpy.types.Scene) -> None:
    """Bulb and hood, turned towards the end wall."""
    iron, _ = principled("Iron", (0.15, 0.15, 0.16), roughness=0.6)
    glow = tools.glow("Bulb", (1.0, 0.84, 0.62), BULB_POWER_W / (4.0 * np.pi**2 * BULB_RADIUS**2))
    for name, shape, look in (("Hood", hood(), iron), ("Bulb", sphere(BULB_RADIUS, 12), glow)):
        tools.place(scene, name, to_mesh(name, shape, [look]), LAMP).rotation_euler = (-0.27 * TAU, 0.0, -0.25)


def build(scene: bpy.types.Scene) -> None:
    build_gallery(scene)
    build_things(scene)
    build_lamp(scene)
    tools.aim_camera(scene, (0.5, 0.4, 1.6), (-0.1, 9.0, 1.35), 24.0)
    tools.set_picture(scene)


if __name__ == "__main__":
    tools.run_script(__doc__, "far_lamp", build)
