"""Glass that bends light by its wavelength, from Blender 5.3 on, against Cycles; method as in
test_against_cycles_lights."""

import bpy
import numpy as np
import pytest

from addon import report
from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles, prepare, render
from tests.support.slow_cases import marked

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(bpy.app.version < (5, 3, 0), reason="Blender has dispersion from 5.3 on"),
]

PRISM = {"Transmission_Weight": 1.0, "IOR": 1.7, "Transmission_Dispersion_Abbe_Number": 8.0}
SPLIT = {"Transmission_Dispersion_Scale": 1.0}
CASES = {
    "clear": {"Roughness": 0.0},
    "rough": {"Roughness": 0.3},
    "half": {"Roughness": 0.2, "Transmission_Dispersion_Scale": 0.5},
    "tinted": {"Roughness": 0.15, "Base_Color": (0.9, 0.3, 0.1, 1.0)},
    "half glass": {"Roughness": 0.2, "Transmission_Weight": 0.5, "Base_Color": (0.1, 0.3, 0.9, 1.0)},
    "film": {"Roughness": 0.1, "Thin_Film_Thickness": 400.0},
    "emission": {"Roughness": 0.1, "Emission_Strength": 0.5},
}


def glass(**inputs: object) -> bpy.types.Material:
    return build.principled("prism", **(PRISM | SPLIT | inputs))


@pytest.mark.parametrize("case", marked(CASES, {"half", "film", "emission", "half glass"}))
def test_ball(empty_scene: bpy.types.Scene, case: str) -> None:
    build.stage(empty_scene, glass(**CASES[case]))
    result = compare_with_cycles(empty_scene, count=12)
    assert result.agrees, result


def add_prism(scene: bpy.types.Scene, **inputs: object) -> bpy.types.Material:
    """A ball of glass before a wall that shines on one side, which shows its edge in colours."""
    surface = glass(Roughness=0.0, **inputs)
    build.add_sphere(scene, surface, radius=1.0, segments=32).location.z = -1.0
    shining = build.material("wall", lambda tree: build.shader(tree, "ShaderNodeEmission", Strength=1.0).outputs[0])
    build.add_mesh(scene, "wall", [(0, 6, -3), (6, 6, -3), (6, 6, 3), (0, 6, 3)], [(0, 1, 2, 3)], shining)
    camera = build.add_camera(scene, (0.0, -3.0, 0.0), (1.5708, 0.0, 0.0))
    camera.data.lens = 60.0
    return surface


def test_prism(empty_scene: bpy.types.Scene) -> None:
    """And another glass is seen."""
    surface = add_prism(empty_scene)
    result = compare_with_cycles(empty_scene, count=12)
    assert result.agrees, result
    node = next(n for n in surface.node_tree.nodes if n.type == "BSDF_PRINCIPLED")

    def plant(_scene: bpy.types.Scene) -> None:
        node.inputs["Transmission Dispersion Abbe Number"].default_value = 20.0

    assert not compare_with_cycles(empty_scene, count=12, plant=plant).agrees


def test_edges_are_coloured_and_faces_are_white(empty_scene: bpy.types.Scene) -> None:
    add_prism(empty_scene)
    prepare(empty_scene, 24, 24)
    colours = render(empty_scene, "CISTERN", 256, 1)[..., :3]
    assert np.ptp(colours, axis=2).max() > 0.2
    face = colours[9:15, 3:9].mean((0, 1))
    assert face.min() > 0.3 and np.ptp(face) < 0.03


@pytest.mark.parametrize("preset", ["FINAL", "INTERACTIVE", "WORLD_PATHS"])
def test_techniques_of_reuse_trace_paths(empty_scene: bpy.types.Scene, preset: str) -> None:
    """The same picture as path tracing, and a warning where it is more than a shorter way there."""
    add_prism(empty_scene)
    prepare(empty_scene, 24, 24)
    plain = render(empty_scene, "CISTERN", 16, 1)
    empty_scene.cistern.preset = preset
    np.testing.assert_array_equal(render(empty_scene, "CISTERN", 16, 1), plain)
    warnings = [text for line in report.last for text in line.warnings]
    assert any("'prism' has dispersion" in text for text in warnings) == (preset != "FINAL")


def test_clamped_light_stays_white(empty_scene: bpy.types.Scene) -> None:
    add_prism(empty_scene)
    prepare(empty_scene, 24, 24)
    empty_scene.cistern.clamp_direct = 0.1
    face = render(empty_scene, "CISTERN", 256, 1)[9:15, 3:9, :3].mean((0, 1))
    assert face.min() > 0.02 and face.max() < 0.1 and np.ptp(face) < 0.01
