"""Share of the CPU time of rendering that is spent inside Embree, on .blend files.

  python -m tests.benchmark.embree_share SCENE.blend ... [--scale 0.5] [--samples 8 64]

Linux `perf` (package linux-perf) samples two fresh processes for each scene, one with few samples per pixel and one
with many. The difference of their counts is the rendering alone: export, BVH builds and Python cancel. Counts are
grouped by shared library; the kernel's own time is left out.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

from tests.benchmark.profiling import HERTZ, LIBRARIES, library_group, profile, require_perf


def render(blend: str, scale: float, samples: int) -> None:
    """Inside the sampled process."""
    import atexit

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
    module = "tests.benchmark.embree_share"
    inside = [sys.executable, "-m", module, "--render", str(blend.resolve()), str(scale), str(samples)]
    result: Counter[str] = Counter()
    for (library, _), count in profile(inside, '"error": null').items():
        result[library_group(library)] += count
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
    require_perf()
    print("| scene | " + " | ".join(f"{name} %" for name in LIBRARIES) + " | CPU s |")
    print("|---" * (len(LIBRARIES) + 2) + "|")
    for blend in arguments.scenes:
        few, many = (counts(blend, arguments.scale, samples) for samples in arguments.samples)
        many.subtract(few)
        total = sum(many.values())
        shares = " | ".join(f"{100.0 * many[name] / total:.1f}" for name in LIBRARIES)
        print(f"| {blend.stem} | {shares} | {total / HERTZ:.1f} |", flush=True)


if __name__ == "__main__":
    main()
