"""Scenes for light groups: emitters of every kind, each in a group of its own."""

from __future__ import annotations

import math

import bpy
import numpy as np
from numpy.typing import NDArray

from . import blender_scenes as build
from . import kind_scenes as kinds
from .pass_scenes import Layers

# Groups by what is in them.
LAMP_GROUPS = {"AREA": "key", "POINT": "fill", "SUN": "sun"}


def add_groups(scene: bpy.types.Scene, *names: str) -> None:
    for name in names:
        scene.view_layers[0].lightgroups.add().name = name


def remove_groups(scene: bpy.types.Scene) -> None:
    """Those of the view layer; objects still name theirs."""
    for layer in scene.view_layers:
        while layer.lightgroups:
            layer.active_lightgroup_index = 0
            with bpy.context.temp_override(scene=scene, view_layer=layer):
                bpy.ops.scene.view_layer_remove_lightgroup()


def name_groups(scene: bpy.types.Scene) -> None:
    """Of lamps by their type, and of the world."""
    for obj in scene.objects:
        if obj.type == "LIGHT":
            obj.lightgroup = LAMP_GROUPS[obj.data.type]
    scene.world.lightgroup = "sky"


def build_surfaces(scene: bpy.types.Scene) -> None:
    """Things of every kind on a floor; groups of three lamps, a sign that shines, and the sky."""
    kinds.build_surfaces(scene)
    name_groups(scene)
    bpy.data.objects["sign"].lightgroup = "sign"
    add_groups(scene, "key", "fill", "sun", "sign", "sky")


def build_media(scene: bpy.types.Scene) -> None:
    """A cloud that shines, a lamp and the sky."""
    kinds.build_media(scene)
    name_groups(scene)
    bpy.data.objects["cloud"].lightgroup = "cloud"
    add_groups(scene, "fill", "cloud", "sky")


def build_nested_media(scene: bpy.types.Scene) -> None:
    """A glowing cloud inside of another, in fog that glows as well."""
    build.add_floor(scene)
    build.set_world(scene, strength=0.3)
    build.add_camera(scene, (0.0, -3.6, 1.6), (math.radians(72), 0.0, 0.0), lens=45.0)
    for name, size, glow in (("outer", 0.6, 0.2), ("inner", 0.3, 1.0)):
        cloud = bpy.data.materials.new(name)
        add_volume(cloud, "ShaderNodeOutputMaterial", Density=0.5, Emission_Strength=glow)
        kinds.block(scene, name, (0.0, 0.0, 0.65), size, cloud).lightgroup = name
    add_volume(scene.world, "ShaderNodeOutputWorld", Density=0.05, Emission_Strength=0.02)
    add_groups(scene, "outer", "inner")
    if bpy.app.version >= (5, 0, 0):  # before, Cycles has the glow of the world's fog in no group
        scene.world.lightgroup = "sky"
        add_groups(scene, "sky")


def add_volume(owner: bpy.types.Material | bpy.types.World, output: str, **inputs: object) -> None:
    """A Principled Volume; of materials it is all there is."""
    owner.use_nodes = True
    tree = owner.node_tree
    if isinstance(owner, bpy.types.Material):
        tree.nodes.clear()
    end = next((node for node in tree.nodes if node.bl_idname == output), None) or tree.nodes.new(output)
    tree.links.new(build.shader(tree, "ShaderNodeVolumePrincipled", **inputs).outputs[0], end.inputs["Volume"])


def build_instances(scene: bpy.types.Scene) -> None:
    """Two empties bring a lantern, of a lamp and a glowing pane: what names no group is of the empty's. The sun names
    one that the view layer does not have, the sky none."""
    build.add_floor(scene, build.principled("floor", Base_Color=(0.5, 0.55, 0.6, 1), Roughness=0.3))
    kinds.ball(scene, 0.0, 0.0, build.principled("plastic", Base_Color=(0.7, 0.4, 0.2, 1), Roughness=0.35))
    lantern = bpy.data.collections.new("lantern")
    lamp = build.add_light(scene, "POINT", (0.0, 0.0, 0.8), energy=15.0, shadow_soft_size=0.1)
    pane = kinds.upright(scene, "pane", 0.0, 0.2, kinds.of("pane", "ShaderNodeEmission", Strength=1.5))
    pane.lightgroup = "panes"
    for part in (lamp, pane):
        scene.collection.objects.unlink(part)
        lantern.objects.link(part)
    for name, place in (("left", (-1.2, 0.0, 0.0)), ("right", (1.2, 0.3, 0.0))):
        empty = bpy.data.objects.new(name, None)
        empty.instance_type, empty.instance_collection = "COLLECTION", lantern
        empty.location, empty.lightgroup = place, name
        scene.collection.objects.link(empty)
    build.add_light(scene, "SUN", rotation=(0.9, 0.3, 0.0), energy=0.5, angle=0.1).lightgroup = "nowhere"
    build.set_world(scene)
    build.add_camera(scene, (0.0, -3.6, 3.4), (math.radians(46), 0.0, 0.0), lens=38.0)
    add_groups(scene, "left", "right", "panes", "nobody")


def group(layers: Layers, name: str) -> NDArray[np.float64]:
    return kinds.color(layers, f"Combined_{name}")


def names_of(scene: bpy.types.Scene) -> list[str]:
    return [one.name for one in scene.view_layers[0].lightgroups]


def sum_of_groups(layers: Layers, scene: bpy.types.Scene) -> NDArray[np.float64]:
    return sum(group(layers, name) for name in names_of(scene))
