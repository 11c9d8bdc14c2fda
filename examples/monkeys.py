"""Builds Monkeys, a scene after [Stefanescu 2025]: Suzannes, spheres and cones on a floor among coloured sphere lights.

.venv/bin/python examples/monkeys.py [FILE.blend] [--lights 60] [--emissive]

Everything is Lambertian. The lights hang and lie close to the surfaces, so that the pools of their light overlap: the
case in which a coarse cache of light samples shows its cells.
"""

import bpy
import numpy as np

import scene_tools as tools
from cistern_hall.shapes import Shape, lathe, sphere, to_mesh

FLOOR = 40.0  # side, metres
FIELD = 14.0  # things stand within this square's side
SPACING = 2.3  # metres between things
MOST_LIGHTS = 2000
HUES = ((1.0, 0.1, 0.05), (0.06, 0.2, 1.0), (0.1, 1.0, 0.15), (1.0, 0.55, 0.08), (0.8, 0.08, 1.0), (0.08, 0.8, 1.0))


def suzanne(material: bpy.types.Material) -> bpy.types.Mesh:
    import bmesh

    mesh = bpy.data.meshes.new("Suzanne")
    work = bmesh.new()
    bmesh.ops.create_monkey(work)
    bmesh.ops.subdivide_edges(work, edges=work.edges, cuts=1, use_grid_fill=True, smooth=0.6)
    work.to_mesh(mesh)
    work.free()
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), dtype=bool))
    mesh.materials.append(material)
    return mesh


def cone(radius: float, height: float, segments: int = 48) -> Shape:
    return lathe([(1e-3, 0.0), (radius, 0.0), (1e-3, height)], segments)


def build_things(scene: bpy.types.Scene, random: np.random.Generator) -> None:
    """A jittered grid of things."""
    grey = [tools.matt(f"Clay {k}", c) for k, c in enumerate([(0.8, 0.78, 0.75), (0.6, 0.6, 0.62), (0.75, 0.7, 0.6)])]
    monkeys = [suzanne(material) for material in grey]
    balls = [to_mesh(f"Ball {k}", sphere(1.0, 48), [material]) for k, material in enumerate(grey)]
    cones = [to_mesh(f"Cone {k}", cone(0.8, 1.9), [material]) for k, material in enumerate(grey)]
    steps = np.arange(-0.5 * FIELD, 0.5 * FIELD + 0.1, SPACING)
    for row, y in enumerate(steps):
        for column, x in enumerate(steps):
            at = (float(x + random.uniform(-0.4, 0.4)), float(y + random.uniform(-0.4, 0.4)))
            size, kind, look = random.uniform(0.5, 0.85), (row + 2 * column) % 4, random.integers(3)
            if kind < 2:
                thing = tools.place(scene, "Suzanne", monkeys[look], (*at, 0.92 * size), random.uniform(-0.9, 0.9))
                thing.rotation_euler.x = random.uniform(-0.35, 0.1)
            elif kind == 2:
                thing = tools.place(scene, "Ball", balls[look], (*at, size))
            else:
                thing = tools.place(scene, "Cone", cones[look], (*at, 0.0))
            thing.scale = (size, size, size)


def light_place(random: np.random.Generator, taken: list[tuple[float, float]]) -> tuple[float, float]:
    """A point of the field between the things."""
    while True:
        x, y = random.uniform(-0.55 * FIELD, 0.55 * FIELD, 2)
        if all(np.hypot(x - a, y - b) > 0.95 for a, b in taken):
            return float(x), float(y)


def build_lights(scene: bpy.types.Scene, lights: int, is_emissive: bool, random: np.random.Generator) -> None:
    """A third lie near the floor, the rest hang above the things; dimmer the more there are."""
    places = [(thing.location.x, thing.location.y) for thing in scene.objects if thing.type == "MESH"]
    for k in range(lights):
        radius, colour = random.uniform(0.06, 0.2), HUES[k % len(HUES)]
        is_low = k % 3 == 0
        height = radius + random.uniform(0.02, 0.4) if is_low else random.uniform(1.5, 2.8)
        power = (12.0 if is_low else 60.0) * min(1.0, 60.0 / lights) * random.uniform(0.6, 1.4)
        at = (*(light_place(random, places) if is_low else random.uniform(-0.55 * FIELD, 0.55 * FIELD, 2)), height)
        if is_emissive:
            glow = tools.glow(f"Glow {k}", colour, power / (4.0 * np.pi**2 * radius**2))
            tools.place(scene, "Light", to_mesh(f"Light {k}", sphere(radius, 12), [glow]), at)
        else:
            tools.place(scene, "Light", tools.sphere_light(f"Light {k}", colour, power, radius), at)


def build(scene: bpy.types.Scene, lights: int = 60, is_emissive: bool = False) -> None:
    random = np.random.default_rng(3)
    build_things(scene, random)
    build_lights(scene, lights, is_emissive, random)
    half = 0.5 * FLOOR
    floor = tools.ground((-half, -half), (half, half))
    tools.place(scene, "Floor", to_mesh("Floor", floor, [tools.matt("Floor", (0.6, 0.6, 0.6))]), (0, 0, 0))
    tools.aim_camera(scene, (1.5, -12.6, 4.6), (-0.4, -2.2, 0.5), 32.0)
    tools.set_picture(scene)


def main() -> None:
    parser = tools.argument_parser(__doc__, "monkeys")
    parser.add_argument("--lights", type=tools.count_between(1, MOST_LIGHTS), default=60, help=f"1 to {MOST_LIGHTS}")
    parser.add_argument("--emissive", action="store_true", help="spheres of triangles in place of sphere lights")
    arguments = parser.parse_args()
    build(tools.empty_scene(), arguments.lights, arguments.emissive)
    tools.save(arguments.blend)
    print(f"Monkeys with {arguments.lights} lights: {arguments.blend}")


if __name__ == "__main__":
    main()
