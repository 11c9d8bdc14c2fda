"""Variance and CPU time of our path tracer beside Cycles', in scenes as people make them on any day.

  python -m tests.benchmark.everyday [SCENE ...] [--samples 16] [--seeds 6] [--pixels 80 60]

Nothing is shared or denoised: a look at light sampling, whose faults show as noise. Each scene in a process of its own,
one thread, pictures of both engines with several seeds; variance over the squared mean (and 1 % of the picture's), of
a sample, per pixel and in boxes of 4 x 4, less the 2 % of pixels that are noisiest; CPU time less that of one sample.
"""

from __future__ import annotations

import argparse
import atexit
import json
import resource
import subprocess
import sys

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.everyday.scenes import SCENES
from tests.support.blender_folder import use_own_folder

BOUNCES = 12
ENGINES = ("CYCLES", "CISTERN")
PROCESS_SECONDS = 600


def cpu_seconds() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


def noise(pictures: NDArray[np.float32], box: int) -> float:
    """Of pictures (count, height, width, 3): variance between them over their squared mean, in boxes."""
    count, height, width = (size // step for size, step in zip(pictures.shape, (1, box, box), strict=False))
    cut = pictures[:, : height * box, : width * box].reshape(count, height, box, width, box, 3).mean(axis=(2, 4))
    mean, variance = cut.mean(axis=(0, 3)), cut.var(axis=0, ddof=1).mean(axis=2)
    values = np.sort((variance / (mean**2 + 0.01 * mean.mean() ** 2)).ravel())
    return float(values[: int(0.98 * len(values)) or 1].mean())


def measure(name: str, samples: int, seeds: int, width: int, height: int) -> dict[str, list[float]]:
    """Inside a fresh process, of each engine: noise of a sample in pixels and boxes, microseconds, mean."""
    use_own_folder()
    import bpy

    import addon
    from tests.support.engines import prepare, render

    addon.register()
    atexit.register(addon.unregister)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    SCENES[name]()
    scene = bpy.context.scene
    prepare(scene, width, height, BOUNCES)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    result = {}
    for engine in ENGINES:
        for _ in range(2):  # the first also loads and builds what stays
            start = cpu_seconds()
            render(scene, engine, 1, 0)
            one = cpu_seconds() - start
        pictures, start = [], cpu_seconds()
        for seed in range(seeds):
            pictures.append(render(scene, engine, samples, seed + 1)[..., :3])
        seconds = (cpu_seconds() - start) / seeds - one
        all_pictures = np.array(pictures)
        microseconds = seconds / (samples - 1) / (width * height) * 1e6
        errors = [noise(all_pictures, box) * samples for box in (1, 4)]
        result[engine] = [*errors, microseconds, float(all_pictures.mean())]
    return result


def run_process(name: str, numbers: list[int]) -> dict[str, list[float]]:
    command = [sys.executable, "-m", __spec__.name, "--measure", name, *map(str, numbers)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PROCESS_SECONDS, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith("@@")]
    if not lines:
        raise SystemExit(f"{name} failed:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return json.loads(lines[-1][2:])


def main() -> None:
    if sys.argv[1:2] == ["--measure"]:
        name, *numbers = sys.argv[2:]
        print("@@" + json.dumps(measure(name, *map(int, numbers))), flush=True)
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", choices=[*SCENES, []], metavar="SCENE", help=", ".join(SCENES))
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--pixels", type=int, nargs=2, default=[80, 60])
    arguments = parser.parse_args()
    print("Cistern over Cycles:\n\n| scene | variance: 1 px | 4 px | CPU time | variance × time: 1 px | 4 px | mean |")
    print("|---|---|---|---|---|---|---|")
    for name in arguments.scenes or SCENES:
        result = run_process(name, [arguments.samples, arguments.seeds, *arguments.pixels])
        pixel, box, time, mean = (
            ours / theirs for ours, theirs in zip(*map(result.get, reversed(ENGINES)), strict=True)
        )
        print(
            f"| {name} | {pixel:.2f} | {box:.2f} | {time:.2f} | {pixel * time:.2f} | {box * time:.2f} | {mean:.4f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
