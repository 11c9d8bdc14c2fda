"""The live scene of a viewport when volume objects change."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.sync import versions
from addon.sync.live import Exported
from tests.blender.test_against_cycles_volumes import PRINCIPLED, medium, node_of, of
from tests.support.volume_files import add_volume, needs_openvdb, puff, write_grids

pytestmark = needs_openvdb


@pytest.fixture
def smoky(watched, tmp_path: Path):
    """With a volume that is not there from the start."""
    grids = {"density": puff(6), "flame": puff(6)}
    path = write_grids(tmp_path / "a.vdb", grids)
    exported = watched.after(lambda: add_volume(bpy.context.scene, path, medium("smoke", of(PRINCIPLED, Density=2.0))))
    assert (exported.meshes, exported.instances) == (1, True)
    watched.expect_truth()
    return watched


def stored_grids(watched) -> list[list[str]]:
    meshes = watched.live.builder.stored["mesh"].values()
    return [[grid[0] for grid in m["grids"]] for m in meshes if m["is_there"] and "grids" in m]


def test_moves_read_no_file(smoky) -> None:
    exported = smoky.after(lambda: setattr(bpy.data.objects["cloud"], "location", (1, 2, 3)))
    assert exported == Exported(instances=True)
    smoky.expect_truth()


def test_another_file_is_exported(smoky, tmp_path: Path) -> None:
    path = write_grids(tmp_path / "b.vdb", {"density": 2 * puff(5)})
    assert smoky.after(lambda: setattr(bpy.data.volumes["cloud"], "filepath", str(path))).meshes == 1
    smoky.expect_truth()


def test_edits_of_the_material_read_no_file(smoky) -> None:
    node = node_of(bpy.context.scene, "smoke", "PRINCIPLED_VOLUME")
    exported = smoky.after(lambda: setattr(node.inputs["Density"], "default_value", 3.0))
    assert (exported.materials, exported.meshes) == (1, 0)
    smoky.expect_truth()


def test_materials_that_read_other_grids(smoky) -> None:
    assert stored_grids(smoky) == [["density"]]
    node = node_of(bpy.context.scene, "smoke", "PRINCIPLED_VOLUME")
    smoky.after(lambda: setattr(node.inputs["Density Attribute"], "default_value", "flame"))
    assert stored_grids(smoky) == [["flame"]]
    smoky.expect_truth()


def test_volumes_that_go_are_forgotten(smoky) -> None:
    smoky.after(lambda: bpy.data.objects.remove(bpy.data.objects["cloud"]))
    assert stored_grids(smoky) == []
    smoky.expect_truth()


def test_a_material_of_a_volume_and_of_a_mesh(smoky) -> None:
    """Two programs: on meshes there are no grids."""
    mesh = bpy.data.objects["Object 1"].data
    smoky.after(lambda: mesh.materials.append(bpy.data.materials["smoke"]))
    smoky.expect_truth()
    node = node_of(bpy.context.scene, "smoke", "PRINCIPLED_VOLUME")
    assert smoky.after(lambda: setattr(node.inputs["Density"], "default_value", 4.0)).materials == 2
    smoky.expect_truth()


def test_sequences_follow_the_frame(smoky, tmp_path: Path) -> None:
    for frame in (1, 2):
        write_grids(tmp_path / f"smoke_{frame:04d}.vdb", {"density": np.full((2, 2, 2), float(frame))})
    volume = bpy.data.volumes["cloud"]

    def follow() -> None:
        volume.filepath, volume.is_sequence = str(tmp_path / "smoke_0001.vdb"), True
        volume.frame_duration, volume.frame_start = 2, 1

    smoky.after(follow)
    smoky.after(lambda: bpy.context.scene.frame_set(2))
    smoky.expect_truth()
    (stored,) = (m for m in smoky.live.builder.stored["mesh"].values() if m["is_there"] and "grids" in m)
    assert stored["grids"][0][1].max() == 2.0


def test_what_is_left_out_of_a_volume_is_told_again_and_again(watched, tmp_path: Path) -> None:
    path = write_grids(tmp_path / "a.vdb", {"density": puff(6)})
    reader = versions.volume_reader()
    odd = reader.FloatGrid()
    odd.name = "odd"
    for corner in ((0, 0, 0), (90_000, 90_000, 90_000)):
        odd.fill(corner, corner, 1.0)
    reader.write(str(path), [*reader.readAll(str(path))[0], odd])
    smoke = medium("smoke", of(PRINCIPLED, Density=2.0, Color_Attribute="odd"))
    watched.after(lambda: add_volume(bpy.context.scene, path, smoke))
    for place in ((1, 2, 3), (2, 3, 4)):
        assert ["odd" in warning for warning in watched.warnings] == [True]
        watched.after(lambda place=place: setattr(bpy.data.objects["cloud"], "location", place))
        watched.expect_truth()
