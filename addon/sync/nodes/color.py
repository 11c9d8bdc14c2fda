"""Colour nodes, and taking colours apart and together."""

from __future__ import annotations

from .. import versions
from ..colour import image_colour
from .compiler import NodeView, value_node
from .enums import VECTOR_MATH_VALUES
from .instructions import COLOR, VECTOR, Value, constant
from .vector import separate


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
    return blackbody_color(node, node.value("Temperature"))


def blackbody_color(node: NodeView, kelvin: Value) -> Value:
    return in_working_space(node, node.emit("BLACKBODY", (kelvin,)))


@value_node("ShaderNodeWavelength")
def wavelength(node: NodeView, output: str) -> Value:
    line = in_working_space(node, node.emit("WAVELENGTH", node.values("Wavelength")))
    return node.vector_math("MAXIMUM", line, constant(0.0, letter=VECTOR)).retyped(COLOR)


def in_working_space(node: NodeView, color: Value) -> Value:
    """A linear Rec. 709 colour, which is what the core's spectra give."""
    matrix = image_colour("Linear Rec.709", versions.working_space()).matrix
    if matrix is None:
        return color
    rows = [constant(*matrix[first : first + 3], VECTOR) for first in (0, 3, 6)]
    dot = (VECTOR_MATH_VALUES.index("DOT_PRODUCT"),)
    channels = [node.emit("VECTOR_MATH_VALUE", (color, row), dot) for row in rows]
    return node.emit("COMBINE_XYZ", channels).retyped(COLOR)
