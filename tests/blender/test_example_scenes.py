"""The scenes that examples/ builds: as many lights as asked for, where they belong, saved whole."""

import importlib
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(autouse=True)
def _examples_on_the_path(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES))


def emissive_meshes(scene):
    return [
        thing
        for thing in scene.objects
        if thing.type == "MESH" and any(node.type == "EMISSION" for node in thing.active_material.node_tree.nodes)
    ]


def lamps(scene):
    return [thing for thing in scene.objects if thing.type == "LIGHT"]


@pytest.mark.parametrize("count", [1, 24, 70])
@pytest.mark.parametrize("lights", ["EMISSIVE", "SPHERE"])
@pytest.mark.parametrize("view", ["STREET", "ABOVE"])
def test_city_has_its_lamps_on_the_pavements(count, lights, view):
    import city_grid
    import scene_tools

    scene = scene_tools.empty_scene()
    city_grid.build(scene, count, lights, view)
    heads = emissive_meshes(scene) if lights == "EMISSIVE" else lamps(scene)
    assert (len(heads), len(lamps(scene))) == (count, 0 if lights == "EMISSIVE" else count)
    middles = np.array(city_grid.blocks(count))
    for head in heads:
        away = np.abs(np.array(head.location)[:2] - middles).max(axis=1).min()
        assert 0.5 * city_grid.BLOCK - city_grid.PAVEMENT < away < 0.5 * city_grid.BLOCK
    assert scene.camera is not None and scene.world is None


@pytest.mark.parametrize(("count", "emissive"), [(1, True), (30, False)])
def test_monkeys_have_their_lights_above_the_floor(count, emissive):
    import monkeys
    import scene_tools

    scene = scene_tools.empty_scene()
    monkeys.build(scene, count, emissive)
    heads = emissive_meshes(scene) if emissive else lamps(scene)
    assert len(heads) == count
    for head in heads:
        radius = head.dimensions.z / 2 if emissive else head.data.shadow_soft_size
        assert head.location.z >= radius
    names = {thing.data.name.split()[0] for thing in scene.objects if thing.type == "MESH"}
    assert {"Suzanne", "Ball", "Cone", "Floor"} <= {name.split(".")[0] for name in names}


# Triangles of emissive meshes, lamps, whether there is a world.
LIGHTS = {
    "market": (480 * 64, 0, False),
    "door_ajar": (2, 0, False),
    "glossy_hall": (5 * 2, 4, False),
    "bright_interior": (2 * 2, 0, True),
    "outdoor": (0, 1, True),
    "far_lamp": (144, 0, False),
}


@pytest.mark.parametrize("name", LIGHTS)
def test_benchmark_scenes_have_their_lights(name):
    import scene_tools

    scene = scene_tools.empty_scene()
    importlib.import_module(name).build(scene)
    triangles = sum(len(p.vertices) - 2 for thing in emissive_meshes(scene) for p in thing.data.polygons)
    assert (triangles, len(lamps(scene)), scene.world is not None) == LIGHTS[name]
    assert scene.camera is not None


def test_the_file_is_there_when_it_is_whole(tmp_path):
    import monkeys
    import scene_tools

    monkeys.build(scene_tools.empty_scene(), 2)
    path = tmp_path / "new" / "monkeys.blend"
    scene_tools.save(path)
    assert [entry.name for entry in path.parent.iterdir()] == ["monkeys.blend"]
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert len(lamps(bpy.context.scene)) == 2


@pytest.mark.parametrize("script", ["city_grid", "monkeys"])
def test_bad_numbers_of_lights_are_refused(monkeypatch, capsys, script):
    module = pytest.importorskip(script)
    option = "--lamps" if script == "city_grid" else "--lights"
    monkeypatch.setattr(sys, "argv", [script, option, "0"])
    with pytest.raises(SystemExit):
        module.main()
    assert "0 is not between 1 and 2000" in capsys.readouterr().err
