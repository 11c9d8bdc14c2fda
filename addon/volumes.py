"""Scenes with volumes: no technique that shares or keeps light knows them, so the core traces paths there instead."""

from __future__ import annotations

from typing import Any

from .techniques import is_reference


def warning(volume_name: str, arguments: dict[str, Any]) -> str | None:
    """What to tell users of techniques that are more than a shorter way to the pictures of path tracing. `arguments`
    are those of the core's `Settings`."""
    plain = arguments | ({"indirect": "PATH"} if arguments["indirect"] == "CELL_SHARED" else {})
    is_shorter_way = is_reference(plain) and not arguments.get("temporal_reuse") and arguments.get("bias") != "FAST"
    if not volume_name or is_shorter_way:
        return None
    return f"'{volume_name}' has a volume, which reuse of light does not know: the scene is rendered by path tracing"
