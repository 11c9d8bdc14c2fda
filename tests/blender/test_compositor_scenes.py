"""Renders of scenes that the compositor of another scene asks for: their pictures have its shape."""

import bpy
import numpy as np
import pytest

import addon
from tests.support import blender_scenes as build
from tests.support.compositing import show
from tests.support.engines import prepare, render

pytestmark = pytest.mark.usefixtures("registered_addon")

SIZE, OWN_SIZE = (32, 20), (18, 24)


@pytest.fixture
def asked_for(empty_scene: bpy.types.Scene) -> bpy.types.Scene:
    """One with a shape and a border of its own, that another scene shows."""
    other = bpy.data.scenes.new("Asked for")
    build.add_floor(other)
    build.add_light(other, "POINT", (0.5, -0.5, 2.0), energy=100.0)
    build.add_camera(other)
    build.add_sphere(other, build.principled("ball", Base_Color=(0.8, 0.2, 0.1, 1)))
    build.add_camera(empty_scene)
    for scene, size in ((empty_scene, SIZE), (other, OWN_SIZE)):
        prepare(scene, *size)
        scene.render.engine = "CISTERN"
        scene.cistern.samples, scene.cistern.seed = 8, 3
    other.render.use_border, other.render.border_min_x = True, 0.4
    show(empty_scene, other)
    return other


def expected_of(other: bpy.types.Scene) -> np.ndarray:
    """Rendered by itself, in the shape of the other."""
    other.render.resolution_x, other.render.resolution_y = SIZE
    other.render.use_border = False
    bpy.context.window.scene = other
    return render(other, "CISTERN", 8, 3)


def test_the_picture_has_the_shape_of_the_scene_that_asks(empty_scene, asked_for) -> None:
    shown = render(empty_scene, "CISTERN", 8, 3)
    assert shown.shape[:2] == SIZE[::-1]
    np.testing.assert_allclose(shown, expected_of(asked_for), atol=1e-5)


def test_the_border_is_that_of_the_scene_that_asks(empty_scene, asked_for) -> None:
    empty_scene.render.use_border = empty_scene.render.use_crop_to_border = True
    empty_scene.render.border_min_x, empty_scene.render.border_max_x = 0.25, 0.75
    empty_scene.render.border_min_y, empty_scene.render.border_max_y = 0.0, 1.0
    shown = render(empty_scene, "CISTERN", 8, 3)
    np.testing.assert_allclose(shown, expected_of(asked_for)[:, 8:24], atol=1e-5)


def test_blur_too(empty_scene, asked_for) -> None:
    still = render(empty_scene, "CISTERN", 8, 3)
    move_the_camera(asked_for)
    asked_for.render.use_motion_blur = True
    shown = render(empty_scene, "CISTERN", 8, 3)
    assert np.abs(shown - still).max() > 0.01
    np.testing.assert_allclose(shown, expected_of(asked_for), atol=1e-5)
    assert not [line.error for line in addon.report.last if line.error]


def test_vectors_too(empty_scene, asked_for) -> None:
    move_the_camera(asked_for)
    asked_for.view_layers[0].use_pass_vector = True
    show(empty_scene, asked_for, output="Vector")
    shown = render(empty_scene, "CISTERN", 8, 3)
    assert np.abs(shown).max() > 1.0
    for scene in (empty_scene, asked_for):
        scene.render.resolution_x, scene.render.resolution_y = SIZE
    asked_for.render.use_border = False
    np.testing.assert_allclose(shown, render(empty_scene, "CISTERN", 8, 3), atol=1e-5)


def move_the_camera(scene: bpy.types.Scene) -> None:
    for offset in (-1, 1):
        scene.camera.location.x = 0.25 * offset
        scene.camera.keyframe_insert("location", frame=scene.frame_current + offset)
