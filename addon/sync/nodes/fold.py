"""Arithmetic on constants, with the semantics of the core's instructions (op_table.cpp).

What folds here never reaches the core, so that most materials end as one closure with constant operands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from .enums import MATH_OPERATIONS, VECTOR_MATH_OPERATIONS, VECTOR_MATH_VALUES

Triple = tuple[float, float, float]

FLOAT_EPSILON = 2.0**-23  # smallest tolerance of Compare, as in single precision
LUMINANCE_WEIGHTS = (0.2126391, 0.7151691, 0.0721928)  # Rec. 709, as the core has them


def saturate(x: float) -> float:
    return min(max(x, 0.0), 1.0)


def divide(a: float, b: float) -> float:
    return a / b if b != 0.0 else 0.0


def power(a: float, b: float) -> float:
    if b == 0.0:
        return 1.0
    if a == 0.0 or (a < 0.0 and b != int(b)):
        return 0.0
    return a**b


def _logarithm(a: float, b: float) -> float:
    return divide(math.log(a), math.log(b)) if a > 0.0 and b > 0.0 else 0.0


def _smooth_min(a: float, b: float, k: float) -> float:
    if k == 0.0:
        return min(a, b)
    h = max(k - abs(a - b), 0.0) / k
    return min(a, b) - h**3 * k / 6.0


def wrap(a: float, high: float, low: float) -> float:
    span = high - low
    return a - span * math.floor((a - low) / span) if span != 0.0 else low


def _ping_pong(a: float, b: float) -> float:
    if b == 0.0:
        return 0.0
    x = (a - b) / (2.0 * b)
    return abs((x - math.floor(x)) * 2.0 * b - b)


def sign(a: float) -> float:
    return float(a > 0.0) - float(a < 0.0)


def modulo(a: float, b: float) -> float:
    return math.fmod(a, b) if b != 0.0 else 0.0


_MATH: dict[str, Callable[[float, float, float], float]] = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: divide(a, b),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: power(a, b),
    "LOGARITHM": lambda a, b, c: _logarithm(a, b),
    "SQRT": lambda a, b, c: math.sqrt(max(a, 0.0)),
    "INVERSE_SQRT": lambda a, b, c: 1.0 / math.sqrt(a) if a > 0.0 else 0.0,
    "ABSOLUTE": lambda a, b, c: abs(a),
    "EXPONENT": lambda a, b, c: math.exp(a),
    "MINIMUM": lambda a, b, c: min(a, b),
    "MAXIMUM": lambda a, b, c: max(a, b),
    "LESS_THAN": lambda a, b, c: float(a < b),
    "GREATER_THAN": lambda a, b, c: float(a > b),
    "SIGN": lambda a, b, c: sign(a),
    "COMPARE": lambda a, b, c: float(abs(a - b) <= max(c, FLOAT_EPSILON)),
    "SMOOTH_MIN": _smooth_min,
    "SMOOTH_MAX": lambda a, b, c: -_smooth_min(-a, -b, c),
    "ROUND": lambda a, b, c: float(math.floor(a + 0.5)),
    "FLOOR": lambda a, b, c: float(math.floor(a)),
    "CEIL": lambda a, b, c: float(math.ceil(a)),
    "TRUNC": lambda a, b, c: float(math.trunc(a)),
    "FRACT": lambda a, b, c: a - math.floor(a),
    "MODULO": lambda a, b, c: modulo(a, b),
    "FLOORED_MODULO": lambda a, b, c: a - math.floor(a / b) * b if b != 0.0 else 0.0,
    "WRAP": wrap,
    "SNAP": lambda a, b, c: math.floor(divide(a, b)) * b,
    "PINGPONG": lambda a, b, c: _ping_pong(a, b),
    "SINE": lambda a, b, c: math.sin(a),
    "COSINE": lambda a, b, c: math.cos(a),
    "TANGENT": lambda a, b, c: math.tan(a),
    "ARCSINE": lambda a, b, c: math.asin(min(max(a, -1.0), 1.0)),
    "ARCCOSINE": lambda a, b, c: math.acos(min(max(a, -1.0), 1.0)),
    "ARCTANGENT": lambda a, b, c: math.atan(a),
    "ARCTAN2": lambda a, b, c: math.atan2(a, b),
    "SINH": lambda a, b, c: math.sinh(a),
    "COSH": lambda a, b, c: math.cosh(a),
    "TANH": lambda a, b, c: math.tanh(a),
    "RADIANS": lambda a, b, c: math.radians(a),
    "DEGREES": lambda a, b, c: math.degrees(a),
}


def _math(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple:
    result = _MATH[MATH_OPERATIONS[parameters[0]]](*(value[0] for value in inputs))
    return _float(saturate(result) if parameters[1] else result)


def _float(x: float) -> Triple:
    return (float(x), 0.0, 0.0)


def dot(a: Triple, b: Triple) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def normalize(a: Triple) -> Triple:
    length = math.sqrt(dot(a, a))
    return tuple(divide(x, length) for x in a)


def cross(a: Triple, b: Triple) -> Triple:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _each(function: Callable[..., float]) -> Callable[..., Triple]:
    return lambda a, b, c, scale: tuple(function(*xyz) for xyz in zip(a, b, c, strict=True))


_COMPONENT_WISE = (
    "ADD SUBTRACT MULTIPLY DIVIDE MULTIPLY_ADD ABSOLUTE MINIMUM MAXIMUM FLOOR CEIL MODULO WRAP SNAP SINE COSINE "
    "TANGENT POWER SIGN"
)
_VECTOR_MATH: dict[str, Callable[[Triple, Triple, Triple, float], Triple]] = {
    name: _each(_MATH[name]) for name in _COMPONENT_WISE.split()
} | {
    "FRACTION": _each(_MATH["FRACT"]),
    "CROSS_PRODUCT": lambda a, b, c, scale: cross(a, b),
    "SCALE": lambda a, b, c, scale: tuple(x * scale for x in a),
    "NORMALIZE": lambda a, b, c, scale: normalize(a),
}


def _vector_math(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple | None:
    operation = _VECTOR_MATH.get(VECTOR_MATH_OPERATIONS[parameters[0]])
    return operation(*inputs[:3], inputs[3][0]) if operation else None


def _vector_math_value(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple:
    a, b = inputs
    name = VECTOR_MATH_VALUES[parameters[0]]
    if name == "DOT_PRODUCT":
        return _float(dot(a, b))
    return _float(math.dist(a, b) if name == "DISTANCE" else math.dist(a, (0.0, 0.0, 0.0)))


def lerp(t: float, a: float, b: float) -> float:
    return a * (1.0 - t) + b * t


def _mix_float(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple:
    t = saturate(inputs[0][0]) if parameters[0] else inputs[0][0]
    return _float(lerp(t, inputs[1][0], inputs[2][0]))


def _mix_vector(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple:
    factors = tuple(map(saturate, inputs[0])) if parameters[0] else inputs[0]
    return tuple(map(lerp, factors, inputs[1], inputs[2]))


def _clamp(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple:
    value, low, high = (x[0] for x in inputs)
    if parameters[0] == 1 and low > high:
        low, high = high, low
    return _float(min(max(value, low), high))


def _smooth(t: float, kind: int) -> float:
    return t * t * (3.0 - 2.0 * t) if kind == 2 else t**3 * (t * (6.0 * t - 15.0) + 10.0)


def _map_range(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple:
    value, from_min, from_max, to_min, to_max, steps = (x[0] for x in inputs)
    kind, clamp = parameters
    if from_min == from_max:
        return _float(0.0)
    factor = (value - from_min) / (from_max - from_min)
    if kind == 1:
        factor = math.floor(factor * (steps + 1.0)) / steps if steps > 0.0 else 0.0
    elif kind >= 2:
        factor = _smooth(saturate(factor), kind)
    result = to_min + factor * (to_max - to_min)
    return _float(min(max(result, min(to_min, to_max)), max(to_min, to_max)) if clamp else result)


def rgb_to_hsv(c: Triple) -> Triple:
    high, low = max(c), min(c)
    saturation = divide(high - low, high)
    if saturation == 0.0:
        return (0.0, 0.0, high)
    r, g, b = ((high - x) / (high - low) for x in c)
    hue = b - g if c[0] == high else 2.0 + r - b if c[1] == high else 4.0 + g - r
    return (hue / 6.0 % 1.0, saturation, high)


def hsv_to_rgb(c: Triple) -> Triple:
    hue, saturation, value = c
    if saturation == 0.0:
        return (value, value, value)
    hue = 0.0 if hue == 1.0 else hue * 6.0
    sector = math.floor(hue)
    f = hue - sector
    p, q, t = value * (1 - saturation), value * (1 - saturation * f), value * (1 - saturation * (1 - f))
    sectors = [(value, t, p), (q, value, p), (p, value, t), (p, q, value), (t, p, value)]
    return sectors[sector] if 0 <= sector < len(sectors) else (value, p, q)


def _rgb_to_hsl(c: Triple) -> Triple:
    high, low = max(c), min(c)
    lightness, extent = min(0.5 * (high + low), 1.0), high - low
    if extent == 0.0:
        return (0.0, 0.0, lightness)
    saturation = extent / (2.0 - high - low if lightness > 0.5 else high + low)
    return (rgb_to_hsv(c)[0], saturation, lightness)


def _hsl_to_rgb(c: Triple) -> Triple:
    """A hue outside of [0, 1] does not come around again."""
    sixth, chroma = 6.0 * c[0], (1.0 - abs(2.0 * c[2] - 1.0)) * c[1]
    pure = (abs(sixth - 3.0) - 1.0, 2.0 - abs(sixth - 2.0), 2.0 - abs(sixth - 4.0))
    return tuple((saturate(x) - 0.5) * chroma + c[2] for x in pure)


def _hue_saturation(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple:
    color, (hue, *_), (saturation, *_), (value, *_), (factor, *_) = inputs
    h, s, v = rgb_to_hsv(color)
    shifted = hsv_to_rgb(((h + hue + 0.5) % 1.0, saturate(s * saturation), v * value))
    return tuple(max(lerp(factor, a, b), 0.0) for a, b in zip(color, shifted, strict=True))


def _bright_contrast(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple:
    color, (bright, *_), (contrast, *_) = inputs
    return tuple(max((1.0 + contrast) * x + bright - 0.5 * contrast, 0.0) for x in color)


def _gamma(inputs: Sequence[Triple], parameters: Sequence[int]) -> Triple:
    color, (gamma, *_) = inputs
    return tuple(x**gamma if x > 0.0 else x for x in color) if gamma != 0.0 else (1.0, 1.0, 1.0)


FOLDERS: dict[str, Callable[[Sequence[Triple], Sequence[int]], Triple | None]] = {
    "BROADCAST": lambda i, p: (i[0][0],) * 3,
    "LUMINANCE": lambda i, p: _float(dot(i[0], LUMINANCE_WEIGHTS)),
    "AVERAGE": lambda i, p: _float(sum(i[0]) / 3.0),
    "MATH": _math,
    "VECTOR_MATH": _vector_math,
    "VECTOR_MATH_VALUE": _vector_math_value,
    "MIX_FLOAT": _mix_float,
    "MIX_VECTOR": _mix_vector,
    "CLAMP": _clamp,
    "MAP_RANGE": _map_range,
    "COMBINE_XYZ": lambda i, p: (i[0][0], i[1][0], i[2][0]),
    "SEPARATE_X": lambda i, p: _float(i[0][0]),
    "SEPARATE_Y": lambda i, p: _float(i[0][1]),
    "SEPARATE_Z": lambda i, p: _float(i[0][2]),
    "INVERT": lambda i, p: tuple(lerp(i[0][0], x, 1.0 - x) for x in i[1]),
    "GAMMA": _gamma,
    "BRIGHT_CONTRAST": _bright_contrast,
    "HUE_SATURATION": _hue_saturation,
    "RGB_TO_HSV": lambda i, p: rgb_to_hsv(i[0]),
    "HSV_TO_RGB": lambda i, p: hsv_to_rgb(i[0]),
    "RGB_TO_HSL": lambda i, p: _rgb_to_hsl(i[0]),
    "HSL_TO_RGB": lambda i, p: _hsl_to_rgb(i[0]),
}
