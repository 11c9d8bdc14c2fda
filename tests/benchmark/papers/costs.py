"""Where the time of a frame goes in each system, and how many bytes a pixel takes.

  python -m tests.benchmark.papers.costs [--scenes NAME ...] [--frames 8] [--pixels 9216] [--output out/papers]

Microseconds of CPU time for each pixel and frame by stage, of frames after the first, and bytes for each pixel as the
core counts them: the slope between two pictures, of which the second has twice as many pixels.
[Ouyang 2021] stores 48 bytes for each reservoir; [Zhang and Wang 2023] 64, of which a pixel has six, and a grid of 84.
Theirs know of a sample point its place, its normal and one radiance; ours also its material, the light it received and
from where, so that it can be evaluated again towards other points.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from tests.benchmark.papers.comparison import parser
from tests.benchmark.papers.sessions import Sessions
from tests.benchmark.scoreboard.catalogue import scene_named

SCENES = ("door_ajar", "glossy_hall")
SYSTEMS: dict[str, dict[str, str]] = {
    "path tracer": {},
    "RIS": {"direct": "RIS", "secondary": "RIS"},
    "ReSTIR": {"direct": "RESTIR"},
    "ReSTIR, cell cache [Stefanescu 2025]": {"direct": "RESTIR_CACHE"},
    "cell reservoirs [Boissé 2021]": {"secondary": "CELL_RESERVOIRS"},
    "ReSTIR GI [Ouyang 2021]": {"indirect": "SCREEN_REUSE"},
    "world-space paths [Zhang and Wang 2023]": {"indirect": "WORLD_REUSE"},
    "cell sharing": {"indirect": "CELL_SHARED"},
}
PAPER_BYTES = {
    "ReSTIR GI [Ouyang 2021]": "48 a reservoir",
    "world-space paths [Zhang and Wang 2023]": "6 x 64 + 84",
}
PATHS = "Paths"  # of the path tracer, all there is
BUFFERED = 3  # frames after which no buffer grows any more


def measure(scene: str, arguments: argparse.Namespace) -> list[str]:
    sessions = Sessions(scene_named(scene), arguments.pixels, arguments.bounces, "TREE")
    size, double = (sessions.size(count) for count in (arguments.pixels, 2 * arguments.pixels))
    pixels, more_pixels = (s["width"] * s["height"] for s in (size, double))
    rows: dict[str, dict[str, float]] = {}
    bytes_of: dict[str, float] = {}
    for name, answers in SYSTEMS.items():
        settings = {**answers, "temporal_reuse": True}
        first, all_frames = (sessions.mean(count, 1, **settings) for count in (1, 1 + arguments.frames))
        smaller, larger = (sessions.mean(BUFFERED, 1, **s, **settings).memory_bytes for s in (size, double))
        spent = {stage: s - first.stages.get(stage, 0.0) for stage, s in all_frames.stages.items()}
        spent = spent or {PATHS: all_frames.seconds - first.seconds}
        rows[name] = {stage: 1e6 * s / (arguments.frames * pixels) for stage, s in spent.items()}
        bytes_of[name] = (larger - smaller) / (more_pixels - pixels)
    stages = list(dict.fromkeys(stage for row in rows.values() for stage in row))
    lines = [
        f"## {scene}, {arguments.bounces} bounces, {pixels} pixels, {arguments.frames} frames",
        "",
        f"| µs | {' | '.join(SYSTEMS)} |",
        f"|---|{'---|' * len(SYSTEMS)}",
    ]
    for stage in stages:
        values = (rows[name].get(stage) for name in SYSTEMS)
        lines.append(f"| {stage} | {' | '.join('' if v is None else f'{v:.2f}' for v in values)} |")
    lines += [
        f"| all | {' | '.join(f'{sum(rows[name].values()):.2f}' for name in SYSTEMS)} |",
        f"| bytes | {' | '.join(f'{bytes_of[name]:.0f}' for name in SYSTEMS)} |",
        f"| bytes, paper | {' | '.join(PAPER_BYTES.get(name, '') for name in SYSTEMS)} |",
        "",
    ]
    return lines


def main() -> None:
    command = parser(__doc__, SCENES, bounces=2)
    command.add_argument("--frames", type=int, default=8)
    arguments = command.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    file: Path = arguments.output / "costs.md"
    lines: list[str] = []
    for scene in arguments.scenes:
        lines += measure(scene, arguments)
        file.write_text("\n".join(lines))
    print("\n".join(lines))


if __name__ == "__main__":
    main()
