"""Volume objects against Cycles in the same process.

Means of 4x4 blocks and 4 channels over 6 replicas of each engine, Welch's t-test, false-alarm rate 1 % per case (Šidák
over the 64 values). `test_planted_bugs` shows what the comparison sees.
"""

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.blender.test_against_cycles_volumes import (
    EMISSION,
    PRINCIPLED,
    SCATTER,
    Shader,
    lamp,
    medium,
    node_of,
    of,
    stage,
)
from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles
from tests.support.slow_cases import marked
from tests.support.volume_files import add_volume, needs_openvdb, puff, write_grids

pytestmark = [pytest.mark.usefixtures("registered_addon"), needs_openvdb]

SIZE, SAMPLES = (16, 16), 24  # Cycles takes seconds for a picture of these
FEW_SAMPLES = 8  # of what is not marked slow
PLACE = (0.0, 0.0, 1.0)


def by_attribute(kind: str, socket: str, name: str, scale: float, **inputs: object) -> Shader:
    def volume(tree: bpy.types.ShaderNodeTree) -> bpy.types.Node:
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = name
        times = tree.nodes.new("ShaderNodeMath")
        times.operation = "MULTIPLY"
        tree.links.new(node.outputs["Fac"], times.inputs[0])
        times.inputs[1].default_value = scale
        return build.shader(tree, kind, **{socket: times.outputs[0]}, **inputs)

    return volume


def placed(
    scene: bpy.types.Scene, file: Path, shader: Shader | None, first: tuple = (-10, -10, -10)
) -> bpy.types.Object:
    obj = add_volume(scene, file, medium("smoke", shader) if shader else None)
    obj.location = PLACE
    return obj


def cloud(scene: bpy.types.Scene, folder: Path) -> None:
    stage(scene)
    build.set_world(scene, strength=0.3)
    file = write_grids(folder / "a.vdb", {"density": puff(20)}, 0.09, (-10, -10, -10))
    placed(scene, file, of(PRINCIPLED, Color=(0.8, 0.6, 0.4, 1), Density=6.0, Anisotropy=0.3))
    lamp(scene, energy=150.0)


def default_material(scene: bpy.types.Scene, folder: Path) -> None:
    stage(scene)
    file = write_grids(folder / "a.vdb", {"density": 8.0 * puff(16)}, 0.1, (-8, -8, -8))
    placed(scene, file, None)
    lamp(scene, energy=150.0)


def scatter_by_attribute(scene: bpy.types.Scene, folder: Path) -> None:
    """Turned, scaled unevenly, with voxels that are no cubes; few, so that interpolation shows."""
    stage(scene)
    matrix = np.diag([0.25, 0.2, 0.3, 1.0])
    matrix[:3, 3] = (-0.6, -0.5, -0.7)
    file = write_grids(folder / "a.vdb", {"density": puff(voxels=(6, 6, 6))}, matrix=matrix)
    obj = placed(scene, file, by_attribute(SCATTER, "Density", "density", 5.0, Color=(0.9, 0.7, 0.5, 1)))
    obj.rotation_euler, obj.scale = (0.4, 0.7, 0.3), (1.2, 0.8, 1.0)
    lamp(scene, energy=150.0)


def fire(scene: bpy.types.Scene, folder: Path) -> None:
    """Of fine voxels: from 5.0 on Cycles reads voxels at random in place of what is between them, which is another mean
    of what is no linear function of them, as of the fourth power of a temperature."""
    stage(scene)
    density = puff(48)
    file = write_grids(folder / "a.vdb", {"density": density, "temperature": density}, 0.033, (-24, -24, -24))
    shader = of(PRINCIPLED, Color=(0.6, 0.6, 0.6, 1), Density=2.0, Blackbody_Intensity=1.0, Temperature=3000.0)
    placed(scene, file, shader)


def coloured(scene: bpy.types.Scene, folder: Path) -> None:
    """Colours by a grid of vectors."""
    stage(scene)
    colors = np.stack(np.meshgrid(*(np.linspace(0.2, 0.9, 16),) * 3, indexing="ij"), -1)
    file = write_grids(folder / "b.vdb", {"density": puff(16), "tint": colors}, 0.1, (-8, -8, -8))
    placed(scene, file, tinted)
    lamp(scene, energy=150.0)


def tinted(tree: bpy.types.ShaderNodeTree) -> bpy.types.Node:
    node = build.shader(tree, PRINCIPLED, Density=6.0)
    node.inputs["Color Attribute"].default_value = "tint"
    node.inputs["Color"].default_value = (0.9, 0.9, 0.9, 1)
    return node


def glow_by_flame(scene: bpy.types.Scene, folder: Path) -> None:
    stage(scene)
    file = write_grids(folder / "a.vdb", {"flame": puff(16)}, 0.1, (-8, -8, -8))
    placed(scene, file, by_attribute(EMISSION, "Strength", "flame", 2.0, Color=(1, 0.5, 0.2, 1)))


def object_space(scene: bpy.types.Scene, folder: Path) -> None:
    """Scaled up, of a density in object space, behind a volume of another object."""
    cloud(scene, folder)
    obj = bpy.data.objects["cloud"]
    obj.data.render.space, obj.scale = "OBJECT", (1.4, 1.4, 1.4)
    other = add_volume(scene, obj.data.filepath, bpy.data.materials["smoke"], "other")
    other.location, other.scale = (0.5, 0.3, 0.8), (0.6, 0.6, 0.6)


def copies_side_by_side(scene: bpy.types.Scene, folder: Path) -> None:
    """Two of a grid, moved along an axis by its box."""
    stage(scene)
    build.set_world(scene, strength=0.3)
    file = write_grids(folder / "a.vdb", {"density": 0.5 + 0.5 * puff(6)}, 0.2, (1, 1, 1))
    for number, x in enumerate((-1.6, 0.0)):
        smoke = bpy.data.materials.get("smoke") or medium(
            "smoke", of(PRINCIPLED, Color=(0.8, 0.6, 0.4, 1), Density=4.0)
        )
        add_volume(scene, file, smoke, f"cloud {number}").location = (x, -0.8, 0.3)
    lamp(scene, place=(1.0, -1.0, 4.0), energy=300.0)


def unseen_by_the_camera(scene: bpy.types.Scene, folder: Path) -> None:
    """Only its shadow is seen, and what of its light reaches the floor."""
    cloud(scene, folder)
    smoke = bpy.data.objects["cloud"]
    smoke.visible_camera, smoke.location.z = False, 1.7


def camera_inside(scene: bpy.types.Scene, folder: Path) -> None:
    cloud(scene, folder)
    cloud_object = bpy.data.objects["cloud"]
    cloud_object.location, cloud_object.scale = scene.camera.location, (1.5, 1.5, 1.5)
    node = next(n for n in bpy.data.materials["smoke"].node_tree.nodes if n.bl_idname == PRINCIPLED)
    node.inputs["Density"].default_value = 1.0


def info_node(scene: bpy.types.Scene, folder: Path) -> None:
    def volume(tree: bpy.types.ShaderNodeTree) -> bpy.types.Node:
        info = tree.nodes.new("ShaderNodeVolumeInfo")
        return build.shader(tree, SCATTER, Color=(0.5, 0.7, 0.9, 1), Density=info.outputs["Density"])

    stage(scene)
    file = write_grids(folder / "a.vdb", {"density": 5.0 * puff(16)}, 0.1, (-8, -8, -8))
    placed(scene, file, volume)
    lamp(scene, energy=150.0)


def geometry_nodes(kind: str) -> Callable:
    """A volume that geometry nodes make of a cube."""

    def make(scene: bpy.types.Scene, folder: Path) -> None:
        stage(scene)
        cube = build.add_mesh(scene, "cube", *_cube(0.5), medium("smoke", of(PRINCIPLED, Density=3.0)))
        cube.location = PLACE
        tree = bpy.data.node_groups.new("volume", "GeometryNodeTree")
        for way in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        start, end, node = (tree.nodes.new(k) for k in ("NodeGroupInput", "NodeGroupOutput", kind))
        if "Mesh" in node.inputs:
            tree.links.new(start.outputs[0], node.inputs["Mesh"])
        material = tree.nodes.new("GeometryNodeSetMaterial")
        material.inputs["Material"].default_value = bpy.data.materials["smoke"]
        tree.links.new(node.outputs[0], material.inputs["Geometry"])
        tree.links.new(material.outputs[0], end.inputs[0])
        cube.modifiers.new("volume", "NODES").node_group = tree
        lamp(scene, energy=150.0)

    return make


def _cube(half: float) -> tuple[list, list]:
    points = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)]
    return points, [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


CASES: dict[str, Callable[[bpy.types.Scene, Path], None]] = {
    "cloud": cloud,
    "default material": default_material,
    "scatter by attribute": scatter_by_attribute,
    "fire": fire,
    "coloured": coloured,
    "flame": glow_by_flame,
    "object space": object_space,
    "copies side by side": copies_side_by_side,
    "unseen by the camera": unseen_by_the_camera,
    "camera inside": camera_inside,
    "volume info": info_node,
    "mesh to volume": geometry_nodes("GeometryNodeMeshToVolume"),
    "volume cube": geometry_nodes("GeometryNodeVolumeCube"),
}


SLOW = set(CASES) - {"cloud"}


@pytest.mark.parametrize("case", marked(CASES, SLOW))
def test_volume_objects(empty_scene: bpy.types.Scene, tmp_path: Path, case: str) -> None:
    CASES[case](empty_scene, tmp_path)
    result = compare_with_cycles(empty_scene, SIZE, FEW_SAMPLES if case == "cloud" else SAMPLES)
    assert result.agrees, result


def thinner(scene: bpy.types.Scene) -> None:
    node_of(scene, "smoke", "PRINCIPLED_VOLUME").inputs["Density"].default_value *= 0.6


def beside(scene: bpy.types.Scene) -> None:
    """By half a voxel along each axis, as if voxels were cells."""
    obj = bpy.data.objects["cloud"]
    obj.location = [place + 0.5 * 0.09 for place in obj.location]


@pytest.mark.parametrize("plant", [thinner, pytest.param(beside, marks=pytest.mark.slow)])
def test_planted_bugs(empty_scene: bpy.types.Scene, tmp_path: Path, plant: Callable) -> None:
    cloud(empty_scene, tmp_path)
    result = compare_with_cycles(empty_scene, SIZE, FEW_SAMPLES if plant is thinner else SAMPLES, plant=plant)
    assert not result.agrees, result
