"""Error per frame while something moves, with history and without, as a table and a plot.

  python -m tests.benchmark.motion [--frames 10] [--size 96] [--replicas 8] [--references 1024] [--plot FILE.png]
                                   [--sequences camera light object still cut] [--light Direct] [--candidates 2]

A room with sixty small lamps, two panels and a ball. The camera goes around, a panel slides along the ceiling, the ball
rolls; or nothing moves, or the camera jumps to the other side in frame 5. Each frame is a session of one sample, as in
a viewport that renders one picture per edit. The error of a frame is its mean squared difference from a path-traced
reference of the same moment, over the squared mean of the reference, averaged over replicas with different seeds: of
pixels, and of means over blocks of 8 x 8 pixels, which do not hide a ghost behind noise. `ghost` is what history does
to the mean picture: the root mean squared difference of block means, averaged over replicas, from the reference, over
the mean; `noise` is what that would be without any. Edits of light drop the history of paths, unless they are
validated: then those that no longer hold are. Needs matplotlib for the plot.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import cistern_core as core
import numpy as np
from numpy.typing import NDArray

from tests.benchmark.plotting import load_pyplot, require_matplotlib
from tests.support.core_scenes import DEFAULTS
from tests.support.edited_scenes import BALL, WARM, EditableScene, studio

BLOCK = 8
CUT_FRAME = 5
PATH_TRACING = "path tracing"
SYSTEMS: dict[str, dict] = {
    PATH_TRACING: {},
    "ReSTIR": dict(direct="RESTIR"),
    "ReSTIR, ReSTIR GI": dict(direct="RESTIR", secondary="CELL_RESERVOIRS", indirect="SCREEN_REUSE"),
    "ReSTIR, ReSTIR GI, validated": dict(direct="RESTIR", indirect="SCREEN_REUSE", path_validation=6),
    "ReSTIR, world-space paths": dict(direct="RESTIR", secondary="CELL_RESERVOIRS", indirect="WORLD_REUSE"),
    "Interactive (ours)": dict(indirect="CELL_SHARED"),
}
VARIANTS = [(bias, history) for bias in ("UNBIASED", "FAST") for history in (True, False)]


def move_camera(scene: EditableScene, frame: int) -> None:
    angle = 0.035 * frame
    scene.set_camera((2.7 * np.sin(angle), -2.7 * np.cos(angle), 1.1 + 0.02 * frame), (0.0, 0.0, 0.8), half_width=0.55)


def move_light(scene: EditableScene, frame: int) -> None:
    scene.add_panel(-0.7 + 0.15 * frame, tuple(4.0 * c for c in WARM), replace=0)


def move_object(scene: EditableScene, frame: int) -> None:
    scene.move(BALL, (0.08 * frame, -0.03 * frame, 0.0))


def rest(scene: EditableScene, frame: int) -> None:
    move_camera(scene, 0)


def cut(scene: EditableScene, frame: int) -> None:
    move_camera(scene, 0 if frame < CUT_FRAME else -10)


SEQUENCES: dict[str, Callable[[EditableScene, int], None]] = {
    "camera": move_camera,
    "light": move_light,
    "object": move_object,
    "still": rest,
    "cut": cut,
}


def sequence(name: str, frames: int) -> list[core.Scene]:
    scene = studio()
    rng = np.random.default_rng(3)
    for _ in range(60):
        position = (*rng.uniform((-0.95, -1.0), (0.95, 0.95)), rng.uniform(0.1, 1.7))
        color = 0.03 * rng.dirichlet([0.5, 0.5, 0.5])
        scene.builder.add_point_light("bulb", position, 0.02, tuple(color), visibility=30)
    scenes = []
    for frame in range(frames):
        SEQUENCES[name](scene, frame)
        scenes.append(scene.snapshot())
    return scenes


def picture(scene: core.Scene, cache: core.RenderCache | None, size: int, light: str, **settings) -> NDArray:
    members = DEFAULTS | dict(width=size, height=size, samples=1, max_bounces=3, keep_instances=True) | settings
    members |= dict(passes=[] if light == "Combined" else [light])
    session = core.Session(core.Settings(**members))
    session.start(scene, cache)
    progress = session.wait(3600.0)
    if progress.status is not core.Status.DONE:
        raise RuntimeError(progress.error)
    return session.read(light)[..., :3].astype(np.float64)


def blocks(picture: NDArray) -> NDArray:
    n = picture.shape[0] // BLOCK * BLOCK
    return picture[:n, :n].reshape(n // BLOCK, BLOCK, n // BLOCK, BLOCK, -1).mean(axis=(1, 3))


def errors(pictures: NDArray, references: NDArray) -> dict[str, NDArray]:
    """By frame, of (replicas, frames, height, width, 3) and (frames, height, width, 3)."""
    level = references.mean(axis=(1, 2, 3))
    of_pixels = np.square(pictures - references).mean(axis=(0, 2, 3, 4)) / level**2
    difference = np.array([[blocks(p) - blocks(r) for p, r in zip(one, references, strict=True)] for one in pictures])
    of_blocks = np.square(difference).mean(axis=(0, 2, 3, 4)) / level**2
    ghost = np.sqrt(np.square(difference.mean(axis=0)).mean(axis=(1, 2, 3))) / level
    noise = np.sqrt(difference.var(axis=0, ddof=1).mean(axis=(1, 2, 3)) / len(pictures)) / level
    return {"pixels": of_pixels, "blocks": of_blocks, "ghost": ghost, "noise": noise}


def measure(name: str, arguments: argparse.Namespace) -> dict[tuple[str, str, bool], dict[str, NDArray]]:
    """Errors by system, bias and whether history was kept."""
    scenes = sequence(name, arguments.frames)
    view = (arguments.size, arguments.light)
    references = np.array([picture(s, None, *view, samples=arguments.references, seed=10**6) for s in scenes])
    found = {}
    for system, answers in SYSTEMS.items():
        for bias, history in VARIANTS if system != PATH_TRACING else [("UNBIASED", False)]:
            pictures = []
            for seed in range(1, arguments.replicas + 1):
                cache = core.RenderCache()
                reuse = dict(light_candidates=arguments.candidates, bias=bias, keep_history=history, seed=seed)
                pictures.append([picture(s, cache, *view, **answers, **reuse) for s in scenes])
            found[system, bias, history] = errors(np.array(pictures), references)
    return found


def print_table(name: str, found: dict[tuple[str, str, bool], dict[str, NDArray]]) -> None:
    frames = len(next(iter(found.values()))["pixels"])
    print(f"\n{name}: error of pixels, frame by frame\n")
    print(
        "| system | bias | history | " + " | ".join(map(str, range(frames))) + " | 8 x 8, last | ghost (noise), last |"
    )
    print("|" + "---|" * (frames + 5))
    for (system, bias, history), error in found.items():
        cells = " | ".join(f"{e:.3g}" for e in error["pixels"])
        ghost = f"{error['ghost'][-1]:.4f} ({error['noise'][-1]:.4f})"
        print(f"| {system} | {bias} | {'on' if history else 'off'} | {cells} | {error['blocks'][-1]:.3g} | {ghost} |")


def draw(results: dict[str, dict[tuple[str, str, bool], dict[str, NDArray]]], path: Path) -> None:
    pyplot = load_pyplot()
    figure, axes = pyplot.subplots(2, len(results), figsize=(5 * len(results), 8), squeeze=False)
    for column, (name, found) in enumerate(results.items()):
        for row, kind in enumerate(("pixels", "blocks")):
            axis = axes[row][column]
            colors = {s: f"C{i}" for i, s in enumerate(SYSTEMS)}
            for (system, bias, history), error in found.items():
                style = ("-" if bias == "UNBIASED" else ":") if history else ("--" if bias == "UNBIASED" else "-.")
                label = f"{system}, {bias.lower()}, history {'on' if history else 'off'}"
                axis.semilogy(error[kind], style, color=colors[system], label=label)
            axis.set(title=name, xlabel="frame", ylabel=f"error of {kind}")
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, fontsize=7)
    figure.tight_layout(rect=(0.0, 0.14, 1.0, 1.0))
    figure.savefig(path)
    pyplot.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=10)
    parser.add_argument("--size", type=int, default=96)
    parser.add_argument("--replicas", type=int, default=8)
    parser.add_argument("--references", type=int, default=1024)
    parser.add_argument("--sequences", nargs="+", choices=list(SEQUENCES), default=list(SEQUENCES))
    parser.add_argument("--light", choices=("Combined", "Direct", "Indirect"), default="Combined")
    parser.add_argument("--candidates", type=int, default=0, help="light samples of a visible point; 0: as published")
    parser.add_argument("--plot", type=Path)
    arguments = parser.parse_args()
    if arguments.plot:
        require_matplotlib()
    results = {}
    for name in arguments.sequences:
        results[name] = measure(name, arguments)
        print_table(name, results[name])
    if arguments.plot:
        draw(results, arguments.plot)


if __name__ == "__main__":
    main()
