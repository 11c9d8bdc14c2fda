"""Mean squared error against the number of accumulated frames."""

from __future__ import annotations

from collections.abc import Sequence

import cistern_core as core
import numpy as np
from numpy.typing import NDArray

from tests.support.core_scenes import render

FRAMES = (16, 32, 64, 128, 256, 512, 1024)


def picture(scene: core.Scene, size: int, samples: int, seed: int, **settings) -> NDArray:
    found = render(scene, size, samples=samples, seed=seed, passes=[], **settings)
    return found["Combined"][..., :3].astype(np.float64)


class Reference:
    """The mean of two long renders by the path tracer, whose difference tells how noisy it is itself."""

    def __init__(self, scene: core.Scene, size: int, samples: int, **settings) -> None:
        one, two = (picture(scene, size, samples, seed, **settings) for seed in (900_001, 900_002))
        self.mean = 0.5 * (one + two)
        self.noise = float(np.mean((one - two) ** 2)) / 4.0


def squared_errors(
    scene: core.Scene,
    size: int,
    reference: Reference,
    repeats: int = 8,
    excess: float = 0.0,
    counts: Sequence[int] = FRAMES,
    **settings,
) -> dict[int, float]:
    """By frames, less what is the reference's own; means over `repeats` of the longest renders, and up to four times as
    many shorter ones. `excess`: planted, a share by which the reference is too bright."""
    target = reference.mean * (1.0 + excess)
    errors = {}
    for n in counts:
        seeds = range(1, 1 + repeats * min(4, counts[-1] // n))
        found = [np.mean((picture(scene, size, n, seed, **settings) - target) ** 2) for seed in seeds]
        errors[n] = float(np.mean(found)) - reference.noise
    return errors
