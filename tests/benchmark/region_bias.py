"""Whether sharing changes what a picture shows on average, region by region, on the scoreboard's scenes.

  python -m tests.benchmark.region_bias [--scenes NAME ...] [--batches 32] [--samples 16] [--pixels 3600]

Path tracing and sharing render the same paths, seed by seed. Their difference in each of 4 x 3 regions has the mean
zero if sharing is unbiased; a t-test over the batches tells, with a false-alarm rate of 1 % for a scene and system.
FAST, equal weights in place of the densities, is there to be seen failing. Final, which decides by a trial where to
share, is compared with path tracing of other seeds, as the noise of both allows.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.papers.sessions import Sessions
from tests.benchmark.scoreboard.catalogue import SCENES, scene_named
from tests.support.statistics import Comparison, block_means, compare_replicas, compare_to_value

ROWS, COLUMNS = 3, 4
SHARED = {"indirect": "CELL_SHARED", "temporal_reuse": False}
PAIRED = {"sharing": SHARED, "sharing, FAST": SHARED | {"bias": "FAST"}}
FINAL = SHARED | {"share_trial": True}


def region_means(sessions: Sessions, arguments: argparse.Namespace, first_seed: int, **settings: str) -> NDArray:
    """(batches, regions * channels)."""
    seeds = range(first_seed, first_seed + arguments.batches)
    return np.array(
        [block_means(sessions.mean(arguments.samples, seed, **settings).picture, ROWS, COLUMNS) for seed in seeds]
    )


def compare_paired(ours: NDArray, reference: NDArray) -> Comparison:
    mean = reference.mean(axis=0)
    return compare_to_value(ours - reference + mean, mean)


def print_row(scene: str, system: str, found: Comparison) -> None:
    print(
        f"| {scene} | {system} | {100 * (found.ratio - 1):+.3f} % ± {100 * found.ratio_error:.3f} % | "
        f"{found.largest_z:.1f} | {found.p_value / found.level:.2g} | {'agrees' if found.agrees else 'DIFFERS'} |",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", default=[scene.name for scene in SCENES], metavar="NAME")
    parser.add_argument("--batches", type=int, default=32)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--pixels", type=int, default=3600)
    parser.add_argument("--bounces", type=int, default=12)
    arguments = parser.parse_args()
    print("| scene | system | change of the whole | largest t of a region | p over its level | |")
    print("|---|---|---|---|---|---|")
    for scene in map(scene_named, arguments.scenes):
        if not scene.is_there:
            print(f"{scene.name} is not there: CISTERN_TEST_SCENES names no folder with it")
            continue
        sessions = Sessions(scene, arguments.pixels, arguments.bounces, "TREE", ("Direct", "Indirect"))
        reference = region_means(sessions, arguments, 1)
        for name, settings in PAIRED.items():
            ours = region_means(sessions, arguments, 1, **settings)
            print_row(scene.name, name, compare_paired(ours, reference))
        ours = region_means(sessions, arguments, 1 + arguments.batches, **FINAL)
        print_row(scene.name, "Final", compare_replicas(ours, reference))


if __name__ == "__main__":
    main()
