"""Squared error against accumulated frames, of every system with and without history, as a table and a plot.

  python -m tests.benchmark.convergence [--scene indirect_room] [--systems NAME ...] [--frames 1024] [--repeats 8]

Without history frames are independent and the slope of log MSE against log N is -1. With history each frame holds what
those before it found: single frames are better, but a mean of N gains little until N is far beyond the confidence cap;
then it falls like 1/N again, with more error than frames without history leave (N x MSE, the path tracer's being 1).
"""

from __future__ import annotations

import argparse
from pathlib import Path

from tests.benchmark.plotting import load_pyplot, require_matplotlib
from tests.benchmark.scoreboard.catalogue import LEARNED
from tests.support.convergence import FRAMES, Reference, squared_errors
from tests.support.direct_light_scenes import many_lights
from tests.support.path_scenes import SCENES as PATH_SCENES
from tests.support.statistics import convergence_slope

SCENES = PATH_SCENES | {"many_lights": many_lights}  # in the others there is little to learn about lights
LIMITS = dict(max_bounces=3, sequence="RANDOM")
SYSTEMS: dict[str, dict] = {
    "path tracing": {},
    "RESTIR": dict(direct="RESTIR"),
    "CELL_RESERVOIRS": dict(secondary="CELL_RESERVOIRS"),
    "SCREEN_REUSE": dict(indirect="SCREEN_REUSE"),
    "WORLD_REUSE": dict(indirect="WORLD_REUSE"),
    "CELL_SHARED": dict(indirect="CELL_SHARED"),
    "LEARNED": LEARNED,
    "Final and learned lights": LEARNED | dict(indirect="CELL_SHARED"),
}
HAVE_HISTORY = frozenset(SYSTEMS) - {"path tracing", "LEARNED", "Final and learned lights"}


def measure(arguments: argparse.Namespace) -> dict[str, dict[int, float]]:
    scene, size = SCENES[arguments.scene](), arguments.size
    reference = Reference(scene, size, arguments.reference_samples, **LIMITS)
    counts = [FRAMES[0] << k for k in range((arguments.frames // FRAMES[0]).bit_length())]
    found = {}
    for name in dict.fromkeys(["path tracing", *arguments.systems]):
        for history in (False, True) if name in HAVE_HISTORY and not arguments.without_history else (False,):
            label = f"{name}, history" if history else name
            settings = LIMITS | SYSTEMS[name] | dict(temporal_reuse=history, light_candidates=4, spatial_radius=6.0)
            found[label] = squared_errors(scene, size, reference, arguments.repeats, counts=counts, **settings)
            print(f"{label}: {found[label]}", flush=True)
    return found


def print_table(found: dict[str, dict[int, float]]) -> None:
    traced = found["path tracing"]
    first, last = min(traced), max(traced)
    print(f"| system | slope | N x MSE at {first} | at {last}, path tracing = 1 |")
    print("|---|---|---|---|")
    for name, errors in found.items():
        ratios = (errors[count] / traced[count] for count in (first, last))
        print(f"| {name} | {convergence_slope(errors):.3f} | " + " | ".join(f"{r:.3f}" for r in ratios) + " |")


def plot(found: dict[str, dict[int, float]], path: Path) -> None:
    figure, axes = load_pyplot().subplots(figsize=(8, 6), layout="constrained")
    systems = list(SYSTEMS)
    for name, errors in found.items():
        system, _, history = name.partition(", ")
        style = dict(linestyle="--" if history else "-", color=f"C{systems.index(system)}", label=name)
        axes.loglog(list(errors), list(errors.values()), **style)
    axes.set(xlabel="frames", ylabel="mean squared error")
    axes.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", choices=list(SCENES), default="indirect_room")
    parser.add_argument("--systems", nargs="+", choices=list(SYSTEMS), default=list(SYSTEMS), metavar="NAME")
    parser.add_argument("--without-history", action="store_true", help="leave out the systems with history")
    parser.add_argument("--frames", type=int, default=FRAMES[-1], help="of the longest render")
    parser.add_argument("--size", type=int, default=16)
    parser.add_argument("--repeats", type=int, default=8)
    parser.add_argument("--reference-samples", type=int, default=65536)
    parser.add_argument("--plot", type=Path)
    arguments = parser.parse_args()
    if arguments.plot:
        require_matplotlib()
    found = measure(arguments)
    print_table(found)
    if arguments.plot:
        plot(found, arguments.plot)


if __name__ == "__main__":
    main()
