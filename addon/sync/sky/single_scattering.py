"""Light that was scattered once on its way through a clear atmosphere.

[Nishita et al. 1993] Display of the Earth taking into account atmospheric scattering: a spherical Earth under air and
aerosol that thin out exponentially, in 21 wavelengths; ozone is added, which absorbs only. Numbers are those of
Blender's node of this name (NISHITA before 5.0), so that scenes look alike: 32 steps along the view, the optical depth
towards the sun by eight-point Gauss-Laguerre quadrature. Lengths in metres, radiance in W / (m^2 sr nm) until the
colour matching functions sum it up.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .table import COLUMNS, HALF_PI, ROWS, Atmosphere, SunDisc, in_threads, mirrored, row_elevations

EARTH_RADIUS = 6360e3
ATMOSPHERE_RADIUS = 6420e3
LOWEST, HIGHEST = 1.0, 59999.0  # altitudes
LOWEST_HEIGHT = -50e3  # of points on ways through the Earth, where densities are finite still
AIR_SCALE_HEIGHT = 8000.0
AEROSOL_SCALE_HEIGHT = 1200.0
AEROSOL_SCATTERING = 2e-5  # 1/m at the ground
AEROSOL_EXTINCTION = 1.11 * AEROSOL_SCATTERING
AEROSOL_G = 0.76  # mean cosine
OZONE_HEIGHT, OZONE_HALF_WIDTH = 25e3, 15e3
VIEW_STEPS = 32
_ABSCISSAE, _WEIGHTS = np.polynomial.laguerre.laggauss(8)
RIM_ABSCISSA = 25.0  # stands for the rim of the atmosphere on the way to the sun
SUN_NODES, SUN_WEIGHTS = _ABSCISSAE / RIM_ABSCISSA, _WEIGHTS * np.exp(_ABSCISSAE) / RIM_ABSCISSA

WAVELENGTHS = np.arange(380, 781, 20)  # nm
# CIE 1931 standard observer at these wavelengths.
MATCHING = np.array(
    (
        (0.001368, 0.000039, 0.006450001),
        (0.01431, 0.000396, 0.06785001),
        (0.13438, 0.004, 0.6456),
        (0.34828, 0.023, 1.74706),
        (0.2908, 0.06, 1.6692),
        (0.09564, 0.13902, 0.8129501),
        (0.0049, 0.323, 0.272),
        (0.06327, 0.71, 0.07824999),
        (0.2904, 0.954, 0.0203),
        (0.5945, 0.995, 0.0039),
        (0.9163, 0.87, 0.001650001),
        (1.0622, 0.631, 0.0008),
        (0.8544499, 0.381, 0.00019),
        (0.4479, 0.175, 0.00002),
        (0.1649, 0.061, 0.0),
        (0.04677, 0.017, 0.0),
        (0.01135916, 0.004102, 0.0),
        (0.002899327, 0.001047, 0.0),
        (0.0006900786, 0.0002492, 0.0),
        (0.0001661505, 0.00006, 0.0),
        (0.00004150994, 0.00001499, 0.0),
    )
)
# Absorption of ozone where it is densest, 1/m, as in Blender.
OZONE_ABSORPTION = (
    1e-9
    * np.array(
        (
            (3.25126849861, 5.85395365047, 19.77191155085, 73.09568762914, 200.84561514287, 403.83958096161),
            (635.51335912363, 967.0704118097, 1547.9740042441, 2090.38647223331, 2461.28056164565, 2735.51299461512),
            (2151.25863128643, 1590.51840791988, 1123.56197979857, 735.27551487574, 464.50130357806, 330.96079921048),
        )
    ).ravel()
)
OZONE_ABSORPTION = np.append(OZONE_ABSORPTION, 1e-9 * np.array((225.12612292678, 148.7912926649, 168.28623364192)))


def _sunlight() -> NDArray[np.float64]:
    """Irradiance above the atmosphere, W / (m^2 nm): a black body of 5778 K as wide as the sun."""
    planck, light, boltzmann = 6.62607015e-34, 299792458.0, 1.380649e-23
    radius, distance = 6.955e8, 1.496e11
    metres = 1e-9 * WAVELENGTHS
    radiance = 2.0 * planck * light**2 / metres**5 / np.expm1(planck * light / (metres * boltzmann * 5778.0))
    return 1e-9 * radiance * np.pi * (radius / distance) ** 2


def _air_scattering() -> NDArray[np.float64]:
    """Rayleigh's coefficient at the ground, 1/m, from the refractive index of air and its molecules per cubic metre."""
    index, molecules = 1.0002926, 2.504e25
    return 8.0 * np.pi**3 * (index**2 - 1.0) ** 2 / (3.0 * molecules * (1e-9 * WAVELENGTHS) ** 4)


SUNLIGHT = _sunlight()
AIR_SCATTERING = _air_scattering()
# (wavelengths, 3): what a metre of air, aerosol and ozone of density 1 takes away.
EXTINCTION = np.stack((AIR_SCATTERING, np.full(len(WAVELENGTHS), AEROSOL_EXTINCTION), OZONE_ABSORPTION), axis=1)
_XYZ_OF_SPECTRUM = (WAVELENGTHS[1] - WAVELENGTHS[0]) * MATCHING.T


def _densities(height: NDArray) -> NDArray:
    """Of air, aerosol and ozone, relative to where each is densest: (3, ...)."""
    height = np.maximum(height, LOWEST_HEIGHT)
    ozone = np.maximum(0.0, 1.0 - np.abs(height - OZONE_HEIGHT) * (1.0 / OZONE_HALF_WIDTH))
    return np.stack((np.exp(height * (-1.0 / AIR_SCALE_HEIGHT)), np.exp(height * (-1.0 / AEROSOL_SCALE_HEIGHT)), ozone))


def _height(above: NDArray) -> NDArray:
    """Above the ground, of points at r^2 = EARTH_RADIUS^2 + `above`: no difference of large numbers."""
    return above / (np.sqrt(above + above.dtype.type(EARTH_RADIUS**2)) + above.dtype.type(EARTH_RADIUS))


def _above(height: float) -> float:
    return height * (2.0 * EARTH_RADIUS + height)


def _depth_to_sun(above: NDArray, along: NDArray) -> NDArray:
    """Optical depth, per coefficient of extinction, from points to the rim of the atmosphere: (3, ...) in metres.

    `along` is the point's coordinate in the sun's direction; both may have any shape."""
    length = np.sqrt(along**2 + above.dtype.type(_above(ATMOSPHERE_RADIUS - EARTH_RADIUS)) - above) - along
    depth = np.zeros((3, *length.shape), above.dtype)
    for node, weight in zip(SUN_NODES.astype(above.dtype), SUN_WEIGHTS.astype(above.dtype), strict=True):
        way = node * length
        depth += weight * _densities(_height(above + way * (2.0 * along + way)))
    return depth * length


def _phases(cosine: NDArray) -> NDArray:
    """Rayleigh's and Cornette and Shanks' [1992] phase functions, 1/sr: (..., 2)."""
    g2 = AEROSOL_G**2
    shape = 1.0 + cosine**2
    aerosol = 3.0 * (1.0 - g2) * shape / (8.0 * np.pi * (2.0 + g2) * (1.0 + g2 - 2.0 * AEROSOL_G * cosine) ** 1.5)
    return np.stack((3.0 / (16.0 * np.pi) * shape, aerosol), axis=-1)


@lru_cache(maxsize=4)
def sky_table(atmosphere: Atmosphere, *, as_before_5: bool = False) -> NDArray[np.float32]:
    """The sky without its sun. Below the horizon its rim fades to black, 24 degrees down.

    Blender's rows show elevations half a row below their middles, and so did columns; `as_before_5` for the node of
    4.x, where the rows below the horizon are in place."""
    s = 2.0 * np.arange(ROWS // 2) / ROWS
    view = _ViewRays(atmosphere, HALF_PI * s**2 * (1.0 + 1.0 / ROWS if as_before_5 else 1.0))
    azimuths = 2.0 * np.pi * np.arange(COLUMNS // 2) / COLUMNS - np.pi
    sky = in_threads(lambda k: view.row(k, np.cos(azimuths)), range(ROWS // 2))
    down = row_elevations()[: ROWS // 2] if as_before_5 else -HALF_PI * (1.0 - s) ** 2
    fade = np.maximum(0.0, 1.0 + 2.5 * np.sin(down)) ** 3
    table = mirrored(np.concatenate((fade[:, None, None] * sky[0], sky)))
    table.flags.writeable = False
    return table


class _ViewRays:
    """Rays from the observer at some elevations, cut into steps."""

    def __init__(self, atmosphere: Atmosphere, elevations: NDArray) -> None:
        altitude = min(max(atmosphere.altitude, LOWEST), HIGHEST)
        start = EARTH_RADIUS + altitude
        self.sun = atmosphere.sun_elevation
        self.scale = np.array((atmosphere.air, atmosphere.aerosol, atmosphere.ozone))
        self.elevations = elevations
        rise = start * np.sin(elevations)
        length = np.sqrt(rise**2 + _above(ATMOSPHERE_RADIUS - EARTH_RADIUS) - _above(altitude)) - rise
        self.step = length / VIEW_STEPS
        self.distance = self.step[:, None] * (np.arange(VIEW_STEPS) + 0.5)
        self.up = start + self.distance * np.sin(elevations)[:, None]
        self.above = _above(altitude) + self.distance * (2.0 * rise[:, None] + self.distance)
        self.density = self.scale[:, None, None] * _densities(_height(self.above))
        self.depth = np.cumsum(self.density, axis=2) * self.step[:, None]

    def row(self, k: int, cos_azimuth: NDArray) -> NDArray:
        """XYZ of the rays of elevation `k` at these azimuths from the sun: (azimuths, 3)."""
        sun_up, sun_forward = np.sin(self.sun), np.cos(self.sun)
        forward = self.distance[k, :, None] * np.cos(self.elevations[k]) * cos_azimuth
        along = (forward * sun_forward + (self.up[k] * sun_up)[:, None]).astype(np.float32)
        above = self.above[k, :, None].astype(np.float32)
        depth = _depth_to_sun(above, along) * self.scale[:, None, None].astype(np.float32)
        depth += self.depth[:, k, :, None].astype(np.float32)
        passing = np.exp(-EXTINCTION.astype(np.float32) @ depth.reshape(3, -1)).reshape(-1, *along.shape)
        if sun_up < 0.0:
            passing *= along**2 < above  # else the Earth stands between
        # By wavelength, air and aerosol, azimuth.
        scattered = np.matmul(self.density[:2, k].astype(np.float32), passing)
        cosine = np.cos(self.elevations[k]) * cos_azimuth * sun_forward + np.sin(self.elevations[k]) * sun_up
        coefficients = np.stack((AIR_SCATTERING, np.full(len(WAVELENGTHS), AEROSOL_SCATTERING)), axis=1)
        spectrum = np.einsum("wsa,ws,as->aw", scattered, coefficients * SUNLIGHT[:, None], _phases(cosine))
        return self.step[k] * spectrum @ _XYZ_OF_SPECTRUM.T


def sun_disc(atmosphere: Atmosphere, diameter: float) -> SunDisc:
    """A sun `diameter` radians across, as wide as it is without any effect on its light; black below the horizon."""
    half = 0.5 * diameter
    if atmosphere.sun_elevation + half <= 0.0:
        return SunDisc(np.zeros(3), np.zeros(3))
    solid_angle = 2.0 * np.pi * (1.0 - np.cos(half))
    altitude = min(max(atmosphere.altitude, LOWEST), HIGHEST)
    elevations = np.maximum(atmosphere.sun_elevation + np.array((-half, half)), 0.0)
    depth = _depth_to_sun(np.array(_above(altitude)), (EARTH_RADIUS + altitude) * np.sin(elevations))
    scale = np.array((atmosphere.air, atmosphere.aerosol, 0.0))  # Blender's sun shines through ozone unchanged
    spectrum = SUNLIGHT / solid_angle * np.exp(-(scale[:, None] * depth).T @ EXTINCTION.T)
    return SunDisc(*(spectrum @ _XYZ_OF_SPECTRUM.T))
