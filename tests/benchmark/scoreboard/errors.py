"""Errors of a picture against a reference that has noise of its own, at several scales.

The error of a pixel is the product of its differences to two independent halves of the reference, whose mean over the
reference's noise is the square of its difference to the truth. It is relative to the reference without noise, as a
denoiser sees it: to what its pixels show would make every pixel count more that came out too dark by chance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

TRIM = 0.001  # share of pixels with the largest error that the error per pixel leaves out
FLOOR = 0.01  # added to the squared reference, so that black pixels do not rule
BOXES = (4, 8)


def relative(products: NDArray, base: NDArray) -> NDArray:
    """(height, width): squares of differences or the like over the squared base, mean of the channels."""
    return (products / (base**2 + FLOOR)).mean(axis=2)


def trimmed_mean(values: NDArray, size: NDArray) -> float:
    """Of the values, without those where `size` is largest: the mean of those that are left."""
    count = values.size - int(np.ceil(TRIM * values.size))
    return float(values.ravel()[np.argpartition(size.ravel(), count - 1)[:count]].mean())


def boxes(picture: NDArray, side: int) -> NDArray:
    """Means over side x side pixels; partial boxes are dropped."""
    height, width = (n // side * side for n in picture.shape[:2])
    parts = picture[:height, :width].reshape(height // side, side, width // side, side, -1)
    return parts.mean(axis=(1, 3))


@dataclass(frozen=True)
class Errors:
    """relMSE, the mean of (x - t)² / (t² + 0.01) for the true picture t, as far as the reference can tell."""

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
    base: NDArray  # what errors are relative to: the mean of both without its noise
    guides: dict[str, NDArray]  # albedo and normal, for the denoiser
    samples: int

    @cached_property
    def mean(self) -> NDArray:
        return 0.5 * (self.first + self.second)

    @cached_property
    def noise(self) -> Errors:
        """Of the mean of both halves, by their difference; `ratio`: of their means."""
        half = 0.5 * (self.first - self.second)
        values = relative(half**2, self.base)
        box4, box8 = (float(relative(boxes(half, n) ** 2, boxes(self.base, n)).mean()) for n in BOXES)
        ratio = float(self.first.mean() / self.second.mean())
        return Errors(trimmed_mean(values, values), box4, box8, float(values.mean()), ratio)

    @cached_property
    def resolution(self) -> Errors:
        """The smallest errors that can be told from none."""
        return least_told(self.first, self.second, self.base)

    def squares(self, picture: NDArray) -> NDArray:
        """(height, width): the square of the difference to the mean of both halves, to look at; noise included."""
        return relative((picture - self.mean) ** 2, self.base)

    def errors(self, picture: NDArray) -> Errors:
        """Raises ValueError for a pixel that is not finite. Errors that are too small to be told count as the
        smallest that can."""
        picture = picture.astype(np.float64)
        if not np.isfinite(picture).all():
            raise ValueError(f"{np.count_nonzero(~np.isfinite(picture).all(axis=2))} pixels are not finite")
        values = relative((picture - self.first) * (picture - self.second), self.base)
        pixel = trimmed_mean(values, relative((picture - self.base) ** 2, self.base))
        found, least = replace(self.common((picture, picture)), pixel=pixel), self.resolution
        told = (max(found.at(scale), least.at(scale)) for scale in ("pixel", "box4", "box8", "untrimmed"))
        return Errors(*told, found.ratio)

    def common(self, halves: tuple[NDArray, NDArray]) -> Errors:
        """Errors, none left out, that two pictures have in common: of two with independent noise, their noise is not
        in it. Less than nothing by chance."""
        first, second = halves[0] - self.first, halves[1] - self.second
        at = [float(relative(boxes(first, n) * boxes(second, n), boxes(self.base, n)).mean()) for n in (1, *BOXES)]
        return Errors(at[0], at[1], at[2], at[0], float(0.5 * (halves[0] + halves[1]).mean() / self.mean.mean()))

    def least_common(self, halves: tuple[NDArray, NDArray]) -> Errors:
        """Of such, the smallest that can be told from none."""
        return least_told(halves[0] - self.first, halves[1] - self.second, self.base)


def least_told(first: NDArray, second: NDArray, base: NDArray) -> Errors:
    """By the noise of two halves, at least a standard error of the mean of its products, which need not be Gaussian:
    fourth moments stand for squares of second ones."""
    half = 0.5 * (first - second)

    def deviation(values: NDArray) -> float:
        return float(2.0 * np.sqrt((values**2).sum()) / values.size)

    values = relative(half**2, base)
    box4, box8 = (deviation(relative(boxes(half, n) ** 2, boxes(base, n))) for n in BOXES)
    kept = values[values <= np.quantile(values, 1.0 - TRIM)]
    return Errors(deviation(kept), box4, box8, deviation(values), 0.0)
