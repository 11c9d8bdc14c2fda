"""What the hall is built of: columns with carved capitals, groin vaults, arches, light wells, walls and the water."""

import numpy as np

from .shapes import TAU, Array, Shape, box, joined, lathe, loft_square, patch, sphere, tube

BAY = 4.6  # distance between columns
SPAN = 0.5 * BAY  # radius of the vaults
SPRING = 5.2  # height above the water at which the vaults spring
FLOOR = -0.9  # bottom of the water
SHAFT_RADIUS = 0.40


def acanthus_leaf(height: float, width: float, rows: int = 30, columns: int = 24) -> Shape:
    """A leaf standing at the origin against -X that curls over outwards, with lobes and ribs."""
    s = np.linspace(0.0, 1.0, rows)
    lean = 0.12 + 2.9 * s**3.2  # angle of the spine from upright
    step = height * 1.25 / rows
    out, up = np.cumsum(np.sin(lean)) * step, np.cumsum(np.cos(lean)) * step
    t = np.linspace(-1.0, 1.0, columns)
    lobes = 1.0 - 0.28 * np.abs(np.cos(4.5 * np.pi * s)) * (s < 0.93)
    half = 0.5 * width * (0.80 + 0.30 * np.sin(np.pi * s)) * np.sqrt(np.maximum(1.0 - s**6, 0.02)) * lobes
    rib = 0.020 * np.exp(-((t / 0.13) ** 2)) + 0.008 * np.cos(6.0 * np.pi * np.abs(t))
    cup = 0.035 * t * t
    lift = (rib - cup)[None, :] * np.sin(np.pi * np.clip(s, 0.08, 0.95))[:, None]
    points = np.empty((rows, columns, 3))
    points[..., 0] = out[:, None] + lift * np.cos(lean)[:, None]
    points[..., 1] = half[:, None] * t[None, :]
    points[..., 2] = up[:, None] - lift * np.sin(lean)[:, None]
    return patch(points, (0.5, 1.0))


def volute(reach: float) -> Shape:
    """A scroll that rises from the bell towards a corner along +X."""
    s = np.linspace(0.0, 1.0, 90)
    turn = 3.6 * np.pi * s
    radius = 0.115 * (1.0 - 0.80 * s)
    centre = np.array([reach, -0.11])
    path = np.zeros((len(s), 3))
    path[:, 0] = centre[0] - radius * np.cos(turn + 0.2)
    path[:, 2] = centre[1] + radius * np.sin(turn + 0.2)
    stem = np.linspace(0.0, 1.0, 24)[:-1, None]
    start = np.array([0.42, 0.0, -0.52])
    rise = start + (path[0] - start) * np.concatenate([stem**1.6, stem, stem**0.7], axis=1)
    radii = np.concatenate([np.linspace(0.02, 0.045, len(rise)), 0.045 - 0.02 * s])
    return tube(np.concatenate([rise, path]), radii, 10)


def capital() -> Shape:
    """A Corinthian capital, 0.95 m high, its foot at the origin: a bell, two rows of leaves, scrolls and an abacus."""
    bell_z = np.linspace(0.0, 0.82, 24)
    bell = lathe(np.stack([0.37 + 0.20 * (bell_z / 0.82) ** 3, bell_z], axis=1), 64)
    parts = [bell, lathe([(0.38, -0.05), (0.43, -0.04), (0.45, 0.0), (0.43, 0.04), (0.38, 0.05)], 64)]
    low, high = acanthus_leaf(0.42, 0.31), acanthus_leaf(0.70, 0.31)
    for k in range(8):
        angle = TAU * k / 8.0
        across = np.array([np.cos(angle), np.sin(angle), 0.0])
        parts.append(low.moved(0.385 * across, angle))
        angle += TAU / 16.0
        across = np.array([np.cos(angle), np.sin(angle), 0.0])
        parts.append(high.moved(0.375 * across, angle))
    scroll = volute(0.70)
    parts += [scroll.moved((0.0, 0.0, 0.84), TAU * (k + 0.5) / 4.0) for k in range(4)]
    parts += [sphere(0.07, 16).moved((0.62 * np.cos(a), 0.62 * np.sin(a), 0.80)) for a in TAU * np.arange(4) / 4.0]
    abacus = [(0.30, 0.80), (0.58, 0.80), (0.60, 0.83), (0.60, 0.88), (0.64, 0.90), (0.66, 0.95), (0.30, 0.95)]
    parts.append(loft_square(abacus, 16, hollow=0.12).moved(scale=(1.08, 1.08, 1.0)))
    return joined(parts)


def column(fluted: bool) -> Shape:
    """From the floor to the spring of the vaults. Material 0 is the shaft, 1 the carved stone."""
    top = SPRING - 0.95 - 0.35
    z = np.linspace(FLOOR, top, 48)
    share = (z - FLOOR) / (top - FLOOR)
    swelling = SHAFT_RADIUS * (1.06 - 0.14 * share + 0.03 * np.sin(np.pi * share))
    shaft = lathe(np.stack([swelling, z], axis=1), 160, (2.0, 4.0), flutes=20 if fluted else 0)
    foot = [(0.70, FLOOR), (0.70, 0.02), (0.68, 0.06), (0.60, 0.07)]
    plinth = loft_square(foot, 4)
    ring = TAU * np.linspace(-0.25, 0.25, 12)
    torus = np.stack([0.52 + 0.10 * np.cos(ring), 0.17 + 0.10 * np.sin(ring)], axis=1)
    small = np.stack([0.46 + 0.05 * np.cos(ring), 0.34 + 0.05 * np.sin(ring)], axis=1)
    parts = [plinth, lathe(torus, 96), lathe(small, 96), capital().moved((0.0, 0.0, top))]
    impost = [(0.40, top + 0.95), (0.62, top + 0.95), (0.74, SPRING - 0.03), (0.74, SPRING), (0.30, SPRING)]
    parts.append(loft_square(impost, 4))
    return joined([shaft] + [part.painted(1) for part in parts])


def vault(steps: int = 120) -> Shape:
    """The groin vault over one bay, centred on the origin, seen from below. The bricks follow each of the barrels."""
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, steps + 1)
    # Fewer points where the arcs are upright would leave gaps between neighbours: the edges are shared exactly.
    a, b = np.meshgrid(angle, angle[::-1])
    height = np.maximum(np.cos(a), np.cos(b))
    points = SPAN * np.stack([np.sin(a), np.sin(b), height], axis=2)
    points[..., 2] += SPRING
    shape = patch(points)
    corner_a, corner_b = a.ravel()[shape.quads], b.ravel()[shape.quads]
    along_y = (np.abs(corner_a).mean(axis=1) <= np.abs(corner_b).mean(axis=1))[:, None]
    arc = SPAN * np.where(along_y, corner_a, corner_b)
    length = SPAN * np.sin(np.where(along_y, corner_b, corner_a))
    uvs = np.stack([length, arc], axis=2) / 1.6
    return Shape(shape.positions, shape.quads, uvs, shape.materials)


def arch(steps: int = 64) -> Shape:
    """A rib of cut stone between two columns that stand along Y, its middle over the origin."""
    angle = np.linspace(0.0, np.pi, steps + 1)
    section = np.array([(-0.30, 0.10), (-0.30, -0.12), (-0.24, -0.18), (0.24, -0.18), (0.30, -0.12), (0.30, 0.10)])
    radius = SPAN + section[:, 1]
    points = np.empty((steps + 1, len(section), 3))
    points[..., 0] = section[:, 0][None, :]
    points[..., 1] = -np.cos(angle)[:, None] * radius[None, :]
    points[..., 2] = SPRING + np.sin(angle)[:, None] * radius[None, :]
    shape = patch(points, (1.0, 6.0))
    return Shape(shape.positions, shape.quads[:, ::-1], shape.uvs[:, ::-1], shape.materials)


def light_well(top: float, columns: int = 48, rows: int = 12) -> Shape:
    """Four walls from the arches around an open bay up to the ground, where the sky begins."""
    y = SPAN * np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, columns + 1))
    low = SPRING + np.sqrt(np.maximum(SPAN**2 - y**2, 0.0))
    share = np.linspace(0.0, 1.0, rows + 1)
    points = np.empty((rows + 1, columns + 1, 3))
    points[..., 0] = -SPAN
    points[..., 1] = y
    points[..., 2] = low + (top - low) * share[:, None]
    side = patch(points, (3.0, 3.0))
    uvs = side.positions[side.quads][..., 1:] / 1.6
    side = Shape(side.positions, side.quads, uvs, side.materials)
    return joined([side.moved(turn=TAU * k / 4.0) for k in range(4)])


def walls(low: tuple[float, float], high: tuple[float, float], steps: int = 40) -> Shape:
    """The four outer walls, facing inwards, with courses of bricks 1.6 m to the tile."""
    top = SPRING + SPAN + 0.3
    corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
    sides = []
    for k, start in enumerate(corners):
        end = corners[(k + 1) % 4]
        share = np.linspace(1.0, 0.0, steps + 1)
        points = np.empty((steps + 1, steps + 1, 3))
        points[..., 0] = start[0] + (end[0] - start[0]) * share
        points[..., 1] = start[1] + (end[1] - start[1]) * share
        points[..., 2] = np.linspace(FLOOR, top, steps + 1)[:, None]
        sides.append(patch(points, (np.hypot(end[0] - start[0], end[1] - start[1]) / 1.6, (top - FLOOR) / 1.6)))
    return joined(sides)


def ripples(x: Array, y: Array, drops: Array) -> Array:
    """Height of the water in metres: a faint swell, and rings about `drops` of (x, y)."""
    rng = np.random.default_rng(71)
    height = np.zeros_like(x)
    for wavelength in np.geomspace(0.35, 2.4, 14):
        direction = TAU * rng.random()
        k = TAU / wavelength
        phase = k * (x * np.cos(direction) + y * np.sin(direction)) + TAU * rng.random()
        height += 0.0011 * wavelength**0.8 * np.sin(phase)
    for drop_x, drop_y in drops:
        distance = np.hypot(x - drop_x, y - drop_y)
        height += 0.006 * np.cos(TAU * distance / 0.34) * np.exp(-((distance / 1.1) ** 2))
    return height


def water(low: tuple[float, float], high: tuple[float, float], drops: Array, columns: int, rows: int) -> Shape:
    """The surface, with finer squares where y is small, near the camera."""
    x = np.linspace(low[0], high[0], columns + 1)
    y = low[1] + (high[1] - low[1]) * np.linspace(0.0, 1.0, rows + 1) ** 1.5
    grid_x, grid_y = np.meshgrid(x, y)
    return patch(np.stack([grid_x, grid_y, ripples(grid_x, grid_y, drops)], axis=2), (1.0, 1.0))


def dais() -> Shape:
    """Three round steps that rise out of the water."""
    profile: list[tuple[float, float]] = []
    for radius, z in ((1.75, FLOOR), (1.45, 0.18), (1.15, 0.36)):
        low = profile[-1][1] if profile else z
        top = low + 0.18 if profile else 0.18
        profile += [(radius, low), (radius, top - 0.03), (radius - 0.03, top)]
    profile.append((0.01, profile[-1][1]))
    return lathe(profile, 128, (6.0, 2.0))


def plank(length: float) -> Shape:
    """A board of the walkway, lying along X."""
    return box((length, 0.26, 0.06), 0.012)
