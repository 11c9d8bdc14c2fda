"""Converter nodes: math, mix, clamp, ranges, ramps and curves."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from .compiler import NodeView, value_node
from .enums import BLEND_TYPES, CLAMP_TYPES, INTEGER_OPERATIONS, MAP_RANGE_TYPES, MATH_OPERATIONS
from .instructions import COLOR, TABLE_SIZE, VECTOR, Value, constant
from .vector import separate

SMOOTH_RANGES = ("SMOOTHSTEP", "SMOOTHERSTEP")
ZERO, ONE = constant(0.0), constant(1.0)


@value_node("ShaderNodeMath")
def math_node(node: NodeView, output: str) -> Value | None:
    if node.node.operation not in MATH_OPERATIONS:
        return None
    inputs = node.values("Value, Value_001, Value_002")
    return node.emit("MATH", inputs, (MATH_OPERATIONS.index(node.node.operation), int(node.node.use_clamp)))


@value_node("FunctionNodeIntegerMath")
def integer_math(node: NodeView, output: str) -> Value:
    """From Blender 5.3 on, as the two below."""
    inputs = node.values("Value, Value_001, Value_002")
    return node.emit("INTEGER_MATH", inputs, (node.choice("operation", INTEGER_OPERATIONS),))


@value_node("FunctionNodeBooleanMath")
def boolean_math(node: NodeView, output: str) -> Value | None:
    """Of whole parts, which are true above 0."""
    a, b = (node.math("GREATER_THAN", node.math("TRUNC", x), ZERO) for x in node.values("Boolean, Boolean_001"))
    operation = node.node.operation
    negation = {"NAND": "AND", "NOR": "OR", "XNOR": "XOR", "NIMPLY": "IMPLY", "NOT": "ITSELF"}.get(operation)
    found = {
        "ITSELF": lambda: a,
        "AND": lambda: node.math("MULTIPLY", a, b),
        "OR": lambda: node.math("MAXIMUM", a, b),
        "XOR": lambda: node.math("ABSOLUTE", node.math("SUBTRACT", a, b)),
        "IMPLY": lambda: node.math("MAXIMUM", node.math("SUBTRACT", ONE, a), b),
    }.get(negation or operation)
    if found is None:
        return None
    return node.math("SUBTRACT", ONE, found()) if negation else found()


@value_node("FunctionNodeGetVectorComponent")
def vector_component(node: NodeView, output: str) -> Value:
    """0 where the vector has none of that number."""
    vector, index = node.value("Vector"), node.math("TRUNC", node.value("Index"))
    total = ZERO
    for channel in range(3):
        is_asked = node.math("COMPARE", index, constant(float(channel)))
        total = node.math("ADD", total, node.math("MULTIPLY", separate(node, vector, channel), is_asked))
    return total


@value_node("ShaderNodeMix")
def mix(node: NodeView, output: str) -> Value | None:
    kind, clamp = node.node.data_type, int(node.node.clamp_factor)
    if kind == "RGBA":
        flags = (node.choice("blend_type", BLEND_TYPES), clamp, int(node.node.clamp_result))
        return _mix_color(node, ("Factor_Float", "A_Color", "B_Color"), flags)
    if kind == "FLOAT":
        return node.emit("MIX_FLOAT", node.values("Factor_Float, A_Float, B_Float"), (clamp,))
    if kind == "VECTOR":
        factor = "Factor_Float" if node.node.factor_mode == "UNIFORM" else "Factor_Vector"
        return node.emit("MIX_VECTOR", node.values(f"{factor}, A_Vector, B_Vector"), (clamp,))
    return None


@value_node("ShaderNodeMixRGB")
def mix_rgb(node: NodeView, output: str) -> Value:
    flags = (node.choice("blend_type", BLEND_TYPES), 1, int(node.node.use_clamp))
    return _mix_color(node, ("Fac", "Color1", "Color2"), flags)


def _mix_color(node: NodeView, identifiers: tuple[str, str, str], flags: tuple[int, int, int]) -> Value:
    """A mix by a constant 0 or 1 leaves the other side alone, so that its images are not even loaded."""
    factor = node.value(identifiers[0])
    black = constant(0.0, letter=COLOR)
    plain = flags[0] == BLEND_TYPES.index("MIX")
    a = black if plain and factor.constant == (1.0, 0.0, 0.0) else node.value(identifiers[1])
    b = black if plain and factor.constant == (0.0, 0.0, 0.0) else node.value(identifiers[2])
    return node.emit("MIX_COLOR", (factor, a, b), flags)


@value_node("ShaderNodeClamp")
def clamp_node(node: NodeView, output: str) -> Value:
    return node.emit("CLAMP", node.values("Value, Min, Max"), (node.choice("clamp_type", CLAMP_TYPES),))


@value_node("ShaderNodeMapRange")
def map_range(node: NodeView, output: str) -> Value:
    kind = node.choice("interpolation_type", MAP_RANGE_TYPES)
    if node.node.data_type == "FLOAT":
        inputs = node.values("Value, From Min, From Max, To Min, To Max, Steps")
        value = node.emit("MAP_RANGE", inputs, (kind, int(node.node.clamp)))
        if not node.node.clamp or _is_extended(*inputs[1:3]):
            return value
        return node.emit("CLAMP", (value, *inputs[3:5]), (CLAMP_TYPES.index("RANGE"),))  # the 0 of an empty range, too
    vectors = node.values("Vector, From_Min_FLOAT3, From_Max_FLOAT3, To_Min_FLOAT3, To_Max_FLOAT3, Steps_FLOAT3")
    flags = (kind, int(node.node.clamp and node.node.interpolation_type not in SMOOTH_RANGES))
    channels = [[separate(node, vector, axis) for vector in vectors] for axis in range(3)]
    return node.emit("COMBINE_XYZ", [_map_channel(node, inputs, flags) for inputs in channels])


def _is_extended(low: Value, high: Value) -> bool:
    """Whether a range is known not to be empty."""
    return None not in (low.constant, high.constant) and low.constant != high.constant


def _map_channel(node: NodeView, inputs: list[Value], flags: tuple[int, int]) -> Value:
    """Of a vector, an empty range maps to the lower end."""
    value, from_min, from_max, to_min, to_max, steps = inputs
    if _is_extended(from_min, from_max):
        return node.emit("MAP_RANGE", inputs, flags)
    span = node.math("SUBTRACT", to_max, to_min)
    return node.math("ADD", to_min, node.emit("MAP_RANGE", (value, from_min, from_max, ZERO, span, steps), flags))


@value_node("ShaderNodeValToRGB")
def color_ramp(node: NodeView, output: str) -> Value:
    ramp = node.node.color_ramp
    samples = np.array([ramp.evaluate(i / (TABLE_SIZE - 1)) for i in range(TABLE_SIZE)], np.float32)
    table = node.compiler.code.table(np.ascontiguousarray(samples[:, :3]), np.ascontiguousarray(samples[:, 3]))
    factor, steps = node.value("Fac"), ramp.interpolation == "CONSTANT"
    if factor.constant is not None:
        rgba = _table_entry(samples, factor.constant[0], steps)
        return constant(rgba[3]) if output == "Alpha" else constant(*rgba[:3], COLOR)
    op = "RAMP_LOOKUP_ALPHA" if output == "Alpha" else "RAMP_LOOKUP"
    return node.emit(op, (factor,), (table, int(steps)))


def _table_entry(samples: np.ndarray, x: float, steps: bool) -> list[float]:
    place = min(max(x, 0.0), 1.0) * (TABLE_SIZE - 1)
    index = int(place)
    share = 0.0 if steps else place - index
    after = samples[min(index + 1, TABLE_SIZE - 1)]
    return [float(value) for value in samples[index] * (1.0 - share) + after * share]


@value_node("ShaderNodeRGBCurve")
def rgb_curves(node: NodeView, output: str) -> Value:
    mapping = node.node.mapping
    mapping.initialize()
    red, green, blue, combined = mapping.curves

    def evaluate(x: float) -> list[float]:
        shared = mapping.evaluate(combined, x)
        return [mapping.evaluate(curve, shared) for curve in (red, green, blue)]

    return _curves(node, mapping, evaluate, node.value("Color"))


@value_node("ShaderNodeVectorCurve")
def vector_curves(node: NodeView, output: str) -> Value:
    mapping = node.node.mapping
    mapping.initialize()
    curves = list(mapping.curves)[:3]

    def evaluate(x: float) -> list[float]:
        return [mapping.evaluate(curve, x) for curve in curves]

    return _curves(node, mapping, evaluate, node.value("Vector")).retyped(VECTOR)


@value_node("ShaderNodeFloatCurve")
def float_curve(node: NodeView, output: str) -> Value:
    mapping = node.node.mapping
    mapping.initialize()
    curve = mapping.curves[0]

    def evaluate(x: float) -> list[float]:
        return [mapping.evaluate(curve, x)] * 3

    grey = node.emit("BROADCAST", (node.value("Value"),))
    return separate(node, _curves(node, mapping, evaluate, grey, "Factor"), 0)


def _curves(
    node: NodeView,
    mapping: bpy.types.CurveMapping,
    evaluate: Callable[[float], list[float]],
    value: Value,
    factor: str = "Fac",
) -> Value:
    """Tabulate over the curves' common range; outside of it continue straight, or stay level where asked to."""
    points = [point.location.x for curve in mapping.curves for point in curve.points]
    low, high = min(points), max(points)
    positions = (low + (high - low) * i / (TABLE_SIZE - 1) for i in range(TABLE_SIZE))
    table = node.compiler.code.table(np.array([evaluate(x) for x in positions], np.float32))
    ends = (constant(low), constant(high))
    if mapping.extend == "EXTRAPOLATED":
        return node.emit("CURVE_LOOKUP", (node.value(factor), value, *ends), (table,))
    limits = [constant(x, x, x, COLOR) for x in (low, high)]
    inside = node.vector_math("MINIMUM", node.vector_math("MAXIMUM", value, limits[0]), limits[1])
    level = node.emit("CURVE_LOOKUP", (constant(1.0), inside.retyped(COLOR), *ends), (table,))
    mixed = node.emit("MIX_VECTOR", (node.value(factor), value, level), (0,))
    return mixed.retyped(COLOR)
