"""Motion blur of volume objects by a grid of velocities, in closed form.

A cube of light without surface goes along x. Where its light is on average, and how far that is spread, say where the
shutter opens and how far the cube goes: of 8 pictures the mean has to be within `LIMIT` standard errors, t-tests with a
false-alarm rate of 1e-4 each. (Cycles 5.0 loses light there, up to a sixth of this cube's, as it does not look for
voxels where they go; with position END it goes on after the frame.)
"""

from pathlib import Path

import bpy
import numpy as np
import pytest
from scipy import stats

import addon
from tests.support import blender_scenes as build
from tests.support.engines import prepare, render
from tests.support.volume_files import add_volume, needs_openvdb, write_grids

pytestmark = [pytest.mark.usefixtures("registered_addon"), needs_openvdb]

PICTURES, SAMPLES = 8, 16
LIMIT = stats.t.ppf(1.0 - 0.5e-4, PICTURES - 1)
WIDTH, METRES = 64, 4.0
SPEED = 24.0  # a metre in a frame


def grids(speed: float = SPEED, split: bool = False) -> dict[str, np.ndarray]:
    """A cube of 1 m in the middle of 3 m of wind; of vectors, or of three components."""
    density = np.zeros((60, 60, 60), np.float32)
    density[20:40, 20:40, 20:40] = 1.0
    wind = np.zeros((60, 60, 60, 3), np.float32)
    wind[..., 0], wind[..., 1] = speed, 0.5 * speed  # away from the camera it does not show
    if split:
        return {"density": density} | {f"velocity_{axis}": wind[..., i] for i, axis in enumerate("xyz")}
    return {"density": density, "velocity": wind}


def cube_of_light(scene: bpy.types.Scene, file: Path) -> bpy.types.Object:
    material = bpy.data.materials.new("light")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    density = tree.nodes.new("ShaderNodeAttribute")
    density.attribute_name = "density"
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(density.outputs["Fac"], emission.inputs["Strength"])
    tree.links.new(emission.outputs[0], output.inputs["Volume"])
    cube = add_volume(scene, file, material)
    cube.data.velocity_unit = "SECOND"
    camera = build.add_camera(scene)
    camera.location, camera.rotation_euler = (0.0, -5.0, 0.0), (np.pi / 2, 0.0, 0.0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", METRES
    build.set_world(scene, strength=0.0)
    prepare(scene, WIDTH, 16)
    scene.render.fps, scene.render.use_motion_blur, scene.render.motion_blur_shutter = 24, True, 0.5
    return cube


def moments(scene: bpy.types.Scene) -> np.ndarray:
    """Of pictures, (pictures, 2): the light's mean place in metres, and its variance about the place that is told."""
    x = (np.arange(WIDTH) + 0.5) / WIDTH * METRES - 0.5 * METRES
    found = []
    for seed in range(PICTURES):
        light = render(scene, "CISTERN", SAMPLES, seed + 1)[..., 0].sum(axis=0)
        mean = float(light @ x / light.sum())
        found.append((mean, float(light @ (x - mean) ** 2 / light.sum())))
    return np.array(found)


def agrees(found: np.ndarray, rest: np.ndarray, place: float, way: float) -> bool:
    """Whether it is `place` off where it rests, and spread over `way`."""
    difference = found - rest - np.array([place, way**2 / 12.0])
    error = difference.std(axis=0, ddof=1) / np.sqrt(PICTURES)
    return bool((np.abs(difference.mean(axis=0)) <= LIMIT * error + 1e-3).all())


@pytest.fixture
def scene(empty_scene: bpy.types.Scene) -> bpy.types.Scene:
    return empty_scene


@pytest.mark.parametrize(("position", "place"), [("CENTER", 0.0), ("START", 0.25), ("END", -0.25)])
@pytest.mark.parametrize("split", [False, True])
def test_the_cube_goes_while_the_shutter_is_open(scene, tmp_path, position, place, split) -> None:
    cube_of_light(scene, write_grids(tmp_path / "a.vdb", grids(split=split), 0.05, (-30, -30, -30)))
    scene.render.motion_blur_position = position
    blurred = moments(scene)
    scene.render.use_motion_blur = False
    rest = moments(scene)
    assert agrees(rest, rest.mean(axis=0), 0.0, 0.0)
    assert agrees(blurred, rest, place, 0.5)
    assert not agrees(blurred, rest, place + 0.25, 0.5) and not agrees(blurred, rest, place, 0.25), "planted"


def test_units_scale_and_the_objects_own_switch(scene, tmp_path) -> None:
    cube = cube_of_light(scene, write_grids(tmp_path / "a.vdb", grids(0.5), 0.05, (-30, -30, -30)))
    cube.data.velocity_unit, cube.data.velocity_scale = "FRAME", 2.0
    blurred = moments(scene)
    cube.data.velocity_unit = "SECOND"
    slow = moments(scene)
    cube.data.velocity_unit = "FRAME"
    cube.cycles.use_motion_blur = False
    rest = moments(scene)
    assert agrees(blurred, rest, 0.0, 0.5) and agrees(slow, rest, 0.0, 0.5 / 24.0)
    assert not agrees(blurred, rest, 0.0, 0.25), "planted"


def test_turned_and_scaled_objects(scene, tmp_path) -> None:
    """Velocities are those of object space."""
    cube = cube_of_light(scene, write_grids(tmp_path / "a.vdb", grids(), 0.05, (-30, -30, -30)))
    cube.scale, cube.rotation_euler = (0.5, 1.0, 1.0), (0.0, 0.0, np.pi)
    scene.render.motion_blur_position = "START"
    blurred = moments(scene)
    cube.cycles.use_motion_blur = False
    rest = moments(scene)
    assert agrees(blurred, rest, -0.125, 0.25)


def test_coordinates_do_not_hang_on_how_far_things_go(scene, tmp_path) -> None:
    """Generated ones map the box at rest to [0, 1]: the cube's share above its middle is 1 / 2, blurred or not."""
    cube = cube_of_light(scene, write_grids(tmp_path / "a.vdb", grids(), 0.05, (-30, -30, -30)))
    tree = cube.data.materials[0].node_tree
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    upper = build.shader(tree, "ShaderNodeMath", Value=tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"])
    upper.operation = "GREATER_THAN"
    separate = build.shader(tree, "ShaderNodeSeparateXYZ", Vector=upper.inputs[0].links[0].from_socket)
    tree.links.new(separate.outputs["X"], upper.inputs[0])
    tree.links.new(upper.outputs[0], emission.inputs["Color"])
    scene.render.motion_blur_position = "START"
    blurred = moments(scene)
    cube.cycles.use_motion_blur = False
    rest = moments(scene)
    assert agrees(blurred, rest, 0.25, 0.5)


def test_components_without_wind_are_none(scene, tmp_path) -> None:
    found = grids(split=True)
    found["velocity_y"][:] = found["velocity_z"][:] = 0.0
    cube_of_light(scene, write_grids(tmp_path / "a.vdb", found, 0.05, (-30, -30, -30)))
    blurred = moments(scene)
    scene.render.use_motion_blur = False
    assert agrees(blurred, moments(scene), 0.0, 0.5)


def test_velocities_beyond_reason_are_left_out(scene, tmp_path) -> None:
    cube = cube_of_light(scene, write_grids(tmp_path / "a.vdb", grids(3e38), 0.05, (-30, -30, -30)))
    cube.data.render.precision = "FULL"
    blurred = moments(scene)
    assert any("velocities are left out" in warning for line in addon.report.last for warning in line.warnings)
    scene.render.use_motion_blur = False
    assert agrees(blurred, moments(scene), 0.0, 0.0)


def test_what_shades_and_scatters_goes_on_too(scene, tmp_path) -> None:
    """Before a white sky the cube hides as much light wherever it is: nothing of what goes on is lost."""
    cube = cube_of_light(scene, write_grids(tmp_path / "a.vdb", grids(), 0.05, (-30, -30, -30)))
    tree = cube.data.materials[0].node_tree
    absorption = tree.nodes.new("ShaderNodeVolumeAbsorption")
    tree.links.new(next(n for n in tree.nodes if n.type == "ATTRIBUTE").outputs["Fac"], absorption.inputs["Density"])
    absorption.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    tree.links.new(absorption.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Volume"])
    build.set_world(scene, (1.0, 1.0, 1.0), 1.0)
    blurred = [render(scene, "CISTERN", SAMPLES, seed)[..., 0] for seed in range(1, PICTURES + 1)]
    scene.render.use_motion_blur = False
    rest = [render(scene, "CISTERN", SAMPLES, seed)[..., 0] for seed in range(1, PICTURES + 1)]
    hidden = np.array([[1.0 - picture.mean() for picture in pictures] for pictures in (blurred, rest)])
    error = np.sqrt(hidden.var(axis=1, ddof=1).sum() / PICTURES)
    assert abs(hidden[0].mean() - hidden[1].mean()) <= LIMIT * error
    assert error < 0.02 * hidden[1].mean(), "a fiftieth that is lost is seen"
    assert np.abs(np.mean(blurred, axis=0) - np.mean(rest, axis=0)).max() > 0.2, "planted: it does move"
