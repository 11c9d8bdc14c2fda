"""Scenes with volumes or dispersion: no technique that shares or keeps light knows them, so the core traces paths there
instead."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .techniques import is_reference

if TYPE_CHECKING:
    from cistern_core import Scene


def warning(scene: Scene, arguments: dict[str, Any]) -> str | None:
    """What to tell users of techniques that are more than a shorter way to the pictures of path tracing. `arguments`
    are those of the core's `Settings`."""
    plain = arguments | ({"indirect": "PATH"} if arguments["indirect"] == "CELL_SHARED" else {})
    is_shorter_way = is_reference(plain) and not arguments.get("temporal_reuse") and arguments.get("bias") != "FAST"
    if is_shorter_way:
        return None
    for name, what in ((scene.volume_name, "a volume"), (scene.dispersive_name, "dispersion")):
        if name:
            return f"'{name}' has {what}, which reuse of light does not know: the scene is rendered by path tracing"
    return None
