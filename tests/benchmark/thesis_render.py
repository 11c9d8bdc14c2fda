"""One measurement of the thesis's experiment in a process of its own: builds a scene, renders it, saves the numbers.

    python -m tests.benchmark.thesis_render SCENE METHOD WIDTH FRAMES LONG SEED FILE.npz

METHOD `reference` renders LONG samples with next-event estimation and the light tree, in two halves, and the surfaces.
Any other renders sessions of 1, 2 ... FRAMES frames, of which the differences are the frames, and one of LONG frames
(0: none).
"""

from __future__ import annotations

import resource
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "examples")]

from tests.support.blender_folder import use_own_folder  # noqa: E402

use_own_folder()

import bpy  # noqa: E402

ASPECT = 9 / 16
LIMIT_SECONDS = 3000.0
SAME_POINT = 0.01  # filter width in pixels: all frames see the same points, as the thesis's renderer does

# What the thesis gives both its systems [Stefanescu 2025, §4.1]. Lights are chosen uniformly throughout.
THESIS = {
    "light_candidates": 8,
    "temporal_reuse": True,
    "confidence_cap": 10,
    "spatial_neighbours": 8,
    "spatial_radius": 5.0,
    "spatial_rounds": 1,
}
PRINTED = THESIS | {"bias": "FAST", "visibility_reuse": True}  # Alg. 3 and 4
UNBIASED = THESIS | {"bias": "UNBIASED"}  # whose weights would need many rays to know of visibility
METHODS: dict[str, dict[str, Any]] = {
    "uniform": {"direct": "RIS", "light_candidates": 1},
    "restir-printed": {"direct": "RESTIR"} | PRINTED,
    "cache-printed": {"direct": "RESTIR_CACHE"} | PRINTED,
    "restir": {"direct": "RESTIR"} | UNBIASED,
    "cache": {"direct": "RESTIR_CACHE"} | UNBIASED,
}


def build(scene_name: str) -> tuple[NDArray, NDArray]:
    """Makes the scene the open one; returns the corners of its box."""
    import city_grid
    import monkeys
    import scene_tools

    scene = scene_tools.empty_scene()
    {"city": city_grid, "monkeys": monkeys}[scene_name].build(scene)
    boxes = [
        world_box(instance.object.data, np.array(instance.matrix_world))
        for instance in bpy.context.evaluated_depsgraph_get().object_instances
        if instance.object.type == "MESH"
    ]
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


def world_box(mesh: bpy.types.Mesh, to_world: NDArray) -> tuple[NDArray, NDArray]:
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    placed = points.reshape(-1, 3) @ to_world[:3, :3].T + to_world[:3, 3]
    return placed.min(axis=0), placed.max(axis=0)


def export(width: int) -> Any:  # noqa: ANN401
    """The open scene as a snapshot of the core."""
    import cistern_core as core

    from addon.sync.scene import sync_scene

    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, round(width * ASPECT), 100
    builder = core.SceneBuilder()
    sync_scene(bpy.context.evaluated_depsgraph_get(), builder, core=core)
    return builder.snapshot()


def cpu_seconds() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


class Renderer:
    """Sessions of one scene in direct light alone."""

    def __init__(self, scene: Any, width: int, settings: dict[str, Any]) -> None:  # noqa: ANN401
        import cistern_core as core

        self.core, self.scene = core, scene
        self.settings = {
            "width": width,
            "height": round(width * ASPECT),
            "max_bounces": 0,
            "pixel_filter": core.PixelFilter.GAUSSIAN,
            "filter_width": SAME_POINT,
            "light_sampling": core.LightSampling.UNIFORM,
        } | settings
        self.cpu_seconds = 0.0  # of the last session
        self.core_bytes = 0

    def render(self, samples: int, seed: int, passes: tuple[str, ...] = ("Direct",)) -> dict[str, NDArray]:
        """Pictures with row 0 at the bottom. Raises when the render fails or meets numbers that are not finite."""
        members = self.settings | {"samples": samples, "seed": seed, "passes": list(passes)}
        session = self.core.Session(self.core.Settings(**members))
        before = cpu_seconds()
        session.start(self.scene)
        progress = session.wait(LIMIT_SECONDS)
        self.cpu_seconds = cpu_seconds() - before
        if progress.status is not self.core.Status.DONE:
            raise RuntimeError(f"{progress.status.name}: {progress.error}")
        if progress.non_finite_samples or progress.non_finite_weights:
            raise RuntimeError(
                f"{progress.non_finite_samples} samples, {progress.non_finite_weights} weights not finite"
            )
        self.core_bytes = progress.memory_bytes
        return {name: session.read(name) for name in passes}


def render_reference(scene: Any, width: int, samples: int, seed: int) -> dict[str, NDArray]:  # noqa: ANN401
    import cistern_core as core

    renderer = Renderer(scene, width, {"direct": "NEE", "light_sampling": core.LightSampling.TREE})
    first = renderer.render(samples // 2, seed, ("Direct", "Emission", "Position", "Normal"))
    second = renderer.render(samples // 2, seed + 1)
    halves = np.stack([first["Direct"], second["Direct"]])
    return {
        "halves": halves,
        "emission": first["Emission"],
        "positions": first["Position"],
        "normals": first["Normal"],
    }


def render_frames(
    scene: Any,  # noqa: ANN401
    width: int,
    method: str,
    frames: int,
    long: int,
    seed: int,
) -> dict[str, Any]:
    """Frame k of a session is k mean_k - (k - 1) mean_(k - 1): sessions of one seed repeat each other's frames."""
    renderer = Renderer(scene, width, METHODS[method])
    sums, seconds = [np.zeros(1)], []
    for count in range(1, frames + 1):
        sums.append(count * renderer.render(count, seed)["Direct"].astype(np.float64))
        seconds.append(renderer.cpu_seconds)
    found = {
        "frames": np.diff(np.stack([np.zeros_like(sums[1]), *sums[1:]]), axis=0).astype(np.float32),
        "cpu_seconds": np.array(seconds),
        "core_bytes": renderer.core_bytes,
        "peak_bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    }
    if long > 0:
        found["mean"] = renderer.render(long, seed)["Direct"]
    return found


def main() -> None:
    scene_name, method, *numbers, path = sys.argv[1:]
    width, frames, long, seed = map(int, numbers)
    low, high = build(scene_name)
    scene = export(width)
    if method == "reference":
        found = render_reference(scene, width, long, seed)
    else:
        found = render_frames(scene, width, method, frames, long, seed)
    np.savez(path, low=low, high=high, **found)


if __name__ == "__main__":
    main()
