"""Plays what a user does to a scene with each system, and scores the frames that follow."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.interactive.catalogue import (
    BEFORE,
    FRAMES,
    FRAMES_BEFORE,
    OURS,
    PAN,
    REST,
    Moment,
    engine_named,
    is_cycles,
    pan,
)
from tests.benchmark.interactive.stage import Stage
from tests.benchmark.scoreboard.catalogue import PATH_TRACER, Engine
from tests.benchmark.scoreboard.errors import Reference
from tests.benchmark.scoreboard.measure import without_noise

SHORT, LONG = 8, 40  # samples: their difference is time without building
REFERENCE_SEED = 1_000_001


def samples_in(frames: int, frame_ratio: float) -> int:
    """How many samples fit into the time of so many frames, each of which takes `frame_ratio` samples' time."""
    return max(round(frames * frame_ratio), 1)


@dataclass(frozen=True)
class Score:
    """Of one frame after an event, mean over replicas."""

    event: str
    engine: Engine
    frame: int  # of ours, which ends at the time when this picture is shown
    samples: int
    seconds: float  # of CPU since the event; in the pan, of this frame alone
    pixel: float  # relMSE
    box8: float
    ratio: float  # mean of the picture over that of the reference
    pixel_deviation: float  # standard errors of both between replicas, as shares of them; 0 of a single one
    box8_deviation: float


@dataclass(frozen=True)
class Shot:
    picture: NDArray[np.float32]
    seconds: float


class Experiment:
    """All systems on one stage."""

    def __init__(self, stage: Stage, engines: Sequence[Engine], reference_samples: int) -> None:
        self._stage, self._engines = stage, engines
        self._reference_samples = reference_samples
        self._settings = {e.name: stage.settings(e.settings) for e in engines if not is_cycles(e)}
        self._reference_settings = stage.settings(engine_named(PATH_TRACER).settings)
        self._references: dict[Moment, Reference] = {}
        self._stills: dict[tuple[str, Moment, int, int], Shot] = {}

    def reference(self, moment: Moment) -> Reference:
        """Path-traced, in two halves; of moments in the pan with half the samples."""
        if moment not in self._references:
            count = self._reference_samples // (2 if moment == REST else 4)
            first, second = (
                self._stage.session(moment, count, REFERENCE_SEED + k, self._reference_settings)[0].astype(np.float64)
                for k in (0, 1)
            )
            guides = self._stage.guides(moment, count, self._reference_settings)
            base = without_noise(0.5 * (first + second), guides)
            self._references[moment] = Reference(first, second, base, guides, 2 * count)
        return self._references[moment]

    def has_history(self, engine: Engine) -> bool:
        return not is_cycles(engine) and self._settings[engine.name].get("temporal_reuse", False)

    @cached_property
    def frame_seconds(self) -> dict[str, float]:
        """CPU seconds of one more sample at rest, by engine: medians of three rounds in turn."""
        found: dict[str, list[float]] = {engine.name: [] for engine in self._engines}
        for seed in range(1, 4):
            for engine in self._engines:
                short, long = (self._at_rest(engine, None, count, seed).seconds for count in (SHORT, LONG))
                found[engine.name].append((long - short) / (LONG - SHORT))
        return {name: statistics.median(values) for name, values in found.items()}

    def samples(self, engine: Engine, frame: int) -> int:
        return samples_in(frame, self.frame_seconds[OURS] / self.frame_seconds[engine.name])

    def pan_samples(self, engine: Engine) -> int:
        """Of one of its pictures: what fits into a frame. With history a frame is one sample, whatever it takes."""
        return 1 if self.has_history(engine) else self.samples(engine, 1)

    def _at_rest(self, engine: Engine, before: Moment | None, samples: int, seed: int) -> Shot:
        """With the history of frames of another moment, or with none."""
        if before is None or not self.has_history(engine):
            return self._still(engine, REST, samples, seed)
        self._stage.cache.drop_history()
        self._stage.session(before, FRAMES_BEFORE, seed, self._settings[engine.name])
        return Shot(*self._stage.session(REST, samples, seed, self._settings[engine.name]))

    def _still(self, engine: Engine, moment: Moment, samples: int, seed: int) -> Shot:
        """Without history, and with the scene built before. What was rendered once is not rendered again."""
        key = (engine.name, moment, samples, seed)
        if key not in self._stills:
            if is_cycles(engine):
                found = self._stage.cycles(moment, samples, seed, engine)
            else:
                self._stage.cache.drop_history()
                self._stage.session(moment, 1, seed, self._reference_settings)
                found = self._stage.session(moment, samples, seed, self._settings[engine.name])
            self._stills[key] = Shot(*found)
        return self._stills[key]

    def _panned(self, engine: Engine, seed: int) -> dict[int, Shot]:
        """By frame. Each is a picture of its own."""
        samples = self.pan_samples(engine)
        if not self.has_history(engine):
            return {frame: self._still(engine, pan(frame), samples, seed) for frame in FRAMES}
        settings = self._settings[engine.name]
        self._stage.cache.drop_history()
        self._stage.session(pan(0), FRAMES_BEFORE, seed, settings)
        frames = range(1, FRAMES[-1] + 1)
        shots = {frame: Shot(*self._stage.session(pan(frame), samples, seed, settings)) for frame in frames}
        seconds = statistics.median(shot.seconds for shot in shots.values())
        return {frame: Shot(shots[frame].picture, seconds) for frame in FRAMES}

    def play(self, event: str, replicas: int) -> list[Score]:
        """All engines in turn, replica by replica."""
        found: dict[tuple[str, int], list[Shot]] = {}
        for seed in range(1, replicas + 1):
            for engine in self._engines:
                if event == PAN:
                    shots = self._panned(engine, seed)
                else:
                    before = BEFORE[event]
                    shots = {n: self._at_rest(engine, before, self.samples(engine, n), seed) for n in FRAMES}
                for frame, shot in shots.items():
                    found.setdefault((engine.name, frame), []).append(shot)
        return [self._score(event, engine_named(name), frame, shots) for (name, frame), shots in found.items()]

    def _score(self, event: str, engine: Engine, frame: int, shots: list[Shot]) -> Score:
        reference = self.reference(pan(frame) if event == PAN else REST)
        errors = [reference.errors(shot.picture) for shot in shots]
        samples = self.pan_samples(engine) if event == PAN else self.samples(engine, frame)
        seconds = statistics.fmean(shot.seconds for shot in shots)
        if is_cycles(engine):  # without building
            seconds = samples * self.frame_seconds[engine.name]
        pixel, box8, ratio = ([getattr(error, name) for error in errors] for name in ("pixel", "box8", "ratio"))
        means = [statistics.fmean(values) for values in (pixel, box8, ratio)]
        return Score(event, engine, frame, samples, seconds, *means, deviation(pixel), deviation(box8))


def deviation(values: Sequence[float]) -> float:
    """Standard error of the mean, as a share of it."""
    if len(values) < 2:
        return 0.0
    return statistics.stdev(values) / (statistics.fmean(values) * len(values) ** 0.5)
