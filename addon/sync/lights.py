"""Blender's lamps to the physical quantities of the core.

Blender gives point, spot and area lights in watts and suns in W/m^2 at normal incidence. The constants below were
confirmed by rendering a white plane in Cycles (tests/blender/test_sync_lights.py); c is `versions.light_strength`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import versions


@dataclass(frozen=True)
class LightCall:
    """A method of `SceneBuilder` and its keyword arguments, save `name`."""

    method: str
    arguments: dict[str, Any]


def is_portal(light: bpy.types.Light) -> bool:
    """Whether an area light only guides the sampling of the sky and emits nothing itself."""
    return light.type == "AREA" and versions.cycles_setting(light, "is_portal", False)


def wants_shadow_caustics(light: bpy.types.Light) -> bool:
    """Whether Cycles would look for its light in the shadows of glass by manifold walks."""
    return not is_portal(light) and bool(versions.cycles_setting(light, "is_caustics_light", False))


def light_call(light: bpy.types.Light, matrix: NDArray[np.float64]) -> LightCall | None:
    """The builder call for a lamp placed by `matrix` (4, 4); None for one that sends nothing because its area, or the
    space its cone is measured in, is flattened away."""
    convert = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}[light.type]
    call = convert(light, matrix)
    if call is not None:
        call.arguments.update(
            object_to_world=np.ascontiguousarray(matrix, np.float32),
            casts_shadow=bool(versions.light_casts_shadow(light)),
            use_mis=bool(versions.cycles_setting(light, "use_multiple_importance_sampling", True)),
            max_bounces=int(versions.cycles_setting(light, "max_bounces", 1024)),
        )
    return call


def _intensity(light: bpy.types.Light) -> tuple[float, ...]:
    """W/sr of a point or spot light: radiance times pi r^2. A cone takes light away, it does not concentrate it."""
    strength = versions.light_strength(light)
    if versions.light_is_normalized(light):
        return tuple(strength / (4.0 * math.pi))  # radiance c / (4 pi^2 r^2)
    if light.shadow_soft_size > 0.0:
        return tuple(strength * light.shadow_soft_size**2)  # radiance c / pi
    return tuple(strength / math.pi)


def _point(light: bpy.types.Light, matrix: NDArray[np.float64]) -> LightCall:
    return LightCall(
        "add_point_light",
        {
            "position": tuple(matrix[:3, 3]),
            "radius": light.shadow_soft_size,
            "intensity": _intensity(light),
            "soft": light.use_soft_falloff,
        },
    )


def _spot(light: bpy.types.Light, matrix: NDArray[np.float64]) -> LightCall | None:
    if np.linalg.det(matrix[:3, :3]) == 0.0:
        return None
    return LightCall(
        "add_spot_light",
        {
            "radius": light.shadow_soft_size,
            "intensity": _intensity(light),
            "spot_size": light.spot_size,
            "blend": light.spot_blend,
            "soft": light.use_soft_falloff,
        },
    )


def _sun(light: bpy.types.Light, matrix: NDArray[np.float64]) -> LightCall:
    irradiance = versions.light_strength(light)
    if not versions.light_is_normalized(light) and light.angle > 0.0:
        irradiance = irradiance * math.pi * math.sin(0.5 * light.angle) ** 2  # c is the radiance of the disk
    return LightCall(
        "add_sun_light",
        {"direction": tuple(_unit(matrix[:3, 2])), "angle": light.angle, "irradiance": tuple(irradiance)},
    )


def _area(light: bpy.types.Light, matrix: NDArray[np.float64]) -> LightCall | None:
    size_v = light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size
    edge_u, edge_v = matrix[:3, 0] * light.size, matrix[:3, 1] * size_v
    ellipse = light.shape in {"DISK", "ELLIPSE"}
    area = np.linalg.norm(edge_u) * np.linalg.norm(edge_v) * (math.pi / 4.0 if ellipse else 1.0)
    if area == 0.0:
        return None
    radiance = versions.light_strength(light) / math.pi
    if versions.light_is_normalized(light):
        radiance = radiance / area
    return LightCall(
        "add_area_light",
        {
            "center": tuple(matrix[:3, 3]),
            "edge_u": tuple(edge_u),
            "edge_v": tuple(edge_v),
            "normal": tuple(_unit(-matrix[:3, 2])),
            "radiance": tuple(radiance),
            "ellipse": ellipse,
            "spread": light.spread,
            "portal": is_portal(light),
        },
    )


def _unit(v: NDArray[np.float64]) -> NDArray[np.float64]:
    """`v` at length 1, or the local axis of an unrotated lamp where scale has flattened it away."""
    length = np.linalg.norm(v)
    return v / length if length > 0.0 else np.array((0.0, 0.0, 1.0))
