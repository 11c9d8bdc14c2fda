"""Where things were a frame before, and will be a frame later: what the Vector pass compares."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import SyncReport
from .camera import camera_arguments
from .changes import data_uid, original_uid
from .drift import points_after
from .instances import read_places
from .meshes import points_of, whole_mesh
from .placements import Surface, identity_of

if TYPE_CHECKING:
    from cistern_core import SceneBuilder


@dataclass(frozen=True)
class MotionStep:
    """One frame: the camera, and matrices (items, 4, 4), column by column, with numbers that stand for all items."""

    camera: dict[str, Any]
    matrices: NDArray[np.float32]
    identities: NDArray[np.uint64]
    shapes: dict[int, NDArray[np.float32]]
    """Points (n, 3) of meshes that modifiers or shape keys bend, by the session ids of their objects."""

    def matrices_of(self, matrices: NDArray[np.float32], identities: NDArray[np.uint64]) -> NDArray[np.float32]:
        """Of the items that have these matrices now. What was not there rests."""
        if np.array_equal(identities, self.identities):
            return self.matrices
        if not len(self.identities):
            return matrices
        known, first = np.unique(self.identities, return_index=True)
        found = np.searchsorted(known, identities).clip(0, len(known) - 1)
        is_known = known[found] == identities
        return np.where(is_known[:, None, None], self.matrices[first[found]], matrices)


def read_steps(
    depsgraph: bpy.types.Depsgraph,
    camera: bpy.types.Object | None,
    go_to_frame: Callable[[int, float], None],
    render: bpy.types.RenderSettings | None = None,
) -> tuple[MotionStep, MotionStep]:
    """The frame before and the frame after; the dependency graph is then back where it was. `render`: as of
    `camera_arguments`."""
    scene = depsgraph.scene
    frame, subframe = scene.frame_current, scene.frame_subframe
    steps = []
    try:
        for offset in (-1, 1):
            go_to_frame(frame + offset, subframe)
            steps.append(_read(depsgraph, camera, render))
    finally:
        go_to_frame(frame, subframe)
    return steps[0], steps[1]


def _read(
    depsgraph: bpy.types.Depsgraph, camera: bpy.types.Object | None, render: bpy.types.RenderSettings | None
) -> MotionStep:
    scene = depsgraph.scene_eval
    eye = camera if camera is not None else scene.camera
    evaluated = eye.evaluated_get(depsgraph) if eye is not None else None
    matrices, _ = read_places(depsgraph)
    shapes = {}
    for obj in _meshes(depsgraph):
        if _is_bent(obj, depsgraph):
            with whole_mesh(obj, obj.data) as mesh:
                shapes[original_uid(obj)] = points_of(mesh)
    arguments = camera_arguments(scene, evaluated, SyncReport(), render)
    return MotionStep(arguments, matrices, _identities(depsgraph), shapes)


def _meshes(depsgraph: bpy.types.Depsgraph) -> Iterator[bpy.types.Object]:
    """Evaluated objects that are meshes; where there are collections that only instances show, theirs too."""
    for item in depsgraph.ids:
        if isinstance(item, bpy.types.Object) and isinstance(item.data, bpy.types.Mesh):
            yield item


def _is_bent(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
    return obj.is_deform_modified(depsgraph.scene_eval, "RENDER" if depsgraph.mode == "RENDER" else "PREVIEW")


def _identities(depsgraph: bpy.types.Depsgraph) -> NDArray[np.uint64]:
    """Of all items: by what they show, what places it and which of its instances they are."""
    read = attrgetter("instance_object", "parent", "random_id")
    numbers = []
    for item in depsgraph.object_instances:
        shown, parent, random_id = read(item)
        # The `object` of instances leaks (`InstanceSync._place`).
        shown_uid = original_uid(item.object if shown is None else shown)
        numbers.append(identity_of(shown_uid, original_uid(parent), random_id))
    return np.array(numbers, np.uint64)


def place_steps(
    builder: SceneBuilder,
    steps: Iterable[MotionStep],
    depsgraph: bpy.types.Depsgraph,
    items: NDArray[np.intp],
    surfaces: Iterable[Surface],
) -> None:
    """Give the builder, which has the surfaces of these items, where they were; its camera is then that of a step."""
    matrices, _ = read_places(depsgraph)
    identities = _identities(depsgraph)
    handles = {(surface.key[0], surface.key[2]): surface.mesh for surface in surfaces}
    shown = [(obj, handles.get((original_uid(obj), data_uid(obj.data)))) for obj in _meshes(depsgraph)]
    shown = [(obj, handle) for obj, handle in shown if handle is not None]
    render = depsgraph.scene_eval.render
    seconds = render.fps_base / render.fps
    for number, (step, sign) in enumerate(zip(steps, (-1.0, 1.0), strict=True)):
        columns = step.matrices_of(matrices, identities)[items]
        shapes = {}
        for obj, handle in shown:
            shape = step.shapes.get(original_uid(obj))
            if shape is None:
                with whole_mesh(obj, obj.data) as mesh:
                    shape = points_after(mesh, sign * seconds)
            if shape is not None and len(shape) == builder.mesh_statistics(handle)["points"]:
                shapes[handle] = shape
        builder.set_camera(**step.camera)
        builder.set_motion_step(number, np.ascontiguousarray(columns.transpose(0, 2, 1)), shapes)
