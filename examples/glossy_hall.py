"""Builds Glossy Hall: polished marble, brass and lacquer between luminous panels. Most light arrives by gloss.

.venv/bin/python examples/glossy_hall.py [FILE.blend]
"""

import bpy
import numpy as np

import scene_tools as tools
from cistern_hall import textures
from cistern_hall.materials import principled, textured
from cistern_hall.shapes import TAU, Shape, box, joined, lathe, sphere, to_mesh

HALF_WIDTH, LENGTH, HEIGHT = 4.5, 22.0, 5.0
BAY = 3.6
PANEL_POWER_W = 160.0  # of each, radiant
WALL, TRIM = 0, 1


def column() -> Shape:
    """A smooth shaft between turned rings (material 1)."""
    shaft = lathe([(0.26, 0.3), (0.27, 1.8), (0.23, HEIGHT - 0.5)], 64)
    rings = [(0.001, 0.0), (0.40, 0.0), (0.40, 0.12), (0.33, 0.16), (0.36, 0.24), (0.27, 0.31)]
    top = [(radius, HEIGHT - 0.15 - z) for radius, z in reversed(rings)]
    return joined([shaft, lathe(rings, 64).painted(TRIM), lathe(top, 64).painted(TRIM)])


def side_wall() -> Shape:
    """Lacquered panels in brass frames along X, facing -Y."""
    parts = [tools.upright_quad((0.0, 0.0, 0.0), LENGTH, HEIGHT)]
    for x in np.arange(0.25, LENGTH - BAY + 0.5, BAY):
        frame = box((BAY - 0.5, 0.08, 3.2), 0.02).moved((x + 0.5 * BAY, 0.0, 2.2)).painted(TRIM)
        parts += [frame, box((BAY - 0.7, 0.14, 3.0), 0.02).moved((x + 0.5 * BAY, 0.0, 2.2))]
    return joined(parts)


def fountain() -> Shape:
    """A tiered bowl with a ball on top."""
    profile = [(0.001, 0.0), (0.9, 0.0), (0.9, 0.1), (0.3, 0.2), (0.16, 0.6), (0.3, 0.85), (0.95, 1.05), (1.0, 1.15)]
    bowl = lathe([*profile, (0.9, 1.12), (0.001, 0.95)], 96)
    return joined([bowl, sphere(0.34, 48).moved((0.0, 0.0, 1.32)).painted(TRIM)])


def build_shell(scene: bpy.types.Scene) -> None:
    marble = textures.to_image("marble", textures.marble(), "sRGB")
    floor = textured("Polished Floor", marble, roughness=0.12, specular_ior_level=0.8)
    lacquer, _ = principled("Lacquer", (0.35, 0.05, 0.04), roughness=0.3, coat_weight=1.0, coat_roughness=0.06)
    brass, _ = principled("Brass", (0.90, 0.66, 0.32), metallic=1.0, roughness=0.18)
    ceiling, _ = principled("Ceiling", (0.78, 0.76, 0.72), roughness=0.25)
    ground = tools.ground((-HALF_WIDTH, 0.0), (HALF_WIDTH, LENGTH), tile=3.0)
    tools.place(scene, "Floor", to_mesh("Floor", ground, [floor]), (0, 0, 0))
    above = tools.ground((-HALF_WIDTH, -LENGTH), (HALF_WIDTH, 0.0)).moved(scale=(1.0, -1.0, 1.0))
    tools.place(scene, "Ceiling", to_mesh("Ceiling", above, [ceiling]), (0, 0, HEIGHT))
    side = to_mesh("Side", side_wall(), [lacquer, brass])
    tools.place(scene, "Right", side, (HALF_WIDTH, LENGTH, 0.0), -0.25 * TAU)
    tools.place(scene, "Left", side, (-HALF_WIDTH, 0.0, 0.0), 0.25 * TAU)
    wall = tools.upright_quad((-HALF_WIDTH, 0.0, 0.0), 2.0 * HALF_WIDTH, HEIGHT)
    ends = joined([wall.moved((0.0, LENGTH, 0.0)), wall.moved(turn=0.5 * TAU)])
    tools.place(scene, "Ends", to_mesh("Ends", ends, [lacquer]), (0, 0, 0))
    stone = textured("Column Marble", marble, roughness=0.2)
    shaft = to_mesh("Column", column(), [stone, brass])
    for y in np.arange(0.5 * BAY, LENGTH, BAY):
        for x in (-2.9, 2.9):
            tools.place(scene, "Column", shaft, (x, y, 0.0))
    tools.place(scene, "Fountain", to_mesh("Fountain", fountain(), [stone, brass]), (0.0, 3.3 * BAY, 0.0))


def build_lights(scene: bpy.types.Scene) -> None:
    """A luminous panel in the ceiling of each bay, warm and cool in turn, and brass globes under area lamps."""
    for k, y in enumerate(np.arange(BAY, LENGTH - 1.0, BAY)):
        colour = (1.0, 0.80, 0.55) if k % 2 else (0.75, 0.87, 1.0)
        panel = tools.ground((-0.9, -0.3), (0.9, 0.3)).moved(scale=(1.0, -1.0, 1.0))
        glow = tools.glow(f"Panel {k}", colour, PANEL_POWER_W / (np.pi * 1.08))
        tools.place(scene, "Panel", to_mesh("Panel", panel, [glow]), (0.0, y, HEIGHT - 0.03))
    for y in (2.0 * BAY, 5.0 * BAY):
        for x in (-3.7, 3.7):
            light = bpy.data.lights.new("Wall Lamp", "AREA")
            light.energy, light.size, light.color = 60.0, 0.3, (1.0, 0.6, 0.3)
            lamp = tools.place(scene, "Wall Lamp", light, (x, y, 3.8))
            lamp.rotation_euler.y = np.copysign(0.6, -x)


def build_balls(scene: bpy.types.Scene) -> None:
    """Spheres of several roughnesses on the floor."""
    ball = sphere(0.42, 64)
    looks = [
        principled("Chrome", (0.9, 0.9, 0.92), metallic=1.0, roughness=0.03)[0],
        principled("Satin", (0.9, 0.75, 0.5), metallic=1.0, roughness=0.35)[0],
        principled("Enamel", (0.05, 0.18, 0.40), roughness=0.08)[0],
    ]
    for k, (x, y) in enumerate([(-1.5, 5.2), (1.3, 6.6), (-0.9, 8.4), (1.7, 9.2), (-1.9, 11.0)]):
        tools.place(scene, "Ball", to_mesh("Ball", ball, [looks[k % 3]]), (x, y, 0.42))


def build(scene: bpy.types.Scene) -> None:
    build_shell(scene)
    build_lights(scene)
    build_balls(scene)
    tools.aim_camera(scene, (-0.9, 0.6, 1.7), (0.3, 11.0, 1.5), 24.0)
    tools.set_picture(scene)


if __name__ == "__main__":
    tools.run_script(__doc__, "glossy_hall", build)
