"""The render engine as Blender sees it: final renders of view layers, 3D viewports, and icons.

Departures from Blender's template, each forced by a crash or a leak seen in a supported version:
no `__init__` (5.2 runs it twice) and no `__del__` (there is none to call upward): everything native is local to
`render`, except the exported scene under Persistent Data, which may be freed from any thread, and a viewport, which a
finalizer ends.
"""

import contextlib
import math
import time
import traceback
import weakref
from types import ModuleType
from typing import TYPE_CHECKING, Any

import bpy

from . import core as core_loader
from . import denoise, passes, report, settings, view_modes
from .progress import stage_share, status_text
from .viewport import Viewport
from .viewport_render import stop_all
from .views import place_view_camera, view_names

if TYPE_CHECKING:
    from .sync.scene import SceneSync

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
        self, engine: "CisternEngine", depsgraph: bpy.types.Depsgraph, core: ModuleType, figures: report.RenderReport
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
        self.keeps_export = depsgraph.scene_eval.render.use_persistent_data
        self.is_cancelled = False

    def run(self) -> None:
        exported = self.engine.open_export(self.keeps_export)
        try:
            self.export(exported)
            self.render_views(exported)
        finally:
            if not self.keeps_export:
                exported.close()

    def export(self, exported: "SceneSync") -> None:
        """Bring the exported scene up to date with the evaluated one."""
        self.engine.update_stats("", "Exporting the scene")
        start = time.perf_counter()
        self.figures.warnings += exported.sync(self.depsgraph, self.engine.camera_override).warnings
        self.figures.sync_seconds = time.perf_counter() - start

    def render_views(self, exported: "SceneSync") -> None:
        arguments = settings.core_settings(
            self.core, self.depsgraph, self.size, self.region, self.passes, self.engine.is_preview
        )
        views = view_names(self.engine, self.layer_name)
        for index, view in enumerate(views):
            if self.is_cancelled:
                break
            self.engine.active_view_set(view)
            if len(views) > 1:
                place_view_camera(self.engine, self.depsgraph, exported.builder)
            session = self.core.Session(self.core.Settings(**arguments))
            session.start(exported.builder.snapshot())
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


class CisternEngine(bpy.types.RenderEngine):
    bl_idname = "CISTERN"
    bl_label = "Cistern"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True

    kept_export = None  # the exporter of the previous frame, under Persistent Data
    viewport: Viewport | None = None  # of a 3D viewport; each has an engine of its own

    def update_render_passes(
        self, scene: bpy.types.Scene | None = None, renderlayer: bpy.types.ViewLayer | None = None
    ) -> None:
        passes.register_passes(self, scene, renderlayer)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        figures = report.RenderReport(depsgraph.scene_eval.frame_current, depsgraph.view_layer_eval.name)
        start, cpu_start = time.perf_counter(), time.process_time()
        try:
            LayerRender(self, depsgraph, core_loader.load(), figures).run()
        except Exception as error:  # one that reached Blender would be lost, and crash it while it writes an EXR file
            figures.error = error_sentence(error)
            self.kept_export = None
        figures.seconds = time.perf_counter() - start
        figures.cpu_seconds = time.process_time() - cpu_start
        if not self.is_preview:
            self.announce(figures)

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        self.call_viewport("update", context, depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        self.call_viewport("draw", context, depsgraph)

    def call_viewport(self, method: str, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Call the viewport; an error becomes the line in its corner, until a call succeeds."""
        try:
            if self.viewport is None:
                self.viewport = open_viewport(self)
            getattr(self.viewport, method)(self, context, depsgraph)
            self.viewport.error = None
        except Exception as error:
            sentence = error_sentence(error)
            self.update_stats("Cistern", f"Error: {sentence}")
            if self.viewport is not None:
                self.viewport.error = sentence

    def is_stop_wanted(self) -> bool:
        """Whether the user pressed Esc."""
        return self.test_break()

    def open_export(self, is_kept: bool) -> "SceneSync":
        """The exporter to use: the previous frame's if exports are kept, else a new one that the caller closes."""
        from .sync.scene import SceneSync

        if not is_kept:
            self.kept_export = None
            return SceneSync()
        if self.kept_export is None:
            self.kept_export = SceneSync()
        return self.kept_export

    def announce(self, figures: report.RenderReport) -> None:
        """Tell the user in Blender, and scripts on standard output."""
        for warning in figures.warnings:
            self.report({"WARNING"}, warning)
        if figures.error is not None:
            self.report({"ERROR"}, figures.error)
            self.error_set(figures.error)
        else:
            self.stamp(figures)
        report.publish(figures)

    def stamp(self, figures: report.RenderReport) -> None:
        """Write samples and time into the metadata of the saved files."""
        result = self.get_result()
        if result is not None:
            result.stamp_data_add_field(f"cistern.{figures.layer}.samples", str(figures.samples))
            result.stamp_data_add_field(f"cistern.{figures.layer}.seconds", f"{figures.seconds:.2f}")


def open_viewport(engine: CisternEngine) -> Viewport:
    """A viewport that ends with its engine, or with the process, and keeps neither alive."""
    reference = weakref.ref(engine)

    def redraw() -> None:
        owner = reference()
        if owner is not None:
            with contextlib.suppress(ReferenceError):  # Blender has freed it already
                owner.tag_redraw()

    viewport = Viewport(core_loader.load(), redraw)
    weakref.finalize(engine, viewport.stop).atexit = False  # stop_all waits for the threads then
    return viewport


def error_sentence(error: Exception) -> str:
    """The sentence for the user; the traceback of an unforeseen error goes to standard error as well."""
    from .sync import SyncError

    if isinstance(error, core_loader.CoreUnavailableError | SyncError | RenderFailedError):
        return str(error)
    if core_loader.is_core_error(error):
        return str(error)
    traceback.print_exception(error)
    return f"Unexpected {type(error).__name__}: {error}"


def register() -> None:
    bpy.utils.register_class(CisternEngine)


def unregister() -> None:
    stop_all()
    bpy.utils.unregister_class(CisternEngine)
