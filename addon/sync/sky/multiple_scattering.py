"""Light that was scattered any number of times, and once by the ground.

The sky of Fernando García Liñán (fgarlin.com/posts/2024-12-06-spectral_sky, github.com/fgarlin/skytracer), which
Blender 5.0 has as MULTIPLE_SCATTERING: single scattering is integrated along the view in four wavelengths that were
chosen, with a matrix to XYZ, to stand for the spectrum; what is scattered more often is a fit to a path tracer's
answer for the Earth. Figures are the model's own, for an urban atmosphere. Lengths in kilometres.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .table import Atmosphere, SunDisc, column_azimuths, in_threads, mirrored, row_elevations

EARTH_RADIUS = 6371.0
THICKNESS = 100.0
LOWEST, HIGHEST = 0.001, 99.999  # altitudes
GROUND_ALBEDO = 0.3
AEROSOL_G = 0.8  # mean cosine
STEPS = 64  # along a view, and along a way to the sun
LUT_ALTITUDES, LUT_COSINES = 64, 256
# All but the phase functions is smooth in azimuth and needs fewer places than the table has.
_NODES = np.pi * (np.arange(48) + 0.5) / 48

# At 630, 560, 490 and 430 nm.
SUNLIGHT = np.array((1.679, 1.828, 1.986, 1.307))
# What a kilometre of air, aerosol and ozone of density 1 scatters, and takes away: (3, wavelengths).
_AEROSOL_DENSITY = 1.3681e20
SCATTERING = np.array(
    (
        (6.605e-3, 1.067e-2, 1.842e-2, 3.156e-2),
        tuple(_AEROSOL_DENSITY * c for c in (1.5908e-22, 1.7711e-22, 2.0942e-22, 2.4033e-22)),
        (0.0, 0.0, 0.0, 0.0),
    )
)
_MEAN_OZONE = 334.5  # Dobson units
ABSORPTION = np.array(
    (
        (0.0, 0.0, 0.0, 0.0),
        tuple(_AEROSOL_DENSITY * c for c in (2.8722e-24, 4.6168e-24, 7.9706e-24, 1.3578e-23)),
        tuple(3.78547397e20 * _MEAN_OZONE * c for c in (3.472e-25, 3.914e-25, 1.349e-25, 1.103e-26)),
    )
)
EXTINCTION = SCATTERING + ABSORPTION
AEROSOL_SCALE_HEIGHT, AEROSOL_BACKGROUND = 0.73, 2e6 / _AEROSOL_DENSITY
# Of light that was scattered before, per steradian and unit of sunlight.
MULTIPLE_SCATTERING = 0.02 * np.array((0.217, 0.347, 0.594, 1.0))
XYZ_OF_SPECTRUM = np.array(
    (
        (53.386917738564668, 43.904844466369358, 1.6137278251608962, 20.762668673810577),
        (22.981337506691025, 71.347795700053394, 18.422960591455485, 2.3614213523314369),
        (0.0, 0.10250686796574131, 31.742921188390806, 110.48009643252140),
    )
)


def _height(above: NDArray) -> NDArray:
    """Above the ground, of points at r^2 = EARTH_RADIUS^2 + `above`; 0 below it."""
    return np.maximum(above / (np.sqrt(above + EARTH_RADIUS**2) + EARTH_RADIUS), 0.0)


def _above(height: NDArray | float) -> NDArray | float:
    return height * (2.0 * EARTH_RADIUS + height)


def _way_to_rim(above: NDArray, rise: NDArray) -> NDArray:
    """Length of rays to the rim of the atmosphere; `rise` is the radius times the sine of their elevation."""
    return np.sqrt(rise**2 + _above(THICKNESS) - above) - rise


def _densities(atmosphere: Atmosphere, height: NDArray) -> NDArray:
    """Of air, aerosol and ozone: (..., 3)."""
    log_height = np.log(np.maximum(height, 1e-4))
    air = np.exp(-0.07771971 * np.exp(1.16364243 * log_height))
    aerosol = np.exp(height * (-1.0 / AEROSOL_SCALE_HEIGHT)) + AEROSOL_BACKGROUND
    ozone = np.exp(-5.55555555 * (log_height - 3.22261) ** 2 - log_height)
    return np.stack((atmosphere.air * air, atmosphere.aerosol * aerosol, atmosphere.ozone * ozone), axis=-1)


def _transmittance(atmosphere: Atmosphere, altitude: NDArray, cosine: NDArray) -> NDArray:
    """Of the way from an altitude to the rim, at a cosine from the zenith: (..., 4). The Earth does not stop it."""
    above, rise = _above(altitude), (EARTH_RADIUS + altitude) * cosine
    length = _way_to_rim(above, rise)
    depth = np.zeros((*length.shape, 3))
    for k in range(STEPS):
        way = (k + 0.5) / STEPS * length
        height = _height(above + way * (2.0 * rise + way))
        depth += _densities(atmosphere, height.astype(np.float32))
    return np.exp(-(depth * (length / STEPS)[..., None]) @ EXTINCTION)


def _cosine_interpolation(azimuths: NDArray) -> NDArray:
    """What to weigh values at the nodes by: (azimuths, nodes)."""
    orders = np.arange(len(_NODES))
    at_azimuths = np.cos(np.outer(azimuths, orders)) * np.where(orders == 0, 1.0, 2.0) / len(_NODES)
    return at_azimuths @ np.cos(np.outer(orders, _NODES))


class _Sky:
    def __init__(self, atmosphere: Atmosphere) -> None:
        self.atmosphere = atmosphere
        altitudes = np.linspace(0.0, THICKNESS, LUT_ALTITUDES)
        to_sun = _transmittance(atmosphere, altitudes[:, None], np.linspace(-1.0, 1.0, LUT_COSINES))
        self.to_sun = to_sun.astype(np.float32)
        self.altitude = min(max(0.001 * atmosphere.altitude, LOWEST), HIGHEST)
        self.azimuths = column_azimuths()
        self.from_nodes = _cosine_interpolation(self.azimuths)
        self.sun = np.array((np.cos(atmosphere.sun_elevation), np.sin(atmosphere.sun_elevation)))

    def row(self, elevation: float) -> NDArray:
        """XYZ of the rays of one elevation: (azimuths, 3)."""
        start, upward, across = EARTH_RADIUS + self.altitude, np.sin(elevation), np.cos(elevation)
        above, rise = _above(self.altitude), start * upward
        reaches_ground = rise <= 0.0 and rise**2 >= above
        length = -rise - np.sqrt(rise**2 - above) if reaches_ground else _way_to_rim(above, rise)
        way = (np.arange(STEPS) + 0.5) / STEPS * length
        point_above = above + way * (2.0 * rise + way)
        height, radius = _height(point_above), np.sqrt(point_above + EARTH_RADIUS**2)
        forward = across * self.sun[0] * np.cos(_NODES)
        sun_cosine = (np.outer(forward, way) + (start + way * upward) * self.sun[1]) / radius
        air, aerosol = self._weights(height, length / STEPS)
        sun = _SunAt(sun_cosine.astype(np.float32))
        straight = sun.between(self._transmittance_to_sun(height).reshape(-1, 4), LUT_COSINES * np.arange(STEPS))
        often = (1.0 / (1.0 + 5.0 * np.exp(-17.92 * sun.cosine))) @ ((air + aerosol) * MULTIPLE_SCATTERING)
        often += _sum((air + aerosol) * self._from_ground(height, radius), sun.lit_ground(self.to_sun[0]))
        cosine = across * self.sun[0] * np.cos(self.azimuths) + upward * self.sun[1]
        light = _phase_air(cosine) * (self.from_nodes @ _sum(air, straight))
        light += _phase_aerosol(cosine) * (self.from_nodes @ _sum(aerosol, straight))
        return SUNLIGHT * (light + self.from_nodes @ often) @ XYZ_OF_SPECTRUM.T

    def _weights(self, height: NDArray, step: float) -> tuple[NDArray, NDArray]:
        """What reaches the observer of light that air and aerosol scatter at these steps of his view: (steps, 4)."""
        density = _densities(self.atmosphere, height)
        extinction = density @ EXTINCTION
        passing = np.exp(-step * extinction)
        before = np.cumprod(np.concatenate((np.ones((1, 4)), passing[:-1])), axis=0)
        # [Hillaire 2015] Physically based sky, atmosphere and cloud rendering in Frostbite: a step dims its own light.
        share = before * (1.0 - passing) / np.maximum(extinction, 1e-7)
        return share * density[:, :1] * SCATTERING[0], share * density[:, 1:2] * SCATTERING[1]

    def _from_ground(self, height: NDArray, radius: NDArray) -> NDArray:
        """Radiance that arrives from a ground in unit light, averaged over all directions: (points, 4)."""
        covered = 0.5 * (1.0 - np.sqrt(1.0 - (EARTH_RADIUS / radius) ** 2))
        above = self._transmittance_to_sun(height)[:, -1]  # the zenith's column
        way_up = self.to_sun[0, -1] / np.maximum(above, np.finfo(np.float32).tiny)
        return covered[:, None] * (GROUND_ALBEDO / np.pi) * way_up

    def _transmittance_to_sun(self, height: NDArray) -> NDArray:
        """The lookup table between its altitudes: (heights, cosines, 4)."""
        y = np.clip(height / THICKNESS, 0.0, 1.0).astype(np.float32) * np.float32(LUT_ALTITUDES - 1)
        low = np.minimum(y.astype(np.intp), LUT_ALTITUDES - 2)
        return self.to_sun[low] + (y - low)[:, None, None] * (self.to_sun[low + 1] - self.to_sun[low])


class _SunAt:
    """Lookups where the sun stands at `cosine` (azimuths, steps) from the zenith."""

    def __init__(self, cosine: NDArray) -> None:
        self.cosine = cosine
        x = np.clip(0.5 * cosine + 0.5, 0.0, 1.0) * np.float32(LUT_COSINES - 1)
        self.low = np.minimum(x.astype(np.intp), LUT_COSINES - 2)
        self.share = (x - self.low.astype(np.float32))[..., None]

    def between(self, rows: NDArray, first: NDArray | int = 0) -> NDArray:
        """Of rows (cosines, 4), of which each step may have its own from `first` on: (azimuths, steps, 4)."""
        low = rows.take(self.low + first, axis=0)
        high = rows.take(self.low + (first + 1), axis=0)
        high -= low
        high *= self.share
        high += low
        return high

    def lit_ground(self, rows: NDArray) -> NDArray:
        return self.between(rows) * self.cosine[..., None]


def _sum(weight: NDArray, light: NDArray) -> NDArray:
    return np.einsum("kw,akw->aw", weight.astype(np.float32), light)


def _phase_air(cosine: NDArray) -> NDArray:
    return (3.0 / (16.0 * np.pi) * (1.0 + cosine**2))[:, None]


def _phase_aerosol(cosine: NDArray) -> NDArray:
    """Henyey and Greenstein's [1941]."""
    g2 = AEROSOL_G**2
    return ((1.0 - g2) / (4.0 * np.pi * (1.0 + g2 - 2.0 * AEROSOL_G * cosine) ** 1.5))[:, None]


@lru_cache(maxsize=4)
def sky_table(atmosphere: Atmosphere) -> NDArray[np.float32]:
    """The sky without its sun, down to the ground."""
    table = mirrored(in_threads(_Sky(atmosphere).row, row_elevations()))
    table.flags.writeable = False
    return table


def sun_disc(atmosphere: Atmosphere, diameter: float) -> SunDisc:
    """A sun `diameter` radians across, as wide as it is without any effect on its light."""
    half = 0.5 * diameter
    altitude = min(max(0.001 * atmosphere.altitude, LOWEST), HIGHEST)
    elevations = atmosphere.sun_elevation + np.array((-half, half))
    passing = _transmittance(atmosphere, np.array(altitude), np.sin(elevations))
    spectrum = SUNLIGHT / (2.0 * np.pi * (1.0 - np.cos(half))) * passing
    return SunDisc(*(spectrum @ XYZ_OF_SPECTRUM.T))


def horizon(altitude: float) -> float:
    """Elevation in radians at which the ground begins to hide the sun; `altitude` in metres."""
    return -float(np.arccos(EARTH_RADIUS / (EARTH_RADIUS + 0.001 * altitude)))
