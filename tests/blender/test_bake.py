"""Baking by itself: which pixels lie where, several images, colours of vertices, and what cannot be baked."""

import gc

import bpy
import numpy as np
import pytest

import addon
from addon.bake_types import ALL_LIGHT, COLOR, DIFFUSE, DIRECT, EMIT, INDIRECT, find_type
from addon.engine import CisternEngine
from tests.support import bake_scenes
from tests.support import blender_scenes as build
from tests.support.bake_scenes import BakeScene

pytestmark = pytest.mark.usefixtures("registered_addon")


@pytest.fixture
def scene(empty_scene):
    return BakeScene(empty_scene)


def covers(outline: list[tuple[float, float]], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Whether points lie inside, by how often a ray to the right crosses the outline."""
    is_inside = np.zeros(len(x), bool)
    for (x0, y0), (x1, y1) in zip(outline, outline[1:] + outline[:1], strict=True):
        if y0 != y1:
            is_inside ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return is_inside


def test_polygons_of_any_size_lie_where_their_map_says(scene):
    """A quad, a concave one and a pentagon, each of which is split into triangles in its own way."""
    outlines = [
        [(0, 0), (1, 0), (1, 1), (0, 1)],
        [(2, 0), (3, 0.9), (3.1, 0), (3, 1.9)],
        [(4, 0), (5, 0), (5.4, 0.8), (4.5, 1.6), (3.7, 0.9)],
    ]
    points = [point for outline in outlines for point in outline]
    corners = iter(range(len(points)))
    polygons = [[next(corners) for _ in outline] for outline in outlines]
    sheet = build.add_mesh(
        scene.scene, "sheet", [(x, y, 0.3 * x) for x, y in points], polygons, bpy.data.materials.new("sheet")
    )
    sheet.data.materials[0].use_nodes = True
    image = bake_scenes.add_target(sheet.data.materials[0])
    layer = sheet.data.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", (np.array(points, np.float32) / 6.0).ravel())
    scene.head = sheet
    baked = scene.bake("CISTERN", "POSITION", 16, image=image)
    rows, columns = np.nonzero(baked[..., 3])
    assert len(rows) > 250
    x, y = 6.0 * (columns + 0.5) / bake_scenes.SIZE, 6.0 * (rows + 0.5) / bake_scenes.SIZE
    # Blender 5.3 also bakes pixels whose middle is outside.
    inside = np.any([covers(outline, x, y) for outline in outlines], axis=0)
    assert inside.sum() > 250
    difference = np.abs(baked[rows, columns, :3] - np.stack([x, y, 0.3 * x], axis=1)).max(axis=1)[inside]
    pixel = 6.0 / bake_scenes.SIZE
    assert np.quantile(difference, 0.7) < 0.05 * pixel
    assert difference.max() < 1.5 * pixel  # at edges, samples beyond the triangle are brought onto it


def test_each_material_has_an_image(scene):
    second = build.principled("second", Emission_Color=(0.0, 1.0, 0.0, 1.0), Emission_Strength=2.0)
    other = bake_scenes.add_target(second)
    scene.head.data.materials.append(second)
    polygons = scene.head.data.polygons
    polygons.foreach_set("material_index", np.arange(len(polygons)) % 2)
    first = scene.bake("CISTERN", "EMIT")
    np.testing.assert_allclose(bake_scenes.pixels_of(other)[..., :3].max(axis=(0, 1)), (0.0, 2.0, 0.0))
    np.testing.assert_allclose(first[..., :3].max(axis=(0, 1)), (0.06, 0.15, 0.3), rtol=1e-3)


def test_colours_of_vertices(scene):
    colors = scene.head.data.color_attributes.new("Baked", "FLOAT_COLOR", "CORNER")
    scene.bake("CISTERN", "EMIT", target="VERTEX_COLORS")
    values = np.empty((len(colors.data), 4), np.float32)
    colors.data.foreach_get("color", values.ravel())
    np.testing.assert_allclose(values[:, :3], np.tile((0.06, 0.15, 0.3), (len(values), 1)), rtol=1e-3)


def test_colours_of_vertices_of_a_mesh_in_edit_mode(scene):
    scene.head.data.color_attributes.new("Baked", "FLOAT_COLOR", "POINT")
    bpy.context.view_layer.objects.active = scene.head
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        scene.bake("CISTERN", "EMIT", target="VERTEX_COLORS")
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    values = np.array([item.color[:3] for item in scene.head.data.color_attributes["Baked"].data])
    np.testing.assert_allclose(values, np.tile((0.06, 0.15, 0.3), (len(values), 1)), rtol=1e-3)


def test_no_camera_is_needed_from_above(scene):
    bpy.data.objects.remove(scene.scene.camera)
    assert scene.bake("CISTERN", "DIFFUSE")[..., :3].max() > 0.1
    scene.scene.render.bake.view_from = "ACTIVE_CAMERA"
    with pytest.raises(RuntimeError, match="Scene 'Scene' has no camera to bake from"):
        scene.bake("CISTERN", "DIFFUSE")


def test_what_cannot_be_baked_is_named(scene):
    for bake_type in ("SHADOW", "ENVIRONMENT"):
        with pytest.raises(RuntimeError, match=f"Object 'Suzanne': there is no bake of type {bake_type.title()}"):
            scene.bake("CISTERN", bake_type)


def test_bad_geometry_bakes_black(scene):
    scene.head.data.vertices[0].co = (np.nan, 0.0, 0.0)
    assert np.isfinite(scene.bake("CISTERN", "DIFFUSE")).all()
    assert addon.report.last_report().error is None


def test_stopped_bakes_are_what_there_is(scene, monkeypatch):
    started = []

    def is_stop_wanted(engine):
        started.append(engine)
        return len(started) > 20  # looks: well into the samples

    monkeypatch.setattr(CisternEngine, "is_stop_wanted", is_stop_wanted)
    baked = scene.bake("CISTERN", "COMBINED", samples=1_000_000)
    assert 0 < addon.report.last_report().samples < 1_000_000
    assert baked[..., :3].max() > 0.1


def test_transparency_is_alpha_and_nothing_shows_through(scene):
    scene.material.node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.25
    for bake_type in ("COMBINED", "EMIT", "ROUGHNESS"):
        baked = scene.bake("CISTERN", bake_type, 64)
        shown = baked[..., 3] > 0.0
        np.testing.assert_allclose(baked[shown][:, 3], 0.25, atol=1e-5)
        if bake_type == "EMIT":
            np.testing.assert_allclose(baked[shown][:, 2], 0.25 * 0.3, rtol=1e-3)
        if bake_type == "ROUGHNESS":
            np.testing.assert_allclose(baked[shown][:, 0], 0.35, rtol=1e-3)


@pytest.mark.parametrize("kind", ["COMBINED", "DIFFUSE", "EMIT", "ROUGHNESS"])
def test_pixels_that_show_nothing_are_transparent(scene, kind):
    """So images can be laid over each other."""
    for corner in scene.head.data.uv_layers.active.data:
        corner.uv = 0.5 * corner.uv
    image = bpy.data.images.new("clear", 64, 64, alpha=True, float_buffer=True)
    image.generated_color = (0.0, 0.0, 0.0, 0.0)
    scene.material.node_tree.nodes.active.image = image
    scene.scene.render.engine = "CISTERN"
    bake_scenes.select(scene.head)
    bpy.ops.object.bake(type=kind, margin=0)
    alpha = bake_scenes.pixels_of(image)[..., 3]
    assert alpha.min() == 0.0 and alpha.max() == 1.0
    assert 0.5 < (alpha == 0.0).mean() < 1.0


def test_no_light_comes_through_the_seams_of_a_room(scene):
    """Colours of vertices lie exactly where its walls meet, pixels of its image at their edges."""
    bpy.ops.mesh.primitive_cube_add(size=4.0, location=(20.0, 3.0, 1.0), rotation=(0.2, 0.1, 0.3))
    room = bpy.context.object
    room.data.flip_normals()
    room.data.materials.append(build.principled("wall"))
    image = bake_scenes.add_target(room.data.materials[0])
    room.data.color_attributes.new("Baked", "FLOAT_COLOR", "CORNER")
    scene.head = room
    assert scene.bake("CISTERN", "COMBINED", image=image)[..., :3].max() == 0.0
    scene.bake("CISTERN", "COMBINED", target="VERTEX_COLORS")
    values = np.empty((len(room.data.loops), 4), np.float32)
    room.data.color_attributes[0].data.foreach_get("color", values.ravel())
    assert values[:, :3].max() == 0.0


def test_text_is_baked_to_a_plane(scene):
    bpy.ops.object.text_add(location=(20.0, 0.0, 1.0))
    text = bpy.context.object
    text.data.materials.append(build.principled("ink", Emission_Color=(1.0, 0.0, 0.0, 1.0), Emission_Strength=1.0))
    bpy.ops.mesh.primitive_plane_add(size=4.0, location=(20.5, 0.2, 0.9))
    plane = bpy.context.object
    plane.data.materials.append(build.principled("paper"))
    image = bake_scenes.add_target(plane.data.materials[0])
    bake_scenes.select(plane, text)
    baked = scene.bake("CISTERN", "EMIT", image=image, use_selected_to_active=True, cage_extrusion=1.0)
    is_ink = np.isclose(baked[..., 0], 1.0)
    assert 20 < is_ink.sum() < 1000


def test_window_coordinates_are_those_of_the_camera(scene):
    tree = scene.material.node_tree
    window = tree.nodes.new("ShaderNodeTexCoord").outputs["Window"]
    tree.links.new(window, tree.nodes["Principled BSDF"].inputs["Emission Color"])
    tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 1.0
    ours, theirs = scene.bake("CISTERN", "EMIT", 64), scene.bake("CYCLES", "EMIT", 64)
    assert np.quantile(np.abs(ours - theirs)[..., :2], 0.99) < 0.02
    assert theirs[..., 0].max() > 0.3


def test_threads_do_not_matter(scene):
    render = scene.scene.render
    scene.scene.cistern.preset = "FINAL"
    bakes = []
    for render.threads_mode, render.threads in (("FIXED", 1), ("FIXED", 3)):
        bakes.append(scene.bake("CISTERN", "COMBINED"))
    np.testing.assert_array_equal(*bakes)


def test_sum_of_parts():
    pictures = {
        "Diffuse Direct": 1.0,
        "Diffuse Indirect": 2.0,
        "Diffuse Color": 0.5,
        "Unscattered Emission": 10.0,
        "Combined": 7.0,
    }

    def read(name: str) -> np.ndarray:
        return np.full((1, 1, 4 if name == "Combined" else 3), pictures[name], np.float32)

    def baked(identifier: str, pass_filter: int) -> float:
        bake_type = find_type(identifier, pass_filter)
        assert set(bake_type.core_passes) <= pictures.keys()
        return float(bake_type.color(read)[0, 0, 0])

    assert baked("DIFFUSE", COLOR) == 0.5
    assert baked("DIFFUSE", DIRECT) == 1.0
    assert baked("DIFFUSE", DIRECT | INDIRECT | COLOR) == 1.5
    assert baked("COMBINED", ALL_LIGHT) == 7.0
    assert baked("COMBINED", EMIT) == 10.0
    assert baked("COMBINED", EMIT | DIFFUSE | DIRECT) == 10.5
    assert baked("COMBINED", EMIT | DIFFUSE) == 10.0
    assert baked("EMIT", 0) == 10.0


def test_what_was_exported_goes_with_the_bake(scene):
    """At once, not when Python next looks for cycles: it is as large as the scene."""
    gc.collect()
    gc.disable()
    try:
        scene.bake("CISTERN", "EMIT")
        assert not [thing for thing in gc.get_objects() if type(thing).__name__ in ("SceneSync", "ExportedObject")]
    finally:
        gc.enable()
