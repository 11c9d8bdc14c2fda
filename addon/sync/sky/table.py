"""Rows and columns of sky tables, and the colours in which they are handed on."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ROWS, COLUMNS = 256, 512
HALF_PI = 0.5 * np.pi


@dataclass(frozen=True)
class Atmosphere:
    """Of which a sky is made; equal ones give equal tables. Angles in radians, densities relative to clear air."""

    sun_elevation: float
    altitude: float
    """Of the observer above the ground, in metres."""
    air: float
    aerosol: float
    ozone: float


@dataclass(frozen=True)
class SunDisc:
    """Radiance at the lowest and at the highest point of a sun without limb darkening, in XYZ, linear in between."""

    bottom: NDArray[np.float64]
    top: NDArray[np.float64]


def row_elevations(rows: int = ROWS) -> NDArray[np.float64]:
    """Elevation in radians that a row shows, from straight down to straight up."""
    s = (2.0 * np.arange(rows) + 1.0) / rows - 1.0
    return HALF_PI * s * np.abs(s)


def column_azimuths(columns: int = COLUMNS) -> NDArray[np.float64]:
    """Azimuth in radians from the sun's, of the columns in the first half of a table, which begins behind it."""
    return 2.0 * np.pi * (np.arange(columns // 2) + 0.5) / columns - np.pi


def mirrored(half: NDArray) -> NDArray[np.float32]:
    """The whole table of which `half` is what lies on one side of the sun."""
    return np.ascontiguousarray(np.concatenate((half, half[:, ::-1]), axis=1), np.float32)


def to_rgb(xyz: NDArray, matrix: NDArray) -> NDArray[np.float32]:
    """XYZ times `matrix`; colours that the working space cannot show lose their negative parts."""
    return np.maximum(xyz @ np.asarray(matrix, xyz.dtype).T, 0.0)


def in_threads(row: Callable[[float], NDArray], elevations: Iterable[float]) -> NDArray:
    """The rows of a table; NumPy lets go of the interpreter while it computes."""
    with ThreadPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
        return np.stack(list(pool.map(row, elevations)))
