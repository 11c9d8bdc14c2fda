"""Grids of volume objects: what of a file reaches the core, and what users are told of what cannot."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from addon.sync import SyncReport, versions
from addon.sync.fluid_grids import gas_arrays, gas_domain
from addon.sync.volume_grids import VolumeArrays, volume_arrays, volume_version
from tests.support import blender_scenes as build
from tests.support.volume_files import add_volume, needs_openvdb, puff, write_grids

VOXELS = np.arange(1, 25, dtype=np.float32).reshape(2, 3, 4)


def read(obj: bpy.types.Object, names: set[str], report: SyncReport | None = None) -> VolumeArrays | None:
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return volume_arrays(evaluated.data, f"Object '{obj.name}'", names, report or SyncReport())


@needs_openvdb
def test_voxels_and_where_they_are(empty_scene, tmp_path: Path) -> None:
    """In half precision unless the volume wants more; the box has a voxel around them, in whole leaves of 8. Before
    Blender 5.0 values lie in the middle of their voxels."""
    matrix = np.array([[0.0, 0.5, 0.0, 1.0], [0.25, 0.0, 0.0, 2.0], [0.0, 0.0, 2.0, 3.0], [0, 0, 0, 1]])
    obj = add_volume(empty_scene, write_grids(tmp_path / "a.vdb", {"density": VOXELS}, first=(8, -2, 7), matrix=matrix))
    arrays = read(obj, {"density", "other"})
    ((name, voxels, object_to_voxel, background),) = arrays.grids
    assert (name, voxels.dtype, background) == ("density", np.float16, 0.0)
    assert np.array_equal(voxels, VOXELS)
    centre = versions.voxel_centre()
    assert centre == (0.0 if bpy.app.version >= (5, 0, 0) else 0.5)
    place = matrix @ (8 + 1 + centre, -2 + 2 + centre, 7 + 3 + centre, 1)
    assert object_to_voxel @ place == pytest.approx((1, 2, 3, 1), abs=1e-5)
    assert arrays.size == (16, 16, 16)  # from index 0, -8 and 0 on
    assert arrays.object_to_box @ place == pytest.approx((9 + centre, 8 + centre, 10 + centre, 1), abs=1e-5)
    assert arrays.scales_with_object
    obj.data.render.precision, obj.data.render.space = "FULL", "WORLD"
    arrays = read(obj, {"density"})
    assert arrays.grids[0][1].dtype == np.float32 and not arrays.scales_with_object


@needs_openvdb
def test_vectors_and_grids_that_are_not_asked_for(empty_scene, tmp_path: Path) -> None:
    colors = np.stack([VOXELS, 2 * VOXELS, 3 * VOXELS], -1)
    obj = add_volume(empty_scene, write_grids(tmp_path / "a.vdb", {"density": VOXELS, "tint": colors}))
    ((name, voxels, *_),) = read(obj, {"tint"}).grids
    assert name == "tint" and np.array_equal(voxels, colors)
    assert read(obj, {"flame"}) is None


@needs_openvdb
def test_values_that_are_not_finite_or_too_large_for_half_precision(empty_scene, tmp_path: Path) -> None:
    voxels = np.array([[[np.inf, 1e9, 1.0]]], np.float32)
    obj = add_volume(empty_scene, write_grids(tmp_path / "a.vdb", {"density": voxels}))
    assert read(obj, {"density"}).grids[0][1].ravel().tolist() == [0.0, 65504.0, 1.0]


@needs_openvdb
def test_empty_grids_are_nothing(empty_scene, tmp_path: Path) -> None:
    obj = add_volume(empty_scene, write_grids(tmp_path / "a.vdb", {"density": np.zeros((2, 2, 2))}))
    report = SyncReport()
    assert read(obj, {"density"}, report) is None and report.warnings == []


@pytest.mark.parametrize("content", [None, b"", b"no volume", "cut"])
def test_files_that_cannot_be_read(empty_scene, tmp_path: Path, content) -> None:
    path = tmp_path / "bad.vdb"
    if content == "cut":
        if versions.volume_reader() is None:
            pytest.skip("this Blender cannot write OpenVDB files")
        write_grids(path, {"density": puff(20)})
        path.write_bytes(path.read_bytes()[:1500])
    elif content is not None:
        path.write_bytes(content)
    report = SyncReport()
    assert read(add_volume(empty_scene, path), {"density"}, report) is None
    (warning,) = report.warnings
    assert "Object 'cloud'" in warning and "bad.vdb" in warning


@needs_openvdb
def test_blender_without_a_reader(empty_scene, tmp_path: Path, monkeypatch) -> None:
    obj = add_volume(empty_scene, write_grids(tmp_path / "a.vdb", {"density": VOXELS}))
    monkeypatch.setattr(versions, "volume_reader", lambda: None)
    report = SyncReport()
    assert read(obj, {"density"}, report) is None
    assert report.warnings == ["Object 'cloud': this Blender has no Python module for OpenVDB, the volume is left out"]


def test_no_file_is_nothing(empty_scene) -> None:
    report = SyncReport()
    assert read(add_volume(empty_scene, ""), {"density"}, report) is None and report.warnings == []


@needs_openvdb
def test_sequences(empty_scene, tmp_path: Path) -> None:
    for frame in (1, 2):
        write_grids(tmp_path / f"smoke_{frame:04d}.vdb", {"density": frame * VOXELS})
    obj = add_volume(empty_scene, tmp_path / "smoke_0001.vdb")
    obj.data.is_sequence, obj.data.frame_duration, obj.data.frame_start = True, 2, 1
    for frame in (1, 2, 1):
        empty_scene.frame_set(frame)
        assert np.array_equal(read(obj, {"density"}).grids[0][1], frame * VOXELS)


@needs_openvdb
def test_versions_tell_files_apart(empty_scene, tmp_path: Path) -> None:
    obj = add_volume(empty_scene, write_grids(tmp_path / "a.vdb", {"density": VOXELS}))

    def version(names: set[str]) -> int:
        return volume_version(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data, names)

    before = version({"density"})
    assert before != 0 and before == version({"density"})
    assert before != version({"density", "flame"})
    obj.data.filepath = str(write_grids(tmp_path / "b.vdb", {"density": 2 * VOXELS}))
    assert version({"density"}) not in (0, before)
    obj.data.filepath = str(tmp_path / "missing.vdb")
    assert version({"density"}) == 0


class Flat(list):
    """A bpy_prop_array."""

    def foreach_get(self, values: np.ndarray) -> None:
        values[:] = self


def smoke(**members: object) -> SimpleNamespace:
    """A domain as a bake leaves it, of 2 x 3 x 4 cells and 4 x 6 x 8 refined by noise."""
    density = np.arange(4 * 6 * 8, dtype=np.float32)
    values = {"density_grid": Flat(density), "flame_grid": Flat([]), "color_grid": Flat(np.repeat(density, 4))}
    values |= {"temperature_grid": Flat(np.zeros(192)), "heat_grid": Flat(range(24))}
    plain = {"domain_resolution": (2, 3, 4), "noise_scale": 2, "use_noise": True}
    frames = {"cache_frame_start": 1, "cache_frame_end": 9}
    return SimpleNamespace(**(values | plain | frames | members))


NAMES = {"density", "flame", "color", "temperature", "heat"}


@pytest.fixture
def domain_object(empty_scene) -> bpy.types.Object:
    corners = [(x, y, z) for x in (1, 3) for y in (-2, 4) for z in (0, 8)]
    return build.add_mesh(empty_scene, "domain", corners, [(0, 1, 3, 2), (4, 6, 7, 5)], None)


def test_smoke_lies_in_the_cells_of_its_domain(domain_object) -> None:
    """Voxel 0 is the middle of the first cell. Scripts cannot bake smoke in the `bpy` wheel: a stand-in."""
    arrays = gas_arrays(domain_object, smoke(), 1, NAMES, SyncReport())
    grids = {name: (voxels, matrix) for name, voxels, matrix, _ in arrays.grids}
    assert grids.keys() == {"density", "color", "heat"}  # of flames and temperatures there are none
    voxels, matrix = grids["density"]
    assert voxels.shape == (4, 6, 8) and voxels[1, 2, 3] == 1 + 4 * (2 + 6 * 3)
    assert matrix @ (1 + 0.25, -2 + 0.5, 0 + 0.5, 1) == pytest.approx((0, 0, 0, 1), abs=1e-5)
    assert matrix @ (3 - 0.25, 4 - 0.5, 8 - 0.5, 1) == pytest.approx((3, 5, 7, 1), abs=1e-5)
    assert grids["color"][0].shape == (4, 6, 8, 4) and grids["heat"][0].shape == (2, 3, 4)


@pytest.mark.parametrize("domain", [smoke(cache_frame_start=5), smoke(cache_frame_end=2)])
def test_there_is_no_smoke_before_and_after(domain_object, domain) -> None:
    assert gas_arrays(domain_object, domain, 3, NAMES, SyncReport()) is None


def test_smoke_of_another_resolution(domain_object) -> None:
    report = SyncReport()
    gas_arrays(domain_object, smoke(domain_resolution=(9, 9, 9)), 1, {"density"}, report)
    assert report.warnings == ["Object 'domain': density of the simulation has another resolution, it is left out"]


def test_only_domains_of_gas_are_volumes() -> None:
    def with_modifier(**members: object) -> SimpleNamespace:
        return SimpleNamespace(modifiers=[SimpleNamespace(type="SUBSURF"), SimpleNamespace(type="FLUID", **members)])

    gas, liquid = SimpleNamespace(domain_type="GAS"), SimpleNamespace(domain_type="LIQUID")
    assert gas_domain(with_modifier(fluid_type="DOMAIN", domain_settings=gas)) is gas
    assert gas_domain(with_modifier(fluid_type="DOMAIN", domain_settings=liquid)) is None
    assert gas_domain(with_modifier(fluid_type="FLOW", domain_settings=None)) is None
    assert gas_domain(SimpleNamespace(modifiers=[])) is None
