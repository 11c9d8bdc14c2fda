"""Cistern: a render engine that resamples light in world space.

`register()` never needs the native core; the first render loads it.
"""

from . import command_line, engine, operators, preferences, properties, report, ui

__all__ = ["register", "report", "unregister"]


def register() -> None:
    properties.register()
    operators.register()
    ui.register()
    engine.register()
    preferences.register()
    command_line.register()


def unregister() -> None:
    command_line.unregister()
    preferences.unregister()
    engine.unregister()
    ui.unregister()
    operators.unregister()
    properties.unregister()
