"""Meshes that are subdivided as finely as a picture shows them: the settings of their last modifier, and for whom."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from . import SyncReport, versions
from .camera import camera_arguments, picture_size
from .nodes.value_names import RENDER_COLOR

if TYPE_CHECKING:
    from cistern_core import SceneBuilder

_SCHEMES = {"CATMULL_CLARK": "CATMULL_CLARK", "SIMPLE": "LINEAR"}
_UV_SMOOTHING = {
    "NONE": "NONE",
    "PRESERVE_CORNERS": "CORNERS",
    "PRESERVE_CORNERS_AND_JUNCTIONS": "CORNERS_AND_JUNCTIONS",
    "PRESERVE_CORNERS_JUNCTIONS_AND_CONCAVE": "CORNERS_JUNCTIONS_AND_CONCAVE",
    "PRESERVE_BOUNDARIES": "BOUNDARIES",
    "SMOOTH_ALL": "ALL",
}
_SHARPEST = 10.0  # of OpenSubdiv


@dataclass(frozen=True)
class Subdivision:
    """What `SceneBuilder.add_mesh` has to know beside the mesh."""

    scheme: str
    uv_smoothing: str
    keeps_corners: bool
    uses_creases: bool
    pixels: float
    length: float

    def arguments(self, mesh: bpy.types.Mesh) -> dict[str, Any]:
        """Members of its argument `subdivision`. UV maps are the mesh's first attributes."""
        return {
            "scheme": self.scheme,
            "uv_smoothing": self.uv_smoothing,
            "keeps_corners": self.keeps_corners,
            "uv_maps": len(mesh.uv_layers),
            "encoded_colors": _byte_colors_of_corners(mesh),
            "pixels": self.pixels,
            "length": self.length,
            **(_creases(mesh) if self.uses_creases else {}),
        }


def subdivision_of(obj: bpy.types.Object, scene: bpy.types.Scene, is_render: bool) -> Subdivision | None:
    """Of an evaluated object whose last modifier subdivides adaptively; None for others."""
    edges = versions.adaptive_edges(obj, scene)
    if edges is None:
        return None
    modifier = obj.modifiers[-1]
    if not (modifier.show_render if is_render else modifier.show_viewport):
        return None
    return Subdivision(
        _SCHEMES[modifier.subdivision_type],
        _UV_SMOOTHING.get(modifier.uv_smooth, "BOUNDARIES"),
        modifier.boundary_smooth == "PRESERVE_CORNERS",
        modifier.use_creases,
        *edges,
    )


@contextmanager
def final_mesh(obj: bpy.types.Object, subdivision: Subdivision | None) -> Iterator[bpy.types.Mesh]:
    """The mesh that an evaluated object shows, or the one to be subdivided: from Blender 4.5 on as the modifier finds
    it, before as its levels leave it; as in Cycles."""
    if subdivision is None or not hasattr(obj, "evaluated_geometry"):
        yield obj.data
        return
    geometry = obj.evaluated_geometry()  # which owns the mesh
    base = geometry.mesh_base
    yield obj.data if base is None else base


def _byte_colors_of_corners(mesh: bpy.types.Mesh) -> list[str]:
    """Names of those that Cycles blends as they are encoded."""
    layers = mesh.color_attributes
    found = [layer.name for layer in layers if layer.data_type == "BYTE_COLOR" and layer.domain == "CORNER"]
    render = layers.render_color_index
    is_render = 0 <= render < len(layers) and layers[render].name in found
    return [*found, RENDER_COLOR] if is_render else found


def _creases(mesh: bpy.types.Mesh) -> dict[str, Any]:
    found: dict[str, Any] = {}
    of_edges = _sharpness(mesh, "crease_edge", len(mesh.edges))
    if of_edges is not None:
        ends = np.empty((len(mesh.edges), 2), np.int32)
        mesh.edges.foreach_get("vertices", ends.ravel())
        found["creases"], found["crease_sharpness"] = ends[of_edges > 0.0], of_edges[of_edges > 0.0]
    of_points = _sharpness(mesh, "crease_vert", len(mesh.vertices))
    if of_points is not None:
        sharp = np.flatnonzero(of_points > 0.0).astype(np.int32)
        found["sharp_vertices"], found["vertex_sharpness"] = sharp, of_points[sharp]
    return found


def _sharpness(mesh: bpy.types.Mesh, name: str, count: int) -> np.ndarray | None:
    attribute = mesh.attributes.get(name)
    if attribute is None or len(attribute.data) != count or attribute.data_type != "FLOAT":
        return None
    creases = np.empty(count, np.float32)
    attribute.data.foreach_get("value", creases)
    return np.clip(creases, 0.0, 1.0) * np.float32(_SHARPEST)


def dice_for_render(
    builder: SceneBuilder,
    depsgraph: bpy.types.Depsgraph,
    camera_now: dict[str, Any],
    report: SyncReport,
    render: bpy.types.RenderSettings | None = None,
) -> None:
    """Tell a builder whom a final render subdivides for: the dicing camera, or the one whose arguments these are.
    `render`: as of `camera_arguments`."""
    scene = depsgraph.scene_eval
    camera = versions.cycles_setting(scene, "dicing_camera", None)
    if camera is not None and camera.type == "CAMERA":
        builder.set_camera(**camera_arguments(scene, camera.evaluated_get(depsgraph), report, render))
    width, height = picture_size(scene.render if render is None else render)
    builder.set_dicing(f"Scene '{scene.name}'", width, height, **dicing_rates(scene, is_render=True))
    builder.set_camera(**camera_now)


def dicing_rates(scene: bpy.types.Scene, is_render: bool) -> dict[str, Any]:
    """Arguments of `SceneBuilder.set_dicing` that are settings of Cycles."""
    rate = ("dicing_rate", 1.0) if is_render else ("preview_dicing_rate", 8.0)
    return {
        "rate": versions.cycles_setting(scene, *rate),
        "offscreen_scale": versions.cycles_setting(scene, "offscreen_dicing_scale", 4.0),
        "most_levels": versions.cycles_setting(scene, "max_subdivisions", 12),
    }
