"""Denoises what a 3D viewport shows, beside its rendering: one picture at a time, on a thread of its own.

Rendering waits for none of it. What a filter takes is the work of processor cores that rendering would use, so it runs
for samples that are worth it, and the library stops between two layers of its network: at 0.3 megapixels within 0.1 s.
"""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import denoise
from .report import print_traceback

if TYPE_CHECKING:
    from .viewport_camera import Rectangle
    from .viewport_render import Stage

# Twice the samples are always worth a filter; fewer as long as filters take no more than this share of the time.
FILTER_SHARE = 0.1
# Passes are read one by one; where samples end in between, so often once more.
READ_ATTEMPTS = 4

Pixels = NDArray[np.float32]


@dataclass(frozen=True)
class Noisy:
    """A picture to be denoised."""

    pixel: int
    """Of its stage."""
    place: Rectangle
    passes: dict[str, Pixels]
    samples: int
    status: str
    """Of that moment."""


class Filter(threading.Thread):
    """One run of the denoiser."""

    def __init__(self, noisy: Noisy, threads: int) -> None:
        super().__init__(name="cistern-viewport-denoiser", daemon=True)
        self.noisy = noisy
        self._threads = threads
        self._has_no_use = threading.Event()
        self._begun = time.perf_counter()
        self.seconds = 0.0
        self.pixels: Pixels | None = None
        self.error: str | None = None
        self.start()

    def run(self) -> None:
        try:
            read, samples = self.noisy.passes.__getitem__, self.noisy.samples
            pixels = denoise.quickly_denoised_combined(read, samples, self._threads, self._is_wanted)
            self.pixels = None if pixels is None else np.ascontiguousarray(pixels, np.float32)
        except Exception as error:  # DenoiserError, and whatever else: there is a picture without denoising
            if not isinstance(error, RuntimeError):
                print_traceback(error)
            self.error = str(error) or type(error).__name__
        self.seconds = time.perf_counter() - self._begun

    def cancel(self) -> None:
        """Returns at once; there will be no pixels."""
        self._has_no_use.set()

    @property
    def is_cancelled(self) -> bool:
        return self._has_no_use.is_set()

    def _is_wanted(self) -> bool:
        return not self.is_cancelled


class Schedule:
    """Which samples of a stage are denoised: the first, twice as many, four times as many and so on, and those in
    between where samples take so long that filters hardly count."""

    def __init__(self) -> None:
        self.samples = 0  # denoised last
        self._resting_until = 0.0

    def begin(self, samples: int) -> None:
        self.samples, self._resting_until = samples, math.inf

    def finish(self, seconds: float) -> None:
        """That took so long."""
        self._resting_until = time.perf_counter() + seconds * (1.0 / FILTER_SHARE - 1.0)

    def is_due(self, samples: int) -> bool:
        is_rested = time.perf_counter() >= self._resting_until
        return samples > self.samples and (samples >= 2 * self.samples or is_rested)


class ViewportDenoiser:
    """Of one rendering thread, which alone calls it."""

    def __init__(self) -> None:
        self.is_on = False
        self.error: str | None = None
        self._threads = 0
        self._filter: Filter | None = None
        self._stage: Stage | None = None
        self._schedule = Schedule()
        self._version, self._published, self._is_asked = 0, 0, False

    def begin_job(self, is_on: bool, threads: int) -> None:
        self.is_on, self._threads = is_on, threads
        if not is_on:
            self.error = None

    def end_job(self) -> None:
        self.cancel()
        self._stage = None  # and with it the session's memory

    def begin_stage(self, stage: Stage) -> None:
        """Of the same job. A filter of the stage before goes on: it may be done before this one shows anything."""
        self._stage, self._schedule = stage, Schedule()
        self._version, self._published, self._is_asked = 0, 0, False

    def cancel(self) -> None:
        if self._filter is not None:
            self._filter.cancel()

    def cancel_coarser(self) -> None:
        """What is filtered of a stage before this one comes too late."""
        if self._filter is not None and self._filter.noisy.pixel != self._stage.pixel:
            self._filter.cancel()

    def close(self) -> None:
        """Waits for the filter: Python must not end before it."""
        self.cancel()
        self.wait(None)

    def wait(self, seconds: float | None) -> None:
        """For the filter's end, no longer than so many seconds."""
        if self._filter is not None:
            self._filter.join(seconds)

    def is_behind(self, samples: int) -> bool:
        """Whether the picture of the last sample is not denoised yet, but will be."""
        return self.is_on and samples > 0 and (self._filter is not None or samples > self._schedule.samples)

    def follow(self, progress: Any, has_ended: bool) -> Filter | None:  # noqa: ANN401
        """To be called again and again: begins filters when they are due, and returns one that has pixels."""
        if progress.version != self._version:
            self._version, self._published, self._is_asked = progress.version, progress.frames_done, False
        if self._filter is not None:
            return None if self._filter.is_alive() else self._finished()
        samples = progress.frames_done
        if not self.is_on or samples == 0:
            return None
        if has_ended or (self._published == samples and self._schedule.is_due(samples)):
            self._begin(progress)
        elif not self._is_asked and self._schedule.is_due(samples + 1):
            self._stage.session.read("Combined")  # the core keeps pixels of the next sample for who has read
            self._is_asked = True
        return None

    def _begin(self, progress: Any) -> None:  # noqa: ANN401
        if progress.frames_done <= self._schedule.samples:
            return
        passes = passes_of_one_moment(self._stage.session)
        stage, samples = self._stage, progress.frames_done
        noisy = Noisy(stage.pixel, stage.place, passes, samples, stage.status(progress))
        self._schedule.begin(samples)
        self._filter = Filter(noisy, self._threads)

    def _finished(self) -> Filter | None:
        """What has ended, unless nobody wants it; after an error the job goes on without denoising."""
        done, self._filter = self._filter, None
        if done.is_cancelled:
            return None
        self.error = None if done.error is None else f"The picture is not denoised: {done.error}"
        self.is_on = self.is_on and done.error is None
        if done.noisy.pixel == self._stage.pixel:
            self._schedule.finish(done.seconds)
        return None if done.error is not None else done


def passes_of_one_moment(session: Any) -> dict[str, Pixels]:  # noqa: ANN401
    """What a filter reads. Were it of different samples, what is subtracted would leave noise: too little to matter,
    where samples come so fast that all attempts fail."""
    passes: dict[str, Pixels] = {}
    for _ in range(READ_ATTEMPTS):
        version = session.wait(0.0).version
        passes = {name: session.read(name) for name in ("Combined", *denoise.QUICK_PASSES)}
        if session.wait(0.0).version == version:
            break
    return passes
