"""A final render of one view layer of one frame: export, sessions, pixels, figures.

Everything native is local to it, except the exported scene under Persistent Data.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import bpy

from . import cryptomatte, denoise, passes, report, settings, view_modes, volumes
from .progress import stage_share, status_text
from .views import place_view_camera, view_names

if TYPE_CHECKING:
    from types import ModuleType

    from .engine import CisternEngine
    from .sync import SyncReport
    from .sync.scene import SceneSync
    from .sync.shutter import MotionBlur

# How often Esc is looked for, and the display of the progress renewed.
POLL_SECONDS = 0.1

# Unfinished pictures are shown no more often than this, and in at most a tenth of the time.
DISPLAY_SECONDS = 1.0
DISPLAY_SHARE = 0.1

BYTES_PER_MB = 1e6


class RenderFailedError(RuntimeError):
    """The core stopped a render; the text is the core's sentence."""


class LayerRender:
    """The render of one view layer of one frame: export, sessions (one for each view), pixels, figures."""

    def __init__(
        self, engine: CisternEngine, depsgraph: bpy.types.Depsgraph, core: ModuleType, figures: report.RenderReport
    ) -> None:
        self.engine = engine
        self.depsgraph = depsgraph
        self.core = core
        self.figures = figures
        self.layer_name = depsgraph.view_layer_eval.name
        self.passes = passes.enabled_passes(depsgraph.view_layer_eval)
        self.view_mode = settings.view_mode(depsgraph.scene_eval, engine.is_preview)
        self.size = (engine.resolution_x, engine.resolution_y)
        self.region = settings.render_region(depsgraph.scene_eval.render, *self.size)
        self.arguments = settings.core_settings(core, depsgraph, self.size, self.region, self.passes, engine.is_preview)
        self.blur = self.motion_blur()
        self.keeps_export = depsgraph.scene_eval.render.use_persistent_data
        self.is_cancelled = False

    def run(self) -> None:
        exported = self.engine.open_export(self.keeps_export)
        try:
            synced = self.export(exported)
            self.render_views(exported)
            cryptomatte.stamp(self.engine, self.depsgraph.view_layer_eval, synced.matte_names, self.core)
        finally:
            if not self.keeps_export:
                exported.close()

    def export(self, exported: SceneSync) -> SyncReport:
        """Bring the exported scene up to date with the evaluated one."""
        self.engine.update_stats("", "Exporting the scene")
        start = time.perf_counter()
        camera, motion = self.engine.camera_override, self.motion()
        if self.blur is None:
            synced = exported.sync(self.depsgraph, camera, **motion)
        else:
            synced = self.blur.sync(exported, self.depsgraph, camera, **motion)
        self.figures.warnings += synced.warnings
        self.figures.sync_seconds = time.perf_counter() - start
        return synced

    def motion(self) -> dict[str, Any]:
        """Where things are in the frames beside this one, if a pass tells it; as an argument of `SceneSync.sync`."""
        if not any(render_pass.core_name == "Vector" for render_pass in self.passes):
            return {}
        if self.blur is not None:
            self.figures.warnings.append("The Vector pass is empty with motion blur, as in Cycles")
            return {}
        from .sync.motion import read_steps

        return {"motion": read_steps(self.depsgraph, self.engine.camera_override, self.engine.go_to_frame)}

    def motion_blur(self) -> MotionBlur | None:
        """None where nothing is to be blurred, or cannot be."""
        from .sync.shutter import MotionBlur, shutter_times

        scene = self.depsgraph.scene_eval
        times = shutter_times(scene, self.depsgraph.view_layer_eval)
        if times is None or self.engine.is_preview:
            return None
        if not self.core.Session.can_blur_motion(self.core.Settings(**self.arguments)):
            self.figures.warnings.append(
                f"Scene '{scene.name}': there is no motion blur with techniques that keep samples from frame to frame, "
                "or reservoirs; Final and Path Tracing have it"
            )
            return None
        return MotionBlur(times, scene, self.engine.go_to_frame)

    def render_views(self, exported: SceneSync) -> None:
        builders = [exported.builder, *(self.blur.ends if self.blur else ())]
        views = view_names(self.engine, self.layer_name)
        for index, view in enumerate(views):
            if self.is_cancelled:
                break
            self.engine.active_view_set(view)
            if len(views) > 1:
                for builder in builders:
                    place_view_camera(self.engine, self.depsgraph, builder)
            session = self.core.Session(self.core.Settings(**self.arguments))
            scene, *ends = (builder.snapshot() for builder in builders)
            self.warn_of_volume(scene.volume_name)
            for warning in scene.warnings:
                self.figures.warn_once(warning)
            session.start(scene, shutter=tuple(ends) or None)
            self.render_view(session, view, index / len(views), 1 / len(views))

    def render_view(self, session: Any, view: str, done_before: float, share: float) -> None:  # noqa: ANN401
        """Watch a running session to its end and hand over its pixels; `share` is the view's part of the progress."""
        result = self.engine.begin_result(0, 0, self.region.width, self.region.height, layer=self.layer_name, view=view)
        is_complete = False
        try:
            self.watch(session, result, view, done_before, share)
            self.write(self.finished_reader(session), result, view)
            self.warn_of_black_picture(session)
            is_complete = True
        finally:
            if not is_complete:
                session.cancel()
            self.engine.end_result(result, cancel=not is_complete)

    def watch(self, session: Any, result: bpy.types.RenderResult, view: str, done_before: float, share: float) -> None:  # noqa: ANN401
        """Poll until the session stops. Raises RenderFailedError."""
        display = DisplayClock()
        seen = 0
        while True:
            progress = session.wait(POLL_SECONDS)
            self.show(progress, done_before, share)
            if progress.status is not self.core.Status.RUNNING:
                break
            if self.engine.is_stop_wanted():
                self.is_cancelled = True
                session.cancel()
            elif progress.version != seen and display.is_due():
                seen = progress.version
                self.write(session.read, result, view)
                self.engine.update_result(result)
                display.restart()
        self.account(progress)

    def show(self, progress: Any, done_before: float, share: float) -> None:  # noqa: ANN401
        engine = self.engine
        megabytes = progress.memory_bytes / BYTES_PER_MB
        self.figures.peak_memory_mb = max(self.figures.peak_memory_mb, megabytes)
        engine.update_progress(done_before + share * stage_share(progress))
        engine.update_memory_stats(memory_used=megabytes, memory_peak=self.figures.peak_memory_mb)
        engine.update_stats("", status_text(progress))

    def account(self, progress: Any) -> None:  # noqa: ANN401
        """Take over the final figures of a view. Raises RenderFailedError."""
        if progress.status is self.core.Status.FAILED:
            raise RenderFailedError(progress.error)
        self.figures.samples = progress.frames_done
        if progress.non_finite_samples > 0:
            self.figures.warnings.append(
                f"{progress.non_finite_samples} samples were not finite and count as black: please report the scene"
            )
        if progress.non_finite_weights > 0:
            self.figures.warnings.append(
                f"{progress.non_finite_weights} weights of reused light were not finite and count as zero: please "
                "report the scene"
            )

    def warn_of_volume(self, name: str) -> None:
        warning = volumes.warning(name, self.arguments)
        if warning is not None:
            self.figures.warn_once(warning)

    def warn_of_black_picture(self, session: Any) -> None:  # noqa: ANN401
        if not self.is_cancelled and not session.read("Combined")[..., :3].any():
            scene = self.depsgraph.scene_eval.name
            self.figures.warnings.append(
                f"Scene '{scene}': view layer '{self.layer_name}' is black, no light reaches the camera"
            )

    def finished_reader(self, session: Any) -> view_modes.Reader:  # noqa: ANN401
        """Reads the passes of a finished session, Combined denoised where that is wanted and can be done."""
        scene = self.depsgraph.scene_eval
        if self.is_cancelled or not settings.is_denoised(scene, self.engine.is_preview):
            return session.read
        self.engine.update_stats("", "Denoising")
        try:
            threads = settings.thread_count(scene)
            combined = denoise.denoised_combined(session.read, threads, lambda: not self.engine.is_stop_wanted())
        except denoise.DenoiserError as error:
            self.figures.warn_once(f"The picture is not denoised: {error}")
            return session.read
        self.is_cancelled = combined is None
        return session.read if combined is None else lambda name: combined if name == "Combined" else session.read(name)

    def write(self, read: view_modes.Reader, result: bpy.types.RenderResult, view: str) -> None:
        shown = view_modes.reader(self.view_mode, read)
        passes.write_passes(result.layers[0], view, self.passes, shown)


class DisplayClock:
    """Says when the next unfinished picture is due; in the background, never."""

    def __init__(self) -> None:
        self.due = math.inf if bpy.app.background else time.perf_counter() + DISPLAY_SECONDS
        self.started = 0.0

    def is_due(self) -> bool:
        self.started = time.perf_counter()
        return self.started >= self.due

    def restart(self) -> None:
        now = time.perf_counter()
        self.due = now + max(DISPLAY_SECONDS, (now - self.started) / DISPLAY_SHARE)
