"""Figure 13 of [Ouyang 2021]: how much less MSE than path tracing a frame has after 32 frames of reuse.

  python -m tests.benchmark.papers.ouyang [--scenes NAME ...] [--frames 32] [--rounds 3] [--output out/papers]

At equal time for each frame, as in the paper, path tracing gets the CPU time of one frame with history; at equal total
time, that of all frames up to then. The paper's figures are of the first kind, at 1920 x 1080. How many samples of path
tracing such a frame costs is told as well: times the ratio at equal time it is that at one sample each. The share of
the own path is the error that a frame has in common with path tracing by the paths of this frame alone: of light that
takes no part in reuse, since something smooth is on the way, and of one sample in 31 of the rest. Needs matplotlib.
"""

from __future__ import annotations

import argparse

import numpy as np

from tests.benchmark.papers.comparison import Finding, Range, parser, run
from tests.benchmark.papers.sessions import Reference, Sessions

SCENES = ("veach_ajar", "door_ajar", "market", "glossy_hall")
PAPER = {"UNBIASED": Range(9.3, 166.0), "FAST": Range(14.6, 141.0)}


def measure(sessions: Sessions, reference: Reference, arguments: argparse.Namespace, scene: str) -> list[Finding]:
    """Rounds in turn: both forms of reuse, and path tracing for as long."""
    ratios: dict[tuple[str, str, str], list[float]] = {}
    shares: dict[str, list[float]] = {}
    costs: dict[str, list[float]] = {}
    per_sample = sessions.path_traced_frame(1).seconds
    for seed in range(1, arguments.rounds + 1):
        own = sessions.paths_of_frame(arguments.frames, seed)
        for bias in PAPER:
            frame = sessions.frame(arguments.frames, seed, indirect="SCREEN_REUSE", temporal_reuse=True, bias=bias)
            of_own = 100.0 * reference.common_mse(frame.picture, own) / reference.mse(frame.picture)
            shares.setdefault(bias, []).append(of_own)
            costs.setdefault(bias, []).append(frame.seconds / per_sample)
            for time, frames in (("a frame", 1), ("all frames", arguments.frames)):
                fitting = frames * frame.seconds / per_sample
                samples = max(1, round(fitting))
                traced = sessions.mean(samples, 100 + seed).picture
                for kind, error in (("MSE", reference.mse), ("trimmed MSE", reference.trimmed_mse)):
                    traced_error = error(traced) * samples / fitting  # which falls like 1/N
                    ratios.setdefault((bias, time, kind), []).append(traced_error / error(frame.picture))
    found = [
        Finding(scene, f"{what}, {bias}", float(np.median(v)), Range.of(v), None, unit)
        for what, values, unit in (
            ("share of the own path in the MSE", shares, " %"),
            ("frame time ÷ that of a sample of path tracing", costs, ""),
        )
        for bias, v in values.items()
    ]
    return found + [
        Finding(
            scene,
            f"{kind} of path tracing in the time of {time} ÷ ReSTIR GI, {bias}",
            float(np.median(values)),
            Range.of(values),
            PAPER[bias] if time == "a frame" and kind == "MSE" else None,
        )
        for (bias, time, kind), values in ratios.items()
    ]


def main() -> None:
    command = parser(__doc__, SCENES, bounces=2)
    command.add_argument("--frames", type=int, default=32)
    run("ouyang", "ReSTIR GI against path tracing, after [Ouyang 2021]", command.parse_args(), measure)


if __name__ == "__main__":
    main()
