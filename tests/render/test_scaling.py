"""The numbers of the scaling benchmark: marginal costs, growth against a logarithm, kinds of work by name."""

from collections import Counter

import pytest

from tests.benchmark.scaling.__main__ import Axis, axis_table, log_fit
from tests.benchmark.scaling.breakdown import BOOKKEEPING, has_symbols, kind_of_work
from tests.benchmark.scaling.measure import Cost, cost


def test_cost_is_the_difference_of_many_samples_and_few():
    """Of three repeats: 1.0, 1.2 and 5.0 s of CPU time for 1,000,000 samples of pixels; wall time by the shortest."""
    runs = [[(0.5, 0.4, 1), (1.5, 0.9, 2)], [(0.5, 0.3, 1), (1.7, 1.4, 2)], [(1.0, 0.9, 1), (6.0, 4.0, 3)]]
    found = cost(runs, 1.0)
    assert found.microseconds == pytest.approx(1.2)
    assert found.wall_microseconds == pytest.approx(0.6)
    assert found.memory_bytes == 3


def test_growth_beyond_a_logarithm_shows_in_the_last_step():
    axis = Axis((10, 100, 1000), "lights", "lights", ("even", "steep"))
    even = [Cost(1.0 + 0.5 * k, 0.0, 10**k) for k in range(3)]
    steep = [Cost(10.0**k, 0.0, 0) for k in range(3)]
    assert log_fit(axis, even) == pytest.approx((0.5, 0.5))
    rows = axis_table(axis, {"even": even, "steep": steep})
    assert rows[-2] == "| even | 1.00 | 1.50 | 2.00 | 0.50 | 0.50 | 0 |"
    assert rows[-1] == "| steep | 1.00 | 10.00 | 100.00 | 49.50 | 90.00 | 0 |"


@pytest.mark.parametrize(
    ("library", "symbol", "kind"),
    [
        ("libembree4.so.4", "0x1234", "Embree"),
        ("cistern_core.cpython-311.so", "cistern::HashGrid::sort_by_digit", BOOKKEEPING),
        ("cistern_core.cpython-311.so", "cistern::LightTree::choose", "Cistern"),
        ("libtbb.so.12", "tbb::detail::sort", "TBB"),
        ("libm.so.6", "sincosf", "C library"),
        ("numpy.so", "sort", "other"),
    ],
)
def test_kinds_of_work(library, symbol, kind):
    assert kind_of_work(library, symbol) == kind


def test_a_stripped_core_is_noticed():
    names = Counter({("cistern_core.so", "cistern::trace_path"): 3, ("libembree.so", "0x12"): 2})
    assert has_symbols(names)
    assert not has_symbols(Counter({("cistern_core.so", "0x0000abcd"): 3, ("libembree.so", "0x12"): 2}))
