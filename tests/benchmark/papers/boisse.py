"""Figure 5 and Table 1 of [Boissé 2021]: noise of light that bounced once with and without cell reservoirs, and where
their time goes.

  python -m tests.benchmark.papers.boisse [--scenes NAME ...] [--frames 8] [--output out/papers]

The paper shows pictures of the noise and prints times of four stages, of whose sum the shares are taken here as there.
Candidates are chosen by power, in both forms and without reservoirs: with the light tree they would take most of the
time. Needs matplotlib.
"""

from __future__ import annotations

import argparse

import numpy as np

from tests.benchmark.papers.comparison import Finding, Range, parser, run
from tests.benchmark.papers.sessions import Reference, Sessions

SCENES = ("market", "city_grid", "veach_ajar", "glossy_hall")
# By our stages, in the order of Table 1; percent, over its scenes and both processors.
SHARES = {
    "Later points: candidates": Range(9.9, 16.7, " %"),
    "Later points: grid": Range(4.6, 14.0, " %"),
    "Later points: temporal reuse": Range(13.6, 19.5, " %"),
    "Later points: spatial reuse": Range(54.8, 71.0, " %"),
}


def measure(sessions: Sessions, reference: Reference, arguments: argparse.Namespace, scene: str) -> list[Finding]:
    ratios: dict[str, list[float]] = {}
    for seed in range(1, arguments.rounds + 1):
        plain = sessions.path_traced_frame(seed)
        for bias in ("UNBIASED", "FAST"):
            cells = sessions.frame(arguments.frames, seed, secondary="CELL_RESERVOIRS", temporal_reuse=True, bias=bias)
            for kind, error in (("MSE", reference.mse), ("trimmed MSE", reference.trimmed_mse)):
                gain = error(plain.picture) / error(cells.picture)
                ratios.setdefault(f"{kind} of next-event estimation ÷ cell reservoirs, {bias}", []).append(gain)
            extra = cells.seconds / plain.seconds
            ratios.setdefault(f"frame time ÷ next-event estimation's, {bias}", []).append(extra)
            total = sum(cells.stages[stage] for stage in SHARES)
            for stage in SHARES:
                ratios.setdefault(f"{stage}, {bias}", []).append(100.0 * cells.stages[stage] / total)
    return [
        Finding(scene, what, float(np.median(v)), Range.of(v), SHARES.get(what.split(",")[0]), unit(what))
        for what, v in ratios.items()
    ]


def unit(what: str) -> str:
    return " %" if what.split(",")[0] in SHARES else ""


def main() -> None:
    command = parser(__doc__, SCENES, bounces=1)
    command.add_argument("--frames", type=int, default=8)
    run("boisse", "Cell reservoirs, after [Boissé 2021]", command.parse_args(), measure, "POWER")


if __name__ == "__main__":
    main()
