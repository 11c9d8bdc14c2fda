"""Blend modes of the Mix node on constants, as the core's MIX_COLOR computes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from .enums import BLEND_TYPES
from .fold import FOLDERS, Triple, hsv_to_rgb, lerp, rgb_to_hsv, saturate

Channel = Callable[[float, float, float], float]


def _towards(target: Callable[[float, float], float]) -> Channel:
    return lambda t, a, b: lerp(t, a, target(a, b))


def _screen(t: float, a: float, b: float) -> float:
    return 1.0 - (1.0 - t + t * (1.0 - b)) * (1.0 - a)


def _overlay(t: float, a: float, b: float) -> float:
    return a * (1.0 - t + 2.0 * t * b) if a < 0.5 else 1.0 - (1.0 - t + 2.0 * t * (1.0 - b)) * (1.0 - a)


def _dodge(t: float, a: float, b: float) -> float:
    rest = 1.0 - t * b
    if a == 0.0:
        return 0.0
    return min(a / rest, 1.0) if rest > 0.0 else 1.0


def _burn(t: float, a: float, b: float) -> float:
    part = 1.0 - t + t * b
    return saturate(1.0 - (1.0 - a) / part) if part > 0.0 else 0.0


def _soft_light(t: float, a: float, b: float) -> float:
    screen = 1.0 - (1.0 - b) * (1.0 - a)
    return lerp(t, a, (1.0 - a) * b * a + a * screen)


_CHANNELS: dict[str, Channel] = {
    "MIX": _towards(lambda a, b: b),
    "DARKEN": _towards(min),
    "MULTIPLY": _towards(lambda a, b: a * b),
    "BURN": _burn,
    "LIGHTEN": _towards(max),
    "SCREEN": _screen,
    "DODGE": _dodge,
    "ADD": _towards(lambda a, b: a + b),
    "OVERLAY": _overlay,
    "SOFT_LIGHT": _soft_light,
    "LINEAR_LIGHT": lambda t, a, b: a + t * (2.0 * b - 1.0),
    "DIFFERENCE": _towards(lambda a, b: abs(a - b)),
    "EXCLUSION": lambda t, a, b: max(lerp(t, a, a + b - 2.0 * a * b), 0.0),
    "SUBTRACT": _towards(lambda a, b: a - b),
    "DIVIDE": lambda t, a, b: lerp(t, a, a / b) if b != 0.0 else a,
}


def _blend_hsv(name: str, t: float, a: Triple, b: Triple) -> Triple:
    hsv_a, hsv_b = rgb_to_hsv(a), rgb_to_hsv(b)
    if name == "SATURATION":
        return hsv_to_rgb((hsv_a[0], lerp(t, hsv_a[1], hsv_b[1]), hsv_a[2])) if hsv_a[1] != 0.0 else a
    if name == "VALUE":
        return hsv_to_rgb((hsv_a[0], hsv_a[1], lerp(t, hsv_a[2], hsv_b[2])))
    if hsv_b[1] == 0.0:
        return a
    tinted = hsv_to_rgb((hsv_b[0], hsv_a[1] if name == "HUE" else hsv_b[1], hsv_a[2]))
    return tuple(lerp(t, x, y) for x, y in zip(a, tinted, strict=True))


def mix_color(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple:
    (t, *_), a, b = inputs
    blend, clamp_factor, clamp_result = parameters
    t = saturate(t) if clamp_factor else t
    name = BLEND_TYPES[blend]
    if name in _CHANNELS:
        result = tuple(_CHANNELS[name](t, x, y) for x, y in zip(a, b, strict=True))
    else:
        result = _blend_hsv(name, t, a, b)
    return tuple(map(saturate, result)) if clamp_result else result


FOLDERS["MIX_COLOR"] = mix_color
