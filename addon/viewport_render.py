"""Renders what a 3D viewport shows, on a Python thread of its own: coarse pixels first, then ever finer ones.

The thread never touches Blender's data: it gets snapshots and plain numbers and leaves pictures. Nobody waits for it,
but a redraw that would show the scene as it was before an edit, for a moment.
"""

from __future__ import annotations

import atexit
import threading
import time
import weakref
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import view_modes
from .core import is_core_error
from .progress import status_text
from .report import print_traceback
from .viewport_camera import Rectangle, View
from .viewport_catchers import BUILDING_STAGE, Caches, ShadowedSession
from .viewport_denoise import Filter, ViewportDenoiser

# How often the thread looks up from waiting for the core.
POLL_SECONDS = 0.005
# The first picture after a change is as coarse as it has to be to take no longer.
FIRST_PICTURE_SECONDS = 0.035
# A redraw waits so long after a change for its first picture.
REDRAW_SECONDS = 0.1
# After waiting in vain so many changes at most are not waited for, before the next attempt.
MOST_UNAWAITED = 15
COARSEST_PIXEL = 16
UNMEASURED_PIXEL = 8
# A change waits so long for the first picture of the one before it: else nothing would be seen while things move.
PATIENCE_SECONDS = 0.1
# Later pictures are shown no more often than this.
DISPLAY_SECONDS = 0.2
# A thread that still runs when Python ends would crash it; preparing very many emitters cannot be interrupted.
STOP_SECONDS = 10.0

DEFAULT_CELL_PIXELS = 10.0  # what 0 stands for in the core's Settings
SMALLEST_CELL_PIXELS = 1.0  # that they allow


@dataclass(frozen=True)
class Job:
    """What to render."""

    scene: Any
    """A snapshot of the core."""
    view: View
    settings: tuple[tuple[str, Any], ...]
    """Arguments of the core's `Settings`, save those that depend on the size of a pixel, and `limits`."""
    mode: str
    """Of view_modes."""
    limits: tuple[tuple[str, Any], ...]
    """The same of the finest picture: how many samples, and what ends it before."""
    finest_pixel: int
    """Side of the smallest pixel, in those of the screen."""
    is_denoised: bool = False
    has_catchers: bool = False
    """Whether the picture has shadows in place of shadow catchers. Settings then reuse nothing."""


@dataclass(frozen=True)
class Picture:
    number: int
    request: int
    """Number of the `submit` that it answers."""
    pixels: NDArray[np.float32]
    """(height, width, 4), row 0 at the bottom, premultiplied, scene-linear."""
    place: Rectangle
    status: str
    denoised: tuple[int, int] | None = None
    """Size of its pixels and number of samples, if it is denoised."""


class Stage:
    """The session of one size of pixels.

    The finest pictures after a change go on with the history of the finest before it: what few large pixels remember
    would be a poor start. Coarse ones look at that too, and of the first a history is kept for while things move."""

    def __init__(self, core: ModuleType, job: Job, pixel: int, is_first: bool, caches: Caches) -> None:
        (width, height), region = job.view.frame(pixel)
        self.pixel, self.is_finest = pixel, pixel == job.finest_pixel
        settings = dict(job.settings) | {"width": width, "height": height, "region": region, "samples": 1}
        if self.is_finest:
            settings |= dict(job.limits)
        else:
            settings |= {"keep_history": is_first, "is_draft": True}
        has_relative_cells = settings.get("indirect") == "WORLD_REUSE" and not settings["cell_pixels"]
        if view_modes.shows_cells(job.mode) and not has_relative_cells:  # at their size on the screen
            cell_pixels = (settings["cell_pixels"] or DEFAULT_CELL_PIXELS) / pixel
            settings["cell_pixels"] = max(cell_pixels, SMALLEST_CELL_PIXELS)
        left, bottom = region[:2]
        self.place = (left / width, bottom / height, (left + region[2]) / width, (bottom + region[3]) / height)
        self.pixels = region[2] * region[3]
        self._rendering_since: float | None = None
        if job.has_catchers:
            self.session: Any = ShadowedSession(core, settings)
            self.session.start(job.scene, caches)
        else:
            caches.forget_catchers()
            self.session = core.Session(core.Settings(**settings))
            self.session.start(job.scene, caches.scene)
        self.read = view_modes.reader(job.mode, self.session.read)

    def wait(self) -> Any:  # noqa: ANN401
        """The session's progress, after a moment or at its end."""
        progress = self.session.wait(POLL_SECONDS)
        if self._rendering_since is None and progress.stage != BUILDING_STAGE:
            self._rendering_since = time.perf_counter()
        return progress

    @property
    def rendering_seconds(self) -> float:
        """Since the scene was built: it is not left before, because later jobs take over what is built."""
        return 0.0 if self._rendering_since is None else time.perf_counter() - self._rendering_since

    def status(self, progress: Any) -> str:  # noqa: ANN401
        """The line in the corner of the viewport; the one sample of a coarse picture is not the end."""
        return status_text(progress) if self.is_finest else f"{progress.stage} | Pixel Size {self.pixel}×"

    def seconds_per_pixel(self, progress: Any) -> float:  # noqa: ANN401
        """Of one sample."""
        return max(self.rendering_seconds, POLL_SECONDS) / (progress.frames_done * self.pixels)


class ViewportRender:
    """Renders the newest job and keeps the newest picture. `on_picture` is called on the thread."""

    def __init__(self, core: ModuleType, on_picture: Callable[[], None]) -> None:
        self._core = core
        self._on_picture = on_picture
        self._caches = Caches(core)
        self._condition = threading.Condition()
        self._job: Job | None = None  # waiting to be taken
        self._request_in_hand = 0
        self._submitted = self._submitted_in_hand = 0.0
        self._unawaited = self._to_leave_unawaited = 0  # changes since one was waited for
        self._is_awaited = False
        self.requests = 0
        self._is_wanted = True  # whether the job in hand is to be finished
        self._is_stopped = False
        self._seconds_per_pixel: float | None = None
        self._pictures = 0
        self.picture: Picture | None = None
        self.error: str | None = None
        self._denoiser = ViewportDenoiser()
        self._thread = threading.Thread(target=self._run, name="cistern-viewport", daemon=True)
        self._thread.start()
        _running.add(self)

    def submit(self, job: Job) -> None:
        """Render this instead of what came before. Returns at once."""
        with self._condition:
            self._job = job
            self.requests += 1
            self._unawaited += 1
            self._submitted = time.perf_counter()
            self._is_wanted = True
            self._condition.notify_all()

    def await_picture(self) -> None:
        """Return once there is a picture of the newest job, or REDRAW_SECONDS after its submission.

        Redraws are dear, and without waiting each change takes two, of which the first delays the picture: one that
        comes too late without waiting may come in time with it. So after waiting in vain a few changes are let go by,
        ever more of them, then it is tried again."""
        with self._condition:
            seconds = self._submitted + REDRAW_SECONDS - time.perf_counter()
            if self._unawaited <= self._to_leave_unawaited or seconds <= 0.0:
                return
            self._is_awaited = True
            is_in_time = self._condition.wait_for(self._is_answered, seconds)
            self._is_awaited = False
            self._unawaited = 0
            self._to_leave_unawaited = 0 if is_in_time else min(2 * self._to_leave_unawaited + 1, MOST_UNAWAITED)

    def _is_answered(self) -> bool:
        is_shown = self.picture is not None and self.picture.request == self.requests
        return is_shown or self.error is not None or not self._is_wanted or self._is_stopped

    def pause(self) -> None:
        """Stop rendering; the picture stays. Returns at once."""
        with self._condition:
            self._job, self._is_wanted = None, False

    def stop(self, waits: bool = False) -> None:
        """End the thread. Returns at once unless told to wait."""
        with self._condition:
            self._is_stopped, self._job = True, None
            self._condition.notify_all()
        if waits:
            self._thread.join(STOP_SECONDS)

    @property
    def warnings(self) -> list[str]:
        """Of denoising."""
        return [] if self._denoiser.error is None else [self._denoiser.error]

    @property
    def is_alive(self) -> bool:
        return self._thread.is_alive()

    def _run(self) -> None:
        while (job := self._next_job()) is not None:
            try:
                self._render(job)
                self.error = None
            except Exception as error:  # one that ended the thread would freeze the picture without a word
                if not (isinstance(error, RuntimeError) or is_core_error(error)):
                    print_traceback(error)
                with self._condition:
                    self.error = str(error) or type(error).__name__
                    self._condition.notify_all()
                self._on_picture()
        self._denoiser.close()

    def _next_job(self) -> Job | None:
        with self._condition:
            self._condition.wait_for(lambda: self._job is not None or self._is_stopped)
            job, self._job = self._job, None
            self._request_in_hand, self._submitted_in_hand = self.requests, self._submitted
            return job

    def _must_leave(self, has_waited_enough: bool) -> bool:
        """Whether the job in hand is to be left; for another one only if that has waited enough."""
        with self._condition:
            return self._is_stopped or not self._is_wanted or (self._job is not None and has_waited_enough)

    def _render(self, job: Job) -> None:
        """All pictures of a job. Raises the core's Error, and RuntimeError with its sentence for a failed render."""
        self._denoiser.begin_job(job.is_denoised, dict(job.settings).get("threads", 0))
        try:
            self._render_stages(job)
        finally:
            self._denoiser.end_job()

    def _render_stages(self, job: Job) -> None:
        pixel = first = self._first_pixel(job)
        is_complete = True
        while is_complete and pixel >= job.finest_pixel:
            stage = Stage(self._core, job, pixel, pixel == first, self._caches)
            self._denoiser.begin_stage(stage)
            try:
                is_complete = self._watch(stage, 0.0 if pixel < first else PATIENCE_SECONDS)
            finally:
                stage.session.cancel()
            pixel //= 2

    def _watch(self, stage: Stage, patience: float) -> bool:
        """Show the pictures of a stage as they come; False if it was left before its end."""
        shown, next_display = 0, 0.0
        while True:
            progress = stage.wait()
            is_running = progress.status is self._core.Status.RUNNING
            if progress.status is self._core.Status.FAILED:
                raise RuntimeError(progress.error)
            if progress.frames_done > 0 and shown == 0:
                self._seconds_per_pixel = stage.seconds_per_pixel(progress)
            is_due = progress.version > 0 and time.perf_counter() >= next_display
            if progress.frames_done > shown and (is_due or not is_running):
                self._show(stage, progress)
                shown, patience = progress.frames_done, 0.0
                next_display = time.perf_counter() + DISPLAY_SECONDS
            self._denoise(stage, progress, not is_running)
            if not is_running:
                if not (stage.is_finest and self._denoiser.is_behind(progress.frames_done)):
                    return progress.frames_done > 0
                self._denoiser.wait(POLL_SECONDS)
            if self._must_leave(stage.rendering_seconds >= patience):
                if shown == 0 and patience > 0.0:  # so slow that nothing would be seen while things move
                    self._seconds_per_pixel = 2.0 * max(self._seconds_per_pixel or 0.0, patience / stage.pixels)
                return False

    def _show(self, stage: Stage, progress: Any) -> None:  # noqa: ANN401
        """The picture as it is; where one that is denoised is on show already, only how far rendering has come."""
        status = stage.status(progress)
        shown = self._denoised_on_show()
        if shown is None or not self._denoiser.is_on:
            pixels = np.ascontiguousarray(stage.read("Combined"), np.float32)
            self._put(Picture(self._next_number(), self._request_in_hand, pixels, stage.place, status))
            self._denoiser.cancel_coarser()
        elif shown.denoised[0] == stage.pixel:
            self._put(replace(shown, status=f"{status} | Denoised at Sample {shown.denoised[1]}"))

    def _denoised_on_show(self) -> Picture | None:
        """Of the job in hand."""
        picture = self.picture
        is_it = picture is not None and picture.denoised is not None and picture.request == self._request_in_hand
        return picture if is_it else None

    def _denoise(self, stage: Stage, progress: Any, has_ended: bool) -> None:  # noqa: ANN401
        """Begin to filter what is due, and show what has been filtered."""
        was_on = self._denoiser.is_on
        done = self._denoiser.follow(progress, has_ended)
        if done is not None:
            self._put(self._denoised_picture(done))
        elif was_on and not self._denoiser.is_on and progress.frames_done > 0:  # it failed, and noise is news
            self._show(stage, progress)

    def _denoised_picture(self, done: Filter) -> Picture:
        noisy = done.noisy
        text, kind = f"{noisy.status} | Denoised", (noisy.pixel, noisy.samples)
        return Picture(self._next_number(), self._request_in_hand, done.pixels, noisy.place, text, kind)

    def _next_number(self) -> int:
        self._pictures += 1
        return self._pictures

    def _put(self, picture: Picture) -> None:
        """On show."""
        with self._condition:
            is_first = self.picture is None or self.picture.request != picture.request
            if is_first and time.perf_counter() - self._submitted_in_hand < REDRAW_SECONDS:
                self._to_leave_unawaited = 0
            self.picture = picture
            is_about_to_be_drawn = self._is_awaited and self._is_answered()
            self._condition.notify_all()
        if not is_about_to_be_drawn:
            self._on_picture()

    def _first_pixel(self, job: Job) -> int:
        """Side of the coarsest pixels to begin with: the finest ones, doubled as often as need be."""
        pixel = job.finest_pixel
        while pixel < COARSEST_PIXEL and self._is_too_slow(job, pixel):
            pixel *= 2
        return pixel

    def _is_too_slow(self, job: Job, pixel: int) -> bool:
        if self._seconds_per_pixel is None:
            return pixel < UNMEASURED_PIXEL
        _, (_, _, width, height) = job.view.frame(pixel)
        return width * height * self._seconds_per_pixel > FIRST_PICTURE_SECONDS


_running: weakref.WeakSet[ViewportRender] = weakref.WeakSet()


def running() -> list[ViewportRender]:
    """Those whose thread has not ended, or whose viewport still exists."""
    return list(_running)


@atexit.register
def stop_all() -> None:
    """End all threads, and wait for that."""
    for render in running():
        render.stop(waits=True)
