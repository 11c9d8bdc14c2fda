"""Adaptive subdivision against Cycles; method as in test_against_cycles_lights.

Both cut what lies near the limit surface of Catmull and Clark, along other edges: quarters of pixels leave no
difference that is seen here, but where a floor says so.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest
from test_against_cycles_displacement import Nodes, along_normal, diffuse
from test_against_cycles_true_displacement import displaced_material, grid

import addon
from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles, prepare, render
from tests.support.slow_cases import marked

pytestmark = pytest.mark.usefixtures("registered_addon")
needs_object_space = pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="new in Blender 5.0")
needs_cycles_4_5 = pytest.mark.skipif(
    bpy.app.version < (4, 5, 0), reason="Cycles 4.2 has no creases or corners, other attributes, no blur of shapes"
)

# Blocks of coordinates shown as light, which has no noise: near points where other than four quads meet Cycles follows
# the limit of point attributes less closely (0.3 % of the mean), and up to where creases are sharp (1.4 %).
FLOOR_OF_ATTRIBUTES, FLOOR_OF_CREASES = 0.004, 0.02


def subdivided(obj: bpy.types.Object, pixels: float = 0.25, **settings: object) -> bpy.types.Object:
    """By a last modifier that does so adaptively."""
    modifier = obj.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 0
    if hasattr(modifier, "use_adaptive_subdivision"):
        modifier.use_adaptive_subdivision, modifier.adaptive_pixel_size = True, pixels
    else:
        bpy.context.scene.cycles.feature_set = "EXPERIMENTAL"
        obj.cycles.use_adaptive_subdivision, obj.cycles.dicing_rate = True, pixels
    for name, value in settings.items():
        setattr(modifier, name, value)
    return obj


def is_adaptive(obj: bpy.types.Object, is_on: bool) -> None:
    modifier = obj.modifiers[-1]
    owner = modifier if hasattr(modifier, "use_adaptive_subdivision") else obj.cycles
    owner.use_adaptive_subdivision = is_on


def solid(
    scene: bpy.types.Scene, material: bpy.types.Material, polygons: str = "cube", smooth: bool = True
) -> bpy.types.Object:
    """In place of the stage's sphere."""
    build.stage(scene, build.principled())
    bpy.data.objects.remove(scene.objects["sphere"])
    if polygons == "cube":
        points = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
        faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    else:  # pentagons, triangles and quads
        profile = [(-1, -1), (1, -1), (1, 0.5), (0, 1.3), (-1, 0.5)]
        points = [(x, y, z) for y in (-1, 1) for x, z in profile]
        faces = [(0, 1, 2, 3, 4), (9, 8, 7, 6, 5), (0, 5, 6, 1), (1, 6, 7, 2), (4, 3, 8, 9), (0, 4, 9, 5)]
        faces += [(2, 7, 3), (3, 7, 8)]
    result = build.add_mesh(scene, polygons, points, faces, material, smooth)
    result.location, result.rotation_euler = (0.0, 0.0, 1.0), (0.5, 0.3, 0.2)
    return result


def shown(coordinates: str) -> Callable[[Nodes], bpy.types.NodeSocket]:
    def build_nodes(tree: Nodes) -> bpy.types.NodeSocket:
        color = tree.nodes.new("ShaderNodeTexCoord").outputs[coordinates]
        return build.shader(tree, "ShaderNodeEmission", Color=color).outputs[0]

    return build_nodes


def shown_attribute(tree: Nodes) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = "shown"
    return build.shader(tree, "ShaderNodeEmission", Color=node.outputs["Color"]).outputs[0]


def agrees(scene: bpy.types.Scene, plant: Callable[[], None], floor: float = 0.0) -> None:
    """With Cycles, but not once a bug is planted."""
    result = compare_with_cycles(scene, floor=floor)
    assert result.agrees, result
    planted = compare_with_cycles(scene, floor=floor, plant=lambda _: plant())
    assert not planted.agrees, planted


@pytest.mark.parametrize("polygons", ["cube", "house"])
def test_solids_become_smooth(empty_scene: bpy.types.Scene, polygons: str) -> None:
    obj = subdivided(solid(empty_scene, build.material("grey", diffuse), polygons))
    agrees(empty_scene, lambda: is_adaptive(obj, False))


def test_levels(empty_scene: bpy.types.Scene) -> None:
    """Before Blender 4.5 the modifier's own come first; later they are for other engines."""
    obj = subdivided(solid(empty_scene, build.material("grey", diffuse), "house"), levels=2, render_levels=1)
    agrees(empty_scene, lambda: is_adaptive(obj, False))


@needs_cycles_4_5
@pytest.mark.parametrize("crease", marked([0.3, 0.6, 1.0], {0.3, 0.6}))
def test_creases(empty_scene: bpy.types.Scene, crease: float) -> None:
    obj = subdivided(solid(empty_scene, build.material("grey", diffuse)))
    values = obj.data.attributes.new("crease_edge", "FLOAT", "EDGE")
    values.data.foreach_set("value", np.where(np.arange(12) % 3 == 0, crease, 0.0).astype(np.float32))
    floor = FLOOR_OF_CREASES if crease < 1.0 else 0.0
    agrees(empty_scene, lambda: setattr(obj.modifiers[-1], "use_creases", False), floor)


@needs_cycles_4_5
def test_sharp_points(empty_scene: bpy.types.Scene) -> None:
    obj = subdivided(solid(empty_scene, build.material("grey", diffuse)))
    values = obj.data.attributes.new("crease_vert", "FLOAT", "POINT")
    values.data.foreach_set("value", (np.arange(8) % 3 == 0).astype(np.float32))
    agrees(empty_scene, lambda: setattr(obj.modifiers[-1], "use_creases", False))


@needs_cycles_4_5
@pytest.mark.parametrize("boundary", marked(["PRESERVE_CORNERS", "ALL"], {"ALL"}))
def test_boundaries(empty_scene: bpy.types.Scene, boundary: str) -> None:
    obj = subdivided(grid(empty_scene, build.material("grey", diffuse), count=1), boundary_smooth=boundary)
    other = "ALL" if boundary == "PRESERVE_CORNERS" else "PRESERVE_CORNERS"
    agrees(empty_scene, lambda: setattr(obj.modifiers[-1], "boundary_smooth", other))


@pytest.mark.parametrize("scheme", ["CATMULL_CLARK", "SIMPLE"])
def test_displacement(empty_scene: bpy.types.Scene, scheme: str) -> None:
    material = displaced_material("moved", along_normal("OBJECT", 0.6), diffuse, "DISPLACEMENT")
    obj = subdivided(grid(empty_scene, material, count=2), pixels=0.1, subdivision_type=scheme)
    agrees(empty_scene, lambda: is_adaptive(obj, False))


@needs_cycles_4_5
@pytest.mark.parametrize("smoothing", marked(["NONE", "PRESERVE_BOUNDARIES", "SMOOTH_ALL"], {"NONE"}))
def test_uv_maps(empty_scene: bpy.types.Scene, smoothing: str) -> None:
    obj = subdivided(grid(empty_scene, build.material("uv", shown("UV")), count=2), uv_smooth=smoothing)
    layer = obj.data.uv_layers[0].data
    uv = np.empty(2 * len(layer), np.float32)
    layer.foreach_get("uv", uv)
    layer.foreach_set("uv", uv**3)
    other = "SMOOTH_ALL" if smoothing == "NONE" else "NONE"
    agrees(empty_scene, lambda: setattr(obj.modifiers[-1], "uv_smooth", other), FLOOR_OF_ATTRIBUTES)


def test_generated_coordinates(empty_scene: bpy.types.Scene) -> None:
    obj = subdivided(solid(empty_scene, build.material("generated", shown("Generated"))))

    def widen() -> None:
        obj.data.use_auto_texspace, obj.data.texspace_size = False, (1.1, 1.1, 1.1)

    agrees(empty_scene, widen, FLOOR_OF_ATTRIBUTES)


@needs_cycles_4_5
@pytest.mark.parametrize("domain", marked(["POINT", "CORNER", "FACE"], {"FACE"}))
def test_attributes(empty_scene: bpy.types.Scene, domain: str) -> None:
    obj = solid(empty_scene, build.material("attribute", shown_attribute), "house")
    values = obj.data.attributes.new("shown", "FLOAT_COLOR", domain)

    def fill(seed: int) -> None:
        colors = np.random.default_rng(seed).uniform(0.2, 1.0, 4 * len(values.data))
        values.data.foreach_set("color", colors.astype(np.float32))
        obj.data.update()

    fill(1)
    subdivided(obj)
    agrees(empty_scene, lambda: fill(2), FLOOR_OF_ATTRIBUTES)


@needs_cycles_4_5
def test_byte_colours_of_corners(empty_scene: bpy.types.Scene) -> None:
    """They are blended as they are encoded, unlike all others."""
    obj = subdivided(solid(empty_scene, build.material("shown", shown_attribute)))
    layer = obj.data.color_attributes.new("shown", "BYTE_COLOR", "CORNER")

    def fill(seed: int) -> None:
        on = np.random.default_rng(seed).integers(0, 2, (len(layer.data), 4))
        layer.data.foreach_set("color", on.astype(np.float32).ravel())
        obj.data.update_tag()

    fill(1)
    agrees(empty_scene, lambda: fill(2), FLOOR_OF_ATTRIBUTES)


def test_several_materials(empty_scene: bpy.types.Scene) -> None:
    obj = subdivided(solid(empty_scene, build.material("grey", diffuse), "house"))
    obj.data.materials.append(build.principled("red", Base_Color=(0.8, 0.1, 0.1, 1.0)))
    obj.data.polygons.foreach_set("material_index", np.arange(8, dtype=np.int32) % 2)
    agrees(empty_scene, lambda: obj.data.materials.pop())


@needs_object_space
def test_lengths_in_object_space(empty_scene: bpy.types.Scene) -> None:
    material = displaced_material("moved", along_normal("OBJECT", 0.6), diffuse, "DISPLACEMENT")
    obj = grid(empty_scene, material, count=1)
    subdivided(obj, adaptive_space="OBJECT", adaptive_object_edge_length=0.004, subdivision_type="SIMPLE")
    agrees(empty_scene, lambda: is_adaptive(obj, False))


def triangles(scene: bpy.types.Scene) -> float:
    """Of a picture of one path, by the memory it took."""
    prepare(scene, 48, 48)
    render(scene, "CISTERN", 1, 1)
    return addon.report.last[0].peak_memory_mb


def test_the_dicing_camera_and_rate_count(empty_scene: bpy.types.Scene) -> None:
    subdivided(solid(empty_scene, build.material("grey", diffuse)))
    memory = triangles(empty_scene)
    far = empty_scene.camera.copy()
    far.matrix_world.translation = 20.0 * empty_scene.camera.matrix_world.translation
    far.location = 20.0 * empty_scene.camera.location
    empty_scene.collection.objects.link(far)
    empty_scene.cycles.dicing_camera = far
    assert triangles(empty_scene) < 0.2 * memory
    empty_scene.cycles.dicing_camera = None
    empty_scene.cycles.dicing_rate = 4.0
    assert triangles(empty_scene) < 0.2 * memory
    empty_scene.cycles.dicing_rate = 1.0
    empty_scene.cycles.max_subdivisions = 2
    assert triangles(empty_scene) < 0.2 * memory


@needs_cycles_4_5
def test_motion_blur(empty_scene: bpy.types.Scene) -> None:
    """Of an object that moves and bends."""
    obj = subdivided(solid(empty_scene, build.material("grey", diffuse)), pixels=0.5)
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Wide")
    for point, data in zip(obj.data.vertices, key.data, strict=True):
        data.co.x = 2.0 * point.co.x if point.co.z > 0.0 else point.co.x
    for frame, x in ((0, -0.5), (2, 0.5)):
        obj.location.x, key.value = x, x + 0.5
        obj.keyframe_insert("location", frame=frame)
        key.keyframe_insert("value", frame=frame)
    empty_scene.render.use_motion_blur = True
    empty_scene.render.motion_blur_shutter = 1.0
    agrees(empty_scene, lambda: setattr(obj.cycles, "use_deform_motion", False))


def test_points_that_are_not_finite_are_told(empty_scene: bpy.types.Scene) -> None:
    obj = subdivided(solid(empty_scene, build.material("grey", diffuse)))
    obj.data.vertices[0].co.x = float("inf")
    prepare(empty_scene, 48, 48)
    render(empty_scene, "CISTERN", 1, 1)
    assert any("not subdivided adaptively" in warning for warning in addon.report.last[0].warnings)
