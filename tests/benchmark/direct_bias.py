"""Bias of every way to reuse direct light on the scenes of tests/render/test_direct_reuse.py, as a table.

  python -m tests.benchmark.direct_bias [--replicas 64] [--frames 8] [--json FILE]

Of each system: the mean of direct light over that of the reference, one standard error, the block of the picture that
is farthest off (in units of the mean), how many standard errors it is off, and whether the family of t-tests tells the
two apart (false-alarm rate 1 % per row).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.benchmark import bias_table
from tests.render.test_direct_reuse import BLOCKS, BOUNCES, COMMON, MODES, SIZE, scene
from tests.support.core_scenes import render
from tests.support.direct_light_scenes import SCENES
from tests.support.statistics import block_means, compare_replicas

REFERENCE_SAMPLES = 256


def pictures(name: str, count: int, **settings) -> NDArray:
    """(count, values): block means of direct light from cold starts."""
    members = dict(size=SIZE, max_bounces=BOUNCES.get(name, 0), passes=["Direct"]) | settings
    renders = (render(scene(name), seed=1 + k, **members)["Direct"] for k in range(count))
    return np.array([block_means(picture, BLOCKS, BLOCKS) for picture in renders])


def rows(replicas: int, frames: int) -> list[bias_table.Row]:
    result = []
    for name in SCENES:
        reference = pictures(name, replicas, samples=REFERENCE_SAMPLES)
        for mode, settings in MODES.items():
            for bias in ("UNBIASED", "FAST"):
                if settings["direct"] == "RIS" and bias == "FAST":
                    continue  # nothing to merge: the same estimator
                found = pictures(name, replicas, samples=frames, **(COMMON | settings | dict(bias=bias)))
                result.append((name, mode, bias, compare_replicas(found, reference)))
    return result


def main() -> None:
    arguments = bias_table.parser(__doc__).parse_args()
    bias_table.show(rows(arguments.replicas, arguments.frames), arguments.json)


if __name__ == "__main__":
    main()
