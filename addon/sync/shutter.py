"""Motion blur: when the shutter is open, and the scene at the instants it opens and closes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from . import versions

if TYPE_CHECKING:
    from cistern_core import SceneBuilder

    from . import SyncReport
    from .motion import MotionStep
    from .scene import SceneSync

_CURVE_STEPS = 256
_FLAT = 1e-3


@dataclass(frozen=True)
class ShutterTimes:
    """In frames, from the frame that is rendered on."""

    opening: float
    closing: float

    @property
    def middle(self) -> float:
        return 0.5 * (self.opening + self.closing)


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


def warn_of_unblurred(scene: bpy.types.Scene, report: SyncReport) -> None:
    """Cycles can leave objects out."""

    def is_left_out(obj: bpy.types.Object) -> bool:
        settings = getattr(obj, "cycles", None)  # where its add-on is there
        return not (getattr(settings, "use_motion_blur", True) and getattr(settings, "use_deform_motion", True))

    names = [obj.name for obj in scene.objects if is_left_out(obj)]
    if names:
        rest = f" and {len(names) - 1} more" if len(names) > 1 else ""
        report.warn(f"Object '{names[0]}'{rest}: motion blur cannot be turned off for single objects")


class MotionBlur:
    """Exports the scene in the middle of the exposure and at its ends."""

    def __init__(self, times: ShutterTimes, scene: bpy.types.Scene, go_to_frame: Callable[[int, float], None]) -> None:
        self.times = times
        self.ends: list[SceneBuilder] = []
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
        **motion: Sequence[MotionStep],
    ) -> SyncReport:
        """Fill the builder of `exported` with the middle, and `ends`. The scene is then where it was."""
        try:
            for time in (self.times.opening, self.times.closing):
                self._go_to(time)
                self.ends.append(exported.sync_moment(depsgraph, camera, is_stopped=is_stopped))
            self._go_to(self.times.middle)
            report = exported.sync(depsgraph, camera, is_stopped=is_stopped, **motion)
        finally:
            if self._offset != 0.0:
                self._go_to(0.0)
        warn_of_rolling_shutter(depsgraph.scene_eval, report)
        warn_of_unblurred(depsgraph.scene, report)
        return report

    def _go_to(self, offset: float) -> None:
        self._offset = offset
        self._go_to_frame(self._frame, self._subframe + offset)
