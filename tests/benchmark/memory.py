"""Memory of the core in bytes for each triangle, instance, light and pixel, as it counts itself and as the system does.

    python tests/benchmark/memory.py

Each row is the slope between a small and a large scene, each rendered in a process of its own.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.support import core_scenes

LIMIT_SECONDS = 300
ENDLESS = 2**20  # samples
SIZES = {  # how many of each, in the small and in the large scene
    "triangle": (500_000, 2_000_000),
    "instance": (100_000, 500_000),
    "point light": (50_000, 250_000),
    "pixel, all passes": (100_000, 1_000_000),
}
PASSES = ["Direct", "Indirect", "Emission", "Environment", "Depth", "Normal", "Position"]


def grid(scene: core_scenes.SceneDescription, triangles: int) -> int:
    """Adds a square of quads with smooth normals and a UV map, in waves; returns its handle."""
    side = max(1, round((triangles / 2) ** 0.5))
    x, y = np.meshgrid(*2 * [np.linspace(-1.0, 1.0, side + 1, dtype=np.float32)])
    points = np.stack([x, y, 0.01 * np.sin(40 * x) * np.sin(40 * y)], -1).reshape(-1, 3).astype(np.float32)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    corners = np.stack([first, first + 1, first + side + 2, first + side + 1], 1).ravel().astype(np.int32)
    return scene.builder.add_mesh(
        "grid",
        points,
        corners,
        np.arange(0, len(corners) + 1, 4, dtype=np.int32),
        normals=np.broadcast_to(np.float32([0, 0, 1]), points.shape).copy(),
        normals_domain="POINT",
        attributes=[("UVMap", "CORNER", np.ascontiguousarray(points[corners, :2]))],
    )


def build(kind: str, count: int) -> core_scenes.SceneDescription:
    scene = core_scenes.SceneDescription()
    materials = scene.builder.add_material_set([scene.builder.add_material(core_scenes.principled())], "grid")
    mesh = grid(scene, count if kind == "triangle" else 2)
    places = np.tile(np.eye(4, dtype=np.float32), (count if kind == "instance" else 1, 1, 1))
    places[:, 2, 3] = np.linspace(0.0, -1.0, len(places))
    handles = [np.full(len(places), h, np.int32) for h in (mesh, materials, scene.builder.add_object_name("grid"))]
    scene.builder.add_instances(*handles, places, np.full(len(places), 31, np.uint8))
    for k in range(count if kind == "point light" else 1):
        scene.builder.add_point_light(f"light {k}", [k % 500, k // 500, 3.0], 0.1, [1.0, 1.0, 1.0])
    scene.set_camera((0, 0, 5), (0, 0, 0))
    return scene


def resident_bytes() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096


def measure(kind: str, count: int) -> dict[str, int]:
    """Bytes while it renders: `mesh` by the statistics of the builder, `core` by the session, `system` resident."""
    import cistern_core as core

    before = resident_bytes()
    description = build(kind, count)
    scene = description.snapshot()
    height = count // 1000 if kind.startswith("pixel") else 4
    passes = PASSES if kind.startswith("pixel") else []
    session = core.Session(core.Settings(width=1000, height=height, samples=ENDLESS, passes=passes))
    session.start(scene)
    progress = session.wait(0.1)
    while progress.frames_done < 1:
        assert progress.status is core.Status.RUNNING, progress.error
        progress = session.wait(0.1)
    resident = resident_bytes() - before
    session.cancel()
    mesh = description.builder.mesh_statistics(0)["memory_bytes"]
    return {"mesh": mesh, "core": progress.memory_bytes, "system": resident}


def main() -> None:
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(measure(sys.argv[2], int(sys.argv[3]))))
        return
    print("| bytes for each | mesh alone | by the core's count | by the system's |")
    print("|---|---|---|---|")
    for kind, counts in SIZES.items():
        command = [sys.executable, __file__, "--measure", kind]
        runs = [
            json.loads(subprocess.check_output([*command, str(count)], text=True, timeout=LIMIT_SECONDS))
            for count in counts
        ]
        slopes = {key: (runs[1][key] - runs[0][key]) / (counts[1] - counts[0]) for key in runs[0]}
        print(f"| {kind} | {slopes['mesh']:.0f} | {slopes['core']:.0f} | {slopes['system']:.0f} |", flush=True)


if __name__ == "__main__":
    main()
