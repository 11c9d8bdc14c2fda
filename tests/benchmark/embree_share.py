"""Share of the CPU time of rendering that is spent inside Embree, on .blend files.

  python -m tests.benchmark.embree_share SCENE.blend ... [--scale 0.5] [--samples 8 64]

Linux `perf` (package linux-perf) samples two fresh processes for each scene, one with few samples per pixel and one
with many. The difference of their counts is the rendering alone: export, BVH builds and Python cancel. Counts are
grouped by shared library; the kernel's own time is left out.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERTZ = 499
PROCESS_SECONDS = 1200
# First pattern that a library's name contains; what none matches is "other".
GROUPS = (
    ("Embree", "embree"),
    ("Cistern", "cistern_core"),
    ("TBB", "tbb"),
    ("C library", "libm"),
    ("C library", "libc"),
)


def render(blend: str, scale: float, samples: int) -> None:
    """Inside the sampled process."""
    import atexit

    sys.path.insert(0, str(ROOT))
    from tests.support.blender_folder import use_own_folder

    use_own_folder()
    import bpy

    import addon
    from tests.support.engines import prepare

    addon.register()
    atexit.register(addon.unregister)
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    factor = scene.render.resolution_percentage / 100.0 * scale
    prepare(scene, round(scene.render.resolution_x * factor), round(scene.render.resolution_y * factor))
    scene.render.engine, scene.cistern.samples = "CISTERN", samples
    bpy.ops.render.render()


def counts(blend: Path, scale: float, samples: int) -> Counter[str]:
    """Profile samples by group of a whole process."""
    with tempfile.TemporaryDirectory(prefix="cistern-perf-") as folder:
        data = str(Path(folder) / "perf.data")
        inside = [sys.executable, __file__, "--render", str(blend), str(scale), str(samples)]
        record = ["perf", "record", "-q", "-e", "cpu-clock:u", "-F", str(HERTZ), "-o", data, "--", *inside]
        done = subprocess.run(record, capture_output=True, text=True, timeout=PROCESS_SECONDS, check=False)
        if done.returncode != 0 or '"error": null' not in done.stdout:
            raise SystemExit(f"{blend.name} failed:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
        report = ["perf", "report", "-q", "-n", "--stdio", "--sort", "dso", "-i", data]
        table = subprocess.run(report, capture_output=True, text=True, timeout=PROCESS_SECONDS, check=True).stdout
    result: Counter[str] = Counter()
    for _, count, library in re.findall(r"^\s*([\d.]+)%\s+(\d+)\s+(\S+)", table, re.MULTILINE):
        result[next((group for group, pattern in GROUPS if pattern in library), "other")] += int(count)
    return result


def main() -> None:
    if sys.argv[1:2] == ["--render"]:
        render(sys.argv[2], float(sys.argv[3]), int(sys.argv[4]))
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--scale", type=float, default=0.5, help="of the scene's own resolution")
    parser.add_argument("--samples", type=int, nargs=2, default=[8, 64])
    arguments = parser.parse_args()
    if shutil.which("perf") is None:
        raise SystemExit("perf is missing: install the package linux-perf")
    names = [*dict.fromkeys(group for group, _ in GROUPS), "other"]
    print("| scene | " + " | ".join(f"{name} %" for name in names) + " | CPU s |")
    print("|---" * (len(names) + 2) + "|")
    for blend in arguments.scenes:
        few, many = (counts(blend, arguments.scale, samples) for samples in arguments.samples)
        many.subtract(few)
        total = sum(many.values())
        shares = " | ".join(f"{100.0 * many[name] / total:.1f}" for name in names)
        print(f"| {blend.stem} | {shares} | {total / HERTZ:.1f} |", flush=True)


if __name__ == "__main__":
    main()
