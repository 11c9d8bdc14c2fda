"""Sessions with a window of thin glass: to all but the camera's rays what is clear of it is transparent.

False-alarm rate of all comparisons in this file together: FALSE_ALARM_RATE.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.core_scenes import principled
from tests.support.statistics import compare_replicas, sidak
from tests.support.window_room import block_replicas, finished, picture, room

FALSE_ALARM_RATE = 0.01
SYSTEMS = {
    "learned": dict(direct="LEARNED", secondary="LEARNED", guiding="ON"),
    "shared": dict(indirect="CELL_SHARED", share_trial=False, light_samples=2),
    "reservoirs": dict(direct="RESTIR", secondary="CELL_RESERVOIRS"),
    "paths of neighbours": dict(indirect="WORLD_REUSE"),
}
ROUGHNESS = {"clear": 0.0, "frosted": 0.3}
CASE_RATE = sidak(FALSE_ALARM_RATE, len(SYSTEMS) * len(ROUGHNESS) + 1)
DEEP = dict(max_bounces=8)
GREY = (0.9, 0.9, 0.9)


@pytest.mark.parametrize("roughness", ROUGHNESS)
@pytest.mark.parametrize("system", SYSTEMS)
def test_systems_agree(system: str, roughness: str) -> None:
    """Planted bug: a fifth more light."""
    glass = principled(GREY, transmission=1.0, roughness=ROUGHNESS[roughness], is_thin=True)
    paths = block_replicas(room(sheet=glass, lamps=True), 1, **DEEP)
    other = block_replicas(room(sheet=glass, lamps=True), 101, **SYSTEMS[system], **DEEP)
    result = compare_replicas(paths, other, CASE_RATE)
    assert result.agrees, result
    brighter = block_replicas(room(1.2, sheet=glass, lamps=True), 201, **SYSTEMS[system], **DEEP)
    assert not compare_replicas(paths, brighter, CASE_RATE).agrees


def test_a_clear_sheet_of_index_1_is_not_there() -> None:
    """Planted bug: an index of 1.5."""
    sheets = [principled((1.0, 1.0, 1.0), transmission=1.0, roughness=0.0, is_thin=True, ior=ior) for ior in (1.0, 1.5)]
    without = block_replicas(room(lamps=True), 1, **DEEP)
    there, of_glass = (block_replicas(room(sheet=sheet, lamps=True), 101, **DEEP) for sheet in sheets)
    result = compare_replicas(without, there, CASE_RATE)
    assert result.agrees, result
    assert not compare_replicas(without, of_glass, CASE_RATE).agrees


def test_the_picture_is_the_same_on_any_number_of_threads() -> None:
    glass = principled(GREY, transmission=1.0, roughness=0.0, is_thin=True)
    one, three = (finished(room(sheet=glass), threads=threads, **DEEP) for threads in (1, 3))
    assert np.array_equal(picture(one), picture(three))
