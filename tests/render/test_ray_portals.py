"""Sessions with a ray portal in a window: light samples stop at it, scattered rays go on.

False-alarm rate of all comparisons in this file together: FALSE_ALARM_RATE.
"""

from __future__ import annotations

import cistern_core as core
import numpy as np
import pytest

from tests.support.core_scenes import SceneDescription, portal, principled
from tests.support.statistics import compare_replicas, sidak
from tests.support.window_room import block_replicas, finished, picture, room

FALSE_ALARM_RATE = 0.01
DEEP = dict(max_bounces=8)
WHITE, HALF, BLACK = (1.0, 1.0, 1.0), (0.5, 0.5, 0.5), (0.0, 0.0, 0.0)
# Of a portal that leads straight on, beside what is transparent: together they are not there.
WINDOWS = {"portal": (WHITE, BLACK), "portal and transparent": (HALF, HALF), "by colour": ((1, 0.3, 0), (0, 0.7, 1))}
SYSTEMS = {
    "learned": dict(direct="LEARNED", secondary="LEARNED", guiding="ON"),
    "shared": dict(indirect="CELL_SHARED", share_trial=False, light_samples=2),
    "reservoirs": dict(direct="RESTIR", secondary="CELL_RESERVOIRS"),
    "paths of neighbours": dict(indirect="WORLD_REUSE"),
}
CASE_RATE = sidak(FALSE_ALARM_RATE, len(WINDOWS) + 3 * len(SYSTEMS) + 1)


@pytest.mark.parametrize("window", WINDOWS)
def test_what_leads_straight_on_is_not_there(window: str) -> None:
    """Planted bug: it takes a fifth of the light away."""
    without = block_replicas(room(lamps=True), 1, **DEEP)
    there = block_replicas(room(lamps=True, sheet=portal(*WINDOWS[window])), 101, samples=48, **DEEP)
    result = compare_replicas(without, there, CASE_RATE)
    assert result.agrees, result
    dim = block_replicas(room(lamps=True, sheet=portal((0.8, 0.8, 0.8))), 201, samples=48, **DEEP)
    assert not compare_replicas(without, dim, CASE_RATE).agrees


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("bounces", [1, 2])
def test_the_last_bounce_goes_through_as_well(system: str, bounces: int) -> None:
    """Planted bug: a bounce less."""
    without = block_replicas(room(lamps=True), 1, max_bounces=bounces)
    settings = dict(samples=48, max_bounces=bounces) | SYSTEMS[system]
    there = block_replicas(room(lamps=True, sheet=portal(WHITE)), 101, **settings)
    result = compare_replicas(without, there, CASE_RATE)
    assert result.agrees, result
    fewer = block_replicas(room(lamps=True, sheet=portal(WHITE)), 101, **settings | dict(max_bounces=bounces - 1))
    assert not compare_replicas(without, fewer, CASE_RATE).agrees


def lit_through(sheet: core.MaterialProgram | None, brightness: float = 1.0) -> np.ndarray:
    """A floor under a lamp without shadow that is not in the picture, with a sheet between."""
    scene = SceneDescription()
    scene.add_quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), principled((0.7, 0.65, 0.6)), "floor")
    light = (30.0 * brightness,) * 3
    scene.builder.add_point_light("lamp", (0.5, 0.3, 3.0), 0.6, light, soft=False, casts_shadow=False)
    if sheet:
        scene.add_quad((-20, -20, 1), (40, 0, 0), (0, 40, 0), sheet, "sheet")
    scene.set_environment((0.0, 0.0, 0.0))
    scene.set_camera((0.0, -2.0, 0.9), (0.0, -0.5, 0.0), 0.7)
    return block_replicas(scene.snapshot(), 1 if sheet else 101, max_bounces=1)


def test_lamps_without_shadow_are_met_once() -> None:
    """By light samples and by rays that go straight on beside a portal. Planted bug: a tenth more."""
    without, there = lit_through(None), lit_through(portal((0.2, 0.2, 0.2), (0.8, 0.8, 0.8), move=(1000.0, 0.0, 0.0)))
    result = compare_replicas(without, there, CASE_RATE)
    assert result.agrees, result
    assert not compare_replicas(without, lit_through(None, 1.1), CASE_RATE).agrees


def lit_from(height: float, brightness: float = 1.0) -> core.Scene:
    """A floor below a lamp and a board, both so much higher than they seem: a ray portal leads to them."""
    scene = SceneDescription()
    scene.add_quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), principled((0.7, 0.65, 0.6)), "floor")
    scene.add_quad((-2, -2, 3 + height), (0, 4, 0), (4, 0, 0), principled((0.8, 0.5, 0.3)), "board")
    scene.builder.add_point_light("lamp", (0.5, 0.3, 2.0 + height), 0.6, (30.0 * brightness,) * 3, soft=False)
    if height:
        scene.add_quad((-20, -20, 1), (40, 0, 0), (0, 40, 0), portal(WHITE, move=(0.0, 0.0, height)), "portal")
    scene.set_environment((0.0, 0.0, 0.0))
    scene.set_camera((0.0, -2.5, 0.9), (0.0, 0.0, 0.0), 0.9)
    return scene.snapshot()


@pytest.mark.parametrize("system", SYSTEMS)
def test_systems_agree(system: str) -> None:
    """With a bounce: the board does not see the floor through the portal. Planted bug: a lamp that is 8 % brighter."""
    near = block_replicas(lit_from(0.0), 1, max_bounces=1)
    settings = dict(samples=48, max_bounces=1) | SYSTEMS[system]
    far = block_replicas(lit_from(5.0), 101, **settings)
    result = compare_replicas(near, far, CASE_RATE)
    assert result.agrees, result
    brighter = block_replicas(lit_from(5.0, 1.08), 201, **settings)
    assert not compare_replicas(near, brighter, CASE_RATE).agrees


def test_the_picture_is_the_same_on_any_number_of_threads() -> None:
    one, three = (finished(lit_from(5.0), threads=threads, **DEEP) for threads in (1, 3))
    assert np.array_equal(picture(one), picture(three))
