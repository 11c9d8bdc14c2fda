"""Cistern: a render engine that resamples light in world space.

`register()` never needs the native core; the first render loads it.
"""

from . import engine, operators, preferences, properties, report, ui

__all__ = ["register", "report", "unregister"]


def register() -> None:
    properties.register()
    operators.register()
    ui.register()
    engine.register()
    preferences.register()


def unregister() -> None:
    preferences.unregister()
    engine.unregister()
    ui.unregister()
    operators.unregister()
    properties.unregister()
