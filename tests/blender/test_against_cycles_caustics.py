"""Caustics that are left out or softened, against Cycles; method as in test_against_cycles_lights.

Each setting is also planted as a bug: Cycles has it and Cistern does not. Clear glass is not softened here: it becomes
rough, and of rough glass Cycles' light samples find more than its scattered rays (addon/README.md)."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support import engines
from tests.support.engines import compare_with_cycles
from tests.support.slow_cases import marked

pytestmark = pytest.mark.usefixtures("registered_addon")

# Cistern's names, and Cycles'.
NAMES = {
    "filter_glossy": "blur_glossy",
    "caustics_reflective": "caustics_reflective",
    "caustics_refractive": "caustics_refractive",
}

METAL = {"Base Color": (0.9, 0.7, 0.4, 1.0), "Metallic": 1.0, "Roughness": 0.25}
PAINT = {"Base Color": (0.6, 0.1, 0.1, 1.0), "Roughness": 0.3, "Coat Weight": 1.0, "Coat Roughness": 0.1}
GLASS = {"Base Color": (0.8, 1.0, 0.9, 1.0), "Roughness": 0.2, "Transmission Weight": 1.0}
LAYERS = PAINT | {"Metallic": 0.4, "Transmission Weight": 0.5, "Emission Color": (0.2, 0.3, 1.0, 1.0)}
LAYERS["Emission Strength"] = 0.3


def glossy(tree: build.Nodes) -> bpy.types.NodeSocket:
    return build.shader(tree, "ShaderNodeBsdfAnisotropic", Color=(0.8, 0.8, 0.5, 1.0), Roughness=0.3).outputs[0]


def glass(tree: build.Nodes) -> bpy.types.NodeSocket:
    return build.shader(tree, "ShaderNodeBsdfGlass", Color=(0.8, 0.9, 1.0, 1.0), Roughness=0.25, IOR=1.3).outputs[0]


def toon(tree: build.Nodes) -> bpy.types.NodeSocket:
    node = build.shader(tree, "ShaderNodeBsdfToon", Size=0.3)
    node.component = "GLOSSY"
    return node.outputs[0]


def surface(what) -> bpy.types.Material:
    return build.principled("ball", **what) if isinstance(what, dict) else build.material("ball", what)


CASES = {
    "no reflections of metal": (METAL, {"caustics_reflective": False}),
    "no reflections of paint": (PAINT, {"caustics_reflective": False}),
    "no reflections of glass": (GLASS, {"caustics_reflective": False}),
    "no reflections, toon": (toon, {"caustics_reflective": False}),
    "no refractions": (glass, {"caustics_refractive": False}),
    "no refractions of layers": (LAYERS, {"caustics_refractive": False}),
    "no caustics of glass": (glass, {"caustics_reflective": False, "caustics_refractive": False}),
    "soft metal": (METAL, {"filter_glossy": 1.0}),
    "soft layers": (LAYERS, {"filter_glossy": 1.0}),
    "hardly soft": (glossy, {"filter_glossy": 0.3}),
    "very soft": (glossy, {"filter_glossy": 10.0}),
    "soft, without reflections": (GLASS, {"filter_glossy": 2.0, "caustics_reflective": False}),
}
PLANTED = ("no reflections of metal", "no refractions", "soft metal", "hardly soft")
PAPERS = ("CELL_RESERVOIRS", "RESTIR_GI", "WORLD_PATHS")
QUICK = {"no refractions of layers", "soft layers"}


@pytest.fixture
def limit(monkeypatch):
    """Gives both engines, or Cycles alone, these values of NAMES."""

    def give(values: dict, ours: bool = True) -> None:
        for name, value in values.items():
            monkeypatch.setitem(engines.CYCLES, NAMES[name], value)
            if ours:
                monkeypatch.setitem(engines.CISTERN, name, value)

    return give


@pytest.mark.parametrize("case", marked(CASES, CASES.keys() - QUICK))
def test_caustics(empty_scene: bpy.types.Scene, limit, case: str) -> None:
    material, values = CASES[case]
    build.stage(empty_scene, surface(material))
    limit(values)
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


@pytest.mark.parametrize("preset", ["FINAL", *(pytest.param(p, marks=pytest.mark.slow) for p in PAPERS)])
def test_beside_reuse(empty_scene: bpy.types.Scene, limit, preset: str) -> None:
    material, values = CASES["soft layers"]
    build.stage(empty_scene, surface(material))
    limit(values)
    result = compare_with_cycles(empty_scene, preset=preset)
    assert result.agrees, result


@pytest.mark.parametrize("case", marked(PLANTED, {"no reflections of metal", "hardly soft"}))
def test_planted_bugs(empty_scene: bpy.types.Scene, limit, case: str) -> None:
    material, values = CASES[case]
    build.stage(empty_scene, surface(material))
    limit(values, ours=False)
    result = compare_with_cycles(empty_scene)
    assert not result.agrees, result
