"""How long a session takes from its start to its first picture after an edit, with what earlier ones left and without.

  python -m tests.benchmark.edit_latency [--triangles 500000] [--lights 2000] [--emitters 30000] [--rounds 5]

A landscape of 25 meshes under point lamps and glowing triangles, in a picture of 32 x 18 pixels, so that preparing the
scene is all that counts. Medians over rounds, in milliseconds of CPU and wall-clock time: CPU time is that of the
process, and the one to compare on a busy machine.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator

import cistern_core as core
import numpy as np

from tests.support.core_scenes import DEFAULTS, emission, principled
from tests.support.edited_scenes import EditableScene

MESHES_PER_SIDE = 5


def add_hills(scene: EditableScene, column: int, row: int, cells: int, material: core.MaterialProgram) -> None:
    """A square of side 1 of 2 cells^2 triangles."""
    heights = np.random.default_rng(MESHES_PER_SIDE * row + column).random((cells + 1, cells + 1))
    x, y = np.meshgrid(np.linspace(0, 1, cells + 1), np.linspace(0, 1, cells + 1), indexing="ij")
    points = np.stack([x + column, y + row, 0.05 * heights], -1).reshape(-1, 3)
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    corners = np.stack([first, first + cells + 1, first + cells + 2, first + 1], -1).astype(np.int32).ravel()
    offsets = np.arange(0, len(corners) + 1, 4, dtype=np.int32)
    mesh = scene.builder.add_mesh("hills", points.astype(np.float32), corners, offsets)
    materials = scene.builder.add_material_set([scene.builder.add_material(material)], "hills")
    scene.instances.append((mesh, materials, np.eye(4)))


def landscape(triangles: int, lights: int, emitters: int) -> EditableScene:
    scene = EditableScene()
    cells = max(int(np.sqrt(triangles / 2)) // MESHES_PER_SIDE, 1)
    for k in range(MESHES_PER_SIDE**2):
        add_hills(scene, k % MESHES_PER_SIDE, k // MESHES_PER_SIDE, cells, principled((0.7, 0.7, 0.7)))
    rng = np.random.default_rng(1)
    for _ in range(lights):
        position = (*rng.uniform(0, MESHES_PER_SIDE, 2), rng.uniform(0.2, 1.0))
        scene.builder.add_point_light("lamp", position, 0.02, tuple(rng.uniform(0.01, 0.1, 3)))
    if emitters:
        add_hills(scene, 2, 2, max(int(np.sqrt(emitters / 2)), 1), emission((1.0, 1.0, 1.0)))
    scene.set_camera((2.5, -3.0, 3.0), (2.5, 2.5, 0.0))
    return scene


def edits(scene: EditableScene, step: int) -> Iterator[tuple[str, core.Scene]]:
    yield "nothing", scene.snapshot()
    scene.set_camera((2.5 + 0.1 * step, -3.0, 3.0), (2.5, 2.5, 0.0))
    yield "camera", scene.snapshot()
    scene.builder.add_point_light("lamp", (2.0, 2.0, 1.0 + 0.1 * step), 0.02, (1.0, 0.5, 1.0), replace=0)
    yield "light", scene.snapshot()
    scene.move(3, (0.0, 0.0, 0.1 * step))
    yield "object", scene.snapshot()


def milliseconds(scene: core.Scene, cache: core.RenderCache | None, keep_instances: bool) -> tuple[float, float]:
    """CPU and wall-clock time of a session of one frame."""
    settings = dict(width=32, height=18, samples=1, max_bounces=1, direct="RESTIR", keep_history=True)
    session = core.Session(core.Settings(**DEFAULTS | settings, keep_instances=keep_instances))
    cpu, wall = time.process_time(), time.perf_counter()
    session.start(scene, cache)
    progress = session.wait(600.0)
    if progress.status is not core.Status.DONE:
        raise RuntimeError(progress.error)
    return 1e3 * (time.process_time() - cpu), 1e3 * (time.perf_counter() - wall)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=int, default=500_000)
    parser.add_argument("--lights", type=int, default=2_000)
    parser.add_argument("--emitters", type=int, default=30_000)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    scene = landscape(arguments.triangles, arguments.lights, arguments.emitters)
    found: dict[tuple[str, bool, bool], list[tuple[float, float]]] = {}
    caches = {keep_instances: core.RenderCache() for keep_instances in (False, True)}
    for cache in caches.items():
        milliseconds(scene.snapshot(), cache[1], cache[0])
    for step in range(1, arguments.rounds + 1):
        for edit, snapshot in edits(scene, step):
            for keep_instances, cache in caches.items():
                for with_cache in (True, False):
                    times = milliseconds(snapshot, cache if with_cache else None, keep_instances)
                    found.setdefault((edit, keep_instances, with_cache), []).append(times)
    print("| edit | keep_instances | cache | CPU ms | wall ms |\n|---|---|---|---|---|")
    for (edit, keep_instances, with_cache), times in found.items():
        cpu, wall = np.median(times, axis=0)
        print(f"| {edit} | {keep_instances} | {'kept' if with_cache else 'none'} | {cpu:.0f} | {wall:.0f} |")


if __name__ == "__main__":
    main()
