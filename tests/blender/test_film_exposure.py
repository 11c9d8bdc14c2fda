"""The film's exposure: what it multiplies, pass by pass, in Cistern and in Cycles."""

import bpy
import cistern_core
import numpy as np
import pytest

from addon import open_image_denoise, settings
from tests.support import kind_scenes as kinds
from tests.support.pass_scenes import Layers, add_aov, render_layers

pytestmark = pytest.mark.usefixtures("registered_addon")

EXPOSURE = 4.0  # exact in binary


@pytest.fixture
def scene(empty_scene):
    """All kinds of light, with every pass that both engines have."""
    kinds.build_surfaces(empty_scene)
    kinds.save_layers(empty_scene, (24, 20))
    kinds.ask_for_kinds(empty_scene)
    layer = empty_scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_mist = layer.use_pass_uv = True
    layer.use_pass_object_index = layer.use_pass_material_index = layer.use_pass_cryptomatte_object = True
    layer.cycles.denoising_store_passes = True
    layer.cistern.use_pass_denoising_albedo = layer.cistern.use_pass_denoising_normal = True
    for name, kind in (("Tint", "COLOR"), ("Level", "VALUE")):
        aov = layer.aovs.add()
        aov.name, aov.type = name, kind
    for surface in bpy.data.materials:
        add_aov(surface.node_tree, "Tint", Color=(0.2, 0.4, 0.6, 1.0))
        add_aov(surface.node_tree, "Level", Value=0.3)
    layer.lightgroups.add(name="lamps")
    for lamp in [o for o in empty_scene.objects if o.type == "LIGHT"]:
        lamp.lightgroup = "lamps"
    return empty_scene


def both(scene, engine: str, exposure: float) -> Layers:
    scene.cistern.film_exposure = scene.cycles.film_exposure = exposure
    return render_layers(scene, engine, 8)[0]


def exposed_channels(plain: Layers, exposed: Layers) -> dict[str, bool]:
    """Of those that have anything, whether they are multiplied; the others are the same."""
    found = {}
    for name, pixels in plain.items():
        if np.any(pixels):
            is_same = np.allclose(exposed[name], pixels, rtol=1e-5)
            assert is_same or np.allclose(exposed[name], EXPOSURE * pixels, rtol=1e-5), name
            found[name] = not is_same
    return found


def test_the_same_passes_as_in_cycles_are_multiplied(scene):
    ours, theirs = (
        exposed_channels(both(scene, engine, 1.0), both(scene, engine, EXPOSURE)) for engine in ("CISTERN", "CYCLES")
    )
    common = set(ours) & set(theirs)
    assert len(common) > 50
    assert {name: ours[name] for name in common} == {name: theirs[name] for name in common}
    assert any(ours[name] for name in common) and not all(ours[name] for name in common)


@pytest.mark.parametrize("name", ["direct", "indirect"])
def test_it_comes_after_clamping(scene, name):
    setattr(scene.cistern, f"clamp_{name}", 0.05)
    exposed_channels(both(scene, "CISTERN", 1.0), both(scene, "CISTERN", EXPOSURE))


def test_shadow_catchers(scene):
    """The shadow is none of light, and what the film shows behind it is."""
    bpy.data.objects["floor"].is_shadow_catcher = True
    scene.view_layers[0].cistern.use_pass_shadow_catcher = True
    plain, exposed = both(scene, "CISTERN", 1.0), both(scene, "CISTERN", EXPOSURE)
    found = exposed_channels(plain, exposed)
    shadows = [name for name in found if "Shadow Catcher" in name]
    assert shadows and not any(found[name] for name in shadows)
    assert any(found[name] for name in found if "Combined" in name)


@pytest.mark.skipif(not open_image_denoise.is_there(), reason="this Blender comes without Open Image Denoise")
def test_denoised_pictures(scene):
    scene.cistern.use_denoising = True
    plain, exposed = both(scene, "CISTERN", 1.0), both(scene, "CISTERN", EXPOSURE)
    name = f"{scene.view_layers[0].name}.Combined.G"
    assert exposed[name].mean() / plain[name].mean() == pytest.approx(EXPOSURE, rel=0.01)


def test_viewports(scene):
    scene.cistern.film_exposure = 0.5
    assert settings.viewport_settings(cistern_core, scene)["film_exposure"] == 0.5
