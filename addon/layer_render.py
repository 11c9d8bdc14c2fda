"""A final render of one view layer of one frame: export, sessions, pixels, figures.

Everything native is local to it, except the exported scene under Persistent Data.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import bpy

from . import cryptomatte, denoise, passes, report, settings, shadow_catchers, unshared, view_modes
from .progress import Span
from .session_render import Look, Moments, SessionRender, reader
from .shadow_catchers import ShadowPlan
from .view_modes import with_passes
from .views import place_view_camera, view_names

if TYPE_CHECKING:
    from types import ModuleType

    from cistern_core import Scene, SceneBuilder

    from .engine import CisternEngine
    from .sync import SyncReport
    from .sync.scene import SceneSync
    from .sync.shutter import MotionBlur

# Unfinished pictures are shown no more often than this, and in at most a tenth of the time.
DISPLAY_SECONDS = 1.0
DISPLAY_SHARE = 0.1


class LayerRender(SessionRender):
    """The render of one view layer of one frame: export, sessions (one for each view), pixels, figures."""

    def __init__(
        self, engine: CisternEngine, depsgraph: bpy.types.Depsgraph, core: ModuleType, figures: report.RenderReport
    ) -> None:
        super().__init__(engine, depsgraph, core, figures)
        self.layer_name = depsgraph.view_layer_eval.name
        self.passes = passes.enabled_passes(depsgraph.view_layer_eval)
        self.view_mode = settings.view_mode(depsgraph.scene_eval, engine.is_preview)
        self.size = (engine.resolution_x, engine.resolution_y)
        self.region = settings.render_region(engine.picture_settings(depsgraph), *self.size)
        self.arguments = settings.core_settings(core, depsgraph, self.size, self.region, self.passes, engine.is_preview)
        warning = settings.take_out_deaf_threshold(core, depsgraph.scene_eval, self.arguments, self.arguments)
        if warning is not None:
            figures.warnings.append(warning)
        self.warn_of_passes()
        self.blur = self.motion_blur()
        self.keeps_export = depsgraph.scene_eval.render.use_persistent_data

    def run(self) -> None:
        from .sync import SyncStoppedError

        exported = self.engine.open_export(self.keeps_export)
        try:
            synced = self.export(exported)
            self.render_views(exported)
            cryptomatte.stamp(self.engine, self.depsgraph.view_layer_eval, synced.matte_names, self.core)
        except SyncStoppedError:
            self.is_cancelled = True
            self.engine.kept_export = None
            exported.close()  # and no longer decode what waits
        finally:
            if self.keeps_export:
                exported.drop()
            else:
                exported.close()

    def export(self, exported: SceneSync) -> SyncReport:
        """Bring the exported scene up to date with the evaluated one."""
        self.engine.update_stats("", "Exporting the scene")
        start = time.perf_counter()
        camera, options = self.engine.camera_override, self.motion()
        options |= {"is_stopped": self.engine.is_stop_wanted, "render": self.engine.picture_settings(self.depsgraph)}
        if self.blur is None:
            synced = exported.sync(self.depsgraph, camera, **options)
        else:
            synced = self.blur.sync(exported, self.depsgraph, camera, **options)
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

        camera, picture = self.engine.camera_override, self.engine.picture_settings(self.depsgraph)
        return {"motion": read_steps(self.depsgraph, camera, self.engine.go_to_frame, picture)}

    def motion_blur(self) -> MotionBlur | None:
        """None where nothing is to be blurred, or cannot be."""
        from .sync.shutter import MotionBlur, shutter_curve, shutter_times

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
        self.arguments["shutter_curve"] = shutter_curve(scene)
        return MotionBlur(times, scene, self.engine.go_to_frame)

    def render_views(self, exported: SceneSync) -> None:
        builders = [exported.builder, *(self.blur.moments if self.blur else ())]
        views = view_names(self.engine, self.layer_name)
        for index, view in enumerate(views):
            if self.is_cancelled:
                break
            self.engine.active_view_set(view)
            if view:
                for builder in builders:
                    place_view_camera(self.engine, self.depsgraph, builder)
            scene = self.snapshot(exported.builder)
            others = [self.snapshot(builder, middle=scene) for builder in builders[1:]]
            self.warn_of_path_tracing(scene)
            for warning in scene.warnings:
                self.figures.warn_once(warning)
            self.render_view(Moments(scene, tuple(others)), view, Span(index / len(views), 1 / len(views)))

    def snapshot(self, builder: SceneBuilder, middle: Any = None) -> Any:  # noqa: ANN401
        """Raises SyncStoppedError once the user pressed Esc."""
        from .sync import SyncStoppedError

        scene = builder.snapshot(middle=middle, is_stopped=self.engine.is_stop_wanted)
        if scene is None:
            raise SyncStoppedError
        return scene

    def render_view(self, moments: Moments, view: str, span: Span) -> None:
        """Render a view and hand over its pixels."""
        result = self.engine.begin_result(0, 0, self.region.width, self.region.height, layer=self.layer_name, view=view)
        is_complete = False
        try:
            plan = self.shadow_plan(moments)
            if plan is None:
                read = self.finished_reader(self.rendered(self.arguments, moments, span, self.display(result, view)))
                self.warn_of_black_picture(read)
            else:
                moments = replace(moments, cache=self.core.RenderCache())
                read = self.rendered_with_shadows(plan, moments, span, result, view)
            self.write(read, result, view)
            is_complete = True
        finally:
            self.engine.end_result(result, cancel=not is_complete)

    def shadow_plan(self, moments: Moments) -> ShadowPlan | None:
        if self.engine.is_preview or self.view_mode != "COMBINED" or not moments.scene.has_shadow_catchers:
            return None
        return ShadowPlan(self.arguments, self.depsgraph.view_layer_eval.cistern.use_pass_shadow_catcher)

    def rendered_with_shadows(
        self, plan: ShadowPlan, moments: Moments, span: Span, result: bpy.types.RenderResult, view: str
    ) -> view_modes.Reader:
        """Reads the passes of a finished picture with shadows on its catchers."""
        of_scene, of_shadows = span.split(shadow_catchers.SCENE_SHARE)
        read = self.rendered(
            plan.scene_arguments(), moments, of_scene, self.display(result, view, shadow_catchers.hidden)
        )
        samples, mean_samples = self.figures.samples, self.figures.mean_samples
        if self.is_cancelled or samples == 0:
            return shadow_catchers.hidden(read)
        alone = self.rendered(plan.alone_arguments(samples), moments.shadow_catchers_alone(), of_shadows)
        noisy_shadow, noisy_read = shadow_catchers.shadow(read, alone), shadow_catchers.without_catchers(read)
        shadow, matte = self.denoised(noisy_shadow, read), self.finished_reader(noisy_read)("Combined")
        pictures = {shadow_catchers.SHADOW_PASS: shadow, "Combined": matte, denoise.NOISY_PASS: noisy_read("Combined")}
        if not plan.is_apart:
            backdrop = None
            if plan.needs_backdrop:
                arguments = plan.backdrop_arguments(samples)
                backdrop = self.rendered(arguments, moments.backdrop(), of_shadows.split(1.0)[1])("Environment")
                pictures["Environment"] = shadow_catchers.beside(matte, backdrop)
            for name, share in (("Combined", shadow), (denoise.NOISY_PASS, noisy_shadow)):
                pictures[name] = shadow_catchers.over_shadow(pictures[name], share, backdrop)
        self.figures.samples, self.figures.mean_samples = samples, mean_samples
        return with_passes(read, pictures)

    def display(
        self,
        result: bpy.types.RenderResult,
        view: str,
        shown: Callable[[view_modes.Reader], view_modes.Reader] = lambda read: read,
    ) -> Look:
        """Shows unfinished pictures, as what `shown` makes of them."""
        clock = DisplayClock()
        seen = 0

        def look(session: Any, progress: Any) -> None:  # noqa: ANN401
            nonlocal seen
            if progress.version == seen or not clock.is_due():
                return
            seen = progress.version
            self.write(shown(reader(session)), result, view)
            self.engine.update_result(result)
            clock.restart()

        return look

    def warn_of_passes(self) -> None:
        for name in passes.aovs_left_out(self.depsgraph.view_layer_eval):
            self.figures.warnings.append(
                f"View layer '{self.layer_name}': shader AOV '{name}' is left out, since another pass has this name"
            )

    def warn_of_path_tracing(self, scene: Scene) -> None:
        warning = unshared.warning(scene, self.arguments)
        if warning is not None:
            self.figures.warn_once(warning)

    def warn_of_black_picture(self, read: view_modes.Reader) -> None:
        if not self.is_cancelled and not read("Combined")[..., :3].any():
            scene = self.depsgraph.scene_eval.name
            self.figures.warnings.append(
                f"Scene '{scene}': view layer '{self.layer_name}' is black, no light reaches the camera"
            )

    def finished_reader(self, read: view_modes.Reader) -> view_modes.Reader:
        """Reads the passes of a finished session, Combined denoised where that is wanted and can be done."""
        combined = self.denoised_by(lambda **options: denoise.denoised_combined(read, **options))
        return read if combined is None else with_passes(read, {"Combined": combined})

    def denoised(self, picture: view_modes.Picture, read: view_modes.Reader) -> view_modes.Picture:
        """A picture of the session that `read` reads, denoised where that is wanted and can be done."""
        clean = self.denoised_by(lambda **options: denoise.denoise(picture, *denoise.guides(read), **options))
        return picture if clean is None else clean

    def denoised_by(self, run: Callable[..., view_modes.Picture | None]) -> view_modes.Picture | None:
        scene, layer = self.depsgraph.scene_eval, self.depsgraph.view_layer_eval
        if self.is_cancelled or not settings.is_denoised(scene, layer, self.engine.is_preview):
            return None
        self.engine.update_stats("", "Denoising")
        try:
            clean = run(threads=settings.thread_count(scene), is_wanted=lambda: not self.engine.is_stop_wanted())
        except denoise.DenoiserError as error:
            self.figures.warn_once(f"The picture is not denoised: {error}")
            return None
        self.is_cancelled = clean is None
        return clean

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
