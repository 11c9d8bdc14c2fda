"""The render engine as Blender sees it: final renders of view layers, bakes, 3D viewports, and icons.

Departures from Blender's template, each forced by a crash or a leak seen in a supported version:
no `__init__` (5.2 runs it twice) and no `__del__` (there is none to call upward): everything native is local to
`render`, except the exported scene under Persistent Data, which may be freed from any thread, and a viewport, which a
finalizer ends.
"""

import contextlib
import time
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING

import bpy

from . import core as core_loader
from . import passes, report
from .bake import BakeRender
from .layer_render import LayerRender
from .session_render import RenderFailedError
from .settings import SettingsError
from .viewport import Viewport
from .viewport_render import stop_all

if TYPE_CHECKING:
    from .sync.scene import SceneSync

# Jobs of Blender that keep the engine's class, and how often it is looked whether they have ended.
RENDER_JOBS = ("RENDER", "RENDER_PREVIEW", "OBJECT_BAKE")
WAIT_SECONDS = 0.1


class CisternEngine(bpy.types.RenderEngine):
    bl_idname = "CISTERN"
    bl_label = "Cistern"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True
    bl_use_custom_freestyle = True  # else EEVEE renders the strokes, which needs a display

    kept_export = None  # the exporter of the previous frame, under Persistent Data
    baked_images = 0  # so far
    kept_bake = None  # what is exported of the object that is baked to them: of type bake.ExportedObject
    viewport: Viewport | None = None  # of a 3D viewport; each has an engine of its own

    def update_render_passes(
        self, scene: bpy.types.Scene | None = None, renderlayer: bpy.types.ViewLayer | None = None
    ) -> None:
        if not is_disabled():
            passes.register_passes(self, scene, renderlayer)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        figures = report.RenderReport(depsgraph.scene_eval.frame_current, depsgraph.view_layer_eval.name)
        self.run_reported(figures, lambda: LayerRender(self, depsgraph, core_loader.load(), figures).run())
        if self.is_preview:
            return
        if figures.error is not None:
            self.error_set(figures.error)
        else:
            self.stamp(figures)

    def bake(
        self,
        depsgraph: bpy.types.Depsgraph,
        obj: bpy.types.Object,
        pass_type: str,
        pass_filter: int,
        width: int,
        height: int,
    ) -> None:
        figures = report.RenderReport(depsgraph.scene_eval.frame_current, f"Bake of {obj.name}")
        wanted = (obj, pass_type, pass_filter, (width, height))
        self.run_reported(figures, lambda: BakeRender(self, depsgraph, core_loader.load(), figures).run(*wanted))

    def run_reported(self, figures: report.RenderReport, run: Callable[[], None]) -> None:
        """Announce the figures of what runs. An error that reached Blender would be lost, and crash it while it writes
        an EXR file."""
        start, cpu_start = time.perf_counter(), time.process_time()
        try:
            if is_disabled():
                raise RenderFailedError("Cistern has been disabled")
            run()
        except Exception as error:
            figures.error = error_sentence(error)
            self.kept_export = self.kept_bake = None
        figures.seconds = time.perf_counter() - start
        figures.cpu_seconds = time.process_time() - cpu_start
        if not self.is_preview:
            self.announce(figures)

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        self.call_viewport("update", context, depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        self.call_viewport("draw", context, depsgraph)

    def call_viewport(self, method: str, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Call the viewport; an error becomes the line in its corner, until a call succeeds that shows the scene as it
        is. A redraw after a failed export shows the picture before it."""
        if is_disabled():
            self.viewport = None
            return
        try:
            if self.viewport is None:
                self.viewport = open_viewport(self)
            getattr(self.viewport, method)(self, context, depsgraph)
            if self.viewport.has_scene:
                self.viewport.error = None
        except Exception as error:
            sentence = error_sentence(error)
            self.update_stats("Cistern", f"Error: {sentence}")
            if self.viewport is not None:
                self.viewport.error = sentence

    def picture_settings(self, depsgraph: bpy.types.Depsgraph) -> bpy.types.RenderSettings:
        """Those that have shape and border of the picture: where the compositor of another scene asks for it, those of
        that scene. (Of an instance Blender's property `render` comes before the method.)"""
        known = self.render
        return known if isinstance(known, bpy.types.RenderSettings) else depsgraph.scene_eval.render

    def is_stop_wanted(self) -> bool:
        """Whether the user pressed Esc."""
        return self.test_break()

    def go_to_frame(self, frame: int, subframe: float) -> None:
        """Evaluate the scene of the render at another frame. Before frame 0 Blender itself has subframes below 0, which
        `frame_set` takes for 0."""
        whole, part = divmod(frame + subframe, 1.0)
        self.frame_set(int(whole), subframe=part)

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

    if isinstance(error, core_loader.CoreUnavailableError | SettingsError | SyncError | RenderFailedError):
        return str(error)
    if core_loader.is_core_error(error):
        return str(error)
    report.print_traceback(error)
    return f"Unexpected {type(error).__name__}: {error}"


def is_disabled() -> bool:
    """Whether only a final render keeps the engine, while the rest of the add-on is gone."""
    return not hasattr(bpy.types.Scene, "cistern")


def is_rendering_in_window() -> bool:
    """Be it a final render, a bake or an icon."""
    return not bpy.app.background and any(map(bpy.app.is_job_running, RENDER_JOBS))


def registered_class() -> type | None:
    """This engine's, be it of this module or, while the add-on is upgraded, of the one before."""
    return bpy.types.RenderEngine.bl_rna_get_subclass_py(CisternEngine.bl_idname)


def register() -> None:
    if bpy.app.timers.is_registered(unregister_later):
        bpy.app.timers.unregister(unregister_later)
    elif registered_class() is not None and is_rendering_in_window():
        bpy.app.timers.register(register_later, first_interval=WAIT_SECONDS, persistent=True)
    else:
        register_now()


def register_now() -> None:
    before = registered_class()
    if before is not None:
        bpy.utils.unregister_class(before)
    bpy.utils.register_class(CisternEngine)


def register_later() -> float | None:
    """A timer: once no render is under way."""
    if is_rendering_in_window():
        return WAIT_SECONDS
    register_now()
    return None


def unregister() -> None:
    """Blender crashes where an engine's class goes while it renders in a window, so it stays until that has ended."""
    stop_all()
    if bpy.app.timers.is_registered(register_later):
        bpy.app.timers.unregister(register_later)
    elif is_rendering_in_window():
        bpy.app.timers.register(unregister_later, first_interval=WAIT_SECONDS, persistent=True)
    else:
        bpy.utils.unregister_class(CisternEngine)


def unregister_later() -> float | None:
    """A timer: the same, unless a newer module has done so."""
    if is_rendering_in_window():
        return WAIT_SECONDS
    if registered_class() is CisternEngine:
        bpy.utils.unregister_class(CisternEngine)
    return None
