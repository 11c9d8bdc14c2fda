"""Thin films on Principled, Glass and Metallic against Cycles; method as in test_against_cycles_lights."""

import bpy
import pytest

from addon.sync import versions
from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles
from tests.support.slow_cases import marked

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(not versions.films_cover_metal(), reason="Cycles before 5.0 has another model of thin films"),
]

GOLD = (0.9, 0.6, 0.2, 1.0)
BLACK = (0.0, 0.0, 0.0, 1.0)


def film(thickness: object, ior: float = 1.33, **inputs: object) -> dict:
    return {"Thin_Film_Thickness": thickness, "Thin_Film_IOR": ior, "Roughness": 0.3, "Base_Color": BLACK} | inputs


GLASS = {"Transmission_Weight": 1.0, "Base_Color": (1.0, 1.0, 1.0, 1.0)}
METAL = {"Metallic": 1.0, "Base_Color": GOLD}

PRINCIPLED = {
    "none": film(0.0),
    "fading": film(0.5, 2.0),
    "thin": film(20.0, 2.0),
    "300 nm": film(300.0, 1.8),
    "550 nm, rough": film(550.0, 2.0, Roughness=0.8),
    "1000 nm, smooth": film(1000.0, 1.6, Roughness=0.0),
    "over a base": film(400.0, 1.8, Base_Color=(0.8, 0.2, 0.1, 1.0)),
    "over what does not reflect": film(250.0, 1.7, Specular_IOR_Level=0.0),
    "level and tint": film(350.0, 1.9, Specular_IOR_Level=0.8, Specular_Tint=(0.4, 0.8, 1.0, 1.0)),
    "anisotropic": film(450.0, 2.2, Anisotropic=0.7),
    "under a coat": film(400.0, 1.8, Coat_Weight=0.7),
    "soap": film(400.0, 1.33, IOR=1.0, **GLASS | {"Roughness": 0.0}),
    "glass": film(300.0, 2.0, **GLASS | {"Roughness": 0.0}),
    "rough glass": film(600.0, 1.8, **GLASS | {"Roughness": 0.4}),
    "metal": film(300.0, 1.4, **METAL),
    "rough metal": film(700.0, 1.9, **METAL | {"Roughness": 0.7}),
    "tinted metal": film(450.0, 2.0, **METAL, Specular_Tint=(0.2, 0.4, 1.0, 1.0)),
    "half metal, half glass": film(350.0, 1.8, Metallic=0.5, Transmission_Weight=0.5, Roughness=0.4),
}


SLOW = {
    "soap",
    "550 nm, rough",
    "rough metal",
    "rough glass",
    "half metal, half glass",
    "under a coat",
    "tinted metal",
    "level and tint",
    "fading",
    "thin",
    "none",
    "1000 nm, smooth",
}


@pytest.mark.parametrize("case", marked(PRINCIPLED, SLOW))
def test_principled(empty_scene: bpy.types.Scene, case: str) -> None:
    build.stage(empty_scene, build.principled("ball", **PRINCIPLED[case]))
    # With six replicas the seeds of soap are a false alarm; 24 replicas agree.
    result = compare_with_cycles(empty_scene, count=24 if case == "soap" else 6)
    assert result.agrees, result


def test_textured_thickness(empty_scene: bpy.types.Scene) -> None:
    def surface(tree: build.Nodes) -> bpy.types.NodeSocket:
        noise = build.shader(tree, "ShaderNodeTexNoise", Scale=3.0)
        thickness = tree.nodes.new("ShaderNodeMath")
        thickness.operation = "MULTIPLY"
        tree.links.new(noise.outputs["Fac" if "Fac" in noise.outputs else 0], thickness.inputs[0])
        thickness.inputs[1].default_value = 1000.0
        return build.shader(tree, "ShaderNodeBsdfPrincipled", **film(thickness.outputs[0], 1.8, **METAL)).outputs[0]

    build.stage(empty_scene, build.material("ball", surface))
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


NODES = {
    "glass": ("ShaderNodeBsdfGlass", {"Roughness": 0.2, "IOR": 1.45}, {}),
    "metallic": ("ShaderNodeBsdfMetallic", {"Roughness": 0.3, "Base_Color": GOLD}, {"fresnel_type": "F82"}),
    "conductor": ("ShaderNodeBsdfMetallic", {"Roughness": 0.3}, {"fresnel_type": "PHYSICAL_CONDUCTOR"}),
}


@pytest.mark.parametrize("case", NODES)
def test_node(empty_scene: bpy.types.Scene, case: str) -> None:
    kind, inputs, settings = NODES[case]

    def surface(tree: build.Nodes) -> bpy.types.NodeSocket:
        node = build.shader(tree, kind, Thin_Film_Thickness=420.0, Thin_Film_IOR=1.8, **inputs)
        for name, value in settings.items():
            setattr(node, name, value)
        return node.outputs[0]

    build.stage(empty_scene, build.material("ball", surface))
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


@pytest.mark.parametrize("name, value", [("Thin Film Thickness", 330.0), ("Thin Film IOR", 1.9)])
def test_planted_bugs(empty_scene: bpy.types.Scene, name: str, value: float) -> None:
    """A film a tenth thicker, or of another index."""
    surface = build.principled("ball", **film(300.0, 1.8, **METAL))
    build.stage(empty_scene, surface)

    def plant(scene: bpy.types.Scene) -> None:
        node = next(n for n in surface.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        node.inputs[name].default_value = value

    result = compare_with_cycles(empty_scene, plant=plant)
    assert not result.agrees, result
