"""Generated coordinates against Cycles, of what modifiers, shape keys and texture spaces make of them.

They are shown as light, so that there is no noise but that of edges."""

import bpy
import pytest

from addon.sync import meshes
from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")


def glowing() -> bpy.types.Material:
    """Thin fog, whose light is even along each ray but for its colour."""

    def make(tree):
        coordinates = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
        return build.shader(tree, "ShaderNodeEmission", Color=coordinates, Strength=0.5).outputs[0]

    return build.material("inside", make, "Volume")


def shining() -> bpy.types.Material:
    def make(tree):
        coordinates = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
        return build.shader(tree, "ShaderNodeEmission", Color=coordinates).outputs[0]

    return build.material("generated", make)


def head() -> bpy.types.Object:
    bpy.ops.mesh.primitive_monkey_add(size=2.0)
    return bpy.context.object


def shape_key() -> bpy.types.Object:
    obj = head()
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Key")
    key.value = 1.0
    for point in key.data:
        point.co.x *= 1.5 if point.co.z > 0.0 else 0.6
    return obj


def modified(kind: str, **members: object):
    def make() -> bpy.types.Object:
        obj = head()
        modifier = obj.modifiers.new("modifier", kind)
        for name, value in members.items():
            setattr(modifier, name, value)
        return obj

    return make


def own_space() -> bpy.types.Object:
    obj = head()
    obj.data.use_auto_texspace = False
    obj.data.texspace_location, obj.data.texspace_size = (0.5, 0.0, 0.0), (2.0, 1.0, 1.5)
    return obj


def text() -> bpy.types.Object:
    bpy.ops.object.text_add()
    bpy.context.object.data.extrude = 0.2
    return bpy.context.object


def curve() -> bpy.types.Object:
    bpy.ops.curve.primitive_bezier_curve_add()
    bpy.context.object.data.bevel_depth = 0.3
    return bpy.context.object


TWIST = modified("SIMPLE_DEFORM", deform_method="TWIST", angle=2.0, deform_axis="Z")
ARRAY = modified("ARRAY", count=2, relative_offset_displace=(0.5, 0.0, 0.0))
MAKERS = {
    "head": head,
    "shape key": shape_key,
    "twist": TWIST,
    "array": ARRAY,
    "subdivided": modified("SUBSURF", render_levels=2),
    "own space": own_space,
    "text": text,
    "curve": curve,
}


@pytest.fixture
def shown(empty_scene):
    """Makes an object and shows it, seen from the front and above."""

    def show(make, shade=shining) -> bpy.types.Scene:
        obj = make()
        obj.data.materials.append(shade())
        camera = build.add_camera(empty_scene, (0.4, -4.0, 2.5), (1.0, 0.0, 0.0))
        camera.data.type, camera.data.ortho_scale = "ORTHO", 4.0
        return empty_scene

    return show


def agrees(scene: bpy.types.Scene) -> bool:
    return compare_with_cycles(scene, (32, 32), 32, count=4, blocks=8).agrees


@pytest.mark.parametrize("name", MAKERS)
def test_coordinates_are_those_of_cycles(shown, name):
    assert agrees(shown(MAKERS[name]))


@pytest.mark.parametrize("make", [shape_key, TWIST, ARRAY, own_space, text], ids=lambda make: make.__name__)
def test_bounds_in_their_place_are_seen(shown, monkeypatch, make):
    monkeypatch.setattr(meshes, "generated_coordinates", lambda mesh: None)
    assert not agrees(shown(make))


@pytest.mark.parametrize("name", [name for name in MAKERS if name != "head"])
def test_coordinates_in_volumes_are_those_of_cycles(shown, name):
    scene = shown(MAKERS[name], glowing)
    build.set_world(scene, strength=0.0)
    assert agrees(scene)


@pytest.mark.parametrize("make", [shape_key, ARRAY, own_space], ids=lambda make: make.__name__)
def test_bounds_in_their_place_are_seen_in_volumes(shown, monkeypatch, make):
    monkeypatch.setattr(meshes, "texture_space", lambda mesh: None)
    scene = shown(make, glowing)
    build.set_world(scene, strength=0.0)
    assert not agrees(scene)


def shown_tangents(scene: bpy.types.Scene) -> bpy.types.Scene:
    tree = bpy.data.materials["generated"].node_tree
    tangent = tree.nodes.new("ShaderNodeNewGeometry").outputs["Tangent"]
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    tree.links.new(build.shader(tree, "ShaderNodeVectorMath", Vector=tangent).outputs[0], emission.inputs["Color"])
    tree.nodes.remove(next(n for n in tree.nodes if n.type == "TEX_COORD"))
    next(n for n in tree.nodes if n.type == "VECT_MATH").operation = "ABSOLUTE"
    return scene


TANGENTS = pytest.mark.parametrize("make", [ARRAY, own_space], ids=lambda make: make.__name__)


@TANGENTS
def test_tangents_of_geometry_go_by_them(shown, make):
    assert agrees(shown_tangents(shown(make)))


@TANGENTS
def test_tangents_by_bounds_are_seen(shown, monkeypatch, make):
    monkeypatch.setattr(meshes, "generated_coordinates", lambda mesh: None)
    assert not agrees(shown_tangents(shown(make)))
