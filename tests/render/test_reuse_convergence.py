"""Frames without history are independent of each other: their mean's squared error falls like 1/N. History, or a bias,
bends the line. The tolerance is that of issue and theory; with these repeats the slope's own error is about 0.02.
"""

from __future__ import annotations

import functools

import pytest

from tests.support.convergence import Reference, squared_errors
from tests.support.path_scenes import indirect_room
from tests.support.statistics import convergence_slope

SIZE = 16
LIMITS = dict(max_bounces=3, sequence="RANDOM")
REUSE = dict(light_candidates=4, spatial_radius=6.0, cache_candidates=16, cache_refresh=4)
WITHOUT_HISTORY: dict[str, dict] = {
    "RIS": dict(direct="RIS", secondary="RIS"),
    "RESTIR": dict(direct="RESTIR", temporal_reuse=False),
    "CELL_RESERVOIRS": dict(secondary="CELL_RESERVOIRS", temporal_reuse=False),
    "SCREEN_REUSE": dict(indirect="SCREEN_REUSE", temporal_reuse=False),
    "WORLD_REUSE": dict(indirect="WORLD_REUSE", temporal_reuse=False),
    "CELL_SHARED": dict(indirect="CELL_SHARED", temporal_reuse=False),
    "SCREEN_REUSE in every second tile": dict(indirect="SCREEN_REUSE", temporal_reuse=False, path_multi_bounce=0.5),
}


@functools.cache
def reference() -> Reference:
    return Reference(indirect_room(), SIZE, 65536, **LIMITS)


@pytest.mark.slow
@pytest.mark.parametrize("system", WITHOUT_HISTORY)
def test_frames_without_history_converge_with_slope_minus_one(system: str) -> None:
    settings = LIMITS | REUSE | WITHOUT_HISTORY[system]
    errors = squared_errors(indirect_room(), SIZE, reference(), **settings)
    assert convergence_slope(errors) == pytest.approx(-1.0, abs=0.05), errors


@pytest.mark.slow
def test_a_bias_bends_the_line() -> None:
    """Planted: 1/M instead of unbiased weights; a reference 2 % too bright."""
    settings = LIMITS | REUSE | dict(indirect="SCREEN_REUSE", temporal_reuse=False)
    scene = indirect_room()
    assert convergence_slope(squared_errors(scene, SIZE, reference(), 2, bias="FAST", **settings)) > -0.95
    assert convergence_slope(squared_errors(scene, SIZE, reference(), 2, excess=0.02, **settings)) > -0.95
