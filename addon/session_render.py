"""Sessions of the core under Blender's eyes: progress, Esc, and the figures of a report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import bpy

from . import denoise, report, shadow_catchers, view_modes
from .progress import Span, StatusClock, stage_share, status_text

if TYPE_CHECKING:
    from types import ModuleType

    from .engine import CisternEngine

# How often Esc is looked for, and the display of the progress renewed.
POLL_SECONDS = 0.1

BYTES_PER_MB = 1e6

Look = Callable[[Any, Any], None]
"""What a session that goes on has by now: the session and its progress."""


class RenderFailedError(RuntimeError):
    """The core stopped a render; the text is the core's sentence."""


def reader(session: Any) -> view_modes.Reader:  # noqa: ANN401
    """Reads the passes of a session, finished or not, and those of which the core knows nothing."""
    return denoise.with_noisy(shadow_catchers.unshadowed(session.read))


@dataclass(frozen=True)
class Moments:
    """Snapshots of a scene: as the frame shows it and, with motion blur, at the other moments of its shutter."""

    scene: Any
    others: tuple[Any, ...] = ()
    cache: Any = None
    """A core's RenderCache: what sessions with variants of the scene take over from each other."""

    def shadow_catchers_alone(self) -> Moments:
        alone, *others = (scene.shadow_catchers_alone() for scene in (self.scene, *self.others))
        return Moments(alone, tuple(others), self.cache)

    def backdrop(self) -> Moments:
        return Moments(self.scene.backdrop(), tuple(other.backdrop() for other in self.others))


class SessionRender:
    """Runs sessions for a render of Blender's, until they end or the user presses Esc."""

    def __init__(
        self, engine: CisternEngine, depsgraph: bpy.types.Depsgraph, core: ModuleType, figures: report.RenderReport
    ) -> None:
        self.engine = engine
        self.depsgraph = depsgraph
        self.core = core
        self.figures = figures
        self.status_clock = StatusClock()
        self.is_cancelled = False

    def rendered(
        self, arguments: dict[str, Any], moments: Moments, span: Span, look: Look | None = None
    ) -> view_modes.Reader:
        """Reads the passes of a session that was watched to its end, `look` meanwhile. Raises RenderFailedError."""
        session = self.core.Session(self.core.Settings(**arguments))
        session.start(moments.scene, cache=moments.cache, shutter=moments.others or None)
        try:
            self.watch(session, span, look)
        except BaseException:
            session.cancel()
            raise
        return reader(session)

    def watch(self, session: Any, span: Span, look: Look | None) -> None:  # noqa: ANN401
        """Poll until the session stops. Raises RenderFailedError."""
        while True:
            progress = session.wait(POLL_SECONDS)
            self.show(progress, span)
            if progress.status is not self.core.Status.RUNNING:
                break
            if self.engine.is_stop_wanted():
                self.is_cancelled = True
                session.cancel()
            elif look is not None:
                look(session, progress)
        self.account(progress)

    def show(self, progress: Any, span: Span) -> None:  # noqa: ANN401
        engine = self.engine
        megabytes = progress.memory_bytes / BYTES_PER_MB
        self.figures.peak_memory_mb = max(self.figures.peak_memory_mb, megabytes)
        engine.update_progress(span.start + span.length * stage_share(progress))
        engine.update_memory_stats(memory_used=megabytes, memory_peak=self.figures.peak_memory_mb)
        if self.status_clock.is_due(progress.stage):
            engine.update_stats("", status_text(progress))

    def account(self, progress: Any) -> None:  # noqa: ANN401
        """Take over the final figures of a view. Raises RenderFailedError."""
        if progress.status is self.core.Status.FAILED:
            raise RenderFailedError(progress.error)
        self.figures.samples, self.figures.mean_samples = progress.frames_done, progress.mean_samples
        if progress.noise >= 0.0:
            self.figures.noise = progress.noise
        if progress.non_finite_samples > 0:
            self.figures.warnings.append(
                f"{progress.non_finite_samples} samples were not finite and count as black: please report the scene"
            )
        if progress.non_finite_weights > 0:
            self.figures.warnings.append(
                f"{progress.non_finite_weights} weights of reused light were not finite and count as zero: please "
                "report the scene"
            )
