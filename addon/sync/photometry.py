"""Files of how bright luminaires are in which direction (ANSI/IES LM-63), and tables of them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

WATT_PER_CANDELA = 4.0 * math.pi / 177.83
"""Power of a lamp that sends one candela in all directions, by the luminous efficacy of D65; as Cycles has it."""

TYPE_C, TYPE_B, TYPE_A = 1, 2, 3
COLUMNS, ROWS = 181, 361  # of tables: 2 degrees around the luminaire, half a degree from its axis


@dataclass(frozen=True)
class Photometry:
    """Watts (around, down) at angles in degrees: around the axis, where a full circle includes both ends, and from
    straight down on. Nothing is sent beyond the first and the last."""

    around: NDArray[np.float64]
    down: NDArray[np.float64]
    watts: NDArray[np.float64]

    def table(self) -> NDArray[np.float32]:
        """(ROWS, COLUMNS): `down` 0 to 180 degrees, `around` 0 to 360, cubic in between, at least 0."""
        rows, columns = np.linspace(0.0, 180.0, ROWS), np.linspace(0.0, 360.0, COLUMNS)
        last = len(self.down) - 1
        # Beyond straight down the other side goes on, taken to be alike.
        lines = np.stack([_cubic(self.down, line, rows, (1, last)) for line in self.watts])
        # Where a circle closes the curve has a kink, as in Cycles.
        last = len(self.around) - 1
        ends = (0, last - 1) if self.around[-1] - self.around[0] == 360.0 else (0, last)
        values = np.stack([_cubic(self.around, line, columns, ends) for line in lines.T])
        inside = np.logical_and.outer(_lies_in(rows, self.down), _lies_in(columns, self.around))
        return np.where(inside, np.maximum(values, 0.0), 0.0).astype(np.float32)


def _lies_in(angles: NDArray, knots: NDArray) -> NDArray[np.bool_]:
    return (angles >= knots[0]) & (angles <= knots[-1])


def _cubic(knots: NDArray, values: NDArray, at: NDArray, ends: tuple[int, int]) -> NDArray:
    """Catmull-Rom as if knots were even; `ends` are the indices that stand in before the first and after the last."""
    if len(knots) < 2:
        return np.full(len(at), values[0])
    i = np.clip(np.searchsorted(knots, at, "left") - 1, 0, len(knots) - 2)
    x = (np.clip(at, knots[0], knots[-1]) - knots[i]) / (knots[i + 1] - knots[i])
    padded = np.concatenate([values[[ends[0]]], values, values[[ends[1]]]])
    a, b, c, d = (padded[i + k] for k in range(4))
    return b + 0.5 * x * (c - a + x * (2.0 * a - 5.0 * b + 4.0 * c - d + x * (3.0 * (b - c) + d - a)))


def parse(text: str) -> Photometry:
    """Raises ValueError, with a reason, for what is no such file."""
    numbers = _numbers_after_tilt(text)
    try:
        _lamps, _lumens, factor, down_count, around_count, kind = (next(numbers) for _ in range(6))
        _unit, _width, _length, _height, ballast, future_use, _input_watts = (next(numbers) for _ in range(7))
        down_count, around_count = int(down_count), int(around_count)
        if down_count < 1 or around_count < 1:
            raise ValueError("no angles")
        down = np.array([next(numbers) for _ in range(down_count)])
        around = np.array([next(numbers) for _ in range(around_count)])
        candela = np.array([next(numbers) for _ in range(down_count * around_count)]).reshape(around_count, down_count)
    except StopIteration:
        raise ValueError("it ends too early") from None
    if not (np.isfinite(candela).all() and np.all(np.diff(down) > 0.0) and np.all(np.diff(around) > 0.0)):
        raise ValueError("its angles do not increase, or its values are not finite")
    watts = candela * (factor * ballast * future_use * WATT_PER_CANDELA)
    whole_circle = {TYPE_A: _of_type_a, TYPE_B: _of_type_b, TYPE_C: _of_type_c}.get(int(kind))
    if whole_circle is None:
        raise ValueError(f"its photometric type is {kind:g}")
    return whole_circle(around, down, watts)


def _numbers_after_tilt(text: str) -> Iterator[float]:
    """The numbers that follow the keywords; those of a tilt are skipped."""
    lines = text.replace(",", " ").splitlines()
    start = next((i for i, line in enumerate(lines) if line.strip().upper().startswith("TILT=")), None)
    if start is None:
        raise ValueError("it has no line TILT=")

    def numbers() -> Iterator[float]:
        for word in " ".join(lines[start + 1 :]).split():
            try:
                yield float(word)
            except ValueError:
                raise ValueError(f"{word!r} is not a number") from None

    stream = numbers()
    if lines[start].strip()[len("TILT=") :].strip().upper() == "INCLUDE":
        next(stream, None)  # how the lamp lies in the luminaire
        for _ in range(2 * int(next(stream, 0.0))):
            next(stream, None)
    return stream


def _mirrored(around: NDArray, watts: NDArray, middle: float) -> tuple[NDArray, NDArray]:
    """The same again, mirrored at the last angle, which is `middle`."""
    return np.concatenate([around, 2.0 * middle - around[-2::-1]]), np.concatenate([watts, watts[-2::-1]])


def _of_type_c(around: NDArray, down: NDArray, watts: NDArray) -> Photometry:
    """Around a vertical axis, as street and room lighting: a full circle, a half, a quarter, or all the same."""
    if around[0] == 90.0:
        around = around - 90.0
    if around[0] != 0.0 or down[0] not in (0.0, 90.0):
        raise ValueError("its angles do not begin at 0 or 90 degrees")
    if len(around) == 1:
        around, watts = np.array([0.0, 360.0]), np.concatenate([watts, watts])
    for middle in (90.0, 180.0):
        if around[-1] == middle:
            around, watts = _mirrored(around, watts, middle)
    if around[-1] != 360.0:
        if 360.0 - around[-1] not in (around[1] - around[0], around[-1] - around[-2]):
            raise ValueError(f"it ends at {around[-1]:g} degrees around")
        around, watts = np.append(around, 360.0), np.concatenate([watts, watts[:1]])
    return Photometry(around, down, watts)


def _of_type_b(around: NDArray, down: NDArray, watts: NDArray) -> Photometry:
    """Around a horizontal axis, as floodlights: both angles reach from -90 or 0 to 90 degrees."""
    around, down, watts = down, around, watts.T
    if around[-1] != 90.0 or down[-1] != 90.0:
        raise ValueError("its angles do not end at 90 degrees")
    if around[0] == 0.0:
        around, watts = np.concatenate([-around[:0:-1], around]), np.concatenate([watts[:0:-1], watts])
    if down[0] == 0.0:
        down, watts = np.concatenate([-down[:0:-1], down]), np.concatenate([watts[:, :0:-1], watts], 1)
    return Photometry(around + 90.0, down + 90.0, watts)


def _of_type_a(around: NDArray, down: NDArray, watts: NDArray) -> Photometry:
    """Of headlights: angles from -90 or 0 to 90 degrees."""
    if around[0] == 0.0:
        around, watts = np.concatenate([-around[:0:-1], around]), np.concatenate([watts[:0:-1], watts])
    return Photometry(180.0 - around[::-1], down + 90.0, watts[::-1])
