"""The live scene of a viewport when what materials read of objects changes. Each edit has to change what is described:
the sync that leaves the old value there fails."""

from collections.abc import Callable

import bpy
import pytest
from small_objects import link

ONE = "Object 1"


def read(node_type: str, output: str, **members: str) -> None:
    """Let the material of an object, and of an instance, show an output of a node."""
    for name in (ONE, "Part"):
        obj = bpy.data.objects[name]
        surface = obj.material_slots[0].material if obj.material_slots else None
        if surface is None:
            surface = bpy.data.materials.new("Read")
            surface.use_nodes = True
            obj.data.materials.append(surface)
        tree = surface.node_tree
        node = tree.nodes.new(node_type)
        for member, value in members.items():
            setattr(node, member, value)
        principled = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
        tree.links.new(node.outputs[output], principled.inputs["Base Color"])


def set_property(owner: Callable[[], bpy.types.ID], value: float) -> None:
    """As the panel does, which tags what it edits."""
    owner()["tint"] = value
    owner().update_tag()


def read_attribute(kind: str, name: str) -> None:
    read("ShaderNodeAttribute", "Color", attribute_type=kind, attribute_name=name)


def occlude_as_the_world() -> None:
    read("ShaderNodeAmbientOcclusion", "Color")
    for surface in bpy.data.materials:
        for node in surface.node_tree.nodes if surface.node_tree else ():
            if node.type == "AMBIENT_OCCLUSION":
                node.inputs["Distance"].default_value = 0.0


def with_camera() -> None:
    bpy.context.scene.camera = link("Camera", bpy.data.cameras.new("Camera"))


def with_parent() -> None:
    bpy.data.objects[ONE].parent = link("Parent", None)


EDITS = {
    "colour": (
        lambda: read("ShaderNodeObjectInfo", "Color"),
        lambda: setattr(bpy.data.objects[ONE], "color", (0.1, 0.2, 0.3, 1.0)),
    ),
    "colour of an instancer": (
        lambda: read("ShaderNodeObjectInfo", "Alpha"),
        lambda: setattr(bpy.data.objects["Empty 3"], "color", (0.1, 0.2, 0.3, 0.4)),
    ),
    "object index": (
        lambda: read("ShaderNodeObjectInfo", "Object Index"),
        lambda: setattr(bpy.data.objects[ONE], "pass_index", 3),
    ),
    "material index": (
        lambda: read("ShaderNodeObjectInfo", "Material Index"),
        lambda: setattr(bpy.data.objects[ONE].material_slots[0].material, "pass_index", 3),
    ),
    "property": (
        lambda: read_attribute("OBJECT", "tint"),
        lambda: set_property(lambda: bpy.data.objects[ONE], 0.5),
    ),
    "property of an instancer": (
        lambda: read_attribute("INSTANCER", "tint"),
        lambda: set_property(lambda: bpy.data.objects["Empty 5"], 0.5),
    ),
    "place": (
        lambda: read_attribute("OBJECT", "location"),
        lambda: setattr(bpy.data.objects[ONE], "location", (7, 8, 9)),
    ),
    "property of a mesh": (
        lambda: read_attribute("OBJECT", "tint"),
        lambda: set_property(lambda: bpy.data.meshes["Shared"], 0.5),
    ),
    "property of a scene": (
        lambda: read_attribute("VIEW_LAYER", "tint"),
        lambda: set_property(lambda: bpy.context.scene, 0.5),
    ),
    "property of a world": (
        lambda: read_attribute("VIEW_LAYER", "tint"),
        lambda: set_property(lambda: bpy.context.scene.world, 0.5),
    ),
    "place of the scene's camera": (
        lambda: (with_camera(), read_attribute("VIEW_LAYER", "camera.location")),
        lambda: setattr(bpy.context.scene.camera, "location", (7, 8, 9)),
    ),
    "colour of a parent": (
        lambda: (with_parent(), read_attribute("OBJECT", "parent.color")),
        lambda: setattr(bpy.data.objects[ONE].parent, "color", (0.1, 0.2, 0.3, 1.0)),
    ),
    "distance of a world's occlusion": (
        occlude_as_the_world,
        lambda: setattr(bpy.context.scene.world.light_settings, "distance", 0.5),
    ),
}


@pytest.mark.parametrize("case", EDITS)
def test_edits_of_what_is_read(watched, case) -> None:
    prepare, edit = EDITS[case]
    watched.after(prepare)
    watched.expect_truth()
    before = watched.live.builder.described()
    assert watched.after(edit).is_anything
    assert watched.live.builder.described() != before
    watched.expect_truth()


def test_what_nobody_reads_exports_nothing(watched) -> None:
    exported = watched.after(lambda: setattr(bpy.data.objects[ONE], "color", (0.1, 0.2, 0.3, 1.0)))
    assert not exported.is_anything
    assert watched.live.builder.value_names == []
