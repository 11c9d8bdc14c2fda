"""Errors of a picture against a reference of known noise, at several scales."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

TRIM = 0.001  # share of pixels with the largest error that the error per pixel leaves out
FLOOR = 0.01  # added to the squared reference, so that black pixels do not rule
BOXES = (4, 8)


def relative_squares(difference: NDArray, base: NDArray) -> NDArray:
    """(height, width): squared difference over squared base, mean of the channels."""
    return (difference**2 / (base**2 + FLOOR)).mean(axis=2)


def trimmed_mean(values: NDArray) -> float:
    count = values.size - int(np.ceil(TRIM * values.size))
    return float(np.partition(values.ravel(), count - 1)[:count].mean())


def boxes(picture: NDArray, side: int) -> NDArray:
    """Means over side x side pixels; partial boxes are dropped."""
    height, width = (n // side * side for n in picture.shape[:2])
    parts = picture[:height, :width].reshape(height // side, side, width // side, side, -1)
    return parts.mean(axis=(1, 3))


@dataclass(frozen=True)
class Errors:
    """relMSE, the mean of (x - r)² / (r² + 0.01), less what the reference's own noise adds to it."""

    pixel: float  # without the 0.1 % worst pixels
    box4: float  # of means over 4 x 4 pixels, and below 8 x 8, all of them
    box8: float
    untrimmed: float  # per pixel, all of them
    ratio: float  # mean of the picture over that of the reference

    def at(self, scale: str) -> float:
        return getattr(self, scale)


@dataclass(frozen=True)
class Reference:
    first: NDArray  # (height, width, 3), two halves independent of each other
    second: NDArray
    guides: dict[str, NDArray]  # albedo and normal, for the denoiser
    samples: int

    @cached_property
    def mean(self) -> NDArray:
        return 0.5 * (self.first + self.second)

    @cached_property
    def noise(self) -> Errors:
        """Of the mean of both halves, by their difference; `ratio`: of their means."""
        half = 0.5 * (self.first - self.second)
        box4, box8 = (float(relative_squares(boxes(half, n), boxes(self.mean, n)).mean()) for n in BOXES)
        values = relative_squares(half, self.mean)
        ratio = float(self.first.mean() / self.second.mean())
        return Errors(trimmed_mean(values), box4, box8, float(values.mean()), ratio)

    def squares(self, picture: NDArray) -> NDArray:
        """(height, width): the error of each pixel, noise of the reference included."""
        return relative_squares(picture - self.mean, self.mean)

    def errors(self, picture: NDArray) -> Errors:
        """Raises ValueError for a pixel that is not finite. What is left after the noise of the reference is taken
        off is at least a tenth of that noise: less cannot be told."""
        picture = picture.astype(np.float64)
        if not np.isfinite(picture).all():
            raise ValueError(f"{np.count_nonzero(~np.isfinite(picture).all(axis=2))} pixels are not finite")
        found = [trimmed_mean(self.squares(picture))]
        for n in BOXES:
            found.append(float(relative_squares(boxes(picture - self.mean, n), boxes(self.mean, n)).mean()))
        found.append(float(self.squares(picture).mean()))
        own = (self.noise.pixel, self.noise.box4, self.noise.box8, self.noise.untrimmed)
        left = [max(error - noise, 0.1 * noise) for error, noise in zip(found, own, strict=True)]
        return Errors(*left, float(picture.mean() / self.mean.mean()))
