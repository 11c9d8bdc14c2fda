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
# Of which noise is looked at after multiples alone, so that a noise threshold ends all sessions after the same samples.
LONGEST_STEP = 8

UNLIMITED = {"time_limit": 0.0, "noise_threshold": 0.0, "groups_behind_film": False}
BUILDING_STAGE = "Building"  # of the core's Progress


class Caches:
    """RenderCaches of the core for all that a viewport renders."""

    def __init__(self, core: ModuleType) -> None:
        self._core = core
        self.scene = core.RenderCache()
        self._of_catchers: tuple[Any, Any] | None = None

    def of_catchers(self) -> tuple[Any, Any]:
        """For the scene of catchers alone, of which as much is built as of the scene, and for the backdrop."""
        if self._of_catchers is None:
            self._of_catchers = (self._core.RenderCache(), self._core.RenderCache())
        return self._of_catchers

    def forget_catchers(self) -> None:
        self._of_catchers = None


class StepProgress:
    """The core's Progress of the picture of the scene, as far as all sessions have come."""

    def __init__(self, of_scene: Any, **members: Any) -> None:  # noqa: ANN401
        self._of_scene = of_scene
        self.__dict__.update(members)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self._of_scene, name)


class ShadowedSession:
    """Plays a session of the core, whose Combined has shadows in place of their catchers. Of one thread.

    Where a time limit ends the picture of the scene within a step, that of the step before stays."""

    def __init__(self, core: ModuleType, settings: dict[str, Any]) -> None:
        """`settings`: keyword arguments of the core's `Settings`, by techniques whose samples are independent."""
        self._core = core
        threads = max(settings["threads"] // 2, 1) if settings["threads"] else 0  # the backdrop takes no time
        plan = ShadowPlan(UNLIMITED | settings | {"threads": threads}, is_apart=False)
        of_scene = plan.scene_arguments() | {"time_limit": plan.arguments["time_limit"]}
        alone = plan.alone_arguments(settings["samples"]) | {"time_limit": 0.0}
        self._scene = core.Session(core.Settings(**of_scene))
        self._alone = core.Session(core.Settings(**alone))
        self._backdrop = None
        if plan.needs_backdrop:
            self._backdrop = core.Session(core.Settings(**plan.backdrop_arguments(settings["samples"])))
        self._names = ["Combined", *(name for name in of_scene["passes"] if name not in denoise.LAYER_PASSES)]
        self._sessions = [session for session in (self._scene, self._alone, self._backdrop) if session is not None]
        self._pictures: dict[str, Picture] = {}
        self._alone_caught: Picture | None = None
        self._environment: Picture | None = None
        self._version = self._samples = 0
        self._end: StepProgress | None = None
        self._step, self._released, self._released_at = 1, 0, 0.0

    def start(self, scene: Any, caches: Caches) -> None:  # noqa: ANN401
        self._release(1)
        alone, backdrop = caches.of_catchers()
        self._scene.start(scene, caches.scene)
        self._alone.start(scene.shadow_catchers_alone(), alone)
        if self._backdrop is not None:
            self._backdrop.start(scene.backdrop(), backdrop)

    def wait(self, seconds: float) -> StepProgress:
        """After so many seconds, or less where all have ended."""
        if self._end is not None:
            return self._end
        progresses = [session.wait(0.0) for session in self._sessions]
        late = [index for index, progress in enumerate(progresses) if not self._has_made_step(progress)]
        if late:
            progresses[late[0]] = self._sessions[late[0]].wait(seconds)
        progress = self._advance(progresses)
        if progress.status is not self._core.Status.RUNNING:
            self._end = progress
        return progress

    def _advance(self, progresses: list[Any]) -> StepProgress:
        """Goes on with the next step where this one is made."""
        status, of_scene = self._core.Status, progresses[0]
        for ended in (status.FAILED, status.CANCELLED):
            found = next((progress for progress in progresses if progress.status is ended), None)
            if found is not None:
                return self._progress(of_scene, status=ended, error=found.error)
        if not all(self._has_made_step(progress) for progress in progresses):
            stages = [progress.stage for progress in progresses]
            stage = BUILDING_STAGE if BUILDING_STAGE in stages else of_scene.stage
            return self._progress(of_scene, status=status.RUNNING, stage=stage)
        if of_scene.frames_done > self._samples and len({progress.frames_done for progress in progresses}) == 1:
            self._read(of_scene.frames_done)
        if of_scene.status is status.RUNNING:
            self._lengthen_step()
            self._release((self._released // self._step + 1) * self._step)
        return self._progress(of_scene)

    def cancel(self) -> None:
        """Returns once all have stopped."""
        for session in self._sessions:
            session.hold_after(0)  # so that while one ends, others begin nothing
        for session in self._sessions:
            session.cancel()

    def read(self, name: str) -> Picture:
        """Of the last step, zeros before the first one."""
        if not self._pictures:
            return self._scene.read(name)
        if name == "Combined":
            return self._shadowed(self._pictures["Combined"])
        if name in denoise.LAYER_PASSES:  # denoised as one layer
            return np.zeros_like(self._pictures["Combined"][..., :3])
        return self._pictures[name]

    def _progress(self, of_scene: Any, **members: Any) -> StepProgress:  # noqa: ANN401
        return StepProgress(of_scene, frames_done=self._samples, version=self._version, **members)

    def _has_made_step(self, progress: Any) -> bool:  # noqa: ANN401
        """Sessions are read after every step, so each publishes at the end of every one of them."""
        is_held = progress.frames_done >= self._released and progress.version > self._version
        return is_held or progress.status is not self._core.Status.RUNNING

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
        if time.perf_counter() - self._released_at < STEP_SECONDS:
            self._step = min(2 * self._step, LONGEST_STEP)

    def _release(self, samples: int) -> None:
        self._released, self._released_at = samples, time.perf_counter()
        for session in self._sessions:
            session.hold_after(samples)
