"""Sessions of the core on a scene of the scoreboard, frame by frame: what the comparisons of settings share."""

from __future__ import annotations

import resource
import sys
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.scoreboard.catalogue import EXAMPLES, Scene
from tests.support.blender_folder import use_own_folder

use_own_folder()

import bpy  # noqa: E402, before the core, so that both share one oneTBB

TRIM = 0.001  # share of pixels with the largest error that the trimmed error leaves out
PATH_TRACER = {"direct": "NEE", "secondary": "NEE", "indirect": "PATH"}


@dataclass(frozen=True)
class Rendered:
    """The mean of the samples of a session, or with `frame` one of its frames alone."""

    picture: NDArray[np.float64]  # (height, width, 3)
    seconds: float  # of CPU, all threads
    stages: dict[str, float]  # CPU seconds by stage


@dataclass(frozen=True)
class Reference:
    first: NDArray  # two independent halves
    second: NDArray

    @cached_property
    def mean(self) -> NDArray:
        return 0.5 * (self.first + self.second)

    def mse(self, picture: NDArray) -> float:
        """Mean square error, less the reference's own."""
        return float(((picture - self.mean) ** 2).mean() - ((self.first - self.second) ** 2).mean() / 4.0)

    def trimmed_mse(self, picture: NDArray) -> float:
        """Without the pixels of largest error; a single firefly can rule the other."""
        own = (((self.first - self.second) / 2.0) ** 2).mean(axis=2)
        squares = ((picture - self.mean) ** 2).mean(axis=2)
        kept = int((1.0 - TRIM) * squares.size)
        return float(np.sort(squares, axis=None)[:kept].mean() - np.sort(own, axis=None)[:kept].mean())


def open_scene(scene: Scene) -> None:
    if not scene.module:
        bpy.ops.wm.open_mainfile(filepath=str(scene.file), load_ui=False)
        return
    sys.path.append(str(EXAMPLES))
    module, tools = __import__(scene.module), __import__("scene_tools")
    module.build(tools.empty_scene())


class Sessions:
    """Of one scene, in light of at most so many bounces, of which pictures show one pass."""

    def __init__(
        self, scene: Scene, pixels: int, bounces: int, light_sampling: str, pass_name: str = "Indirect"
    ) -> None:
        import cistern_core as core

        from addon.sync.scene import sync_scene

        open_scene(scene)
        render = bpy.context.scene.render
        scale = (pixels / (render.resolution_x * render.resolution_y)) ** 0.5
        size = {"width": round(render.resolution_x * scale), "height": round(render.resolution_y * scale)}
        render.resolution_x, render.resolution_y, render.resolution_percentage = *size.values(), 100
        builder = core.SceneBuilder()
        sync_scene(bpy.context.evaluated_depsgraph_get(), builder, core=core)
        self._core, self._scene, self._pass_name = core, builder.snapshot(), pass_name
        self._common = size | {
            "max_bounces": bounces,
            "light_sampling": core.LightSampling[light_sampling],
            "passes": [pass_name],
        }

    def mean(self, samples: int, seed: int, **settings: Any) -> Rendered:
        """Raises RuntimeError when the render fails or meets numbers that are not finite."""
        members = self._common | PATH_TRACER | settings | {"samples": samples, "seed": seed}
        session = self._core.Session(self._core.Settings(**members))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        session.start(self._scene)
        progress = session.wait(3000.0)
        seconds = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
        if progress.status is not self._core.Status.DONE or progress.non_finite_samples or progress.non_finite_weights:
            raise RuntimeError(f"{progress.status.name}: {progress.error or 'numbers that are not finite'}")
        return Rendered(
            session.read(self._pass_name)[..., :3].astype(np.float64), seconds, dict(progress.stage_seconds)
        )

    def frame(self, number: int, seed: int, **settings: Any) -> Rendered:
        """Frame `number` (2 or more) alone, with the history of those before it: number x mean less the sum of a
        session one frame shorter, since sessions of one seed repeat each other's frames. Its times are those of the
        longer session over its number of frames, building left out."""
        before, after = (self.mean(count, seed, **settings) for count in (number - 1, number))
        building = self.mean(1, seed, **settings).seconds
        stages = {name: seconds / number for name, seconds in after.stages.items()}
        seconds = (after.seconds - building) / (number - 1)
        return Rendered(number * after.picture - (number - 1) * before.picture, seconds, stages)

    def reference(self, samples: int, seed: int = 1_000_001) -> Reference:
        halves = (self.mean(samples // 2, seed + k).picture for k in (0, 1))
        return Reference(*halves)
