"""Builds Door Ajar: a furnished room whose only light is a lamp in the corridor, through a door that stands ajar.

.venv/bin/python examples/door_ajar.py [FILE.blend]
"""

import bpy
import numpy as np

import scene_tools as tools
from cistern_hall import textures
from cistern_hall.materials import principled, textured
from cistern_hall.shapes import Shape, box, joined, lathe, sphere, to_mesh

ROOM = (5.2, 4.4, 2.7)  # the room lies at x, y, z > 0
WALL = 0.15
DOOR = (3.1, 4.0)  # from here to here along the far wall
DOOR_HEIGHT = 2.1
AJAR = np.radians(24.0)
CORRIDOR = 1.7  # width
LAMP_POWER_W = 900.0  # radiant


def shell() -> Shape:
    """Walls and ceilings of room and corridor, with the opening of the door."""
    (x, y, z), (left, right) = ROOM, DOOR
    far, back = y + WALL, y + WALL + CORRIDOR
    return joined(
        [
            tools.block((-WALL, -WALL, 0.0), (0.0, back + WALL, z)),
            tools.block((x, -WALL, 0.0), (x + WALL, back + WALL, z)),
            tools.block((-WALL, -WALL, 0.0), (x + WALL, 0.0, z)),
            tools.block((0.0, y, 0.0), (left, far, z)),
            tools.block((right, y, 0.0), (x, far, z)),
            tools.block((left, y, DOOR_HEIGHT), (right, far, z)),
            tools.block((-WALL, back, 0.0), (x + WALL, back + WALL, z)),
            tools.block((-WALL, -WALL, z), (x + WALL, back + WALL, z + WALL)),
        ]
    )


def door() -> Shape:
    """A panelled leaf that reaches from its hinge along -X."""
    width = DOOR[1] - DOOR[0]
    leaf = tools.block((-width, -0.02, 0.005), (0.0, 0.02, DOOR_HEIGHT - 0.005))
    panels = [
        tools.block((-width + 0.12, -0.035, low), (-0.12, 0.035, low + height))
        for low, height in ((0.2, 0.7), (1.1, 0.8))
    ]
    knob = sphere(0.03, 16).moved((-width + 0.06, -0.07, 1.0)).painted(1)
    return joined([leaf, *panels, knob])


def table() -> Shape:
    legs = [tools.block((x, y, 0.0), (x + 0.07, y + 0.07, 0.72)) for x in (-0.7, 0.63) for y in (-0.4, 0.33)]
    return joined([box((1.6, 0.95, 0.05), 0.01).moved((0.0, 0.0, 0.745)), *legs])


def jar() -> Shape:
    profile = [(0.001, 0.0), (0.10, 0.0), (0.17, 0.12), (0.18, 0.22), (0.12, 0.34), (0.07, 0.38), (0.09, 0.44)]
    return lathe(profile, 48, (2.0, 1.0))


def build_room(scene: bpy.types.Scene) -> None:
    plaster = tools.matt("Plaster", (0.72, 0.68, 0.60))
    wood = textured("Wood", textures.to_image("wood", textures.wood(), "sRGB"), roughness=0.35)
    paint, _ = principled("Paint", (0.55, 0.60, 0.55), roughness=0.4)
    brass, _ = principled("Brass", (0.85, 0.62, 0.28), metallic=1.0, roughness=0.25)
    tools.place(scene, "Walls", to_mesh("Walls", shell(), [plaster]), (0, 0, 0))
    floor = tools.ground((-WALL, -WALL), (ROOM[0] + WALL, ROOM[1] + 2.0 * WALL + CORRIDOR), tile=1.2)
    tools.place(scene, "Floor", to_mesh("Floor", floor, [wood]), (0, 0, 0))
    leaf = to_mesh("Door", door(), [paint, brass])
    tools.place(scene, "Door", leaf, (DOOR[1], ROOM[1] + 0.02, 0.0), AJAR)


def build_furniture(scene: bpy.types.Scene) -> None:
    wood, brass = bpy.data.materials["Wood"], bpy.data.materials["Brass"]
    glaze_image = textures.to_image("glaze", textures.glaze(), "sRGB")
    glaze = textured("Glaze", glaze_image, roughness=0.45, coat_weight=1.0, coat_roughness=0.05)
    steel, _ = principled("Steel", (0.75, 0.76, 0.78), metallic=1.0, roughness=0.08)
    tools.place(scene, "Table", to_mesh("Table", table(), [wood]), (1.75, 2.5, 0.0), 0.3)
    for (x, y), material in zip(((1.3, 2.45), (1.75, 2.6), (2.2, 2.75)), (glaze, steel, brass), strict=True):
        tools.place(scene, "Jar", to_mesh("Jar", jar(), [material]), (x, y, 0.77), x)
    marble = textured("Picture", textures.to_image("marble", textures.marble(), "sRGB"), roughness=0.3)
    frame = joined([box((1.1, 0.05, 0.8), 0.01).painted(1), tools.upright_quad((-0.48, -0.03, -0.33), 0.96, 0.66)])
    picture = to_mesh("Picture", frame, [marble, wood])
    tools.place(scene, "Picture", picture, (1.4, ROOM[1] - 0.04, 1.65))
    shelves = joined([tools.block((0.0, 0.0, z), (0.32, 1.4, z + 0.03)) for z in (0.4, 0.8, 1.2, 1.6)])
    tools.place(scene, "Shelves", to_mesh("Shelves", shelves, [wood]), (0.0, 1.6, 0.0))
    random = np.random.default_rng(2)
    covers = [tools.matt("Cover", c) for c in ((0.5, 0.1, 0.08), (0.1, 0.25, 0.4), (0.6, 0.5, 0.25), (0.15, 0.3, 0.15))]
    for z in (0.43, 0.83, 1.23):
        for y in np.arange(1.62, 2.95, 0.06):
            book = tools.block((0.02, y, z), (0.24, y + 0.05, z + random.uniform(0.2, 0.32)))
            tools.place(scene, "Book", to_mesh("Book", book, [covers[random.integers(4)]]), (0, 0, 0))


def build(scene: bpy.types.Scene) -> None:
    build_room(scene)
    build_furniture(scene)
    lamp = tools.ground((-0.4, -0.4), (0.4, 0.4)).moved(scale=(1.0, -1.0, 1.0))  # faces down
    glow = tools.glow("Lamp", (1.0, 0.86, 0.66), LAMP_POWER_W / (np.pi * 0.64))
    at = (4.5, ROOM[1] + WALL + 0.5 * CORRIDOR, ROOM[2] - 0.02)
    tools.place(scene, "Lamp", to_mesh("Lamp", lamp, [glow]), at)
    tools.aim_camera(scene, (4.75, 0.3, 1.55), (1.75, 3.9, 1.0), 20.0)
    tools.set_picture(scene)


if __name__ == "__main__":
    tools.run_script(__doc__, "door_ajar", build)
