"""Colour spaces of images: the curve and the matrix that lead to the file's working space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .colour_config import Decode, decoder

_D65, _D60, _E = (0.3127, 0.3290), (0.32168, 0.33767), (1.0 / 3.0, 1.0 / 3.0)
_REC709 = ((0.640, 0.330), (0.300, 0.600), (0.150, 0.060))
_REC2020 = ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046))
_P3 = ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060))
_AP1 = ((0.713, 0.293), (0.165, 0.830), (0.128, 0.044))
_AP0 = ((0.7347, 0.2653), (0.0, 1.0), (0.0001, -0.0770))
_XYZ = ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0))  # the tristimulus values themselves

# Blender's name -> (curve, primaries, white).
_SPACES = {
    "sRGB": ("SRGB", _REC709, _D65),
    "Linear Rec.709": ("LINEAR", _REC709, _D65),
    "Linear": ("LINEAR", _REC709, _D65),
    "Linear Rec.2020": ("LINEAR", _REC2020, _D65),
    "Linear DCI-P3 D65": ("LINEAR", _P3, _D65),
    "Display P3": ("SRGB", _P3, _D65),
    "ACEScg": ("LINEAR", _AP1, _D60),
    "ACES2065-1": ("LINEAR", _AP0, _D60),
    "Linear CIE-XYZ D65": ("LINEAR", _XYZ, _D65),
    "Linear CIE-XYZ E": ("LINEAR", _XYZ, _E),
}
REC709_SPACE = "Linear Rec.709"
_DATA_SPACES = {"Non-Color", "Raw"}
_UNCHANGED_SPACES = _DATA_SPACES | {"scene_linear", ""}

_BRADFORD = np.array(((0.8951, 0.2664, -0.1614), (-0.7502, 1.7135, 0.0367), (0.0389, -0.0685, 1.0296)))


@dataclass(frozen=True)
class ImageColour:
    """How stored values become working-space ones; see native/scene/image.h."""

    transfer: str
    matrix: tuple[float, ...] | None
    is_known: bool = True
    is_data: bool = False
    """Not colours: alpha, if any, is a channel like the others."""
    is_filtered_linear: bool = False
    """Cycles decodes such an image once, before it filters. Of encoded ones only sRGB is filtered as it is stored, and
    only where the working space has its primaries."""
    decode: Decode | None = None
    """With the above: from stored colours to the working space, in place of curve and matrix."""


def image_colour(name: str, working_space: str) -> ImageColour:
    """Decoding of an image whose colour space Blender calls `name`; one that nobody knows is taken for sRGB."""
    if name in _UNCHANGED_SPACES or name == working_space:
        return ImageColour("LINEAR", None, is_data=name in _DATA_SPACES)
    known = name in _SPACES
    decode = None if known else decoder(name, working_space)
    if decode is not None:
        return ImageColour("SRGB", None, is_filtered_linear=True, decode=decode)
    curve, primaries, white = _SPACES[name if known else "sRGB"]
    _, working_primaries, working_white = _SPACES[known_space(working_space)]
    is_working = (primaries, white) == (working_primaries, working_white)
    filtered_linear = known and curve != "LINEAR" and not (name == "sRGB" and is_working)
    if is_working:
        return ImageColour(curve, None, known, is_filtered_linear=filtered_linear)
    to_xyz = _adapted(rgb_to_xyz(primaries, white), white)
    from_xyz = np.linalg.inv(_adapted(rgb_to_xyz(working_primaries, working_white), working_white))
    return ImageColour(curve, tuple((from_xyz @ to_xyz).ravel().tolist()), known, is_filtered_linear=filtered_linear)


def known_space(working_space: str) -> str:
    """The one of ours that a working space is: other configurations have longer names for it, as `ACES - ACEScg`. One
    that is of no name we know is taken for Rec. 709."""
    linear = (name for name, (curve, *_) in _SPACES.items() if curve == "LINEAR" and name != "Linear")
    return next((name for name in linear if name.removeprefix("Linear ") in working_space), REC709_SPACE)


def luminance_weights(working_space: str) -> tuple[float, ...]:
    """What the channels of a colour of the working space add to its luminance; together 1."""
    _, primaries, white = _SPACES[known_space(working_space)]
    return tuple(_adapted(rgb_to_xyz(primaries, white), white)[1].tolist())


def rgb_to_xyz(primaries: tuple[tuple[float, float], ...], white: tuple[float, float]) -> NDArray[np.float64]:
    """The matrix that sends each primary to its chromaticity and (1, 1, 1) to the white of luminance 1."""
    if primaries == _XYZ:
        return np.eye(3)
    columns = np.array([(x, y, 1.0 - x - y) for x, y in primaries]).T
    return columns * np.linalg.solve(columns, _white_xyz(white))


def srgb_to_linear(values: NDArray) -> NDArray:
    """[IEC 61966-2-1]"""
    above = np.maximum((values + 0.055) / 1.055, 0.0) ** 2.4
    return np.where(values < 0.04045, np.maximum(values, 0.0) / 12.92, above)


def _adapted(to_xyz: NDArray[np.float64], white: tuple[float, float]) -> NDArray[np.float64]:
    """The same colours under D65 (Bradford)."""
    gain = (_BRADFORD @ _white_xyz(_D65)) / (_BRADFORD @ _white_xyz(white))
    return np.linalg.inv(_BRADFORD) @ np.diag(gain) @ _BRADFORD @ to_xyz


def _white_xyz(white: tuple[float, float]) -> NDArray[np.float64]:
    x, y = white
    return np.array((x / y, 1.0, (1.0 - x - y) / y))
