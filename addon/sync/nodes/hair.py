"""Shaders of hair."""

from __future__ import annotations

from . import value_names
from .compiler import NodeView, closure_node
from .enums import HAIR_COMPONENTS, HAIR_PARAMETRIZATIONS, SPACES
from .inputs import mesh_attribute
from .instructions import Value, constant
from .vector import NORMAL_TRANSFORM, vector_constant

ZERO = (0.0, 0.0, 0.0)


@closure_node("ShaderNodeBsdfHairPrincipled")
def principled_hair(node: NodeView, weight: Value) -> None:
    by_facets = node.node.model == "HUANG"
    vary = _variation(node, "Random Roughness")
    roughness = _scaled(node, node.value("Roughness"), vary)
    color = (
        *(node.value("Color"), _scaled(node, node.value("Melanin"), _variation(node, "Random Color"))),
        *node.values("Melanin Redness, Tint, Absorption Coefficient"),
    )
    tangent = node.emit("STRAND_TANGENT", (), (0,))
    if by_facets:
        shape = (roughness, *node.values("Aspect Ratio, IOR, Offset"))
        factors = node.values("R lobe, TT lobe, TRT lobe")
        inputs = (weight, tangent, _major_axis(node), *color, *shape, *factors)
    else:
        radial = _scaled(node, node.value("Radial Roughness"), vary)
        inputs = (weight, tangent, *color, roughness, radial, *node.values("Coat, IOR, Offset"))
    op = "CLOSURE_MICROFACET_HAIR" if by_facets else "CLOSURE_HAIR"
    node.compiler.code.closure(op, inputs, (node.choice("parametrization", HAIR_PARAMETRIZATIONS),))


def _major_axis(node: NodeView) -> Value:
    """Of the cross-section: along the normals of hair curves; particles have none."""
    if node.value("Aspect Ratio").constant == constant(1.0).constant:
        return vector_constant(*ZERO)
    normal = mesh_attribute(node, value_names.STRAND_NORMAL, "Vector", missing_alpha=0)
    return node.emit("VECTOR_TRANSFORM", (normal,), (NORMAL_TRANSFORM, SPACES.index("OBJECT"), SPACES.index("WORLD")))


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
