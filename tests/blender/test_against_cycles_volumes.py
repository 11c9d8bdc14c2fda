"""Participating media against Cycles in the same process.

Means of 4x4 blocks and 4 channels over 6 replicas of each engine, Welch's t-test, false-alarm rate 1 % per case (Šidák
over the 64 values). `test_planted_bugs` shows what the comparison sees.
"""

import math
from collections.abc import Callable

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles, prepare, replicas
from tests.support.slow_cases import marked
from tests.support.statistics import compare_replicas

pytestmark = pytest.mark.usefixtures("registered_addon")

SIZE, SAMPLES = (32, 32), 64
CUBE = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
SCATTER, ABSORPTION = "ShaderNodeVolumeScatter", "ShaderNodeVolumeAbsorption"
PRINCIPLED, EMISSION = "ShaderNodeVolumePrincipled", "ShaderNodeEmission"

Shader = Callable[[bpy.types.ShaderNodeTree], bpy.types.Node]


def of(kind: str, **inputs: object) -> Shader:
    return lambda tree: build.shader(tree, kind, **inputs)


def medium(name: str, volume: Shader, surface: Shader | None = None) -> bpy.types.Material:
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    tree = result.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(volume(tree).outputs[0], output.inputs["Volume"])
    if surface:
        tree.links.new(surface(tree).outputs[0], output.inputs["Surface"])
    return result


def add_cube(
    scene: bpy.types.Scene, inside: bpy.types.Material, size: float = 0.8, place: tuple = (0.0, 0.0, 1.0)
) -> bpy.types.Object:
    cube = build.add_mesh(scene, inside.name, [tuple(size * c for c in p) for p in CUBE], SIDES, inside)
    cube.location = place
    return cube


def fill_world(scene: bpy.types.Scene, volume: Shader, strength: float = 0.0) -> None:
    tree = build.set_world(scene, strength=strength).node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(volume(tree).outputs[0], output.inputs["Volume"])


def stage(scene: bpy.types.Scene, **camera: object) -> None:
    build.add_floor(scene)
    build.add_camera(scene, **camera)


def lamp(scene: bpy.types.Scene, kind: str = "POINT", place: tuple = (1.0, -1.0, 2.5), **members: object) -> None:
    """Found by light samples alone: scattered rays of Cycles that go on behind a lamp in a volume lose light, a ball of
    0.3 m in fog by 15 %. With and without them ours agree, see tests/render/test_volumes.py."""
    light = build.add_light(scene, kind, place, **({"energy": 100.0, "shadow_soft_size": 0.1} | members))
    light.data.cycles.use_multiple_importance_sampling = False


def spot_in_fog(scene: bpy.types.Scene) -> None:
    stage(scene)
    fill_world(scene, of(SCATTER, Color=(0.9, 0.7, 0.5, 1), Density=0.15))
    lamp(scene, "SPOT", (0.3, 0.0, 2.2), energy=300.0, spot_size=0.9, spot_blend=0.3)


def lamp_in_cube(scene: bpy.types.Scene) -> None:
    stage(scene)
    add_cube(scene, medium("fog", of(SCATTER, Color=(0.8, 0.6, 0.9, 1), Density=1.5)))
    lamp(scene, place=(0.2, -0.1, 1.2), energy=60.0)


def absorbing_glass(scene: bpy.types.Scene) -> None:
    stage(scene)
    build.set_world(scene, strength=1.0)
    glass = of("ShaderNodeBsdfGlass", IOR=1.3, Roughness=0.3)
    build.add_sphere(scene, medium("ink", of(ABSORPTION, Color=(0.9, 0.5, 0.2, 1), Density=2.0), glass))


def glowing(scene: bpy.types.Scene) -> None:
    stage(scene)
    add_cube(scene, medium("fire", of(EMISSION, Color=(1, 0.5, 0.2, 1), Strength=0.8)))


def sun_in_cube(scene: bpy.types.Scene, anisotropy: float = 0.0) -> None:
    stage(scene)
    add_cube(scene, medium("mist", of(SCATTER, Density=1.0, Anisotropy=anisotropy)))
    build.add_light(scene, "SUN", rotation=(0.9, 0.3, 0.0), energy=3.0, angle=0.1)


def sky_in_cube(scene: bpy.types.Scene) -> None:
    stage(scene)
    build.set_world(scene, strength=1.0)
    add_cube(scene, medium("cloud", of(SCATTER, Color=(1, 0.9, 0.8, 1), Density=2.0, Anisotropy=0.3)))


def principled_in_cube(scene: bpy.types.Scene, **inputs: object) -> None:
    stage(scene)
    values = {"Color": (0.7, 0.5, 0.3, 1), "Density": 1.2, "Anisotropy": 0.4, "Absorption_Color": (0.1, 0.4, 0.2, 1)}
    add_cube(scene, medium("smoke", of(PRINCIPLED, **(values | inputs))))
    lamp(scene, energy=200.0)


def camera_inside(scene: bpy.types.Scene) -> None:
    stage(scene, position=(0.0, -2.4, 1.0), rotation=(math.radians(85), 0, 0), lens=30.0)
    add_cube(scene, medium("fog", of(PRINCIPLED, Color=(0.8, 0.8, 0.5, 1), Density=0.2)), size=2.5)
    build.add_sphere(scene, build.principled("ball", Base_Color=(0.7, 0.5, 0.4, 1)), radius=0.4)
    lamp(scene, place=(0.5, -0.5, 1.8), energy=100.0)


def nested(scene: bpy.types.Scene) -> None:
    """A cube inside of another, a third across both sides of the first; the camera in the large one."""
    camera_inside(scene)
    add_cube(scene, medium("red", of(ABSORPTION, Color=(1, 0.3, 0.2, 1), Density=1.5)), 0.5, (-0.7, 0.0, 0.8))
    add_cube(scene, medium("mist", of(SCATTER, Density=1.5, Anisotropy=-0.6)), 0.6, (0.9, 0.6, 0.9))


def mesh_lamp_in_fog(scene: bpy.types.Scene) -> None:
    stage(scene)
    add_cube(scene, medium("fog", of(SCATTER, Density=0.6, Anisotropy=0.5)))
    glow = build.material("glow", of_surface("ShaderNodeEmission", Strength=15.0))
    add_cube(scene, glow, 0.15, (0.1, 0.0, 1.1))


def of_surface(kind: str, **inputs: object) -> Callable:
    return lambda tree: build.shader(tree, kind, **inputs).outputs[0]


def mixed(scene: bpy.types.Scene) -> None:
    """Mix and Add of everything, beside another anisotropy."""

    def volume(tree: bpy.types.ShaderNodeTree) -> bpy.types.Node:
        parts = [
            build.shader(tree, SCATTER, Color=(0.8, 0.6, 0.4, 1), Density=1.0, Anisotropy=0.7),
            build.shader(tree, SCATTER, Color=(0.2, 0.6, 0.8, 1), Density=1.0, Anisotropy=-0.5),
            build.shader(tree, ABSORPTION, Density=2.0),
            build.shader(tree, EMISSION, Color=(0.2, 0.4, 1, 1), Strength=0.2),
        ]
        mix = tree.nodes.new("ShaderNodeMixShader")
        mix.inputs[0].default_value = 0.4
        first, second = tree.nodes.new("ShaderNodeAddShader"), tree.nodes.new("ShaderNodeAddShader")
        for source, target in zip(
            (parts[0], parts[2], parts[1], parts[3]),
            (first.inputs[0], first.inputs[1], second.inputs[0], second.inputs[1]),
            strict=True,
        ):
            tree.links.new(source.outputs[0], target)
        tree.links.new(first.outputs[0], mix.inputs[1])
        tree.links.new(second.outputs[0], mix.inputs[2])
        return mix

    stage(scene)
    add_cube(scene, medium("mixture", volume))
    lamp(scene, energy=200.0)


def mirror_in_fog(scene: bpy.types.Scene) -> None:
    stage(scene)
    fill_world(scene, of(PRINCIPLED, Color=(0.8, 0.8, 0.8, 1), Density=0.1), strength=0.5)
    build.add_sphere(scene, build.principled("mirror", Metallic=1.0, Roughness=0.1))
    lamp(scene, "AREA", (0.0, 0.0, 2.5), energy=60.0, shape="SQUARE", size=0.8)


def uneven(kind: str, **inputs: object) -> Shader:
    """Of a density by noise in object coordinates, from nothing to 4."""

    def volume(tree: bpy.types.ShaderNodeTree) -> bpy.types.Node:
        place = tree.nodes.new("ShaderNodeTexCoord").outputs["Object"]
        noise = build.shader(tree, "ShaderNodeTexNoise", Vector=place, Scale=2.0)
        ramp = build.shader(tree, "ShaderNodeMapRange", Value=noise.outputs[0], From_Min=0.4, From_Max=0.7, To_Max=4.0)
        return build.shader(tree, kind, Density=ramp.outputs[0], **inputs)

    return volume


def cloud(scene: bpy.types.Scene) -> None:
    stage(scene)
    build.set_world(scene, strength=0.5)
    add_cube(scene, medium("cloud", uneven(SCATTER, Color=(0.9, 0.8, 0.6, 1), Anisotropy=0.4)))
    lamp(scene, energy=200.0)


def glowing_cloud(scene: bpy.types.Scene) -> None:
    """In even mist, with a lamp inside."""
    stage(scene)
    smoke = uneven(PRINCIPLED, Color=(0.5, 0.7, 0.9, 1), Emission_Strength=0.3, Emission_Color=(1, 0.4, 0.1, 1))
    add_cube(scene, medium("cloud", smoke))
    add_cube(scene, medium("mist", of(SCATTER, Density=0.3)), size=0.95)
    lamp(scene, place=(0.2, -0.1, 1.2), energy=60.0)


def transparent_film(scene: bpy.types.Scene) -> None:
    sky_in_cube(scene)
    bpy.data.objects.remove(bpy.data.objects["floor"])
    scene.render.film_transparent = True


CASES: dict[str, Callable[[bpy.types.Scene], None]] = {
    "spot in fog": spot_in_fog,
    "lamp in cube": lamp_in_cube,
    "absorbing glass": absorbing_glass,
    "emission": glowing,
    "sun": sun_in_cube,
    "forward": lambda scene: sun_in_cube(scene, 0.7),
    "backward": lambda scene: sun_in_cube(scene, -0.7),
    "sky": sky_in_cube,
    "principled": principled_in_cube,
    "principled fire": lambda scene: principled_in_cube(
        scene, Blackbody_Intensity=0.01, Temperature=3500.0, Emission_Strength=0.1, Emission_Color=(0, 0.5, 1, 1)
    ),
    "camera inside": camera_inside,
    "nested": nested,
    "mesh lamp": mesh_lamp_in_fog,
    "mixed": mixed,
    "mirror": mirror_in_fog,
    "transparent film": transparent_film,
}


SLOW = {"lamp in cube", "spot in fog", "backward", "principled", "nested", "mirror", "mesh lamp"}


@pytest.mark.parametrize("case", marked(CASES, SLOW))
def test_volumes(empty_scene: bpy.types.Scene, case: str) -> None:
    if case == "mixed" and bpy.app.version < (4, 5, 0):
        pytest.skip("Cycles 4.2 does not weigh emission in a mix, and adds phase functions up: up to 0.88 of the mean")
    CASES[case](empty_scene)
    result = compare_with_cycles(empty_scene, SIZE, SAMPLES)
    assert result.agrees, result


def sun_by_phase(scene: bpy.types.Scene, phase: str, **inputs: object) -> None:
    """A cube of which a strip is seen from ahead of the sun, a floor below it by what goes on."""

    def volume(tree: bpy.types.ShaderNodeTree) -> bpy.types.Node:
        node = tree.nodes.new(SCATTER)
        node.phase = phase
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        return node

    stage(scene)
    add_cube(scene, medium("mist", volume))
    build.add_light(scene, "SUN", rotation=(-1.2, 0.1, 0.0), energy=3.0, angle=0.1)


PHASES: dict[str, dict[str, object]] = {
    "Rayleigh": {"phase": "RAYLEIGH"},
    "Draine": {"phase": "DRAINE", "Anisotropy": 0.6, "Alpha": 1.0},
    "Draine, backward": {"phase": "DRAINE", "Anisotropy": -0.5, "Alpha": 0.7},
    "sea water": {"phase": "FOURNIER_FORAND", "IOR": 1.33, "Backscatter": 0.1},
    "clear water": {"phase": "FOURNIER_FORAND", "IOR": 1.1, "Backscatter": 0.02},
    "cloud": {"phase": "MIE", "Diameter": 20.0},
    "haze": {"phase": "MIE", "Diameter": 2.0},
    "smoke": {"phase": "MIE", "Diameter": 0.5},
    "fumes": {"phase": "MIE", "Diameter": 0.06},
}


def has_phases() -> bool:
    return "phase" in bpy.types.ShaderNodeVolumeScatter.bl_rna.properties


@pytest.mark.parametrize("case", PHASES)
def test_phase_functions(empty_scene: bpy.types.Scene, case: str) -> None:
    if not has_phases():
        pytest.skip("this Blender has one phase function")
    sun_by_phase(empty_scene, **PHASES[case])
    result = compare_with_cycles(empty_scene, SIZE, SAMPLES)
    assert result.agrees, result


@pytest.mark.slow
@pytest.mark.parametrize("case", [cloud, glowing_cloud])
def test_uneven(empty_scene: bpy.types.Scene, case: Callable) -> None:
    """Small, as these take Cycles long."""
    case(empty_scene)
    result = compare_with_cycles(empty_scene, (16, 16), SAMPLES)
    assert result.agrees, result


def thinner_noise(scene: bpy.types.Scene) -> None:
    node_of(scene, "cloud", "MAP_RANGE").inputs["To Max"].default_value *= 0.85


def seen_by_scattered(scene: bpy.types.Scene) -> None:
    """A sky for rays that a volume scattered alone, by Light Path."""
    sky_in_cube(scene)
    tree = scene.world.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    path = tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(path.outputs["Is Volume Scatter Ray"], background.inputs["Strength"])


def hidden_lamp(scene: bpy.types.Scene) -> None:
    lamp_in_cube(scene)
    bpy.data.objects["point"].visible_volume_scatter = False


def hidden_world(scene: bpy.types.Scene) -> None:
    sky_in_cube(scene)
    scene.world.cycles_visibility.scatter = False
    lamp(scene, energy=100.0)


def hidden_mesh(scene: bpy.types.Scene) -> None:
    mesh_lamp_in_fog(scene)
    bpy.data.objects["glow"].visible_volume_scatter = False


@pytest.mark.parametrize("case", [seen_by_scattered, hidden_lamp, hidden_world, hidden_mesh])
def test_visibility(empty_scene: bpy.types.Scene, case: Callable) -> None:
    if case is seen_by_scattered and bpy.app.version < (4, 5, 0):
        pytest.skip("this Blender has no output Is Volume Scatter Ray")
    if case is hidden_mesh and bpy.app.version < (4, 4, 0):
        pytest.skip("Cycles 4.2 shows scattered rays what diffuse ones see, too")
    case(empty_scene)
    result = compare_with_cycles(empty_scene, SIZE, SAMPLES)
    assert result.agrees, result


LIMITS = {"none": (8, 0), "one": (8, 1), "all": (0, 8)}


@pytest.mark.parametrize("case", LIMITS)
def test_limits(empty_scene: bpy.types.Scene, case: str) -> None:
    """Of bounces in total, and in volumes; 0 is light that was scattered once."""
    sky_in_cube(empty_scene)
    lamp(empty_scene, energy=100.0)
    limited(empty_scene, *LIMITS[case])
    ours = replicas(empty_scene, "CISTERN", 6, SAMPLES, 4)
    result = compare_replicas(ours, replicas(empty_scene, "CYCLES", 6, SAMPLES, 4, first_seed=1001))
    assert result.agrees, result
    limited(empty_scene, LIMITS[case][0] + 1, LIMITS[case][1] + 1)
    planted = compare_replicas(ours, replicas(empty_scene, "CYCLES", 6, SAMPLES, 4, first_seed=1001))
    assert not planted.agrees, planted


def limited(scene: bpy.types.Scene, total: int, volume: int) -> None:
    prepare(scene, *SIZE, total)
    scene.cycles.volume_bounces = scene.cistern.max_volume_bounces = volume


def denser(scene: bpy.types.Scene) -> None:
    node_of(scene, "fog", "VOLUME_SCATTER").inputs["Density"].default_value *= 1.15


def turned(scene: bpy.types.Scene) -> None:
    node_of(scene, "mist", "VOLUME_SCATTER").inputs["Anisotropy"].default_value += 0.05


def thinner_inside(scene: bpy.types.Scene) -> None:
    node_of(scene, "red", "VOLUME_ABSORPTION").inputs["Density"].default_value *= 0.5


def without_alpha(scene: bpy.types.Scene) -> None:
    node_of(scene, "mist", "VOLUME_SCATTER").inputs["Alpha"].default_value = 0.0


def node_of(scene: bpy.types.Scene, name: str, kind: str) -> bpy.types.Node:
    tree = bpy.data.materials[name].node_tree
    tree.update_tag()
    return next(node for node in tree.nodes if node.type == kind)


PLANTED = [(lamp_in_cube, denser), (sun_in_cube, turned), (nested, thinner_inside)]
PLANTED += [pytest.param(cloud, thinner_noise, marks=pytest.mark.slow)]


def dusty(scene: bpy.types.Scene) -> None:
    sun_by_phase(scene, **PHASES["Draine"])


if has_phases():
    PLANTED.append((dusty, without_alpha))


@pytest.mark.parametrize(("case", "plant"), PLANTED)
def test_planted_bugs(empty_scene: bpy.types.Scene, case: Callable, plant: Callable) -> None:
    case(empty_scene)
    result = compare_with_cycles(empty_scene, (16, 16) if case is cloud else SIZE, SAMPLES, plant=plant)
    assert not result.agrees, result
