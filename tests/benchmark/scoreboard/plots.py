"""Error against CPU time of one scene, at each scale and after denoising."""

from __future__ import annotations

from pathlib import Path

from tests.benchmark.plotting import load_pyplot
from tests.benchmark.scoreboard.board import SCALES, SceneScore, Shot

STYLES = {"CYCLES": "--", "PATH": ":", "PAPERS": "-", "OURS": "-"}


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
