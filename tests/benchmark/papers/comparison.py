"""The command line, tables and plots that the comparisons of the papers share."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.benchmark.papers.sessions import DIFFUSE_ALONE, SAME_POINT, Reference, Sessions
from tests.benchmark.plotting import load_pyplot, require_matplotlib
from tests.benchmark.scoreboard.catalogue import ROOT, scene_named

COLUMNS = 4  # panels side by side


@dataclass(frozen=True)
class Range:
    """What a paper prints, or what we found over the rounds."""

    low: float
    high: float
    unit: str = ""

    @classmethod
    def of(cls, values: Sequence[float], unit: str = "") -> Range:
        return cls(min(values), max(values), unit)

    def __str__(self) -> str:
        return f"{self.low:.3g} to {self.high:.3g}{self.unit}"


@dataclass(frozen=True)
class Finding:
    """One number of a scene beside the paper's."""

    scene: str
    what: str
    value: float
    spread: Range | None  # over the rounds
    paper: Range | None
    unit: str = ""
    error: float = 0.0  # of the value, where it is known: what is no farther off counts as within

    @property
    def row(self) -> str:
        spread, paper = (str(r) if r else "" for r in (self.spread, self.paper))
        verdict = ""
        if self.paper:
            is_within = self.paper.low - self.error <= self.value <= self.paper.high + self.error
            verdict = "within" if is_within else ("above" if self.value > self.paper.high else "below")
        return f"| {self.scene} | {self.what} | {self.value:.3g}{self.unit} | {spread} | {paper} | {verdict} |"


Measure = Callable[[Sessions, Reference, argparse.Namespace, str], list[Finding]]


def parser(description: str, scenes: Sequence[str], bounces: int) -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    result.add_argument("--scenes", nargs="+", default=list(scenes), metavar="NAME", help="of the scoreboard")
    result.add_argument("--pixels", type=int, default=128 * 72, help="of a picture, in its scene's shape")
    result.add_argument("--bounces", type=int, default=bounces, help="of indirect light")
    result.add_argument("--rounds", type=int, default=3, help="repetitions with other seeds")
    result.add_argument("--reference-samples", type=int, default=2048)
    result.add_argument("--diffuse", action="store_true", help="only light that diffuse lobes scatter")
    result.add_argument("--usual-filter", action="store_true", help="pixels see a new point in each frame")
    result.add_argument("--output", type=Path, default=ROOT / "out" / "papers")
    return result


def run(
    name: str, title: str, arguments: argparse.Namespace, measure: Measure, light_sampling: str = "TREE"
) -> list[Finding]:
    """Measures scene after scene, and writes the table and the plot anew after each."""
    require_matplotlib()
    arguments.output.mkdir(parents=True, exist_ok=True)
    findings: list[Finding] = []
    for scene in map(scene_named, arguments.scenes):
        if not scene.is_there:
            print(f"{scene.name} is not there: CISTERN_TEST_SCENES names no folder with it")
            continue
        common = (DIFFUSE_ALONE if arguments.diffuse else {}) | ({} if arguments.usual_filter else SAME_POINT)
        sessions = Sessions(scene, arguments.pixels, arguments.bounces, light_sampling, **common)
        reference = sessions.reference(arguments.reference_samples)
        findings += measure(sessions, reference, arguments, scene.name)
        suffix = ("-diffuse" if arguments.diffuse else "") + ("-filter" if arguments.usual_filter else "")
        write(arguments.output / (name + suffix), title, arguments, findings)
    return findings


def write(stem: Path, title: str, arguments: argparse.Namespace, findings: Sequence[Finding]) -> None:
    kind = "Diffuse indirect light" if arguments.diffuse else "Indirect light"
    kind += ", the usual pixel filter," if arguments.usual_filter else ""
    lines = [
        f"# {title}",
        "",
        f"{kind} of at most {arguments.bounces} bounces, "
        f"{arguments.pixels} pixels, {arguments.rounds} rounds; "
        f"reference: path tracing with {arguments.reference_samples} samples, whose own noise is taken off. Times are "
        "CPU times.",
        "",
        "| scene | number | here | over the rounds | paper | |",
        "|---|---|---|---|---|---|",
        *(finding.row for finding in findings),
        "",
    ]
    stem.with_suffix(".md").write_text("\n".join(lines))
    print("\n".join(lines), flush=True)
    draw(stem.with_suffix(".png"), title, findings)


def draw(path: Path, title: str, findings: Sequence[Finding]) -> None:
    """A panel for each number with a bar for each scene, the paper's range as a band."""
    pyplot = load_pyplot()
    kinds = list(dict.fromkeys(finding.what for finding in findings))
    columns = min(len(kinds), COLUMNS)
    rows_of_panels = -(-len(kinds) // columns)
    size = (3.4 * columns, 4.0 * rows_of_panels)
    figure, axes = pyplot.subplots(rows_of_panels, columns, figsize=size, dpi=90, squeeze=False)
    for axis in axes.flat[len(kinds) :]:
        axis.set_axis_off()
    for axis, kind in zip(axes.flat, kinds, strict=False):
        rows = [finding for finding in findings if finding.what == kind]
        places = np.arange(len(rows))
        axis.bar(places, [row.value for row in rows], 0.6)
        for place, row in zip(places, rows, strict=True):
            if row.spread:
                axis.plot([place, place], [row.spread.low, row.spread.high], "k-", lw=1)
        if rows[0].paper:
            axis.axhspan(rows[0].paper.low, rows[0].paper.high, color="C1", alpha=0.3)
        axis.set_title(textwrap.fill(kind, 40), fontsize=8)
        axis.set_xticks(places, [row.scene for row in rows], rotation=30, ha="right", fontsize=8)
    figure.suptitle(f"{title} (band: the paper)", fontsize=9)
    figure.tight_layout()
    figure.savefig(path)
    pyplot.close(figure)
