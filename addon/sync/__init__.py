"""Turns an evaluated dependency graph into the arrays of the native core.

Converters are functions from evaluated data-blocks to NumPy arrays or plain keyword arguments; none of them looks at
the user interface, and none keeps a reference to Blender's data after it returned.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

MATTE_KINDS = ("object", "material", "asset")


class SyncError(ValueError):
    """The scene cannot be rendered as it is; the text names the data-block and what is missing."""


class SyncStoppedError(Exception):
    """The user wants no picture of the scene any more."""


@dataclass
class SyncReport:
    """What one sync has to tell the user, and when it has to look whether the user still wants it."""

    warnings: list[str] = field(default_factory=list)
    """One line each, naming the data-block; no line twice."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall time by stage."""
    matte_names: dict[str, set[str]] = field(default_factory=lambda: {kind: set() for kind in MATTE_KINDS})
    """Names of all objects, materials and assets (topmost parents) with surfaces that were looked at."""

    surface_items: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, np.intp))
    """By instance of the builder: the item of the dependency graph that it shows."""

    is_stopped: Callable[[], bool] = lambda: False
    by_source: dict[Hashable, dict[str, None]] = field(default_factory=dict)
    """The warnings again, in order, by what they tell of."""
    earlier: dict[Hashable, dict[str, None]] = field(default_factory=dict)
    """Those of syncs before, of what was not looked at again."""

    _told: set[str] = field(default_factory=set)
    _source: Hashable = None

    @contextmanager
    def about(self, source: Hashable) -> Iterator[None]:
        """What warns meanwhile is what there is to tell of `source`."""
        before, self._source = self._source, source
        self.earlier.pop(source, None)
        try:
            yield
        finally:
            self._source = before

    def warn(self, text: str) -> None:
        self.by_source.setdefault(self._source, {})[text] = None
        if text not in self._told:
            self._told.add(text)
            self.warnings.append(text)

    def look_up(self) -> None:
        """Between data-blocks, which take a second at most. Raises SyncStoppedError."""
        if self.is_stopped():
            raise SyncStoppedError
