"""Shadow catchers and holdouts against Cycles."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.shadow_catchers import over_shadow
from tests.support import blender_scenes as build
from tests.support import engines
from tests.support.engines import compare_with_cycles, prepare, render
from tests.support.pass_scenes import compare_layers, prepare_layers, render_layers

pytestmark = pytest.mark.usefixtures("registered_addon")

SIZE, SAMPLES = (48, 32), 64


def footage(scene: bpy.types.Scene, alpha: float = 1.0, glow: float = 0.0) -> bpy.types.Scene:
    """A red and a grey ball, which may shine, on a brown floor that catches their shadows, under sun and sky; behind
    them the film is transparent."""
    floor = build.add_floor(scene, build.principled("floor", Base_Color=(0.6, 0.5, 0.4, 1.0)), half=4.0)
    floor.name, floor.is_shadow_catcher = "Floor", True
    red = {"Base_Color": (0.8, 0.1, 0.1, 1.0), "Alpha": alpha}
    grey = {"Emission_Color": (1.0, 0.5, 0.2, 1.0), "Emission_Strength": glow}
    for name, inputs, x in (("Red", red, -0.8), ("Grey", grey, 0.9)):
        ball = build.add_sphere(scene, build.principled(name, **inputs), radius=0.6)
        ball.name, ball.location = name, (x, 0.0, 0.0)
    build.add_light(scene, "SUN", energy=2.0, angle=0.2, rotation=(0.7, 0.3, 0.0))
    build.set_world(scene, (0.3, 0.4, 0.6))
    build.add_camera(scene, (0.0, -8.0, 4.0), (1.15, 0.0, 0.0))
    scene.render.film_transparent = True
    return scene


def without_roulette(monkeypatch) -> None:
    """Cycles' alpha over catchers that are seen through something counts its paths as if none had ended at random:
    0.73 in place of 0.64."""
    monkeypatch.setitem(engines.CYCLES, "min_transparent_bounces", engines.BOUNCES)


def test_shadows_darken_what_lies_below(empty_scene):
    assert compare_with_cycles(footage(empty_scene), SIZE, SAMPLES).agrees


def test_where_paths_are_shared(empty_scene):
    assert compare_with_cycles(footage(empty_scene), SIZE, SAMPLES, preset="FINAL").agrees


def test_what_shines_is_no_light_of_catchers_alone(empty_scene):
    assert compare_with_cycles(footage(empty_scene, glow=2.0), SIZE, SAMPLES).agrees


@pytest.mark.parametrize("preset", ["PATH_TRACING", "FINAL"])
def test_catchers_behind_what_is_half_transparent(empty_scene, monkeypatch, preset):
    without_roulette(monkeypatch)
    assert compare_with_cycles(footage(empty_scene, alpha=0.4), SIZE, SAMPLES, preset=preset).agrees


@pytest.mark.parametrize("film_transparent", [False, True], ids=["opaque", "transparent, where it matters"])
def test_transparent_glass_is_of_transparent_films_alone(empty_scene, film_transparent):
    """As in Cycles, whose pictures with an opaque film and catchers are the same with it and without."""
    scene = footage(empty_scene)
    bpy.data.objects["Red"].data.materials[0] = build.principled("glass", Transmission_Weight=1.0, Roughness=0.0)
    scene.render.film_transparent = film_transparent
    prepare(scene, *SIZE)
    without_it = render(scene, "CISTERN", 8, 1)
    scene.cistern.film_transparent_glass = True
    assert np.array_equal(render(scene, "CISTERN", 8, 1), without_it) != film_transparent


def test_an_ordinary_floor_is_seen(empty_scene):
    """Planted: Cycles has one."""

    def release(scene: bpy.types.Scene) -> None:
        scene.objects["Floor"].is_shadow_catcher = False

    assert not compare_with_cycles(footage(empty_scene), SIZE, SAMPLES, plant=release).agrees


def test_half_transparent_holdouts(empty_scene):
    scene = footage(empty_scene, alpha=0.4)
    scene.objects["Floor"].is_shadow_catcher = False
    scene.objects["Red"].is_holdout = True
    assert compare_with_cycles(scene, SIZE, SAMPLES).agrees


def with_shadow_pass(scene: bpy.types.Scene, preset: str = "PATH_TRACING") -> bpy.types.Scene:
    for settings in (scene.view_layers[0].cycles, scene.view_layers[0].cistern):
        settings.use_pass_shadow_catcher = True
    prepare_layers(scene, preset)
    return scene


@pytest.mark.parametrize("is_transparent", [True, False])
def test_shadows_in_a_pass_of_their_own(empty_scene, monkeypatch, is_transparent):
    without_roulette(monkeypatch)
    scene = with_shadow_pass(footage(empty_scene, alpha=0.4))
    scene.render.film_transparent = is_transparent
    names = [f"Shadow Catcher.{channel}" for channel in "RGB"] + [f"Combined.{channel}" for channel in "RGBA"]
    assert compare_layers(scene, names).agrees


def test_shadows_by_reservoirs(empty_scene):
    """In the pass: Combined cuts off noise above 1, of which paths that are the same with and without shadows have
    none."""
    scene = with_shadow_pass(footage(empty_scene), "RESTIR_DI")
    assert compare_layers(scene, [f"Shadow Catcher.{channel}" for channel in "RGB"]).agrees


@pytest.mark.parametrize("preset", ["RIS", "RESTIR_GI", "CELL_RESERVOIRS"])
def test_light_of_what_is_half_transparent_is_left_to_reservoirs(empty_scene, monkeypatch, preset):
    """And is no light of the catchers behind it, which would be missing in Combined."""
    without_roulette(monkeypatch)
    scene = with_shadow_pass(footage(empty_scene, alpha=0.4), preset)
    result = compare_layers(scene, [f"Combined.{channel}" for channel in "RGBA"])
    assert result.agrees, result


def test_shadows_of_one_ball_more_are_seen(empty_scene):
    """Planted: in the pass of Cycles alone."""
    scene = with_shadow_pass(footage(empty_scene))
    add = lambda scene: build.add_sphere(scene, build.principled("more"), radius=0.15)  # noqa: E731
    assert not compare_layers(scene, [f"Shadow Catcher.{channel}" for channel in "RGB"], plant=add).agrees


def test_without_anything_on_them_catchers_show_the_world(empty_scene):
    """Beyond their edges, too: the picture of the world alone has the same rays."""
    scene = footage(empty_scene)
    for name in ("Red", "Grey"):
        bpy.data.objects.remove(scene.objects[name])
    scene.render.film_transparent = False
    prepare(scene, *SIZE)
    shown = render(scene, "CISTERN", 16, seed=1)
    np.testing.assert_allclose(shown[..., :3], np.broadcast_to((0.15, 0.2, 0.3), shown[..., :3].shape), rtol=1e-5)
    assert (shown[..., 3] == 1.0).all()


def test_the_world_beside_catchers_is_blurred(empty_scene):
    """As without catchers; planted: a camera that rests."""
    scene = empty_scene
    tree = build.set_world(scene, strength=1.0).node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    place = build.shader(tree, "ShaderNodeTexCoord").outputs["Generated"]
    stripes = build.shader(tree, "ShaderNodeTexWave", Vector=place, Scale=4.0)
    tree.links.new(stripes.outputs["Color"], background.inputs["Color"])
    floor = build.add_floor(scene, half=1.0)
    floor.location.z, floor.is_shadow_catcher = -40.0, True  # out of view
    camera = build.add_camera(scene)
    camera.rotation_euler.z = -0.1
    camera.keyframe_insert("rotation_euler", frame=0)
    camera.rotation_euler.z = 0.1
    camera.keyframe_insert("rotation_euler", frame=2)
    scene.frame_set(1)
    prepare(scene, *SIZE)
    still = render(scene, "CISTERN", 64, 1)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    with_catcher = render(scene, "CISTERN", 64, 1)
    floor.is_shadow_catcher = False
    blurred = render(scene, "CISTERN", 64, 1)
    assert np.abs(with_catcher - blurred).max() < 0.1
    assert np.abs(still - blurred).max() > 0.3


def test_layers_over_each_other():
    matte = np.array([[[0.2, 0.1, 0.0, 0.5]]], np.float32)
    shadow = np.array([[[0.5, 0.25, 0.0]]], np.float32)  # leaves a quarter
    alone = over_shadow(matte, shadow, None)
    np.testing.assert_allclose(alone, [[[0.2, 0.1, 0.0, 0.875]]], rtol=1e-6)
    over_world = over_shadow(matte, shadow, np.full((1, 1, 3), 0.8, np.float32))
    np.testing.assert_allclose(over_world, [[[0.3, 0.2, 0.1, 1.0]]], rtol=1e-6)
    lit = over_shadow(matte, 2.0 * np.ones_like(shadow), None)
    np.testing.assert_array_equal(lit, matte)


def fill_with_fog(scene: bpy.types.Scene, density: float) -> None:
    fog = build.material("fog", lambda tree: build.shader(tree, "ShaderNodeVolumeScatter", Density=density).outputs[0])
    tree = fog.node_tree
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    link = output.inputs["Surface"].links[0]
    tree.links.new(link.from_socket, output.inputs["Volume"])
    tree.links.remove(output.inputs["Surface"].links[0])
    box = build.add_sphere(scene, fog, radius=1.8, segments=16)
    box.location = (0.0, 0.0, -0.3)


def test_thin_volumes_before_catchers(empty_scene):
    """No holdouts of the picture of catchers alone. In fog quotients have noise, which shadows cut off at 1."""
    scene = footage(empty_scene)
    fill_with_fog(scene, 1e-4)
    assert compare_with_cycles(scene, SIZE, SAMPLES, floor=0.005).agrees


def test_holdouts_leave_holes_in_the_world(empty_scene):
    scene = footage(empty_scene)
    scene.objects["Red"].is_holdout, scene.render.film_transparent = True, False
    prepare(scene, *SIZE)
    shown = render(scene, "CISTERN", 16, seed=1)[..., :3]
    assert (shown.max(axis=2) == 0.0).sum() > 15


def held_out(kind: str, share: float) -> bpy.types.Material:
    """A holdout, of which `share` is left, added to another shader."""

    def surface(tree):
        hole = build.shader(tree, "ShaderNodeMixShader", Fac=share)
        tree.links.new(build.shader(tree, "ShaderNodeHoldout").outputs[0], hole.inputs[2])
        add = build.shader(tree, "ShaderNodeAddShader")
        tree.links.new(hole.outputs[0], add.inputs[0])
        tree.links.new(build.shader(tree, kind).outputs[0], add.inputs[1])
        return add.outputs[0]

    return build.material("held out", surface)


@pytest.mark.parametrize(
    ("kind", "share"), [("ShaderNodeBsdfDiffuse", 1.0), ("ShaderNodeEmission", 1.0), ("ShaderNodeBsdfDiffuse", 0.6)]
)
def test_holdouts_added_to_what_shows(empty_scene, kind, share):
    """Where nothing of them is left out, nothing beside them shows; to other rays it does."""
    scene = footage(empty_scene)
    scene.objects["Floor"].is_shadow_catcher = False
    bpy.data.objects["Red"].data.materials[0] = held_out(kind, share)
    assert compare_with_cycles(scene, SIZE, SAMPLES).agrees


def test_a_holdout_that_leaves_a_little_is_seen(empty_scene):
    """Planted: beside that of Cycles, the shader shows."""
    scene = footage(empty_scene)
    scene.objects["Floor"].is_shadow_catcher = False
    bpy.data.objects["Red"].data.materials[0] = held_out("ShaderNodeBsdfDiffuse", 1.0)

    def leave_a_little(_: bpy.types.Scene) -> None:
        bpy.data.objects["Red"].data.materials[0] = held_out("ShaderNodeBsdfDiffuse", 0.98)

    assert not compare_with_cycles(scene, SIZE, SAMPLES, plant=leave_a_little).agrees


@pytest.mark.parametrize("kind", ["ShaderNodeBsdfDiffuse", "ShaderNodeEmission"])
def test_passes_of_surfaces_have_holes_too(empty_scene, kind):
    """In the middle of the ball, as there: neither depth nor normal."""
    scene = footage(empty_scene)
    bpy.data.objects["Red"].data.materials[0] = held_out(kind, 1.0)
    scene.objects["Floor"].is_shadow_catcher = False
    prepare_layers(scene, "PATH_TRACING")
    scene.view_layers[0].use_pass_z = scene.view_layers[0].use_pass_normal = True
    holes = {}
    for engine in ("CISTERN", "CYCLES"):
        channels, _ = render_layers(scene, engine, 8)
        is_hole = (channels["ViewLayer.Combined.A"] == 0.0) & (channels["ViewLayer.Depth.Z"] > 1e9)
        holes[engine] = is_hole & (channels["ViewLayer.Normal.X"] == 0.0)
    assert holes["CISTERN"].sum() > 10
    assert (holes["CISTERN"] == holes["CYCLES"]).mean() > 0.98


@pytest.mark.parametrize("held", ["object", "material"])
def test_holes_seen_through_fog_have_no_depth(empty_scene, held):
    scene = footage(empty_scene)
    bpy.data.objects.remove(scene.objects["Floor"])
    if held == "object":
        scene.objects["Red"].is_holdout = True
    else:
        bpy.data.objects["Red"].data.materials[0] = held_out("ShaderNodeBsdfDiffuse", 1.0)
    prepare_layers(scene, "PATH_TRACING")
    scene.view_layers[0].use_pass_z = True
    clear, _ = render_layers(scene, "CISTERN", 8)
    fill_with_fog(scene, 0.4)
    foggy, _ = render_layers(scene, "CISTERN", 8)
    no_depth = {name: layers["ViewLayer.Depth.Z"] > 1e9 for name, layers in (("clear", clear), ("foggy", foggy))}
    is_hole = clear["ViewLayer.Combined.A"] == 0.0
    assert (foggy["ViewLayer.Combined.A"][is_hole] > 0.0).sum() > 100, "fog lies before holes"
    assert (no_depth["clear"] == no_depth["foggy"]).mean() > 0.98
