"""Scenes by chance: what a number stands for is the same on every machine.

They leave out what addon/README.md lists as found otherwise by other techniques: objects that only some kinds of ray
see. Mirrors and clear glass are left out as well, whose caustics no number of samples tells apart.
"""

from __future__ import annotations

import math
import random

import bpy
from mathutils import Vector

from .blender_scenes import add_camera, add_light, material, set_world, shader

SHAPES = ("cube_add", "uv_sphere_add", "monkey_add", "plane_add", "torus_add", "ico_sphere_add", "cylinder_add")
TEXTURES = ("Noise", "Checker", "Voronoi", "Wave")
LAMPS = ("POINT", "SPOT", "AREA", "AREA", "SUN")
SKIES = ("ShaderNodeTexSky", "ShaderNodeTexChecker", "ShaderNodeTexNoise", "ShaderNodeTexGradient")


def build(seed: int) -> bpy.types.Scene:
    """A room or a floor with objects, lamps and a world, in a new file."""
    chance = random.Random(seed)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    materials = [_material(chance, f"material {number}") for number in range(chance.randint(2, 6))]
    has_room = chance.random() < 0.5
    if has_room:
        bpy.ops.mesh.primitive_cube_add(size=6, location=(0, 0, 3))
    else:
        bpy.ops.mesh.primitive_plane_add(size=chance.choice((8, 30)))
    _dress(chance, bpy.context.object, materials)
    for _ in range(chance.randint(1, 7)):
        _add_object(chance, materials)
    lamps = chance.choice((0, 1, 1, 2, 3, 8))
    for _ in range(lamps):
        _add_lamp(chance, scene, lamps)
    if lamps == 0 or chance.random() < 0.6:
        _add_world(chance, scene)
    _add_camera(chance, scene, has_room)
    return scene


def _color(chance: random.Random, lowest: float = 0.05) -> tuple[float, ...]:
    return (*(chance.uniform(lowest, 0.95) for _ in range(3)), 1.0)


def _principled(chance: random.Random, tree: bpy.types.ShaderNodeTree) -> bpy.types.Node:
    values = {"Base Color": _color(chance), "Roughness": chance.choice((chance.uniform(0.1, 1.0), 0.5, 1.0))}
    for name in ("Metallic", "Transmission Weight", "Coat Weight", "Sheen Weight", "Subsurface Weight", "Anisotropic"):
        if chance.random() < 0.2:
            values[name] = chance.choice((1.0, chance.random()))
    if chance.random() < 0.2:
        values["Alpha"] = chance.uniform(0.1, 0.95)
    if chance.random() < 0.15:
        values |= {"Emission Color": _color(chance), "Emission Strength": chance.uniform(0.1, 3.0)}
    if "Transmission Weight" in values:
        values["Roughness"] = chance.uniform(0.2, 0.8)
    node = shader(tree, "ShaderNodeBsdfPrincipled", **values)
    if chance.random() < 0.4:
        _link_texture(chance, tree, node)
    return node


def _link_texture(chance: random.Random, tree: bpy.types.ShaderNodeTree, node: bpy.types.Node) -> None:
    texture = tree.nodes.new(f"ShaderNodeTex{chance.choice(TEXTURES)}").outputs["Color"]
    name = chance.choice(("Base Color", "Base Color", "Roughness", "Normal"))
    if name == "Normal":
        texture = shader(tree, "ShaderNodeBump", Strength=chance.uniform(0.1, 0.6), Height=texture).outputs[0]
    tree.links.new(texture, node.inputs[name])


def _closure(chance: random.Random, tree: bpy.types.ShaderNodeTree, kinds: tuple[str, ...]) -> bpy.types.NodeSocket:
    kind = chance.choice(kinds)
    if kind == "Principled":
        return _principled(chance, tree).outputs[0]
    if kind == "Mix":
        parts = ("Principled", "Diffuse", "Anisotropic", "Translucent", "Transparent")
        mix = shader(tree, "ShaderNodeMixShader", Fac=chance.random())
        for socket in mix.inputs[1:3]:
            tree.links.new(_closure(chance, tree, parts), socket)
        return mix.outputs[0]
    if kind == "Emission":
        return shader(tree, "ShaderNodeEmission", Color=_color(chance), Strength=chance.uniform(0.2, 4.0)).outputs[0]
    node = shader(tree, f"ShaderNodeBsdf{kind}", Color=_color(chance, 0.3 if kind == "Transparent" else 0.05))
    if "Roughness" in node.inputs:
        node.inputs["Roughness"].default_value = chance.uniform(0.15, 0.7)
    if "IOR" in node.inputs:
        node.inputs["IOR"].default_value = chance.uniform(1.05, 1.6)
    return node.outputs[0]


def _material(chance: random.Random, name: str) -> bpy.types.Material:
    others = ("Diffuse", "Anisotropic", "Glass", "Refraction", "Translucent", "Transparent", "Emission", "Mix")
    return material(name, lambda tree: _closure(chance, tree, ("Principled",) * 4 + others))


def _dress(chance: random.Random, obj: bpy.types.Object, materials: list[bpy.types.Material]) -> None:
    chosen = chance.sample(materials, chance.choice((1, 1, 2)))
    for one in chosen:
        obj.data.materials.append(one)
    for polygon in obj.data.polygons:
        polygon.material_index = chance.randrange(len(chosen))


def _add_object(chance: random.Random, materials: list[bpy.types.Material]) -> None:
    place = {"location": [chance.uniform(-2, 2), chance.uniform(-2, 2), chance.uniform(0.2, 2.5)]}
    place["rotation"] = [chance.uniform(0, 6) for _ in range(3)]
    getattr(bpy.ops.mesh, f"primitive_{chance.choice(SHAPES)}")(**place)
    obj, scale = bpy.context.object, chance.uniform(0.2, 1.0)
    obj.scale = [scale * chance.uniform(0.5, 1.5) * (-1 if chance.random() < 0.1 else 1) for _ in range(3)]
    if chance.random() < 0.5:
        bpy.ops.object.shade_smooth()
    _dress(chance, obj, materials)


def _add_lamp(chance: random.Random, scene: bpy.types.Scene, count: int) -> None:
    kind = chance.choice(LAMPS)
    energy = chance.uniform(0.3, 3.0) if kind == "SUN" else chance.uniform(30, 300) / count
    place = (chance.uniform(-2.5, 2.5), chance.uniform(-2.5, 2.5), chance.uniform(2, 5))
    turn = (chance.uniform(-1, 1), chance.uniform(-1, 1), chance.uniform(0, 6))
    lamp = add_light(scene, kind, place, turn, energy=energy, color=_color(chance, 0.3)[:3]).data
    if kind in ("POINT", "SPOT"):
        lamp.shadow_soft_size = chance.uniform(0.05, 0.5)
    elif kind == "SUN":
        lamp.angle = chance.uniform(0.01, 0.5)
    else:
        lamp.shape = chance.choice(("SQUARE", "RECTANGLE", "DISK", "ELLIPSE"))
        lamp.size, lamp.size_y = chance.uniform(0.3, 2.0), chance.uniform(0.3, 2.0)
        lamp.spread = chance.choice((math.pi, chance.uniform(0.3, 3.0)))


def _add_world(chance: random.Random, scene: bpy.types.Scene) -> None:
    tree = set_world(scene, _color(chance)[:3], chance.uniform(0.1, 1.5)).node_tree
    background = tree.nodes["Background"]
    if chance.random() < 0.6:
        sky = tree.nodes.new(chance.choice(SKIES))
        tree.links.new(sky.outputs["Color"], background.inputs["Color"])
        if sky.bl_idname == "ShaderNodeTexSky":
            sky.sun_disc, background.inputs["Strength"].default_value = chance.random() < 0.3, 0.1


def _add_camera(chance: random.Random, scene: bpy.types.Scene, is_inside: bool) -> None:
    distance = 2.8 if is_inside else chance.uniform(4, 8)
    place = Vector((chance.uniform(-2.5, 2.5), -distance, chance.uniform(0.5, 4.0)))
    turn = (Vector((0, 0, 1)) - place).to_track_quat("-Z", "Y").to_euler()
    add_camera(scene, place, turn, chance.choice((18, 28, 50)) if is_inside else chance.uniform(28, 60))
