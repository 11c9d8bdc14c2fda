"""Blender as a module under pytest: a fresh configuration, an empty scene, and nothing left registered at exit."""

import atexit
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
for folder in (ROOT, Path(__file__).resolve().parent):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
# Before Blender starts, or the user's own configuration is read.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="cistern-tests-")

import bpy  # noqa: E402


@pytest.fixture
def empty_scene() -> Iterator[bpy.types.Scene]:
    """The scene of a new, empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield bpy.context.scene


@pytest.fixture(scope="session")
def registered_addon() -> Iterator[None]:
    """The engine, registered as the README's scripts do it; a class left registered crashes some Blender at exit."""
    import addon

    addon.register()
    atexit.register(_unregister_once, addon)
    yield
    _unregister_once(addon)


_unregistered: set[str] = set()


def _unregister_once(module) -> None:
    if module.__name__ not in _unregistered:
        _unregistered.add(module.__name__)
        module.unregister()
