"""Baking: what the surface of an object looks like, rendered into images of its UV map, or into its colours.

Blender says which point of which triangle each pixel shows; the core then looks at these points from right above.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import settings, unshared
from .bake_types import BakeType, find_type
from .progress import Span
from .session_render import Moments, RenderFailedError, SessionRender
from .sync import versions
from .sync.meshes import whole_mesh

if TYPE_CHECKING:
    from types import ModuleType

    from . import report
    from .engine import CisternEngine
    from .sync.scene import SceneSync


@dataclass(frozen=True)
class BakedPixels:
    """Where the pixels of an image lie on an object's mesh, rows from the bottom up; as `SceneBuilder.set_sheet` has
    it."""

    polygons: NDArray[np.int32]
    points: NDArray[np.float32]
    steps_x: NDArray[np.float32]
    steps_y: NDArray[np.float32]

    @property
    def shows_anything(self) -> bool:
        return bool((self.polygons >= 0).any())


def read_pixels(layer: bpy.types.RenderLayer, mesh: bpy.types.Mesh) -> BakedPixels:
    """From the passes that Blender fills before an engine bakes; `mesh`: the evaluated one of the object."""
    primitives, differentials = (_pass_values(layer, name) for name in ("BakePrimitive", "BakeDifferential"))
    triangles, weights = _triangles_and_weights(primitives)
    corners, polygons = _blender_triangles(mesh)
    has_place = np.isfinite(corners).all(axis=(1, 2))
    shown = np.flatnonzero(triangles >= 0)
    shown = shown[has_place[triangles[shown]]]
    pixels = BakedPixels(
        np.full(len(triangles), -1, np.int32), *(np.zeros((len(triangles), 3), np.float32) for _ in range(3))
    )
    first, second, third = np.moveaxis(corners[triangles[shown]], 1, 0)
    along_u, along_v = first - third, second - third
    u, v = weights[shown].T[..., None]
    du_dx, du_dy, dv_dx, dv_dy = differentials[shown].T[..., None] / versions.baked_pixel_step()
    pixels.polygons[shown] = polygons[triangles[shown]]
    pixels.points[shown] = third + u * along_u + v * along_v
    pixels.steps_x[shown] = du_dx * along_u + dv_dx * along_v
    pixels.steps_y[shown] = du_dy * along_u + dv_dy * along_v
    return pixels


def _pass_values(layer: bpy.types.RenderLayer, name: str) -> NDArray[np.float32]:
    render_pass = layer.passes[name]
    values = np.empty((len(render_pass.rect), render_pass.channels), np.float32)
    render_pass.rect.foreach_get(values.ravel())
    return values


def _triangles_and_weights(primitives: NDArray[np.float32]) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """By pixel: a triangle, -1 for none of this object's, and weights of its first two corners. Before a pass of their
    own, seeds came first here."""
    bits = primitives.view(np.int32)
    return (bits[:, 1], primitives[:, 2:]) if primitives.shape[1] == 4 else (bits[:, 2], primitives[:, :2])


def _blender_triangles(mesh: bpy.types.Mesh) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Corners (n, 3, 3) and polygons of the triangles that Blender splits a mesh into."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    vertices, polygons = np.empty((count, 3), np.int32), np.empty(count, np.int32)
    positions = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.loop_triangles.foreach_get("vertices", vertices.ravel())
    mesh.loop_triangles.foreach_get("polygon_index", polygons)
    mesh.vertices.foreach_get("co", positions.ravel())
    return positions[vertices], polygons


@dataclass(frozen=True)
class ExportedObject:
    """What all images of an object's bake have in common."""

    scene: SceneSync
    instance: int
    cache: Any
    """A core's RenderCache."""


class BakeRender(SessionRender):
    """Renders one image of a bake."""

    def __init__(
        self, engine: CisternEngine, depsgraph: bpy.types.Depsgraph, core: ModuleType, figures: report.RenderReport
    ) -> None:
        super().__init__(engine, depsgraph, core, figures)
        self.sees_from_camera = depsgraph.scene_eval.render.bake.view_from == "ACTIVE_CAMERA"

    def run(self, obj: bpy.types.Object, identifier: str, pass_filter: int, size: tuple[int, int]) -> None:
        """Raises RenderFailedError, SyncError or the core's Error. Blender then makes the pixels black; those of a bake
        that is stopped are what there is."""
        from .sync import SyncStoppedError

        bake_type = find_type(identifier, pass_filter)
        if bake_type is None:
            raise RenderFailedError(f"Object '{obj.name}': there is no bake of type {identifier.title()}")
        # Blender finds the image that a result belongs to by the name of its layer.
        self.engine.baked_images += 1
        result = self.engine.begin_result(0, 0, *size, layer=f"Bake {self.engine.baked_images}")
        is_written = False
        try:
            layer = result.layers[0]
            item, mesh = self.shown_item(obj)
            with whole_mesh(obj.evaluated_get(self.depsgraph), mesh) as whole:
                pixels = read_pixels(layer, whole)
            if pixels.shows_anything:
                picture = self.picture(obj, item, bake_type, pixels, size)
                if self.figures.samples > 0:
                    write_combined(layer, picture)
                    is_written = True
        except SyncStoppedError:
            self.is_cancelled = True
        finally:
            self.engine.end_result(result, cancel=not is_written)

    def shown_item(self, obj: bpy.types.Object) -> tuple[int, bpy.types.Mesh]:
        """The item of the dependency graph that is the object itself, and its evaluated mesh. Of curves, texts and the
        like it is one that they instance."""
        for index, item in enumerate(self.depsgraph.object_instances):
            owner, shown = (item.parent, item.instance_object) if item.is_instance else (item.object, item.object)
            is_itself = owner.original == obj.original == shown.original
            if is_itself and isinstance(item.object.data, bpy.types.Mesh):
                return index, item.object.data
        raise RenderFailedError(f"Object '{obj.name}' has no surface in this render")

    def picture(
        self, obj: bpy.types.Object, item: int, bake_type: BakeType, pixels: BakedPixels, size: tuple[int, int]
    ) -> NDArray[np.float32]:
        """(height, width, 4)."""
        if self.engine.kept_bake is None:
            self.engine.kept_bake = self.export(obj, item)
        kept = self.engine.kept_bake
        kept.scene.builder.set_sheet(
            f"Object '{obj.name}'", *size, kept.instance, **vars(pixels), sees_from_eye=self.sees_from_camera
        )
        scene = kept.scene.builder.snapshot()
        arguments = settings.bake_settings(self.core, self.depsgraph, size, list(bake_type.core_passes))
        of_path_tracing = unshared.warning(scene, arguments)
        for warning in [*scene.warnings, *([of_path_tracing] if of_path_tracing else [])]:
            self.figures.warn_once(warning)
        read = self.rendered(arguments, Moments(scene, cache=kept.cache), Span(0.0, 1.0))
        is_covered = (pixels.polygons >= 0).reshape(size[1], size[0], 1)
        return np.concatenate([bake_type.color(read), is_covered * read("Combined")[..., 3:]], axis=2)

    def export(self, obj: bpy.types.Object, item: int) -> ExportedObject:
        """The scene, in which the object is this item of the dependency graph."""
        from .sync.scene import SceneSync

        self.engine.update_stats("", "Exporting the scene")
        start = time.perf_counter()
        if self.sees_from_camera and self.depsgraph.scene_eval.camera is None:
            raise RenderFailedError(f"Scene '{self.depsgraph.scene_eval.name}' has no camera to bake from")
        exported = SceneSync()
        synced = exported.sync(self.depsgraph, is_stopped=self.engine.is_stop_wanted, needs_camera=False)
        for warning in synced.warnings:
            self.figures.warn_once(warning)
        exported.finish()
        self.figures.sync_seconds = time.perf_counter() - start
        instances = np.flatnonzero(synced.surface_items == item)
        if len(instances) == 0:
            raise RenderFailedError(f"Object '{obj.name}' has no surface in this render")
        return ExportedObject(exported, int(instances[0]), self.core.RenderCache())  # its mesh; what follows is hair


def write_combined(layer: bpy.types.RenderLayer, picture: NDArray[np.float32]) -> None:
    target = layer.passes["Combined"]
    target.rect.foreach_set(np.ascontiguousarray(picture[..., : target.channels]).ravel())
