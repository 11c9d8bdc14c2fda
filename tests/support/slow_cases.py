"""Cases of a parametrized test of which some run in the full run alone."""

from collections.abc import Iterable, Set

import pytest


def marked(cases: Iterable[str], slow: Set[str]) -> list:
    """`cases` in order, those in `slow` with the mark of that name. Raises where `slow` names none of them."""
    names = list(cases)
    if not slow <= set(names):
        raise ValueError(f"no such cases: {sorted(slow - set(names))}")
    return [pytest.param(name, marks=pytest.mark.slow) if name in slow else name for name in names]
