"""Numbers, table, plots and pictures of the thesis's experiment, from what thesis_render measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.plotting import load_pyplot
from tests.support.grid_energy import GridEnergy, Grids, grid_energy, make_grids

WHITE_PERCENTILE = 97.0  # of the brightest channel of the reference: what is shown as white
VISIBLE_GRID = 1.25  # times the structure of the same scene without cells
CELLS_PER_AXIS = 64  # [Stefanescu 2025, §4.2]
# Of the cache's grid beyond the scene's box, in its sizes: native/restir/light_cache_cells.cpp.
LOWER_MARGIN, UPPER_MARGIN = np.array([0.00618, 0.00414, 0.00732]), np.array([0.00236, 0.00449, 0.00646])

TITLES = {
    "uniform": "uniform",
    "restir-printed": "ReSTIR, as printed",
    "cache-printed": "cell cache, as printed",
    "restir": "ReSTIR, unbiased",
    "cache": "cell cache, unbiased",
}
SCENES = {"city": "City Grid", "monkeys": "Monkeys"}
PAIRS = (("restir-printed", "cache-printed"), ("restir", "cache"))


@dataclass(frozen=True)
class Reference:
    direct: NDArray  # (height, width, 3), mean of both halves
    noise: float  # mean square error of `direct` as displayed
    emission: NDArray
    positions: NDArray
    normals: NDArray
    low: NDArray  # corners of the scene's box
    high: NDArray
    white: float  # radiance

    def displayed(self, picture: NDArray) -> NDArray:
        """Linear, with white at 1 and nothing beyond: an error that few bright pixels do not rule."""
        return np.clip(picture / self.white, 0.0, 1.0)

    def error(self, picture: NDArray) -> float:
        """Root mean square error as displayed, less the reference's own."""
        difference = self.displayed(picture) - self.displayed(self.direct)
        return float(np.sqrt(max(np.mean(difference**2) - self.noise, 0.0)))

    def linear_error(self, picture: NDArray) -> float:
        """Root mean square error of radiance over the mean radiance."""
        return float(np.sqrt(np.mean((picture - self.direct) ** 2)) / self.direct.mean())

    def grid(self, picture: NDArray) -> GridEnergy:
        """Of the displayed error, for the thesis's cells."""
        return grid_energy((self.displayed(picture) - self.displayed(self.direct))[self.hit], self.grids)

    @cached_property
    def hit(self) -> NDArray:
        """Which pixels show a surface."""
        return np.linalg.norm(self.normals, axis=2) > 0.5

    @cached_property
    def grids(self) -> Grids:
        size = np.full(3, np.max(self.high - self.low))  # cells are cubes
        edges = size * (1.0 + LOWER_MARGIN + UPPER_MARGIN) / CELLS_PER_AXIS
        return make_grids(self.positions[self.hit], self.normals[self.hit], self.low - size * LOWER_MARGIN, edges)


@dataclass(frozen=True)
class Measurement:
    """Of one method in one scene, over the rounds."""

    frames: NDArray  # (rounds, frames, height, width, 3)
    mean: NDArray  # of many frames of the first round
    frame_seconds: list[float]  # CPU time of a frame with history, by round
    first_seconds: list[float]  # CPU time of building, preparing and the first frame
    core_bytes: int
    peak_bytes: int

    @property
    def frame_milliseconds(self) -> float:
        return 1e3 * float(np.median(self.frame_seconds))

    @property
    def first_milliseconds(self) -> float:
        return 1e3 * float(np.median(self.first_seconds))


def read_reference(path: Path) -> Reference:
    with np.load(path) as file:
        halves = file["halves"].astype(np.float64)
        direct = halves.mean(axis=0)
        brightest = direct.max(axis=2)
        white = float(np.percentile(brightest[brightest > 0.0], WHITE_PERCENTILE))
        shown = np.clip(halves / white, 0.0, 1.0)
        noise = float(np.mean((shown[0] - shown[1]) ** 2)) / 4.0
        surfaces = [file[name].astype(np.float64) for name in ("emission", "positions", "normals")]
        return Reference(direct, noise, *surfaces, file["low"], file["high"], white)


def read_measurement(paths: list[Path]) -> Measurement:
    rounds = [dict(np.load(path)) for path in paths]
    seconds = [r["cpu_seconds"] for r in rounds]
    return Measurement(
        np.stack([r["frames"] for r in rounds]).astype(np.float64),
        rounds[0]["mean"].astype(np.float64),
        [float(s[-1] - s[1]) / (len(s) - 2) for s in seconds],
        [float(s[0]) for s in seconds],
        int(rounds[0]["core_bytes"]),
        max(int(r["peak_bytes"]) for r in rounds),
    )


def errors(reference: Reference, measured: Measurement) -> NDArray:
    """(frames,) root mean square errors, root mean square over the rounds."""
    table = np.array([[reference.error(frame) for frame in one_round] for one_round in measured.frames])
    return np.sqrt((table**2).mean(axis=0))


def percent(value: float, base: float) -> str:
    return f"{100.0 * (value / base - 1.0):+.0f} %"


def verdict(is_so: bool) -> str:
    return "agrees" if is_so else "**differs**"


def scene_table(reference: Reference, results: dict[str, Measurement]) -> list[str]:
    count = next(iter(results.values())).frames.shape[1]
    heads = " | ".join(f"frame {k + 1}" for k in range(count))
    lines = [
        f"| method | {heads} | mean of frames | linear, frame {count} | first frame ms | later frames ms "
        "| core MB | peak MB |",
        "|---|" + "---|" * (count + 6),
    ]
    for name, measured in results.items():
        row = " | ".join(f"{error:.4f}" for error in errors(reference, measured))
        linear = np.mean([reference.linear_error(one_round[-1]) for one_round in measured.frames])
        lines.append(
            f"| {TITLES[name]} | {row} | {reference.error(measured.mean):.4f} | {linear:.2f} "
            f"| {measured.first_milliseconds:.0f} | {measured.frame_milliseconds:.0f} "
            f"| {measured.core_bytes / 1e6:.1f} | {measured.peak_bytes / 1e6:.0f} |"
        )
    return lines


def grid_table(reference: Reference, results: dict[str, Measurement]) -> list[str]:
    lines = [
        "| method | frame 1 | last frame | mean of frames | amplitude in the mean |",
        "|---|---|---|---|---|",
    ]
    for name, measured in results.items():
        found = [reference.grid(p) for p in (measured.frames[0, 0], measured.frames[0, -1], measured.mean)]
        cells = " | ".join(f"{grid.ratio:.2f} ({grid.z:+.1f} σ)" for grid in found)
        lines.append(f"| {TITLES[name]} | {cells} | {found[-1].amplitude:.4f} |")
    return lines


def bars(reference: dict[str, Reference], results: dict[str, dict[str, Measurement]]) -> list[str]:
    """What the thesis claims and what we ask of ourselves, for both pairs of methods."""
    lines = ["| claim | system | measured | |", "|---|---|---|---|"]
    for base, cached in PAIRS:
        title = TITLES[cached]
        for scene, thesis_is_lower in (("city", True), ("monkeys", False)):
            first = [errors(reference[scene], results[scene][name])[0] for name in (base, cached)]
            word = "below" if thesis_is_lower else "above"
            lines.append(
                f"| thesis: first-frame error {word} ReSTIR's in {SCENES[scene]} | {title} "
                f"| {first[1]:.4f} against {first[0]:.4f} | {verdict((first[1] < first[0]) == thesis_is_lower)} |"
            )
        for scene in SCENES:
            old, new = results[scene][base], results[scene][cached]
            more_time = new.frame_milliseconds / old.frame_milliseconds - 1.0
            more_memory = new.core_bytes / old.core_bytes - 1.0
            time, memory = f"{100 * more_time:+.0f} %", f"{100 * more_memory:+.0f} %"
            where = f"{title} | {time}" + f" in {SCENES[scene]}"
            lines.append(f"| thesis: frame time +20 to +23 % | {where} | {verdict(0.18 <= more_time <= 0.25)} |")
            lines.append(
                f"| ours: frame time at most +15 % | {where} | {'met' if more_time <= 0.15 else '**missed**'} |"
            )
            where = f"{title} | {memory}" + f" in {SCENES[scene]}"
            if scene == "city":
                lines.append(f"| thesis: memory more than doubles | {where} | {verdict(more_memory > 1.0)} |")
            lines.append(f"| ours: memory at most +50 % | {where} | {'met' if more_memory <= 0.5 else '**missed**'} |")
        for scene in SCENES:
            lines += grid_bars(reference[scene], scene, *(results[scene][name] for name in (base, cached)), title)
    return lines


def grid_bars(reference: Reference, scene: str, base: Measurement, cached: Measurement, title: str) -> list[str]:
    """Whether the cells show, in the first frame or the mean: scenes have structure of their own, so ReSTIR, which
    knows of no cells, is the measure."""
    pairs = [
        (reference.grid(new).ratio, reference.grid(old).ratio)
        for new, old in ((cached.frames[0, 0], base.frames[0, 0]), (cached.mean, base.mean))
    ]
    is_visible = any(new > VISIBLE_GRID * old for new, old in pairs)
    found = ", ".join(f"{new:.2f} against {old:.2f}" for new, old in pairs)
    where = f"{title} | {found} in {SCENES[scene]}"
    lines = [
        f"| ours: no visible grid (at most {VISIBLE_GRID} times ReSTIR's structure, first frame and mean) | {where} "
    ]
    lines[0] += f"| {'**missed**' if is_visible else 'met'} |"
    if scene == "monkeys":
        lines.append(f"| thesis: visible grid in Monkeys | {where} | {verdict(is_visible)} |")
    return lines


def encoded(reference: Reference, picture: NDArray) -> NDArray:
    """For the screen, by the sRGB curve, top row first; lamps seen straight are added."""
    linear = reference.displayed(picture + reference.emission)[::-1]
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def draw_pictures(path: Path, reference: Reference, results: dict[str, Measurement]) -> None:
    """Rows: first frame, last frame, mean of many; one column a method, the reference last."""
    pyplot = load_pyplot()
    columns = [*results, "reference"]
    height, width, _ = reference.direct.shape
    figure, axes = pyplot.subplots(3, len(columns), figsize=(4 * len(columns), 12.6 * height / width), dpi=width / 4)
    for column, name in enumerate(columns):
        if name == "reference":
            pictures = [reference.direct] * 3
        else:
            measured = results[name]
            pictures = [measured.frames[0, 0], measured.frames[0, -1], measured.mean]
        for row, picture in enumerate(pictures):
            axes[row, column].imshow(encoded(reference, picture), interpolation="nearest")
            axes[row, column].set_axis_off()
        axes[0, column].set_title(TITLES.get(name, name))
    figure.tight_layout(pad=0.3)
    figure.savefig(path)
    pyplot.close(figure)


def draw_plots(path: Path, reference: dict[str, Reference], results: dict[str, dict[str, Measurement]]) -> None:
    """The thesis's Figures 4 and 5."""
    pyplot = load_pyplot()
    figure, axes = pyplot.subplots(1, 4, figsize=(18, 4.2), dpi=110)
    for axis, scene in zip(axes, SCENES, strict=False):
        for name, measured in results[scene].items():
            values = errors(reference[scene], measured)
            style = "--" if name.endswith("printed") else "-"
            axis.plot(np.arange(1, len(values) + 1), values, style, marker="o", label=TITLES[name])
        axis.set(title=SCENES[scene], xlabel="frame", ylabel="RMSE as displayed", ylim=(0.0, None))
        axis.set_xticks(np.arange(1, len(values) + 1))
    axes[0].legend(fontsize=8)
    places = np.arange(len(TITLES))
    for axis, what in zip(axes[2:], ("frame time, ms of CPU", "memory of the core, MB"), strict=True):
        for k, scene in enumerate(SCENES):
            values = [
                m.frame_milliseconds if what.startswith("frame") else m.core_bytes / 1e6
                for m in results[scene].values()
            ]
            axis.bar(np.arange(len(values)) + 0.4 * k - 0.2, values, 0.38, label=SCENES[scene])
        axis.set_title(what)
        axis.set_xticks(
            places[: len(values)], [TITLES[name].replace(", ", "\n") for name in results["city"]], fontsize=8
        )
    axes[2].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path)
    pyplot.close(figure)
