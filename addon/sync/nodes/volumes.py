"""Volume shaders: each adds what a medium does to light, under a weight. Formulas as in Cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .color import blackbody_color
from .compiler import Compiler, NodeView, flatten_shader, volume_node
from .enums import MATH_OPERATIONS, PHASE_FUNCTIONS
from .graph import Port
from .instructions import COLOR, FLOAT, VECTOR, Value, constant

ONE, ZERO = constant(1.0), constant(0.0)
WHITE, BLACK = constant(1.0, 1.0, 1.0, COLOR), constant(0.0, letter=COLOR)

PHASE_INPUTS = {
    "HENYEY_GREENSTEIN": ["Anisotropy"],
    "RAYLEIGH": [],
    "DRAINE": ["Anisotropy", "Alpha"],
    "MIE": ["Diameter"],
    "FOURNIER_FORAND": ["IOR", "Backscatter"],
}
"""What each phase function of a node depends on, in the order of the instruction's inputs."""

STEFAN_BOLTZMANN = 5.670373e-8 * 1e-6 / math.pi
"""W/(m^2 K^4), in Cycles' unit for the radiance of a fire."""


def add_medium(compiler: Compiler, volume: Port) -> None:
    """What reaches a Volume input."""
    compiler.in_volume = True
    flatten_shader(compiler, volume, ONE)
    compiler.in_volume = False


def grid_factor(compiler: Compiler, name: str) -> Value:
    """What a volume object multiplies an input by: a grid where it has one of this name."""
    if compiler.grids is None or not name:
        return constant(1.0, 1.0, 1.0, VECTOR)
    compiler.grids.add(name)
    return compiler.code.emit("GRID_FACTOR", (), (compiler.code.program.attribute(name),))


def add_default_medium(compiler: Compiler) -> None:
    """Of a volume object without a material: a new Principled Volume, as in Cycles."""
    density = compiler.code.convert(grid_factor(compiler, "density"), FLOAT)
    grey = constant(0.5, 0.5, 0.5, COLOR)
    compiler.code.closure("CLOSURE_VOLUME", (ONE, grey, grey, density, ZERO, ZERO), (0,))


def _factor(node: NodeView, value: Value, attribute: str) -> Value:
    """A value multiplied by the grid that a node names, unless it names none."""
    socket = node.port(attribute)
    name = "" if socket is None else socket.socket.default_value
    if node.compiler.grids is None or not name:
        return value
    factor = grid_factor(node.compiler, name)
    if value.type == COLOR:
        return node.vector_math("MULTIPLY", value, factor).retyped(COLOR)
    return node.math("MULTIPLY", value, node.math("MAXIMUM", node.emit("AVERAGE", (factor,)), ZERO))


@dataclass(frozen=True)
class _Phase:
    kind: str = "HENYEY_GREENSTEIN"
    inputs: tuple[Value, Value] = (ZERO, ZERO)


ISOTROPIC = _Phase()


def _add(
    node: NodeView, weight: Value, scattering: Value, absorption: Value, density: Value, phase: _Phase = ISOTROPIC
) -> None:
    inputs = (weight, scattering, absorption, density, *phase.inputs)
    node.compiler.code.closure("CLOSURE_VOLUME", inputs, (PHASE_FUNCTIONS.index(phase.kind),))


def _rest(node: NodeView, color: Value) -> Value:
    """What a colour lacks to be white."""
    zero = constant(0.0, letter=VECTOR)
    return node.vector_math("MAXIMUM", node.vector_math("SUBTRACT", WHITE, color), zero).retyped(COLOR)


def _phase(node: NodeView) -> _Phase:
    """Blender before 4.3 has one phase function."""
    kind = getattr(node.node, "phase", "HENYEY_GREENSTEIN")
    if kind not in PHASE_INPUTS:
        node.warn(f"the phase function {kind} is not supported: Henyey-Greenstein is used")
        kind = "HENYEY_GREENSTEIN"
    first, second, *_ = (*map(node.value, PHASE_INPUTS[kind]), ZERO, ZERO)
    return _Phase(kind, (first, second))


@volume_node("ShaderNodeVolumeAbsorption")
def absorption(node: NodeView, weight: Value) -> None:
    color, density = node.values("Color, Density")
    _add(node, weight, BLACK, _rest(node, color), density)


@volume_node("ShaderNodeVolumeScatter")
def scatter(node: NodeView, weight: Value) -> None:
    color, density = node.values("Color, Density")
    _add(node, weight, color, BLACK, density, _phase(node))


@volume_node("ShaderNodeVolumeCoefficients")
def coefficients(node: NodeView, weight: Value) -> None:
    scattered, absorbed, emitted = (
        node.value(f"{kind} Coefficients") for kind in ("Scatter", "Absorption", "Emission")
    )
    _add(node, weight, scattered, absorbed, ONE, _phase(node))
    node.compiler.code.closure("CLOSURE_VOLUME_EMISSION", (weight, emitted, ONE))


@volume_node("ShaderNodeEmission")
def emission(node: NodeView, weight: Value) -> None:
    node.compiler.code.closure("CLOSURE_VOLUME_EMISSION", (weight, *node.values("Color, Strength")))


@volume_node("ShaderNodeVolumePrincipled")
def principled(node: NodeView, weight: Value) -> None:
    """Its attributes are those of volume objects: meshes have none."""
    color, density, anisotropy, tint = node.values("Color, Density, Anisotropy, Absorption Color")
    color, density = _factor(node, color, "Color Attribute"), _factor(node, density, "Density Attribute")
    half, zero = constant(0.5, 0.5, 0.5, VECTOR), constant(0.0, letter=VECTOR)
    root = node.vector_math("POWER", node.vector_math("MAXIMUM", tint, zero), half)
    absorbed = node.vector_math("MULTIPLY", _rest(node, color), _rest(node, root))
    _add(node, weight, color, absorbed, density, _Phase(inputs=(anisotropy, ZERO)))
    emit = node.compiler.code.closure
    strength = node.math("MAXIMUM", node.value("Emission Strength"), ZERO)
    emit("CLOSURE_VOLUME_EMISSION", (weight, node.value("Emission Color"), strength))
    intensity = node.value("Blackbody Intensity")
    if intensity.constant is None or intensity.constant[0] > 0.0:
        emit("CLOSURE_VOLUME_EMISSION", (weight, *_fire(node, intensity)))


def _fire(node: NodeView, intensity: Value) -> tuple[Value, Value]:
    """Colour and strength of what glows by its temperature; nothing where the intensity is not above 0."""
    temperature = _factor(node, node.value("Temperature"), "Temperature Attribute")
    kelvin = node.math("MAXIMUM", temperature, ZERO)
    color = node.vector_math("MULTIPLY", node.value("Blackbody Tint"), blackbody_color(node, kelvin))
    fourth_power = node.math("POWER", kelvin, constant(4.0))
    mixed = node.emit("MIX_FLOAT", (intensity, ONE, fourth_power), (0,))
    is_on = node.emit("MATH", (intensity, ZERO, ZERO), (MATH_OPERATIONS.index("GREATER_THAN"), 0))
    return color, node.math("MULTIPLY", node.math("MULTIPLY", mixed, constant(STEFAN_BOLTZMANN)), is_on)
