"""Seconds that the export adds to Blender's own evaluation, for 2 M triangles and for 100,000 instances.

    python tests/benchmark/export_speed.py [--fake]

Prints one line of JSON: the first and the best of several runs; CPU seconds count all threads. The first run of a mesh
includes the normals that Blender computes on demand. `--fake` leaves the native core out: Python's share alone.
"""

import atexit
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "blender")]

from tests.support.blender_folder import use_own_folder  # noqa: E402

use_own_folder()

import bpy  # noqa: E402

RUNS = 3
TRIANGLES_SIDE = 1000  # quads along a side: 2 triangles each
INSTANCES_SIDE = 317


class ProbeEngine(bpy.types.RenderEngine):
    """Times a function of the dependency graph of a final render."""

    bl_idname = "CISTERN_EXPORT_SPEED"
    bl_label = "Export speed"
    run: Callable[[bpy.types.Depsgraph], dict[str, float]] | None = None
    runs: tuple[dict[str, float], ...] = ()

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        ProbeEngine.runs = tuple(ProbeEngine.run(depsgraph) for _ in range(RUNS))


def empty_file() -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine = camera, ProbeEngine.bl_idname
    scene.render.resolution_x = scene.render.resolution_y = 4


def two_million_triangles() -> None:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=TRIANGLES_SIDE, y_subdivisions=TRIANGLES_SIDE)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.polygons[0].use_smooth = False  # corner normals: the dearest kind


def hundred_thousand_instances() -> None:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=INSTANCES_SIDE - 1, y_subdivisions=INSTANCES_SIDE - 1, size=100)
    tree = bpy.data.node_groups.new("Cubes", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    place, cube = tree.nodes.new("GeometryNodeInstanceOnPoints"), tree.nodes.new("GeometryNodeMeshCube")
    tree.links.new(start.outputs[0], place.inputs["Points"])
    tree.links.new(cube.outputs[0], place.inputs["Instance"])
    tree.links.new(place.outputs[0], end.inputs[0])
    bpy.context.object.modifiers.new("Cubes", "NODES").node_group = tree


def timed(core) -> Callable[[bpy.types.Depsgraph], dict[str, float]]:
    from addon.sync.scene import sync_scene

    def run(depsgraph: bpy.types.Depsgraph) -> dict[str, float]:
        builder = core.SceneBuilder()
        start, cpu_start = time.perf_counter(), time.process_time()
        sync_scene(depsgraph, builder, core=core)
        return {
            "seconds": round(time.perf_counter() - start, 3),
            "cpu_seconds": round(time.process_time() - cpu_start, 3),
        }

    return run


def main() -> None:
    if "--fake" in sys.argv:
        import fake_core

        core = fake_core.CORE
    else:
        import cistern_core as core
    bpy.utils.register_class(ProbeEngine)
    atexit.register(bpy.utils.unregister_class, ProbeEngine)
    ProbeEngine.run = staticmethod(timed(core))
    results: dict[str, object] = {"blender": bpy.app.version_string, "core": getattr(core, "__version__", "none")}
    for build in (two_million_triangles, hundred_thousand_instances):
        empty_file()
        build()
        ProbeEngine.runs = ()
        bpy.ops.render.render()
        if not ProbeEngine.runs:
            sys.exit(f"{build.__name__}: the export failed, see above")
        results[build.__name__] = {
            "first": ProbeEngine.runs[0],
            "best": min(ProbeEngine.runs, key=lambda run: run["cpu_seconds"]),
        }
    print(json.dumps(results))


if __name__ == "__main__":
    main()
