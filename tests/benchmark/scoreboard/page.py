"""A page that shows the pictures of all engines at equal time side by side, each with its errors."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps, image
from numpy.typing import NDArray

from tests.benchmark.scoreboard.board import SceneScore

WHITE_PERCENTILE = 97.0  # of the brightest channel of the reference: what is shown as white
ERROR_RANGE = (-3.0, 1.0)  # of the logarithm to base 10 of a pixel's relative square
STYLE = (
    "body{font:14px sans-serif;background:#222;color:#ddd} figure{display:inline-block;margin:6px} "
    "img{display:block;width:384px;image-rendering:pixelated} a{color:#9cf}"
)


def encoded(picture: NDArray, white: float) -> NDArray:
    """For the screen, by the sRGB curve."""
    linear = np.clip(picture / white, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def error_colours(squares: NDArray) -> NDArray:
    low, high = ERROR_RANGE
    return colormaps["inferno"]((np.log10(squares + 1e-12) - low) / (high - low))[..., :3]


def figure(folder: Path, name: str, picture: NDArray, caption: str) -> str:
    """Saves a picture and returns the markup that shows it."""
    (folder / "pictures").mkdir(exist_ok=True)
    image.imsave(folder / "pictures" / f"{name}.png", np.clip(picture, 0.0, 1.0))
    text = html.escape(caption)
    return f'<figure><img src="pictures/{name}.png" alt="{text}"><figcaption>{text}</figcaption></figure>'


def section(folder: Path, score: SceneScore) -> list[str]:
    reference, name = score.reference, score.scene.name
    brightest = reference.mean.max(axis=2)
    white = float(np.percentile(brightest[brightest > 0.0], WHITE_PERCENTILE))
    lines = [f'<h2 id="{name}">{name}</h2>', f'<p><img style="width:100%" src="{name}.png" alt="error over time"></p>']
    lines.append(figure(folder, f"{name}-reference", encoded(reference.mean, white), "reference"))
    for engine, shots in score.shots.items():
        shot = score.last(engine)
        pictures = {
            f"{shots[0].engine.title}, {shot.samples} samples, {shot.seconds:.1f} s": encoded(
                shot.picture.combined, white
            ),
            f"error, relMSE {shot.errors.pixel:.3g}": error_colours(reference.squares(shot.picture.combined)),
            f"denoised, relMSE {shot.denoised_errors.pixel:.3g}": encoded(shot.denoised, white),
        }
        row = [figure(folder, f"{name}-{engine}-{k}", p, text) for k, (text, p) in enumerate(pictures.items())]
        lines.append(f"<div>{''.join(row)}</div>")
    return lines


def write(folder: Path, scores: Sequence[SceneScore]) -> None:
    lines = ["<!doctype html>", '<meta charset="utf-8">', "<title>Scoreboard</title>", f"<style>{STYLE}</style>"]
    lines.append("<h1>Scoreboard</h1><p>Pictures of equal CPU time, errors (black 0.001, white 10), denoised.</p>")
    lines.append("<p>" + " · ".join(f'<a href="#{s.scene.name}">{s.scene.name}</a>' for s in scores) + "</p>")
    for score in scores:
        lines += section(folder, score)
    (folder / "index.html").write_text("\n".join(lines))
