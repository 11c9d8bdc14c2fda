"""A fitted sky over ground of some albedo, for a sun above the horizon in air of some turbidity.

[Hosek and Wilkie 2012] An Analytic Model for Full Spectral Sky-Dome Radiance: eq. 8, whose nine coefficients and mean
radiance are Bezier curves over the cube root of the sun's elevation (eq. 11) and linear in turbidity and albedo between
those that were fitted. Here each of X, Y and Z is such a sky. The curves are not the authors' tables: they were found
again from what Blender's node shows, by `tests/benchmark/hosek_wilkie.py`, to 0.01 % on average where no
colour is cut off.

As in Blender only the distance to the sun changes below the horizon, and a sun below it counts as one at it.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from .table import HALF_PI, column_azimuths, mirrored, row_elevations

ROWS, COLUMNS = 512, 1024  # the brightness has a cusp at the sun
LARGEST_ZENITH_ANGLE = HALF_PI - 0.001
SMALLEST_TURBIDITY, LARGEST_TURBIDITY = 1.0, 10.0
CURVES = Path(__file__).with_name("hosek_wilkie.npz")


@lru_cache(maxsize=1)
def _curves() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Chebyshev series over the cube root of the elevation. `shape`: (turbidity 1 to 10, albedo 0 and 1, XYZ, power,
    A B E H); `radiance`: (turbidity in halves, albedo in halves, XYZ, power, what C D F G and I are times the mean
    radiance), which is quadratic in between."""
    with np.load(CURVES) as curves:
        return curves["shape"].astype(np.float64), curves["radiance"].astype(np.float64)


def _through_three(x: float) -> NDArray[np.float64]:
    """Weights of what is at 0, 1/2 and 1 in the parabola through it, at x."""
    return np.array(((2.0 * x - 1.0) * (x - 1.0), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)))


def coefficients(sun_elevation: float, turbidity: float, albedo: float) -> NDArray[np.float64]:
    """(XYZ, A B E H C D F G I), the last five times the mean radiance."""
    shape, radiance = _curves()
    turbidity = float(np.clip(turbidity, SMALLEST_TURBIDITY, LARGEST_TURBIDITY))
    albedo = float(np.clip(albedo, 0.0, 1.0))
    below = min(int(turbidity - SMALLEST_TURBIDITY), len(shape) - 2)
    part = turbidity - SMALLEST_TURBIDITY - below
    place = np.array((2.0 * np.cbrt(np.clip(sun_elevation, 0.0, HALF_PI) / HALF_PI) - 1.0,))
    linear = np.einsum("t,a,takps->kps", (1.0 - part, part), (1.0 - albedo, albedo), shape[below : below + 2])
    curved = np.einsum(
        "t,a,takps->kps", _through_three(part), _through_three(albedo), radiance[2 * below : 2 * below + 3]
    )
    series = [chebvander(place, curves.shape[1] - 1)[0] for curves in (linear, curved)]
    return np.concatenate((series[0] @ linear, series[1] @ curved), axis=1)


def radiance(coefficients: NDArray, cos_zenith: NDArray, sun_distance: NDArray) -> NDArray:
    """Of one of X, Y and Z, by the cosine of the angle to the zenith and by the angle to the sun [eq. 8]."""
    a, b, e, h, c, d, f, g, i = coefficients
    cosine = np.cos(sun_distance)
    mie = (1.0 + cosine**2) / (1.0 + h**2 - 2.0 * h * cosine) ** 1.5
    towards_sun = c + d * np.exp(e * sun_distance) + f * cosine**2 + g * mie + i * np.sqrt(cos_zenith)
    return (1.0 + a * np.exp(b / (cos_zenith + 0.01))) * towards_sun


@lru_cache(maxsize=4)
def sky_table(sun_elevation: float, turbidity: float, albedo: float) -> NDArray[np.float32]:
    """The sky, which in this model holds no sun. Thick air under a low sun has some colours below 0, as in Blender."""
    sun_elevation = max(sun_elevation, 0.0)
    elevation = row_elevations(ROWS)[:, None]
    cosine = np.cos(elevation) * np.cos(sun_elevation) * np.cos(column_azimuths(COLUMNS))
    distance = np.arccos(np.clip(cosine + np.sin(elevation) * np.sin(sun_elevation), -1.0, 1.0))
    cos_zenith = np.cos(np.minimum(HALF_PI - elevation, LARGEST_ZENITH_ANGLE))
    curves = coefficients(sun_elevation, turbidity, albedo)
    table = mirrored(np.stack([radiance(c, cos_zenith, distance) for c in curves], axis=-1))
    table.flags.writeable = False
    return table
