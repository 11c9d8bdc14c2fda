"""Builds City Grid, a night scene after [Stefanescu 2025]: streets between buildings, lit by street lamps alone.

.venv/bin/python examples/city_grid.py [FILE.blend] [--lamps 512] [--lights EMISSIVE|SPHERE] [--view STREET|ABOVE]

Everything is Lambertian. A lamp's light is a lantern of emissive panes (8 triangles each), or a sphere light.
"""

import bpy
import numpy as np

import scene_tools as tools
from cistern_hall.shapes import TAU, Shape, box, joined, lathe, to_mesh

LAMPS_PER_BLOCK = 8
MOST_LAMPS = 2000
BLOCK = 26.0  # side of a block with its pavement, metres
STREET = 9.0
PITCH = BLOCK + STREET
PAVEMENT = 3.2  # width; KERB is its height
KERB = 0.15
STOREY = 3.2
LAMP_HEIGHT = 3.6  # of the middle of the lantern
LANTERN = (0.30, 0.30, 0.42)
LAMP_POWER_W = 900.0  # radiant; some ten times a real one, so that the picture needs no exposure setting
SODIUM = (1.0, 0.66, 0.32)
WHITE = (0.85, 0.92, 1.0)
WALL, TRIM, PANE = 0, 1, 2


def building(width: float, storeys: int) -> Shape:
    """A square house of flat walls with rows of dark windows, ledges and a roof edge, standing on the origin."""
    height = STOREY * storeys
    parts = [box((width, width, height), 0.02).moved((0.0, 0.0, 0.5 * height))]
    parts += [box((width + 0.5, width + 0.5, 0.22), 0.02).moved((0.0, 0.0, STOREY)).painted(TRIM)]
    parts += [box((width + 0.7, width + 0.7, 0.4), 0.02).moved((0.0, 0.0, height)).painted(TRIM)]
    across = np.arange(-0.5 * width + 1.1, 0.5 * width - 1.1, 2.2)
    for turn in TAU * np.arange(4) / 4.0:
        for storey in range(storeys):
            bottom = STOREY * storey + (0.4 if storey == 0 else 1.0)
            for x in across:
                corner = (x + 0.4, -0.5 * width - 0.02, bottom)
                parts.append(tools.upright_quad(corner, 1.2, STOREY * (storey + 1) - 0.6 - bottom, turn).painted(PANE))
    return joined(parts)


def lamp_post() -> Shape:
    """Post and hood; the lantern between them is left open."""
    top, half = LAMP_HEIGHT + 0.5 * LANTERN[2], 0.5 * LANTERN[2]
    outline = [(0.12, 0.0), (0.11, 0.5), (0.06, 0.6), (0.05, LAMP_HEIGHT - half - 0.1), (0.16, LAMP_HEIGHT - half)]
    foot = lathe([*outline, (0.001, LAMP_HEIGHT - half)], 16)
    hood = lathe([(0.001, top), (0.26, top), (0.22, top + 0.06), (0.04, top + 0.22), (0.001, top + 0.26)], 16)
    return joined([foot, hood])


def lantern() -> Shape:
    """Four upright panes."""
    x, _, z = LANTERN
    corner = (-0.5 * x, -0.5 * x, LAMP_HEIGHT - 0.5 * z)
    return joined([tools.upright_quad(corner, x, z, turn) for turn in TAU * np.arange(4) / 4.0])


def car() -> Shape:
    body = box((4.2, 1.7, 0.65), 0.1).moved((0.0, 0.0, 0.62))
    cabin = box((2.2, 1.5, 0.6), 0.15).moved((-0.2, 0.0, 1.2)).painted(TRIM)
    wheels = [
        box((0.62, 0.22, 0.62), 0.2).moved((x, y, 0.31)).painted(PANE) for x in (-1.3, 1.3) for y in (-0.78, 0.78)
    ]
    return joined([body, cabin, *wheels])


def blocks(lamps: int) -> list[tuple[float, float]]:
    """Middles (x, y) of the blocks of a square town with room for the lamps, the innermost first."""
    side = int(np.ceil(np.sqrt(lamps / LAMPS_PER_BLOCK)))
    middles = (np.arange(side) - 0.5 * (side - 1)) * PITCH
    found = [(float(x), float(y)) for y in middles for x in middles]
    return sorted(found, key=lambda at: (round(at[0] ** 2 + at[1] ** 2, 3), at))


def lamp_places(middle: tuple[float, float]) -> list[tuple[float, float]]:
    """Two lamps on each side of a block, near the kerb."""
    reach, step = 0.5 * BLOCK - 0.6, 0.25 * BLOCK
    around = [(s * reach, t * step) for s in (-1, 1) for t in (-1, 1)] + [
        (t * step, s * reach) for s in (-1, 1) for t in (-1, 1)
    ]
    return [(middle[0] + x, middle[1] + y) for x, y in around]


def build_houses(scene: bpy.types.Scene, middles: list[tuple[float, float]], random: np.random.Generator) -> None:
    stone = tools.matt("Trim", (0.55, 0.53, 0.50))
    pane = tools.matt("Pane", (0.05, 0.06, 0.08))
    walls = [(0.62, 0.55, 0.45), (0.55, 0.32, 0.25), (0.68, 0.66, 0.62), (0.42, 0.45, 0.50), (0.66, 0.58, 0.36)]
    half = 0.5 * (BLOCK - 2.0 * PAVEMENT)
    kinds = []
    for k, colour in enumerate(walls):
        wall = tools.matt(f"Wall {k}", colour)
        kinds += [
            to_mesh(f"House {k} {n}", building(half - 0.6, n), [wall, stone, pane]) for n in (2 + k, 5 + (3 * k) % 7)
        ]
    slab = to_mesh("Block", box((BLOCK, BLOCK, KERB), 0.03), [tools.matt("Pavement", (0.40, 0.39, 0.37))])
    for x, y in middles:
        tools.place(scene, "Block", slab, (x, y, 0.5 * KERB))
        for dx, dy in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            at = (x + 0.5 * dx * half, y + 0.5 * dy * half, KERB)
            tools.place(scene, "House", kinds[random.integers(len(kinds))], at, 0.25 * TAU * random.integers(4))


def build_lamps(scene: bpy.types.Scene, middles: list[tuple[float, float]], lamps: int, lights: str) -> None:
    """`lamps` of them, those of the innermost blocks first; every block burns sodium or white."""
    post = to_mesh("Lamp post", lamp_post(), [tools.matt("Iron", (0.10, 0.10, 0.11))])
    pane_area = 4.0 * LANTERN[0] * LANTERN[2]
    heads = []
    for name, colour in (("Sodium", SODIUM), ("White", WHITE)):
        if lights == "EMISSIVE":
            glow = tools.glow(name, colour, LAMP_POWER_W / (np.pi * pane_area))
            heads.append((to_mesh(f"{name} lantern", lantern(), [glow]), 0.0))
        else:
            heads.append((tools.sphere_light(f"{name} lamp", colour, LAMP_POWER_W, 0.12), LAMP_HEIGHT))
    places = [(k, at) for k, middle in enumerate(middles) for at in lamp_places(middle)][:lamps]
    for block, (x, y) in places:
        head, height = heads[block % 3 == 0]
        tools.place(scene, "Lamp post", post, (x, y, KERB))
        tools.place(scene, "Lamp", head, (x, y, KERB + height))


def build_streets(scene: bpy.types.Scene, middles: list[tuple[float, float]], random: np.random.Generator) -> None:
    reach = max(abs(c) for middle in middles for c in middle) + PITCH
    ground = tools.ground((-reach, -reach), (reach, reach))
    tools.place(scene, "Streets", to_mesh("Streets", ground, [tools.matt("Asphalt", (0.16, 0.16, 0.17))]), (0, 0, 0))
    paint = [tools.matt(f"Paint {k}", c) for k, c in enumerate([(0.5, 0.06, 0.05), (0.1, 0.2, 0.45), (0.7, 0.7, 0.68)])]
    rest = [tools.matt("Cabin", (0.12, 0.13, 0.15)), tools.matt("Tyre", (0.03, 0.03, 0.03))]
    kinds = [to_mesh(f"Car {k}", car(), [colour, *rest]) for k, colour in enumerate(paint)]
    for x, y in middles:
        for _ in range(2):
            along, side = random.uniform(-0.4, 0.4) * BLOCK, random.choice((-1.0, 1.0))
            at = (x + side * (0.5 * BLOCK + 1.1), y + along, 0.0)
            tools.place(scene, "Car", kinds[random.integers(3)], at, 0.25 * TAU * side)


def aim(scene: bpy.types.Scene, view: str, lamps: int) -> None:
    """From a pavement along a street, or from above one corner over all the town."""
    side = np.ceil(np.sqrt(lamps / LAMPS_PER_BLOCK))
    crossing = 0.5 * PITCH * (side % 2)  # middle of a street nearest to the middle of the town
    if view == "STREET":
        eye = (crossing + 0.5 * STREET + 1.6, crossing - 0.63 * PITCH, 1.75)
        tools.aim_camera(scene, eye, (crossing - 1.0, crossing + PITCH, 3.0), 24.0)
    else:
        reach = 0.5 * side * PITCH
        eye = (-0.3 * reach - 20.0, -0.6 * reach - 25.0, 0.35 * reach + 45.0)
        tools.aim_camera(scene, eye, (0.0, -0.1 * reach, 0.0), 28.0)


def build(scene: bpy.types.Scene, lamps: int = 512, lights: str = "EMISSIVE", view: str = "STREET") -> None:
    random = np.random.default_rng(11)
    middles = blocks(lamps)
    build_houses(scene, middles, random)
    build_lamps(scene, middles, lamps, lights)
    build_streets(scene, middles, random)
    aim(scene, view, lamps)
    tools.set_picture(scene)


def main() -> None:
    parser = tools.argument_parser(__doc__, "city_grid")
    parser.add_argument("--lamps", type=tools.count_between(1, MOST_LAMPS), default=512, help=f"1 to {MOST_LAMPS}")
    parser.add_argument("--lights", choices=("EMISSIVE", "SPHERE"), default="EMISSIVE")
    parser.add_argument("--view", choices=("STREET", "ABOVE"), default="STREET")
    arguments = parser.parse_args()
    build(tools.empty_scene(), arguments.lamps, arguments.lights, arguments.view)
    tools.save(arguments.blend)
    print(f"City Grid with {arguments.lamps} lamps: {arguments.blend}")


if __name__ == "__main__":
    main()
