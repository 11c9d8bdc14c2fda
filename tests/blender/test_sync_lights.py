"""Units of the lamps: the numbers of the converters, and a white plane in Cycles lit by what they promise."""

import math

import bpy
import numpy as np
import pytest
from cycles_pixel import cycles_pixel

from addon.sync.lights import light_call

PI = math.pi
IDENTITY = np.eye(4)


def lamp(kind: str, energy: float = 100.0, **members) -> bpy.types.Light:
    light = bpy.data.lights.new("Lamp", kind)
    light.energy, light.color = energy, (1.0, 0.5, 0.25)
    for name, value in members.items():
        setattr(light, name, value)
    return light


def has_normalize() -> bool:
    return "normalize" in bpy.types.Light.bl_rna.properties


def arguments(light: bpy.types.Light, matrix: np.ndarray = IDENTITY) -> dict:
    return light_call(light, matrix).arguments


def test_point_light_spreads_its_power_over_the_sphere(empty_scene) -> None:
    call = light_call(lamp("POINT", shadow_soft_size=0.3), IDENTITY)
    assert call.method == "add_point_light"
    assert call.arguments["intensity"] == pytest.approx(np.array((100, 50, 25)) / (4 * PI))
    # radiance c / (4 pi^2 r^2), as intensity / (pi r^2)
    assert call.arguments["intensity"][0] / (PI * 0.3**2) == pytest.approx(100 / (4 * PI**2 * 0.3**2), rel=1e-6)
    assert call.arguments["radius"] == pytest.approx(0.3) and call.arguments["soft"]


def test_radius_of_a_point_light_ignores_scale(empty_scene) -> None:
    assert arguments(lamp("POINT", shadow_soft_size=0.3), np.diag((2.0, 3, 4, 1)))["radius"] == pytest.approx(0.3)


@pytest.mark.parametrize(("radius", "intensity"), [(0.3, 100 * 0.3**2), (0.0, 100 / PI)])
@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
def test_point_and_spot_without_normalize(empty_scene, kind, radius, intensity) -> None:
    if not has_normalize():
        pytest.skip("this Blender has no normalize switch")
    light = lamp(kind, shadow_soft_size=radius, normalize=False)
    assert arguments(light)["intensity"][0] == pytest.approx(intensity, rel=1e-6)


def test_exposure_and_temperature(empty_scene) -> None:
    if "exposure" not in bpy.types.Light.bl_rna.properties:
        pytest.skip("this Blender has neither exposure nor temperature")
    light = lamp("POINT", exposure=2.0, use_temperature=True, temperature=3000.0)
    # 3000 K is (1.771, 0.844, 0.272) in linear Rec. 709
    expected = np.array((1.0, 0.5, 0.25)) * (1.771, 0.844, 0.272) * 400 / (4 * PI)
    assert arguments(light)["intensity"] == pytest.approx(expected, rel=2e-3)


def test_cone_of_a_spot_does_not_change_its_intensity(empty_scene) -> None:
    matrix = np.diag((2.0, 1, 1, 1))
    narrow = arguments(lamp("SPOT", spot_size=0.2, spot_blend=0.4), matrix)
    assert narrow["intensity"][0] == pytest.approx(100 / (4 * PI))
    assert (narrow["spot_size"], narrow["blend"]) == pytest.approx((0.2, 0.4))
    assert np.array_equal(narrow["object_to_world"], matrix)  # its scale makes the cone elliptical
    assert narrow["object_to_world"].dtype == np.float32


@pytest.mark.parametrize("angle", [0.0, 0.1, 1.0])
def test_sun_irradiance_does_not_depend_on_its_angle(empty_scene, angle) -> None:
    values = arguments(lamp("SUN", energy=3.0, angle=angle))
    assert values["irradiance"] == pytest.approx((3.0, 1.5, 0.75))
    assert values["direction"] == pytest.approx((0, 0, 1))  # a lamp shines along -Z


@pytest.mark.parametrize(("angle", "irradiance"), [(1.0, 3 * PI * math.sin(0.5) ** 2), (0.0, 3.0)])
def test_sun_without_normalize_has_constant_radiance(empty_scene, angle, irradiance) -> None:
    if not has_normalize():
        pytest.skip("this Blender has no normalize switch")
    assert arguments(lamp("SUN", 3.0, angle=angle, normalize=False))["irradiance"][0] == pytest.approx(irradiance)


@pytest.mark.parametrize(
    ("shape", "area", "ellipse"),
    [("SQUARE", 24.0, False), ("RECTANGLE", 6.0, False), ("DISK", 6 * PI, True), ("ELLIPSE", 1.5 * PI, True)],
)
def test_area_light_divides_its_power_by_its_world_area(empty_scene, shape, area, ellipse) -> None:
    light = lamp("AREA", shape=shape, size=2.0, size_y=0.5, spread=1.0)
    values = arguments(light, np.diag((2.0, 3.0, 5.0, 1.0)))
    size_v = 3 * (0.5 if shape in ("RECTANGLE", "ELLIPSE") else 2.0)
    assert values["edge_u"] == pytest.approx((4, 0, 0)) and values["edge_v"] == pytest.approx((0, size_v, 0))
    assert values["radiance"][0] == pytest.approx(100 / (PI * area))
    assert values["ellipse"] is ellipse and values["spread"] == pytest.approx(1.0)
    assert values["normal"] == pytest.approx((0, 0, -1))


def test_area_light_without_normalize(empty_scene) -> None:
    if not has_normalize():
        pytest.skip("this Blender has no normalize switch")
    assert arguments(lamp("AREA", size=2.0, normalize=False))["radiance"][0] == pytest.approx(100 / PI)


def test_area_light_without_area_sends_nothing(empty_scene) -> None:
    assert light_call(lamp("AREA"), np.diag((0.0, 1.0, 1.0, 1.0))) is None


def test_switches(empty_scene) -> None:
    light = lamp("AREA", use_shadow=False)
    light.cycles.use_multiple_importance_sampling, light.cycles.max_bounces = False, 3
    if hasattr(light.cycles, "cast_shadow"):
        light.cycles.cast_shadow = False
    values = arguments(light)
    assert (values["casts_shadow"], values["use_mis"], values["max_bounces"]) == (False, False, 3)
    assert not values["portal"]
    light.cycles.is_portal = True
    assert arguments(light)["portal"]


def test_energy_that_is_no_number_reaches_the_core(empty_scene) -> None:
    assert math.isnan(arguments(lamp("POINT", energy=math.nan))["intensity"][0])


HEIGHT = 2.0
CASES = [
    ("POINT", {"shadow_soft_size": 0.0}),
    ("POINT", {"shadow_soft_size": 0.01}),
    ("SPOT", {"shadow_soft_size": 0.01, "spot_size": 1.0, "spot_blend": 0.1}),
    ("SUN", {"angle": 0.0}),
    ("SUN", {"angle": 0.4}),
    ("AREA", {"shape": "RECTANGLE", "size": 0.02, "size_y": 0.01}),
    ("AREA", {"shape": "DISK", "size": 0.02}),
]


def irradiance_below(call) -> np.ndarray:
    """W/m^2 on a horizontal plane at distance HEIGHT under a small lamp, from the builder's arguments."""
    values = call.arguments
    if call.method == "add_sun_light":
        return np.array(values["irradiance"])
    if call.method == "add_area_light":
        area = (
            np.linalg.norm(values["edge_u"]) * np.linalg.norm(values["edge_v"]) * (PI / 4 if values["ellipse"] else 1)
        )
        return np.array(values["radiance"]) * area / HEIGHT**2
    return np.array(values["intensity"]) / (HEIGHT**2 + values["radius"] ** 2)


@pytest.mark.parametrize("normalize", [True, False])
@pytest.mark.parametrize(("kind", "members"), CASES)
def test_a_white_plane_in_cycles_receives_what_the_arguments_say(
    empty_scene, tmp_path, kind, members, normalize
) -> None:
    """Small lamps straight above leave Cycles no noise to speak of, save the wide sun: 256 samples, 1 % allowed."""
    if not normalize and not has_normalize():
        pytest.skip("this Blender has no normalize switch")
    light = lamp(kind, **members)
    if not normalize:
        light.normalize = False
    lamp_object = bpy.data.objects.new("Lamp", light)
    lamp_object.location = (0, 0, HEIGHT)
    eye = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    eye.data.type, eye.data.ortho_scale, eye.location = "ORTHO", 0.01, (0, 0, 1)
    for obj in (lamp_object, eye):
        empty_scene.collection.objects.link(obj)
    bpy.ops.mesh.primitive_plane_add(size=1)
    material = bpy.data.materials.new("White")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    material.node_tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    matrix = np.eye(4)
    matrix[2, 3] = HEIGHT
    expected = irradiance_below(light_call(light, matrix)) / PI
    assert cycles_pixel(eye, tmp_path, samples=256)[:3] == pytest.approx(expected, rel=0.01)
