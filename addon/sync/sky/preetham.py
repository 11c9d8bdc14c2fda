"""A fitted sky for a sun above the horizon in air of some turbidity.

[Preetham, Shirley and Smits 1999] A practical analytic model for daylight: luminance and chromaticity are the values
at the zenith (§A.2) times Perez' distribution. As in Blender, luminance is 0.06 of the paper's kcd/m^2, and what lies
below the horizon goes on as it is there.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .table import HALF_PI, column_azimuths, mirrored, row_elevations

ROWS, COLUMNS = 512, 1024  # the brightness has a cusp at the sun
LUMINANCE_UNIT = 0.06
LARGEST_ZENITH_ANGLE = HALF_PI - 0.001
SMALLEST_Y, LARGEST = 0.01, 1e4  # what no sky has: the model goes there with a turbidity below 1.2

# Perez' A to E of Y, x and y: slope times turbidity plus offset.
_SLOPES = np.array(
    (
        (0.1787, -0.3554, -0.0227, 0.1206, -0.0670),
        (-0.0193, -0.0665, -0.0004, -0.0641, -0.0033),
        (-0.0167, -0.0950, -0.0079, -0.0441, -0.0109),
    )
)
_OFFSETS = np.array(
    (
        (-1.4630, 0.4275, 5.3251, -2.5771, 0.3703),
        (-0.2592, 0.0008, 0.2125, -0.8989, 0.0452),
        (-0.2608, 0.0092, 0.2102, -1.6537, 0.0529),
    )
)
# Chromaticity of the zenith: rows are powers 2, 1, 0 of turbidity, columns powers 3 to 0 of the sun's zenith angle.
_ZENITH_X = np.array(
    ((0.00166, -0.00375, 0.00209, 0.0), (-0.02903, 0.06377, -0.03202, 0.00394), (0.11693, -0.21196, 0.06052, 0.25886))
)
_ZENITH_Y = np.array(
    ((0.00275, -0.00610, 0.00317, 0.0), (-0.04214, 0.08970, -0.04153, 0.00516), (0.15346, -0.26756, 0.06670, 0.26688))
)


def _zenith(sun_angle: float, turbidity: float) -> NDArray[np.float64]:
    """Y, x and y straight above."""
    chi = (4.0 / 9.0 - turbidity / 120.0) * (np.pi - 2.0 * sun_angle)
    luminance = (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192
    powers = turbidity ** np.array((2.0, 1.0, 0.0)), sun_angle ** np.array((3.0, 2.0, 1.0, 0.0))
    return np.array((LUMINANCE_UNIT * luminance, *(powers[0] @ table @ powers[1] for table in (_ZENITH_X, _ZENITH_Y))))


def _perez(coefficients: NDArray, zenith_angle: NDArray | float, sun_distance: NDArray | float) -> NDArray:
    a, b, c, d, e = coefficients
    towards_sun = 1.0 + c * np.exp(d * sun_distance) + e * np.cos(sun_distance) ** 2
    return (1.0 + a * np.exp(b / np.cos(zenith_angle))) * towards_sun


@lru_cache(maxsize=4)
def sky_table(sun_elevation: float, turbidity: float) -> NDArray[np.float32]:
    """The sky, which in this model holds no sun."""
    sun_angle = HALF_PI - sun_elevation
    elevation = row_elevations(ROWS)[:, None]
    cosine = np.cos(elevation) * np.cos(sun_elevation) * np.cos(column_azimuths(COLUMNS))
    distance = np.arccos(np.clip(cosine + np.sin(elevation) * np.sin(sun_elevation), -1.0, 1.0))
    angle = np.minimum(HALF_PI - elevation, LARGEST_ZENITH_ANGLE)
    luminance, x, y = (
        value * _perez(c, angle, distance) / _perez(c, 0.0, sun_angle)
        for value, c in zip(_zenith(sun_angle, turbidity), _SLOPES * turbidity + _OFFSETS, strict=True)
    )
    y = np.maximum(y, SMALLEST_Y)
    xyz = np.stack((x / y * luminance, luminance, (1.0 - x - y) / y * luminance), axis=-1)
    table = mirrored(np.clip(xyz, 0.0, LARGEST))
    table.flags.writeable = False
    return table
