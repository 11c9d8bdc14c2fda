"""What openings and light through panes are worth, to look at: rooms with a window by Cycles and by Cistern, for equal
CPU time.

  python -m tests.benchmark.windows [--seconds 20] [--size 360 270] [--output tests/benchmark/plots]

Writes windows.jpg. Above, under an even world and a sky, Cycles, Cycles with a portal in the window, Final without
openings and with them; below, where the sun shines in through glass, Cycles, Cycles with glass that throws no shadow
(as one helps oneself), Final without openings and light through panes, and with both. One thread; `--seconds` are those
of the samples, told from two short renders.
"""

from __future__ import annotations

import argparse
import atexit
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.everyday.__main__ import BOUNCES, cpu_seconds
from tests.benchmark.everyday.scenes import PANE, SCENES
from tests.benchmark.plotting import load_pyplot, require_matplotlib
from tests.support.blender_folder import use_own_folder

FEW, MORE = 2, 10  # samples by which the time of one is told


class Column(NamedTuple):
    title: str
    scene: str
    engine: str
    finds: bool = False  # openings, and light through panes
    is_shadowless: bool = False  # the glass


def open_window(world: str) -> tuple[Column, ...]:
    return (
        Column("Cycles", f"window_{world}", "CYCLES"),
        Column("Cycles with a portal", f"portal_{world}", "CYCLES"),
        Column("Final without openings", f"window_{world}", "CISTERN"),
        Column("Final", f"window_{world}", "CISTERN", finds=True),
    )


ROWS = {
    "even world": open_window("world"),
    "sky": open_window("sky"),
    "sun behind glass": (
        Column("Cycles", "glazed_sun", "CYCLES"),
        Column("Cycles, glass without shadow", "glazed_sun", "CYCLES", is_shadowless=True),
        Column("Final without light through panes", "glazed_sun", "CISTERN"),
        Column("Final", "glazed_sun", "CISTERN", finds=True),
    ),
}


def picture(column: Column, arguments: argparse.Namespace) -> tuple[NDArray, int]:
    """Linear RGB, row 0 above, and how many samples the time was for."""
    import bpy

    from tests.support.engines import prepare, render

    bpy.ops.wm.read_factory_settings(use_empty=True)
    SCENES[column.scene]()
    scene = bpy.context.scene
    prepare(scene, *arguments.size, BOUNCES)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.cistern.preset = "FINAL"
    scene.cistern.find_openings = scene.cistern.light_through_panes = column.finds
    if column.is_shadowless:
        scene.objects[PANE].visible_shadow = False
    render(scene, column.engine, 1, 0)  # loads and builds what stays
    times = []
    for samples in (FEW, MORE):
        start = cpu_seconds()
        render(scene, column.engine, samples, 0)
        times.append(cpu_seconds() - start)
    samples = max(round(arguments.seconds * (MORE - FEW) / (times[1] - times[0])), 1)
    return render(scene, column.engine, samples, 1)[::-1, :, :3], samples


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
    columns = max(map(len, ROWS.values()))
    figure, axes = pyplot.subplots(len(ROWS), columns, figsize=(columns * width / 100, 1.15 * len(ROWS) * height / 100))
    for row, (light, shown_columns) in zip(axes, ROWS.items(), strict=True):
        pictures = [picture(column, arguments) for column in shown_columns]
        exposure = 0.35 / float(np.median(pictures[-1][0].mean(axis=2)))  # that of the row's clearest picture
        for axis, column, (linear, samples) in zip(row, shown_columns, pictures, strict=True):
            axis.imshow(shown(linear, exposure), interpolation="nearest")
            axis.set_title(f"{column.title}\n{light}, {samples} samples", fontsize=9)
            axis.axis("off")
    figure.tight_layout()
    arguments.output.mkdir(parents=True, exist_ok=True)
    path = arguments.output / "windows.jpg"
    figure.savefig(path, dpi=100)
    print(f"Wrote {path}")


if __name__ == "__main__":
    main()
