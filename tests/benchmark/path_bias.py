"""Bias of every way to reuse paths on the scenes of tests/render/test_path_reuse.py, as a table.

  python -m tests.benchmark.path_bias [--replicas 64] [--frames 8] [--scenes NAME ...] [--json FILE]
  python -m tests.benchmark.path_bias --combinations [...]

Of each system: the mean of the picture over that of the reference, one standard error, the block of the picture that is
farthest off (in units of the mean), how many standard errors it is off, and whether the family of t-tests tells the two
apart (false-alarm rate 1 % per row).

With --combinations, FAST with every combination of answers, which no test holds to anything: ratio of means and error
for each scene, by answers for direct light (columns) and all others. An asterisk: told apart. By default on three
scenes; what merges nothing is the same estimator as UNBIASED.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from tests.benchmark import bias_table
from tests.render.test_path_reuse import (
    COMBINATIONS,
    DIRECT,
    INDIRECT,
    LIMITS,
    SECONDARY,
    THREE_SCENES,
    Answers,
    members_of,
    sessions,
)
from tests.support.path_scenes import SCENES
from tests.support.statistics import Comparison, compare_replicas

REFERENCE_SAMPLES = 128
SYSTEMS: list[Answers] = [
    ("NEE", "RIS", "PATH"),
    ("NEE", "CELL_RESERVOIRS", "PATH"),
    ("NEE", "NEE", "SCREEN_REUSE"),
    ("NEE", "NEE", "WORLD_REUSE"),
    ("RESTIR", "CELL_RESERVOIRS", "SCREEN_REUSE"),
    ("RESTIR", "CELL_RESERVOIRS", "WORLD_REUSE"),
]
BOTH = [
    (answers, bias)
    for answers in SYSTEMS
    for bias in ("UNBIASED", "FAST")
    if (answers, bias) != (("NEE", "RIS", "PATH"), "FAST")  # nothing to merge: the same estimator
]
EVERY_FAST = [(answers, "FAST") for answers in COMBINATIONS]


def rows(
    scenes: Sequence[str], systems: Iterable[tuple[Answers, str]], replicas: int, frames: int
) -> list[bias_table.Row]:
    result = []
    limits = LIMITS[""]
    for name in scenes:
        reference = sessions(name, replicas, 100_000, samples=REFERENCE_SAMPLES, **limits)
        for answers, bias in systems:
            found = sessions(name, replicas, 1, **(members_of(answers) | limits | dict(samples=frames, bias=bias)))
            result.append((name, " × ".join(answers), bias, compare_replicas(found, reference)))
    return result


def show_combinations(table: Sequence[bias_table.Row]) -> None:
    """A table for each scene."""

    def cell(found: Comparison | None) -> str:
        return f"{found.ratio:.3f} ± {found.ratio_error:.3f}{'' if found.agrees else ' *'}" if found else ""

    for scene in dict.fromkeys(row[0] for row in table):
        of_scene = {row[1]: row[3] for row in table if row[0] == scene}
        print(f"\n| {scene} | {' | '.join(DIRECT)} |\n|---|{'---|' * len(DIRECT)}")
        for others in (f"{secondary} × {indirect}" for secondary in SECONDARY for indirect in INDIRECT):
            print(f"| {others} | {' | '.join(cell(of_scene.get(f'{direct} × {others}')) for direct in DIRECT)} |")


def main() -> None:
    parser = bias_table.parser(__doc__)
    parser.add_argument("--scenes", nargs="+", choices=list(SCENES), metavar="NAME")
    parser.add_argument("--combinations", action="store_true", help="FAST with every combination of answers")
    arguments = parser.parse_args()
    scenes = arguments.scenes or (THREE_SCENES if arguments.combinations else list(SCENES))
    table = rows(scenes, EVERY_FAST if arguments.combinations else BOTH, arguments.replicas, arguments.frames)
    if arguments.combinations:
        show_combinations(table)
    bias_table.show(table, arguments.json)


if __name__ == "__main__":
    main()
