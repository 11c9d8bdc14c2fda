"""Efficiency of our estimators: variance times CPU time of path tracing over theirs, per pixel and in larger boxes.

  python -m tests.benchmark.efficiency [--scenes NAME ...] [--systems NAME ...] [--rounds 4] [--left-out 0.02]

Above 1 is better than path tracing. Of light that surfaces reflect: edges of lamps in the picture are as noisy for all.
Every system renders the same scene in turn, with a new seed each round; variances are those between rounds, relative to
what all pictures show on average, so no reference is needed. Of few rounds fireflies decide: a share of the noisiest
pixels or boxes, of all systems together, can be left out. CPU times leave out those of building the scene. Beside
each number is its range as rounds are left out one by one.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.papers.sessions import Sessions
from tests.benchmark.scoreboard.catalogue import LEARNED, scene_named
from tests.benchmark.scoreboard.errors import boxes

SHARED = {"indirect": "CELL_SHARED", "temporal_reuse": False}
FINAL = SHARED | {"share_trial": True, "light_samples": 2, "caustic_guide": True}
SYSTEMS: dict[str, dict] = {
    "path tracing": {},
    "learned lights": LEARNED,
    "sharing": SHARED,
    "sharing on trial": SHARED | {"share_trial": True},
    "sharing, next vertex alone": SHARED | {"share_visible": 1},
    "both": SHARED | LEARNED,
    "both, next vertex alone": SHARED | LEARNED | {"share_visible": 1},
    "guiding": {"guiding": "ON"},
    "guiding on trial": {"guiding": "AUTO"},
    "guiding, sharing": SHARED | {"guiding": "ON"},
    "Final": FINAL | {"guiding": "AUTO"},
    "Final, never guided": FINAL,
}
SIDES = (1, 4, 8)
FLOOR = 0.01  # of the mean's square, added to that of each pixel


def box_means(picture: NDArray, side: int) -> NDArray:
    return picture if side == 1 else boxes(picture, side)


def relative_variances(pictures: list[NDArray], shown: NDArray) -> NDArray:
    """Of every pixel or box, between pictures of equal expectation `shown`."""
    scale = shown.mean(axis=2) ** 2 + FLOOR * shown.mean() ** 2
    return np.var(pictures, axis=0, ddof=1).mean(axis=2) / scale


def efficiencies(found: dict[str, list[tuple[NDArray, float]]], side: int, left_out: float) -> dict[str, float]:
    """By system, from its pictures and their seconds, without the share of boxes that are noisiest in all together."""
    boxed = {name: [box_means(picture, side) for picture, _ in runs] for name, runs in found.items()}
    shown = np.mean([picture for pictures in boxed.values() for picture in pictures], axis=0)
    variances = {name: relative_variances(pictures, shown) for name, pictures in boxed.items()}
    noise = sum(variance / variance.mean() for variance in variances.values())
    kept = noise <= np.quantile(noise, 1.0 - left_out)
    costs = {
        name: variances[name][kept].mean() * np.mean([seconds for _, seconds in runs]) for name, runs in found.items()
    }
    return {name: float(costs["path tracing"] / cost) for name, cost in costs.items()}


def interval(
    found: dict[str, list[tuple[NDArray, float]]], side: int, left_out: float, name: str
) -> tuple[float, float]:
    values = []
    for one in range(len(found[name])):
        part = {key: runs[:one] + runs[one + 1 :] for key, runs in found.items()}
        values.append(efficiencies(part, side, left_out)[name])
    return min(values), max(values)


def measure(sessions: Sessions, systems: list[str], samples: int, rounds: int) -> dict[str, list]:
    found: dict[str, list[tuple[NDArray, float]]] = {name: [] for name in systems}
    building = sessions.mean(1, 0).seconds
    for seed in range(1, rounds + 1):
        for name in systems:
            rendered = sessions.mean(samples, seed, **SYSTEMS[name])
            found[name].append((rendered.picture, rendered.seconds - building))
    return found


def print_table(scene: str, found: dict[str, list], left_out: float) -> None:
    print(f"| {scene} | CPU time | " + " | ".join(f"{side} px" for side in SIDES) + " |")
    print("|---|---|" + "---|" * len(SIDES))
    seconds = {name: np.mean([seconds for _, seconds in runs]) for name, runs in found.items()}
    by_side = {side: efficiencies(found, side, left_out) for side in SIDES}
    for name in found:
        cells = []
        for side in SIDES:
            low, high = interval(found, side, left_out, name)
            cells.append(f"{by_side[side][name]:.2f} ({low:.2f} to {high:.2f})")
        print(f"| {name} | {seconds[name] / seconds['path tracing']:.2f} | " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", default=["cbox", "door_ajar"], metavar="NAME", help="of the scoreboard")
    parser.add_argument("--systems", nargs="+", default=list(SYSTEMS), choices=list(SYSTEMS), metavar="NAME")
    parser.add_argument("--pixels", type=int, default=160 * 90)
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--rounds", type=int, default=4, help="3 or more")
    parser.add_argument("--bounces", type=int, default=12)
    parser.add_argument("--left-out", type=float, default=0.0, help="share of the noisiest pixels and boxes")
    arguments = parser.parse_args()
    systems = list(dict.fromkeys(["path tracing", *arguments.systems]))
    for scene in map(scene_named, arguments.scenes):
        if not scene.is_there:
            print(f"{scene.name} is not there: CISTERN_TEST_SCENES names no folder with it")
            continue
        sessions = Sessions(scene, arguments.pixels, arguments.bounces, "TREE", ("Direct", "Indirect"))
        print_table(scene.name, measure(sessions, systems, arguments.samples, arguments.rounds), arguments.left_out)


if __name__ == "__main__":
    main()
