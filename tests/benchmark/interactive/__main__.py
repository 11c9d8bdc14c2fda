"""Error of the first frames after a cold start, a camera cut, an edit of a light, and in a slow pan of the camera.

  python -m tests.benchmark.interactive [--scenes door_ajar market] [--events EVENT ...] [--engines NAME ...]
                                        [--pixels 9216] [--replicas 4] [--reference-samples 1024] [--output FOLDER]

The core is asked for pictures as a 3D viewport asks, with the viewport's settings of a preset: at rest one session of
so many samples, and while the camera moves a session of one sample for each frame, each with the history of the ones
before. Before a cut there were 16 frames of a view 90 degrees to the left, before the edit 16 with one glowing material
half as bright. In the pan the camera turns by a quarter of a degree and moves by a centimetre each frame, after 16 at
rest. All of it ends in the same view of the same scene, at frame 32 of the pan. The papers' systems have ReSTIR with
its own number of candidates for the light that comes straight from lamps.

Frames 1, 4, 16 and 32 are those of Interactive. The other systems are shown at the same time: with as many samples as
fit into its CPU time, at least one. In the pan a system without history has what fits into one frame; one with history
has one sample, though it may take longer than ours. Frame times are those of one more sample at rest. What comes before
the first sample, export of the scene and building, is left out for Cycles, which would start anew with it here, and in
the times of ours it counts as far as the event causes it.

Errors are relMSE, per pixel (without the 0.1 % worst) and in boxes of 8 x 8 pixels, but for the noise of the reference,
means over replicas with different seeds. The output folder gets interactive.md, a plot of error against time of each
scene, and a line of JSON for each number, added to interactive.jsonl. Needs matplotlib.
"""

from __future__ import annotations

import argparse
import atexit
from pathlib import Path

from tests.benchmark.interactive import catalogue
from tests.benchmark.plotting import require_matplotlib
from tests.benchmark.scoreboard.__main__ import chosen_scenes
from tests.benchmark.scoreboard.catalogue import ROOT, SCENES
from tests.benchmark.scoreboard.report import append_lines, commit


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    scenes = [scene.name for scene in SCENES]
    rivals = [engine.name for engine in catalogue.ENGINES if engine.name != catalogue.OURS]
    parser.add_argument("--scenes", nargs="+", choices=scenes, default=["door_ajar", "market"], metavar="NAME")
    parser.add_argument(
        "--events",
        nargs="+",
        choices=catalogue.EVENTS,
        default=catalogue.EVENTS,
        metavar="EVENT",
        help=", ".join(catalogue.EVENTS),
    )
    parser.add_argument(
        "--engines",
        nargs="+",
        choices=rivals,
        default=rivals,
        metavar="NAME",
        help=f"besides Interactive: {', '.join(rivals)}",
    )
    parser.add_argument("--pixels", type=int, default=9216)
    parser.add_argument("--replicas", type=int, default=4)
    parser.add_argument("--reference-samples", type=int, default=1024, help="half as many of moments in the pan")
    parser.add_argument("--output", type=Path, default=ROOT / "out" / "interactive")
    return parser.parse_args()


def main() -> None:
    arguments = parse_arguments()
    require_matplotlib()
    import addon  # with Blender, and below with the core
    from tests.benchmark.interactive import report
    from tests.benchmark.interactive.measure import Experiment
    from tests.benchmark.interactive.stage import Stage

    addon.register()
    atexit.register(addon.unregister)
    chosen = [catalogue.OURS, *arguments.engines]
    engines = [engine for engine in catalogue.ENGINES if engine.name in chosen]
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    lines = [f"Commit {commit()}, {arguments.pixels} pixels, {arguments.replicas} replicas."]
    for scene in chosen_scenes(arguments.scenes):
        experiment = Experiment(Stage(scene, arguments.pixels), engines, arguments.reference_samples)
        scores = [score for event in arguments.events for score in experiment.play(event, arguments.replicas)]
        found = ["", *report.table(scene.name, scores), "", report.costs(experiment.frame_seconds, scores)]
        found += [report.noise(experiment.reference(catalogue.REST)), report.deviations(scores)]
        print("\n".join(found), flush=True)
        lines += found
        (output / "interactive.md").write_text("\n".join(lines) + "\n")
        append_lines(output / "interactive.jsonl", report.entries(scene.name, scores))
        report.draw(output / f"{scene.name}.png", scene.name, scores)


if __name__ == "__main__":
    main()
