"""Pictures of the scene at hand for equal CPU time, side by side, to look at."""

from __future__ import annotations

import argparse
import atexit
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.everyday.__main__ import BOUNCES, cpu_seconds
from tests.benchmark.plotting import load_pyplot, require_matplotlib
from tests.support.blender_folder import use_own_folder

FEW, MORE = 2, 10  # samples by which the time of one is told


class Picture(NamedTuple):
    title: str
    engine: str
    build: Callable[[], None]  # into an empty scene
    settings: dict[str, object]  # of scene.cistern, besides the preset Final


def render_for(picture: Picture, size: Sequence[int], seconds: float) -> tuple[NDArray, int]:
    """Linear RGB, row 0 above, and how many samples the time was for, told from two short renders. One thread."""
    import bpy

    from tests.support.engines import prepare, render

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    picture.build()
    prepare(scene, *size, BOUNCES)
    for name, value in {"preset": "FINAL", **picture.settings}.items():
        setattr(scene.cistern, name, value)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    render(scene, picture.engine, 1, 0)  # loads and builds what stays
    times = []
    for samples in (FEW, MORE):
        start = cpu_seconds()
        render(scene, picture.engine, samples, 0)
        times.append(cpu_seconds() - start)
    samples = max(round(seconds * (MORE - FEW) / (times[1] - times[0])), 1)
    return render(scene, picture.engine, samples, 1)[::-1, :, :3], samples


def shown(linear: NDArray, exposure: float) -> NDArray:
    return np.clip(linear * exposure, 0.0, 1.0) ** (1.0 / 2.2)


def write_rows(rows: dict[str, Sequence[Picture]], size: Sequence[int], seconds: float, path: Path) -> None:
    """Each row at the exposure of its last picture."""
    pyplot = load_pyplot()
    columns = max(map(len, rows.values()))
    figure, axes = pyplot.subplots(
        len(rows), columns, figsize=(columns * size[0] / 100, 1.15 * len(rows) * size[1] / 100)
    )
    for row, (light, pictures) in zip(axes, rows.items(), strict=True):
        renders = [render_for(picture, size, seconds) for picture in pictures]
        exposure = 0.35 / float(np.median(renders[-1][0].mean(axis=2)))
        for axis, picture, (linear, samples) in zip(row, pictures, renders, strict=True):
            axis.imshow(shown(linear, exposure), interpolation="nearest")
            axis.set_title(f"{picture.title}\n{light}, {samples} samples", fontsize=9)
            axis.axis("off")
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)
    print(f"Wrote {path}")


def run(description: str, rows: dict[str, Sequence[Picture]], name: str) -> None:
    """A program that writes these rows."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--size", type=int, nargs=2, default=[360, 270])
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "plots")
    arguments = parser.parse_args()
    require_matplotlib()
    use_own_folder()
    import addon

    addon.register()
    atexit.register(addon.unregister)
    write_rows(rows, arguments.size, arguments.seconds, arguments.output / name)
