"""The project's scoreboard: error x CPU time of Cistern, of every system of the papers, and of Cycles, in one run.

  python -m tests.benchmark.scoreboard references [--scenes NAME ...] [--reference-samples 512] [--resolution 20736]
  python -m tests.benchmark.scoreboard [--scenes NAME ...] [--engines NAME ...] [--samples 64] [--budget SECONDS]

The first command renders what is missing of the references, one for each scene, by Cycles, into a cache that later runs
share; what the scene is made from is part of their names, so that an edited scene gets a new one.

The second renders each scene by each engine: with four samples, then for equal CPU time, for a fourth and a half of the
budget and for the whole of it, in turn (A B C ... A B C ...), each picture in a process of its own. The budget is what
Cycles takes for its `--samples`, without export and building, which are measured apart and not counted. Errors are
relMSE per pixel and in boxes of 4 x 4 and 8 x 8 pixels, and per pixel after the same denoiser with the same guides for
all, for direct light, indirect light and the emission in view each by itself.

The output folder gets scoreboard.md (tables, and the bars met or missed), overview.png (all of it at a glance), a plot
of error against time of each scene, a page with all pictures beside their errors (index.html), and a line of JSON for
each picture, added to history.jsonl.
Scenes are those that examples/ builds and those of the folder CISTERN_TEST_SCENES. Needs matplotlib.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from tests.benchmark.plotting import require_matplotlib
from tests.benchmark.scoreboard import board, catalogue, report
from tests.benchmark.scoreboard.measure import GUIDE_ENGINE, Laboratory


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    out = catalogue.ROOT / "out"
    scenes, engines = ([entry.name for entry in entries] for entries in (catalogue.SCENES, catalogue.ENGINES))
    parser.add_argument("command", nargs="?", choices=("run", "references"), default="run")
    parser.add_argument("--scenes", nargs="+", choices=scenes, metavar="NAME", help=", ".join(scenes))
    parser.add_argument(
        "--engines", nargs="+", choices=engines, default=engines, metavar="NAME", help=", ".join(engines)
    )
    parser.add_argument(
        "--resolution", type=int, default=192 * 108, help="pixels of a picture, in the scene's own shape"
    )
    parser.add_argument("--samples", type=int, default=64, help="of Cycles: the error after denoising to be reached")
    parser.add_argument("--budget", type=float, help="CPU seconds of the longest render (default: those of Cycles)")
    parser.add_argument("--rounds", type=int, default=1, help="repetitions with other seeds")
    parser.add_argument("--reference-samples", type=int, default=512, help="in both halves together")
    parser.add_argument("--cache", type=Path, default=out / "references")
    parser.add_argument("--output", type=Path, default=out / "scoreboard")
    return parser.parse_args()


def chosen_scenes(names: list[str] | None) -> list[catalogue.Scene]:
    """Those asked for, or all; says which are not there."""
    scenes = [scene for scene in catalogue.SCENES if names is None or scene.name in names]
    missing = [scene.name for scene in scenes if not scene.is_there]
    if missing:
        print(f"Left out, since {catalogue.SCENES_VARIABLE} names no folder with them: {', '.join(missing)}")
    return [scene for scene in scenes if scene.is_there]


def main() -> None:
    arguments = parse_arguments()
    laboratory = Laboratory(arguments.cache.resolve(), arguments.resolution)
    scenes = chosen_scenes(arguments.scenes)
    if arguments.command == "references":
        for scene in scenes:
            laboratory.extend_reference(scene, arguments.reference_samples)
            reference = laboratory.reference(scene)
            print(f"{scene.name}: noise {reference.noise}, least {reference.resolution}", flush=True)
            if scene.reference != GUIDE_ENGINE:
                print(f"to Cycles: {laboratory.difference_to_cycles(scene, reference)}", flush=True)
        return
    require_matplotlib()
    engines = [catalogue.engine_named(name) for name in arguments.engines]
    plan = board.Plan(engines, arguments.samples, arguments.budget, arguments.rounds)
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    scored = []
    for scene in scenes:
        scored.append(board.score(laboratory, scene, plan))
        report.append_history(output / "history.jsonl", scored[-1])
        report.write(output, scored)  # anew after each scene: a run that is stopped leaves what it has
    print(f"Wrote {output / 'scoreboard.md'}")


if __name__ == "__main__":
    main()
