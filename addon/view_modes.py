"""What the picture itself shows in place of the render: a pass as it is, or numbers through a colour scale."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.float32]
Reader = Callable[[str], Picture]

VIEW_ITEMS = (
    ("COMBINED", "Combined", "The render"),
    ("DIRECT", "Direct", "Light reflected once at the visible point"),
    ("INDIRECT", "Indirect", "Light that took more turns"),
    ("CELLS", "Cells", "A colour for each cell of reuse"),
    ("CELL_OCCUPANCY", "Cell Occupancy", "Pixels in the same cell: dark blue 1, green 64, white 4096 and more"),
    (
        "CELL_LEVEL",
        "Cell Level",
        "Size of a cell: dark blue the smallest, green doubled 3 times, white 15 times and more",
    ),
    ("NORMAL_BIN", "Normal Bin", "A colour for each direction that cells of reuse are divided by"),
    (
        "RESERVOIR_CONFIDENCE",
        "Reservoir Confidence",
        "Batches of candidates behind a pixel's choice: dark blue 1, green 16, white 256 and more",
    ),
    (
        "RESERVOIR_WEIGHT",
        "Reservoir Weight",
        "Weight of a pixel's light sample: dark blue 0.1 and less, green 100, white 100,000 and more",
    ),
    (
        "REUSE_COUNT",
        "Reuse Count",
        "Samples of other points that a pixel was handed: black none, dark blue 1, green 8, white 64 and more",
    ),
    (
        "LIGHT_CHOICE_ENTROPY",
        "Light Choice Entropy",
        "How many lights matter around a visible point, as learned: dark blue 0.06 nats and less, green 0.7 (two "
        "lights alike), white 8. After the last sample of a final render",
    ),
    (
        "LIGHT_CHOICE_SAMPLES",
        "Light Choice Samples",
        "Effective number of samples that the choice of lights is learned from: black none, dark blue 64, green 4096, "
        "white 262,144 and more. After the last sample of a final render",
    ),
    ("SAMPLE_COUNT", "Sample Count", "Samples of a pixel: dark blue 1, green 64, white 4096 and more"),
    ("GUIDED", "Guided", "White where bounces are guided. After the last sample of a final render"),
)


def with_passes(read: Reader, pictures: dict[str, Picture]) -> Reader:
    """Reads these in place of the passes of the same names."""
    return lambda name: pictures[name] if name in pictures else read(name)


@dataclass(frozen=True)
class LogScale:
    """Maps numbers to colours by their logarithm: `low` and below to the first colour, `high` and above to the last.
    Zero, which means that there is nothing, is black."""

    low: float
    high: float


# View -> the core's pass, and the scale of its numbers (None: it has colours).
SOURCES: dict[str, tuple[str, LogScale | None]] = {
    "DIRECT": ("Direct", None),
    "INDIRECT": ("Indirect", None),
    "CELLS": ("Cells", None),
    "CELL_OCCUPANCY": ("Cell Occupancy", LogScale(1.0, 4096.0)),
    "CELL_LEVEL": ("Cell Level", LogScale(1.0, 16.0)),
    "NORMAL_BIN": ("Normal Bin", None),
    "RESERVOIR_CONFIDENCE": ("Reservoir Confidence", LogScale(1.0, 256.0)),
    "RESERVOIR_WEIGHT": ("Reservoir Weight", LogScale(0.1, 1e5)),
    "REUSE_COUNT": ("Reuse Count", LogScale(1.0, 64.0)),
    "LIGHT_CHOICE_ENTROPY": ("Light Choice Entropy", LogScale(0.0625, 8.0)),
    "LIGHT_CHOICE_SAMPLES": ("Light Choice Samples", LogScale(64.0, 262144.0)),
    "SAMPLE_COUNT": ("Sample Count", LogScale(1.0, 4096.0)),
    "GUIDED": ("Guided", LogScale(0.5, 1.0)),
}

# Dark blue, blue, green, yellow, white in equal steps: brighter at each. Scene-linear Rec. 709.
RAMP = np.array([(0.01, 0.01, 0.12), (0.0, 0.10, 0.45), (0.02, 0.35, 0.12), (0.85, 0.60, 0.04), (1.0, 1.0, 1.0)])


def core_passes(view: str) -> list[str]:
    """The passes of the core that a view needs besides Combined."""
    return [SOURCES[view][0]] if view in SOURCES else []


def shows_cells(view: str) -> bool:
    """Whether a view shows the cells themselves, or how they are made and filled."""
    return view in ("CELLS", "CELL_OCCUPANCY", "CELL_LEVEL", "NORMAL_BIN")


def ramp_colors(numbers: Picture, scale: LogScale) -> Picture:
    """(height, width, 1) -> (height, width, 3)."""
    known = np.isfinite(numbers[..., 0]) & (numbers[..., 0] > 0.0)
    logs = np.log(np.where(known, numbers[..., 0], scale.low) / scale.low) / np.log(scale.high / scale.low)
    steps = np.linspace(0.0, 1.0, len(RAMP))
    colors = np.stack([np.interp(logs, steps, channel) for channel in RAMP.T], axis=-1)
    return (colors * known[..., None]).astype(np.float32)


def reader(view: str, read: Reader) -> Reader:
    """`read` with Combined as the view shows it: opaque where it shows cells and numbers."""
    if view not in SOURCES:
        return read
    source, scale = SOURCES[view]

    def read_view(name: str) -> Picture:
        if name != "Combined":
            return read(name)
        shown = read(source)
        is_light = view in ("DIRECT", "INDIRECT")
        alpha = read("Combined")[..., 3:] if is_light else np.ones_like(shown[..., :1])
        return np.concatenate([shown if scale is None else ramp_colors(shown, scale), alpha], axis=-1)

    return read_view
