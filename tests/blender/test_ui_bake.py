"""The panels of baking, and baking from multiresolution, which Blender does by itself."""

import bpy
import numpy as np
import pytest

from addon import ui_bake
from tests.blender.drawn_panels import draw, editor
from tests.blender.engine_fakes import fresh_scene

pytestmark = pytest.mark.usefixtures("registered_addon")


def choose_multires(scene, kind=None):
    owner = scene.render.bake if ui_bake.HAS_OWN_MULTIRES else scene.render
    setattr(owner, "use_multires" if ui_bake.HAS_OWN_MULTIRES else "use_bake_multires", True)
    if kind is not None:
        setattr(owner, "type" if ui_bake.HAS_OWN_MULTIRES else "bake_type", kind)


def shown(scene):
    """The panels that are, and what each draws."""
    panels = [cls for cls in ui_bake.CLASSES if cls.poll(editor(300, scene=scene))]
    return {cls.__name__.removeprefix("CISTERN_RENDER_PT_"): draw(cls, scene=scene) for cls in panels}


def test_baking_by_the_engine():
    scene = fresh_scene()
    assert "object.bake" in shown(scene)["bake"] and "object.bake_image" not in shown(scene)["bake"]
    assert {"bake_influence", "bake_selected", "bake_output"} <= set(shown(scene))


@pytest.mark.parametrize("kind", ["NORMALS", "DISPLACEMENT"])
def test_baking_from_multiresolution(kind):
    scene = fresh_scene()
    choose_multires(scene, kind)
    panels = shown(scene)
    assert set(panels) == {"bake", "bake_output"}
    assert panels["bake"][0] == "object.bake_image"
    assert any("lores_mesh" in name for name in panels["bake_output"]) == (kind == "DISPLACEMENT")


MARGINS = [("NORMAL", "TANGENT", False), ("NORMAL", "OBJECT", True), ("UV", "TANGENT", False), ("AO", "TANGENT", True)]


@pytest.mark.parametrize(("kind", "space", "has_choice"), MARGINS)
def test_margins_that_blender_makes_in_its_own_way(kind, space, has_choice):
    scene = fresh_scene()
    scene.cistern.bake_type, scene.render.bake.normal_space = kind, space
    assert ("margin_type" in shown(scene)["bake_output"]) == has_choice


def test_multiresolution_is_baked_with_our_engine_chosen():
    scene = fresh_scene()
    obj = scene.objects["Cube"]
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    if not obj.data.uv_layers:
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.smart_project()
        bpy.ops.object.mode_set(mode="OBJECT")
    modifier = obj.modifiers.new("multires", "MULTIRES")
    for _ in range(2):
        bpy.ops.object.multires_subdivide(modifier=modifier.name, mode="CATMULL_CLARK")
    modifier.levels = 0
    image = bpy.data.images.new("baked", 32, 32, float_buffer=True)
    material = bpy.data.materials.new("baked")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    obj.data.materials.clear()
    obj.data.materials.append(material)
    choose_multires(scene, "NORMALS")
    assert bpy.ops.object.bake_image() == {"FINISHED"}
    pixels = np.array(image.pixels).reshape(32, 32, 4)[..., :3]
    assert pixels.std() > 0.01 and pixels[..., 2].mean() > 0.3
