"""Which cases run every day: where there are many, a share of those of each test. `tests/run.sh --full` runs all."""

from collections import Counter
from pathlib import Path

import pytest

# Of the cases of each test, by the beginning of its file's path in tests/.
SHARES = {"blender/test_against_cycles_": 0.2, "blender/test_passes": 0.5, "render/test_": 0.25}

# Multiples of it fall evenly into [0, 1), and keep step with no other number.
GOLDEN_RATIO = 0.6180339887498949


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Marks the rest as slow, unless cases are asked for. The first case of each test runs every day."""
    options = config.option
    if options.keyword or options.lf or options.failedfirst or any("::" in argument for argument in config.args):
        return
    cases: Counter[str] = Counter()
    for item in items:
        share = share_of(item)
        if share == 1.0 or item.get_closest_marker("slow"):
            continue
        test = item.nodeid.partition("[")[0]
        if cases[test] * GOLDEN_RATIO % 1.0 >= share:
            item.add_marker(pytest.mark.slow)
        cases[test] += 1


def share_of(item: pytest.Item) -> float:
    path = item.path.relative_to(Path(__file__).parent).as_posix()
    return next((share for beginning, share in SHARES.items() if path.startswith(beginning)), 1.0)
