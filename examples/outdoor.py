"""Builds Outdoor: a small square with houses, trees and cars under a sun and a cloudy sky.

.venv/bin/python examples/outdoor.py [FILE.blend]
"""

import bpy
import numpy as np

import scene_tools as tools
from cistern_hall import textures
from cistern_hall.materials import make_world, principled, textured
from cistern_hall.shapes import TAU, Shape, joined, lathe, patch, to_mesh, tube
from city_grid import building, car, lamp_post

SQUARE = 15.0  # half its side, metres
LEAVES = 1800  # of a tree
SUN_W_M2 = 3.5


def tree(random: np.random.Generator) -> Shape:
    """Trunk and boughs, and a crown of leaves (material 1) about the ends of the boughs."""
    s = np.linspace(0.0, 1.0, 10)
    parts = [tube(np.stack([0.15 * s**2, 0.05 * s, 2.6 * s], axis=1), 0.16 - 0.07 * s, 10)]
    ends = []
    for _ in range(9):
        turn, reach, rise = random.uniform(0.0, TAU), random.uniform(0.7, 1.5), random.uniform(0.8, 2.2)
        bough = np.stack([0.15 + reach * np.cos(turn) * s, 0.05 + reach * np.sin(turn) * s, 2.4 + rise * s**0.8], 1)
        parts.append(tube(bough, 0.07 - 0.05 * s, 6))
        ends.append(bough[-1])
    middles = np.array(ends)[random.integers(len(ends), size=LEAVES)] + random.normal(0.0, 0.42, (LEAVES, 3))
    along = random.normal(size=(LEAVES, 3))
    along *= 0.09 / np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(along, random.normal(size=(LEAVES, 3)))
    across *= 0.06 / np.linalg.norm(across, axis=1, keepdims=True)
    for m, a, b in zip(middles, along, across, strict=True):
        parts.append(patch(np.array([[m - a - b, m + a - b], [m - a + b, m + a + b]])).painted(1))
    return joined(parts)


def basin() -> Shape:
    """A round fountain with water (material 1)."""
    rim = [(2.2, 0.0), (2.2, 0.55), (2.0, 0.6), (1.9, 0.55), (1.9, 0.3)]
    pillar = [(0.25, 0.3), (0.2, 1.1), (0.9, 1.4), (0.95, 1.5), (0.001, 1.42)]
    water = lathe([(1.92, 0.42), (0.001, 0.42)], 64).painted(1)
    return joined([lathe(rim, 64), lathe(pillar, 48), water])


def build_houses(scene: bpy.types.Scene) -> None:
    stone, relief = textures.limestone()
    stone_image = textures.to_image("limestone", stone, "sRGB")
    relief_image = textures.to_image("relief", relief, "Non-Color")
    paving = textured("Paving", stone_image, relief_image, roughness=0.7)
    reach = 4.0 * SQUARE
    ground = tools.ground((-reach, -reach), (reach, reach), tile=3.0)
    tools.place(scene, "Ground", to_mesh("Ground", ground, [paving]), (0, 0, 0))
    bricks = textured("Bricks", textures.to_image("bricks", textures.bricks()[0], "sRGB"), scale=4.0, roughness=0.85)
    walls = [bricks, tools.matt("Ochre", (0.66, 0.50, 0.28)), tools.matt("Lime", (0.74, 0.71, 0.64))]
    trim = textured("Trim", stone_image, relief_image, roughness=0.8)
    pane, _ = principled("Pane", (0.04, 0.05, 0.06), roughness=0.05)
    width = 10.0
    kinds = [to_mesh(f"House {k}", building(width, 3 + k), [walls[k], trim, pane]) for k in range(3)]
    for side in range(4):
        for k in range(-1, 2):
            along, away = k * (width + 0.6 * (side + 1)), SQUARE + 0.5 * width
            at = [(along, away), (away, along), (along, -away - 12.0), (-away, along)][side]
            tools.place(scene, "House", kinds[(side + k) % 3], (*at, 0.0))


def build_things(scene: bpy.types.Scene) -> None:
    random = np.random.default_rng(4)
    bark, leaf = tools.matt("Bark", (0.20, 0.14, 0.09)), tools.matt("Leaf", (0.12, 0.28, 0.06))
    trees = [to_mesh("Tree", tree(random), [bark, leaf]) for _ in range(2)]
    for k, (x, y) in enumerate([(-9, 8), (-3, 10), (4, 9.5), (10, 6), (-11, 0), (11, -3), (6, 2.5)]):
        tools.place(scene, "Tree", trees[k % 2], (x, y, 0.0), 1.7 * k)
    tyre, glass = tools.matt("Tyre", (0.03, 0.03, 0.03)), principled("Glass", (0.02, 0.02, 0.03), roughness=0.03)[0]
    for k, colour in enumerate([(0.45, 0.03, 0.03), (0.05, 0.12, 0.35), (0.65, 0.66, 0.68)]):
        paint, _ = principled("Paint", colour, metallic=0.3, roughness=0.3, coat_weight=1.0, coat_roughness=0.03)
        mesh = to_mesh("Car", car(), [paint, glass, tyre])
        tools.place(scene, "Car", mesh, (-7.0 + 5.2 * k, -1.0 - 1.5 * k, 0.0), 0.5 * k)
    water, _ = principled("Water", (0.02, 0.05, 0.05), roughness=0.02, ior=1.33)
    stone = bpy.data.materials["Trim"]
    tools.place(scene, "Fountain", to_mesh("Fountain", basin(), [stone, water]), (0.5, 4.5, 0.0))
    post = to_mesh("Lamp post", lamp_post(), [principled("Iron", (0.08, 0.08, 0.09), metallic=0.5, roughness=0.4)[0]])
    for x, y in ((-5, 3), (5.5, 6), (-1.5, -4)):
        tools.place(scene, "Lamp post", post, (x, y, 0.0))


def build(scene: bpy.types.Scene) -> None:
    build_houses(scene)
    build_things(scene)
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle, sun.color = SUN_W_M2, np.radians(0.53), (1.0, 0.93, 0.82)
    tools.place(scene, "Sun", sun, (0, 0, 30)).rotation_euler = (np.radians(48.0), 0.0, np.radians(-35.0))
    scene.world = make_world(0.9, 2.0)
    tools.aim_camera(scene, (-2.5, -13.0, 1.8), (0.8, 4.0, 2.1), 22.0)
    tools.set_picture(scene)


if __name__ == "__main__":
    tools.run_script(__doc__, "outdoor", build)
