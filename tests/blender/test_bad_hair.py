"""Hair that no scene should have, through Blender to the picture; as test_bad_geometry."""

import math

import bpy
import numpy as np
import pytest

from tests.blender.bad_input import HEIGHT, WIDTH, cube, picture_of
from tests.blender.engine_fakes import fresh_scene
from tests.support.hair_scenes import CAN_MAKE_CURVES, add_particle_hair, hair_curves

pytestmark = [
    pytest.mark.usefixtures("registered_addon", "built_core"),
    pytest.mark.skipif(not CAN_MAKE_CURVES, reason="scripts cannot make hair curves"),
]

# Two strands across the picture, of which the second is broken.
KEYS = np.array([[(-2, 0, z), (0, 0.1, z), (2, 0, z)] for z in (0.3, 0.9)], np.float32)


def key(value: float):
    return lambda positions, radii: positions[1].__setitem__((1, 2), value)


def radius(value: float):
    return lambda positions, radii: radii[1].__setitem__(slice(None), value)


def repeat(positions: np.ndarray, radii: np.ndarray) -> None:
    positions[1] = positions[1, 0]


BROKEN = {
    "a key that is no number": (key(math.nan), "not finite"),
    "a key at infinity": (key(math.inf), "not finite"),
    "a radius that is no number": (radius(math.nan), "not finite"),
    "a radius of infinity": (radius(math.inf), "not finite"),
    "no radius": (radius(0.0), None),
    "a radius below 0": (radius(-0.1), None),
    "one place for all keys": (repeat, None),
    "a key far away": (key(1e30), None),
}


@pytest.mark.parametrize("name", BROKEN)
def test_one_broken_strand(tmp_path, name) -> None:
    spoil, warning = BROKEN[name]
    means = []
    for change in (None, spoil):
        scene = fresh_scene(WIDTH, HEIGHT, samples=8)
        bpy.data.objects.remove(cube())
        positions, radii = KEYS.copy(), np.full((2, 3), 0.2, np.float32)
        if change:
            change(positions, radii)
        scene.collection.objects.link(bpy.data.objects.new("Fur", hair_curves("Fur", positions, radii)))
        picture, report = picture_of(scene, tmp_path)
        assert np.isfinite(picture).all()
        means.append(float(picture.mean()))
        if change:
            found = [w for w in report.warnings if "Fur" in w]
            assert (len(found) == 1 and warning in found[0]) if warning else not found
    empty = fresh_scene(WIDTH, HEIGHT, samples=8)
    bpy.data.objects.remove(cube())
    assert means[1] > 1.001 * float(picture_of(empty, tmp_path)[0].mean()), "the good strand is there"


@pytest.mark.parametrize("scale", [(1, 1, 1), (0, 1, 1), (0, 0, 0), (-1, 1, 1e-20)])
@pytest.mark.parametrize("length", [0.0, 0.5])
def test_particles_without_material_length_or_volume(tmp_path, length, scale) -> None:
    scene = fresh_scene(WIDTH, HEIGHT, samples=4)
    cube().scale = scale
    add_particle_hair(cube(), 7, count=20, hair_length=length)
    picture, _ = picture_of(scene, tmp_path)
    assert np.isfinite(picture).all()
