"""Normals against Cycles: smooth ones of stretched and sheared objects, which it transforms before it interpolates them
where a mesh has a single user, and those beside flat faces and sharp edges.

They are shown as light, so that there is no noise but that of edges."""

import bpy
import numpy as np
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")


def shown_normals() -> bpy.types.Material:
    def make(tree: build.Nodes) -> bpy.types.NodeSocket:
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation = "MULTIPLY_ADD"
        node.inputs[1].default_value = node.inputs[2].default_value = (0.5, 0.5, 0.5)
        tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"], node.inputs[0])
        return build.shader(tree, "ShaderNodeEmission", Color=node.outputs[0]).outputs[0]

    return build.material("normals", make)


def cube(scene: bpy.types.Scene) -> bpy.types.Object:
    """Smooth, of 8 points, stretched."""
    bpy.ops.mesh.primitive_cube_add(size=1.6)
    result = bpy.context.object
    result.data.polygons.foreach_set("use_smooth", [True] * 6)
    result.rotation_euler, result.scale = (0.3, 0.4, 0.2), (1.0, 0.6, 0.25)
    result.data.materials.append(shown_normals())
    build.add_camera(scene, (0.4, -4.0, 2.5), (1.0, 0.0, 0.0)).data.lens = 60.0
    return result


def sheared(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    parent = bpy.data.objects.new("parent", None)
    scene.collection.objects.link(parent)
    parent.rotation_euler, parent.scale = (0.5, 0.2, 0.6), (1.3, 0.7, -1.1)
    obj.parent = parent


def sharp(_scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """Normals at corners."""
    for edge in obj.data.edges[:4]:
        edge.use_edge_sharp = True


def half_flat(_scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """No face is plane, so that flat ones show their triangles."""
    for number, vertex in enumerate(obj.data.vertices):
        vertex.co *= 1.0 + 0.05 * (number % 3)
    obj.data.polygons.foreach_set("use_smooth", [number % 2 != 0 for number in range(len(obj.data.polygons))])


def half_flat_and_sharp(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    half_flat(scene, obj)
    sharp(scene, obj)


def half_flat_of_its_own(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """Custom normals, which flat faces have, too."""
    half_flat(scene, obj)
    normals = np.random.default_rng(1).normal(size=(len(obj.data.loops), 3))
    obj.data.normals_split_custom_set(normals.tolist())


def of_faces(_scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """As geometry nodes give them to faces, from Blender 5.0 on."""
    half_flat(_scene, obj)
    normals = np.array([polygon.normal for polygon in obj.data.polygons], np.float32) + np.float32([0.5, 0.0, 0.5])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    obj.data.attributes.new("custom_normal", "FLOAT_VECTOR", "FACE").data.foreach_set("vector", normals.ravel())
    obj.data.update()


def shared(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    other = obj.copy()
    other.location.z = 50.0
    scene.collection.objects.link(other)


def scattering(_scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """Subsurface scattering that weighs nothing."""
    tree = obj.data.materials[0].node_tree
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 1e-6
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    tree.links.new(output.inputs["Surface"].links[0].from_socket, mix.inputs[1])
    tree.links.new(tree.nodes.new("ShaderNodeSubsurfaceScattering").outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])


def plain(_scene: bpy.types.Scene, _obj: bpy.types.Object) -> None:
    pass


def sheared_and_shared(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    sheared(scene, obj)
    shared(scene, obj)


def sheared_and_scattering(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    sheared(scene, obj)
    scattering(scene, obj)


FLAT = [half_flat, half_flat_and_sharp, half_flat_of_its_own, of_faces]
CASES = [plain, sheared, sharp, sheared_and_shared, sheared_and_scattering, *FLAT]


def agrees(scene: bpy.types.Scene) -> bool:
    return compare_with_cycles(scene, (32, 32), 32, count=4, blocks=8).agrees


@pytest.mark.parametrize("change", CASES)
def test_shading_normals(empty_scene: bpy.types.Scene, change) -> None:
    if change is of_faces and bpy.app.version < (5, 0, 0):
        pytest.skip("Blender has no such normals before")
    change(empty_scene, cube(empty_scene))
    assert agrees(empty_scene)


def test_smooth_faces_that_do_not_know_flat_ones_are_seen(empty_scene: bpy.types.Scene) -> None:
    """Planted: for Cycles the edges between them are sharp, as they are in Blender's own viewport."""
    obj = cube(empty_scene)
    half_flat(empty_scene, obj)

    def plant(_: bpy.types.Scene) -> None:
        for edge in list(obj.data.edges)[1:]:
            edge.use_edge_sharp = True

    assert not compare_with_cycles(empty_scene, (32, 32), 32, count=4, blocks=8, plant=plant).agrees


def test_a_second_user_is_seen(empty_scene: bpy.types.Scene) -> None:
    """Planted: for Cycles the mesh has another."""
    obj = cube(empty_scene)
    sheared(empty_scene, obj)

    def plant(scene: bpy.types.Scene) -> None:
        shared(scene, obj)

    assert not compare_with_cycles(empty_scene, (32, 32), 32, count=4, blocks=8, plant=plant).agrees
