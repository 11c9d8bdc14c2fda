"""Builds Bright Interior: a white living room with a wall of windows to an overcast sky and two luminous ceilings.

.venv/bin/python examples/bright_interior.py [FILE.blend]

An easy case: large lights, high albedos, few shadows. Nothing may be lost here to bookkeeping.
"""

import bpy
import numpy as np

import scene_tools as tools
from cistern_hall import textures
from cistern_hall.materials import make_world, principled, textured
from cistern_hall.shapes import TAU, Shape, box, joined, lathe, to_mesh, tube

ROOM = (6.4, 5.0, 2.8)  # the room lies at x, y, z > 0; its windows are at x = 0
SILL, LINTEL = 0.5, 2.5
PANES = 3
PANEL_POWER_W = 280.0  # of each luminous ceiling, radiant


def shell() -> Shape:
    x, y, z = ROOM
    t = 0.2
    step = y / PANES
    posts = [
        tools.block((-t, max(k * step - 0.06, 0.0), SILL), (0.0, k * step + 0.06, LINTEL)) for k in range(PANES + 1)
    ]
    solid = [
        tools.block((-t, 0.0, 0.0), (0.0, y, SILL)),
        tools.block((-t, 0.0, LINTEL), (0.0, y, z)),
        tools.block((x, 0.0, 0.0), (x + t, y, z)),
        tools.block((-t, -t, 0.0), (x + t, 0.0, z)),
        tools.block((-t, y, 0.0), (x + t, y + t, z)),
        tools.block((-t, -t, z), (x + t, y + t, z + t)),
    ]
    return joined([*posts, *solid])


def sofa(width: float) -> Shape:
    """Seat, back, arms and cushions (material 1), facing -Y."""
    seat = box((width, 0.9, 0.3), 0.05).moved((0.0, 0.0, 0.28))
    back = box((width, 0.22, 0.6), 0.08).moved((0.0, 0.38, 0.62))
    arms = [box((0.26, 0.98, 0.4), 0.06).moved((side * 0.5 * (width - 0.2), 0.0, 0.5)) for side in (-1, 1)]
    count = round((width - 0.4) / 0.75)
    places = (np.arange(count) - 0.5 * (count - 1)) * (width - 0.4) / count
    cushions = [box((0.7, 0.7, 0.16), 0.06).moved((x, -0.08, 0.5)).painted(1) for x in places]
    return joined([seat, back, *arms, *cushions])


def plant(random: np.random.Generator) -> Shape:
    """A pot (material 1) with long leaves."""
    parts = [lathe([(0.001, 0.0), (0.16, 0.0), (0.22, 0.4), (0.19, 0.4), (0.18, 0.36), (0.001, 0.36)], 40).painted(1)]
    s = np.linspace(0.0, 1.0, 12)
    for _ in range(46):
        reach, rise = random.uniform(0.25, 0.75), random.uniform(0.5, 1.2)
        path = np.stack([0.08 * s + reach * s**2, 0.0 * s, 0.36 + rise * (1.3 * s - 0.5 * s**2)], axis=1)
        leaf = tube(path, 0.045 * np.sin(np.pi * np.clip(s, 0.05, 0.99)) ** 0.7, 6)
        parts.append(leaf.moved(turn=random.uniform(0.0, TAU), scale=(1.0, 1.0, 1.0)))
    return joined(parts)


def table() -> Shape:
    top = lathe([(0.001, 0.38), (0.5, 0.38), (0.52, 0.40), (0.5, 0.42), (0.001, 0.42)], 64)
    return joined([top, lathe([(0.3, 0.0), (0.05, 0.03), (0.04, 0.38)], 32).painted(1)])


def build_room(scene: bpy.types.Scene) -> None:
    white = tools.matt("White", (0.82, 0.81, 0.79))
    wood = textured("Wood", textures.to_image("wood", textures.wood(), "sRGB"), roughness=0.4)
    tools.place(scene, "Walls", to_mesh("Walls", shell(), [white]), (0, 0, 0))
    floor = tools.ground((0.0, 0.0), ROOM[:2], tile=1.3)
    tools.place(scene, "Floor", to_mesh("Floor", floor, [wood]), (0, 0, 0))
    weave = textured("Rug", textures.to_image("glaze", textures.glaze(), "sRGB"), roughness=0.9)
    rug = tools.ground((-1.4, -1.0), (1.4, 1.0), tile=2.0)
    tools.place(scene, "Rug", to_mesh("Rug", rug, [weave]), (2.6, 2.4, 0.01))
    panel = tools.ground((-0.8, -0.5), (0.8, 0.5)).moved(scale=(1.0, -1.0, 1.0))
    for x in (2.0, 4.6):
        glow = tools.glow("Ceiling Light", (1.0, 0.93, 0.84), PANEL_POWER_W / (np.pi * 1.6))
        tools.place(scene, "Panel", to_mesh("Panel", panel, [glow]), (x, 2.5, ROOM[2] - 0.03))
    scene.world = make_world(4.0, 1.0)


def build_furniture(scene: bpy.types.Scene) -> None:
    random = np.random.default_rng(8)
    fabric, cushion = tools.matt("Fabric", (0.45, 0.48, 0.50)), tools.matt("Cushion", (0.70, 0.58, 0.38))
    tools.place(scene, "Sofa", to_mesh("Sofa", sofa(2.5), [fabric, cushion]), (2.6, 4.1, 0.0))
    tools.place(scene, "Chair", to_mesh("Chair", sofa(1.1), [fabric, cushion]), (5.0, 2.9, 0.0), -0.22 * TAU)
    oak, steel = bpy.data.materials["Wood"], principled("Steel", (0.7, 0.7, 0.72), metallic=1.0, roughness=0.3)[0]
    tools.place(scene, "Table", to_mesh("Table", table(), [oak, steel]), (2.7, 2.4, 0.0))
    leaf, _ = principled("Leaf", (0.09, 0.26, 0.06), roughness=0.4)
    clay, _ = principled("Clay", (0.62, 0.30, 0.18), roughness=0.7)
    tools.place(scene, "Plant", to_mesh("Plant", plant(random), [leaf, clay]), (0.65, 4.4, 0.0))
    marble = textured("Picture", textures.to_image("marble", textures.marble(), "sRGB"), roughness=0.4)
    frame = joined([box((1.3, 0.05, 0.9), 0.01).painted(1), tools.upright_quad((-0.58, -0.03, -0.38), 1.16, 0.76)])
    tools.place(scene, "Picture", to_mesh("Picture", frame, [marble, oak]), (2.7, ROOM[1] - 0.03, 1.75))


def build(scene: bpy.types.Scene) -> None:
    build_room(scene)
    build_furniture(scene)
    tools.aim_camera(scene, (5.9, 0.35, 1.5), (2.0, 3.6, 0.95), 20.0)
    tools.set_picture(scene)


if __name__ == "__main__":
    tools.run_script(__doc__, "bright_interior", build)
