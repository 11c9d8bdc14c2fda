"""Blender's own colour configuration (OpenColorIO), asked for the colour spaces that `colour` does not know."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import versions

Decode = Callable[[NDArray], NDArray]


@cache
def decoder(name: str, working_space: str) -> Decode | None:
    """What brings stored colours (…, 3 or 1) of a space to the working one; None where that cannot be found out."""
    config = _config()
    if config is None:
        return None
    try:
        convert = config.getProcessor(name, working_space).getDefaultCPUProcessor()
    except versions.colour_reader().Exception:  # there is no such space, or a table of it is missing
        return None

    def decode(colours: NDArray) -> NDArray:
        rgb = np.array(np.broadcast_to(colours, (*colours.shape[:-1], 3)), np.float32)
        convert.applyRGB(rgb)
        return rgb if colours.shape[-1] == 3 else rgb.mean(-1, keepdims=True)  # greys stay so, as in Cycles

    return decode


@cache
def _config() -> Any:  # noqa: ANN401
    """The one that Blender takes, or None without a reader of it."""
    reader = versions.colour_reader()
    own = Path(bpy.utils.system_resource("DATAFILES"), "colormanagement", "config.ocio")
    path = Path(os.environ.get("OCIO") or own)
    if reader is None or not path.is_file():
        return None
    try:
        return reader.Config.CreateFromFile(str(path))
    except reader.Exception:
        return None
