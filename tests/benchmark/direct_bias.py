"""Bias of every way to reuse direct light on the scenes of tests/render/test_direct_reuse.py, as a table.

  python -m tests.benchmark.direct_bias [--replicas 64] [--frames 8] [--json FILE]

Of each system: the mean of direct light over that of the reference, one standard error, the block of the picture that
is farthest off (in units of the mean), how many standard errors it is off, and whether the family of t-tests tells the
two apart (false-alarm rate 1 % per row).
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.render.test_direct_reuse import BLOCKS, BOUNCES, COMMON, MODES, SIZE, scene
from tests.support.core_scenes import render
from tests.support.direct_light_scenes import SCENES
from tests.support.statistics import Comparison, block_means, compare_replicas

REFERENCE_SAMPLES = 256


def pictures(name: str, count: int, **settings) -> NDArray:
    """(count, values): block means of direct light from cold starts."""
    members = dict(size=SIZE, max_bounces=BOUNCES.get(name, 0), passes=["Direct"]) | settings
    renders = (render(scene(name), seed=1 + k, **members)["Direct"] for k in range(count))
    return np.array([block_means(picture, BLOCKS, BLOCKS) for picture in renders])


def rows(replicas: int, frames: int) -> list[tuple[str, str, str, Comparison]]:
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--replicas", type=int, default=64)
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    table = rows(arguments.replicas, arguments.frames)
    print("| scene | system | bias | mean / reference | worst block | standard errors | verdict |")
    print("|---|---|---|---|---|---|---|")
    for name, mode, bias, c in table:
        verdict = "agrees" if c.agrees else "differs"
        mean = f"{c.ratio:.4f} ± {c.ratio_error:.4f}"
        print(f"| {name} | {mode} | {bias} | {mean} | {c.largest_difference:.3f} | {c.largest_z:.1f} | {verdict} |")
    if arguments.json:
        keys = ("scene", "system", "bias")
        found = [dict(zip(keys, row[:3], strict=True)) | dataclasses.asdict(row[3]) for row in table]
        arguments.json.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
