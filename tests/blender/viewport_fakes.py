"""Stand-ins for what a viewport needs from Blender's windows and from the core, with a core that renders on command."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType, SimpleNamespace

import bpy
import numpy as np
from mathutils import Matrix

from addon.sync.changes import EVERYTHING
from addon.sync.live import LiveSync
from addon.viewport_camera import View, viewport_view
from addon.viewport_render import ViewportRender
from tests.blender.engine_fakes import LightSampling, PixelFilter, Status

REGION = (64, 48)


class FakeViewportCore(ModuleType):
    """Every frame takes `frame_seconds`; `sessions` holds all sessions in order. A frame shows its session's number."""

    def __init__(self):
        super().__init__("cistern_core")
        self.Status, self.LightSampling, self.PixelFilter = Status, LightSampling, PixelFilter
        self.Settings = lambda **members: SimpleNamespace(**members)
        self.Session = lambda settings: FakeViewportSession(self, settings)
        self.RenderCache = SimpleNamespace
        self.frame_seconds = 0.002
        self.building_seconds = 0.0
        self.failure = ""
        self.sessions = []


class FakeViewportSession:
    def __init__(self, core, settings):
        self.core, self.settings = core, settings
        self.is_cancelled = False
        self.number = len(core.sessions)
        self.reads = []
        core.sessions.append(self)

    def start(self, scene, cache):
        self.scene, self.cache, self.started = scene, cache, time.perf_counter()
        self.thread = threading.current_thread()

    def wait(self, seconds):
        time.sleep(min(seconds, self.core.frame_seconds))
        elapsed = time.perf_counter() - self.started - self.core.building_seconds
        done = min(max(int(elapsed / self.core.frame_seconds), 0), self.settings.samples)
        status = Status.DONE if done == self.settings.samples else Status.RUNNING
        if self.core.failure:
            status = Status.FAILED
        return SimpleNamespace(
            status=Status.CANCELLED if self.is_cancelled else status,
            frames_done=done,
            pixels_left=1.0,
            openings=0,
            frames=self.settings.samples,
            noise=-1.0,
            remaining_seconds=-1.0,
            stage="Building" if elapsed < 0.0 else "Rendering",
            stage_done=0.0,
            error=self.core.failure,
            version=done,
        )

    def cancel(self):
        self.is_cancelled = True

    def read(self, name):
        _, _, width, height = self.settings.region
        self.reads.append(name)
        channels = {"Combined": 4, "Cell Occupancy": 1, "Cell Level": 1}.get(name, 3)
        return np.full((height, width, channels), float(self.number + 1), np.float32)


@contextmanager
def watched_render(core: FakeViewportCore) -> Iterator[ViewportRender]:
    """A rendering thread that keeps all its pictures, and has to end with the test."""
    pictures = []
    render = ViewportRender(core, lambda: pictures.append(render.picture))
    render.pictures = pictures
    yield render
    render.stop(waits=True)
    assert not render.is_alive


class FakeEngine:
    """Plays the RenderEngine; counts its calls."""

    def __init__(self):
        self.redraws = 0
        self.pixel_size = 1
        self.stats = ""

    def get_preview_pixel_size(self, scene):
        return self.pixel_size

    def update_stats(self, name, text):
        self.stats = text

    def tag_redraw(self):
        self.redraws += 1


def fake_space(**members):
    return SimpleNamespace(
        **{
            "clip_start": 0.1,
            "clip_end": 100.0,
            "use_render_border": False,
            "use_local_camera": False,
            "local_view": None,
            "use_local_collections": False,
            "camera": None,
            **members,
        }
    )


def perspective(aspect=REGION[0] / REGION[1], shift=(0.0, 0.0), zoom=2.0):
    """Blender's window matrix of a perspective view that shows 2 / zoom at unit distance across."""
    matrix = Matrix.Identity(4)
    matrix[0][0], matrix[1][1] = zoom, zoom * aspect
    matrix[0][2], matrix[1][2] = shift
    matrix[2][2], matrix[2][3], matrix[3][2], matrix[3][3] = -1.002, -0.2002, -1.0, 0.0
    return matrix


def orthographic(width=10.0, aspect=REGION[0] / REGION[1]):
    matrix = Matrix.Identity(4)
    matrix[0][0], matrix[1][1], matrix[2][2] = 2.0 / width, 2.0 * aspect / width, -0.01
    return matrix


def fake_context(scene, window_matrix=None, view_matrix=None, perspective_name="PERSP", **space):
    return SimpleNamespace(
        scene=scene,
        region=SimpleNamespace(width=REGION[0], height=REGION[1]),
        region_data=SimpleNamespace(
            window_matrix=window_matrix if window_matrix is not None else perspective(),
            view_matrix=view_matrix if view_matrix is not None else Matrix.Translation((0.0, 0.0, -5.0)),
            view_perspective=perspective_name,
        ),
        space_data=fake_space(**space),
    )


def look_through_camera(scene: bpy.types.Scene, size: tuple[int, int], sync: LiveSync) -> View:
    """Exports the scene; what a viewport of that size sees whose picture is the whole one of the scene's camera."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = scene.camera.evaluated_get(depsgraph)
    window = camera.calc_matrix_camera(depsgraph, x=size[0], y=size[1])
    context = fake_context(scene, window, camera.matrix_world.inverted(), "CAMERA")
    context.region.width, context.region.height = size
    view = viewport_view(context, depsgraph)
    sync.sync(depsgraph, EVERYTHING)
    sync.builder.set_camera(**view.camera_arguments())
    return view
