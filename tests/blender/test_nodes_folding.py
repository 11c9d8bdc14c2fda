"""Constant trees fold to the numbers worked out by hand, and conversions are Blender's."""

from __future__ import annotations

import math

import pytest
from node_trees import Tree, shown_value, socket

from addon.sync import versions
from addon.sync.nodes.fold import FOLDERS, LUMINANCE_WEIGHTS, hsv_to_rgb, rgb_to_hsv


def math_tree(operation: str, *values: float, clamp: bool = False):
    def build(tree: Tree):
        node = tree.node("ShaderNodeMath", operation=operation, use_clamp=clamp)
        for name, value in zip(("Value", "Value_001", "Value_002"), values, strict=False):
            socket(node.inputs, name).default_value = value
        return node, "Value"

    return build


@pytest.mark.parametrize(
    ("operation", "values", "expected"),
    [
        ("ADD", (2.0, 3.0), 5.0),
        ("DIVIDE", (2.0, 0.0), 0.0),
        ("POWER", (-2.0, 0.5), 0.0),
        ("POWER", (-2.0, 3.0), -8.0),
        ("LOGARITHM", (8.0, 2.0), 3.0),
        ("MULTIPLY_ADD", (2.0, 3.0, 4.0), 10.0),
        ("WRAP", (5.5, 3.0, 1.0), 1.5),
        ("PINGPONG", (5.0, 2.0), 1.0),
        ("SNAP", (5.7, 2.0), 4.0),
        ("MODULO", (-5.0, 3.0), -2.0),
        ("FLOORED_MODULO", (-5.0, 3.0), 1.0),
        ("COMPARE", (1.0, 1.2, 0.3), 1.0),
        ("SMOOTH_MIN", (1.0, 1.0, 0.6), 0.9),
        ("SQRT", (-1.0,), 0.0),
        ("EXPONENT", (1.0,), math.e),
        ("TRUNC", (-1.5,), -1.0),
        ("ROUND", (0.5,), 1.0),
    ],
)
def test_math_folds(empty_scene, operation, values, expected):
    assert shown_value(math_tree(operation, *values))[0] == pytest.approx(expected, abs=1e-6)


def test_math_clamps(empty_scene):
    assert shown_value(math_tree("ADD", 2.0, 3.0, clamp=True))[0] == 1.0


BLENDS_OF_A_FIFTH_AND_THREE_FIFTHS_BY_HALF = {  # worked out from the definitions of the blend modes
    "MIX": 0.4,
    "DARKEN": 0.2,
    "LIGHTEN": 0.4,
    "MULTIPLY": 0.5 * 0.2 + 0.5 * 0.12,
    "SCREEN": 1 - (0.5 + 0.5 * 0.4) * 0.8,
    "ADD": 0.5 * 0.2 + 0.5 * 0.8,
    "SUBTRACT": 0.5 * 0.2 + 0.5 * -0.4,
    "DIFFERENCE": 0.5 * 0.2 + 0.5 * 0.4,
    "DIVIDE": 0.5 * 0.2 + 0.5 * 0.2 / 0.6,
    "OVERLAY": 0.2 * (0.5 + 0.6),
    "SOFT_LIGHT": 0.5 * 0.2 + 0.5 * (0.8 * 0.6 * 0.2 + 0.2 * (1 - 0.4 * 0.8)),
    "LINEAR_LIGHT": 0.2 + 0.5 * (1.2 - 1),
    "EXCLUSION": 0.5 * 0.2 + 0.5 * (0.8 - 2 * 0.12),
    "DODGE": 0.2 / 0.7,
    "BURN": 0.0,  # 1 - 0.8 / 0.8
    "HUE": 0.2,  # a grey has no hue to give
    "SATURATION": 0.2,
    "COLOR": 0.2,
    "VALUE": 0.4,
}


@pytest.mark.parametrize(("blend", "expected"), BLENDS_OF_A_FIFTH_AND_THREE_FIFTHS_BY_HALF.items())
def test_mix_color_folds(empty_scene, blend, expected):
    def build(tree: Tree):
        node = tree.node("ShaderNodeMix", data_type="RGBA", blend_type=blend)
        tree.set(node, Factor_Float=0.5, A_Color=(0.2, 0.2, 0.2, 1), B_Color=(0.6, 0.6, 0.6, 1))
        return node, "Result_Color"

    assert shown_value(build) == pytest.approx((expected,) * 3, abs=1e-6)


def test_map_range_folds(empty_scene):
    cases = [("LINEAR", 23.0), ("STEPPED", 10 + 20 * 3 / 4), ("SMOOTHSTEP", 10 + 20 * 0.65**2 * (3 - 2 * 0.65))]
    for kind, expected in cases:

        def build(tree: Tree, kind: str = kind):
            node = tree.node("ShaderNodeMapRange", interpolation_type=kind)
            values = {"Value": 2.6, "From Min": 0.0, "From Max": 4.0, "To Min": 10.0, "To Max": 30.0, "Steps": 4.0}
            return tree.set(node, **values), "Result"

        assert shown_value(build)[0] == pytest.approx(expected), kind


def test_color_round_trips_and_hue_shift():
    for rgb in ((0.1, 0.5, 0.9), (0.9, 0.1, 0.1), (0.3, 0.3, 0.3), (0.0, 0.7, 0.2)):
        assert hsv_to_rgb(rgb_to_hsv(rgb)) == pytest.approx(rgb)
        hsl = FOLDERS["RGB_TO_HSL"]([rgb], ())
        assert FOLDERS["HSL_TO_RGB"]([hsl], ()) == pytest.approx(rgb)
    third = FOLDERS["HUE_SATURATION"]([(1.0, 0.0, 0.0), (0.5 + 1 / 3,) * 3, (1.0,) * 3, (1.0,) * 3, (1.0,) * 3], ())
    assert third == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)


def test_small_color_nodes_fold(empty_scene):
    grey = (0.25, 0.25, 0.25)
    assert FOLDERS["INVERT"]([(0.5,) * 3, grey], ()) == pytest.approx((0.5,) * 3)
    assert FOLDERS["GAMMA"]([grey, (0.5,) * 3], ()) == pytest.approx((0.5,) * 3)
    assert FOLDERS["BRIGHT_CONTRAST"]([grey, (0.1,) * 3, (0.2,) * 3], ()) == pytest.approx((0.3,) * 3)
    assert FOLDERS["CLAMP"]([(5.0,) * 3, (3.0,) * 3, (1.0,) * 3], (1,))[0] == 3.0


def test_implicit_conversions_fold(empty_scene):
    def color_to_float(tree: Tree):
        rgb = tree.node("ShaderNodeRGB")
        rgb.outputs[0].default_value = (1.0, 0.5, 0.25, 1.0)
        node = tree.set(tree.node("ShaderNodeMath", operation="ADD"), Value_001=0.0)
        tree.link(rgb, "Color", node, "Value")
        return node, "Value"

    def vector_to_float(tree: Tree):
        xyz = tree.set(tree.node("ShaderNodeCombineXYZ"), X=1.0, Y=0.5, Z=0.25)
        node = tree.set(tree.node("ShaderNodeMath", operation="ADD"), Value_001=0.0)
        tree.link(xyz, "Vector", node, "Value")
        return node, "Value"

    def float_to_color(tree: Tree):
        value = tree.node("ShaderNodeValue")
        value.outputs[0].default_value = 0.3
        node = tree.node("ShaderNodeGamma")
        tree.link(value, "Value", node, "Color")
        return node, "Color"

    luminance = sum(w * x for w, x in zip(LUMINANCE_WEIGHTS, (1.0, 0.5, 0.25), strict=True))
    assert shown_value(color_to_float)[0] == pytest.approx(luminance)
    assert shown_value(vector_to_float)[0] == pytest.approx(1.75 / 3)
    assert shown_value(float_to_color) == pytest.approx((0.3, 0.3, 0.3))


def test_implicit_conversions_of_textures_emit_instructions(empty_scene):
    def checker_into_float(tree: Tree):
        node = tree.set(tree.node("ShaderNodeMath", operation="MULTIPLY"), Value_001=2.0)
        tree.link(tree.node("ShaderNodeTexChecker"), "Color", node, "Value")
        return node, "Value"

    product = shown_value(checker_into_float)
    assert product.op == "MATH" and product.inputs[0].op == "LUMINANCE" and product.inputs[0].inputs[0].op == "CHECKER"


def test_what_is_not_finite_is_left_to_the_core(empty_scene):
    """Where it may still vanish: one over infinity is 0, as Blender knows from 5.0 on."""

    def reciprocal(tree: Tree):
        power, one = tree.node("ShaderNodeMath", operation="EXPONENT"), tree.node("ShaderNodeMath", operation="DIVIDE")
        power.inputs[0].default_value, one.inputs[0].default_value = 100.0, 1.0
        tree.tree.links.new(one.inputs[1], power.outputs[0])
        return one, "Value"

    value = shown_value(reciprocal)
    assert value == (0.0, 0.0, 0.0) if versions.joins_links() else value.op == "MATH"


def test_ramps_and_curves(empty_scene):
    def ramp(tree: Tree):
        node = tree.set(tree.node("ShaderNodeValToRGB"), Fac=0.25)
        return node, "Color"

    def curve(tree: Tree):
        node = tree.node("ShaderNodeRGBCurve")
        tree.link(tree.node("ShaderNodeTexChecker"), "Color", node, "Color")
        return node, "Color"

    assert shown_value(ramp) == pytest.approx((0.25, 0.25, 0.25), abs=1e-6)
    lookup = shown_value(curve)
    assert lookup.op == "CURVE_LOOKUP" and lookup.inputs[2:] == [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]


def test_common_subexpressions_and_dead_code(empty_scene):
    tree = Tree()
    mix = tree.node("ShaderNodeMix", data_type="RGBA", blend_type="MULTIPLY")
    for target in ("A_Color", "B_Color"):
        tree.link(tree.node("ShaderNodeTexNoise"), "Color", mix, target)
    tree.shown(mix, "Result_Color")
    assert [i.op for i in tree.compile().instructions] == ["GENERATED", "NOISE_COLOR", "MIX_COLOR"]
    tree.set(mix, Factor_Float=0.0)
    mix.blend_type = "MIX"
    assert [i.op for i in tree.compile().instructions] == ["GENERATED", "NOISE_COLOR"]
