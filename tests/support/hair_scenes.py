"""Hair built by script: curves and particle systems on the test sphere."""

from __future__ import annotations

import bpy
import numpy as np

from tests.support import blender_scenes as build

CAN_MAKE_CURVES = "add_curves" in bpy.types.Curves.bl_rna.functions
"""By script."""
_SPLINE_TYPE = "GeometryNodeCurveSplineType"


def hair_curves(name: str, positions: np.ndarray, radii: np.ndarray) -> bpy.types.Curves:
    """`positions` (strands, keys, 3), `radii` (strands, keys)."""
    curves = bpy.data.hair_curves.new(name)
    curves.add_curves([positions.shape[1]] * len(positions))
    curves.attributes["position"].data.foreach_set("vector", positions.astype(np.float32).ravel())
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii.astype(np.float32).ravel())
    return curves


def make_poly(obj: bpy.types.Object, first: int, end: int) -> None:
    """Its curves from `first` to before `end`, by geometry nodes: scripts cannot choose types in Blender 4.2."""
    tree = bpy.data.node_groups.new("poly", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, finish, node = (tree.nodes.new(k) for k in ("NodeGroupInput", "NodeGroupOutput", _SPLINE_TYPE))
    node.spline_type = "POLY"
    index = tree.nodes.new("GeometryNodeInputIndex").outputs[0]
    middle, reach = 0.5 * (first + end - 1), 0.5 * (end - first)
    chosen = build.shader(tree, "ShaderNodeMath", Value=index)
    chosen.operation = "COMPARE"
    chosen.inputs[1].default_value, chosen.inputs[2].default_value = middle, reach
    tree.links.new(chosen.outputs[0], node.inputs["Selection"])
    tree.links.new(start.outputs[0], node.inputs["Curve"])
    tree.links.new(node.outputs[0], finish.inputs[0])
    obj.modifiers.new("poly", "NODES").node_group = tree


def scale_radii(curves: bpy.types.Curves, factor: float) -> None:
    data = curves.attributes["radius"].data
    radii = np.empty(len(data), np.float32)
    data.foreach_get("value", radii)
    data.foreach_set("value", radii * np.float32(factor))
    curves.update_tag()


def fur(strands: int = 1600, keys: int = 6, length: float = 0.35, seed: int = 1) -> np.ndarray:
    """Keys of bent strands around a sphere of radius 0.5 that stands where the test sphere does."""
    rng = np.random.default_rng(seed)
    roots = rng.normal(size=(strands, 1, 3))
    roots /= np.linalg.norm(roots, axis=2, keepdims=True)
    t = np.linspace(0.0, 1.0, keys)[None, :, None]
    bend = 0.4 * rng.normal(size=(strands, 1, 3)) * length
    return roots * (0.5 + length * t) + bend * t**2 * np.cos(3.0 * t) + np.array([0.0, 0.0, 0.7])


def add_fur(scene: bpy.types.Scene, surface: bpy.types.Material, radius: float = 0.003, **shape) -> bpy.types.Object:
    """Curves whose tips are a quarter as wide as their roots."""
    positions = fur(**shape)
    taper = np.linspace(1.0, 0.25, positions.shape[1])
    curves = hair_curves("fur", positions, np.tile(radius * taper, (len(positions), 1)))
    curves.materials.append(surface)
    result = bpy.data.objects.new("fur", curves)
    scene.collection.objects.link(result)
    return result


def add_particle_hair(obj: bpy.types.Object, material_slot: int = 1, **members) -> bpy.types.ParticleSettings:
    """A hair system with values that show in a small picture; `members` of its settings."""
    obj.modifiers.new("hair", "PARTICLE_SYSTEM")
    settings = obj.particle_systems[0].settings
    settings.type = "HAIR"
    values = {"count": 600, "hair_length": 0.4, "root_radius": 1.0, "tip_radius": 0.2, "radius_scale": 0.012}
    for name, value in (values | {"material": material_slot, "use_close_tip": False} | members).items():
        setattr(settings, name, value)
    return settings


def coloured_by(make_color) -> bpy.types.Material:
    """Diffuse with the colour that `make_color` builds in a tree."""
    return build.material(
        "hair", lambda tree: build.shader(tree, "ShaderNodeBsdfDiffuse", Color=make_color(tree)).outputs[0]
    )
