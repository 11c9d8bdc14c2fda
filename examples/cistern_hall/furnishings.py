"""The smaller things: hanging lamps, posts, floating candles, jars and the head that watches over the water."""

import bpy
import numpy as np

from .shapes import TAU, Shape, box, joined, lathe, sphere, tube

# Materials of a shape that carries light: its body first, then what glows.
BODY, GLOW, TRIM = 0, 1, 2


def ring(radius: float, thickness: float, segments: int = 48) -> Shape:
    angle = np.linspace(0.0, TAU, segments + 1)
    path = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros_like(angle)], axis=1)
    return tube(path, thickness, 8)


def chain(length: float) -> Shape:
    """Links that hang from (0, 0, length) down to the origin, each turned against the last."""
    angle = np.linspace(0.0, TAU, 17)
    upright = np.stack([0.022 * np.cos(angle), np.zeros_like(angle), 0.042 * np.sin(angle)], axis=1)
    link = tube(upright, 0.007, 6)
    count = int(length / 0.068)
    return joined([link.moved((0.0, 0.0, (k + 0.5) * 0.068), 0.25 * TAU * (k % 2)) for k in range(count)])


def hanging_lamp(chain_length: float) -> Shape:
    """A bronze cage around a glowing globe, which is at the origin."""
    cap = lathe([(0.20, 0.15), (0.21, 0.17), (0.12, 0.24), (0.05, 0.27), (0.04, 0.33), (0.01, 0.35)], 40)
    dish = lathe([(0.01, -0.26), (0.04, -0.25), (0.05, -0.21), (0.15, -0.17), (0.19, -0.15), (0.17, -0.14)], 40)
    bars = []
    for k in range(6):
        s = np.linspace(-1.0, 1.0, 16)
        bow = 0.17 + 0.05 * (1.0 - s * s)
        angle = TAU * k / 6.0
        bars.append(tube(np.stack([bow * np.cos(angle), bow * np.sin(angle), 0.16 * s], axis=1), 0.008, 6))
    body = joined([cap, dish, *bars, ring(0.22, 0.012), chain(chain_length).moved((0.0, 0.0, 0.34))])
    return joined([body, sphere(0.11, 16).painted(GLOW)])


def candle() -> Shape:
    """A candle in a floating bronze bowl; the water line is the origin."""
    stick = lathe([(0.035, 0.0), (0.036, 0.09), (0.030, 0.10), (0.008, 0.095)], 24)
    bowl = lathe([(0.02, -0.03), (0.10, -0.015), (0.14, 0.02), (0.135, 0.02), (0.09, 0.0), (0.02, -0.005)], 32)
    flame = lathe([(0.002, 0.105), (0.012, 0.12), (0.013, 0.135), (0.007, 0.16), (0.001, 0.18)], 12)
    return joined([stick, flame.painted(GLOW), bowl.painted(TRIM)])


def post() -> Shape:
    """A post of the walkway with a small lamp on top, standing at the origin."""
    outline = [(0.07, -0.9), (0.07, 0.04), (0.05, 0.08), (0.032, 0.10), (0.030, 0.72), (0.06, 0.75), (0.06, 0.77)]
    foot = lathe(outline, 24)
    hood = lathe([(0.09, 0.93), (0.09, 0.94), (0.02, 0.99), (0.004, 1.03)], 24)
    bars = [
        tube(np.array([(0.06 * np.cos(a), 0.06 * np.sin(a), z) for z in (0.77, 0.85, 0.93)]), 0.006, 6)
        for a in TAU * np.arange(4) / 4.0
    ]
    return joined([foot, hood, *bars, sphere(0.045, 12).moved((0.0, 0.0, 0.84)).painted(GLOW)])


def rope(length: float, sag: float) -> Shape:
    """Hangs along Y between two posts."""
    s = np.linspace(-1.0, 1.0, 40)
    path = np.stack([np.zeros_like(s), 0.5 * length * s, -sag * (1.0 - s * s)], axis=1)
    return tube(path, 0.016, 10)


def jar() -> Shape:
    """An amphora 0.85 m high with two handles."""
    profile = [(0.02, 0.0), (0.09, 0.0), (0.10, 0.03), (0.07, 0.06), (0.12, 0.16), (0.21, 0.32), (0.25, 0.46)]
    profile += [(0.23, 0.56), (0.15, 0.65), (0.085, 0.70), (0.075, 0.79), (0.10, 0.84), (0.105, 0.86), (0.08, 0.86)]
    profile += [(0.06, 0.80), (0.065, 0.70)]
    points = np.asarray(profile)
    # A smooth outline through the points above.
    at = np.linspace(0.0, len(points) - 1.0, 90)
    smooth = np.stack([np.interp(at, np.arange(len(points)), points[:, k]) for k in range(2)], axis=1)
    kernel = np.array([0.1, 0.2, 0.4, 0.2, 0.1])
    smooth[2:-2] = np.stack([np.convolve(smooth[:, k], kernel, mode="valid") for k in range(2)], axis=1)
    handle = np.array([(0.08, 0.0, 0.80), (0.17, 0.0, 0.81), (0.21, 0.0, 0.76), (0.21, 0.0, 0.66), (0.19, 0.0, 0.60)])
    fine = np.stack([np.interp(np.linspace(0, 4, 24), np.arange(5), handle[:, k]) for k in range(3)], axis=1)
    handles = [tube(fine, 0.018, 10).moved(turn=turn) for turn in (0.0, 0.5 * TAU)]
    return joined([lathe(smooth, 72, (1.0, 1.0)), *handles])


def brazier() -> Shape:
    """A golden tripod with a bowl, in which a ball of glass rests; the ball is material 1."""
    bowl = lathe([(0.01, 0.62), (0.12, 0.63), (0.25, 0.70), (0.31, 0.80), (0.33, 0.80), (0.29, 0.69), (0.14, 0.60)], 64)
    legs = []
    for k in range(3):
        angle = TAU * k / 3.0
        s = np.linspace(0.0, 1.0, 24)
        reach = 0.34 - 0.16 * np.sin(np.pi * s) ** 2 - 0.06 * s
        legs.append(tube(np.stack([reach * np.cos(angle), reach * np.sin(angle), 0.70 * s], axis=1), 0.022, 10))
    ball = sphere(0.27, 64).moved((0.0, 0.0, 0.95))
    return joined([bowl, ring(0.24, 0.015).moved((0.0, 0.0, 0.30)), *legs, ball.painted(1)])


def pedestal() -> Shape:
    return box((0.9, 0.9, 0.5), 0.03)


def watcher(name: str, material: bpy.types.Material) -> bpy.types.Mesh:
    """Blender's monkey, subdivided: this hall's answer to the Medusa heads of Istanbul's cistern."""
    import bmesh

    mesh = bpy.data.meshes.new(name)
    work = bmesh.new()
    work.loops.layers.uv.new("UVMap")
    bmesh.ops.create_monkey(work, calc_uvs=True)
    work.to_mesh(mesh)
    work.free()
    mesh.materials.append(material)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), dtype=bool))
    return mesh
