"""Scenes with volumes from Blender: which techniques they are rendered by, and what users are told."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import addon
from addon import unshared
from tests.support import blender_scenes as build
from tests.support.engines import prepare, render
from tests.support.statistics import block_means, compare_replicas
from tests.support.volume_files import add_volume, needs_openvdb, puff, write_grids

pytestmark = pytest.mark.usefixtures("registered_addon")


def fog(density: float = 1.0, kind: str = "ShaderNodeVolumeScatter") -> bpy.types.Material:
    result = bpy.data.materials.new("Fog")
    result.use_nodes = True
    tree = result.node_tree
    tree.nodes.clear()
    scatter = build.shader(tree, kind, Density=density)
    tree.links.new(scatter.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
    return result


@pytest.fixture
def foggy_scene(empty_scene: bpy.types.Scene) -> bpy.types.Scene:
    build.add_floor(empty_scene)
    build.add_sphere(empty_scene, fog())
    build.add_light(empty_scene, "POINT", energy=100.0)
    build.add_camera(empty_scene)
    prepare(empty_scene, 16, 16)
    return empty_scene


PRESETS = {
    "FINAL": False,
    "INTERACTIVE": True,
    "RIS": True,
    "RESTIR_DI": True,
    "CELL_CACHE": True,
    "CELL_RESERVOIRS": True,
    "RESTIR_GI_FAST": True,
    "WORLD_PATHS": True,
}


@pytest.mark.parametrize("preset", PRESETS)
def test_all_presets_trace_paths(foggy_scene: bpy.types.Scene, preset: str) -> None:
    """Light samplers and numbers of light samples stay those of the preset: pictures agree but for noise."""
    expected = render(foggy_scene, "CISTERN", 64, 1)
    foggy_scene.cistern.preset = preset
    assert render(foggy_scene, "CISTERN", 64, 1).mean() == pytest.approx(expected.mean(), rel=0.02)
    warnings = addon.report.last[-1].warnings
    assert [warning for warning in warnings if "'Fog' has a volume" in warning] == warnings
    assert len(warnings) == PRESETS[preset]


def test_no_warning_without_volumes(foggy_scene: bpy.types.Scene) -> None:
    bpy.data.objects.remove(bpy.data.objects["sphere"])
    foggy_scene.cistern.preset = "RESTIR_GI"
    render(foggy_scene, "CISTERN", 1, 1)
    assert addon.report.last[-1].warnings == []


def test_motion_blur(foggy_scene: bpy.types.Scene) -> None:
    """Volumes move with their objects: the ball leaves the picture at once, half of the time it is not there."""
    still = render(foggy_scene, "CISTERN", 64, 1)[..., :3].mean()
    sphere = bpy.data.objects["sphere"]
    foggy_scene.render.use_motion_blur, foggy_scene.render.motion_blur_shutter = True, 1.0
    sphere.keyframe_insert("location", frame=foggy_scene.frame_current - 1)
    sphere.location.x += 1.0
    sphere.keyframe_insert("location", frame=foggy_scene.frame_current + 1)
    blurred = render(foggy_scene, "CISTERN", 64, 1)
    assert np.isfinite(blurred).all() and abs(blurred[..., :3].mean() / still - 1.0) > 1e-3


@needs_openvdb
def test_files_of_other_frames_have_no_part_in_motion_blur(foggy_scene: bpy.types.Scene, tmp_path: Path) -> None:
    """Of a sequence that jumps from one side to the other, where the shutter opens before the frame."""
    bpy.data.objects.remove(bpy.data.objects["sphere"])
    for frame in (1, 2):
        write_grids(tmp_path / f"smoke_{frame:04d}.vdb", {"density": puff(10)}, first=(20 * frame - 35, -5, 0))
    cloud = add_volume(foggy_scene, tmp_path / "smoke_0001.vdb", fog(8.0, "ShaderNodeVolumePrincipled"))
    cloud.data.is_sequence, cloud.data.frame_duration, cloud.data.frame_start = True, 2, 1
    foggy_scene.frame_set(2)
    still = render(foggy_scene, "CISTERN", 64, 1)
    foggy_scene.render.use_motion_blur, foggy_scene.render.motion_blur_shutter = True, 1.0
    np.testing.assert_allclose(render(foggy_scene, "CISTERN", 64, 1), still, atol=1e-5)
    foggy_scene.frame_set(1)
    assert np.abs(render(foggy_scene, "CISTERN", 64, 1) - still).mean() > 1e-3


def denser_by(tree: bpy.types.NodeTree, node: str, output: str) -> bpy.types.Node:
    """What absorbs 1 per metre more the more a vector points up: from 0 to 2."""
    along = tree.nodes.new("ShaderNodeVectorMath")
    along.operation = "DOT_PRODUCT"
    tree.links.new(tree.nodes.new(node).outputs[output], along.inputs[0])
    along.inputs[1].default_value = (0.0, 0.0, 1.0)
    density = build.shader(tree, "ShaderNodeMapRange", Value=along.outputs["Value"], From_Min=-1.0, To_Max=2.0)
    return build.shader(tree, "ShaderNodeVolumeAbsorption", Color=(0, 0, 0, 1), Density=density.outputs[0])


DIRECTIONS = {
    "Incoming": "ShaderNodeNewGeometry",
    "Normal": "ShaderNodeNewGeometry",
    "True Normal": "ShaderNodeNewGeometry",
    "Reflection": "ShaderNodeTexCoord",
}


@pytest.mark.parametrize("output", DIRECTIONS)
@pytest.mark.parametrize("tilt", [0.0, 60.0, 90.0, 180.0])
def test_by_direction(empty_scene: bpy.types.Scene, output: str, tilt: float) -> None:
    """Of a bright world: what passes a ball of 1 m that absorbs by where rays come from, away from their
    direction as in Cycles. The camera looks through the middle, turned away from straight down; noise is 0.6 %."""
    ball = build.add_sphere(empty_scene, fog(), radius=0.5)
    ball.location.z = -0.5
    tree = ball.data.materials[0].node_tree
    volume = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL").inputs["Volume"]
    tree.links.new(denser_by(tree, DIRECTIONS[output], output).outputs[0], volume)
    build.set_world(empty_scene, (1.0, 1.0, 1.0), strength=1.0)
    angle = np.radians(tilt)
    camera = build.add_camera(empty_scene, (0.0, -2 * np.sin(angle), 2 * np.cos(angle)), (angle, 0.0, 0.0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.02
    prepare(empty_scene, 8, 8)
    passed = render(empty_scene, "CISTERN", 2048, 1)[..., 0].mean()
    assert passed == pytest.approx(np.exp(-(1.0 + np.cos(angle))), rel=0.03)


def test_worlds_by_direction(empty_scene: bpy.types.Scene) -> None:
    """A bright plane, 1 m beyond the near clip, through air that absorbs 2 per metre on the way down; without a
    warning."""
    glow = build.material("glow", lambda tree: build.shader(tree, "ShaderNodeEmission").outputs[0])
    build.add_floor(empty_scene, glow)
    tree = build.set_world(empty_scene).node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(denser_by(tree, "ShaderNodeNewGeometry", "Incoming").outputs[0], output.inputs["Volume"])
    camera = build.add_camera(empty_scene, (0.0, 0.0, 1.1), (0.0, 0.0, 0.0))
    camera.data.lens, camera.data.clip_start = 2000.0, 0.1
    prepare(empty_scene, 1, 1)
    assert render(empty_scene, "CISTERN", 16, 1)[0, 0, 0] == pytest.approx(np.exp(-2.0), rel=1e-3)
    assert addon.report.last[-1].warnings == []


def thinner_above(tree: bpy.types.NodeTree, kind: str, **inputs: object) -> bpy.types.Node:
    """A volume that has exp(-z) of its density, or strength, at the height z above the ground, and below it 1."""
    place = tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
    height = build.shader(tree, "ShaderNodeSeparateXYZ", Vector=place).outputs["Z"]
    depth = build.shader(tree, "ShaderNodeMapRange", Value=height, To_Min=0.0, To_Max=-100.0, From_Max=100.0).outputs[0]
    power = tree.nodes.new("ShaderNodeMath")
    power.operation = "EXPONENT"
    tree.links.new(depth, power.inputs[0])
    return build.shader(tree, kind, **dict.fromkeys(inputs, power.outputs[0]))


@pytest.mark.parametrize("tilt", [0.0, 60.0])
@pytest.mark.parametrize("kind", ["ABSORPTION", "EMISSION"])
def test_worlds_that_vary(empty_scene: bpy.types.Scene, kind: str, tilt: float) -> None:
    """What passes, or shines, on an endless way up to where nothing is left; noise is 0.5 %."""
    build.add_floor(empty_scene)
    tree = build.set_world(empty_scene, (1.0, 1.0, 1.0), 1.0 if kind == "ABSORPTION" else 0.0).node_tree
    if kind == "ABSORPTION":
        volume = thinner_above(tree, "ShaderNodeVolumeAbsorption", Density=None)
        volume.inputs["Color"].default_value = (0, 0, 0, 1)
    else:
        volume = thinner_above(tree, "ShaderNodeEmission", Strength=None)
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(volume.outputs[0], output.inputs["Volume"])
    camera = build.add_camera(empty_scene, (0.0, 0.0, 0.1), (np.radians(180.0 - tilt), 0.0, 0.0), lens=2000.0)
    camera.data.clip_start = 1e-4
    prepare(empty_scene, 8, 8)
    depth = np.exp(-0.1) / np.cos(np.radians(tilt))
    expected = np.exp(-depth) if kind == "ABSORPTION" else depth
    assert render(empty_scene, "CISTERN", 2048, 1)[..., 0].mean() == pytest.approx(expected, rel=0.02)
    assert addon.report.last[-1].warnings == []


def in_fog(is_world: bool, density: float = 1.0) -> bpy.types.Scene:
    """A ball in fog that lies on the ground, of the world or in a wide box."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    build.stage(scene, build.principled("ball"))
    fog_tree = scene.world.node_tree
    if not is_world:
        box = fog()
        corners = [(x, y, z) for x in (-300, 300) for y in (-300, 300) for z in (-50, 20)]
        sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        build.add_mesh(scene, "box", corners, sides, box)
        fog_tree = box.node_tree
    scatter = thinner_above(fog_tree, "ShaderNodeVolumeScatter", Density=None)
    scatter.inputs["Color"].default_value, scatter.inputs["Anisotropy"].default_value = (0.9, 0.7, 0.5, 1), 0.3
    half = scatter.inputs["Density"].links[0].from_node.inputs[0].links[0].from_node
    half.inputs["To Min"].default_value = np.log(0.5 * density)
    output = next(node for node in fog_tree.nodes if node.type in ("OUTPUT_WORLD", "OUTPUT_MATERIAL"))
    fog_tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    prepare(scene, 16, 16)
    return scene


def blocks(scene: bpy.types.Scene) -> np.ndarray:
    return np.array([block_means(render(scene, "CISTERN", 32, seed)[..., :3], 4, 4).ravel() for seed in range(1, 9)])


def test_fog_of_the_world_is_that_of_a_wide_box(registered_addon) -> None:
    """False-alarm rate 1 %. Planted: 1.4 times as much of it."""
    of_box = blocks(in_fog(False))
    result = compare_replicas(of_box, blocks(in_fog(True)))
    assert result.agrees, result
    assert not compare_replicas(of_box, blocks(in_fog(True, 1.4))).agrees


def half_immersed(scene: bpy.types.Scene, method: str, density: float) -> None:
    """A cube of wax, 1 m wide, the lower half of which is in ink."""
    wax = build.material(
        "wax", lambda tree: build.shader(tree, "ShaderNodeSubsurfaceScattering", Scale=1.0, IOR=1.0).outputs[0]
    )
    node = next(node for node in wax.node_tree.nodes if node.type == "SUBSURFACE_SCATTERING")
    node.falloff = method
    node.inputs["Radius"].default_value = (0.5, 0.5, 0.5)
    ink = fog(density, "ShaderNodeVolumeAbsorption")
    next(n for n in ink.node_tree.nodes if n.type == "VOLUME_ABSORPTION").inputs["Color"].default_value = (0, 0, 0, 1)
    for half, height, inside in ((0.5, 0.5, wax), (1.5, 0.0, ink)):
        corners = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, height)]
        sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        build.add_mesh(scene, inside.name, corners, sides, inside)
    prepare(scene, 8, 8)


@pytest.mark.parametrize("method", ["RANDOM_WALK", "BURLEY"])
def test_light_that_leaves_wax_into_ink_is_absorbed(empty_scene: bpy.types.Scene, method: str) -> None:
    """A lamp in the ink, and the camera above: what it sees of it comes through the wax, and 0.1 m of ink."""
    half_immersed(empty_scene, method, 1000.0)
    build.add_light(empty_scene, "POINT", (0.6, 0.0, -0.2), energy=100.0, shadow_soft_size=0.0)
    build.add_camera(empty_scene, (3.0, 0.0, 0.3), (np.radians(90), 0.0, np.radians(90)), lens=100.0)
    assert render(empty_scene, "CISTERN", 256, 1)[..., :3].max() < 1e-6


def test_light_that_leaves_wax_into_the_air_is_not(empty_scene: bpy.types.Scene) -> None:
    """A lamp 1 m above, the camera in the ink, 0.1 m from the wax, of which it loses 18 %."""
    half_immersed(empty_scene, "RANDOM_WALK", 2.0)
    build.add_light(empty_scene, "POINT", (0.0, 0.0, 1.5), energy=100.0, shadow_soft_size=0.0)
    build.add_camera(empty_scene, (0.0, -0.6, -0.1), (np.radians(90), 0.0, 0.0), lens=100.0)
    empty_scene.camera.data.clip_start = 1e-3
    through_ink = render(empty_scene, "CISTERN", 1024, 1)[..., :3].mean()
    bpy.data.materials["Fog"].node_tree.nodes["Volume Absorption"].inputs["Density"].default_value = 0.0
    assert through_ink / render(empty_scene, "CISTERN", 1024, 1)[..., :3].mean() == pytest.approx(0.82, rel=0.1)


def test_warning_is_about_reuse() -> None:
    plain = {"direct": "NEE", "secondary": "NEE", "indirect": "PATH"}
    fog = SimpleNamespace(volume_name="Fog", dispersive_name="")
    prism = SimpleNamespace(volume_name="", dispersive_name="Prism")
    clear = SimpleNamespace(volume_name="", dispersive_name="")
    assert unshared.warning(fog, plain) is None
    assert unshared.warning(fog, plain | {"direct": "LEARNED", "indirect": "CELL_SHARED"}) is None
    assert unshared.warning(clear, plain | {"direct": "RIS"}) is None
    for change in ({"direct": "RIS"}, {"indirect": "WORLD_REUSE"}, {"indirect": "CELL_SHARED", "bias": "FAST"}):
        assert "'Fog' has a volume" in unshared.warning(fog, plain | change)
        assert "'Prism' has dispersion" in unshared.warning(prism, plain | change)
