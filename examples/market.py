"""Builds Market, a street of stalls by night, lit by 480 bulbs of 64 emissive triangles each.

.venv/bin/python examples/market.py [FILE.blend]

The bulbs hang under the awnings behind valances, so that each lights its own stall and a strip of the street: most
lights that are near a point do not reach it.
"""

import bpy
import numpy as np

import scene_tools as tools
from cistern_hall import textures
from cistern_hall.materials import principled, textured
from cistern_hall.shapes import TAU, Shape, box, joined, patch, sphere, to_mesh, tube

STALLS = 24  # on each side of the street
PITCH = 2.7  # metres from stall to stall
FRONT = 2.1  # of the counters, from the middle of the street
WIDTH, DEPTH = 2.3, 1.5
EAVES, RIDGE = 2.35, 2.75  # heights of the front and the back of the awning
VALANCE = 0.32
BULBS, BULB_RADIUS, BULB_POWER_W = 10, 0.035, 9.0
LIGHTS = ((1.0, 0.72, 0.42), (1.0, 0.55, 0.25), (0.95, 0.9, 0.8), (1.0, 0.35, 0.18), (0.55, 0.8, 1.0))
CLOTHS = ((0.62, 0.07, 0.05), (0.08, 0.28, 0.12), (0.08, 0.16, 0.42), (0.66, 0.42, 0.08))
FRUITS = ((0.75, 0.1, 0.05), (0.85, 0.4, 0.05), (0.3, 0.55, 0.08), (0.8, 0.65, 0.1), (0.3, 0.05, 0.2))


def striped(points: np.ndarray) -> Shape:
    """A cloth through a grid of points with every other pair of columns in material 1."""
    shape = patch(points, (1.0, 1.0))
    columns = points.shape[1] - 1
    stripes = (np.arange(len(shape.quads)) % columns) // 2 % 2
    return Shape(shape.positions, shape.quads, shape.uvs, stripes)


def cloth() -> Shape:
    """Awning and scalloped valance, open towards +Y, the counter's front edge on the X axis. Both sides show."""
    x = np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, 41)
    slope = np.linspace(0.0, 1.0, 7)[:, None]
    sag = -0.04 * np.sin(np.pi * slope)
    awning = np.stack(np.broadcast_arrays(x, -0.45 + (DEPTH + 0.45) * slope, EAVES + (RIDGE - EAVES) * slope + sag), 2)
    hem = EAVES - VALANCE * (0.8 + 0.2 * np.abs(np.sin(TAU * x / 0.46)))
    rows = [np.stack([x, np.full_like(x, -0.45), z], 1) for z in (hem, np.full_like(x, EAVES))]
    y = np.linspace(-0.45, DEPTH, 9)
    top = EAVES + (RIDGE - EAVES) * (y + 0.45) / (DEPTH + 0.45)
    sides = [
        striped(np.array([np.stack([np.full_like(y, side), y, z], 1) for z in (np.full_like(y, EAVES - VALANCE), top)]))
        for side in (-0.5 * WIDTH, 0.5 * WIDTH)
    ]
    return joined([striped(awning), striped(np.array(rows)), *sides])


def stand() -> Shape:
    """Counter, shelf and four posts."""
    half = 0.5 * WIDTH
    posts = [
        tube(np.array([(x, y, 0.0), (x, y, 1.2), (x, y, EAVES if y < 0 else RIDGE)]), 0.03)
        for x in (-half + 0.04, half - 0.04)
        for y in (-0.4, DEPTH - 0.05)
    ]
    shelf = tools.block((-half, DEPTH - 0.4, 1.25), (half, DEPTH, 1.29))
    return joined([tools.block((-half, 0.0, 0.0), (half, 0.9, 0.85)), shelf, *posts])


def heap(random: np.random.Generator) -> Shape:
    """A tray of fruit in three layers; material 0 is the tray."""
    parts = [box((0.5, 0.5, 0.1), 0.02)]
    for layer, side in enumerate((4, 3, 2)):
        steps = (np.arange(side) - 0.5 * (side - 1)) * 0.115
        for x in steps:
            for y in steps:
                at = (x + random.uniform(-0.01, 0.01), y + random.uniform(-0.01, 0.01), 0.1 + 0.08 * layer)
                parts.append(sphere(0.058, 10).moved(at).painted(1))
    return joined(parts)


def bulbs() -> Shape:
    """A string of bulbs under the front of the awning, above the hem of the valance."""
    x = (np.arange(BULBS) + 0.5) / BULBS * (WIDTH - 0.2) - 0.5 * (WIDTH - 0.2)
    return joined(
        [sphere(BULB_RADIUS, 8).moved((at, -0.25, EAVES - 0.14 + 0.03 * (-1) ** k)) for k, at in enumerate(x)]
    )


def build_stalls(scene: bpy.types.Scene, random: np.random.Generator) -> None:
    wood = textured("Wood", textures.to_image("wood", textures.wood(), "sRGB"), roughness=0.6)
    white = tools.matt("White Cloth", (0.7, 0.68, 0.62))
    awnings = [to_mesh("Awning", cloth(), [tools.matt("Cloth", c), white]) for c in CLOTHS]
    table = to_mesh("Stand", stand(), [wood])
    heaps = [to_mesh("Fruit", heap(random), [wood, principled("Fruit", c, roughness=0.35)[0]]) for c in FRUITS]
    strength = BULB_POWER_W / (4.0 * np.pi**2 * BULB_RADIUS**2)
    strings = [to_mesh("Bulbs", bulbs(), [tools.glow("Bulb", colour, strength)]) for colour in LIGHTS]
    for k in range(2 * STALLS):
        side, along = (-1 if k % 2 else 1), (k // 2 - 0.5 * STALLS) * PITCH
        turn = -0.25 * TAU * side
        for what in (awnings[random.integers(4)], table, strings[random.integers(5)]):
            tools.place(scene, what.name, what, (side * FRONT, along, 0.0), turn)
        for step in (-0.75, -0.2, 0.35, 0.9):
            at = (side * (FRONT + 0.4), along + step, 0.9)
            tools.place(scene, "Fruit", heaps[random.integers(5)], at, 0.25 * TAU * random.integers(4))


def build_street(scene: bpy.types.Scene, random: np.random.Generator) -> None:
    reach, wall = 0.5 * STALLS * PITCH + 3.0, FRONT + DEPTH + 0.4
    stone, relief = textures.limestone()
    stone_image = textures.to_image("limestone", stone, "sRGB")
    paving = textured("Paving", stone_image, textures.to_image("relief", relief, "Non-Color"), roughness=0.5)
    bricks = textured("Bricks", textures.to_image("bricks", textures.bricks()[0], "sRGB"), roughness=0.85)
    street = tools.ground((-wall, -reach), (wall, reach), tile=2.0)
    tools.place(scene, "Street", to_mesh("Street", street, [paving]), (0, 0, 0))
    facade = tools.upright_quad((-reach, wall, 0.0), 2.0 * reach, 9.0, tile=1.6)
    end = tools.upright_quad((-wall, reach, 0.0), 2.0 * wall, 9.0, tile=1.6)
    houses = joined([facade.moved(turn=-0.25 * TAU), facade.moved(turn=0.25 * TAU), end])
    tools.place(scene, "Houses", to_mesh("Houses", houses, [bricks]), (0, 0, 0))
    crate = to_mesh("Crate", box((0.5, 0.4, 0.35), 0.02), [bpy.data.materials["Wood"]])
    for _ in range(30):
        at = (random.choice((-1, 1)) * random.uniform(1.3, 1.7), random.uniform(-reach, reach), 0.175)
        tools.place(scene, "Crate", crate, at, random.uniform(0.0, TAU))


def build(scene: bpy.types.Scene) -> None:
    random = np.random.default_rng(5)
    build_stalls(scene, random)
    build_street(scene, random)
    tools.aim_camera(scene, (0.5, -0.5 * STALLS * PITCH - 2.0, 1.65), (-0.3, 0.0, 1.35), 28.0)
    tools.set_picture(scene)


if __name__ == "__main__":
    tools.run_script(__doc__, "market", build)
