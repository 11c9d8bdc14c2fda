"""Sessions whose light samples pass the glass of a window: the picture is that of scattered rays alone.

False-alarm rate of all comparisons in this file together: FALSE_ALARM_RATE.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.statistics import compare_replicas, sidak
from tests.support.window_room import block_replicas, finished, openings, picture, room

FALSE_ALARM_RATE = 0.01
PANE, TWO_PANES, ONE_FACE = (0.0, 0.01), (0.0, 0.01, 0.03, 0.04), (0.0,)
SYSTEMS = {
    "paths": {},
    "learned": dict(direct="LEARNED", secondary="LEARNED", guiding="ON"),
    "shared": dict(indirect="CELL_SHARED", share_trial=False, light_samples=2),
}
CASES = [
    *((PANE, system, True) for system in SYSTEMS),
    *((PANE, system, False) for system in SYSTEMS),
    (TWO_PANES, "paths", True),
    (TWO_PANES, "shared", True),
    (ONE_FACE, "paths", True),
    (ONE_FACE, "learned", True),
]
CASE_RATE = sidak(FALSE_ALARM_RATE, len(CASES))
DEEP = dict(max_bounces=8)


@pytest.mark.parametrize(("glass", "system", "finds"), CASES)
def test_light_samples_through_glass_change_nothing_but_noise(glass: tuple, system: str, finds: bool) -> None:
    """Planted bug: 8 % more sky. Without openings an even sky has no light samples: then the pictures are the same."""
    settings = SYSTEMS[system] | DEEP | dict(find_openings=finds)
    assert openings(finished(room(glass=glass), **settings)) == finds
    passing = block_replicas(room(glass=glass), 1, **settings)
    without = block_replicas(room(glass=glass), 101, light_through_panes=False, samples=64, **settings)
    result = compare_replicas(passing, without, CASE_RATE)
    assert result.agrees, result
    brighter = block_replicas(room(1.08, glass=glass), 201, **settings)
    assert not compare_replicas(brighter, without, CASE_RATE).agrees


@pytest.mark.parametrize("system", ["paths", "shared"])
def test_it_pays(system: str) -> None:
    """Of these seeds, 0.07 and 0.04 of the variance were measured."""
    settings = SYSTEMS[system] | DEEP
    passing = block_replicas(room(glass=PANE), 1, **settings)
    without = block_replicas(room(glass=PANE), 1, light_through_panes=False, **settings)
    assert passing.var(axis=0).mean() < 0.2 * without.var(axis=0).mean()


def test_nothing_is_found_where_samples_do_not_pass() -> None:
    assert openings(finished(room(glass=PANE), light_through_panes=False)) == 0
    assert openings(finished(room(glass=PANE), filter_glossy=1.0)) == 0


def test_the_picture_is_the_same_on_any_number_of_threads() -> None:
    one, three = (finished(room(glass=PANE), threads=threads, **DEEP) for threads in (1, 3))
    assert np.array_equal(picture(one), picture(three))


def sums(name: str, **settings: object) -> NDArray:
    session = finished(room(glass=PANE), samples=256, passes=[name], **DEEP, **settings)
    return session.read(name)[..., :3].mean(axis=(0, 1))


def test_light_that_passed_glass_is_indirect() -> None:
    """A scattering by each face follows that of the surface."""
    for passes in (True, False):
        for name in ("Direct", "Diffuse Direct", "Glossy Direct"):
            assert np.all(sums(name, light_through_panes=passes) < 1e-5), name  # beside the edges
    for name in ("Indirect", "Diffuse Indirect"):
        assert np.allclose(sums(name), sums(name, light_through_panes=False), rtol=0.1), name


@pytest.mark.parametrize("answers", [dict(direct="RESTIR"), dict(secondary="CELL_RESERVOIRS"),
                                     dict(indirect="WORLD_REUSE")])  # fmt: skip
def test_reservoirs_know_straight_lines_alone(answers: dict[str, str]) -> None:
    on, off = (picture(finished(room(glass=PANE), light_through_panes=p, **answers, **DEEP)) for p in (True, False))
    assert np.array_equal(on, off)
