"""Colour nodes, and taking colours apart and together."""

from __future__ import annotations

from .compiler import NodeView, value_node
from .instructions import COLOR, Value
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
    return node.emit("BLACKBODY", node.values("Temperature"))


@value_node("ShaderNodeWavelength")
def wavelength(node: NodeView, output: str) -> Value:
    return node.emit("WAVELENGTH", node.values("Wavelength"))
