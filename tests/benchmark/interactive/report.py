"""Frames after an event as a table, as lines of JSON, and as a plot of error against time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from tests.benchmark.interactive.catalogue import EVENTS, FRAMES, OURS, PAN
from tests.benchmark.interactive.measure import Score
from tests.benchmark.plotting import load_pyplot
from tests.benchmark.scoreboard.errors import Reference

SCALES = {"pixel": "1 px", "box8": "8 px"}
WIDTHS = {"OURS": 2.5, "CYCLES": 1.8}
STYLES = {"CYCLES": "--", "PATH": ":"}


def rows(scores: Sequence[Score]) -> dict[tuple[str, str], list[Score]]:
    """By event and engine, from frame to frame."""
    found: dict[tuple[str, str], list[Score]] = {}
    for score in sorted(scores, key=lambda score: score.frame):
        found.setdefault((score.event, score.engine.name), []).append(score)
    return found


def table(scene: str, scores: Sequence[Score]) -> list[str]:
    """In bold the least error of each frame."""
    frames = " | ".join(f"{title}: {frame}" for title in SCALES.values() for frame in FRAMES)
    lines = [f"| {scene} | | samples | {frames} |", "|---" * (3 + len(SCALES) * len(FRAMES)) + "|"]
    for (event, _), row in rows(scores).items():
        cells = []
        for scale in SCALES:
            for score in row:
                rivals = [getattr(s, scale) for s in scores if (s.event, s.frame) == (event, score.frame)]
                error = getattr(score, scale)
                cells.append(f"**{error:.2g}**" if error <= min(rivals) else f"{error:.2g}")
        samples = list(dict.fromkeys(str(score.samples) for score in row))
        lines.append(f"| {event} | {row[0].engine.title} | {', '.join(samples)} | " + " | ".join(cells) + " |")
    return lines


def costs(frame_seconds: dict[str, float], scores: Sequence[Score]) -> str:
    titles = {score.engine.name: score.engine.title for score in scores}
    parts = [f"{titles[name]} {seconds / frame_seconds[OURS]:.2f}" for name, seconds in frame_seconds.items()]
    milliseconds = 1e3 * frame_seconds[OURS]
    return f"CPU time of a frame at rest, over that of ours ({milliseconds:.1f} ms): {', '.join(parts)}."


def noise(reference: Reference) -> str:
    own = reference.noise
    return (
        f"Reference: path-traced, {reference.samples} samples; relMSE of its own {own.pixel:.2g} per pixel and "
        f"{own.box8:.2g} in boxes, which does not count."
    )


def deviations(scores: Sequence[Score]) -> str:
    parts = []
    for scale, title in SCALES.items():
        values = sorted(getattr(score, f"{scale}_deviation") for score in scores)
        parts.append(f"{100 * values[len(values) // 2]:.0f} % ({title}; at most {100 * values[-1]:.0f} %)")
    return f"Standard errors of these numbers between replicas: in the median {' and '.join(parts)}."


def entries(scene: str, scores: Sequence[Score]) -> list[dict[str, object]]:
    return [asdict(score) | {"scene": scene, "engine": score.engine.name} for score in scores]


def draw(path: Path, scene: str, scores: Sequence[Score]) -> None:
    """After events against CPU time since then, on both axes by powers of ten; in the pan from frame to frame."""
    pyplot = load_pyplot()
    found = rows(scores)
    events = [event for event in EVENTS if any(key[0] == event for key in found)]
    names = list(dict.fromkeys(name for _, name in found))
    figure, axes = pyplot.subplots(2, len(events), figsize=(4.5 * len(events), 8), dpi=90, squeeze=False)
    for (event, name), row in found.items():
        group, color = row[0].engine.group, f"C{names.index(name)}"
        for (scale, title), axis in zip(SCALES.items(), axes[:, events.index(event)], strict=True):
            times = [score.frame if event == PAN else score.seconds for score in row]
            errors = [getattr(score, scale) for score in row]
            width = WIDTHS.get(group, 1.3)
            axis.plot(times, errors, STYLES.get(group, "-"), color=color, marker="o", ms=4, lw=width)
            axis.set(xscale="log", yscale="log", title=f"{event}, {title}")
            axis.set_xlabel("frame" if event == PAN else "CPU seconds")
            axis.grid(which="both", alpha=0.25)
    for axis in axes[:, 0]:
        axis.set_ylabel("relMSE")
    titles = {score.engine.name: score.engine.title for score in scores}
    figure.legend(axes[0][0].lines, [titles[name] for name in names], loc="lower center", ncols=3, fontsize=9)
    figure.suptitle(scene)
    figure.tight_layout(rect=(0.0, 0.08, 1.0, 1.0))
    figure.savefig(path)
    pyplot.close(figure)
