"""Statistics for pictures made of independent replicas. The unit of evidence is the replica: pixels of one picture are
correlated, pictures with different seeds are not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

FALSE_ALARM_RATE = 0.01
"""Of one comparison of two pictures; `sidak` shares it out over its values."""


def sidak(false_alarm_rate: float, comparisons: int) -> float:
    """Level of each of `comparisons` tests so that all together have the given false-alarm rate."""
    return 1.0 - (1.0 - false_alarm_rate) ** (1.0 / comparisons)


def block_means(image: NDArray, rows: int, columns: int) -> NDArray:
    """Means over a rows x columns grid of blocks of (height, width, channels), flattened with the channels."""
    parts = [np.array_split(strip, columns, axis=1) for strip in np.array_split(image, rows, axis=0)]
    return np.array([part.astype(np.float64).mean(axis=(0, 1)) for strip in parts for part in strip]).ravel()


@dataclass(frozen=True)
class Comparison:
    """Outcome of a family of t-tests at a stated false-alarm rate."""

    p_value: float  # smallest of the family
    level: float  # p below this is a difference
    worst: int  # index of the smallest p
    largest_z: float
    ratio: float  # sum of all means of `a` over those of `b`
    ratio_error: float  # one standard error
    largest_difference: float  # of the means of a value, over the mean of all values of `b`
    differing: int = 0  # values whose p is below the level

    @property
    def agrees(self) -> bool:
        return self.p_value >= self.level

    def __str__(self) -> str:
        verdict = "agree" if self.agrees else "DIFFER"
        return (
            f"{verdict}: smallest p {self.p_value:.2e} (level {self.level:.1e}) at block value {self.worst}, "
            f"|t| {self.largest_z:.1f}, ratio of means {self.ratio:.5f} ± {self.ratio_error:.5f}, "
            f"largest difference {self.largest_difference:.4f} of the mean"
        )


def compare_replicas(
    a: NDArray, b: NDArray, false_alarm_rate: float = FALSE_ALARM_RATE, floor: float = 0.0
) -> Comparison:
    """Welch's t-test per value of (replicas, values) arrays, Šidák-corrected over the values.

    `floor` is added to the standard error: a stated error of the method that replicas do not show.
    """
    mean_a, mean_b = a.mean(axis=0), b.mean(axis=0)
    variance_a, variance_b = a.var(axis=0, ddof=1) / len(a), b.var(axis=0, ddof=1) / len(b)
    variance = variance_a + variance_b
    # A value without any noise (black background) must agree to rounding; the floor stands for single precision.
    rounding = 1e-5 * np.maximum(np.abs(mean_a), np.abs(mean_b)) + 1e-9 + floor
    t = (mean_a - mean_b) / np.sqrt(variance + rounding**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        freedom = variance**2 / (variance_a**2 / (len(a) - 1) + variance_b**2 / (len(b) - 1))
    freedom = np.where(np.isfinite(freedom), freedom, len(a) + len(b) - 2)
    p = 2.0 * stats.t.sf(np.abs(t), freedom)
    worst = int(np.argmin(p))
    sums_a, sums_b = a.sum(axis=1), b.sum(axis=1)
    ratio = sums_a.mean() / sums_b.mean() if sums_b.mean() else np.nan
    relative = [s.std(ddof=1) / np.sqrt(len(s)) / s.mean() if s.mean() else 0.0 for s in (sums_a, sums_b)]
    error = abs(ratio) * float(np.hypot(*relative))
    largest = float(np.max(np.abs(mean_a - mean_b)) / np.mean(mean_b)) if mean_b.any() else np.inf
    level = sidak(false_alarm_rate, p.size)
    differing = int((p < level).sum())
    return Comparison(float(p[worst]), level, worst, float(abs(t[worst])), ratio, error, largest, differing)


def compare_to_value(a: NDArray, expected: float | NDArray, false_alarm_rate: float = FALSE_ALARM_RATE) -> Comparison:
    """One-sample t-test per value of (replicas, values) against exact values, Šidák-corrected."""
    mean, error = a.mean(axis=0), a.std(axis=0, ddof=1) / np.sqrt(len(a))
    rounding = 1e-5 * np.abs(mean) + 1e-9
    t = (mean - expected) / np.sqrt(error**2 + rounding**2)
    p = 2.0 * stats.t.sf(np.abs(t), len(a) - 1)
    worst = int(np.argmin(p))
    total = float(np.sum(np.broadcast_to(expected, mean.shape)))
    ratio = float(mean.sum()) / total if total else np.nan
    ratio_error = float(a.sum(axis=1).std(ddof=1) / np.sqrt(len(a)) / total) if total else np.nan
    largest = float(np.max(np.abs(mean - expected))) * mean.size / total if total else np.inf
    level = sidak(false_alarm_rate, p.size)
    return Comparison(float(p[worst]), level, worst, float(abs(t[worst])), ratio, ratio_error, largest)


def convergence_slope(errors: dict[int, float]) -> float:
    """Slope of log(mean squared error) against log(samples) by least squares."""
    samples = np.log(np.array(sorted(errors)))
    values = np.log(np.array([errors[n] for n in sorted(errors)]))
    return float(np.polyfit(samples, values, 1)[0])
