"""How time and memory grow: CPU time per sample and pixel against lights, triangles and pixels; speed-up by threads;
and where the time of a frame goes.

  python -m tests.benchmark.scaling [--axis lights lamps points triangles pixels threads breakdown] [--rounds 3]

One number of a scene grows at a time; what its picture shows stays the same. Each size is measured in a process of
its own, in turn (small ... large, small ... large), and in it all systems in turn; medians over the rounds. A line is
fitted against the logarithm of the size: what a tenfold size adds, and beside it what the last step adds for each
tenfold, which is more where growth is faster than a logarithm. Bytes are what the core counts, of the last step.
Threads: wall time, the shortest of many runs, since the machine may have other work. Needs matplotlib; `breakdown`
needs perf, and a core with symbols (cmake -DCMAKE_STRIP=).

The output folder gets a table and a plot of each axis.
"""

from __future__ import annotations

import argparse
import dataclasses
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.benchmark.plotting import load_pyplot, require_matplotlib
from tests.benchmark.scaling import breakdown
from tests.benchmark.scaling.measure import FINAL, PATH_TRACER, SYSTEMS, Cost, Job, run
from tests.benchmark.scoreboard.catalogue import ROOT

SMALL = {"width": 320, "height": 180}  # pictures of which the size does not grow
SPEED_UP_ASKED = 1.9
THREADS = (1, 2)


@dataclass(frozen=True)
class Axis:
    """What grows: a number of the scene, or without one the pixels."""

    sizes: tuple[int, ...]
    title: str
    member: str = ""
    systems: tuple[str, ...] = (PATH_TRACER, FINAL)
    samples: tuple[int, int] = (4, 20)
    repeats: int = 2

    def job(self, size: int) -> Job:
        width = round((size * 16 / 9) ** 0.5)
        picture = SMALL if self.member else {"width": width, "height": round(width * 9 / 16)}
        scene = {self.member: size} if self.member else {}
        return Job(scene, dict(picture), list(self.systems), list(self.samples), self.repeats)


LIGHT_COUNTS = (10, 100, 1_000, 10_000, 100_000, 1_000_000)
AXES = {
    "lights": Axis(LIGHT_COUNTS, "emissive triangles", "lights", tuple(SYSTEMS)),
    "lamps": Axis(LIGHT_COUNTS, "point lamps", "lamps", tuple(SYSTEMS)),
    "points": Axis(LIGHT_COUNTS, "point lamps without size", "points", tuple(SYSTEMS)),  # which no ray meets
    "triangles": Axis((10_000, 100_000, 1_000_000, 10_000_000), "triangles", "triangles"),
    "pixels": Axis((100_000, 500_000, 2_000_000, 8_000_000), "pixels", samples=(1, 3), repeats=1),
}
CHOICES = (*AXES, "threads", "breakdown")
Costs = dict[str, list[Cost]]  # by system, one for each size


def measure(axis: Axis, rounds: int) -> Costs:
    """Medians over rounds through all sizes."""
    runs = [[run(axis.job(size)) for size in axis.sizes] for _ in range(rounds)]
    return {
        system: [middle([one[k][system] for one in runs]) for k in range(len(axis.sizes))] for system in axis.systems
    }


def middle(costs: Sequence[Cost]) -> Cost:
    ordered = sorted(costs, key=lambda cost: cost.microseconds)
    return ordered[len(ordered) // 2]


def log_fit(axis: Axis, costs: Sequence[Cost]) -> tuple[float, float]:
    """Microseconds at a size of 1, and what each tenfold adds."""
    slope, start = np.polyfit(np.log10(axis.sizes), [cost.microseconds for cost in costs], 1)
    return float(start), float(slope)


def axis_table(axis: Axis, found: Costs) -> list[str]:
    sizes = " | ".join(f"{size:,}" for size in axis.sizes)
    lines = [
        f"| µs per sample and pixel, by {axis.title} | {sizes} | tenfold adds | the last | bytes for each |",
        "|---" * (len(axis.sizes) + 4) + "|",
    ]
    step = np.log10(axis.sizes[-1] / axis.sizes[-2])
    for system, costs in found.items():
        last = (costs[-1].microseconds - costs[-2].microseconds) / step
        each = (costs[-1].memory_bytes - costs[-2].memory_bytes) / (axis.sizes[-1] - axis.sizes[-2])
        cells = " | ".join(f"{cost.microseconds:.2f}" for cost in costs)
        lines.append(f"| {system} | {cells} | {log_fit(axis, costs)[1]:.2f} | {last:.2f} | {each:.0f} |")
    return lines


def draw(path: Path, axis: Axis, found: Costs) -> None:
    pyplot = load_pyplot()
    figure, plot = pyplot.subplots(figsize=(7, 5), dpi=90)
    for index, (system, costs) in enumerate(found.items()):
        plot.semilogx(axis.sizes, [cost.microseconds for cost in costs], f"C{index}o-", label=system)
        start, slope = log_fit(axis, costs)
        plot.semilogx(axis.sizes, start + slope * np.log10(axis.sizes), f"C{index}:", label="a line against log")
    plot.set(xlabel=axis.title, ylabel="µs of CPU time per sample and pixel", ylim=(0.0, None))
    plot.grid(alpha=0.25)
    plot.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path)
    pyplot.close(figure)


def threads_table(rounds: int) -> list[str]:
    """Wall time of one thread over that of two, and what the work itself costs more."""
    lines = [
        f"| threads {THREADS[0]} to {THREADS[1]} | wall time shrinks (≥ {SPEED_UP_ASKED}) | CPU time grows |",
        "|---|---|---|",
    ]
    size = {"width": 640, "height": 360}
    systems = [PATH_TRACER, FINAL]
    runs = [[run(Job({}, size | {"threads": n}, systems, [2, 18], 3)) for n in THREADS] for _ in range(rounds)]
    for system in systems:
        wall = [min(one[k][system].wall_microseconds for one in runs) for k in range(len(THREADS))]
        cpu = statistics.median(one[1][system].microseconds / one[0][system].microseconds for one in runs)
        lines.append(f"| {system} | {wall[0] / wall[1]:.2f} | {cpu:.2f} |")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--axis", nargs="+", choices=CHOICES, default=CHOICES, metavar="AXIS", help=", ".join(CHOICES))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--scenes", nargs="+", default=breakdown.SCENES, metavar="NAME", help="of the breakdown")
    parser.add_argument("--largest", type=int, default=10**9, help="leave out larger sizes; two or more must remain")
    parser.add_argument("--output", type=Path, default=ROOT / "out" / "scaling")
    arguments = parser.parse_args()
    require_matplotlib()
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    for name in arguments.axis:
        if name == "threads":
            lines = threads_table(arguments.rounds)
        elif name == "breakdown":
            lines = breakdown.table(arguments.scenes, 160 * 90, [16, 144])
        else:
            kept = tuple(size for size in AXES[name].sizes if size <= arguments.largest)
            axis = dataclasses.replace(AXES[name], sizes=kept)
            found = measure(axis, arguments.rounds)
            lines = axis_table(axis, found)
            draw(output / f"{name}.png", axis, found)
        (output / f"{name}.md").write_text("\n".join(lines) + "\n")
        print("\n".join(lines), flush=True)


if __name__ == "__main__":
    main()
