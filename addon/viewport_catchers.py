"""Shadow catchers in 3D viewports: the sessions of a final render beside each other, keeping step.

What they hand out is of the same samples, by the same random numbers. So where no shadow falls a catcher has no noise.
"""

from __future__ import annotations

import time
from types import ModuleType
from typing import Any

import numpy as np

from . import denoise, shadow_catchers
from .shadow_catchers import CAUGHT_PASS, ShadowPlan
from .view_modes import Picture

# A step has as many samples as go into this time; pictures are read after each.
STEP_SECONDS = 0.1
MOST_STEPS = 16

UNLIMITED = {"time_limit": 0.0, "noise_threshold": 0.0, "groups_behind_film": False}


class Caches:
    """RenderCaches of the core for all that a viewport renders."""

    def __init__(self, core: ModuleType) -> None:
        self.scene = core.RenderCache()
        self.alone = core.RenderCache()
        self.backdrop = core.RenderCache()


class StepProgress:
    """The core's Progress of the picture of the scene, as far as all sessions have come."""

    def __init__(self, of_scene: Any, **members: Any) -> None:  # noqa: ANN401
        self._of_scene = of_scene
        self.__dict__.update(members)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self._of_scene, name)


class ShadowedSession:
    """Plays a session of the core, whose Combined has shadows in place of their catchers. Of one thread."""

    def __init__(self, core: ModuleType, settings: dict[str, Any]) -> None:
        """`settings`: keyword arguments of the core's `Settings`, by techniques whose samples are independent."""
        self._core = core
        plan = ShadowPlan(UNLIMITED | settings, is_apart=False)
        of_scene = plan.scene_arguments() | {"time_limit": plan.arguments["time_limit"]}
        alone = plan.alone_arguments(settings["samples"]) | {"time_limit": 0.0}
        self._scene = core.Session(core.Settings(**of_scene))
        self._alone = core.Session(core.Settings(**alone))
        self._backdrop = None
        if plan.needs_backdrop:
            self._backdrop = core.Session(core.Settings(**plan.backdrop_arguments(settings["samples"])))
        replaced = (denoise.NOISY_PASS, *denoise.LAYER_PASSES)
        self._names = ["Combined", *(name for name in of_scene["passes"] if name not in replaced)]
        self._sessions = [session for session in (self._scene, self._alone, self._backdrop) if session is not None]
        self._pictures: dict[str, Picture] = {}
        self._alone_caught: Picture | None = None
        self._environment: Picture | None = None
        self._version = self._samples = 0
        self._step, self._released = 1, 0.0

    def start(self, scene: Any, caches: Caches) -> None:  # noqa: ANN401
        self._release(1)
        self._scene.start(scene, caches.scene)
        self._alone.start(scene.shadow_catchers_alone(), caches.alone)
        if self._backdrop is not None:
            self._backdrop.start(scene.backdrop(), caches.backdrop)

    def wait(self, seconds: float) -> StepProgress:
        of_scene = self._scene.wait(seconds)
        of_all = [of_scene, *(session.wait(0.0) for session in self._sessions[1:])]
        failed = next((progress for progress in of_all if progress.status is self._core.Status.FAILED), None)
        if failed is not None:
            return self._progress(of_scene, failed.status, failed.error)
        if any(progress.status is self._core.Status.CANCELLED for progress in of_all):
            return self._progress(of_scene, self._core.Status.CANCELLED)
        if not all(self._has_made_step(progress) for progress in of_all):
            return self._progress(of_scene, self._core.Status.RUNNING)
        if of_scene.frames_done > self._samples:
            self._read(of_scene.frames_done)
        if of_scene.status is self._core.Status.RUNNING:
            self._lengthen_step()
            self._release(self._samples + self._step)
        return self._progress(of_scene, of_scene.status)

    def cancel(self) -> None:
        for session in self._sessions:
            session.cancel()

    def read(self, name: str) -> Picture:
        """Of the last step, zeros before the first one."""
        if not self._pictures:
            return self._scene.read(name)
        if name in ("Combined", denoise.NOISY_PASS):
            return self._shadowed(self._pictures["Combined"])
        if name in denoise.LAYER_PASSES:  # denoised as one layer
            return np.zeros_like(self._pictures["Combined"][..., :3])
        return self._pictures[name]

    def _progress(self, of_scene: Any, status: Any, error: str = "") -> StepProgress:  # noqa: ANN401
        members = {"status": status, "error": error, "frames_done": self._samples, "version": self._version}
        return StepProgress(of_scene, **members)

    def _has_made_step(self, progress: Any) -> bool:  # noqa: ANN401
        """Sessions are read after every step, so each publishes every one of them."""
        return progress.status is not self._core.Status.RUNNING or progress.version > self._version

    def _read(self, samples: int) -> None:
        self._pictures = {name: self._scene.read(name) for name in self._names}
        self._alone_caught = self._alone.read(CAUGHT_PASS)
        self._environment = None if self._backdrop is None else self._backdrop.read("Environment")
        self._version, self._samples = self._version + 1, samples

    def _shadowed(self, combined: Picture) -> Picture:
        caught = self._pictures[CAUGHT_PASS]
        passes = {"Combined": combined, CAUGHT_PASS: caught}
        shadow = shadow_catchers.shadow(passes.__getitem__, {CAUGHT_PASS: self._alone_caught}.__getitem__)
        return shadow_catchers.over_shadow(combined - caught, shadow, self._environment)

    def _lengthen_step(self) -> None:
        if time.perf_counter() - self._released < STEP_SECONDS:
            self._step = min(2 * self._step, MOST_STEPS)

    def _release(self, samples: int) -> None:
        self._released = time.perf_counter()
        for session in self._sessions:
            session.hold_after(samples)
