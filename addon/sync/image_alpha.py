"""What Cycles makes of an image's alpha: the file decides about its colours, Blender's setting only whether to look;
from Blender 5.1 on the setting decides about colours, too.

Followed in Cycles' `scene/image_oiio.cpp` (files on disk) and `blender/image.cpp` (packed, painted, generated images,
which Cycles reads from Blender's buffers), and measured for every format and setting against Blender 5.0, and for most
against 5.2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .versions import alpha_mode_decides

# Files without a word about their alpha whose colours Cycles multiplies all the same.
_FORMATS_TAKEN_FOR_STRAIGHT = {"dds", "psd"}
_PREMULTIPLIED_TARGA = 4
_ROWS_AT_A_TIME = 256


@dataclass(frozen=True)
class FilePixels:
    """A decoded file: pixels as stored, and whether Cycles multiplies their colours by alpha."""

    pixels: NDArray
    is_straight: bool


def is_straight(format_name: str, channels: int, attribute: Callable[[str, int], int]) -> bool:
    """Whether Cycles multiplies the colours of a file by its alpha: never with other than four channels.

    `attribute` reads OpenImageIO's header of the file, by name and with a value for what is not there.
    """
    if channels != 4:
        return False
    if format_name == "targa":
        return attribute("targa:alpha_type", -1) != _PREMULTIPLIED_TARGA
    return attribute("oiio:UnassociatedAlpha", 0) != 0 or format_name in _FORMATS_TAKEN_FOR_STRAIGHT


def alpha_of_file(alpha_mode: str, is_data: bool, is_straight: bool, channels: int = 4) -> str:
    """Name of native/scene/image.h's AlphaMode for a file on disk. From Blender 5.1 on its setting decides where there
    are four channels, not the file."""
    if alpha_mode_decides() and channels == 4:
        is_straight = alpha_mode == "STRAIGHT"
    return _without_colours(alpha_mode, is_data) or ("STRAIGHT" if is_straight else "PREMULTIPLIED")


def alpha_of_buffer(alpha_mode: str, is_data: bool, pixels: NDArray) -> str:
    """The same for pixels of Blender's own buffers: bytes are straight, floats multiplied, whatever the setting; from
    5.1 on the setting says what Cycles takes them for."""
    return alpha_of_file(alpha_mode, is_data, pixels.dtype == np.uint8, pixels.shape[2])


def alpha_of_packed(alpha_mode: str, is_data: bool) -> str:
    """The same for a packed file, whose floats Blender multiplies as it reads them if they are not marked PREMUL."""
    return alpha_of_file(alpha_mode, is_data, alpha_mode == "STRAIGHT")


def packed_needs_blender(alpha_mode: str, is_data: bool, pixels: NDArray, is_linear: bool) -> bool:
    """Whether a packed file's stored pixels differ from what Blender makes of them as it reads.

    It divides bytes marked PREMUL by alpha (and clips them), and decodes floats before it multiplies.
    """
    if _without_colours(alpha_mode, is_data) or pixels.shape[2] not in (2, 4):
        return False
    if pixels.dtype == np.uint8:
        return alpha_mode == "PREMUL"
    is_multiplied_again = alpha_mode_decides() and alpha_mode == "STRAIGHT"
    return is_multiplied_again or not is_linear


def decoded(pixels: NDArray, alpha: str, decode: Callable[[NDArray], NDArray]) -> NDArray:
    """Linear pixels of encoded ones: halves, floats where those were. Alpha multiplies or ignores the colours.

    Colours that stand multiplied are divided by alpha to be decoded, as Cycles' `scene/colorspace.cpp` does.
    """
    largest = np.iinfo(pixels.dtype).max if np.issubdtype(pixels.dtype, np.integer) else 1.0
    linear = np.empty(pixels.shape, np.float32 if pixels.dtype == np.float32 else np.float16)
    has_alpha = pixels.shape[2] in (2, 4)
    colours = pixels.shape[2] - has_alpha
    for row in range(0, len(pixels), _ROWS_AT_A_TIME):
        values = pixels[row : row + _ROWS_AT_A_TIME].astype(np.float32) / np.float32(largest)
        colour, weight = values[:, :, :colours], 1.0
        if has_alpha and alpha == "STRAIGHT":
            weight = values[:, :, colours:]
        if has_alpha and alpha == "PREMULTIPLIED":
            weight = np.where(values[:, :, colours:] > 0.0, values[:, :, colours:], 1.0)
            colour = colour / weight
        values[:, :, :colours] = weight * decode(colour)
        linear[row : row + _ROWS_AT_A_TIME] = np.clip(values, None, np.finfo(linear.dtype).max)
    return linear


def _without_colours(alpha_mode: str, is_data: bool) -> str | None:
    """The AlphaMode where colours and alpha have nothing to do with each other."""
    if alpha_mode == "NONE":
        return "IGNORED"
    return "INDEPENDENT" if is_data or alpha_mode == "CHANNEL_PACKED" else None
