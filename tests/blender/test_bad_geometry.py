"""Geometry that no scene should have, through Blender to the picture: a message that names the
data-block, or correct output; never a crash, never a black frame without a word. Needs `cistern_core`.
"""

import math

import bpy
import numpy as np
import pytest

from tests.blender.bad_input import HEIGHT, WIDTH, Change, cube, lamp, object_, picture_of
from tests.blender.engine_fakes import fresh_scene

pytestmark = pytest.mark.usefixtures("registered_addon", "built_core")


@pytest.fixture(scope="module")
def good_and_empty(registered_addon, built_core, tmp_path_factory) -> tuple[float, float]:
    """Mean brightness of the factory scene with its cube and without."""
    means = []
    for hidden in (False, True):
        scene = fresh_scene(WIDTH, HEIGHT, samples=16)
        cube().hide_render = hidden
        means.append(float(picture_of(scene, tmp_path_factory.mktemp("good"))[0].mean()))
    assert means[0] > 1.2 * means[1]
    return means[0], means[1]


def move_vertex(value: float) -> Change:
    """Through the attribute: Blender's own `co` clamps infinity."""

    def change(scene: bpy.types.Scene) -> None:
        attribute = cube().data.attributes["position"]
        positions = np.empty(3 * len(attribute.data), np.float32)
        attribute.data.foreach_get("vector", positions)
        positions[9] = value
        attribute.data.foreach_set("vector", positions)

    return change


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e20, 3e38])
def test_a_vertex_at_nowhere_costs_its_triangles(value, good_and_empty, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT, samples=16)
    move_vertex(value)(scene)
    pixels, report = picture_of(scene, tmp_path)
    assert any("'Cube'" in warning and "left out" in warning for warning in report.warnings), report.warnings
    assert good_and_empty[1] < pixels.mean() < good_and_empty[0]  # the other triangles are there


def collapse(scene: bpy.types.Scene) -> None:
    for vertex in cube().data.vertices:
        vertex.co = (0.0, 0.0, 0.0)


def replace_mesh(points: list, edges: list, faces: list) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        cube().data.clear_geometry()
        cube().data.from_pydata(points, edges, faces)

    return change


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(collapse, id="zero area"),
        pytest.param(replace_mesh([], [], []), id="empty"),
        pytest.param(replace_mesh([(0, 0, 0), (1, 0, 0)], [(0, 1)], []), id="loose edge"),
        pytest.param(replace_mesh([(0, 0, 0)], [], []), id="loose vertex"),
        pytest.param(object_(location=(1e20, 0, 0)), id="out of sight"),
    ],
)
def test_meshes_without_area_show_nothing(change: Change, good_and_empty, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT, samples=16)
    change(scene)
    assert picture_of(scene, tmp_path)[0].mean() == pytest.approx(good_and_empty[1], rel=0.05)


@pytest.mark.parametrize("scale", [(0, 0, 0), (1, 0, 0), (1e-39, 1e-39, 1e-39), (1e20, 1e20, 1e20)])
def test_flattened_objects_are_left_out_and_named(scale, good_and_empty, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT, samples=16)
    cube().scale = scale
    pixels, report = picture_of(scene, tmp_path)
    assert any("'Cube'" in warning for warning in report.warnings), report.warnings
    assert pixels.mean() == pytest.approx(good_and_empty[1], rel=0.05)


def test_objects_scaled_to_zero_along_one_axis_stay(good_and_empty, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT, samples=16)
    cube().scale = (1, 1, 0)
    pixels, report = picture_of(scene, tmp_path)
    assert report.warnings == []
    assert good_and_empty[1] < pixels.mean() < good_and_empty[0]


def test_many_flattened_objects_are_one_warning(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    for index in range(8):
        copy = bpy.data.objects.new(f"flat{index}", cube().data)
        copy.scale = (1, 0, 0)
        scene.collection.objects.link(copy)
    _, report = picture_of(scene, tmp_path)
    assert len(report.warnings) == 1 and "'flat0'" in report.warnings[0] and "3 more" in report.warnings[0]


def test_a_mirrored_object_is_lit_like_the_plain_one(good_and_empty, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT, samples=16)
    cube().scale = (-1, 1, 1)
    pixels, report = picture_of(scene, tmp_path)
    assert report.warnings == [] and pixels.mean() == pytest.approx(good_and_empty[0], rel=0.05)


@pytest.mark.parametrize("factor", [1e5, 1e-3, 1e-5])
def test_kilometres_and_micrometres(factor, good_and_empty, tmp_path) -> None:
    """The same picture at every size."""
    scene = fresh_scene(WIDTH, HEIGHT, samples=16)
    for item in scene.objects:
        item.location, item.scale = factor * item.location, factor * item.scale
    lamp().energy *= factor**2
    lamp().shadow_soft_size *= factor
    scene.camera.data.clip_start, scene.camera.data.clip_end = 0.1 * factor, 1000 * factor
    pixels, report = picture_of(scene, tmp_path)
    assert report.warnings == [] and pixels.mean() == pytest.approx(good_and_empty[0], rel=0.05)
