"""Builds the demo scene and saves it as a .blend file with its images packed.

.venv/bin/python examples/make_demo_scene.py [FILE.blend]
"""

import atexit
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import addon
from cistern_hall import hall
from scene_tools import save

SAMPLES = 32  # per pixel


def triangles(scene: bpy.types.Scene) -> tuple[int, int]:
    """Triangles of the distinct meshes, and of all their instances, as rendered before modifiers."""
    counts = {mesh: sum(len(polygon.vertices) - 2 for polygon in mesh.polygons) for mesh in bpy.data.meshes}
    placed = 0
    for thing in scene.objects:
        inside = thing.instance_collection.objects if thing.instance_collection else [thing]
        placed += sum(counts[part.data] for part in inside if part.type == "MESH")
    return sum(counts.values()), placed


def make(path: Path) -> None:
    """Replaces what is open in Blender by the demo scene and saves it. The add-on must be registered."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True, load_ui=False)
    scene = bpy.context.scene
    hall.build(scene)
    scene.render.engine = "CISTERN"
    scene.cistern.samples, scene.cistern.use_denoising = SAMPLES, True
    distinct, placed = triangles(scene)
    print(f"Demo scene: {distinct:,} triangles, {placed:,} with all instances, {len(bpy.data.lights)} lamps")
    save(path)


def ensure(path: Path) -> Path:
    """Makes the file unless it is there and newer than the scripts that make it."""
    sources = [Path(__file__), *Path(hall.__file__).parent.glob("*.py")]
    if not path.is_file() or path.stat().st_mtime < max(source.stat().st_mtime for source in sources):
        make(path)
    return path


if __name__ == "__main__":
    addon.register()
    atexit.register(addon.unregister)
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/cistern_demo.blend"))
