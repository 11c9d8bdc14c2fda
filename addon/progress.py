"""The core's progress as text and as a share of the whole."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import bpy

BACKGROUND_SECONDS = 5.0  # from one line of status to the next
CACHING_STAGE = "Caching light"  # of the core's Progress


@dataclass(frozen=True)
class Span:
    """A part of the progress of a render."""

    start: float
    length: float

    def split(self, share: float) -> tuple[Span, Span]:
        middle = share * self.length
        return Span(self.start, middle), Span(self.start + middle, self.length - middle)


def clock_text(seconds: float) -> str:
    """Hours (if any), minutes and seconds."""
    minutes, whole_seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{whole_seconds:02}" if hours else f"{minutes:02}:{whole_seconds:02}"


def stage_share(progress: Any) -> float:  # noqa: ANN401
    """How much of the present stage is done, 0 to 1: light is cached before the first sample."""
    if progress.stage == CACHING_STAGE:
        return progress.stage_done
    return progress.frames_done / max(progress.expected_frames, 1)


class StatusClock:
    """Says when a line of status is due. In the background Blender before 5.0 prints each: one at a new stage, and then
    one every few seconds, is enough."""

    def __init__(self) -> None:
        self.stage, self.due = "", 0.0

    def is_due(self, stage: str) -> bool:
        now = time.perf_counter()
        if bpy.app.background and stage == self.stage and now < self.due:
            return False
        self.stage, self.due = stage, now + BACKGROUND_SECONDS
        return True


def status_text(progress: Any) -> str:  # noqa: ANN401
    """The line beside Blender's own render statistics."""
    parts = [progress.stage]
    if progress.stage == CACHING_STAGE:
        parts.append(f"{progress.stage_done:.0%}")
    if progress.frames_done > 0:
        parts.append(f"Sample {progress.frames_done}/{progress.frames}")
    if progress.openings > 0:
        parts.append(f"{progress.openings} Opening{'s' if progress.openings > 1 else ''}")
    if progress.noise >= 0.0:
        parts.append(f"Noise {progress.noise:.3g}")
    if progress.pixels_left < 1.0:
        parts.append(f"{progress.pixels_left:.0%} of Pixels Left")
    if progress.remaining_seconds >= 0.0:
        parts.append(f"Remaining {clock_text(progress.remaining_seconds)}")
    return " | ".join(parts)
