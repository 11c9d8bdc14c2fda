"""Denoising of finished pictures: a plain function on arrays, and what a final render makes of it.

`denoise` needs no scene, so that pictures of any engine can be denoised alike.
"""

from collections.abc import Callable

import numpy as np

from .open_image_denoise import NAME, Denoiser, DenoiserError, Picture, is_there
from .view_modes import Reader

__all__ = ["DenoiserError", "denoise", "denoised_combined", "state_sentence", "with_needed_passes"]

# The core's passes: what is denoised, and what guides it. Noisy is Combined without the light that neighbours share:
# they share its noise too, and no denoiser could tell that from the picture.
NOISY_PASS = "Noisy"
GUIDE_PASSES = ("Denoising Albedo", "Denoising Normal")

# Light that neighbours share would not be used.
TECHNIQUES = {"share_visible": 1}

# Denoisers expect that errors of neighbours are independent: where boxes of pixels are stratified together, up to 8 %
# more was left of pictures of few samples (outdoor.py, 1 and 2), and from 16 on as much.
SEQUENCE = "PIXEL_SOBOL"

# The network pads with black: pictures below this size in pixels come out too dark unless they are extended.
SMALLEST_SIDE = 64


def denoise(
    color: Picture,
    albedo: Picture,
    normal: Picture,
    has_clean_guides: bool = False,
    threads: int = 0,
    is_wanted: Callable[[], bool] = lambda: True,
) -> Picture | None:
    """The picture without its noise, or None once `is_wanted` says no (it is asked again and again, from any thread).

    All (height, width, 3): scene-linear radiance without upper limit, share of reflected light, unit normal (0 where
    there is none). Guides that still have noise (`has_clean_guides` off) are denoised first, each by itself. Numbers
    that are not finite count as 0. Raises DenoiserError where the library is absent or fails, ValueError for shapes."""
    if color.ndim != 3 or color.shape[2] != 3 or not color.shape == albedo.shape == normal.shape:
        raise ValueError(f"shapes {color.shape}, {albedo.shape}, {normal.shape}: all must be (height, width, 3)")
    if not is_wanted():
        return None
    try:
        inputs = {"color": prepared(color), "albedo": prepared(albedo), "normal": prepared(normal)}
        with Denoiser(threads) as denoiser:
            output = filtered(denoiser, inputs, has_clean_guides, is_wanted)
    except MemoryError as error:
        raise DenoiserError(f"{NAME} failed: {error}") from error
    if output is None:
        return None
    (top, _), (left, _), _ = margins(color)
    return output[top : top + color.shape[0], left : left + color.shape[1]]


def filtered(
    denoiser: Denoiser, inputs: dict[str, Picture], has_clean_guides: bool, is_wanted: Callable[[], bool]
) -> Picture | None:
    """`color` of the inputs, filtered after the guides; None once nobody wants it."""
    if not has_clean_guides:
        for name in ("albedo", "normal"):
            guide = denoiser.filter({name: inputs[name]}, is_wanted=is_wanted)
            if guide is None:
                return None
            inputs[name] = guide
    return denoiser.filter(inputs, is_hdr=True, has_clean_guides=True, is_wanted=is_wanted)


def margins(picture: Picture) -> list[tuple[int, int]]:
    """Pixels to add before and after, of rows, columns and channels."""
    missing = [max(SMALLEST_SIDE - side, 0) for side in picture.shape[:2]]
    return [*((pixels // 2, pixels - pixels // 2) for pixels in missing), (0, 0)]


def prepared(picture: Picture) -> Picture:
    """A contiguous copy, finite, and mirrored at its edges up to the size that the library needs."""
    finite = np.nan_to_num(np.array(picture, np.float32, order="C"), copy=False, nan=0.0, posinf=0.0, neginf=0.0)
    added = margins(picture)
    return np.ascontiguousarray(np.pad(finite, added, mode="symmetric")) if np.any(added) else finite


def state_sentence() -> str:
    """For the user: what denoising does, or why it cannot."""
    if not is_there():
        return f"This Blender comes without {NAME}: pictures stay as they are."
    return "The finished picture is filtered, guided by the colours and normals of surfaces."


def with_needed_passes(core_passes: list[str]) -> list[str]:
    """The core's passes to ask for besides Combined, and with them those that denoising reads."""
    return list(dict.fromkeys([*core_passes, NOISY_PASS, *GUIDE_PASSES]))


def denoised_combined(read: Reader, threads: int, is_wanted: Callable[[], bool]) -> Picture | None:
    """Combined (red, green, blue, alpha) of a finished session, denoised; None once it is not wanted.

    Colours are multiplied by alpha before and after. Alpha has no noise to speak of and stays as it is, and so does a
    pixel in which nothing was found: no glow may reach a transparent film. Raises DenoiserError."""
    noisy = read(NOISY_PASS)
    color = denoise(noisy[..., :3], *map(read, GUIDE_PASSES), threads=threads, is_wanted=is_wanted)
    if color is None:
        return None
    return np.where(noisy.any(axis=2, keepdims=True), np.concatenate([color, noisy[..., 3:]], axis=2), noisy)
