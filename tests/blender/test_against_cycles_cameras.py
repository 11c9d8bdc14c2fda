"""Every camera model against Cycles; method and false-alarm rate as in test_against_cycles_lights."""

import math

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")

CAMERAS = {
    "perspective": {},
    "wide": {"lens": 20.0},
    "vertical fit": {"sensor_fit": "VERTICAL", "sensor_height": 20.0},
    "horizontal fit": {"sensor_fit": "HORIZONTAL", "sensor_width": 30.0},
    "shift": {"shift_x": 0.15, "shift_y": -0.1},
    "orthographic": {"type": "ORTHO", "ortho_scale": 4.0},
    "orthographic shift": {"type": "ORTHO", "ortho_scale": 4.0, "shift_x": 0.1, "shift_y": 0.2},
    "clipping": {"clip_start": 3.6, "clip_end": 5.2},
}
LENSES = {
    "round": {"aperture_fstop": 0.05},
    "blades": {"aperture_fstop": 0.05, "aperture_blades": 5, "aperture_rotation": 0.4},
    "anamorphic": {"aperture_fstop": 0.05, "aperture_ratio": 2.0},
}


def textured_stage(scene: bpy.types.Scene) -> bpy.types.Object:
    build.stage(scene, build.principled("ball", Base_Color=(0.8, 0.3, 0.2, 1), Roughness=0.6))
    return scene.camera


PANORAMAS = {
    "EQUIRECTANGULAR": [{}, {"longitude_min": -1.0, "longitude_max": 0.7, "latitude_min": -0.9, "latitude_max": 0.4}],
    "EQUIANGULAR_CUBEMAP_FACE": [{}],
    "MIRRORBALL": [{}],
    "FISHEYE_EQUIDISTANT": [{}, {"fisheye_fov": 1.2}],
    "FISHEYE_EQUISOLID": [{}, {"fisheye_lens": 12.0, "fisheye_fov": 2.0, "sensor_width": 30.0}],
    "FISHEYE_LENS_POLYNOMIAL": [
        {"fisheye_fov": 1.8, "fisheye_polynomial_k1": -0.06, "fisheye_polynomial_k2": 0.0005, "sensor_width": 30.0}
    ],
    "CENTRAL_CYLINDRICAL": [{}, {"central_cylindrical_range_u_min": -0.5, "central_cylindrical_radius": 1.6}],
}


@pytest.mark.parametrize("case", CAMERAS)
def test_camera(empty_scene: bpy.types.Scene, case: str) -> None:
    camera = textured_stage(empty_scene)
    for name, value in CAMERAS[case].items():
        setattr(camera.data, name, value)
    size = (64, 40) if "vertical" not in case else (40, 64)
    result = compare_with_cycles(empty_scene, size=size)
    assert result.agrees, result


LOOKED_THROUGH = {
    "spot": lambda: build.add_light(bpy.context.scene, "SPOT", spot_size=0.7, energy=0.0),
    "point": lambda: build.add_light(bpy.context.scene, "POINT", energy=0.0),
    "empty": lambda: bpy.data.objects.new("empty", None),
    "cube, scaled": lambda: bpy.data.objects.new("cube", bpy.data.meshes.new("cube")),
}


@pytest.mark.parametrize("case", LOOKED_THROUGH)
@pytest.mark.parametrize("size", [(64, 40), (40, 64)])
def test_objects_that_are_no_cameras(empty_scene: bpy.types.Scene, case: str, size: tuple[int, int]) -> None:
    """Any object may be the active camera: lamps see what their cone lights."""
    textured_stage(empty_scene)
    seen = LOOKED_THROUGH[case]()
    if seen.name not in empty_scene.collection.objects:
        empty_scene.collection.objects.link(seen)
    seen.matrix_basis = empty_scene.camera.matrix_basis
    seen.scale = (1.0, 2.0, 0.5)
    empty_scene.camera = seen
    result = compare_with_cycles(empty_scene, size=size)
    assert result.agrees, result


def spark(scene: bpy.types.Scene, blades: int, rotation: float) -> None:
    """A small light far behind what is in focus: it shows as the shape of the aperture."""
    glow = build.material("glow", lambda tree: build.shader(tree, "ShaderNodeEmission", Strength=100.0).outputs[0])
    build.add_floor(scene, glow, half=0.5)
    lens = build.add_camera(scene, (0.0, 0.0, 20.0), (0.0, 0.0, 0.0)).data.dof
    lens.use_dof, lens.focus_distance, lens.aperture_fstop = True, 2.0, 0.05
    lens.aperture_blades, lens.aperture_rotation = blades, rotation


APERTURES = {"triangle": (3, 0.0), "square": (4, 0.0), "hexagon, turned": (6, 0.2)}


@pytest.mark.parametrize("case", APERTURES)
def test_shapes_of_apertures(empty_scene: bpy.types.Scene, case: str) -> None:
    spark(empty_scene, *APERTURES[case])
    result = compare_with_cycles(empty_scene, samples=256, blocks=8)
    assert result.agrees, result


@pytest.mark.parametrize("case", APERTURES)
def test_apertures_turned_by_half_a_blade_are_seen(empty_scene: bpy.types.Scene, case: str) -> None:
    """Planted."""
    blades, rotation = APERTURES[case]
    spark(empty_scene, blades, rotation)

    def plant(scene: bpy.types.Scene) -> None:
        scene.camera.data.dof.aperture_rotation = rotation + math.pi / blades

    assert not compare_with_cycles(empty_scene, samples=256, blocks=8, plant=plant).agrees


@pytest.mark.parametrize("case", LENSES)
def test_depth_of_field(empty_scene: bpy.types.Scene, case: str) -> None:
    camera = textured_stage(empty_scene)
    camera.data.dof.use_dof = True
    camera.data.dof.focus_distance = 2.2
    for name, value in LENSES[case].items():
        setattr(camera.data.dof, name, value)
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def test_focus_object(empty_scene: bpy.types.Scene) -> None:
    camera = textured_stage(empty_scene)
    camera.data.dof.use_dof, camera.data.dof.aperture_fstop = True, 0.05
    target = bpy.data.objects.new("focus", None)
    target.location = (0.8, -1.5, 0.3)
    empty_scene.collection.objects.link(target)
    camera.data.dof.focus_object = target
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def test_orthographic_depth_of_field(empty_scene: bpy.types.Scene) -> None:
    camera = textured_stage(empty_scene)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 4.0
    camera.data.dof.use_dof, camera.data.dof.aperture_fstop, camera.data.dof.focus_distance = True, 2.0, 2.0
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def test_pixel_aspect_and_scaled_camera(empty_scene: bpy.types.Scene) -> None:
    camera = textured_stage(empty_scene)
    camera.scale = (2.0, 0.5, 3.0)
    empty_scene.render.pixel_aspect_x = 1.6
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def zoomed(scene: bpy.types.Scene) -> None:
    scene.camera.data.lens *= 1.01


def turned(scene: bpy.types.Scene) -> None:
    scene.camera.rotation_euler.x += math.radians(0.3)


@pytest.mark.parametrize("plant", [zoomed, turned])
def test_planted_bugs(empty_scene: bpy.types.Scene, plant) -> None:
    """Cycles' lens is 1 % longer, or its camera turned by 0.3 degrees."""
    textured_stage(empty_scene)
    assert not compare_with_cycles(empty_scene, plant=plant).agrees


def panoramic(scene: bpy.types.Scene, kind: str, number: int) -> bpy.types.Camera:
    camera = textured_stage(scene).data
    if kind not in camera.bl_rna.properties["panorama_type"].enum_items:
        pytest.skip("this Blender does not have it")
    camera.type, camera.panorama_type = "PANO", kind
    for name, value in PANORAMAS[kind][number].items():
        setattr(camera, name, value)
    return camera


@pytest.mark.parametrize("size", [(64, 40), pytest.param((40, 64), marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("kind", "number"), [(kind, number) for kind, cases in PANORAMAS.items() for number in range(len(cases))]
)
def test_panorama(empty_scene: bpy.types.Scene, kind: str, number: int, size: tuple[int, int]) -> None:
    panoramic(empty_scene, kind, number)
    result = compare_with_cycles(empty_scene, size=size)
    assert result.agrees, result


@pytest.mark.parametrize("size", [(64, 40), (40, 64)])
@pytest.mark.parametrize("kind", PANORAMAS)
def test_shifted_panorama(empty_scene: bpy.types.Scene, kind: str, size: tuple[int, int]) -> None:
    camera = panoramic(empty_scene, kind, 0)
    camera.shift_x, camera.shift_y, camera.sensor_fit = 0.15, -0.1, "VERTICAL"
    result = compare_with_cycles(empty_scene, size=size)
    assert result.agrees, result


def test_shift_that_panoramas_lose_is_seen(empty_scene: bpy.types.Scene) -> None:
    panoramic(empty_scene, "EQUIRECTANGULAR", 0).shift_x = 0.02

    def plant(scene: bpy.types.Scene) -> None:
        scene.camera.data.shift_x = 0.0

    assert not compare_with_cycles(empty_scene, plant=plant).agrees


def test_panorama_with_a_lens(empty_scene: bpy.types.Scene) -> None:
    camera = panoramic(empty_scene, "FISHEYE_EQUIDISTANT", 1)
    camera.dof.use_dof, camera.dof.aperture_fstop, camera.dof.focus_distance = True, 0.1, 2.2
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


@pytest.mark.parametrize("kind", ["EQUIRECTANGULAR", "FISHEYE_EQUISOLID"])
def test_window_coordinates_of_panoramas(empty_scene: bpy.types.Scene, kind: str) -> None:
    """Of surfaces and of the world."""
    panoramic(empty_scene, kind, 0).shift_x = 0.1

    def window(tree: build.Nodes) -> bpy.types.NodeSocket:
        return tree.nodes.new("ShaderNodeTexCoord").outputs["Window"]

    glow = build.material("glow", lambda tree: build.shader(tree, "ShaderNodeEmission", Color=window(tree)).outputs[0])
    for thing in empty_scene.objects:
        if thing.type == "MESH":
            thing.data.materials.clear()
            thing.data.materials.append(glow)
    tree = empty_scene.world.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(window(tree), background.inputs["Color"])
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def test_another_fisheye_is_seen(empty_scene: bpy.types.Scene) -> None:
    """Planted: a field of view 2 % wider."""
    panoramic(empty_scene, "FISHEYE_EQUIDISTANT", 1)

    def plant(scene: bpy.types.Scene) -> None:
        scene.camera.data.fisheye_fov *= 1.02

    assert not compare_with_cycles(empty_scene, plant=plant).agrees
