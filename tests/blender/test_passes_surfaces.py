"""Mist, UV and the indices beside Cycles, in the same process and from the same scene."""

import bpy
import numpy as np
import pytest

from tests.support import blender_scenes as build
from tests.support import pass_scenes

pytestmark = pytest.mark.usefixtures("registered_addon")

SWITCHES = ("mist", "uv", "object_index", "material_index")
MEANS = ["Mist.Z", "UV.U", "UV.V", "UV.A"]
LONG = bpy.app.version >= (5, 0, 0)
INDICES = ["Object Index.X", "Material Index.X"] if LONG else ["IndexOB.X", "IndexMA.X"]
OCCLUSION = ["Ambient Occlusion.R" if LONG else "AO.R"]
# The path tracer, sharing in bands, reservoirs at the visible point, at later ones, of paths, and history.
PRESETS = ["PATH_TRACING", "FINAL", "INTERACTIVE", "RESTIR_DI", "CELL_RESERVOIRS", "RESTIR_GI", "WORLD_PATHS"]


@pytest.fixture
def cards(empty_scene):
    def build(camera_type="PERSP", preset="PATH_TRACING"):
        pass_scenes.build_cards(empty_scene, camera_type)
        pass_scenes.prepare_layers(empty_scene, preset)
        for name in SWITCHES:
            setattr(empty_scene.view_layers[0], f"use_pass_{name}", True)
        return empty_scene

    return build


def compare(scene, plant=None):
    return pass_scenes.compare_layers(scene, MEANS, plant)


@pytest.mark.parametrize("preset", PRESETS)
def test_mist_and_uv_are_those_of_cycles(cards, preset):
    result = compare(cards(preset=preset))
    assert result.agrees, result


@pytest.mark.parametrize("falloff", ["LINEAR", "INVERSE_QUADRATIC"])
@pytest.mark.parametrize("is_transparent", [False, True])
def test_mist_by_falloff_and_through_a_transparent_film(cards, falloff, is_transparent):
    scene = cards("ORTHO")
    scene.world.mist_settings.falloff = falloff
    scene.render.film_transparent = is_transparent
    scene.cycles.film_transparent_glass = scene.cistern.film_transparent_glass = is_transparent
    result = compare(scene)
    assert result.agrees, result


def nearer_mist(scene):
    scene.world.mist_settings.start -= 0.1


def other_map(scene):
    bpy.data.objects["Base"].data.uv_layers["other"].active_render = True


def thinner_card(scene):
    mix = next(n for n in bpy.data.materials["Thick"].node_tree.nodes if n.bl_idname == "ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.65


def solid_glass(scene):
    scene.cycles.film_transparent_glass = False


@pytest.mark.parametrize("plant", [nearer_mist, other_map, thinner_card, solid_glass])
def test_planted_differences_are_found(cards, plant):
    scene = cards()
    scene.render.film_transparent = True
    scene.cycles.film_transparent_glass = scene.cistern.film_transparent_glass = True
    result = compare(scene, plant)
    assert not result.agrees, result


def ball_with_occlusion(scene, preset):
    """A ball on a floor, of which nothing further away than its own radius occludes."""
    build.stage(scene, build.principled("matt"), segments=192)
    scene.world.light_settings.distance = 0.7
    scene.view_layers[0].use_pass_ambient_occlusion = True
    pass_scenes.prepare_layers(scene, preset)
    return scene


@pytest.mark.parametrize("preset", ["PATH_TRACING", "FINAL", "RESTIR_GI"])
def test_occlusion_is_that_of_cycles(empty_scene, preset):
    result = pass_scenes.compare_layers(ball_with_occlusion(empty_scene, preset), OCCLUSION)
    assert result.agrees, result


def test_occlusion_of_another_distance_is_seen(empty_scene):
    def plant(scene):
        scene.world.light_settings.distance *= 1.1

    result = pass_scenes.compare_layers(ball_with_occlusion(empty_scene, "PATH_TRACING"), OCCLUSION, plant)
    assert not result.agrees, result


@pytest.mark.parametrize("preset", ["PATH_TRACING", "FINAL", "RESTIR_GI"])
def test_indices_are_those_of_cycles(cards, preset):
    """Exactly, except where chance decides in Cycles whether a thin card is passed."""
    scene = cards(preset=preset)
    ours, _ = pass_scenes.render_layers(scene, "CISTERN", 2)
    theirs, _ = pass_scenes.render_layers(scene, "CYCLES", 2)
    for name in INDICES:
        mine, other = ours[f"ViewLayer.{name}"], theirs[f"ViewLayer.{name}"]
        thin = {4.0, 11.0, 12.0} if name == INDICES[0] else {6.0}
        certain = ~np.isin(other, list(thin))
        np.testing.assert_array_equal(mine[certain], other[certain])
        assert len(set(mine[certain].ravel())) >= 4
        assert not np.isin(mine, list(thin)).any()


def test_channels_have_the_names_of_cycles(cards):
    scene = cards()
    names = {}
    for engine in ("CISTERN", "CYCLES"):
        channels, _ = pass_scenes.render_layers(scene, engine, 1)
        names[engine] = {name for name in channels if not name.startswith(("ViewLayer.Direct", "ViewLayer.Indirect"))}
    assert names["CISTERN"] == names["CYCLES"]


@pytest.mark.parametrize("preset", ["PATH_TRACING", "FINAL", "RESTIR_DI"])
def test_passes_are_the_same_with_any_number_of_threads_and_in_a_border(cards, preset):
    scene = cards(preset=preset)
    render = scene.render
    one, three = pass_scenes.layers_by_threads(scene)
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.25, 0.75
    part, _ = pass_scenes.render_layers(scene, "CISTERN", 4)
    for name in (f"ViewLayer.{name}" for name in MEANS + INDICES):
        np.testing.assert_array_equal(one[name], three[name])
        np.testing.assert_array_equal(part[name], one[name][4:12, 12:36])


def test_view_layers_have_passes_of_their_own(cards):
    scene = cards()
    scene.view_layers.new("Second").use_pass_uv = True
    channels, _ = pass_scenes.render_layers(scene, "CISTERN", 1)
    assert "Second.UV.U" in channels and "Second.Mist.Z" not in channels
    np.testing.assert_array_equal(channels["Second.UV.U"], channels["ViewLayer.UV.U"])


def test_without_a_world_mist_has_the_range_of_cycles(cards):
    scene = cards()
    scene.world = None
    result = compare(scene)
    assert result.agrees, result


def test_time_limit_ends_passes_with_the_picture(cards):
    scene = cards()
    full, _ = pass_scenes.render_layers(scene, "CISTERN", 16)
    scene.cistern.time_limit = 1e-6
    first, _ = pass_scenes.render_layers(scene, "CISTERN", 1 << 20)
    assert np.abs(first["ViewLayer.Mist.Z"] - full["ViewLayer.Mist.Z"]).mean() < 0.1
    assert set(np.unique(first["ViewLayer.UV.A"])) <= {0.0, 1.0}


def test_what_lies_behind_half_transparent_holdouts(empty_scene):
    """All data are of that, whatever share of the light it is."""
    empty_scene.render.film_transparent = True
    pass_scenes.build_cards(empty_scene)
    bpy.data.objects["Thick"].is_holdout = True
    pass_scenes.write_aovs(empty_scene)
    pass_scenes.prepare_layers(empty_scene, "PATH_TRACING")
    layer = empty_scene.view_layers[0]
    for name in ("uv", "object_index", "material_index", "z"):
        setattr(layer, f"use_pass_{name}", True)
    shown, _ = pass_scenes.render_layers(empty_scene, "CISTERN", 16, 1)
    bpy.data.objects["Thick"].hide_render = True
    bare, _ = pass_scenes.render_layers(empty_scene, "CISTERN", 16, 1)
    names = [*INDICES, "UV.U", "Depth.Z", "Level.X", "Tint.R"]
    row, column = 8, 20  # of Thick
    found = {name: [float(layers[f"{layer.name}.{name}"][row, column]) for layers in (shown, bare)] for name in names}
    for name, (one, other) in found.items():
        assert one == pytest.approx(other, rel=0.02), name
    assert found[INDICES[0]][0] == 3


def behind_fogs(scene, *fogs):
    """Channels of a wall with UV coordinates of 1 and the AOV "one", behind cubes of fog, 1 m deep each."""

    def wall(tree):
        pass_scenes.add_aov(tree, "one", Value=1.0)
        return build.shader(tree, "ShaderNodeBsdfDiffuse").outputs[0]

    corners = [(-9.0, 8.0, -9.0), (9.0, 8.0, -9.0), (9.0, 8.0, 9.0), (-9.0, 8.0, 9.0)]
    shown = build.add_mesh(scene, "wall", corners, [(0, 1, 2, 3)], build.material("wall", wall))
    shown.data.uv_layers.new(name="uv").data.foreach_set("uv", np.ones(8, np.float32))
    cube = [(9.0 * x, 0.5 * y, 9.0 * z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    for number, fog in enumerate(fogs):
        inside = build.material("fog", fog, "Volume")
        build.add_mesh(scene, "fog", cube, sides, inside).location.y = 2.0 * number
    build.add_camera(scene, (0.0, -4.0, 0.0), (np.pi / 2, 0.0, 0.0)).data.type = "ORTHO"
    pass_scenes.prepare_layers(scene, "PATH_TRACING")
    layer = scene.view_layers[0]
    layer.use_pass_uv, aov = True, layer.aovs.add()
    aov.name, aov.type = "one", "VALUE"
    channels, _ = pass_scenes.render_layers(scene, "CISTERN", 16)
    return [channels[f"ViewLayer.{name}"] for name in ("UV.U", "UV.A", "one.X")]


def is_share(values, expected):
    """Within five standard errors, a false alarm in a million, and these below 0.01."""
    error = values.std() / np.sqrt(values.size)
    return abs(values.mean() - expected) < 5.0 * error and error < 0.01


@pytest.mark.parametrize("color", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("varies", [False, True])
def test_uv_and_aovs_behind_fog_are_there_by_what_it_lets_through(empty_scene, color, varies):
    """Whatever ends of rays are chosen by. In place of the share exp(-1) it was up to 1.4 of that, by the colour."""

    def fog(tree):
        density = 1.0
        if varies:  # but is the same everywhere
            checker = build.shader(tree, "ShaderNodeTexChecker", Scale=0.01)
            for socket in checker.inputs[1:3]:
                socket.default_value = (1.0, 1.0, 1.0, 1.0)
            density = checker.outputs["Color"]
        return build.shader(tree, "ShaderNodeVolumePrincipled", Color=(color,) * 3 + (1,), Density=density).outputs[0]

    for values in behind_fogs(empty_scene, fog):
        assert is_share(values, np.exp(-1.0))
        assert not is_share(values, 1.1 * np.exp(-1.0)), "planted"


def test_fogs_of_two_colours_let_through_what_both_do(empty_scene):
    """The mean over channels of the product, not the product of means: planted."""

    def absorbing(color):
        return lambda tree: build.shader(tree, "ShaderNodeVolumeAbsorption", Color=color, Density=1.0).outputs[0]

    colors = np.array([(0.9, 0.1, 0.5, 1.0), (0.1, 0.9, 0.5, 1.0)])
    shares = np.exp(colors[:, :3] - 1.0)
    for values in behind_fogs(empty_scene, *(absorbing(tuple(color)) for color in colors)):
        assert abs(values.mean() - shares.prod(axis=0).mean()) < 1e-3
        assert abs(values.mean() - shares.mean(axis=1).prod()) > 1e-2
