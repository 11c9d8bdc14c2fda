"""Toon shaders against Cycles; method as in test_against_cycles_lights."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles
from tests.support.slow_cases import marked

pytestmark = pytest.mark.usefixtures("registered_addon")

RED = (0.8, 0.2, 0.1, 1.0)


def toon(component: str, size: float, smooth: float = 0.0) -> bpy.types.Material:
    def surface(tree: build.Nodes) -> bpy.types.NodeSocket:
        node = build.shader(tree, "ShaderNodeBsdfToon", Color=RED, Size=size, Smooth=smooth)
        node.component = component
        return node.outputs[0]

    return build.material("ball", surface)


CASES = {
    "diffuse": ("DIFFUSE", 0.5),
    "diffuse, whole": ("DIFFUSE", 1.0),
    "diffuse, faded": ("DIFFUSE", 0.4, 0.3),
    "diffuse, faded beyond the horizon": ("DIFFUSE", 0.8, 0.9),
    "glossy": ("GLOSSY", 0.3),
    "glossy, wide": ("GLOSSY", 0.9),
    "glossy, faded": ("GLOSSY", 0.2, 0.3),
    "glossy, narrow": ("GLOSSY", 0.05),
}


@pytest.mark.parametrize("case", marked(CASES, {"diffuse, faded", "diffuse, whole", "glossy, wide"}))
def test_toon(empty_scene: bpy.types.Scene, case: str) -> None:
    build.stage(empty_scene, toon(*CASES[case]))
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


BESIDE_REUSE = [
    pytest.param(component, preset, marks=() if preset in quick else pytest.mark.slow)
    for component, quick in (("DIFFUSE", ("FINAL",)), ("GLOSSY", ("RESTIR_GI",)))
    for preset in ("FINAL", "RESTIR_DI", "RESTIR_GI", "WORLD_PATHS")
]


@pytest.mark.parametrize(("component", "preset"), BESIDE_REUSE)
def test_beside_reuse(empty_scene: bpy.types.Scene, component: str, preset: str) -> None:
    build.stage(empty_scene, toon(component, 0.5, 0.2))
    result = compare_with_cycles(empty_scene, preset=preset)
    assert result.agrees, result


@pytest.mark.parametrize("name, value", [("Size", 0.55), ("Smooth", 0.3)])
@pytest.mark.parametrize("component", ["DIFFUSE", "GLOSSY"])
def test_planted_bugs(empty_scene: bpy.types.Scene, component: str, name: str, value: float) -> None:
    """A cone a tenth larger, or one that fades out more."""
    surface = toon(component, 0.5, 0.2)
    build.stage(empty_scene, surface)

    def plant(_scene: bpy.types.Scene) -> None:
        node = next(n for n in surface.node_tree.nodes if n.type == "BSDF_TOON")
        node.inputs[name].default_value = value

    result = compare_with_cycles(empty_scene, plant=plant)
    assert not result.agrees, result
