"""The comparisons of [Zhang and Wang 2023] with ReSTIR GI: MSE, frame time, cell size, and the mean of many frames.

  python -m tests.benchmark.papers.zhang [--scenes NAME ...] [--frames 32] [--long 20000] [--output out/papers]

MSE and frame time are those of a frame with history, of both systems, unbiased, at one sample per pixel (§6.1); ReSTIR
GI also without the history of its spatial reservoirs and the neighbours that it takes in while that is short; the other
also by six reservoirs of a cell, of visible points alone, in place of three, half of them of deep vertices. The MSE
against the smallest cell size (Figure 9) is given over that of the paper's choice, 1 % of the scene: as published,
where cells are the smallest times a power of two, up to a tenth of the picture; and with all of that one size. The mean
of many frames (Figure 8) is that of a small picture, from a few sessions with seeds of their own, so that its error is
known: its mean over that of path tracing, and how many of its blocks differ by t-tests with a false-alarm rate of
FALSE_ALARM_RATE for all scenes together. Needs matplotlib.
"""

from __future__ import annotations

import argparse

import numpy as np

from tests.benchmark.papers.comparison import Finding, Range, parser, run
from tests.benchmark.papers.sessions import Reference, Sessions
from tests.support.statistics import block_means, compare_replicas, sidak

SCENES = ("veach_ajar", "door_ajar", "market", "glossy_hall")
CELL_SIZES = (0.0067, 0.0133, 0.02)  # of the scene's diagonal, besides PAPER_CELL_SIZE; the paper plots 0.67 to 2 %
PAPER_CELL_SIZE = 0.01
WORLD, SCREEN = {"indirect": "WORLD_REUSE"}, {"indirect": "SCREEN_REUSE"}
NO_SPATIAL_HISTORY = {"path_spatial_cap": 0.0}
SIX_VISIBLE = {"path_cell_count": 6, "path_deep_points": False}
OF_ONE_SIZE = {"cell_pixels": 1.0}  # as they are seen, where the smallest size is larger
IMPROVEMENT = Range(16.6, 41.9, " %")
OVERHEAD = Range(4.41, 8.36, " %")
FALSE_ALARM_RATE = 0.01
BLOCKS = 4  # along each side of the small picture
REFERENCE_SESSIONS = 16


def measure(sessions: Sessions, reference: Reference, arguments: argparse.Namespace, scene: str) -> list[Finding]:
    found = compare_systems(sessions, reference, arguments, scene)
    found += compare_cell_sizes(sessions, reference, arguments, scene)
    if arguments.long > 0:
        found += compare_long_mean(sessions, arguments, scene)
    return found


def compare_systems(
    sessions: Sessions, reference: Reference, arguments: argparse.Namespace, scene: str
) -> list[Finding]:
    percent: dict[tuple[str, Range | None], list[float]] = {}
    for seed in range(1, arguments.rounds + 1):
        world, six, screen, less = (
            sessions.frame(arguments.frames, seed, temporal_reuse=True, **answer)
            for answer in (WORLD, WORLD | SIX_VISIBLE, SCREEN, SCREEN | NO_SPATIAL_HISTORY)
        )
        for ours, theirs, name in (
            (world, screen, "ReSTIR GI's"),
            (world, less, "that without spatial history"),
            (six, screen, "ReSTIR GI's, by six visible points of a cell"),
        ):
            is_printed = ours is world and theirs is screen
            for kind, error, paper in (
                ("MSE", reference.mse, IMPROVEMENT if is_printed else None),
                ("trimmed MSE", reference.trimmed_mse, None),
            ):
                below = 100.0 * (1.0 - error(ours.picture) / error(theirs.picture))
                percent.setdefault((f"{kind} below {name}", paper), []).append(below)
            longer = 100.0 * (ours.seconds / theirs.seconds - 1.0)
            percent.setdefault((f"frame time above {name}", OVERHEAD if is_printed else None), []).append(longer)
    return [
        Finding(scene, what, float(np.median(values)), Range.of(values), paper, " %")
        for (what, paper), values in percent.items()
    ]


def compare_cell_sizes(
    sessions: Sessions, reference: Reference, arguments: argparse.Namespace, scene: str
) -> list[Finding]:
    """Without the worst pixels, whose chance differences are larger than those of cell sizes."""
    findings = []
    for sizes, settings in (("", {}), (" everywhere", OF_ONE_SIZE)):
        errors: dict[float, list[float]] = {}
        for seed in range(1, arguments.rounds + 1):
            for size in (PAPER_CELL_SIZE, *CELL_SIZES):
                frame = sessions.frame(
                    arguments.frames, seed, temporal_reuse=True, min_cell_size=size, **WORLD, **settings
                )
                errors.setdefault(size, []).append(reference.trimmed_mse(frame.picture))
        for size in CELL_SIZES:
            ratios = list(np.divide(errors[size], errors[PAPER_CELL_SIZE]))
            what = f"trimmed MSE with cells of {100.0 * size:.3g} %{sizes}, over that with 1 %"
            median = float(np.median(ratios))
            findings.append(Finding(scene, what, median, Range.of(ratios), Range(1.0, float("inf"))))
    return findings


def compare_long_mean(sessions: Sessions, arguments: argparse.Namespace, scene: str) -> list[Finding]:
    size = sessions.size(arguments.long_pixels)

    def blocks(count: int, samples: int, first_seed: int, **settings: object) -> np.ndarray:
        pictures = (sessions.mean(samples, first_seed + k, **size, **settings).picture for k in range(count))
        return np.array([np.concatenate([block_means(p, n, n) for n in (1, BLOCKS)]) for p in pictures])

    count = arguments.long_sessions
    means = blocks(count, arguments.long // count, 1, indirect="WORLD_REUSE", temporal_reuse=True)
    references = blocks(REFERENCE_SESSIONS, arguments.long_reference // REFERENCE_SESSIONS, 1001)
    result = compare_replicas(means, references, sidak(FALSE_ALARM_RATE, len(arguments.scenes)))
    error = 3.0 * result.ratio_error
    spread = Range(result.ratio - error, result.ratio + error)
    what = f"mean of {arguments.long} frames"
    return [
        Finding(scene, f"{what} ÷ path tracing's", result.ratio, spread, Range(1.0, 1.0), error=error),
        Finding(scene, f"{what} tells from path tracing's: blocks", float(result.differing), None, Range(0.0, 0.0)),
    ]


def main() -> None:
    command = parser(__doc__, SCENES, bounces=8)
    command.add_argument("--frames", type=int, default=32)
    command.add_argument("--long", type=int, default=20_000, help="frames whose mean is compared, 0: none")
    command.add_argument("--long-pixels", type=int, default=24 * 16, help="of the picture for that")
    command.add_argument("--long-sessions", type=int, default=16, help="that these frames are divided among")
    command.add_argument("--long-reference", type=int, default=262_144, help="samples of path tracing for that")
    run("zhang", "World-space paths, after [Zhang and Wang 2023]", command.parse_args(), measure)


if __name__ == "__main__":
    main()
