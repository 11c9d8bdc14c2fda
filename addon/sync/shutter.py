"""Motion blur: when the shutter is open, and the scene at the instants it opens and closes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from . import SyncReport, versions
from .camera import camera_arguments
from .drift import Drift

if TYPE_CHECKING:
    from cistern_core import SceneBuilder

    from .motion import MotionStep
    from .scene import SceneSync

_CURVE_STEPS = 256
_FLAT = 1e-3
_UNBLURRED = {"LIGHT", "CAMERA", "LIGHT_PROBE", "SPEAKER"}  # of cameras, the one that looks


@dataclass(frozen=True)
class ShutterTimes:
    """In frames, from the frame that is rendered on."""

    opening: float
    closing: float

    @property
    def middle(self) -> float:
        return 0.5 * (self.opening + self.closing)

    @property
    def length(self) -> float:
        return self.closing - self.opening

    def at(self, moment: Moment) -> float:
        share = moment.step / (1 << moment.doublings)
        return (1.0 - share) * self.opening + share * self.closing


def shutter_times(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> ShutterTimes | None:
    """None without motion blur."""
    render = scene.render
    if not (
        render.use_motion_blur and render.motion_blur_shutter > 0.0 and getattr(view_layer, "use_motion_blur", True)
    ):
        return None
    length = render.motion_blur_shutter
    opening = {"START": 0.0, "CENTER": -0.5 * length, "END": -length}[render.motion_blur_position]
    return ShutterTimes(opening, opening + length)


def shutter_curve(scene: bpy.types.Scene) -> list[float]:
    """How far the shutter is open at even steps from its opening to its closing, none negative; empty where that is the
    same all along, or never."""
    mapping = scene.render.motion_blur_shutter_curve
    mapping.initialize()
    curve = mapping.curves[0]
    values = [max(mapping.evaluate(curve, step / _CURVE_STEPS), 0.0) for step in range(_CURVE_STEPS + 1)]
    return values if max(values) - min(values) > _FLAT else []


def warn_of_rolling_shutter(scene: bpy.types.Scene, report: SyncReport) -> None:
    if versions.cycles_setting(scene, "rolling_shutter_type", "NONE") != "NONE":
        report.warn(f"Scene '{scene.name}': the rolling shutter is ignored, all rows are exposed at once")


def _doublings(obj: bpy.types.Object, instancer: bpy.types.Object | None = None) -> int:
    """How often the time that the shutter is open is halved to find the moments at which an object is looked at, as in
    Cycles; 0 for one that is not to be blurred. What instances it has a say, too."""
    shown = (obj,) if instancer is None else (obj, instancer)
    if not all(versions.cycles_setting(one, "use_motion_blur", True) for one in shown):
        return 0
    return max(versions.cycles_setting(one, "motion_steps", 1) for one in shown)


def moves(obj: bpy.types.Object, instancer: bpy.types.Object | None) -> bool:
    """Whether it is to be blurred."""
    return _doublings(obj, instancer) > 0


def bends(obj: bpy.types.Object, instancer: bpy.types.Object | None) -> bool:
    """Whether blur follows changes of its shape, too."""
    return moves(obj, instancer) and all(
        versions.cycles_setting(one, "use_deform_motion", True) for one in (obj, instancer) if one is not None
    )


@dataclass(frozen=True)
class Moment:
    """One of even steps of the time that a shutter is open: `step` of 2 to the power of `doublings`."""

    step: int
    doublings: int

    @property
    def is_middle(self) -> bool:
        return 2 * self.step == 1 << self.doublings

    def has(self, obj: bpy.types.Object, instancer: bpy.types.Object | None) -> bool:
        """Whether it is one at which the place of this object is looked at."""
        own = min(_doublings(obj, instancer), self.doublings)
        return own > 0 and self.step % (1 << (self.doublings - own)) == 0

    def has_shape_of(self, obj: bpy.types.Object, instancer: bpy.types.Object | None) -> bool:
        return self.has(obj, instancer) and bends(obj, instancer)


def moments_of(depsgraph: bpy.types.Depsgraph, camera: bpy.types.Object | None) -> list[Moment]:
    """As many as the object that is looked at most often asks for, without the middle; none without blur."""
    blurred = [item for item in depsgraph.ids if isinstance(item, bpy.types.Object) and item.type not in _UNBLURRED]
    most = max(map(_doublings, [*blurred, *([] if camera is None else [camera])]), default=0)
    moments = (Moment(step, most) for step in range((1 << most) + 1))
    return [moment for moment in moments if not moment.is_middle] if most else []


class MotionBlur:
    """Exports the scene in the middle of the exposure and at other moments of it, with all that is to be blurred."""

    def __init__(self, times: ShutterTimes, scene: bpy.types.Scene, go_to_frame: Callable[[int, float], None]) -> None:
        self.times = times
        self.moments: list[SceneBuilder] = []
        self._frame, self._subframe = scene.frame_current, scene.frame_subframe
        self._go_to_frame = go_to_frame
        self._offset = 0.0

    def sync(
        self,
        exported: SceneSync,
        depsgraph: bpy.types.Depsgraph,
        camera: bpy.types.Object | None,
        *,
        is_stopped: Callable[[], bool] = lambda: False,
        render: bpy.types.RenderSettings | None = None,
        **motion: Sequence[MotionStep],
    ) -> SyncReport:
        """Fill the builder of `exported` with the middle, and `moments`. The scene is then where it was."""
        seen_by = camera if camera is not None else depsgraph.scene_eval.camera
        try:
            for moment in moments_of(depsgraph, seen_by):
                self._go_to(self.times.at(moment))
                builder = exported.sync_moment(
                    depsgraph, moment, camera, is_stopped=is_stopped, frame=self._frame, render=render
                )
                self.moments.append(builder)
            self._go_to(self.times.middle)
            drift = Drift.during(self.times, self._frame + self._subframe, depsgraph.scene_eval.render)
            report = exported.sync(
                depsgraph, camera, is_stopped=is_stopped, frame=self._frame, drift=drift, render=render, **motion
            )
            if seen_by is not None and not _doublings(seen_by):
                rests = seen_by.evaluated_get(depsgraph)
                resting = camera_arguments(depsgraph.scene_eval, rests, SyncReport(), render)
                for builder in self.moments:
                    builder.set_camera(**resting)
        finally:
            is_elsewhere = self._offset != 0.0
            if is_elsewhere:
                self._go_to(0.0)
        if is_elsewhere:
            exported.shade_anew()  # materials and the world are those of the frame, as in Cycles
        warn_of_rolling_shutter(depsgraph.scene_eval, report)
        return report

    def _go_to(self, offset: float) -> None:
        self._offset = offset
        self._go_to_frame(self._frame, self._subframe + offset)
