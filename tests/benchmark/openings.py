"""What openings are worth, to look at: a room with a window by Cycles and by Cistern, for equal CPU time.

  python -m tests.benchmark.openings [--seconds 20] [--size 360 270] [--output tests/benchmark/plots]

Writes openings.jpg: under an even world (above) and a sky (below) Cycles, Cycles with a portal in the window, Final
without openings and with them. One thread; `--seconds` are those of the samples, told from two short renders.
"""

from __future__ import annotations

import argparse
import atexit
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.everyday.__main__ import BOUNCES, cpu_seconds
from tests.benchmark.everyday.scenes import SCENES
from tests.benchmark.plotting import load_pyplot, require_matplotlib
from tests.support.blender_folder import use_own_folder

FEW, MORE = 2, 10  # samples by which the time of one is told
WORLDS = {"even world": "world", "sky": "sky"}
# Title, scene, engine, openings.
COLUMNS = (
    ("Cycles", "window", "CYCLES", False),
    ("Cycles with a portal", "portal", "CYCLES", False),
    ("Final without openings", "window", "CISTERN", False),
    ("Final", "window", "CISTERN", True),
)


def picture(name: str, engine: str, finds_openings: bool, arguments: argparse.Namespace) -> tuple[NDArray, int]:
    """Linear RGB, row 0 above, and how many samples the time was for."""
    import bpy

    from tests.support.engines import prepare, render

    bpy.ops.wm.read_factory_settings(use_empty=True)
    SCENES[name]()
    scene = bpy.context.scene
    prepare(scene, *arguments.size, BOUNCES)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.cistern.preset, scene.cistern.find_openings = "FINAL", finds_openings
    render(scene, engine, 1, 0)  # loads and builds what stays
    times = []
    for samples in (FEW, MORE):
        start = cpu_seconds()
        render(scene, engine, samples, 0)
        times.append(cpu_seconds() - start)
    samples = max(round(arguments.seconds * (MORE - FEW) / (times[1] - times[0])), 1)
    return render(scene, engine, samples, 1)[::-1, :, :3], samples


def shown(linear: NDArray, exposure: float) -> NDArray:
    return np.clip(linear * exposure, 0.0, 1.0) ** (1.0 / 2.2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--size", type=int, nargs=2, default=[360, 270])
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "plots")
    arguments = parser.parse_args()
    require_matplotlib()
    use_own_folder()
    import addon

    addon.register()
    atexit.register(addon.unregister)
    pyplot = load_pyplot()
    width, height = arguments.size
    figure, axes = pyplot.subplots(len(WORLDS), len(COLUMNS), figsize=(len(COLUMNS) * width / 100, 2.2 * height / 100))
    for row, (world, suffix) in zip(axes, WORLDS.items(), strict=True):
        exposure = 0.0
        for axis, (title, scene, engine, finds_openings) in zip(row, COLUMNS, strict=True):
            linear, samples = picture(f"{scene}_{suffix}", engine, finds_openings, arguments)
            exposure = exposure or 0.35 / float(np.median(linear.mean(axis=2)))  # that of the row's first picture
            axis.imshow(shown(linear, exposure), interpolation="nearest")
            axis.set_title(f"{title}, {world}: {samples} samples", fontsize=9)
            axis.axis("off")
    figure.tight_layout()
    arguments.output.mkdir(parents=True, exist_ok=True)
    path = arguments.output / "openings.jpg"
    figure.savefig(path, dpi=100)
    print(f"Wrote {path}")


if __name__ == "__main__":
    main()
