"""What a noise threshold costs and leaves, with adaptive sampling and for the picture as a whole.

  python -m tests.benchmark.adaptive_sampling [--scenes NAME ...] [--threshold 0.03] [--pixels 14400] [--rounds 4]

Final ends by the threshold, with a new seed each round. Samples per pixel and CPU time, without that of building the
scene; the noise that is left, as a display shows it, in blocks of 8 x 8 pixels by what rounds differ by: of the median
block, of that than which one in twenty is noisier, and of the noisiest; and the mean of the pictures over that of
as many with a fixed number of samples, with one standard error: what ends when it looks clean is too dark where light
is rare.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.efficiency import FINAL
from tests.benchmark.papers.sessions import Rendered, Sessions
from tests.benchmark.scoreboard.catalogue import scene_named
from tests.benchmark.scoreboard.errors import boxes

WAYS = {"as a whole": {}, "adaptive": {"adaptive_sampling": True}}
MOST_SAMPLES = 4096
BLOCK = 8


def displayed(picture: NDArray) -> NDArray:
    """As the core's `displayed`."""
    light = np.maximum(picture, 0.0)
    compressed = light / (1.0 + light)
    return np.where(compressed < 0.0031308, 12.92 * compressed, 1.055 * compressed ** (1.0 / 2.4) - 0.055)


def block_noise(pictures: list[NDArray]) -> NDArray:
    squares = np.var([displayed(picture) for picture in pictures], axis=0, ddof=1)
    return np.sqrt(boxes(squares, BLOCK).mean(axis=2))


def mean_ratio(pictures: list[NDArray], fixed: list[NDArray]) -> tuple[float, float]:
    """Of means over pictures, and its standard error."""
    ours, theirs = ([picture.mean() for picture in some] for some in (pictures, fixed))
    ratio = np.mean(ours) / np.mean(theirs)
    errors = [np.std(some, ddof=1) / np.mean(some) / len(some) ** 0.5 for some in (ours, theirs)]
    return ratio, ratio * float(np.hypot(*errors))


def print_table(scene: str, found: dict[str, list[Rendered]], building: float) -> None:
    fixed = [rendered.picture for rendered in found.pop("fixed")]
    print(f"| {scene} | samples | CPU s | noise: median | 19 of 20 | worst | mean over that of fixed samples |")
    print("|---|---|---|---|---|---|---|")
    for name, runs in found.items():
        noise = block_noise([rendered.picture for rendered in runs])
        ratio, error = mean_ratio([rendered.picture for rendered in runs], fixed)
        samples, seconds = (
            np.mean([getattr(rendered, key) for rendered in runs]) for key in ("mean_samples", "seconds")
        )
        left = [np.median(noise), np.quantile(noise, 0.95), noise.max()]
        cells = [f"{samples:.0f}", f"{seconds - building:.2f}", *(f"{value:.4f}" for value in left)]
        print(" | ".join(["| " + name, *cells, f"{ratio:.4f} ± {error:.4f} |"]), flush=True)


def measure(sessions: Sessions, threshold: float, rounds: int) -> dict[str, list[Rendered]]:
    """Of each way in turn; and of as many samples as the adaptive one took on average, whatever was seen."""
    settings = FINAL | {"guiding": "AUTO"}
    found: dict[str, list[Rendered]] = {name: [] for name in (*WAYS, "fixed")}
    for seed in range(1, rounds + 1):
        for name, way in WAYS.items():
            ends = {"noise_threshold": threshold, **way}
            found[name].append(sessions.mean(MOST_SAMPLES, seed, **settings, **ends))
        samples = round(found["adaptive"][-1].mean_samples)
        found["fixed"].append(sessions.mean(samples, 1000 + seed, **settings))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--scenes", nargs="+", default=["door_ajar", "outdoor"], metavar="NAME", help="of the scoreboard"
    )
    parser.add_argument("--threshold", type=float, default=0.03)
    parser.add_argument("--pixels", type=int, default=160 * 90)
    parser.add_argument("--rounds", type=int, default=4, help="3 or more")
    parser.add_argument("--bounces", type=int, default=12)
    arguments = parser.parse_args()
    for scene in map(scene_named, arguments.scenes):
        if not scene.is_there:
            print(f"{scene.name} is not there: CISTERN_TEST_SCENES names no folder with it")
            continue
        sessions = Sessions(
            scene, arguments.pixels, arguments.bounces, "TREE", ("Direct", "Indirect", "Emission", "Environment")
        )
        building = sessions.mean(1, 0).seconds
        print_table(scene.name, measure(sessions, arguments.threshold, arguments.rounds), building)


if __name__ == "__main__":
    main()
