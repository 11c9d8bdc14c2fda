"""A scene of the scoreboard at moments before and after an event, for the core and for Cycles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import radians
from typing import Any

import bpy
import cistern_core as core  # after Blender, so that both share one oneTBB
import numpy as np
from bpy.app.handlers import persistent
from mathutils import Matrix
from numpy.typing import NDArray

from addon.settings import viewport_settings
from addon.sync import SyncReport
from addon.sync.camera import camera_arguments
from addon.sync.changes import EVERYTHING, read_changes
from addon.sync.live import LiveSync
from addon.techniques import choose_preset
from tests.benchmark.interactive.catalogue import MOMENTS, Moment
from tests.benchmark.papers.sessions import open_scene
from tests.benchmark.scoreboard.catalogue import Engine, Scene
from tests.benchmark.scoreboard.render import GUIDES, cpu_seconds, prepare_picture
from tests.support import engines

SECONDS = 3600.0
AUTO = "AUTO"  # Cycles' choice of which sides of a glowing surface to sample


class Stage:
    """One scene that goes from moment to moment; needs the add-on registered. Pictures are (height, width, 3), row 0 at
    the bottom."""

    def __init__(self, scene: Scene, pixels: int) -> None:
        open_scene(scene)
        self._scene = bpy.context.scene
        prepare_picture(self._scene, pixels)
        self._camera = self._scene.camera.matrix_world.copy()
        self._glow = first_glow()
        self._brightness = np.array(self._glow.default_value)
        self._auto_materials = [m for m in bpy.data.materials if m.cycles.emission_sampling == AUTO]
        self._scenes = self._export(MOMENTS)
        self.cache = core.RenderCache()

    def _go_to(self, moment: Moment) -> None:
        turned = Matrix.Rotation(radians(moment.degrees), 4, "Z")
        place, rotation, _ = (self._camera @ Matrix.Translation((moment.metres, 0.0, 0.0))).decompose()
        self._scene.camera.matrix_world = Matrix.Translation(place) @ turned @ rotation.to_matrix().to_4x4()
        self._glow.default_value = self._brightness * [*[moment.brightness] * 3, 1.0]
        bpy.context.view_layer.update()

    def _export(self, moments: Iterable[Moment]) -> dict[Moment, core.Scene]:
        """As the viewport has them: of what a moment leaves alone, the same objects as in the one before."""
        sync = LiveSync(core)
        sync.sync(bpy.context.evaluated_depsgraph_get(), EVERYTHING)

        @persistent
        def follow(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
            sync.sync(depsgraph, read_changes(depsgraph))

        found = {}
        bpy.app.handlers.depsgraph_update_post.append(follow)
        try:
            for moment in moments:
                self._go_to(moment)
                camera = self._scene.camera.evaluated_get(bpy.context.evaluated_depsgraph_get())
                sync.builder.set_camera(**camera_arguments(self._scene, camera, SyncReport()))
                found[moment] = sync.builder.snapshot()
        finally:
            bpy.app.handlers.depsgraph_update_post.remove(follow)
            sync.close()
        return found

    def settings(self, chosen: Mapping[str, Any]) -> dict[str, Any]:
        """The core's, of a viewport with a preset and what else is set by hand."""
        settings = self._scene.cistern
        settings.viewport_preset = "RENDER"
        choose_preset(settings, chosen["preset"])
        for name in chosen.keys() - {"preset"}:
            setattr(settings, name, chosen[name])
        render = self._scene.render
        size = {"width": render.resolution_x, "height": render.resolution_y}
        return viewport_settings(core, self._scene) | size

    def session(
        self, moment: Moment, samples: int, seed: int, settings: Mapping[str, Any]
    ) -> tuple[NDArray[np.float32], float]:
        """The mean of the samples of a session and its CPU seconds, all of them. It goes on with the history of the
        one before. Raises RuntimeError when the render fails or meets numbers that are not finite."""
        before = cpu_seconds()
        session = self._run(moment, settings | {"samples": samples, "seed": seed})
        seconds = cpu_seconds() - before
        return session.read("Combined")[..., :3], seconds

    def guides(self, moment: Moment, samples: int, settings: Mapping[str, Any]) -> dict[str, NDArray[np.float32]]:
        """For a denoiser; not without noise at edges."""
        session = self._run(moment, settings | {"samples": samples, "passes": [*GUIDES.values()]})
        return {name: session.read(pass_name)[..., :3] for name, pass_name in GUIDES.items()}

    def _run(self, moment: Moment, settings: Mapping[str, Any]) -> core.Session:
        session = core.Session(core.Settings(**settings))
        session.start(self._scenes[moment], self.cache)
        progress = session.wait(SECONDS)
        if progress.status is not core.Status.DONE or progress.non_finite_samples or progress.non_finite_weights:
            raise RuntimeError(f"{progress.status.name}: {progress.error or 'numbers that are not finite'}")
        return session

    def cycles(self, moment: Moment, samples: int, seed: int, engine: Engine) -> tuple[NDArray[np.float32], float]:
        """The same by Cycles; its seconds are those of all that rendering a scene anew takes."""
        self._go_to(moment)
        for material in self._auto_materials:
            material.cycles.emission_sampling = engine.emission_sampling or AUTO
        before = cpu_seconds()
        picture = engines.render(self._scene, "CYCLES", samples, seed)[..., :3]
        return picture, cpu_seconds() - before


def first_glow() -> bpy.types.NodeSocket:
    """The colour in which a material of the scene emits."""
    for material in bpy.data.materials:
        for node in material.node_tree.nodes if material.node_tree else ():
            if node.type == "EMISSION" and not node.inputs["Color"].is_linked:
                return node.inputs["Color"]
    raise ValueError("no material of the scene emits a colour that can be edited")
