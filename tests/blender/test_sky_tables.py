"""Tables of skies: what can be known of them without Cycles."""

import itertools
import math

import numpy as np
import pytest

from addon.sync.nodes.sky import _wrapped_place
from addon.sync.sky import multiple_scattering, preetham, single_scattering
from addon.sync.sky.table import COLUMNS, ROWS, Atmosphere, row_elevations

MODELS = [single_scattering, multiple_scattering]
CLEAR = Atmosphere(sun_elevation=0.4, altitude=100.0, air=1.0, aerosol=1.0, ozone=1.0)
BLUE, RED = 2, 0  # of XYZ: what blue and red do most to


@pytest.mark.parametrize("model", MODELS)
def test_the_sky_is_mirrored_at_the_sun_and_brightest_there(model) -> None:
    table = model.sky_table(CLEAR)
    assert table.shape == (ROWS, COLUMNS, 3) and table.dtype == np.float32
    np.testing.assert_array_equal(table, table[:, ::-1])
    at_sun = int(np.argmin(np.abs(row_elevations() - CLEAR.sun_elevation)))
    assert abs(int(np.argmax(table[at_sun, : COLUMNS // 2, 1])) - COLUMNS // 2) < 2


@pytest.mark.parametrize("model", MODELS)
def test_the_zenith_is_blue_and_a_setting_sun_red(model) -> None:
    table = model.sky_table(CLEAR)
    assert table[-1, 0, BLUE] > 1.2 * table[-1, 0, RED]
    low = model.sun_disc(Atmosphere(0.02, 100.0, 1.0, 1.0, 1.0), 0.01)
    high = model.sun_disc(Atmosphere(1.5, 100.0, 1.0, 1.0, 1.0), 0.01)
    assert low.bottom[1] < low.top[1] < 0.2 * high.top[1]
    assert low.top[BLUE] / low.top[RED] < 0.3 * high.top[BLUE] / high.top[RED]


@pytest.mark.parametrize("model", MODELS)
def test_a_wider_sun_gives_as_much_light(model) -> None:
    for diameter in (0.0005, 0.01, 0.1):
        disc = model.sun_disc(Atmosphere(1.0, 100.0, 1.0, 1.0, 1.0), diameter)
        flux = 0.5 * (disc.bottom[1] + disc.top[1]) * 2.0 * np.pi * (1.0 - np.cos(0.5 * diameter))
        reference = model.sun_disc(Atmosphere(1.0, 100.0, 1.0, 1.0, 1.0), 0.001)
        assert flux == pytest.approx(0.5 * (reference.bottom[1] + reference.top[1]) * np.pi * 0.0005**2, rel=2e-3)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("elevation", [-0.5 * math.pi, 0.0, 0.5 * math.pi])
def test_tables_are_finite_to_the_ends_of_the_sliders(model, elevation: float) -> None:
    for altitude, density in itertools.product((0.0, 1e5), (0.0, 1000.0)):
        atmosphere = Atmosphere(elevation, altitude, density, density, density)
        disc = model.sun_disc(atmosphere, 0.0005)
        for values in (model.sky_table(atmosphere), disc.bottom, disc.top):
            assert np.isfinite(values).all()


def test_preetham_is_finite_where_it_means_nothing() -> None:
    for elevation, turbidity in itertools.product((-1.5, 0.0, 1.5707), (1.0, 10.0)):
        table = preetham.sky_table(elevation, turbidity)
        assert np.isfinite(table).all() and table.min() >= 0.0


@pytest.mark.parametrize("turns", [-2, 0, 1])
def test_a_sun_past_the_zenith_comes_down_on_the_other_side(turns: int) -> None:
    place = _wrapped_place(math.pi - 0.3 + 2.0 * math.pi * turns, 0.2)
    assert place.elevation == pytest.approx(0.3)
    assert place.direction == pytest.approx(
        (-math.cos(0.3) * math.sin(0.2), -math.cos(0.3) * math.cos(0.2), math.sin(0.3))
    )
