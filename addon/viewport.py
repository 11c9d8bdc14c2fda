"""One 3D viewport: Blender's two callbacks on one side, a live scene and a rendering thread on the other.

Both callbacks come on Blender's main thread. `view_update` exports what changed; `view_draw` looks where the camera is,
and draws the newest picture, after a change once that is there or has not come in a moment. No reference to Blender's
data outlives a call.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Any

from . import settings, unshared
from .viewport_camera import View, viewport_view
from .viewport_draw import Screen
from .viewport_render import Job, ViewportRender

if TYPE_CHECKING:
    from collections.abc import Callable

    import bpy

    from .sync.changes import Changes
    from .sync.studio_light import ViewportLighting


class Viewport:
    """Lives as long as the engine of a viewport. `redraw` is called on another thread when there is a new picture."""

    def __init__(self, core: ModuleType, redraw: Callable[[], None]) -> None:
        from .sync.live import LiveSync

        self._core = core
        self._sync = LiveSync(core)
        self._render = ViewportRender(core, redraw)
        self._screen = Screen()
        self._snapshot: Any = None
        self._has_catchers = False
        self._dicing_rates: dict[str, Any] = {}
        self._view: View | None = None
        self._job: Job | None = None
        self._hiding: tuple = ()
        self._lighting: ViewportLighting | None = None
        self.warnings: list[str] = []
        self._scene_warnings: list[str] = []
        self.error: str | None = None

    def update(
        self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph
    ) -> None:
        """Something was evaluated: export what changed."""
        from .sync.changes import read_changes

        changes = read_changes(depsgraph)
        if self._hiding != hiding(context.space_data):
            changes = replace(changes, has_unlisted=True)
        self._export(context, depsgraph, changes)
        self._request(engine, context, depsgraph)

    def draw(self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draw the newest picture, and ask for another one if the view or a setting is not what it was."""
        from .sync.changes import NOTHING, UNLISTED
        from .sync.studio_light import viewport_lighting

        if self._hiding != hiding(context.space_data):
            self._export(context, depsgraph, UNLISTED)
        elif self._lighting != viewport_lighting(context.space_data):
            self._export(context, depsgraph, NOTHING)
        self._request(engine, context, depsgraph)
        self._render.await_picture()
        picture = self._render.picture
        if picture is not None:
            self._screen.draw(engine, depsgraph.scene, picture, (context.region.width, context.region.height))
        engine.update_stats("Cistern", self.status(depsgraph.scene.cistern.viewport_pause))

    @property
    def has_scene(self) -> bool:
        """Whether the last export succeeded."""
        return self._sync.builder is not None

    def stop(self, waits: bool = False) -> None:
        """End the thread and drop the scene."""
        self._render.stop(waits)
        self._sync.close()

    def status(self, is_paused: bool) -> str:
        """The line in the corner of the viewport."""
        error = self.error or self._render.error
        if error is not None:
            return f"Error: {error}"
        progress = self._render.picture.status if self._render.picture is not None else "Building"
        warnings = [*self._scene_warnings, *self.warnings, *self._render.warnings]
        parts = [f"{progress} (paused)" if is_paused else progress, *warnings[:1]]
        if len(warnings) > 1:
            parts.append(f"{len(warnings) - 1} more warnings")
        return " | ".join(parts)

    def _export(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph, changes: Changes) -> None:
        from .sync.studio_light import viewport_lighting

        self._hiding, self._lighting = hiding(context.space_data), viewport_lighting(context.space_data)
        self.warnings = self._sync.sync(depsgraph, changes, context.space_data).warnings
        if self._sync.exported.is_anything:
            self._view = None

    def _request(
        self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph
    ) -> None:
        """Hand a job to the thread, unless it is the one before."""
        if self._sync.builder is None:
            return
        if depsgraph.scene.cistern.viewport_pause:
            self._pause()
            return
        from .sync.subdivision import dicing_rates

        view, rates = viewport_view(context, depsgraph), dicing_rates(depsgraph.scene, is_render=False)
        if view != self._view or rates != self._dicing_rates:
            self._sync.builder.set_camera(**view.camera_arguments())
            owner = f"Scene '{depsgraph.scene.name}'"
            self._sync.builder.set_dicing(owner, view.width, view.height, **rates, stays_diced=True)
            self._dicing_rates = rates
            self._snapshot, self._view = self._sync.builder.snapshot(), view
            self._has_catchers = self._snapshot.has_shadow_catchers
        job = self._make_job(depsgraph.scene, engine.get_preview_pixel_size(depsgraph.scene))
        if job != self._job:
            self._job = job
            self._render.submit(job)

    def _pause(self) -> None:
        if self._job is not None:
            self._job = None
            self._render.pause()

    def _make_job(self, scene: bpy.types.Scene, finest_pixel: int) -> Job:
        has_catchers = self._has_catchers and scene.cistern.viewport_view == "COMBINED"
        arguments = settings.viewport_settings(self._core, scene, has_catchers)
        arguments["passes"] = tuple(arguments["passes"])
        limits = settings.viewport_limits(scene)
        found = (
            unshared.warning(self._snapshot, arguments),
            settings.take_out_deaf_threshold(self._core, scene, arguments, limits),
        )
        self._scene_warnings = [*self._snapshot.warnings, *(warning for warning in found if warning is not None)]
        return Job(
            self._snapshot,
            self._view,
            tuple(sorted(arguments.items())),
            scene.cistern.viewport_view,
            tuple(sorted(limits.items())),
            finest_pixel,
            settings.is_viewport_denoised(scene),
            has_catchers,
        )


def hiding(space: bpy.types.SpaceView3D) -> tuple:
    """What a viewport's own switches hide; they change without an evaluation."""
    return (space.local_view is not None, space.use_local_collections, *(getattr(space, name) for name in switches()))


@cache
def switches() -> tuple[str, ...]:
    """Names of a viewport's switches for types of objects."""
    import bpy

    names = bpy.types.SpaceView3D.bl_rna.properties.keys()
    return tuple(name for name in names if name.startswith("show_object_viewport_"))
