"""Denoising of final renders: what is denoised and what is not, and how much nearer to the truth it gets."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import addon
from addon import denoise as denoising
from addon import layer_render, open_image_denoise, settings
from addon.engine import CisternEngine
from addon.layer_render import LayerRender
from tests.blender.engine_fakes import fresh_scene, install, render
from tests.blender.test_open_image_denoise import error, has_library

pytestmark = pytest.mark.usefixtures("registered_addon")


def plane(channels, name, ids="RGB"):
    return np.stack([channels[f"ViewLayer.{name}.{channel}"] for channel in ids], axis=2)


@pytest.fixture
def core(monkeypatch):
    return install(monkeypatch)


@pytest.fixture
def stand_in(monkeypatch):
    """In place of the library: 10 less the picture. Returns the calls."""
    calls = []

    def play(layers, albedo, normal, threads=0, is_wanted=None):
        parts = [part for part in vars(layers).values() if part is not None]
        calls.append((parts[0].shape, tuple(albedo[0, 0]), tuple(normal[0, 0]), threads))
        return 10.0 - sum(parts) if is_wanted() else None

    monkeypatch.setattr(denoising, "denoise_layers", play)
    return calls


def denoised_scene(*size):
    scene = fresh_scene(*size)
    scene.cistern.use_denoising = True
    return scene


def stereo(scene, folder):
    scene.render.use_multiview = True
    scene.render.image_settings.views_format = "INDIVIDUAL"
    scene.render.filepath = str(folder / "eye.exr")
    return scene


def test_off_by_default_and_then_nothing_more_is_asked_of_the_core(core, stand_in, tmp_path):
    render(fresh_scene(), tmp_path)
    assert stand_in == [] and core.settings[0].passes == ["Direct", "Indirect"]


def test_the_picture_is_denoised_with_its_guides_and_nothing_else_is(core, stand_in, tmp_path):
    scene = denoised_scene()
    scene.view_layers[0].cistern.use_pass_denoising_albedo = True
    scene.render.threads_mode, scene.render.threads = "FIXED", 3
    channels, [report] = render(scene, tmp_path)
    assert stand_in == [((6, 8, 3), (0.25, 0.5, 0.75), (0.0, 1.0, 0.0), 3)]
    assert np.all(channels["ViewLayer.Combined.R"] == 10.0 - np.arange(8)) and report.warnings == []
    assert np.all(channels["ViewLayer.Combined.A"] == 1.0)
    assert np.all(plane(channels, "Direct") == (0.5, 0.25, 0.125))
    assert {name.split(".")[1] for name in channels} == {"Combined", "Direct", "Indirect", "Denoising Albedo"}


def test_the_noisy_picture_is_there_for_who_asks(core, stand_in, tmp_path):
    scene = denoised_scene()
    scene.view_layers[0].cistern.use_pass_noisy = True
    channels, _ = render(scene, tmp_path)
    assert np.all(channels["ViewLayer.Noisy Image.R"] == np.arange(8))
    assert np.all(plane(channels, "Noisy Image") == 10.0 - plane(channels, "Combined"))


def test_unfinished_pictures_have_it_too(core, stand_in, tmp_path, monkeypatch):
    """Blender shows them, but not in the background. Planted bug: the core was asked for a pass it does not know."""
    shown = []
    monkeypatch.setattr(layer_render.DisplayClock, "is_due", lambda clock: True)
    monkeypatch.setattr(layer_render.DisplayClock, "restart", lambda clock: shown.append(clock))
    scene = denoised_scene()
    scene.view_layers[0].cistern.use_pass_noisy = scene.view_layers[0].cistern.use_pass_shadow_catcher = True
    _, [report] = render(scene, tmp_path)
    assert report.error is None and shown


def test_pixels_that_will_be_denoised_share_for_that(core, stand_in, tmp_path):
    scene = denoised_scene()
    scene.cistern.indirect, scene.cistern.share_visible, scene.cistern.share_deep = "CELL_SHARED", 8, 4
    for is_denoised in (True, False):
        scene.cistern.use_denoising = is_denoised
        render(scene, tmp_path)
        assert (core.settings[-1].share_visible, core.settings[-1].share_deep) == (8, 4)
        assert core.settings[-1].share_for_denoiser == is_denoised
        assert core.settings[-1].sequence == ("PIXEL_SOBOL" if is_denoised else "SOBOL")


def test_a_border_is_denoised_alone(core, stand_in, tmp_path):
    scene = denoised_scene(16, 12)
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0
    channels, _ = render(scene, tmp_path)
    assert stand_in[0][0] == (6, 8, 3)
    assert np.all(channels["ViewLayer.Combined.R"][6:, 4:12] == 10.0 - np.arange(4, 12))


def test_each_layer_and_each_view_is_denoised(core, stand_in, tmp_path):
    scene = denoised_scene()
    scene.view_layers.new("Second")
    stereo(scene, tmp_path)
    bpy.ops.render.render(write_still=True)
    assert len(stand_in) == 4


def test_a_layer_may_be_left_noisy(core, stand_in, tmp_path):
    scene = denoised_scene()
    scene.view_layers.new("Second").cycles.use_denoising = False
    render(scene, tmp_path)
    assert len(stand_in) == 1
    assert [made.share_for_denoiser for made in core.settings] == [True, False]


def test_views_and_icons_are_not_denoised(core, stand_in, tmp_path):
    scene = denoised_scene()
    scene.cistern.view = "CELLS"
    render(scene, tmp_path)
    assert stand_in == []
    scene.cistern.view = "COMBINED"
    layer = scene.view_layers[0]
    assert settings.is_denoised(scene, layer, is_preview=False)
    assert not settings.is_denoised(scene, layer, is_preview=True)


@pytest.mark.parametrize("breaks", [[False, False, True], [False, False, False, False]], ids=["rendering", "done"])
def test_a_cancelled_render_is_not_denoised(core, stand_in, tmp_path, monkeypatch, breaks):
    """Cancelled among its samples, and after the last one."""
    answers = iter(breaks)
    monkeypatch.setattr(CisternEngine, "is_stop_wanted", lambda self: next(answers, True))
    scene = denoised_scene()
    scene.cistern.samples = 1000 if breaks[-1] else 5
    channels, [report] = render(scene, tmp_path)
    assert np.all(channels["ViewLayer.Combined.R"][0] == np.arange(8))
    assert (report.samples, report.error, report.warnings) == (3 if breaks[-1] else 5, None, [])


def test_status_line_says_denoising(core, stand_in, tmp_path, monkeypatch):
    texts = []
    status_bar = SimpleNamespace(
        update_stats=lambda stats, info: texts.append(info), is_stop_wanted=lambda: False, is_preview=False
    )
    finish = LayerRender.finished_reader

    def finish_recorded(layer, session):
        engine, layer.engine = layer.engine, status_bar
        reader = finish(layer, session)
        layer.engine = engine
        return reader

    monkeypatch.setattr(LayerRender, "finished_reader", finish_recorded)
    render(denoised_scene(), tmp_path)
    assert texts == ["Denoising"]


def test_without_the_library_the_picture_arrives_as_it_is_with_a_warning(core, tmp_path, monkeypatch):
    monkeypatch.setattr(open_image_denoise, "find_library", lambda: None)
    channels, [report] = render(denoised_scene(), tmp_path)
    assert report.warnings == ["The picture is not denoised: this Blender comes without Open Image Denoise"]
    assert report.error is None
    assert np.all(channels["ViewLayer.Combined.R"][0] == np.arange(8))
    assert "without" in denoising.state_sentence()


def test_two_views_without_the_library_give_one_warning(core, tmp_path, monkeypatch):
    monkeypatch.setattr(open_image_denoise, "find_library", lambda: None)
    stereo(denoised_scene(), tmp_path)
    addon.report.last.clear()
    bpy.ops.render.render(write_still=True)
    assert len(addon.report.last_report().warnings) == 1


def test_memory_that_runs_out_leaves_the_picture_as_it_is(core, tmp_path, monkeypatch):
    def fail(picture):
        raise MemoryError("Unable to allocate 3 TiB")

    monkeypatch.setattr(denoising, "prepared", fail)
    channels, [report] = render(denoised_scene(), tmp_path)
    assert "3 TiB" in report.warnings[0] and report.error is None
    assert np.all(channels["ViewLayer.Combined.R"][0] == np.arange(8))


def test_alpha_and_what_is_empty_stay(stand_in):
    picture = np.array([[(1, 2, 3, 1), (0.5, 0, 0, 0.25), (0, 0, 0, 0), (0, 0, 0, 1), (2, 2, 2, 0)]], np.float32)
    names = (*denoising.LAYER_PASSES, *denoising.GUIDE_PASSES)
    passes = {"Combined": picture} | {name: 0.25 * picture[..., :3] for name in names}
    combined = denoising.denoised_combined(passes.__getitem__, 0, lambda: True)
    assert np.array_equal(combined[..., 3], picture[..., 3])
    is_empty = np.array([[False, False, True, False, False]])
    assert np.all(combined[is_empty] == 0.0)
    assert np.array_equal(combined[~is_empty][:, :3], 10.0 - picture[~is_empty][:, :3])


def flat(value):
    return np.full((16, 16, 3), value, np.float32)


def test_a_picture_is_taken_apart_and_the_parts_are_the_picture():
    layers = denoising.layers_of(flat(7.0), indirect := flat(2.0), flat(4.0), flat(0.0))
    assert np.all(layers.scattered == 1.0) and layers.indirect is indirect and np.all(layers.kept == 4.0)


@pytest.mark.parametrize(("noise", "kept"), [(0.3, 4.0), (2.0, 2.0), (3.0, 0.0)])
def test_noisy_emission_is_filtered(noise, kept):
    """Variances of 0.6, 25 and 56 % of the square."""
    layers = denoising.layers_of(flat(7.0), flat(2.0), flat(4.0), flat(noise))
    np.testing.assert_allclose(layers.kept, kept, rtol=1e-5)
    np.testing.assert_allclose(layers.scattered, 5.0 - kept, rtol=1e-5)


def test_noise_of_emission_is_that_of_its_surroundings():
    """One pixel's estimate has one degree of freedom: it may be 0 or large by chance."""
    noise = flat(0.0)
    noise[8, 8] = 10.0  # 100 of 49 x 16: 0.13
    share = denoising.noisy_share(flat(4.0), noise)[..., 0]
    assert np.count_nonzero(share) == 49 and share[5, 5] == pytest.approx((100 / (49 * 16) - 0.1) / 0.3, rel=1e-4)


@pytest.mark.parametrize("parts", [(2.0, -1.0, 0.0), (2.0, 3.0, 0.0), (2.0, 0.0, -1.0)])
def test_negative_light_is_not_taken_apart(parts):
    """Of lamps of negative strength: indirect, direct, emission. The sum is not negative, and filters keep it."""
    picture, indirect, emission = map(flat, parts)
    layers = denoising.layers_of(picture, indirect, emission, emission)
    assert layers.scattered is picture and layers.indirect is None and layers.kept is None


def test_rounding_is_not_taken_for_negative_light():
    picture = np.full((2, 2, 3), 7.0, np.float32)
    layers = denoising.layers_of(picture, np.nextafter(picture, np.float32(8.0)), 0.0 * picture, 0.0 * picture)
    assert np.all(layers.scattered == 0.0) and layers.indirect is not None


# Renders by the built core.


def textured_scene(samples):
    """A checked floor and a glossy cube under a lamp, on a transparent film, and sharp."""
    scene = fresh_scene(80, 64, samples)
    scene.cistern.preset, scene.cistern.filter_width = "PATH_TRACING", 0.75
    scene.render.film_transparent = True
    bpy.ops.mesh.primitive_plane_add(size=7.0, location=(0.0, 0.0, -1.0))
    floor = bpy.data.materials.new("Checks")
    floor.use_nodes = True
    tree = floor.node_tree
    checks = tree.nodes.new("ShaderNodeTexChecker")
    checks.inputs["Scale"].default_value = 14.0
    checks.inputs["Color1"].default_value, checks.inputs["Color2"].default_value = (
        (0.8, 0.2, 0.1, 1),
        (0.1, 0.3, 0.8, 1),
    )
    tree.links.new(checks.outputs["Color"], tree.nodes["Principled BSDF"].inputs["Base Color"])
    bpy.context.object.data.materials.append(floor)
    return scene


def combined(scene, folder, is_denoised):
    scene.cistern.use_denoising = is_denoised
    channels, [report] = render(scene, folder)
    assert (report.error, report.warnings) == (None, [])
    return plane(channels, "Combined", "RGBA")


@pytest.fixture(scope="module")
def pictures(registered_addon, tmp_path_factory):
    """Of the same 2 samples, plain and denoised, and of 512 with another seed."""
    folder = tmp_path_factory.mktemp("pictures")
    scene = textured_scene(2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(denoising, "SEQUENCE", "SOBOL")
        noisy, clean = (combined(scene, folder, is_denoised) for is_denoised in (False, True))
    scene.cistern.samples, scene.cistern.seed = 512, 1
    return noisy, clean, combined(scene, folder, False)


@has_library
def test_a_denoised_render_is_nearer_to_a_long_one(pictures):
    noisy, clean, long = pictures
    assert error(clean[..., :3], long[..., :3]) < 0.65 * error(noisy[..., :3], long[..., :3])
    assert clean[..., :3].mean() == pytest.approx(long[..., :3].mean(), rel=0.03)


@has_library
def test_what_cells_share_can_be_denoised(tmp_path, pictures):
    """Neighbours have hardly any noise in common, so the picture gets as near as the path tracer's."""
    noisy, by_paths, long = pictures
    scene = textured_scene(2)
    scene.cistern.preset, scene.cistern.indirect = "CUSTOM", "CELL_SHARED"
    scene.cistern.use_temporal_reuse = scene.cistern.use_share_trial = False
    clean = combined(scene, tmp_path, True)
    assert not np.array_equal(clean, by_paths)
    assert error(clean[..., :3], long[..., :3]) < 0.65 * error(noisy[..., :3], long[..., :3])


@has_library
def test_alpha_of_a_denoised_render_is_untouched_and_nothing_glows_outside(pictures):
    noisy, clean, _ = pictures
    assert np.array_equal(clean[..., 3], noisy[..., 3])
    outside = noisy[..., 3] == 0.0
    assert outside.any() and np.all(clean[outside] == 0.0)


@has_library
def test_guides_of_the_core_in_the_wrong_order_are_worse(tmp_path, pictures, monkeypatch):
    """Planted: albedo taken for the normal."""
    _, clean, long = pictures
    monkeypatch.setattr(denoising, "GUIDE_PASSES", denoising.GUIDE_PASSES[::-1])
    swapped = combined(textured_scene(2), tmp_path, True)
    assert error(swapped[..., :3], long[..., :3]) > 1.3 * error(clean[..., :3], long[..., :3])


# Emission in view: the part of the picture with little noise and the largest contrast.


def lamps_scene(samples):
    """A dark floor under glowing balls, which the camera and the pixel filter show sharp."""
    scene = fresh_scene(80, 64, samples)
    scene.cistern.preset, scene.cistern.filter_width = "PATH_TRACING", 0.75
    glow = bpy.data.materials.new("Glow")
    glow.use_nodes = True
    glow.node_tree.nodes.clear()
    emission = glow.node_tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = 200.0
    output = glow.node_tree.nodes.new("ShaderNodeOutputMaterial")
    glow.node_tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    for x in (-2.0, -1.0, 1.5, 2.5):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.05, location=(x, 0.5 * x, 1.0))
        bpy.context.object.data.materials.append(glow)
    return scene


@has_library
def test_sharp_lamps_are_kept(tmp_path, monkeypatch):
    """Planted: emission filtered whatever its noise is, and the picture not taken apart."""
    long = combined(lamps_scene(512), tmp_path, False)[..., :3]
    assert long.max() > 100.0
    layered = combined(lamps_scene(8), tmp_path, True)[..., :3]
    monkeypatch.setattr(denoising, "noisy_share", lambda *_: 1.0)
    filtered = combined(lamps_scene(8), tmp_path, True)[..., :3]
    monkeypatch.setattr(denoising, "layers_of", lambda picture, *parts: denoising.Layers(picture))
    whole = combined(lamps_scene(8), tmp_path, True)[..., :3]
    assert error(layered, long) < 0.1 * min(error(filtered, long), error(whole, long))
    assert layered.mean() == pytest.approx(long.mean(), rel=0.04)
    assert max(filtered.mean(), whole.mean()) < 0.94 * long.mean()


@has_library
@pytest.mark.parametrize("samples", [1, 4, 16])
def test_lamps_out_of_focus_are_filtered(tmp_path, monkeypatch, samples):
    """Planted: emission left as it is."""

    def blurred(samples):
        scene = lamps_scene(samples)
        scene.camera.data.dof.use_dof = True
        scene.camera.data.dof.focus_distance, scene.camera.data.dof.aperture_fstop = 1.0, 0.1
        return scene

    long = combined(blurred(256), tmp_path, False)[..., :3]
    layered = combined(blurred(samples), tmp_path, True)[..., :3]
    monkeypatch.setattr(denoising, "noisy_share", lambda *_: 0.0)
    kept = combined(blurred(samples), tmp_path, True)[..., :3]
    assert error(layered, long) < 0.5 * error(kept, long)
