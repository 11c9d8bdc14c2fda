"""Shaders of hair against Cycles; method as in test_against_cycles_lights."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support import engines
from tests.support.engines import compare_with_cycles
from tests.support.hair_scenes import CAN_MAKE_CURVES, add_fur
from tests.support.slow_cases import marked

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(not CAN_MAKE_CURVES, reason="scripts cannot make hair curves"),
]

BLOND = (0.6, 0.4, 0.2, 1.0)
HAIR = {
    "default": {},
    "colour": {"Color": BLOND},
    "rough": {"Color": BLOND, "Roughness": 0.8, "Radial Roughness": 0.9},
    "coat": {"Color": BLOND, "Coat": 0.6},
    "tilt": {"Color": BLOND, "Offset": 0.08},
    "index": {"Color": BLOND, "IOR": 1.2},
    "melanin": {"parametrization": "MELANIN", "Melanin": 0.4, "Melanin Redness": 0.3, "Tint": (0.9, 0.7, 0.8, 1.0)},
    "random melanin": {"parametrization": "MELANIN", "Melanin": 0.4, "Random Color": 0.8},
    "random roughness": {"Color": BLOND, "Random Roughness": 0.9},
    "absorption": {"parametrization": "ABSORPTION", "Absorption Coefficient": (0.2, 0.4, 0.9)},
}


def principled_hair(**inputs: object) -> bpy.types.Material:
    def make(tree):
        node = tree.nodes.new("ShaderNodeBsdfHairPrincipled")
        for name, value in inputs.items():
            if hasattr(node, name):
                setattr(node, name, value)
            else:
                next(s for s in node.inputs if s.identifier == name).default_value = value
        return node.outputs[0]

    return build.material("hair", make)


SIMPLE_HAIR = {
    "reflection": {"Color": BLOND},
    "tilted reflection": {"Color": BLOND, "Offset": -0.3},
    "narrow reflection": {"Color": BLOND, "RoughnessU": 0.3, "RoughnessV": 0.3},
    "transmission": {"Color": BLOND, "component": "Transmission"},
    "narrow transmission": {"Color": BLOND, "component": "Transmission", "RoughnessU": 0.2, "RoughnessV": 0.1},
}


def simple_hair(**inputs: object) -> bpy.types.Material:
    def make(tree):
        node = tree.nodes.new("ShaderNodeBsdfHair")
        node.component = inputs.pop("component", "Reflection")
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        return node.outputs[0]

    return build.material("hair", make)


def stage(scene: bpy.types.Scene) -> None:
    """As in test_against_cycles_hair, on black: rounded ribbons, of which Cycles knows where across they are seen."""
    sphere = build.stage(scene, build.principled("skin", Base_Color=(0.0, 0.0, 0.0, 1), Specular_IOR_Level=0.0))
    sphere.scale, sphere.location = (0.7, 0.7, 0.7), (0.0, 0.0, 0.21)
    scene.cycles_curves.shape = "RIBBONS"


FACETS = {
    "facets": {},
    "facets, round": {"Aspect Ratio": 1.0, "Offset": 0.0},
    "facets, flat": {"Aspect Ratio": 0.3},
    "facets, rough": {"Roughness": 0.8, "Random Roughness": 0.5},
    "facets, tilt": {"Offset": 0.15},
    "facets, index": {"IOR": 1.2},
    "facets, melanin": {"parametrization": "MELANIN", "Melanin": 0.4, "Melanin Redness": 0.3, "Random Color": 0.8},
    "facets, factors": {"R lobe": 0.3, "TT lobe": 0.6},
}
SLOW_FACETS = {"facets, rough", "facets, index", "facets, melanin", "facets, factors"}


SLOW = {"tilt", "random melanin", "rough", "index", "random roughness", "melanin", "absorption"}


@pytest.mark.parametrize("case", marked(HAIR, SLOW))
def test_principled_hair(empty_scene: bpy.types.Scene, case: str) -> None:
    stage(empty_scene)
    add_fur(empty_scene, principled_hair(**HAIR[case]))
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def light_by_points(scene: bpy.types.Scene) -> None:
    """Of no size, alone: scattered rays find nothing."""
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    for lamp in [o for o in scene.objects if o.type == "LIGHT"]:
        if lamp.data.type == "AREA":
            bpy.data.objects.remove(lamp)
        else:
            lamp.data.shadow_soft_size = 0.0


def light_by_half_a_world(scene: bpy.types.Scene) -> None:
    """That scattered rays alone find: Cycles' light samples find up to 1 % less of these strands, less in places."""
    for obj in [obj for obj in scene.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(obj)
    tree = build.set_world(scene, (1.0, 1.0, 1.0)).node_tree
    generated = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    side = build.shader(tree, "ShaderNodeSeparateXYZ", Vector=generated)
    half = build.shader(tree, "ShaderNodeMath", Value=side.outputs["X"])
    half.operation = "GREATER_THAN"
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    tree.links.new(half.outputs[0], background.inputs["Strength"])
    scene.world.cycles.sampling_method = "NONE"


@pytest.mark.parametrize("case", marked(FACETS, SLOW_FACETS))
def test_microfacet_hair(empty_scene: bpy.types.Scene, case: str) -> None:
    stage(empty_scene)
    light_by_half_a_world(empty_scene)
    add_fur(empty_scene, principled_hair(model="HUANG", **{"Color": BLOND} | FACETS[case]))
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


@pytest.mark.parametrize("aspect_ratio", marked([1.0, 0.3], {1.0}))
def test_microfacet_hair_on_a_mesh(empty_scene: bpy.types.Scene, aspect_ratio: float) -> None:
    """There light enters a strand anywhere across, and its section turns with the view."""
    hair = principled_hair(model="HUANG", **{"Color": BLOND, "Aspect Ratio": aspect_ratio})
    build.stage(empty_scene, hair)
    light_by_half_a_world(empty_scene)
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def test_another_cross_section_is_seen(empty_scene: bpy.types.Scene) -> None:
    """Planted: round strands in the picture of Cycles."""
    stage(empty_scene)
    light_by_half_a_world(empty_scene)
    fur = add_fur(empty_scene, principled_hair(model="HUANG", **{"Color": BLOND, "Aspect Ratio": 0.3}))

    def plant(_scene: bpy.types.Scene) -> None:
        node = next(n for n in fur.data.materials[0].node_tree.nodes if n.type == "BSDF_HAIR_PRINCIPLED")
        node.inputs["Aspect Ratio"].default_value = 1.0

    result = compare_with_cycles(empty_scene, plant=plant)
    assert not result.agrees, result


@pytest.mark.parametrize("case", SIMPLE_HAIR)
def test_simple_hair(empty_scene: bpy.types.Scene, case: str) -> None:
    """As its light samples find it."""
    stage(empty_scene)
    light_by_points(empty_scene)
    add_fur(empty_scene, simple_hair(**SIMPLE_HAIR[case]))
    result = compare_with_cycles(empty_scene, bounces=0)
    assert result.agrees, result


def test_another_tilt_of_simple_hair_is_seen(empty_scene: bpy.types.Scene) -> None:
    """Planted: in the picture of Cycles."""
    stage(empty_scene)
    light_by_points(empty_scene)
    fur = add_fur(empty_scene, simple_hair(Color=BLOND))

    def plant(_scene: bpy.types.Scene) -> None:
        node = next(n for n in fur.data.materials[0].node_tree.nodes if n.type == "BSDF_HAIR")
        node.inputs["Offset"].default_value = 0.1

    result = compare_with_cycles(empty_scene, bounces=0, plant=plant)
    assert not result.agrees, result


# The least ratio of pictures and the largest difference of blocks, a little beyond what was measured.
BOUNDS = {
    "reflection": (0.97, 0.1),
    "tilted reflection": (0.96, 0.14),
    "narrow reflection": (0.993, 0.04),
    "transmission": (0.99, 0.03),
    "narrow transmission": (0.997, 0.01),
}


@pytest.mark.parametrize("case", SIMPLE_HAIR)
def test_simple_hair_within_bounds(empty_scene: bpy.types.Scene, case: str) -> None:
    """Its scattered rays take directions, too, that light samples do not know."""
    stage(empty_scene)
    add_fur(empty_scene, simple_hair(**SIMPLE_HAIR[case]))
    result = compare_with_cycles(empty_scene)
    least, largest = BOUNDS[case]
    assert least < result.ratio < 1.002 and result.largest_difference < largest, result


@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_simple_hair_on_a_mesh(empty_scene: bpy.types.Scene, offset: float) -> None:
    """Along its tangent; offset does not show where that is not linked."""

    def make(tree):
        tangent = build.shader(tree, "ShaderNodeTangent")
        inputs = {"Tangent": tangent.outputs[0], "Offset": offset} if offset else {"Offset": 0.5}
        inputs |= {"RoughnessU": 0.3, "RoughnessV": 0.3}
        return build.shader(tree, "ShaderNodeBsdfHair", Color=BLOND, **inputs).outputs[0]

    build.stage(empty_scene, build.material("ball", make))
    light_by_points(empty_scene)
    result = compare_with_cycles(empty_scene, bounces=0, floor=0.005)  # tangents are those of triangles here
    assert result.agrees, result


@pytest.mark.slow
@pytest.mark.parametrize("filter_glossy", [10.0, 0.0])
def test_softened_hair(empty_scene: bpy.types.Scene, monkeypatch, filter_glossy: float) -> None:
    """After the first bounce; planted: only in Cycles."""
    stage(empty_scene)
    add_fur(empty_scene, principled_hair(Color=BLOND, Roughness=0.1))
    monkeypatch.setitem(engines.CYCLES, "blur_glossy", 10.0)
    monkeypatch.setitem(engines.CISTERN, "filter_glossy", filter_glossy)
    result = compare_with_cycles(empty_scene, count=16)
    assert result.agrees == (filter_glossy > 0.0), result


@pytest.mark.parametrize("preset", marked(("FINAL", "RESTIR_DI"), {"RESTIR_DI"}))
def test_beside_reuse(empty_scene: bpy.types.Scene, preset: str) -> None:
    stage(empty_scene)
    add_fur(empty_scene, principled_hair(Color=BLOND))
    result = compare_with_cycles(empty_scene, preset=preset)
    assert result.agrees, result


def test_other_hair_is_seen(empty_scene: bpy.types.Scene) -> None:
    stage(empty_scene)
    hair = add_fur(empty_scene, principled_hair(Color=BLOND))

    def plant(_scene: bpy.types.Scene) -> None:
        node = next(n for n in hair.data.materials[0].node_tree.nodes if n.type == "BSDF_HAIR_PRINCIPLED")
        node.inputs["Color"].default_value = (0.1, 0.4, 0.2, 1.0)

    result = compare_with_cycles(empty_scene, plant=plant)
    assert not result.agrees, result
