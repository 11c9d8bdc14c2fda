"""Smoke and fire of fluid simulations to the grids of volume objects."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import bpy
import numpy as np

from . import SyncReport
from .volume_grids import Grid, VolumeArrays, boxed, stored

# Grids of a domain by the names materials read them by: property, channels, whether noise refines it.
_GRIDS = {
    "density": ("density_grid", 1, True),
    "flame": ("flame_grid", 1, True),
    "color": ("color_grid", 4, True),  # multiplied by the density, the fourth channel
    "temperature": ("temperature_grid", 1, True),
    "heat": ("heat_grid", 1, False),
}


def gas_domain(obj: bpy.types.Object) -> bpy.types.FluidDomainSettings | None:
    """The domain of gas that an object is, which then shows no surface, as in Cycles."""
    for modifier in obj.modifiers:
        if modifier.type == "FLUID" and modifier.fluid_type == "DOMAIN":
            domain = modifier.domain_settings
            return domain if domain is not None and domain.domain_type == "GAS" else None
    return None


def gas_arrays(
    obj: bpy.types.Object,
    domain: Any,  # noqa: ANN401
    frame: int,
    names: Collection[str],
    report: SyncReport,
) -> VolumeArrays | None:
    """None where there is no gas: before and after the simulation, or before it is baked."""
    if not domain.cache_frame_start <= frame <= domain.cache_frame_end:
        return None
    grids = []
    for name in _GRIDS.keys() & set(names):
        member, channels, is_refined = _GRIDS[name]
        size = np.array(domain.domain_resolution) * (domain.noise_scale if domain.use_noise and is_refined else 1)
        flat = getattr(domain, member)
        if len(flat) != size.prod() * channels:
            if len(flat):
                report.warn(f"Object '{obj.name}': {name} of the simulation has another resolution, it is left out")
            continue
        values = np.empty(len(flat), np.float32)
        flat.foreach_get(values)
        if not values.any():
            continue
        voxels = values.reshape(*size[::-1], channels).transpose(2, 1, 0, 3)  # x is the fastest there
        if channels == 1:
            voxels = voxels[..., 0]
        grids.append(Grid(name, stored(voxels, is_half=False), _object_to_voxel(obj.data, size)))
    return boxed(grids, scales_with_object=False) if grids else None


def _object_to_voxel(mesh: bpy.types.Mesh, size: np.ndarray) -> np.ndarray:
    """The texture space of the mesh is the domain; there voxels are cells."""
    middle, half = np.array(mesh.texspace_location), np.array(mesh.texspace_size)
    scale = size / (2.0 * np.where(half > 0.0, half, 1.0))
    matrix = np.diag([*scale, 1.0])
    matrix[:3, 3] = 0.5 * size - scale * middle - 0.5
    return matrix.astype(np.float32)
