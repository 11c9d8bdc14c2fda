"""Blender as a module under pytest: a fresh configuration, an empty scene, and nothing left registered at exit."""

import atexit
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
for folder in (ROOT, Path(__file__).resolve().parent):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
from tests.support.blender_folder import use_own_folder  # noqa: E402

use_own_folder()

import bpy  # noqa: E402


@pytest.fixture(scope="session")
def built_core() -> ModuleType:
    """The core itself, where others take a stand-in."""
    import cistern_core

    return cistern_core


@pytest.fixture
def empty_scene() -> Iterator[bpy.types.Scene]:
    """The scene of a new, empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield bpy.context.scene


@pytest.fixture
def watched(empty_scene) -> Iterator[Any]:
    """A live scene (watched_scene.Watched)."""
    from watched_scene import watching

    with watching() as scene:
        yield scene


class ProbeEngine(bpy.types.RenderEngine):
    """Renders nothing; hands the dependency graph of a final render to `probe`."""

    bl_idname = "CISTERN_PROBE"
    bl_label = "Cistern probe"
    probe: Callable[[bpy.types.Depsgraph], Any] | None = None
    answer: Any = None
    error: Exception | None = None

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        try:
            ProbeEngine.answer = ProbeEngine.probe(depsgraph)
        except Exception as error:  # Blender would swallow it
            ProbeEngine.error = error


@pytest.fixture(scope="session")
def _probe_engine() -> Iterator[None]:
    bpy.utils.register_class(ProbeEngine)
    yield
    bpy.utils.unregister_class(ProbeEngine)


@pytest.fixture
def with_render_depsgraph(_probe_engine) -> Callable[[Callable[[bpy.types.Depsgraph], Any]], Any]:
    """Calls a function with the dependency graph that engines get in a final render, and returns its answer."""

    def call(probe: Callable[[bpy.types.Depsgraph], Any]) -> Any:  # noqa: ANN401
        scene = bpy.context.scene
        scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = ProbeEngine.bl_idname, 4, 4
        ProbeEngine.probe, ProbeEngine.answer, ProbeEngine.error = staticmethod(probe), None, None
        bpy.ops.render.render()
        if ProbeEngine.error is not None:
            raise ProbeEngine.error
        return ProbeEngine.answer

    return call


@pytest.fixture
def camera_scene(empty_scene, monkeypatch) -> bpy.types.Scene:
    """A scene with a camera, and material programs that are empty but for their name."""
    from small_objects import link

    from addon.sync import materials

    def named(material: bpy.types.Material | None, context: Any) -> Any:  # noqa: ANN401
        return context.core.MaterialProgram(material.name if material else "default")

    monkeypatch.setattr(materials, "compile_material", named)
    monkeypatch.setattr(materials, "compile_world", named)
    monkeypatch.setattr(materials, "compile_light", lambda light, context: None)
    empty_scene.camera = link("Eye", bpy.data.cameras.new("Eye"))
    return empty_scene


@pytest.fixture
def recorded_sync(camera_scene, with_render_depsgraph) -> Callable[[], tuple[Any, Any]]:
    """Syncs the scene as a final render would, into a builder that records; returns that and a SyncReport."""
    import fake_core

    from addon.sync.scene import sync_scene

    def run() -> tuple[Any, Any]:
        builder = fake_core.SceneBuilder()
        return builder, with_render_depsgraph(lambda graph: sync_scene(graph, builder, core=fake_core.CORE))

    return run


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
