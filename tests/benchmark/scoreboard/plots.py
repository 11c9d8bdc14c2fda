"""Error against CPU time of one scene, at each scale and after denoising; and all scenes at a glance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tests.benchmark.plotting import load_pyplot
from tests.benchmark.scoreboard.board import SCALES, SceneScore, Shot
from tests.benchmark.scoreboard.catalogue import OURS, OURS_DENOISED, PATH_TRACER
from tests.benchmark.scoreboard.report import DENOISED, bars_of, ours_at, ratio

STYLES = {"CYCLES": "--", "PATH": ":", "PAPERS": "-", "OURS": "-"}
# Of the overview, by group: how a system is drawn, and in front of what.
MARKERS = {"CYCLES": ("|", 11, 1), "PATH": ("o", 8, 3), "PAPERS": ("o", 7, 2), "OURS": ("s", 5, 2)}
GROUP_COLORS = {"CYCLES": "0.55", "PATH": "black"}


def draw(path: Path, score: SceneScore) -> None:
    pyplot = load_pyplot()
    figure, axes = pyplot.subplots(1, len(SCALES) + 1, figsize=(5 * (len(SCALES) + 1), 5), dpi=90, sharex=True)
    for axis, (scale, title) in zip(axes, [*SCALES.items(), ("denoised", "denoised, 1 px")], strict=True):
        for index, shots in enumerate(score.shots.values()):
            curve = sorted((shot.seconds, error_of(shot, scale)) for shot in shots)
            group = shots[0].engine.group
            width = 3.0 if group == "OURS" else 1.3
            axis.plot(*zip(*curve, strict=True), STYLES[group], color=f"C{index % 10}", marker="o", lw=width, ms=4)
        axis.set(xscale="log", yscale="log", xlabel="CPU seconds", title=title)
        axis.grid(which="both", alpha=0.25)
    axes[-1].axhline(score.target_error, color="grey", lw=0.8)
    axes[0].set_ylabel("relMSE")
    titles = [shots[0].engine.title for shots in score.shots.values()]
    figure.legend(axes[0].lines, titles, loc="lower center", ncols=6, fontsize=9)
    figure.suptitle(score.scene.name)
    figure.tight_layout(rect=(0.0, 0.09, 1.0, 1.0))
    figure.savefig(path)
    pyplot.close(figure)


def error_of(shot: Shot, scale: str) -> float:
    return shot.denoised_errors.pixel if scale == "denoised" else shot.errors.at(scale)


def draw_overview(path: Path, scores: Sequence[SceneScore]) -> None:
    """Each system's error x time over that of the best setting of Cycles: a row for each scene, a column for each bar,
    which is a black tick in the row."""
    pyplot = load_pyplot()
    columns = {"pixel": "single pixels", "box8": "boxes of 8 × 8 pixels", DENOISED: "time to a denoised picture"}
    height = 1.6 + 0.42 * len(scores)
    figure, axes = pyplot.subplots(1, len(columns), figsize=(15, height), dpi=90, sharey=True)
    rows = range(len(scores))
    names = [name for name in scores[0].shots if name not in (OURS, OURS_DENOISED)]
    color = dict(zip([n for n in names if n != PATH_TRACER], (f"C{k % 10}" for k in range(len(names))), strict=False))
    for axis, (scale, title) in zip(axes, columns.items(), strict=True):
        for name in names:
            engine = scores[0].shots[name][0].engine
            marker, size, order = MARKERS[engine.group]
            ratios = [ratio(score, name, scale) for score in scores]
            shade = GROUP_COLORS.get(engine.group, color.get(name))
            fill = "none" if engine.group == "PAPERS" else shade
            axis.plot(ratios, rows, marker, color=shade, mfc=fill, ms=size, mew=2, zorder=order, label=engine.title)
        ratios = [ratio(score, ours_at(score, scale), scale) for score in scores]
        axis.plot(ratios, rows, "D", color="crimson", ms=9, zorder=4, label=scores[0].shots[OURS][0].engine.title)
        for row, score in enumerate(scores):
            axis.vlines(bars_of(score)[scale], row - 0.4, row + 0.4, color="black", lw=2, zorder=1)
        axis.axvline(1.0, color="0.8", zorder=0)
        axis.set(xscale="log", xlabel="over the best of Cycles: less is better", title=title)
        axis.grid(axis="y", alpha=0.25)
    axes[0].set_yticks(list(rows), [score.scene.name for score in scores])
    axes[0].invert_yaxis()
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=6, fontsize=9)
    figure.tight_layout(rect=(0.0, 0.95 / height, 1.0, 1.0))
    figure.savefig(path)
    pyplot.close(figure)
