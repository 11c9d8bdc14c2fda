"""Shader nodes: each appends closure instructions under a weight."""

from __future__ import annotations

from ..versions import (
    coats_are_whole,
    films_cover_metal,
    glass_is_anisotropic,
    joins_links,
    radius_is_free_path,
    rough_diffuse_is_dim,
    thin_glass_is_wide,
)
from .compiler import Compiler, NodeView, closure_node, flatten_shader, volume_node
from .enums import CLAMP_TYPES, DISTRIBUTIONS, SHEEN_DISTRIBUTIONS, SUBSURFACE_METHODS, TOON_COMPONENTS
from .instructions import COLOR, VECTOR, Value, constant
from .vector import default_tangent

ONE = constant(1.0)
ZERO_VECTOR = constant(0.0, letter=VECTOR)
NO_SUBSURFACE = (ZERO_VECTOR, constant(0.0), ONE, constant(0.0))
NO_FILM = (constant(0.0), ONE)


@volume_node("ShaderNodeMixShader")
@closure_node("ShaderNodeMixShader")
def mix_shader(node: NodeView, weight: Value) -> None:
    factor = node.emit("CLAMP", (node.value("Fac"), constant(0.0), ONE), (CLAMP_TYPES.index("MINMAX"),))
    rest = node.math("SUBTRACT", ONE, factor)
    for identifier, share in (("Shader", rest), ("Shader_001", factor)):
        flatten_shader(node.compiler, node.port(identifier), node.math("MULTIPLY", weight, share))


@volume_node("ShaderNodeAddShader")
@closure_node("ShaderNodeAddShader")
def add_shader(node: NodeView, weight: Value) -> None:
    for identifier in ("Shader", "Shader_001"):
        flatten_shader(node.compiler, node.port(identifier), weight)


def _emission(node: NodeView, name: str, dark: Value) -> Value:
    """Colour or strength: Cycles emits nothing where none of the channels is above 0, if that is known beforehand."""
    value = node.value(name)
    is_known = value.constant is not None and (joins_links() or node.linked(name) is None)
    return dark if is_known and max(value.constant) <= 0.0 else value


@closure_node("ShaderNodeBsdfPrincipled")
def principled(node: NodeView, weight: Value) -> None:
    thick = _thick_wall(node)
    anisotropic = node.value("Anisotropic")
    inputs = [
        *node.values("Base Color, Metallic, Roughness, IOR, Alpha"),
        node.normal(),
        *node.values("Diffuse Roughness, Subsurface Weight, Specular IOR Level, Specular Tint"),
        anisotropic,
        node.value("Anisotropic Rotation"),
        _tangent(node, anisotropic),
        *node.values("Transmission Weight, Coat Weight, Coat Roughness, Coat IOR, Coat Tint"),
        _coat_normal(node),
        *node.values("Sheen Weight, Sheen Roughness, Sheen Tint"),
        _emission(node, "Emission Color", constant(0.0, 0.0, 0.0, COLOR)),
        _emission(node, "Emission Strength", constant(0.0)),
        *_subsurface(node),
        *_thin_film(node),
        _inverse_abbe(node),
    ]
    multiple_scattering = node.node.distribution == "MULTI_GGX"
    method = node.choice("subsurface_method", SUBSURFACE_METHODS)
    layers = int(films_cover_metal()) + 2 * int(glass_is_anisotropic())
    layers += 4 * int(rough_diffuse_is_dim()) + 8 * int(coats_are_whole())
    thin_wall = 2 if thin_glass_is_wide() else 1
    for share, wall in ((thick, 0), (node.math("SUBTRACT", ONE, thick), thin_wall)):
        parameters = (int(multiple_scattering), method, layers, wall)
        node.compiler.code.closure("CLOSURE_PRINCIPLED", (node.math("MULTIPLY", weight, share), *inputs), parameters)


def new_principled(compiler: Compiler) -> None:
    """With the values of a new node."""
    white, zero, half = constant(1.0, 1.0, 1.0, COLOR), constant(0.0), constant(0.5)
    normal = compiler.code.emit("NORMAL")
    inputs = [
        *(ONE, constant(0.8, 0.8, 0.8, COLOR), zero, half, constant(1.5), ONE, normal),
        *(zero, zero, half, white),  # diffuse roughness, subsurface, specular
        *(zero, zero, ZERO_VECTOR, zero),  # anisotropy, transmission
        *(zero, constant(0.03), constant(1.5), white, normal),  # coat
        *(zero, half, white, white, zero),  # sheen, emission
        *NO_SUBSURFACE,
        *NO_FILM,
        zero,  # dispersion
    ]
    compiler.code.closure("CLOSURE_PRINCIPLED", inputs, (1, 0, 0, 0))


def _subsurface(node: NodeView) -> tuple[Value, ...]:
    """Radius, scale, index of refraction and anisotropy, which are not read where nothing gets below the surface."""
    if node.value("Subsurface Weight").constant == (0.0, 0.0, 0.0):
        return NO_SUBSURFACE
    others = node.values("Subsurface Radius, Subsurface Scale, Subsurface IOR")
    return (*others, _scattering_anisotropy(node, "Subsurface Anisotropy"))


def _scattering_anisotropy(node: NodeView, name: str) -> Value:
    """Before Blender 5.2 it was never below 0."""
    value = node.value(name)
    return value if radius_is_free_path() else node.math("MAXIMUM", value, constant(0.0))


def _coat_normal(node: NodeView) -> Value:
    """Without a coat its normal is not read: do not compile a bump for it."""
    weight = node.value("Coat Weight")
    return node.shading_normal() if weight.constant == (0.0, 0.0, 0.0) else node.normal("Coat Normal")


def _tangent(node: NodeView, anisotropy: Value) -> Value:
    """Read only where the lobe is anisotropic; unlinked, it circles around the object's Z axis."""
    if anisotropy.constant == (0.0, 0.0, 0.0):
        return ZERO_VECTOR
    return node.linked("Tangent") or default_tangent(node)


def _thin_film(node: NodeView) -> tuple[Value, ...]:
    """Thickness and index, which is not read where there is no film."""
    thickness = node.value("Thin Film Thickness")
    return NO_FILM if thickness.constant == (0.0, 0.0, 0.0) else (thickness, node.value("Thin Film IOR"))


def _inverse_abbe(node: NodeView) -> Value:
    """Of the dispersion of glass, which Blender has from 5.3 on."""
    scale = node.value("Transmission Dispersion Scale")
    if scale.constant == (0.0, 0.0, 0.0):
        return constant(0.0)
    bounded = node.math("MINIMUM", node.math("MAXIMUM", scale, constant(0.0)), ONE)
    return node.math(
        "DIVIDE", bounded, node.math("MAXIMUM", node.value("Transmission Dispersion Abbe Number"), constant(0.0))
    )


def _thick_wall(node: NodeView) -> Value:
    """0 where walls are thin, 1 where not, as always before Blender 5.2. Of linked numbers the whole part counts."""
    return node.math("COMPARE", node.math("TRUNC", node.value("Thin Wall")), constant(0.0))


def _distribution(node: NodeView) -> tuple[int]:
    return (node.choice("distribution", DISTRIBUTIONS),)


@closure_node("ShaderNodeBsdfDiffuse")
def diffuse(node: NodeView, weight: Value) -> None:
    inputs = (weight, *node.values("Color, Roughness"), node.normal())
    node.compiler.code.closure("CLOSURE_DIFFUSE", inputs, (int(rough_diffuse_is_dim()),))


@closure_node("ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfGlossy")
def glossy(node: NodeView, weight: Value) -> None:
    anisotropy = node.value("Anisotropy")
    inputs = (weight, *node.values("Color, Roughness"), anisotropy, node.value("Rotation"), node.normal())
    tangent = _tangent(node, anisotropy)
    node.compiler.code.closure("CLOSURE_GLOSSY", (*inputs, tangent), _distribution(node))


@closure_node("ShaderNodeBsdfGlass")
def glass(node: NodeView, weight: Value) -> None:
    anisotropy = node.value("Anisotropy")
    inputs = (weight, *node.values("Color, Roughness, IOR"), node.normal(), *_thin_film(node), anisotropy)
    inputs = (*inputs, node.value("Rotation"), _tangent(node, anisotropy))  # from Blender 5.3 on
    node.compiler.code.closure("CLOSURE_GLASS", inputs, _distribution(node))


@closure_node("ShaderNodeBsdfRefraction")
def refraction(node: NodeView, weight: Value) -> None:
    inputs = (weight, *node.values("Color, Roughness, IOR"), node.normal())
    node.compiler.code.closure("CLOSURE_REFRACTION", inputs, _distribution(node))


@closure_node("ShaderNodeBsdfRayPortal")
def ray_portal(node: NodeView, weight: Value) -> None:
    position = node.linked("Position") or node.at_shift("POSITION")
    inputs = (weight, node.value("Color"), position, node.value("Direction"))
    node.compiler.code.closure("CLOSURE_RAY_PORTAL", inputs)


@closure_node("ShaderNodeBsdfTranslucent")
def translucent(node: NodeView, weight: Value) -> None:
    node.compiler.code.closure("CLOSURE_TRANSLUCENT", (weight, node.value("Color"), node.normal()))


@closure_node("ShaderNodeBsdfTransparent")
def transparent(node: NodeView, weight: Value) -> None:
    node.compiler.code.closure("CLOSURE_TRANSPARENT", (weight, node.value("Color")))


@closure_node("ShaderNodeEmission", "ShaderNodeBackground")
def emission(node: NodeView, weight: Value) -> None:
    node.compiler.code.closure("CLOSURE_EMISSION", (weight, *node.values("Color, Strength")))


@closure_node("ShaderNodeBsdfSheen")
def sheen(node: NodeView, weight: Value) -> None:
    inputs = (weight, *node.values("Color, Roughness"), node.normal())
    node.compiler.code.closure("CLOSURE_SHEEN", inputs, (node.choice("distribution", SHEEN_DISTRIBUTIONS),))


@closure_node("ShaderNodeBsdfToon")
def toon(node: NodeView, weight: Value) -> None:
    inputs = (weight, *node.values("Color, Size, Smooth"), node.normal())
    node.compiler.code.closure("CLOSURE_TOON", inputs, (node.choice("component", TOON_COMPONENTS),))


@closure_node("ShaderNodeSubsurfaceScattering")
def subsurface_scattering(node: NodeView, weight: Value) -> None:
    surface = node.values("Color, Radius, Scale, IOR, Roughness")
    inputs = (weight, *surface, _scattering_anisotropy(node, "Anisotropy"), node.normal())
    node.compiler.code.closure("CLOSURE_SUBSURFACE", inputs, (node.choice("falloff", SUBSURFACE_METHODS),))


@closure_node("ShaderNodeHoldout")
def holdout(node: NodeView, weight: Value) -> None:
    node.compiler.code.closure("CLOSURE_HOLDOUT", (weight,))


@closure_node("ShaderNodeBsdfMetallic")
def metallic(node: NodeView, weight: Value) -> None:
    is_conductor = node.node.fresnel_type == "PHYSICAL_CONDUCTOR"
    names = "IOR, Extinction" if is_conductor else "Base Color, Edge Tint"
    colors = (value.retyped(COLOR) for value in node.values(names))
    anisotropy = node.value("Anisotropy")
    rest = (node.value("Roughness"), anisotropy, node.value("Rotation"), node.normal(), _tangent(node, anisotropy))
    inputs = (weight, *colors, *rest, *_thin_film(node))
    node.compiler.code.closure("CLOSURE_METALLIC", inputs, (*_distribution(node), int(is_conductor)))


@closure_node("unsupported")
def unsupported(node: NodeView, weight: Value) -> None:
    """Stand-in for a shader the core does not have: diffuse of its colour, nothing for a volume."""
    output = node.node.outputs[0].name if len(node.node.outputs) else ""
    if output == "Volume" or (node.port("Color") is None and node.port("Base Color") is None):
        return
    color = node.value("Color") if node.port("Color") else node.value("Base Color")
    node.compiler.code.closure("CLOSURE_DIFFUSE", (weight, color, constant(0.0), node.shading_normal()), (0,))
