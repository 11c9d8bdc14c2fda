"""Clouds of Gaussian splats to arrays, by Cycles' rules (Blender 5.3): shapes, opacity, and radiance by spherical
harmonics, in attributes whose names Blender's importers give them."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass, field
from itertools import takewhile

import bpy
import numpy as np
from numpy.typing import NDArray

from . import versions
from .colour import image_colour
from .meshes import read_attribute_values
from .points import point_attributes

_HARMONICS = 15  # of bands 1 to 3
_LEAST_OPACITY = 0.01  # as far as splats reach
_DEFAULT_ROTATION = (1.0, 0.0, 0.0, 0.0)
_DEFAULT_RADIANCE = (0.0, 0.0, 0.0, 0.5)  # grey, half opaque


@dataclass(frozen=True)
class SplatArrays:
    """The arguments of `SceneBuilder.add_splats` save name and handle."""

    positions: NDArray[np.float32]
    scales: NDArray[np.float32]
    rotations: NDArray[np.float32]
    radiance: NDArray[np.float32]
    harmonics: NDArray[np.uint8] | None = None
    to_working_space: tuple[float, ...] | None = None
    attributes: list[tuple[str, str, NDArray[np.float32]]] = field(default_factory=list)


def is_splat_cloud(data: bpy.types.ID | None) -> bool:
    return isinstance(data, bpy.types.PointCloud) and getattr(data, "type", "") == "GAUSSIAN_SPLAT"


def splat_arrays(cloud: bpy.types.PointCloud, wanted: Set[str]) -> SplatArrays | None:
    """None for a cloud without splats, or without the attribute that tells how wide they are."""
    scales = _values(cloud, "scale", 3)
    if scales is None or not len(scales):
        return None
    positions = _values(cloud, "position", 3)
    radiance = _values_or(cloud, "radiance:base", _DEFAULT_RADIANCE)
    return SplatArrays(
        positions,
        scales,
        _values_or(cloud, "rotation", _DEFAULT_ROTATION),
        radiance,
        _harmonics(cloud),
        image_colour("Linear Rec.709", versions.working_space()).matrix,
        point_attributes(cloud, positions, _radii(scales, radiance[:, 3]), wanted),
    )


def _values(cloud: bpy.types.PointCloud, name: str, components: int) -> NDArray[np.float32] | None:
    """None for attributes of another kind, too."""
    attribute = cloud.attributes.get(name)
    values = None if attribute is None else read_attribute_values(attribute)
    return values if values is not None and values.shape[1] == components else None


def _values_or(cloud: bpy.types.PointCloud, name: str, default: tuple[float, ...]) -> NDArray[np.float32]:
    values = _values(cloud, name, len(default))
    return np.tile(np.float32(default), (len(cloud.points), 1)) if values is None else values


def _harmonics(cloud: bpy.types.PointCloud) -> NDArray[np.uint8] | None:
    """(splats, 15, 3), [-1, 1] in 8 bits as Cycles keeps them, up to the first that is missing; None where all are."""
    columns = (_values(cloud, f"radiance:sh_{i}", 3) for i in range(_HARMONICS))
    found = [_in_bytes(values) for values in takewhile(lambda values: values is not None, columns)]
    if not found:
        return None
    nothing = np.full((len(cloud.points), _HARMONICS - len(found), 3), _in_bytes(np.zeros(1)), np.uint8)
    return np.concatenate([np.stack(found, axis=1), nothing], axis=1)


def _in_bytes(values: NDArray) -> NDArray[np.uint8]:
    return (np.clip(0.5 * (np.nan_to_num(values) + 1.0), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def _radii(scales: NDArray[np.float32], opacities: NDArray[np.float32]) -> NDArray[np.float32]:
    """Where the opacity has fallen to the least that is shown, for the Point Info node."""
    deviations = np.sqrt(2.0 * np.log(np.fmax(opacities, _LEAST_OPACITY) / _LEAST_OPACITY))
    return deviations * np.abs(scales).max(axis=1)
