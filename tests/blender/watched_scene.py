"""A scene of a few objects and lamps that is synced live, for tests of what an edit exports."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import bpy
import fake_core
from bpy.app.handlers import persistent
from replay_builder import ReplayBuilder
from small_objects import link, triangle

from addon.sync.changes import EVERYTHING, read_changes
from addon.sync.live import Exported, LiveSync

CORE = SimpleNamespace(**vars(fake_core.CORE) | {"SceneBuilder": ReplayBuilder})


class Watched:
    """A live scene that is synced after every evaluation, as Blender calls `view_update`."""

    def __init__(self) -> None:
        self.live = LiveSync(CORE)
        self.exported: list[Exported] = []
        self.warnings: list[str] = []

    def sync(self, depsgraph: bpy.types.Depsgraph) -> None:
        self.warnings = self.live.sync(depsgraph, read_changes(depsgraph)).warnings
        self.exported.append(self.live.exported)

    def after(self, edit: Callable[[], Any]) -> Exported:
        """All that was exported for an edit."""
        self.exported.clear()
        edit()
        bpy.context.view_layer.update()
        total = Exported()
        for one in self.exported:
            total.materials += one.materials
            total.meshes += one.meshes
            total.lamps += one.lamps
            total.instances |= one.instances
            total.environment |= one.environment
        return total

    def expect_truth(self) -> None:
        """What the builder holds, and what is warned of, is what an export from nothing gives."""
        fresh = LiveSync(CORE)
        try:
            report = fresh.sync(bpy.context.evaluated_depsgraph_get(), EVERYTHING)
            assert sorted(self.warnings) == sorted(report.warnings)
            assert self.live.builder.described() == fresh.builder.described()
        finally:
            fresh.close()


@contextmanager
def watching() -> Iterator[Watched]:
    """A scene of a few objects and lamps that is being watched."""
    build_scene()
    watched = Watched()

    @persistent
    def update(_scene, depsgraph) -> None:
        watched.sync(depsgraph)

    watched.live.sync(bpy.context.evaluated_depsgraph_get(), EVERYTHING)
    bpy.app.handlers.depsgraph_update_post.append(update)
    bpy.app.handlers.frame_change_post.append(update)
    try:
        yield watched
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(update)
        bpy.app.handlers.frame_change_post.remove(update)
        watched.live.close()


def build_scene() -> None:
    """Two objects that share a mesh, one of its own, an instanced collection, and lamps."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("Day")
    shared = triangle("Shared")
    for index, mesh in enumerate((shared, shared, triangle("Own"))):
        obj = link(f"Object {index}", mesh, location=(2.0 * index, 0.0, 0.0))
        material = bpy.data.materials.new(f"Material {index}")
        material.use_nodes = True
        obj.material_slots or obj.data.materials.append(None)
        obj.material_slots[0].link = "OBJECT"
        obj.material_slots[0].material = material
    collection = bpy.data.collections.new("Set")
    link("Part", triangle("Part"), collection)
    link("Inner Lamp", bpy.data.lights.new("Inner Lamp", "SPOT"), collection)
    for x in (3, 5):
        empty = link(f"Empty {x}", None, location=(x, 1, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
    for kind in ("POINT", "SUN", "AREA"):
        link(f"{kind} Lamp", bpy.data.lights.new(f"{kind} Lamp", kind), location=(0, 0, 4))
    bpy.context.view_layer.update()


def base_color(material: bpy.types.Material):
    return next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled").inputs["Base Color"]
