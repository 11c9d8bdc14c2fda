"""Sessions of the core on a scene of the scoreboard, frame by frame: what the comparisons of settings share."""

from __future__ import annotations

import resource
import sys
from collections.abc import Sequence
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
# A pixel sees the same point in all frames, as with one G-buffer. Where the points of a coarse pixel differ, what was
# found through a gap is often hidden from the point of the frame before: unbiased weights then owe it all to one path.
SAME_POINT = {"filter_width": 0.01}
DIFFUSE_ALONE = {"max_glossy_bounces": 0, "max_transmission_bounces": 0}
PATH_TRACER = {"direct": "NEE", "secondary": "NEE", "indirect": "PATH"}


@dataclass(frozen=True)
class Rendered:
    """The mean of the samples of a session, or with `frame` one of its frames alone."""

    picture: NDArray[np.float64]  # (height, width, 3)
    seconds: float  # of CPU, all threads
    stages: dict[str, float]  # CPU seconds by stage
    memory_bytes: int  # by the core's own count
    mean_samples: float = 0.0  # of pixels, in the whole session


@dataclass(frozen=True)
class Reference:
    first: NDArray  # two independent halves
    second: NDArray

    @cached_property
    def mean(self) -> NDArray:
        return 0.5 * (self.first + self.second)

    def mse(self, picture: NDArray) -> float:
        """Mean square error, less the reference's own."""
        return self.common_mse(picture, picture)

    def common_mse(self, one: NDArray, other: NDArray) -> float:
        """Mean product of the errors of two pictures, less the reference's own: what they have in common."""
        own = ((self.first - self.second) ** 2).mean() / 4.0
        return float(((one - self.mean) * (other - self.mean)).mean() - own)

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
    """Of one scene, in light of at most so many bounces, of which pictures show the sum of some passes. `common`:
    settings of all."""

    def __init__(
        self,
        scene: Scene,
        pixels: int,
        bounces: int,
        light_sampling: str,
        passes: Sequence[str] = ("Indirect",),
        **common: Any,
    ) -> None:
        import cistern_core as core

        from addon.sync.scene import sync_scene

        open_scene(scene)
        render = bpy.context.scene.render
        self._shape = render.resolution_x, render.resolution_y
        size = self.size(pixels)
        render.resolution_x, render.resolution_y, render.resolution_percentage = *size.values(), 100
        builder = core.SceneBuilder()
        sync_scene(bpy.context.evaluated_depsgraph_get(), builder, core=core)
        self._core, self._scene, self._passes = core, builder.snapshot(), passes
        self._common = size | {
            "max_bounces": bounces,
            "light_sampling": core.LightSampling[light_sampling],
            "passes": list(passes),
            **common,
        }

    def size(self, pixels: int) -> dict[str, int]:
        """Settings of a picture of about so many pixels, in the scene's shape."""
        scale = (pixels / (self._shape[0] * self._shape[1])) ** 0.5
        return {"width": round(self._shape[0] * scale), "height": round(self._shape[1] * scale)}

    def mean(self, samples: int, seed: int, cache: object = None, **settings: Any) -> Rendered:
        """Raises RuntimeError when the render fails or meets numbers that are not finite."""
        members = self._common | PATH_TRACER | settings | {"samples": samples, "seed": seed}
        session = self._core.Session(self._core.Settings(**members))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        session.start(self._scene, cache)
        progress = session.wait(3000.0)
        seconds = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
        if progress.status is not self._core.Status.DONE or progress.non_finite_samples or progress.non_finite_weights:
            raise RuntimeError(f"{progress.status.name}: {progress.error or 'numbers that are not finite'}")
        picture = sum(session.read(name).astype(np.float64) for name in self._passes)
        return Rendered(picture, seconds, dict(progress.stage_seconds), progress.memory_bytes, progress.mean_samples)

    def frame(self, number: int, seed: int, **settings: Any) -> Rendered:
        """Frame `number` (2 or more) alone, in a session of its own that goes on with the history of those before it.
        Its times are means over all of them, without building."""
        cache = self._core.RenderCache()
        settings["keep_history"] = True
        before = self.mean(number - 1, seed, cache, **settings)
        last = self.mean(1, seed, cache, **settings)
        stages = {stage: (seconds + last.stages[stage]) / number for stage, seconds in before.stages.items()}
        return Rendered(last.picture, sum(stages.values()), stages, last.memory_bytes)

    def paths_of_frame(self, number: int, seed: int) -> NDArray:
        """What path tracing makes of the paths of a frame (2 or more): sessions of one seed repeat each other's."""
        before, after = (self.mean(count, seed).picture for count in (number - 1, number))
        return number * after - (number - 1) * before

    def path_traced_frame(self, seed: int, samples: int = 16) -> Rendered:
        """One sample for each pixel. Its time is the mean of more of them, without building."""
        one, more = (self.mean(count, seed) for count in (1, 1 + samples))
        return Rendered(one.picture, (more.seconds - one.seconds) / samples, {}, one.memory_bytes)

    def reference(self, samples: int, seed: int = 1_000_001) -> Reference:
        halves = (self.mean(samples // 2, seed + k).picture for k in (0, 1))
        return Reference(*halves)
