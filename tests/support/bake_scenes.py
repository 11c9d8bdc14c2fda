"""A scene to bake, and bakes of it by either engine."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from . import blender_scenes as build
from .engines import prepare

SIZE = 64
LAMP_WATTS = 200.0


class BakeScene:
    """A head over a floor in the light of a window, and the image that it is baked to."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self.scene = scene
        build.set_world(scene, (0.3, 0.4, 0.6), 1.0)
        self.lamp = build.add_light(scene, "AREA", (2.0, -2.0, 3.0), (0.7, 0.3, 0.3), energy=LAMP_WATTS, size=1.0)
        build.add_floor(scene).location.z = -1.0
        build.add_camera(scene, (0.0, -5.0, 1.0), (1.4, 0.0, 0.0))
        bpy.ops.mesh.primitive_monkey_add(rotation=(0.3, 0.2, 0.5))
        self.head = bpy.context.object
        self.head.scale = (1.0, 1.2, 0.9)
        self.head.data.polygons.foreach_set("use_smooth", [True] * len(self.head.data.polygons))
        self.head.modifiers.new("smooth", "SUBSURF").render_levels = 2
        self.material = build.material("paint", paint)
        self.head.data.materials.append(self.material)
        self.image = add_target(self.material)
        prepare(scene, SIZE, SIZE)

    def bake(
        self,
        engine: str,
        bake_type: str,
        samples: int = 16,
        seed: int = 1,
        image: bpy.types.Image | None = None,
        **options: object,
    ) -> NDArray[np.float32]:
        """The pixels of the image, 0 where nothing is baked. Raises RuntimeError with the engine's words."""
        image = image or self.image
        self.scene.render.engine = engine
        settings = self.scene.cycles if engine == "CYCLES" else self.scene.cistern
        settings.samples, settings.seed = samples, seed
        set_pixels(image, 0.0)
        if not options.get("use_selected_to_active"):
            select(self.head)
        bpy.ops.object.bake(type=bake_type, margin=0, use_clear=False, **options)
        return pixels_of(image)


def paint(tree: build.Nodes) -> bpy.types.NodeSocket:
    colors = build.shader(tree, "ShaderNodeTexNoise", Scale=3.0)
    principled = build.shader(tree, "ShaderNodeBsdfPrincipled", Base_Color=colors.outputs["Color"], Roughness=0.35)
    for name, value in {"Metallic": 0.3, "Transmission Weight": 0.2, "Emission Strength": 0.3}.items():
        principled.inputs[name].default_value = value
    principled.inputs["Emission Color"].default_value = (0.2, 0.5, 1.0, 1.0)
    return principled.outputs[0]


def add_target(material: bpy.types.Material, size: int = SIZE) -> bpy.types.Image:
    """The image that the material is baked to."""
    image = bpy.data.images.new("baked", size, size, float_buffer=True, is_data=True)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    return image


def select(active: bpy.types.Object, *others: bpy.types.Object) -> None:
    for obj in bpy.context.scene.objects:
        obj.select_set(obj == active or obj in others)
    bpy.context.view_layer.objects.active = active


def set_pixels(image: bpy.types.Image, value: float) -> None:
    image.pixels.foreach_set(np.full(4 * image.size[0] * image.size[1], value, np.float32))


def pixels_of(image: bpy.types.Image) -> NDArray[np.float32]:
    """(height, width, 4), row 0 at the bottom."""
    pixels = np.empty((image.size[1], image.size[0], 4), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    return pixels
