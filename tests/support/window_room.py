"""A room with a window under an even sky, and pictures of it."""

from __future__ import annotations

import cistern_core as core
import numpy as np
from numpy.typing import NDArray

from tests.support.core_scenes import DEFAULTS, SceneDescription, principled
from tests.support.statistics import block_means

HALF, HEIGHT = 2.0, 2.5  # of a square room, m
SIDE, BOTTOM, TOP = 0.6, 0.8, 1.8  # of its window, in the wall at x = HALF
SIZE, SAMPLES, REPLICAS, BLOCKS = 32, 16, 16, 3


def room(
    brightness: float = 1.0,
    pane: int = 0,
    eye: tuple[float, float, float] = (-1.8, -1.5, 1.2),
    glass: tuple[float, ...] = (),
    lamps: bool = False,
    sheet: core.MaterialProgram | None = None,
    haze: core.MaterialProgram | None = None,
    card: core.MaterialProgram | None = None,
) -> core.Scene:
    """`pane`: kinds of rays that see a board in the window, which else is open; `glass`: how far faces of glass are
    beyond it, m, every other one the outside of a pane; `lamps`: one inside, and one outside that shines in; `sheet`:
    one of that material closes the window; `haze`: wide splats of it, inside and outside; `card`: one hangs there."""
    scene = SceneDescription()
    plaster = principled((0.7, 0.65, 0.6))
    w = 2.0 * HALF
    scene.add_quad((-HALF, -HALF, 0), (w, 0, 0), (0, w, 0), plaster, "floor")
    scene.add_quad((-HALF, -HALF, HEIGHT), (0, w, 0), (w, 0, 0), plaster, "ceiling")
    scene.add_quad((-HALF, -HALF, 0), (0, w, 0), (0, 0, HEIGHT), plaster, "back")
    scene.add_quad((-HALF, -HALF, 0), (0, 0, HEIGHT), (w, 0, 0), plaster, "right")
    scene.add_quad((-HALF, HALF, 0), (w, 0, 0), (0, 0, HEIGHT), plaster, "left")
    scene.add_quad((HALF, -HALF, 0), (0, 0, HEIGHT), (0, HALF - SIDE, 0), plaster, "beside")
    scene.add_quad((HALF, SIDE, 0), (0, 0, HEIGHT), (0, HALF - SIDE, 0), plaster, "beside")
    scene.add_quad((HALF, -SIDE, 0), (0, 0, BOTTOM), (0, 2 * SIDE, 0), plaster, "below")
    scene.add_quad((HALF, -SIDE, TOP), (0, 0, HEIGHT - TOP), (0, 2 * SIDE, 0), plaster, "above")
    if pane:
        scene.add_quad((HALF, -SIDE, BOTTOM), (0, 0, TOP - BOTTOM), (0, 2 * SIDE, 0), plaster, "pane", visibility=pane)
    if sheet:
        scene.add_quad((HALF + 0.01, -HALF, 0), (0, 0, HEIGHT), (0, w, 0), sheet, "sheet")
    clear = principled(transmission=1.0, roughness=0.0)
    for i, depth in enumerate(glass):
        margin = 0.2 if depth > 0.0 else 0.0  # the first may close the window, others are wider
        up, across = (0, 0, TOP - BOTTOM + 2.0 * margin), (0, 2.0 * (SIDE + margin), 0)
        corner = (HALF + depth, -SIDE - margin, BOTTOM - margin)
        scene.add_quad(corner, *((across, up) if i % 2 else (up, across)), clear, "glass")
    if haze:
        rng = np.random.default_rng(8)
        places = rng.uniform((-1.5, -1.5, 0.3), (HALF + 1.0, 1.5, 2.2), (24, 3))
        black = np.full((24, 3), -1.0)
        scene.add_splats(places, rng.uniform(0.15, 0.4, (24, 3)), black, rng.uniform(0.2, 0.6, 24), material=haze)
    if card:
        scene.add_quad((-0.5, 0.2, 0.6), (1.0, 0.0, 0.0), (0.0, 0.3, 0.8), card, "card")
    if lamps:
        scene.builder.add_point_light("inside", (-1.0, 1.0, 2.0), 0.2, (1.0 * brightness,) * 3, soft=True)
        scene.builder.add_point_light("outside", (HALF + 1.0, 0.2, 2.0), 0.5, (20.0 * brightness,) * 3, soft=False)
    scene.set_environment((3.0 * brightness, 3.2 * brightness, 3.5 * brightness))
    scene.set_camera(eye, (1.0, 0.3, 1.0), 0.8)
    return scene.snapshot()


def finished(scene: core.Scene, cache: core.RenderCache | None = None, **settings: object) -> core.Session:
    members = DEFAULTS | dict(width=SIZE, height=SIZE, samples=2, max_bounces=3) | settings
    session = core.Session(core.Settings(**members))
    session.start(scene, cache)
    progress = session.wait(600.0)
    assert progress.status is core.Status.DONE, progress.error
    return session


def openings(session: core.Session) -> int:
    return session.wait(0.0).openings


def picture(session: core.Session) -> NDArray:
    return session.read("Combined")[..., :3]


def block_replicas(scene: core.Scene, first_seed: int, **settings: object) -> NDArray:
    seeds = range(first_seed, first_seed + REPLICAS)
    pictures = [picture(finished(scene, **(dict(samples=SAMPLES, seed=seed) | settings))) for seed in seeds]
    return np.array([block_means(p, BLOCKS, BLOCKS) for p in pictures])
