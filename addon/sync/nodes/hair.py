"""Shaders of hair."""

from __future__ import annotations

from . import value_names
from .compiler import NodeView, closure_node
from .enums import HAIR_COMPONENTS, HAIR_PARAMETRIZATIONS
from .inputs import mesh_attribute
from .instructions import Value, constant

ZERO = (0.0, 0.0, 0.0)


@closure_node("ShaderNodeBsdfHairPrincipled")
def principled_hair(node: NodeView, weight: Value) -> None:
    is_elliptic = node.node.model == "HUANG"
    if is_elliptic:
        node.warn("Principled Hair by Huang is rendered as by Chiang: round, of one roughness")
    vary = _variation(node, "Random Roughness")
    roughness = _scaled(node, node.value("Roughness"), vary)
    radial = roughness if is_elliptic else _scaled(node, node.value("Radial Roughness"), vary)
    melanin = _scaled(node, node.value("Melanin"), _variation(node, "Random Color"))
    inputs = (
        *(weight, node.emit("STRAND_TANGENT", (), (0,)), node.value("Color"), melanin),
        *node.values("Melanin Redness, Tint, Absorption Coefficient"),
        *(roughness, radial, constant(0.0) if is_elliptic else node.value("Coat")),
        *node.values("IOR, Offset"),
    )
    node.compiler.code.closure("CLOSURE_HAIR", inputs, (node.choice("parametrization", HAIR_PARAMETRIZATIONS),))


@closure_node("ShaderNodeBsdfHair")
def hair(node: NodeView, weight: Value) -> None:
    """On meshes scales are not tilted, but where a tangent is linked."""
    tangent, offset = node.linked("Tangent"), node.value("Offset")
    if tangent is None:
        tangent = node.emit("STRAND_TANGENT", (), (1,))
        is_strand = mesh_attribute(node, value_names.STRAND, "Fac", missing_alpha=0)
        offset = node.math("MULTIPLY", offset, is_strand)
    inputs = (weight, tangent, *node.values("Color, RoughnessU, RoughnessV"), offset)
    node.compiler.code.closure("CLOSURE_SIMPLE_HAIR", inputs, (node.choice("component", HAIR_COMPONENTS),))


def _variation(node: NodeView, amount: str) -> Value | None:
    """What a number is multiplied by on each strand: 1 +- `amount`; None where that is 0."""
    spread = node.value(amount)
    if spread.constant == ZERO:
        return None
    random = node.linked("Random") or mesh_attribute(node, value_names.STRAND_RANDOM, "Fac", missing_alpha=0)
    centered = node.math("SUBTRACT", random, constant(0.5))
    return node.math(
        "ADD", constant(1.0), node.math("MULTIPLY", node.math("MULTIPLY", constant(2.0), centered), spread)
    )


def _scaled(node: NodeView, value: Value, factor: Value | None) -> Value:
    return value if factor is None else node.math("MULTIPLY", value, factor)
