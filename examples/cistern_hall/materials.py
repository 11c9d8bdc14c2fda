"""The materials of the hall: Principled nodes with image textures, and a world with a sky."""

import bpy
from bpy.types import Image, Material, Node, NodeTree

from . import textures

LINEAR = "Linear Rec.709"
Colour = tuple[float, float, float]


def principled(name: str, colour: Colour = (0.8, 0.8, 0.8), **inputs: float) -> tuple[Material, Node]:
    """A material and its Principled node; keywords are the names of sockets with underscores for blanks."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value = (*colour, 1.0)
    for socket, value in inputs.items():
        node.inputs[socket.replace("_", " ").title().replace("Ior", "IOR")].default_value = value
    return material, node


def image_node(tree: NodeTree, image: Image, scale: float) -> Node:
    """An image texture, repeated `scale` times over the UV map."""
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Scale"].default_value = (scale, scale, scale)
    tree.links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    return texture


def textured(
    name: str, colour: Image, relief: Image | None = None, scale: float = 1.0, depth: float = 1.0, **inputs: float
) -> Material:
    material, node = principled(name, **inputs)
    tree = material.node_tree
    tree.links.new(image_node(tree, colour, scale).outputs["Color"], node.inputs["Base Color"])
    if relief is not None:
        normal = tree.nodes.new("ShaderNodeNormalMap")
        normal.inputs["Strength"].default_value = depth
        tree.links.new(image_node(tree, relief, scale).outputs["Color"], normal.inputs["Color"])
        tree.links.new(normal.outputs["Normal"], node.inputs["Normal"])
    return material


def glowing(name: str, colour: Colour, strength: float) -> Material:
    """Emits `colour` x `strength` W/(m2 sr)."""
    material, node = principled(name, (0.8, 0.8, 0.8), roughness=0.5)
    node.inputs["Emission Color"].default_value = (*colour, 1.0)
    node.inputs["Emission Strength"].default_value = strength
    return material


def make_materials() -> dict[str, Material]:
    brick, brick_relief = textures.bricks()
    stone, stone_relief = textures.limestone()
    brick_image = textures.to_image("bricks", brick, "sRGB")
    brick_normal = textures.to_image("bricks normal", brick_relief, "Non-Color")
    stone_image = textures.to_image("limestone", stone, "sRGB")
    stone_normal = textures.to_image("limestone normal", stone_relief, "Non-Color")
    marble_image = textures.to_image("marble", textures.marble(), "sRGB")
    wood_image = textures.to_image("wood", textures.wood(), "sRGB")
    glaze_image = textures.to_image("glaze", textures.glaze(), "sRGB")
    return {
        "bricks": textured("Bricks", brick_image, brick_normal, roughness=0.85),
        "limestone": textured("Limestone", stone_image, stone_normal, depth=0.7, roughness=0.7),
        "marble": textured("Marble", marble_image, roughness=0.28),
        "polished": textured("Polished Marble", marble_image, roughness=0.35, coat_weight=0.8, coat_roughness=0.04),
        "wood": textured("Wet Wood", wood_image, roughness=0.3),
        "glaze": textured("Glazed Clay", glaze_image, roughness=0.45, coat_weight=1.0, coat_roughness=0.02),
        "water": principled("Water", (0.006, 0.020, 0.018), roughness=0.025, ior=1.33)[0],
        "bronze": principled("Bronze", (0.62, 0.38, 0.17), metallic=1.0, roughness=0.28)[0],
        "gold": principled("Gold", (1.0, 0.71, 0.29), metallic=1.0, roughness=0.12)[0],
        "glass": principled("Glass", (0.96, 1.0, 0.98), roughness=0.0, ior=1.5, transmission_weight=1.0)[0],
        "wax": principled("Wax", (0.87, 0.78, 0.58), roughness=0.45)[0],
        "lamp": glowing("Lamp", (1.0, 0.58, 0.24), 55.0),
        "flame": glowing("Flame", (1.0, 0.50, 0.16), 260.0),
    }


def make_world(strength: float, turn: float) -> bpy.types.World:
    """The sky around the hall, turned about Z by `turn` radians."""
    world = bpy.data.worlds.new("Sky")
    world.use_nodes = True
    tree = world.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = strength
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, turn)
    environment = tree.nodes.new("ShaderNodeTexEnvironment")
    environment.image = textures.to_image("sky", textures.sky(), LINEAR, is_float=True)
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], environment.inputs["Vector"])
    tree.links.new(environment.outputs["Color"], background.inputs["Color"])
    return world
