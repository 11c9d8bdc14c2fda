"""What a viewport's Rendered shading shows in place of the scene's lamps and world."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import OpenImageIO
import pytest

from addon import ui_viewport
from addon.sync import SyncReport, studio_light
from addon.sync.camera import camera_arguments
from addon.sync.changes import EVERYTHING, NOTHING
from addon.sync.live import LiveSync
from tests.blender.drawn_panels import draw
from tests.support import blender_scenes as build
from tests.support.core_scenes import render

pytestmark = pytest.mark.usefixtures("registered_addon")

ROTATION, INTENSITY, OPACITY, COLOR = 0.7, 1.5, 0.3, (0.2, 0.4, 0.1)


@pytest.fixture
def space(empty_scene) -> bpy.types.SpaceView3D:
    """A viewport that renders."""
    found = next(area for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D").spaces.active
    found.shading.type = "RENDERED"
    return found


def show_studio(space: bpy.types.SpaceView3D) -> str:
    """Returns the picture's path."""
    shading = space.shading
    shading.use_scene_world_render = False
    shading.studiolight_rotate_z, shading.studiolight_intensity = ROTATION, INTENSITY
    shading.studiolight_background_alpha = OPACITY
    return shading.selected_studio_light.path


def lit_scene(scene: bpy.types.Scene) -> None:
    build.stage(scene, build.principled("ball", Metallic=1.0, Roughness=0.2))
    scene.world.color = COLOR


def world_of(scene: bpy.types.Scene, path: str) -> None:
    """The world that Cycles makes of such a light."""
    tree = scene.world.node_tree
    vector = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    mapping = build.shader(tree, "ShaderNodeMapping", Vector=vector, Rotation=(0.0, 0.0, ROTATION))
    mapping.vector_type = "VECTOR"
    picture = build.shader(tree, "ShaderNodeTexEnvironment", Vector=mapping.outputs[0])
    picture.image = bpy.data.images.load(path)
    brighter = tree.nodes.new("ShaderNodeVectorMath")
    brighter.operation = "SCALE"
    brighter.inputs["Scale"].default_value = INTENSITY
    tree.links.new(picture.outputs[0], brighter.inputs[0])
    seen = build.shader(tree, "ShaderNodeMixRGB", Fac=OPACITY, Color1=(*COLOR, 1), Color2=brighter.outputs[0])
    is_seen = tree.nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"]
    both = build.shader(tree, "ShaderNodeMixRGB", Fac=is_seen, Color1=brighter.outputs[0], Color2=seen.outputs[0])
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(both.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = 1.0


def picture(live: LiveSync, space: bpy.types.SpaceView3D | None, changes=EVERYTHING) -> np.ndarray:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert live.sync(depsgraph, changes, space).warnings == []
    scene = depsgraph.scene_eval
    live.builder.set_camera(**camera_arguments(scene, scene.camera, SyncReport()))
    return render(live.builder.snapshot(), 32, 16)["Combined"][..., :3]


def test_the_picture_is_that_of_such_a_world(empty_scene, built_core, space):
    lit_scene(empty_scene)
    path = show_studio(space)
    live, of_world = LiveSync(built_core), LiveSync(built_core)
    try:
        shown = picture(live, space)
        world_of(empty_scene, path)
        np.testing.assert_allclose(shown, picture(of_world, None), rtol=1e-3, atol=1e-4)
        # Planted: the other way round.
        space.shading.studiolight_rotate_z = -ROTATION
        assert np.abs(picture(live, space, NOTHING) / shown - 1.0).max() > 0.1
        # Those of before are gone, and the world comes back.
        assert len(live._kept.materials.compiled) == len(of_world._kept.materials.compiled)
        space.shading.use_scene_world_render = True
        np.testing.assert_allclose(picture(live, space, NOTHING), shown, rtol=1e-3, atol=1e-4)
    finally:
        live.close()
        of_world.close()


def test_without_the_scenes_lamps(empty_scene, built_core, space):
    lit_scene(empty_scene)
    live = LiveSync(built_core)
    try:
        both = picture(live, space)
        space.shading.use_scene_lights_render = False
        without = picture(live, space, NOTHING)
        assert without.mean() < 0.8 * both.mean()
        for lamp in [obj for obj in empty_scene.objects if obj.type == "LIGHT"]:
            bpy.data.objects.remove(lamp)
        np.testing.assert_allclose(picture(live, None), without, rtol=1e-4)
        space.shading.type = "SOLID"
        assert studio_light.viewport_lighting(space) == studio_light.SCENE_LIGHTING
    finally:
        live.close()


@pytest.mark.parametrize(
    ("name", "stored", "expected"),
    [
        ("light.png", np.uint8((128, 64, 255)), (0.216, 0.0513, 1.0)),
        ("light.exr", np.float32((0.5, 0.25, 9.0)), (0.5, 0.25, 9.0)),
        ("grey.exr", np.float32((0.5,)), (0.5, 0.5, 0.5)),
    ],
)
def test_pictures_of_users(tmp_path: Path, name: str, stored: np.ndarray, expected: tuple):
    """Light is as it is stored, or as sRGB has it in bytes."""
    path = str(tmp_path / name)
    spec = OpenImageIO.ImageSpec(4, 2, len(stored), stored.dtype.name)
    output = OpenImageIO.ImageOutput.create(path)
    output.open(path, spec)
    output.write_image(np.tile(stored, (2, 4, 1)))
    output.close()
    found = studio_light._picture(path)
    assert found.shape == (2, 4, 3)
    np.testing.assert_allclose(found[0, 0], expected, rtol=0.01)


def test_a_picture_that_is_not_there_is_named(empty_scene, built_core, monkeypatch):
    """As long as it is shown."""
    lit_scene(empty_scene)
    live = LiveSync(built_core)
    try:
        for rotation in (0.0, 1.0):
            lighting = studio_light.ViewportLighting(True, studio_light.StudioLight("/none.exr", rotation, 1.0, 1.0))
            monkeypatch.setattr("addon.sync.live.viewport_lighting", lambda _, lighting=lighting: lighting)
            [warning] = live.sync(bpy.context.evaluated_depsgraph_get(), NOTHING, None).warnings
            assert "'/none.exr' cannot be read" in warning
    finally:
        live.close()


def test_worlds_hidden_from_rays_hide_the_picture(empty_scene, built_core, space):
    lit_scene(empty_scene)
    show_studio(space)
    empty_scene.world.cycles_visibility.camera = False
    live = LiveSync(built_core)
    try:
        assert 100 < (picture(live, space) == 0.0).all(2).sum() < 500
        empty_scene.world.cycles_visibility.camera = True
        assert (picture(live, space) > 0.0).all()
    finally:
        live.close()


def test_the_panel(space):
    panel = ui_viewport.CISTERN_VIEW3D_PT_shading_lighting
    assert panel.poll(SimpleNamespace(engine="CISTERN", space_data=space))
    assert not panel.poll(SimpleNamespace(engine="BLENDER_EEVEE", space_data=space))
    switches = ["use_scene_lights_render", "use_scene_world_render"]
    assert draw(panel, space_data=space) == switches
    show_studio(space)
    drawn = draw(panel, space_data=space)
    assert drawn[:2] == switches and {"studio_light", "studiolight_rotate_z", "studiolight_intensity"} <= set(drawn)
