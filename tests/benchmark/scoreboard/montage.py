"""Pictures of a run of the scoreboard side by side, those of equal CPU time.

  python -m tests.benchmark.scoreboard.montage [--run out/scoreboard] [--scenes NAME ...] [--engines NAME ...]
                                               [--output tests/benchmark/plots/equal_time.jpg]

A row for each scene, a column for each engine, with samples and errors of each; of Cycles, if best-cycles is asked for,
the setting that has the least error x time there. Needs matplotlib.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from tests.benchmark.plotting import load_pyplot, require_matplotlib
from tests.benchmark.scoreboard.catalogue import CYCLES, ROOT, engine_named

INCH = 100  # pixels
CAPTION = 34  # pixels above each picture
SCENES = ("city_grid", "door_ajar", "veach_ajar", "sponza")
BEST_CYCLES = "best-cycles"
ENGINES = (BEST_CYCLES, "restir-gi", "world-paths", "path", "final")


def longest_renders(run: Path) -> dict[tuple[str, str], dict]:
    """By scene and engine, the history's last among those with the most samples, which is what the page shows."""
    found: dict[tuple[str, str], dict] = {}
    for line in (run / "history.jsonl").read_text().splitlines():
        entry = json.loads(line)
        key = entry["scene"], entry["engine"]
        if entry["is_target"]:
            continue
        if key not in found or entry["samples"] >= found[key]["samples"]:
            found[key] = entry
    return found


def best_cycles(renders: dict[tuple[str, str], dict], scene: str) -> str:
    names = [engine for of_scene, engine in renders if of_scene == scene and engine.startswith(CYCLES)]
    return min(names, key=lambda name: renders[scene, name]["errors"]["pixel"] * renders[scene, name]["seconds"])


def draw(run: Path, scenes: Sequence[str], engines: Sequence[str], output: Path) -> None:
    pyplot = load_pyplot()
    renders = longest_renders(run)
    sizes = [renders[scene, engines[-1]]["size"] for scene in scenes]
    width = max(w for w, _ in sizes)
    heights = [h * width / w + CAPTION for w, h in sizes]
    figure, axes = pyplot.subplots(
        len(scenes),
        len(engines),
        figsize=(len(engines) * width / INCH, sum(heights) / INCH),
        gridspec_kw={"height_ratios": heights},
        squeeze=False,
    )
    for row, scene in zip(axes, scenes, strict=True):
        for axis, name in zip(row, engines, strict=True):
            engine = best_cycles(renders, scene) if name == BEST_CYCLES else name
            entry = renders[scene, engine]
            axis.imshow(pyplot.imread(run / "pictures" / f"{scene}-{engine}-0.png"), interpolation="nearest")
            title = f"{engine_named(engine).title}, {entry['samples']} samples, {entry['seconds']:.0f} s"
            axis.set_title(f"{title}\nrelMSE {entry['errors']['pixel']:.2g}", fontsize=9, pad=3)
            axis.axis("off")
    figure.subplots_adjust(0.0, 0.0, 1.0, 1.0 - CAPTION / sum(heights), 0.01, CAPTION / min(heights))
    output.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(output, dpi=INCH, pil_kwargs={"quality": 80})
    print(f"Wrote {output}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=Path, default=ROOT / "out" / "scoreboard")
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="NAME")
    parser.add_argument("--engines", nargs="+", default=ENGINES, metavar="NAME")
    parser.add_argument("--output", type=Path, default=ROOT / "tests" / "benchmark" / "plots" / "equal_time.jpg")
    arguments = parser.parse_args()
    require_matplotlib()
    draw(arguments.run, arguments.scenes, arguments.engines, arguments.output)


if __name__ == "__main__":
    main()
