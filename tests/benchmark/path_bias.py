"""Bias of every way to reuse paths on the scenes of tests/render/test_path_reuse.py, as a table.

  python -m tests.benchmark.path_bias [--replicas 64] [--frames 8] [--scenes NAME ...] [--json FILE]

Of each system: the mean of the picture over that of the reference, one standard error, the block of the picture that is
farthest off (in units of the mean), how many standard errors it is off, and whether the family of t-tests tells the two
apart (false-alarm rate 1 % per row).
"""

from __future__ import annotations

from collections.abc import Sequence

from tests.benchmark import bias_table
from tests.render.test_path_reuse import LIMITS, members_of, sessions
from tests.support.path_scenes import SCENES
from tests.support.statistics import compare_replicas

REFERENCE_SAMPLES = 128
SYSTEMS = [
    ("NEE", "RIS", "PATH"),
    ("NEE", "CELL_RESERVOIRS", "PATH"),
    ("NEE", "NEE", "SCREEN_REUSE"),
    ("NEE", "NEE", "WORLD_REUSE"),
    ("RESTIR", "CELL_RESERVOIRS", "SCREEN_REUSE"),
    ("RESTIR", "CELL_RESERVOIRS", "WORLD_REUSE"),
]


def rows(scenes: Sequence[str], replicas: int, frames: int) -> list[bias_table.Row]:
    result = []
    limits = LIMITS[""]
    for name in scenes:
        reference = sessions(name, replicas, 100_000, samples=REFERENCE_SAMPLES, **limits)
        for answers in SYSTEMS:
            for bias in ("UNBIASED", "FAST"):
                if answers == ("NEE", "RIS", "PATH") and bias == "FAST":
                    continue  # nothing to merge: the same estimator
                found = sessions(name, replicas, 1, **(members_of(answers) | limits | dict(samples=frames, bias=bias)))
                result.append((name, " × ".join(answers), bias, compare_replicas(found, reference)))
    return result


def main() -> None:
    parser = bias_table.parser(__doc__)
    parser.add_argument("--scenes", nargs="+", choices=list(SCENES), default=list(SCENES))
    arguments = parser.parse_args()
    bias_table.show(rows(arguments.scenes, arguments.replicas, arguments.frames), arguments.json)


if __name__ == "__main__":
    main()
