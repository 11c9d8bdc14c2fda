"""Colour nodes, and taking colours apart and together."""

from __future__ import annotations

import math

from .compiler import NodeView, value_node
from .instructions import COLOR, Value, constant
from .vector import separate

# CIE 1931 colour matching functions: Wyman, Sloan and Shirley 2013, Simple analytic approximations to the CIE XYZ
# color matching functions, multi-lobe fit: (weight, mean, inverse width below, above) in nanometres.
XYZ_LOBES = (
    ((0.362, 442.0, 0.0624, 0.0374), (1.056, 599.8, 0.0264, 0.0323), (-0.065, 501.1, 0.0490, 0.0382)),
    ((0.821, 568.8, 0.0213, 0.0247), (0.286, 530.9, 0.0613, 0.0322)),
    ((1.217, 437.0, 0.0845, 0.0278), (0.681, 459.0, 0.0385, 0.0725)),
)
XYZ_TO_RGB = (
    (3.2404542, -1.5371385, -0.4985314),
    (-0.9692660, 1.8760108, 0.0415560),
    (0.0556434, -0.2040259, 1.0572252),
)
WAVELENGTH_SCALE = 1.0 / 2.52  # Blender's scale, which keeps every channel below one


@value_node("ShaderNodeHueSaturation")
def hue_saturation(node: NodeView, output: str) -> Value:
    return node.emit("HUE_SATURATION", node.values("Color, Hue, Saturation, Value, Fac"))


@value_node("ShaderNodeBrightContrast")
def bright_contrast(node: NodeView, output: str) -> Value:
    return node.emit("BRIGHT_CONTRAST", node.values("Color, Bright, Contrast"))


@value_node("ShaderNodeGamma")
def gamma(node: NodeView, output: str) -> Value:
    return node.emit("GAMMA", node.values("Color, Gamma"))


@value_node("ShaderNodeInvert")
def invert(node: NodeView, output: str) -> Value:
    return node.emit("INVERT", node.values("Fac, Color"))


@value_node("ShaderNodeRGBToBW")
def rgb_to_bw(node: NodeView, output: str) -> Value:
    return node.emit("LUMINANCE", node.values("Color"))


@value_node("ShaderNodeSeparateColor")
def separate_color(node: NodeView, output: str) -> Value:
    color, mode = node.value("Color"), node.node.mode
    if mode != "RGB":
        color = node.emit(f"RGB_TO_{mode}", (color,))
    return separate(node, color, ("Red", "Green", "Blue").index(output))


@value_node("ShaderNodeCombineColor")
def combine_color(node: NodeView, output: str) -> Value:
    color, mode = node.emit("COMBINE_XYZ", node.values("Red, Green, Blue")).retyped(COLOR), node.node.mode
    return color if mode == "RGB" else node.emit(f"{mode}_TO_RGB", (color,))


@value_node("ShaderNodeSeparateRGB")
def separate_rgb(node: NodeView, output: str) -> Value:
    return separate(node, node.value("Image"), "RGB".index(output))


@value_node("ShaderNodeSeparateHSV")
def separate_hsv(node: NodeView, output: str) -> Value:
    return separate(node, node.emit("RGB_TO_HSV", node.values("Color")), "HSV".index(output))


@value_node("ShaderNodeCombineRGB")
def combine_rgb(node: NodeView, output: str) -> Value:
    return node.emit("COMBINE_XYZ", node.values("R, G, B")).retyped(COLOR)


@value_node("ShaderNodeCombineHSV")
def combine_hsv(node: NodeView, output: str) -> Value:
    return node.emit("HSV_TO_RGB", (node.emit("COMBINE_XYZ", node.values("H, S, V")),))


@value_node("ShaderNodeBlackbody")
def blackbody(node: NodeView, output: str) -> Value:
    return node.emit("BLACKBODY", node.values("Temperature"))


@value_node("ShaderNodeWavelength")
def wavelength(node: NodeView, output: str) -> Value:
    value = node.value("Wavelength")
    if value.constant is None:
        node.warn("a Wavelength node with a linked input is not supported: it reads the socket's own value")
        value = constant(node.port("Wavelength").socket.default_value)
    return constant(*wavelength_color(value.constant[0]), COLOR)


def wavelength_color(nanometres: float) -> list[float]:
    """Linear Rec. 709 colour of a spectral line, negative channels cut off."""
    xyz = [sum(_lobe(nanometres, *lobe) for lobe in lobes) for lobes in XYZ_LOBES]
    rgb = [sum(weight * value for weight, value in zip(row, xyz, strict=True)) for row in XYZ_TO_RGB]
    return [max(channel * WAVELENGTH_SCALE, 0.0) for channel in rgb]


def _lobe(x: float, weight: float, mean: float, below: float, above: float) -> float:
    offset = (x - mean) * (below if x < mean else above)
    return weight * math.exp(-0.5 * offset * offset)
