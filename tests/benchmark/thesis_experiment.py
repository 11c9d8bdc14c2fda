"""The experiment of [Stefanescu 2025] in one command: City Grid and Monkeys by uniform sampling, ReSTIR and cell cache.

    python -m tests.benchmark.thesis_experiment [--frames 5] [--rounds 3] [--output out/thesis]

Writes `thesis.md` (tables, and where they agree with the thesis), `plots.png` (its Figures 4 and 5) and one picture of
each scene (its Figures 2 and 3). Needs matplotlib.

Each scene and method is measured in processes of its own, in turn, so that the machine's moods fall on all alike. Frame
time is CPU time over all threads: of the first frame with all preparation, and of later ones from the difference of a
session of many frames and one of two. Memory is the core's own count, and the process's peak with Blender in it. The
error is that of direct light, displayed with white at the reference's 97th percentile, against next-event estimation
with the light tree, less that reference's own noise.
"""

from __future__ import annotations

import argparse
import datetime
import subprocess
import sys
from pathlib import Path

from tests.benchmark import thesis_report as report
from tests.benchmark.plotting import require_matplotlib

ROOT = Path(__file__).resolve().parents[2]
PROCESS_SECONDS = 3600
METHODS = tuple(report.TITLES)


def run(scene: str, method: str, seed: int, numbers: argparse.Namespace, long: int) -> Path:
    """Measures in a new process unless the same was measured before."""
    name = f"{scene}-{method}-{numbers.width}-{numbers.frames}-{long}-{seed}.npz"
    path = numbers.output / "measured" / name
    if path.is_file() and not numbers.again:
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"partial-{path.name}")
    command = [sys.executable, "-m", "tests.benchmark.thesis_render", scene, method]
    command += [str(n) for n in (numbers.width, numbers.frames, long, seed)] + [str(partial.resolve())]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PROCESS_SECONDS, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{scene} by {method} failed:\n{done.stdout[-1000:]}{done.stderr[-2000:]}")
    partial.replace(path)
    print(f"measured {scene}, {method}, seed {seed}", flush=True)
    return path


def measure(
    numbers: argparse.Namespace,
) -> tuple[dict[str, report.Reference], dict[str, dict[str, report.Measurement]]]:
    references = {
        scene: report.read_reference(run(scene, "reference", 1001, numbers, numbers.reference_samples))
        for scene in report.SCENES
    }
    paths: dict[tuple[str, str], list[Path]] = {}
    for seed in range(1, numbers.rounds + 1):
        for scene in report.SCENES:
            for method in METHODS:
                long = numbers.long if seed == 1 else 0
                paths.setdefault((scene, method), []).append(run(scene, method, seed, numbers, long))
    results = {
        scene: {method: report.read_measurement(paths[scene, method]) for method in METHODS} for scene in report.SCENES
    }
    return references, results


def write_report(
    folder: Path,
    numbers: argparse.Namespace,
    references: dict[str, report.Reference],
    results: dict[str, dict[str, report.Measurement]],
) -> None:
    lines = [
        "# City Grid and Monkeys, after [Stefanescu 2025]",
        "",
        f"{datetime.date.today()}, {numbers.width} pixels wide, {numbers.rounds} rounds; mean of frames: of "
        f"{numbers.long} frames with history; reference: {numbers.reference_samples} samples.",
        "",
    ]
    for scene, title in report.SCENES.items():
        lines += [f"## {title}: error by frame, time, memory", ""]
        lines += [*report.scene_table(references[scene], results[scene]), ""]
        lines += [f"Error that follows the cells, over that of displaced cells, in {title}:", ""]
        lines += [*report.grid_table(references[scene], results[scene]), ""]
        report.draw_pictures(folder / f"{scene}.png", references[scene], results[scene])
    lines += ["## Where it agrees", "", *report.bars(references, results), ""]
    report.draw_plots(folder / "plots.png", references, results)
    (folder / "thesis.md").write_text("\n".join(lines))
    print("\n".join(lines))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=5, help="3 or more")
    parser.add_argument("--rounds", type=int, default=3, help="repetitions with other seeds")
    parser.add_argument("--width", type=int, default=640, help="pixels, at 16:9")
    parser.add_argument("--long", type=int, default=64, help="frames whose mean shows what does not average out")
    parser.add_argument("--reference-samples", type=int, default=1024)
    parser.add_argument("--output", type=Path, default=ROOT / "out" / "thesis")
    parser.add_argument("--again", action="store_true", help="measure again what the output folder has already")
    numbers = parser.parse_args()
    if numbers.frames < 3:
        parser.error("--frames: times need at least 3")
    require_matplotlib()
    numbers.output = numbers.output.resolve()
    write_report(numbers.output, numbers, *measure(numbers))


if __name__ == "__main__":
    main()
