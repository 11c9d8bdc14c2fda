"""The Sky Texture node: a table of the sky, and a disc for the sun."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import versions
from ..colour import image_colour
from ..sky import hosek_wilkie, multiple_scattering, preetham, single_scattering
from ..sky.table import Atmosphere, to_rgb
from .compiler import NodeView, value_node
from .enums import HORIZON_PROJECTION, INTERPOLATIONS, ROTATION_TYPES
from .instructions import COLOR, Value, constant
from .textures import texture_vector
from .vector import vector_constant

SMALLEST_SUN = 0.0005  # radians, as Cycles has it
HALF_PI = 0.5 * math.pi


@dataclass(frozen=True)
class SunPlace:
    """Angles in radians; the azimuth counts from +X towards +Y."""

    elevation: float
    azimuth: float

    @property
    def direction(self) -> tuple[float, float, float]:
        across = math.cos(self.elevation)
        return across * math.cos(self.azimuth), across * math.sin(self.azimuth), math.sin(self.elevation)


@dataclass(frozen=True)
class Sky:
    """A sky as the node has it set: equal ones look alike, and share a table."""

    kind: str
    atmosphere: Atmosphere | None = None
    turbidity: float = 0.0
    sun_elevation: float = 0.0
    ground_albedo: float = 0.0

    def table(self) -> NDArray[np.float32]:
        """XYZ, as `addon/sync/sky` lays it out."""
        if self.kind == "HOSEK_WILKIE":
            return hosek_wilkie.sky_table(self.sun_elevation, self.turbidity, self.ground_albedo)
        if self.atmosphere is None:
            return preetham.sky_table(self.sun_elevation, self.turbidity)
        if self.kind == "MULTIPLE_SCATTERING":
            return multiple_scattering.sky_table(self.atmosphere)
        return single_scattering.sky_table(self.atmosphere, as_before_5=self.kind == "NISHITA")


@value_node("ShaderNodeTexSky")
def sky_texture(node: NodeView, output: str) -> Value:
    sky = node.node
    direction = texture_vector(node)
    if sky.sky_type in ("PREETHAM", "HOSEK_WILKIE"):
        place = _place_of(sky.sun_direction)
        albedo = sky.ground_albedo if sky.sky_type == "HOSEK_WILKIE" else 0.0
        return _table(node, direction, Sky(sky.sky_type, None, sky.turbidity, place.elevation, albedo), place)
    place = _wrapped_place(sky.sun_elevation, sky.sun_rotation)
    aerosol = sky.aerosol_density if hasattr(sky, "aerosol_density") else sky.dust_density
    atmosphere = Atmosphere(place.elevation, sky.altitude, sky.air_density, aerosol, sky.ozone_density)
    color = _table(node, direction, Sky(sky.sky_type, atmosphere), place)
    return _with_sun(node, direction, color, place, atmosphere) if sky.sun_disc else color


def _place_of(direction: tuple[float, float, float]) -> SunPlace:
    x, y, z = direction
    return SunPlace(math.atan2(z, math.hypot(x, y)), math.atan2(y, x))


def _wrapped_place(elevation: float, rotation: float) -> SunPlace:
    """Of a sun that an animation may have carried past the zenith, or around the Earth."""
    elevation = math.remainder(elevation, 2.0 * math.pi)
    if abs(elevation) > HALF_PI:
        elevation, rotation = math.copysign(math.pi, elevation) - elevation, rotation + math.pi
    return SunPlace(elevation, math.remainder(HALF_PI - rotation, 2.0 * math.pi))


def _to_working_space() -> NDArray[np.float64]:
    matrix = image_colour("Linear CIE-XYZ D65", versions.working_space()).matrix
    return np.eye(3) if matrix is None else np.reshape(matrix, (3, 3))


def _table(node: NodeView, direction: Value, sky: Sky, place: SunPlace) -> Value:
    """The sky without its sun, which stands over the middle of the table: along +X, as far as the core knows."""
    key = ("sky", sky, versions.working_space())
    handle = node.compiler.context.table_handle(key, "sky", lambda: to_rgb(sky.table(), _to_working_space()))
    origin = vector_constant(0.0, 0.0, 0.0)
    turned = node.emit(
        "VECTOR_ROTATE",
        (direction, origin, vector_constant(0.0, 0.0, 1.0), constant(-place.azimuth), origin),
        (ROTATION_TYPES.index("Z_AXIS"), 0),
    )
    parameters = (node.compiler.code.program.image(handle), INTERPOLATIONS["Linear"], HORIZON_PROJECTION)
    return node.emit("ENVIRONMENT_IMAGE", (turned,), parameters)


def _with_sun(node: NodeView, direction: Value, color: Value, place: SunPlace, atmosphere: Atmosphere) -> Value:
    sky, is_old = node.node, node.node.sky_type == "NISHITA"
    model = multiple_scattering if sky.sky_type == "MULTIPLE_SCATTERING" else single_scattering
    diameter = max(sky.sun_size, SMALLEST_SUN)
    bottom, top = place.elevation - 0.5 * diameter, place.elevation + 0.5 * diameter
    horizon = 0.0 if is_old else multiple_scattering.horizon(sky.altitude)
    if top <= horizon:
        return color
    disc = model.sun_disc(atmosphere, diameter)
    colors = (to_rgb(sky.sun_intensity * xyz, _to_working_space()) for xyz in (disc.bottom, disc.top))
    angles = vector_constant(0.5 * diameter, max(bottom, 0.0) if is_old else bottom, top)
    radiance = [constant(*(float(c) for c in rgb), COLOR) for rgb in colors]
    inputs = (direction, color, vector_constant(*place.direction), angles, *radiance, constant(horizon))
    return node.emit("SUN_DISC", inputs, (int(is_old),))
