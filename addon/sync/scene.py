"""One sync: an evaluated dependency graph into a scene builder."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import ModuleType
from typing import TYPE_CHECKING

import bpy

from . import SyncReport
from .camera import camera_arguments
from .changes import EVERYTHING, UNLISTED, Changes
from .images import ImageCache
from .instances import InstanceSync
from .light_groups import group_numbers
from .materials import KeptMaterials, MaterialContext, MaterialTable, data_block_uid, tree_uses
from .motion import MotionStep, place_steps
from .subdivision import dice_for_render
from .world import environment_arguments

if TYPE_CHECKING:
    from cistern_core import SceneBuilder

    from .drift import Drift
    from .shutter import Moment


class SceneSync:
    """Syncs scene after scene for final renders, and keeps what stays valid between them: the decoded image files.

    `builder` holds the last synced scene; it is a new one each time, because Blender hands out no proof that a
    mesh is the same as before.
    """

    def __init__(self, core: ModuleType | None = None) -> None:
        self._core = core if core is not None else importlib.import_module("cistern_core")
        self._images = ImageCache()
        self.builder: SceneBuilder | None = None
        self._shading: Shading | None = None

    def sync(
        self,
        depsgraph: bpy.types.Depsgraph,
        camera: bpy.types.Object | None = None,
        motion: Sequence[MotionStep] = (),
        is_stopped: Callable[[], bool] = lambda: False,
        needs_camera: bool = True,
        frame: int | None = None,
        drift: Drift | None = None,
        render: bpy.types.RenderSettings | None = None,
    ) -> SyncReport:
        """Fill `builder`. `camera` overrides the scene's. `frame`: which movies and sequences show, if not the scene's;
        `drift`: of what is blurred; `render`: as of `camera_arguments`. Raises SyncError, the core's Error, or
        SyncStoppedError once `is_stopped` says so."""
        self.drop()  # before there is another one
        self.builder = self._core.SceneBuilder()
        report = SyncReport(is_stopped=is_stopped)
        self._shading = _sync(
            depsgraph,
            self.builder,
            self._core,
            camera,
            self._images,
            report,
            motion=motion,
            needs_camera=needs_camera,
            frame=frame,
            drift=drift,
            render=render,
        )
        self.builder.blend_normals_in_world()
        return report

    def shade_anew(self) -> None:
        """Make the materials and the world again that were synced last, of the dependency graph as it is now."""
        self._shading.renew()

    def sync_moment(
        self,
        depsgraph: bpy.types.Depsgraph,
        moment: Moment,
        camera: bpy.types.Object | None = None,
        is_stopped: Callable[[], bool] = lambda: False,
        frame: int | None = None,
        render: bpy.types.RenderSettings | None = None,
    ) -> SceneBuilder:
        """A builder with what the dependency graph, at another moment of the same frame, shows of what is blurred."""
        builder = self._core.SceneBuilder()
        sync_scene(
            depsgraph,
            builder,
            core=self._core,
            camera=camera,
            images=self._images,
            moment=moment,
            is_stopped=is_stopped,
            frame=frame,
            render=render,
        )
        return builder

    def drop(self) -> None:
        """Drop the scene, and with it what asks whether to stop; image files stay."""
        self.builder = self._shading = None

    def finish(self) -> None:
        """Keep `builder` alone: the scene is neither shaded anew nor synced again."""
        self._shading = None
        self._images.close()

    def close(self) -> None:
        """Drop the scene and stop the decoding threads."""
        self.drop()
        self._images.close()


def sync_scene(
    depsgraph: bpy.types.Depsgraph,
    builder: SceneBuilder,
    *,
    core: ModuleType,
    camera: bpy.types.Object | None = None,
    images: ImageCache | None = None,
    motion: Sequence[MotionStep] = (),
    is_stopped: Callable[[], bool] = lambda: False,
    needs_camera: bool = True,
    moment: Moment | None = None,
    frame: int | None = None,
    render: bpy.types.RenderSettings | None = None,
) -> SyncReport:
    """Add everything the dependency graph shows to an empty builder. `camera` overrides the scene's, `moment`
    leaves out what is not looked at then.

    Raises SyncError without a camera that it needs, and lets the core's Error through: its text names the data-block.
    Raises SyncStoppedError once `is_stopped` says so; the builder is then good for nothing."""
    report = SyncReport(is_stopped=is_stopped)
    cache = images if images is not None else ImageCache()
    try:
        _sync(
            depsgraph,
            builder,
            core,
            camera,
            cache,
            report,
            motion=motion,
            needs_camera=needs_camera,
            moment=moment,
            frame=frame,
            render=render,
        )
    finally:
        if images is None:
            cache.close()
    return report


@dataclass(frozen=True)
class Shading:
    """The materials and the world of a synced scene."""

    context: MaterialContext
    kept: KeptMaterials
    light_groups: dict[str, int]

    def table(self, changes: Changes = EVERYTHING) -> MaterialTable:
        override = self.context.depsgraph.view_layer_eval.material_override
        return MaterialTable(self.context, override, self.kept, changes)

    def add_environment(self, materials: MaterialTable) -> None:
        arguments = environment_arguments(self.context.depsgraph, materials, self.light_groups)
        self.context.builder.set_environment(**arguments)

    def renew(self) -> None:
        materials = self.table(replace(UNLISTED, shading=frozenset(map(data_block_uid, self.kept.compiled))))
        materials.refresh()
        self.add_environment(materials)


def _sync(
    depsgraph: bpy.types.Depsgraph,
    builder: SceneBuilder,
    core: ModuleType,
    camera: bpy.types.Object | None,
    images: ImageCache,
    report: SyncReport,
    *,
    motion: Sequence[MotionStep] = (),
    needs_camera: bool = True,
    moment: Moment | None = None,
    frame: int | None = None,
    drift: Drift | None = None,
    render: bpy.types.RenderSettings | None = None,
) -> Shading:
    scene = depsgraph.scene_eval
    with timed(report, "camera"):
        camera_object = camera if camera is not None else scene.camera
        if camera_object is not None:
            camera_object = camera_object.evaluated_get(depsgraph)
        if needs_camera or camera_object is not None:
            camera_now = camera_arguments(scene, camera_object, report, render)
            builder.set_camera(**camera_now)
        if needs_camera and moment is None:
            dice_for_render(builder, depsgraph, camera_now, report, render)
    with timed(report, "trees"):
        uses = tree_uses(depsgraph)
        images.begin(scene.frame_current if frame is None else frame)
        for image, image_user in uses.images:
            images.prefetch(image, image_user)
    view_layer = depsgraph.view_layer_eval
    aov_names = frozenset(aov.name for aov in view_layer.aovs if aov.is_valid)
    context = MaterialContext(core, builder, depsgraph, images, report, aov_names)
    shading = Shading(context, KeptMaterials(), group_numbers(view_layer))
    materials = shading.table()
    with timed(report, "world"):
        shading.add_environment(materials)
    with timed(report, "instances"):
        instances = InstanceSync(
            depsgraph,
            builder,
            materials,
            uses,
            report,
            light_groups=shading.light_groups,
            moment=moment,
            drift=drift,
            subdivides=needs_camera,
        )
        instances.run()
        report.surface_items = instances.surface_items
        if motion:
            place_steps(builder, motion, depsgraph, instances.surface_items, instances.surfaces)
            builder.set_camera(**camera_now)
    report.seconds["meshes"] = instances.meshes.seconds
    return shading


@contextmanager
def timed(report: SyncReport, stage: str) -> Iterator[None]:
    """Add the wall time of a stage to the report."""
    start = time.perf_counter()
    try:
        yield
    finally:
        report.seconds[stage] = time.perf_counter() - start
