"""Scenes for passes by kind of scattering: every lobe, each way light can go through a surface, and media."""

from __future__ import annotations

import math

import bpy
import numpy as np
from numpy.typing import NDArray

from . import blender_scenes as build
from . import hair_scenes
from .engines import prepare

LONG_NAMES = bpy.app.version >= (5, 0, 0)
SURFACE_KINDS = ("Diffuse", "Glossy", "Transmission")
KINDS = (*SURFACE_KINDS, "Volume")
_SHORT = {"Diffuse": "Diff", "Glossy": "Gloss", "Transmission": "Trans", "Volume": "Volume"}
_SHORT_PARTS = {"Direct": "Dir", "Indirect": "Ind", "Color": "Col"}


def pass_name(kind: str, part: str) -> str:
    """As Blender of this version spells it."""
    return f"{kind} {part}" if LONG_NAMES else _SHORT[kind] + _SHORT_PARTS[part]


EMISSION, ENVIRONMENT = ("Emission", "Environment") if LONG_NAMES else ("Emit", "Env")


def ask_for_kinds(scene: bpy.types.Scene, wanted: bool = True) -> None:
    """Of both engines, with Emission and Environment."""
    layer = scene.view_layers[0]
    for kind in SURFACE_KINDS:
        for part in ("direct", "indirect", "color"):
            setattr(layer, f"use_pass_{kind.lower()}_{part}", wanted)
    for own in (layer.cistern, layer.cycles):
        own.use_pass_volume_direct = own.use_pass_volume_indirect = wanted
    layer.use_pass_emit = layer.use_pass_environment = wanted


def save_layers(scene: bpy.types.Scene, size: tuple[int, int], preset: str = "PATH_TRACING") -> None:
    """Equal settings of both engines, all layers into one file."""
    prepare(scene, *size)
    scene.cistern.preset = preset
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"


def ball(scene: bpy.types.Scene, x: float, y: float, surface: bpy.types.Material) -> bpy.types.Object:
    result = build.add_sphere(scene, surface, radius=0.45, segments=32)
    result.location = (x, y, 0.0)
    return result


def of(name: str, kind: str, **inputs: object) -> bpy.types.Material:
    return build.material(name, lambda tree: build.shader(tree, kind, **inputs).outputs[0])


def thin(name: str, kind: str, alpha: float, **inputs: object) -> bpy.types.Material:
    """Of which a share of `alpha` is there."""

    def make(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        mix = tree.nodes.new("ShaderNodeMixShader")
        mix.inputs[0].default_value = alpha
        tree.links.new(
            build.shader(tree, "ShaderNodeBsdfTransparent", Color=(0.9, 1, 0.8, 1)).outputs[0], mix.inputs[1]
        )
        tree.links.new(build.shader(tree, kind, **inputs).outputs[0], mix.inputs[2])
        return mix.outputs[0]

    return build.material(name, make)


def upright(scene: bpy.types.Scene, name: str, x: float, y: float, surface: bpy.types.Material) -> bpy.types.Object:
    points = [(x - 0.4, y, 0.05), (x + 0.4, y, 0.05), (x + 0.4, y + 0.15, 0.9), (x - 0.4, y + 0.15, 0.9)]
    return build.add_mesh(scene, name, points, [(0, 1, 2, 3)], surface)


def block(
    scene: bpy.types.Scene, name: str, center: tuple[float, float, float], size: float, inside: bpy.types.Material
) -> bpy.types.Object:
    """A cube of twice this size."""
    cube = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return build.add_mesh(scene, name, (size * np.array(cube) + np.array(center)).tolist(), sides, inside)


def light_surfaces(scene: bpy.types.Scene) -> None:
    build.add_light(scene, "AREA", (1.5, -1.0, 2.5), (0.4, 0.5, 0.0), energy=60.0, size=1.0)
    build.add_light(scene, "POINT", (-1.5, -1.5, 1.5), energy=30.0, shadow_soft_size=0.25)
    build.add_light(scene, "SUN", rotation=(0.9, 0.3, 0.0), energy=0.5, angle=0.1)
    build.set_world(scene)
    build.add_camera(scene, (0.0, -3.6, 3.4), (math.radians(46), 0.0, 0.0), lens=38.0)


def build_surfaces(scene: bpy.types.Scene) -> None:
    """Nine things on a floor that reflects a little, most with more than one kind of lobe; one shines."""
    plastic = dict(Base_Color=(0.7, 0.4, 0.2, 1), Roughness=0.35)
    build.add_floor(scene, build.principled("floor", Base_Color=(0.5, 0.55, 0.6, 1), Roughness=0.3))
    ball(scene, -1.2, 0.8, build.principled("plastic", **plastic, Coat_Weight=0.6, Coat_Roughness=0.05))
    ball(scene, 0.0, 0.8, of("metal", "ShaderNodeBsdfGlossy", Color=(0.9, 0.7, 0.5, 1), Roughness=0.4))
    ball(scene, 1.2, 0.8, of("mirror", "ShaderNodeBsdfGlossy", Color=(0.8, 0.9, 0.9, 1), Roughness=0.0))
    ball(scene, -1.2, -0.3, of("glass", "ShaderNodeBsdfGlass", Color=(0.9, 1, 0.9, 1), Roughness=0.0, IOR=1.45))
    ball(scene, 0.0, -0.3, of("frosted", "ShaderNodeBsdfGlass", Color=(1, 0.9, 0.8, 1), Roughness=0.4, IOR=1.45))
    skin = dict(Subsurface_Weight=0.7, Subsurface_Scale=0.1, Base_Color=(0.8, 0.5, 0.4, 1))
    ball(scene, 1.2, -0.3, build.principled("skin", **skin))
    upright(scene, "leaf", -0.8, -1.2, thin("leaf", "ShaderNodeBsdfTranslucent", 0.8, Color=(0.4, 0.8, 0.2, 1)))
    upright(scene, "veil", 0.2, -1.3, thin("veil", "ShaderNodeBsdfGlossy", 0.6, Roughness=0.15))
    upright(scene, "sign", 1.1, -1.2, of("sign", "ShaderNodeEmission", Color=(1, 0.6, 0.3, 1), Strength=1.5))
    light_surfaces(scene)


def build_hair(scene: bpy.types.Scene) -> None:
    """Hair on a ball of satin, where Blender can make curves."""
    build.add_floor(scene)
    build.add_sphere(scene, build.principled("satin", Sheen_Weight=1.0, Sheen_Roughness=0.4), radius=0.5)
    hair_scenes.add_fur(scene, of("hair", "ShaderNodeBsdfHairPrincipled", Color=(0.5, 0.25, 0.1, 1)), strands=800)
    light_surfaces(scene)


def build_media(scene: bpy.types.Scene) -> None:
    """A cloud that hides a part of a ball and shines a little, in fog."""
    build.add_floor(scene, build.principled("floor", Roughness=0.4))
    ball(scene, -0.4, 0.0, of("metal", "ShaderNodeBsdfGlossy", Roughness=0.3))
    cloud = bpy.data.materials.new("cloud")
    cloud.use_nodes = True
    tree = cloud.node_tree
    tree.nodes.clear()
    smoke = build.shader(tree, "ShaderNodeVolumePrincipled", Density=1.2, Anisotropy=0.3, Emission_Strength=0.1)
    tree.links.new(smoke.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
    block(scene, "cloud", (0.4, -0.3, 0.6), 0.45, cloud)
    lamp = build.add_light(scene, "POINT", (1.0, -1.0, 2.5), energy=100.0, shadow_soft_size=0.1)
    lamp.data.cycles.use_multiple_importance_sampling = False  # see test_against_cycles_volumes
    build.set_world(scene, strength=0.3)
    build.add_camera(scene, (0.0, -3.6, 1.6), (math.radians(72), 0.0, 0.0), lens=45.0)


def color(layers: dict[str, NDArray], name: str) -> NDArray[np.float64]:
    return np.stack([layers[f"ViewLayer.{name}.{channel}"] for channel in "RGB"], axis=2).astype(np.float64)


def light_of(layers: dict[str, NDArray], kind: str, part: str) -> NDArray[np.float64]:
    """What Combined has of it: multiplied by the colour."""
    light = color(layers, pass_name(kind, part))
    return light if kind == "Volume" else light * color(layers, pass_name(kind, "Color"))


def sum_of_kinds(layers: dict[str, NDArray], has_transparent_film: bool = False) -> NDArray[np.float64]:
    """Of all kinds, Emission and Environment: Combined. Of what is behind a transparent film that has nothing."""
    parts = [light_of(layers, kind, part) for kind in KINDS for part in ("Direct", "Indirect")]
    seen = color(layers, EMISSION)
    return sum(parts) + (seen if has_transparent_film else seen + color(layers, ENVIRONMENT))
