"""Where things were a frame before, and will be a frame later: what the Vector pass compares."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import SyncReport
from .camera import camera_arguments
from .changes import original_uid
from .instances import read_places
from .placements import identity_of

if TYPE_CHECKING:
    from cistern_core import SceneBuilder


@dataclass(frozen=True)
class MotionStep:
    """One frame: the camera, and matrices (items, 4, 4), column by column, with numbers that stand for all items."""

    camera: dict[str, Any]
    matrices: NDArray[np.float32]
    identities: NDArray[np.uint64]

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
    depsgraph: bpy.types.Depsgraph, camera: bpy.types.Object | None, go_to_frame: Callable[[int, float], None]
) -> tuple[MotionStep, MotionStep]:
    """The frame before and the frame after; the dependency graph is then back where it was."""
    scene = depsgraph.scene
    frame, subframe = scene.frame_current, scene.frame_subframe
    steps = []
    try:
        for offset in (-1, 1):
            go_to_frame(frame + offset, subframe)
            steps.append(_read(depsgraph, camera))
    finally:
        go_to_frame(frame, subframe)
    return steps[0], steps[1]


def _read(depsgraph: bpy.types.Depsgraph, camera: bpy.types.Object | None) -> MotionStep:
    scene = depsgraph.scene_eval
    eye = camera if camera is not None else scene.camera
    evaluated = eye.evaluated_get(depsgraph) if eye is not None else None
    matrices, _ = read_places(depsgraph)
    return MotionStep(camera_arguments(scene, evaluated, SyncReport()), matrices, _identities(depsgraph))


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
    builder: SceneBuilder, steps: Iterable[MotionStep], depsgraph: bpy.types.Depsgraph, items: NDArray[np.intp]
) -> None:
    """Give the builder, which has the surfaces of these items, where they were; its camera is then that of a step."""
    matrices, _ = read_places(depsgraph)
    identities = _identities(depsgraph)
    for number, step in enumerate(steps):
        columns = step.matrices_of(matrices, identities)[items]
        builder.set_camera(**step.camera)
        builder.set_motion_step(number, np.ascontiguousarray(columns.transpose(0, 2, 1)))
