"""CPU time per sample per pixel, and error x CPU time, of Cistern beside Cycles, on .blend files, in one run.

  python -m tests.benchmark.cpu_per_sample SCENE.blend ... [--rounds 3] [--scale 0.5] [--samples 16 80] [--json FILE]

Each engine renders each scene in fresh processes, in turn (A B A B ...). Two sample counts are rendered per process;
the difference of their user times cancels scene export and acceleration-structure builds. Medians over the rounds; the
ratio is the median of the rounds' own ratios, because the machine's speed drifts.

Both engines may end dim paths at random from the first bounce on. They do so by different rules, so that a cheaper
sample may also be a noisier one: another column compares squared error x CPU time, which does not depend on that. The
error is relMSE, (x - y)^2 / 2 / (mean^2 + 0.01) of two pictures with different seeds, less the 0.1 % worst values.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
ENGINES = ("CISTERN", "CYCLES")
PROCESS_SECONDS = 1200


def measure(blend: str, engine: str, scale: float, samples: list[int]) -> dict[str, float]:
    """Inside a fresh process: microseconds of user time per sample per pixel, and seconds of everything else."""
    import atexit

    sys.path.insert(0, str(ROOT))
    from tests.support.blender_folder import use_own_folder

    use_own_folder()
    import bpy

    import addon
    from tests.support.engines import prepare, render

    addon.register()
    atexit.register(addon.unregister)
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    factor = scene.render.resolution_percentage / 100.0 * scale
    width, height = round(scene.render.resolution_x * factor), round(scene.render.resolution_y * factor)
    prepare(scene, width, height, bounces=12)
    times, pictures = [], []
    for count, seed in ((samples[0], 1), (samples[1], 2), (samples[1], 3)):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        pictures.append(render(scene, engine, count, seed)[..., :3])
        times.append(resource.getrusage(resource.RUSAGE_SELF).ru_utime - before)
    long_render = (times[1] + times[2]) / 2
    per_sample = (long_render - times[0]) / (samples[1] - samples[0])
    error = relative_error(*pictures[1:]) * samples[1]
    microseconds = per_sample / (width * height) * 1e6
    rest_seconds = times[0] - samples[0] * per_sample
    return {"microseconds": microseconds, "rest_seconds": rest_seconds, "error_time": error * microseconds}


def relative_error(first: NDArray, second: NDArray) -> float:
    """relMSE of either picture, from their difference."""
    mean = 0.5 * (first.astype(np.float64) + second)
    values = np.sort(((first - second) ** 2 / (2.0 * (mean**2 + 0.01))).ravel())
    return float(values[: int(0.999 * len(values)) or 1].mean())


def run_process(blend: Path, engine: str, scale: float, samples: list[int]) -> dict[str, float]:
    command = [sys.executable, __file__, "--measure", str(blend), engine, str(scale), *map(str, samples)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PROCESS_SECONDS, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith("@@")]
    if not lines:
        raise SystemExit(f"{blend.name} with {engine} failed:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return json.loads(lines[-1][2:])


def benchmark(blend: Path, rounds: int, scale: float, samples: list[int]) -> dict:
    results = {engine: [] for engine in ENGINES}
    for _ in range(rounds):
        for engine in ENGINES:
            results[engine].append(run_process(blend, engine, scale, samples))
    ours, theirs = ([r["microseconds"] for r in results[engine]] for engine in ENGINES)
    our_error, their_error = ([r["error_time"] for r in results[engine]] for engine in ENGINES)
    return {
        "scene": blend.stem,
        "cistern_us": statistics.median(ours),
        "cycles_us": statistics.median(theirs),
        "ratio": statistics.median(a / b for a, b in zip(ours, theirs, strict=True)),
        "error_time_ratio": statistics.median(a / b for a, b in zip(our_error, their_error, strict=True)),
        "cistern_rest_s": statistics.median(r["rest_seconds"] for r in results["CISTERN"]),
        "cycles_rest_s": statistics.median(r["rest_seconds"] for r in results["CYCLES"]),
    }


def main() -> None:
    if sys.argv[1:2] == ["--measure"]:
        blend, engine, scale, *samples = sys.argv[2:]
        print("@@" + json.dumps(measure(blend, engine, float(scale), [int(n) for n in samples])), flush=True)
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--scale", type=float, default=0.5, help="of the scene's own resolution")
    parser.add_argument("--samples", type=int, nargs=2, default=[16, 80])
    parser.add_argument("--json", type=Path, help="append one line per scene to this file")
    arguments = parser.parse_args()
    print("| scene | Cistern µs | Cycles µs | ratio | error x time, ratio | Cistern other s | Cycles other s |")
    print("|---|---|---|---|---|---|---|")
    for blend in arguments.scenes:
        row = benchmark(blend, arguments.rounds, arguments.scale, arguments.samples)
        print(
            f"| {row['scene']} | {row['cistern_us']:.2f} | {row['cycles_us']:.2f} | {row['ratio']:.2f} "
            f"| {row['error_time_ratio']:.2f} | {row['cistern_rest_s']:.2f} | {row['cycles_rest_s']:.2f} |",
            flush=True,
        )
        if arguments.json:
            with arguments.json.open("a") as file:
                file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
