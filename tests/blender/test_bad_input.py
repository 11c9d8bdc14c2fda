"""Input that no scene should have, through Blender to the picture: a message that names the data-block, or correct
output; never a crash, never a black frame without a word. Needs `cistern_core`.
"""

import math
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

import addon
from tests.blender.engine_fakes import fresh_scene, render

pytestmark = pytest.mark.usefixtures("registered_addon", "built_core")

Change = Callable[[bpy.types.Scene], object]
WIDTH, HEIGHT = 24, 16


@pytest.fixture(scope="module")
def built_core():
    import cistern_core

    return cistern_core


def cube() -> bpy.types.Object:
    return bpy.data.objects["Cube"]


def lamp() -> bpy.types.Light:
    return bpy.data.objects["Light"].data


def tree() -> bpy.types.NodeTree:
    return cube().material_slots[0].material.node_tree


def surface() -> bpy.types.Node:
    return tree().nodes["Principled BSDF"]


def set_members(target: Callable[[bpy.types.Scene], object], **members: object) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        for name, value in members.items():
            setattr(target(scene), name, value)

    return change


def object_(**members: object) -> Change:
    return set_members(lambda scene: cube(), **members)


def light(kind: str = "POINT", **members: object) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        lamp().type = kind
        set_members(lambda _: lamp(), **members)(scene)

    return change


def camera(**members: object) -> Change:
    return set_members(lambda scene: scene.camera.data, **members)


def lens(**members: object) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        scene.camera.data.dof.use_dof = True
        set_members(lambda _: scene.camera.data.dof, **members)(scene)

    return change


def picture_of(scene: bpy.types.Scene, folder: Path) -> tuple[np.ndarray, addon.report.RenderReport]:
    """Combined RGB of a render that must succeed with finite pixels."""
    channels, [report] = render(scene, folder)
    assert report.error is None
    pixels = np.stack([channels[f"ViewLayer.Combined.{c}"] for c in "RGB"], -1)
    assert np.isfinite(pixels).all()
    return pixels, report


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


# --- geometry -------------------------------------------------------------------------------------------------------


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


@pytest.mark.parametrize("scale", [(0, 0, 0), (1, 1, 0), (1e-39, 1e-39, 1e-39), (1e20, 1e20, 1e20)])
def test_flattened_objects_are_left_out_and_named(scale, good_and_empty, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT, samples=16)
    cube().scale = scale
    pixels, report = picture_of(scene, tmp_path)
    assert any("'Cube'" in warning for warning in report.warnings), report.warnings
    assert pixels.mean() == pytest.approx(good_and_empty[1], rel=0.05)


def test_many_flattened_objects_are_one_warning(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    for index in range(8):
        copy = bpy.data.objects.new(f"flat{index}", cube().data)
        copy.scale = (1, 0, 1)
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


# --- what cannot be rendered: one sentence that names the data-block --------------------------------------------------

FAILURES = {
    "matrix nan": (object_(location=(math.nan, 0, 0)), "Cube"),
    "camera matrix nan": (set_members(lambda s: s.camera, location=(math.nan, 0, 0)), "Camera"),
    "camera scale 0": (set_members(lambda s: s.camera, scale=(0, 0, 0)), "Camera"),
    "clip": (camera(clip_start=100.0, clip_end=1.0), "Camera: clip end"),
    "clip nan": (camera(clip_start=math.nan), "Camera: clip start"),
    "focal length nan": (camera(lens=math.nan), "Camera"),
    "sensor nan": (camera(sensor_width=math.nan), "Camera"),
    "shift nan": (camera(shift_x=math.nan), "Camera"),
    "shift far": (camera(shift_x=1e10), "Camera"),
    "ortho scale 0": (camera(type="ORTHO", ortho_scale=0.0), "Camera"),
    "focus nan": (lens(focus_distance=math.nan), "Camera: focus distance"),
    "aperture nan": (lens(aperture_fstop=math.nan), "Camera: aperture radius"),
    "blades nan": (lens(aperture_rotation=math.nan), "Camera: blade rotation"),
    "ratio nan": (lens(aperture_ratio=math.nan), "Camera: aperture ratio"),
    "point nan": (light(energy=math.nan), "Light: energy"),
    "point inf": (light(energy=math.inf), "Light: energy"),
    "sun nan": (light("SUN", energy=math.nan), "Light: energy"),
    "spot nan": (light("SPOT", energy=math.nan), "Light: energy"),
    "area nan": (light("AREA", energy=math.nan), "Light: energy"),
    "area size nan": (light("AREA", size=math.nan), "Light"),
    "radius nan": (light(shadow_soft_size=math.nan), "Light: radius"),
    "color nan": (light(color=(math.nan, 1, 1)), "Light: energy"),
    "sun angle nan": (light("SUN", angle=math.nan), "Light: angle"),
    "light nowhere": (set_members(lambda s: bpy.data.objects["Light"], location=(math.nan, 0, 0)), "Light: position"),
    "camera is a mesh": (lambda scene: setattr(scene, "camera", cube()), "Scene 'Scene' has no camera"),
}


@pytest.mark.parametrize("name", FAILURES)
def test_what_cannot_be_rendered_is_named(name, tmp_path) -> None:
    change, message = FAILURES[name]
    scene = fresh_scene(WIDTH, HEIGHT)
    change(scene)
    scene.render.filepath = str(tmp_path / "failed.exr")
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.render.render(write_still=True)
    assert message in addon.report.last_report().error


def test_an_index_out_of_range_is_named(tmp_path) -> None:
    fresh_scene(WIDTH, HEIGHT)
    cube().data.attributes[".corner_vert"].data[0].value = 1000
    with pytest.raises(RuntimeError, match="Cube: vertex of corner 0 is 1000"):
        bpy.ops.render.render()


def test_no_camera_is_refused_by_blender(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    scene.camera = None
    with pytest.raises(RuntimeError, match="camera"):
        bpy.ops.render.render()


# --- what is odd but has a picture ----------------------------------------------------------------------------------


def flat_lamp(kind: str) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        light(kind)(scene)
        bpy.data.objects["Light"].scale = (0, 0, 0)

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(light("AREA", size=0.0), "Light", id="area without size"),
        pytest.param(flat_lamp("AREA"), "Light", id="area scaled to 0"),
        pytest.param(flat_lamp("SPOT"), "Light", id="spot scaled to 0"),
        pytest.param(light(energy=3e38), "not finite", id="energy beyond range"),
        pytest.param(
            lambda scene: setattr(surface().inputs["Emission Strength"], "default_value", math.inf),
            "not finite",
            id="emission beyond range",
        ),
        pytest.param(camera(type="PANO"), "Camera", id="panorama"),
    ],
)
def test_odd_things_are_rendered_with_a_warning(change: Change, message: str, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    change(scene)
    pixels, report = picture_of(scene, tmp_path)
    assert any(message in warning for warning in report.warnings), report.warnings
    assert pixels.max() > 0.0


def material_index_of_no_slot(scene: bpy.types.Scene) -> None:
    for polygon in cube().data.polygons:
        polygon.material_index = 500


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(flat_lamp("POINT"), id="point scaled to 0"),
        pytest.param(flat_lamp("SUN"), id="sun scaled to 0"),
        pytest.param(light("SPOT", spot_size=0.0), id="spot of no cone"),
        pytest.param(light(energy=-10.0), id="negative light"),
        pytest.param(camera(lens=0.0), id="lens clamped by Blender"),
        pytest.param(camera(clip_end=math.inf), id="endless clip"),
        pytest.param(lens(focus_distance=0.0), id="focus at the lens"),
        pytest.param(lens(aperture_fstop=0.0), id="f-stop 0"),
        pytest.param(lambda scene: cube().data.materials.clear(), id="no slots"),
        pytest.param(lambda scene: cube().data.materials.__setitem__(0, None), id="empty slot"),
        pytest.param(material_index_of_no_slot, id="index of no slot"),
        pytest.param(lambda scene: tree().nodes.clear(), id="no output node"),
        pytest.param(lambda scene: setattr(surface().inputs["IOR"], "default_value", 0.0), id="index of refraction 0"),
        pytest.param(lambda scene: setattr(surface().inputs["Roughness"], "default_value", math.nan), id="nan input"),
    ],
)
def test_odd_things_are_rendered(change: Change, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    change(scene)
    pixels, report = picture_of(scene, tmp_path)
    assert report.warnings == [] and pixels.max() > 0.0


# --- black pictures -------------------------------------------------------------------------------------------------


def remove_light(scene: bpy.types.Scene) -> None:
    bpy.data.objects.remove(bpy.data.objects["Light"])
    scene.world = None


def hide_light(scene: bpy.types.Scene) -> None:
    bpy.data.objects["Light"].hide_render = True
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 0.0


@pytest.mark.parametrize("change", [remove_light, hide_light])
def test_no_light_is_black_and_said(change: Change, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    change(scene)
    pixels, report = picture_of(scene, tmp_path)
    assert pixels.max() == 0.0
    assert any("Scene 'Scene'" in warning and "black" in warning for warning in report.warnings)


# --- images ---------------------------------------------------------------------------------------------------------


def show(image: bpy.types.Image | None) -> None:
    """As the colour of the cube, glowing: its own colour reaches the picture."""
    node = tree().nodes.new("ShaderNodeTexImage")
    node.image = image
    surface().inputs["Emission Strength"].default_value = 1.0
    for name in ("Base Color", "Emission Color"):
        tree().links.new(node.outputs["Color"], surface().inputs[name])


def image_file(path: Path, source: str = "FILE") -> bpy.types.Image:
    image = bpy.data.images.new("Wanted", 4, 4)
    image.source, image.filepath = source, str(path)
    return image


def broken_file(folder: Path, content: bytes) -> Path:
    path = folder / "broken.png"
    path.write_bytes(content)
    return path


BROKEN_IMAGES = {
    "missing": lambda folder: image_file(folder / "nowhere.png"),
    "empty file": lambda folder: image_file(broken_file(folder, b"")),
    "no image": lambda folder: image_file(broken_file(folder, b"this is not a picture")),
    "a folder": lambda folder: image_file(folder),
    "missing sequence": lambda folder: image_file(folder / "nowhere001.png", "SEQUENCE"),
    "missing movie": lambda folder: image_file(folder / "nowhere.mp4", "MOVIE"),
}


@pytest.mark.parametrize("name", BROKEN_IMAGES)
def test_an_unreadable_image_is_magenta_and_named(name, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    show(BROKEN_IMAGES[name](tmp_path))
    pixels, report = picture_of(scene, tmp_path)
    assert any("'Wanted'" in warning and "magenta" in warning for warning in report.warnings), report.warnings
    red, green, blue = pixels[HEIGHT // 2, WIDTH // 2]
    assert red > 0.9 and blue > 0.9 and green < 0.2


def test_a_missing_sky_is_magenta_and_named(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    nodes = scene.world.node_tree.nodes
    node = nodes.new("ShaderNodeTexEnvironment")
    node.image = image_file(tmp_path / "nowhere.hdr")
    background = next(n for n in nodes if n.type == "BACKGROUND")
    scene.world.node_tree.links.new(node.outputs[0], background.inputs[0])
    pixels, report = picture_of(scene, tmp_path)
    assert any("'Wanted'" in warning for warning in report.warnings)
    assert pixels[0, 0, 0] > 0.9 and pixels[0, 0, 1] < 0.1


@pytest.mark.parametrize("value", [math.nan, math.inf, -5.0])
def test_a_bad_pixel_in_the_sky_spoils_no_other(value, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    image = bpy.data.images.new("sky", 16, 8, float_buffer=True)
    pixels = np.ones((8, 16, 4), np.float32)
    pixels[6, 3, :3] = value
    image.pixels.foreach_set(pixels.ravel())
    nodes = scene.world.node_tree.nodes
    node = nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    background = next(n for n in nodes if n.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 1.0
    scene.world.node_tree.links.new(node.outputs[0], background.inputs[0])
    rendered, _ = picture_of(scene, tmp_path)
    assert rendered.mean() > 0.5


def test_an_image_of_no_size_is_magenta(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    picture_of(scene, tmp_path)
    image = bpy.data.images["Render Result"]
    show(image)
    assert tuple(image.size) == (0, 0)
    _, report = picture_of(scene, tmp_path)
    assert any("'Render Result'" in warning for warning in report.warnings)


# --- node trees -----------------------------------------------------------------------------------------------------


def links_in_a_circle(kind: str) -> Change:
    def change(scene: bpy.types.Scene) -> None:
        first, second = tree().nodes.new(kind), tree().nodes.new(kind)
        tree().links.new(first.outputs[0], second.inputs[0])
        tree().links.new(second.outputs[0], first.inputs[0])
        tree().links.new(second.outputs[0], surface().inputs["Roughness"])

    return change


@pytest.mark.parametrize("kind", ["ShaderNodeMath", "NodeReroute", "ShaderNodeMix"])
def test_links_in_a_circle(kind, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    links_in_a_circle(kind)(scene)
    assert picture_of(scene, tmp_path)[0].max() > 0.0


def test_a_group_in_itself(tmp_path) -> None:
    """Blender refuses the assignment, which leaves a group without a tree inside; that one must be harmless."""
    scene = fresh_scene(WIDTH, HEIGHT)
    outer = bpy.data.node_groups.new("Outer", "ShaderNodeTree")
    outer.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    inner = outer.nodes.new("ShaderNodeGroup")
    inner.node_tree = outer
    output = outer.nodes.new("NodeGroupOutput")
    if inner.outputs:
        outer.links.new(inner.outputs[0], output.inputs[0])
    group = tree().nodes.new("ShaderNodeGroup")
    group.node_tree = outer
    tree().links.new(group.outputs[0], surface().inputs["Base Color"])
    assert picture_of(scene, tmp_path)[0].max() > 0.0


def test_three_hundred_nodes(tmp_path) -> None:
    """Too many for the core's registers: said, and grey."""
    scene = fresh_scene(WIDTH, HEIGHT)
    value = tree().nodes.new("ShaderNodeTexNoise").outputs[0]
    for _ in range(300):
        node = tree().nodes.new("ShaderNodeMath")
        tree().links.new(value, node.inputs[0])
        value = node.outputs[0]
    tree().links.new(value, surface().inputs["Roughness"])
    pixels, report = picture_of(scene, tmp_path)
    assert any("Material 'Material'" in warning for warning in report.warnings) and pixels.max() > 0.0


def test_forty_closures(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    value = surface().outputs[0]
    for index in range(40):
        mix, glossy = tree().nodes.new("ShaderNodeMixShader"), tree().nodes.new("ShaderNodeBsdfGlossy")
        glossy.inputs["Roughness"].default_value = index / 40
        tree().links.new(value, mix.inputs[1])
        tree().links.new(glossy.outputs[0], mix.inputs[2])
        value = mix.outputs[0]
    output = next(node for node in tree().nodes if node.type == "OUTPUT_MATERIAL")
    tree().links.new(value, output.inputs["Surface"])
    assert picture_of(scene, tmp_path)[0].max() > 0.0


@pytest.mark.parametrize("kind", ["ShaderNodeBsdfToon", "ShaderNodeBsdfHairPrincipled", "ShaderNodeWireframe"])
def test_unsupported_nodes_are_named(kind, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    node = tree().nodes.new(kind)
    output = next(n for n in tree().nodes if n.type == "OUTPUT_MATERIAL")
    target = output.inputs["Surface"] if node.outputs[0].type == "SHADER" else surface().inputs["Roughness"]
    tree().links.new(node.outputs[0], target)
    pixels, report = picture_of(scene, tmp_path)
    assert any("Material 'Material'" in w and node.bl_label in w for w in report.warnings)
    assert pixels.max() > 0.0


# --- pictures -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("width", "height"), [(1, 1), (8192, 1), (1, 4096)])
def test_extreme_sizes(width, height, tmp_path) -> None:
    """Blender itself makes no side smaller than 4 pixels, save by its percentage or border: see test_engine_core."""
    scene = fresh_scene(width, height, samples=1)
    pixels, _ = picture_of(scene, tmp_path)
    assert pixels.shape[:2] == (max(height, 4), max(width, 4))
    assert pixels.max() > 0.0


@pytest.mark.parametrize("is_cropped", [True, False])
def test_a_border_of_one_pixel(is_cropped, tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    border = scene.render
    border.use_border, border.use_crop_to_border = True, is_cropped
    border.border_min_x, border.border_max_x = 0.5, 0.5 + 1.01 / WIDTH
    border.border_min_y, border.border_max_y = 0.5, 0.5 + 1.01 / HEIGHT
    pixels, _ = picture_of(scene, tmp_path)
    assert pixels.shape[:2] == ((1, 1) if is_cropped else (HEIGHT, WIDTH))
    assert np.count_nonzero(pixels.max(axis=2)) == 1


def test_a_border_of_nothing_is_refused_by_blender(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    scene.render.use_border = True
    scene.render.border_min_x = scene.render.border_max_x = 0.5
    with pytest.raises(RuntimeError, match="small"):
        bpy.ops.render.render()


def test_zero_samples_are_one(tmp_path) -> None:
    scene = fresh_scene(WIDTH, HEIGHT)
    scene.cistern.samples = 0
    _, report = picture_of(scene, tmp_path)
    assert report.samples == 1
