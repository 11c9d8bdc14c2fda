"""The scoreboard in words: tables, bars met or missed, and a line of JSON for each picture."""

from __future__ import annotations

import datetime
import json
import os
import subprocess
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from tests.benchmark.scoreboard.board import SCALES, SceneScore, Shot
from tests.benchmark.scoreboard.catalogue import (
    KINDS,
    OURS,
    OURS_DENOISED,
    PATH_TRACER,
    PATH_TRACER_BAR,
    ROOT,
    engine_named,
)

DENOISED = "denoised"


def commit() -> str:
    """Of the repository, with a + where files have changed since; "unknown" outside one."""
    command = ["git", "describe", "--always", "--dirty=+", "--exclude=*"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def append_history(file: Path, score: SceneScore) -> None:
    """One line for each picture."""
    shots = [*score.targets, *(shot for shots in score.shots.values() for shot in shots)]
    append_lines(file, [history_of(score, shot) for shot in shots])


def append_lines(file: Path, entries: Sequence[dict[str, object]]) -> None:
    """Lines of JSON that also say when, and by which commit."""
    about = {"date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"), "commit": commit()}
    with file.open("a") as lines:
        for entry in entries:
            lines.write(json.dumps(about | entry) + "\n")


def history_of(score: SceneScore, shot: Shot) -> dict[str, object]:
    height, width, _ = shot.picture.combined.shape
    picture = {name: getattr(shot.picture, name) for name in ("seconds", "sync_seconds", "wall_seconds", "peak_mb")}
    return {
        "scene": score.scene.name,
        "engine": shot.engine.name,
        "is_target": any(shot is target for target in score.targets),
        "samples": shot.samples,
        "seed": shot.seed,
        "size": [width, height],
        **picture,
        "errors": asdict(shot.errors),
        "denoised_errors": asdict(shot.denoised_errors),
        "reference": {"samples": score.reference.samples, "noise": asdict(score.reference.noise)},
    }


def scene_table(score: SceneScore) -> list[str]:
    """Of the longest render of each engine; ratios to the best setting of Cycles, where it takes part."""
    noise, target = score.reference.noise, score.targets[0]
    has_cycles = any(shots[0].engine.group == "CYCLES" for shots in score.shots.values())
    lines = [
        f"Reference: {engine_named(score.scene.reference).title}, {score.reference.samples} samples; "
        f"relMSE of its own {noise.pixel:.2g} per pixel, "
        f"{noise.box4:.2g} and {noise.box8:.2g} in boxes, which does not count. Target after denoising: "
        f"{score.target_error:.4f}, of Cycles with {target.samples} samples in {target.seconds:.1f} s, mean of "
        f"{len(score.targets)}.",
        *difference_to_cycles(score),
        "",
        "| engine | samples | CPU s | export, build s | peak MB | mean / reference | 1 px | 4 px | 8 px | denoised | "
        "error × time: 1 px | 4 px | 8 px | denoised: s to target |",
        "|---" * 14 + "|",
    ]
    for name, shots in score.shots.items():
        shot = score.last(name)
        errors = " | ".join(f"{shot.errors.at(scale):.3g}" for scale in SCALES)
        values = [(score.product(name, scale), scale) for scale in SCALES] + [(score.time_to_target(name), DENOISED)]
        cells = " | ".join(f"{v:.3g}" + (f" ({ratio(score, name, s):.2f})" if has_cycles else "") for v, s in values)
        lines.append(
            f"| {shots[0].engine.title} | {shot.samples} | {shot.seconds:.2f} | {shot.picture.sync_seconds:.2f} "
            f"| {shot.picture.peak_mb:.0f} | {shot.errors.ratio:.4f} | {errors} "
            f"| {shot.denoised_errors.pixel:.3g} | {cells} |"
        )
    return lines


def difference_to_cycles(score: SceneScore) -> list[str]:
    if score.to_cycles is None:
        return []
    found, least = score.to_cycles
    return [
        f"Cycles' own picture differs from it by {found.untrimmed:.2g} per pixel and {found.box8:.2g} in boxes of 8 x "
        f"8, its noise left out ({least.untrimmed:.2g} and {least.box8:.2g} could be told); "
        f"its mean is {found.ratio:.4f} of it."
    ]


def ratio(score: SceneScore, name: str, scale: str, base: str | None = None) -> float:
    """Error x time, or for "denoised" time to the target, over that of `base`: else the best setting of Cycles."""
    base = base or score.best_cycles(scale)
    if scale == DENOISED:
        return score.time_to_target(name) / score.time_to_target(base)
    return score.product(name, scale) / score.product(base, scale)


def verdict(value: float, bar: float) -> str:
    return f"{value:.2f} (≤ {bar:g}) {'met' if value <= bar else '**missed**'}"


def bars_of(score: SceneScore) -> dict[str, float]:
    """By scale."""
    bars = KINDS[score.scene.kind]
    return {"pixel": bars.pixel, "box8": bars.boxes, DENOISED: bars.denoised}


def ours_at(score: SceneScore, scale: str) -> str:
    """Which of ours the bars are for: where a denoiser follows, the one that is told so."""
    return OURS_DENOISED if scale == DENOISED and OURS_DENOISED in score.shots else OURS


def bars_table(scores: Sequence[SceneScore]) -> list[str]:
    """Ours over the best setting of Cycles."""
    lines = ["| scene | kind | 1 px | 8 px | denoised alike, time to target |", "|---|---|---|---|---|"]
    for score in scores:
        bars = bars_of(score).items()
        cells = " | ".join(verdict(ratio(score, ours_at(score, scale), scale), bar) for scale, bar in bars)
        lines.append(f"| {score.scene.name} | {score.scene.kind} | {cells} |")
    return lines


def path_tracer_table(scores: Sequence[SceneScore]) -> list[str]:
    """Ours over plain path tracing of our own."""
    lines = ["| scene | 1 px | 4 px | 8 px |", "|---|---|---|---|"]
    for score in scores:
        ratios = (ratio(score, OURS, scale, PATH_TRACER) for scale in SCALES)
        lines.append(f"| {score.scene.name} | " + " | ".join(verdict(r, PATH_TRACER_BAR) for r in ratios) + " |")
    return lines


def winners_table(scores: Sequence[SceneScore]) -> list[str]:
    """Who has the least error x time, and by how much ours is from it."""
    lines = ["| scene | " + " | ".join(SCALES.values()) + " |", "|---|---|---|---|"]
    for score in scores:
        cells = []
        for scale in SCALES:
            best = min(score.shots, key=lambda name: score.product(name, scale))  # noqa: B023
            behind = f", ours {ratio(score, OURS, scale, best):.2f} ×" if OURS in score.shots and best != OURS else ""
            cells.append(score.shots[best][0].engine.title + behind)
        lines.append(f"| {score.scene.name} | " + " | ".join(cells) + " |")
    return lines


def write(folder: Path, scores: Sequence[SceneScore]) -> None:
    """Tables, plots and the page, of all scenes scored so far."""
    from tests.benchmark.scoreboard import page, plots  # with matplotlib, which the tables do without

    height, width, _ = scores[0].reference.mean.shape
    lines = [
        "# Scoreboard",
        "",
        f"{datetime.date.today()}, commit {commit()}, {width * height} pixels, {os.cpu_count()} processors. Error: "
        "relMSE of the longest render; × CPU time without export and building. In brackets: over the best of Cycles.",
        "",
    ]
    names = set.intersection(*(set(score.shots) for score in scores))
    if OURS in names and any(name.startswith("cycles") for name in names):
        lines += ["## Bars: ours over the best setting of Cycles", "", *bars_table(scores), ""]
    if {OURS, PATH_TRACER} <= names:
        lines += ["## Ours over our own path tracer", "", *path_tracer_table(scores), ""]
    lines += ["## Least error × time", "", *winners_table(scores), ""]
    for score in scores:
        lines += [f"## {score.scene.name}", "", *scene_table(score), ""]
        plots.draw(folder / f"{score.scene.name}.png", score)
    if OURS in names and any(name.startswith("cycles") for name in names):
        plots.draw_overview(folder / "overview.png", scores)
    (folder / "scoreboard.md").write_text("\n".join(lines))
    page.write(folder, scores)
