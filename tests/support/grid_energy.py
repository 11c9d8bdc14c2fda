"""How much of a picture's error follows the cells of a grid in the scene: a number for a visible grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MIN_PIXELS = 8
"""Smaller cells tell little about their mean."""

NORMAL_BINS_PER_FACE = 3
"""Along both sides of each face of a cube of directions: bins 30 degrees wide, one of them about the axis."""


@dataclass(frozen=True)
class GridEnergy:
    """`aligned`: mean square of the error's cell means, over that within cells, of what is not smooth.
    `displaced`: the same for cells of the same size that lie elsewhere, mean and standard deviation over displacements:
    what blotches of no relation to the cells give. `amplitude`: root mean square, in the unit of the error, of what the
    true cells have beyond the displaced ones."""

    aligned: float
    displaced: float
    displaced_deviation: float
    amplitude: float

    @property
    def ratio(self) -> float:
        """1 where errors do not know of the cells."""
        return self.aligned / self.displaced

    @property
    def z(self) -> float:
        """Standard deviations of the displaced grids by which the true one stands out."""
        return (self.aligned - self.displaced) / self.displaced_deviation


def normal_bins(normals: NDArray) -> NDArray:
    """Bin of each direction of (n, 3)."""
    face = np.abs(normals).argmax(axis=1)
    row = np.arange(len(normals))
    longest = normals[row, face]
    sides = np.stack([normals[row, (face + 1) % 3], normals[row, (face + 2) % 3]], 1) / np.abs(longest)[:, None]
    places = np.clip((np.arctan(sides) / np.pi * 2.0 + 0.5) * NORMAL_BINS_PER_FACE, 0, NORMAL_BINS_PER_FACE - 1)
    u, v = places.astype(np.int64).T
    return ((2 * face + (longest > 0)) * NORMAL_BINS_PER_FACE + u) * NORMAL_BINS_PER_FACE + v


def cell_labels(positions: NDArray, normals: NDArray, origin: NDArray, edges: NDArray) -> NDArray:
    """Number of each point's cell, counting up from 0 without gaps."""
    key = normal_bins(normals)
    for cell in np.floor((positions - origin) / edges).astype(np.int64).T:
        key = key * (np.ptp(cell) + 1) + (cell - cell.min())
    return np.unique(key, return_inverse=True)[1].ravel()


@dataclass(frozen=True)
class Grids:
    """Labels of the cells of a grid, and of the same grid displaced: to compare with, and to smooth by."""

    true: NDArray
    displaced: list[NDArray]
    smoothing: list[NDArray]


def make_grids(positions: NDArray, normals: NDArray, origin: NDArray, edges: NDArray, displacements: int = 24) -> Grids:
    """For (pixels, 3) surface points and the grid of cells with corner `origin`."""
    random = np.random.default_rng(7)
    corners = [origin + random.uniform(0.0, 1.0, 3) * edges for _ in range(2 * displacements)]
    labels = [cell_labels(positions, normals, corner, edges) for corner in (origin, *corners)]
    return Grids(labels[0], labels[1 : 1 + displacements], labels[1 + displacements :])


def cell_means(errors: NDArray, labels: NDArray) -> NDArray:
    """(pixels, channels): the mean of each pixel's cell."""
    counts = np.bincount(labels)[:, None]
    return (np.stack([np.bincount(labels, channel) for channel in errors.T], 1) / counts)[labels]


def between_and_within(errors: NDArray, labels: NDArray) -> tuple[float, float, float]:
    """Of (pixels, channels): mean square between cells, mean square within, both equal in the mean for independent
    pixels of mean zero; and pixels per cell, times which a step of each cell adds its variance to the first."""
    counts = np.bincount(labels)
    large = counts >= MIN_PIXELS
    kept = large[labels]
    errors, labels = errors[kept], labels[kept]
    counts = counts[large]
    if len(counts) == 0:
        raise ValueError(f"no cell has {MIN_PIXELS} pixels")
    compact = np.cumsum(large) - 1
    sums = np.stack([np.bincount(compact[labels], channel) for channel in errors.T], 1)
    means = sums / counts[:, None]
    between = float((counts[:, None] * means**2).sum() / means.size)
    residual = errors - means[compact[labels]]
    within = float((residual**2).sum() / (errors.shape[1] * (len(errors) - len(counts))))
    return between, within, len(errors) / len(counts)


def grid_energy(errors: NDArray, grids: Grids) -> GridEnergy:
    """Of (pixels, channels). What is smooth at the scale of cells, such as a bias by brightness, is taken off first."""
    errors = errors - np.mean([cell_means(errors, labels) for labels in grids.smoothing], axis=0)
    between, within, pixels_per_cell = between_and_within(errors, grids.true)
    displaced = [b / w for b, w, _ in (between_and_within(errors, labels) for labels in grids.displaced)]
    elsewhere = float(np.mean(displaced))
    amplitude = float(np.sqrt(max(between - within * elsewhere, 0.0) / pixels_per_cell))
    return GridEnergy(between / within, elsewhere, float(np.std(displaced, ddof=1)), amplitude)
