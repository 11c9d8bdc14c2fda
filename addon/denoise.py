"""Denoising of pictures: plain functions on arrays, and what a final render and a 3D viewport make of them.

`denoise` and `denoise_layers` need no scene, so that pictures of any engine can be denoised alike. A picture comes in
layers, each filtered by itself, since what is sharp in one would else be taken for noise of another: shadows of direct
light in the noise of indirect light, and above all lamps in view, whose glow a filter spreads over dark neighbours.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .open_image_denoise import (
    BALANCED_QUALITY,
    FAST_QUALITY,
    HIGH_QUALITY,
    NAME,
    Denoiser,
    DenoiserError,
    Picture,
    is_there,
)
from .view_modes import Reader

__all__ = [
    "DenoiserError",
    "Layers",
    "denoise",
    "denoise_layers",
    "denoise_quickly",
    "denoised_combined",
    "layers_of",
    "quickly_denoised_combined",
    "state_sentence",
    "viewport_sentence",
    "with_needed_passes",
    "with_noisy",
    "with_quick_passes",
]

# The core's passes: parts of Combined, which is what is denoised, and what guides that.
LAYER_PASSES = ("Indirect", "Emission", "Emission Noise")
GUIDE_PASSES = ("Denoising Albedo", "Denoising Normal")

# What is read for a quick picture: filtering indirect light by itself would take as long again.
EMISSION_PASSES = LAYER_PASSES[1:]
QUICK_PASSES = (*EMISSION_PASSES, *GUIDE_PASSES)

# Combined as it was before, by Cycles' name for it; of which the core knows nothing.
NOISY_PASS = "Noisy Image"

# From so many samples on guides have so little noise that quick filters take them for clean, which keeps patterns. With
# fewer that leaves up to half more noise.
CLEAN_GUIDE_SAMPLES = 8

# Light paths that visible points share are chosen with denoisers in mind.
TECHNIQUES = {"use_share_for_denoiser": True}

# Denoisers expect that errors of neighbours are independent: where boxes of pixels are stratified together, up to 8 %
# more was left of pictures of few samples (outdoor.py, 1 and 2), and from 16 on as much.
SEQUENCE = "PIXEL_SOBOL"

# The network pads with black: pictures below this size in pixels come out too dark unless they are extended.
SMALLEST_SIDE = 64

# Emission in view is left as it is where the variance of its noise, over so many pixels to a side, is at most the first
# share of its square, and filtered with direct light from the second on: sharp lamps have noise at their edges alone,
# and lamps out of focus are nothing but noise.
NOISE_SIDE = 7
NOISE_SHARES = (0.1, 0.4)

# Rounding, as a share of the picture, by which a layer may be below zero.
ROUNDING = 1e-4


@dataclass(frozen=True)
class Layers:
    """Parts of a picture, which is their sum: each (height, width, 3), scene-linear radiance without upper limit."""

    scattered: Picture  # all that is in no other: direct light and the environment
    indirect: Picture | None = None
    kept: Picture | None = None  # added as it is


def denoise(
    color: Picture,
    albedo: Picture,
    normal: Picture,
    has_clean_guides: bool = False,
    threads: int = 0,
    is_wanted: Callable[[], bool] = lambda: True,
) -> Picture | None:
    """`denoise_layers` of a picture that is not taken apart."""
    return denoise_layers(Layers(color), albedo, normal, has_clean_guides, threads, is_wanted)


def denoise_layers(
    layers: Layers,
    albedo: Picture,
    normal: Picture,
    has_clean_guides: bool = False,
    threads: int = 0,
    is_wanted: Callable[[], bool] = lambda: True,
) -> Picture | None:
    """The picture without its noise, or None once `is_wanted` says no (it is asked again and again, from any thread).

    Guides are (height, width, 3): share of reflected light, unit normal (0 where there is none). Those that still have
    noise (`has_clean_guides` off) are denoised first, each by itself. Numbers that are not finite count as 0. Raises
    DenoiserError where the library is absent or fails, ValueError for shapes."""
    check_shapes(layers, albedo, normal)
    if not is_wanted():
        return None
    try:
        guides: dict[str, Picture] = {"albedo": prepared(albedo), "normal": prepared(normal)}
        with Denoiser(threads) as denoiser:
            if not has_clean_guides:
                for name, noisy in guides.items():
                    guide = denoiser.filter({name: noisy}, is_wanted=is_wanted)
                    if guide is None:
                        return None
                    guides[name] = guide
            return filtered(denoiser, layers, guides, is_wanted)
    except MemoryError as error:
        raise DenoiserError(f"{NAME} failed: {error}") from error


def denoise_quickly(
    layers: Layers,
    albedo: Picture,
    normal: Picture,
    has_clean_guides: bool,
    threads: int,
    is_wanted: Callable[[], bool],
) -> Picture | None:
    """`denoise_layers` with guides as they are, noisy or clean: of a single layer and few samples in a sixteenth of the
    time with about 15 % more error. The library's lesser qualities also stop sooner once they are not wanted."""
    check_shapes(layers, albedo, normal)
    quality = BALANCED_QUALITY if has_clean_guides else FAST_QUALITY  # a finer filter pays once there is little noise
    try:
        guides = {"albedo": prepared(albedo), "normal": prepared(normal)}
        with Denoiser(threads) as denoiser:
            return filtered(denoiser, layers, guides, is_wanted, has_clean_guides, quality)
    except MemoryError as error:
        raise DenoiserError(f"{NAME} failed: {error}") from error


def check_shapes(layers: Layers, albedo: Picture, normal: Picture) -> None:
    """Raises ValueError."""
    parts = [part for part in (*vars(layers).values(), albedo, normal) if part is not None]
    shapes = [part.shape for part in parts]
    if len(set(shapes)) > 1 or len(shapes[0]) != 3 or shapes[0][2] != 3:
        raise ValueError(f"shapes {', '.join(map(str, shapes))}: all must be (height, width, 3)")


def filtered(
    denoiser: Denoiser,
    layers: Layers,
    guides: dict[str, Picture],
    is_wanted: Callable[[], bool],
    has_clean_guides: bool = True,
    quality: int = HIGH_QUALITY,
) -> Picture | None:
    """The sum of the filtered layers; None once nobody wants it."""
    (top, _), (left, _), _ = margins(layers.scattered)
    height, width, _ = layers.scattered.shape
    total = np.zeros(layers.scattered.shape, np.float32)
    for layer in (layers.scattered, layers.indirect):
        if layer is None or not layer.any():
            continue
        inputs = {"color": prepared(layer)} | guides
        output = denoiser.filter(
            inputs, is_hdr=True, has_clean_guides=has_clean_guides, quality=quality, is_wanted=is_wanted
        )
        if output is None:
            return None
        total += output[top : top + height, left : left + width]
    return total if layers.kept is None else total + finite(layers.kept)


def finite(picture: Picture) -> Picture:
    """A contiguous copy with 0 in place of what is not finite."""
    return np.nan_to_num(np.array(picture, np.float32, order="C"), copy=False, nan=0.0, posinf=0.0, neginf=0.0)


def margins(picture: Picture) -> list[tuple[int, int]]:
    """Pixels to add before and after, of rows, columns and channels."""
    missing = [max(SMALLEST_SIDE - side, 0) for side in picture.shape[:2]]
    return [*((pixels // 2, pixels - pixels // 2) for pixels in missing), (0, 0)]


def prepared(picture: Picture) -> Picture:
    """A contiguous copy, finite, and mirrored at its edges up to the size that the library needs."""
    added = margins(picture)
    copy = finite(picture)
    return np.ascontiguousarray(np.pad(copy, added, mode="symmetric")) if np.any(added) else copy


def state_sentence() -> str:
    """For the user: what denoising does, or why it cannot."""
    if not is_there():
        return f"This Blender comes without {NAME}: pictures stay as they are."
    return "The finished picture is filtered, guided by the colours and normals of surfaces."


def viewport_sentence() -> str:
    """The same for 3D viewports."""
    if not is_there():
        return state_sentence()
    return "Pictures are filtered while samples are added: the 1st, the 2nd, the 4th and so on, and the last."


def with_needed_passes(core_passes: list[str]) -> list[str]:
    """The core's passes to ask for besides Combined, and with them those that denoising reads."""
    return list(dict.fromkeys([*core_passes, *LAYER_PASSES, *GUIDE_PASSES]))


def with_quick_passes(core_passes: list[str]) -> list[str]:
    """The same for quick pictures."""
    return list(dict.fromkeys([*core_passes, *QUICK_PASSES]))


def layers_of(picture: Picture, indirect: Picture, emission: Picture, emission_noise: Picture) -> Layers:
    """Of a picture, two of its parts, and standard errors of the latter, each by itself rough.

    The picture alone where a part of it is negative, by lamps of negative strength: filters know no such light, and
    what one part lacks would not be taken from the others."""
    scattered = picture - indirect - emission
    if any(np.any(part < -ROUNDING * np.abs(picture)) for part in (scattered, indirect, emission)):
        return Layers(picture)
    noisy = noisy_share(emission, emission_noise) * emission
    return Layers(np.maximum(scattered, 0.0) + noisy, indirect, emission - noisy)


def noisy_share(emission: Picture, noise: Picture) -> Picture:
    """(height, width, 1): the share of the emission that is filtered."""
    squares, variances = (mean_of_neighbours((part**2).mean(axis=2)) for part in (emission, noise))
    least, most = NOISE_SHARES
    share = np.divide(variances, squares, out=np.zeros_like(squares), where=squares > 0.0)
    return np.clip((share - least) / (most - least), 0.0, 1.0)[..., None].astype(np.float32)


def mean_of_neighbours(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Over NOISE_SIDE x NOISE_SIDE pixels; the outermost ones go on beyond the edges."""
    for axis in (0, 1):
        margin = [(0, 0), (0, 0)]
        margin[axis] = (NOISE_SIDE // 2, NOISE_SIDE // 2)
        padded = np.pad(values, margin, mode="edge")
        values = np.lib.stride_tricks.sliding_window_view(padded, NOISE_SIDE, axis=axis).mean(axis=-1)
    return values


def with_noisy(read: Reader) -> Reader:
    """Reads Noisy Image, too: what Combined is so far."""
    return lambda name: read("Combined" if name == NOISY_PASS else name)


def guides(read: Reader) -> tuple[Picture, Picture]:
    """Albedo and normal of a finished session."""
    albedo, normal = map(read, GUIDE_PASSES)
    return albedo, normal


def denoised_combined(read: Reader, threads: int, is_wanted: Callable[[], bool]) -> Picture | None:
    """Combined (red, green, blue, alpha) of a finished session, denoised; None once it is not wanted.

    Colours are multiplied by alpha before and after. Alpha has no noise to speak of and stays as it is, and so does a
    pixel in which nothing was found: no glow may reach a transparent film. Raises DenoiserError."""
    noisy = read("Combined")
    layers = layers_of(noisy[..., :3], *map(read, LAYER_PASSES))
    color = denoise_layers(layers, *guides(read), threads=threads, is_wanted=is_wanted)
    return None if color is None else with_alpha(color, noisy)


def quickly_denoised_combined(
    read: Reader, samples: int, threads: int, is_wanted: Callable[[], bool]
) -> Picture | None:
    """The same of Combined and QUICK_PASSES of so many samples. One filter gets the whole picture, save sharp lamps."""
    noisy = read("Combined")
    nothing = np.zeros_like(noisy[..., :3])
    layers = layers_of(noisy[..., :3], nothing, *map(read, EMISSION_PASSES))
    has_clean_guides = samples >= CLEAN_GUIDE_SAMPLES
    color = denoise_quickly(layers, *guides(read), has_clean_guides, threads, is_wanted)
    return None if color is None else with_alpha(color, noisy)


def with_alpha(color: Picture, noisy: Picture) -> Picture:
    return np.where(noisy.any(axis=2, keepdims=True), np.concatenate([color, noisy[..., 3:]], axis=2), noisy)
