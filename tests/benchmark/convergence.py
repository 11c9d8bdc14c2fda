"""Squared error against accumulated frames, of every system with and without history, as a table and a plot.

  python -m tests.benchmark.convergence [--scene indirect_room] [--size 16] [--repeats 8] [--plot out/convergence.png]

Without history frames are independent and the slope of log MSE against log N is -1. With history each frame holds what
those before it found: single frames are better, but a mean of N gains little until N is far beyond the confidence cap;
then it falls like 1/N again, with more error than frames without history leave (N x MSE, the path tracer's being 1).
"""

from __future__ import annotations

import argparse
from pathlib import Path

from tests.benchmark.plotting import load_pyplot, require_matplotlib
from tests.support.convergence import FRAMES, Reference, squared_errors
from tests.support.path_scenes import SCENES
from tests.support.statistics import convergence_slope

LIMITS = dict(max_bounces=3, sequence="RANDOM")
SYSTEMS: dict[str, dict] = {
    "path tracing": {},
    "RESTIR": dict(direct="RESTIR"),
    "CELL_RESERVOIRS": dict(secondary="CELL_RESERVOIRS"),
    "SCREEN_REUSE": dict(indirect="SCREEN_REUSE"),
    "WORLD_REUSE": dict(indirect="WORLD_REUSE"),
    "CELL_SHARED": dict(indirect="CELL_SHARED"),
}
HAVE_HISTORY = frozenset(SYSTEMS) - {"path tracing"}


def measure(scene_name: str, size: int, repeats: int, reference_samples: int) -> dict[str, dict[int, float]]:
    scene = SCENES[scene_name]()
    reference = Reference(scene, size, reference_samples, **LIMITS)
    found = {}
    for name, answers in SYSTEMS.items():
        for history in (False, True) if name in HAVE_HISTORY else (False,):
            label = f"{name}, history" if history else name
            settings = LIMITS | answers | dict(temporal_reuse=history, light_candidates=4, spatial_radius=6.0)
            found[label] = squared_errors(scene, size, reference, repeats, **settings)
    return found


def print_table(found: dict[str, dict[int, float]]) -> None:
    ends = [FRAMES[0] * found["path tracing"][FRAMES[0]], FRAMES[-1] * found["path tracing"][FRAMES[-1]]]
    print(f"| system | slope | N x MSE at {FRAMES[0]} | at {FRAMES[-1]}, path tracing = 1 |")
    print("|---|---|---|---|")
    for name, errors in found.items():
        first, last = FRAMES[0] * errors[FRAMES[0]] / ends[0], FRAMES[-1] * errors[FRAMES[-1]] / ends[1]
        print(f"| {name} | {convergence_slope(errors):.3f} | {first:.3f} | {last:.3f} |")


def plot(found: dict[str, dict[int, float]], path: Path) -> None:
    figure, axes = load_pyplot().subplots(figsize=(8, 6))
    for name, errors in found.items():
        axes.loglog(list(errors), list(errors.values()), "--" if "history" in name else "-", label=name)
    axes.set(xlabel="frames", ylabel="mean squared error")
    axes.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", choices=list(SCENES), default="indirect_room")
    parser.add_argument("--size", type=int, default=16)
    parser.add_argument("--repeats", type=int, default=8)
    parser.add_argument("--reference-samples", type=int, default=65536)
    parser.add_argument("--plot", type=Path)
    arguments = parser.parse_args()
    if arguments.plot:
        require_matplotlib()
    found = measure(arguments.scene, arguments.size, arguments.repeats, arguments.reference_samples)
    print_table(found)
    if arguments.plot:
        plot(found, arguments.plot)


if __name__ == "__main__":
    main()
