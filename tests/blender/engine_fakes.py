"""Stands in for the native core and the scene export, so that the engine's own part can be tested alone.

The fake core "renders" pictures that tell where a pixel lies: Combined holds the full frame's x and y.
"""

import sys
from enum import Enum
from pathlib import Path
from types import ModuleType, SimpleNamespace

import bpy
import numpy as np
import OpenImageIO

import addon
from addon.sync import SyncReport

CONSTANTS = {
    "Direct": (0.5, 0.25, 0.125),
    "Indirect": (1.0, 2.0, 3.0),
    "Emission": (4.0, 5.0, 6.0),
    "Emission Noise": (0.25, 0.5, 1.0),
    "Environment": (7.0, 8.0, 9.0),
    "Unscattered Emission": (2.0, 2.5, 3.0),
    "Unscattered Environment": (3.5, 4.0, 4.5),
    "Diffuse Direct": (0.125, 0.25, 0.375),
    "Diffuse Indirect": (0.5, 0.625, 0.75),
    "Diffuse Color": (0.875, 0.0, 0.125),
    "Glossy Direct": (1.125, 1.25, 1.375),
    "Glossy Indirect": (1.5, 1.625, 1.75),
    "Glossy Color": (0.875, 0.5, 0.25),
    "Transmission Direct": (2.125, 2.25, 2.375),
    "Transmission Indirect": (2.5, 2.625, 2.75),
    "Transmission Color": (0.25, 0.375, 0.5),
    "Volume Direct": (3.125, 3.25, 3.375),
    "Volume Indirect": (3.5, 3.625, 3.75),
    "Depth": (12.5,),
    "Normal": (0.0, 0.0, 1.0),
    "Position": (-1.0, -2.0, -3.0),
    "Mist": (0.375,),
    "Ambient Occlusion": (0.625, 0.625, 0.625),
    "UV": (0.25, 0.75, 1.0),
    "Vector": (1.0, -2.0, 3.0, -4.0),
    "Object Index": (3.0,),
    "Material Index": (5.0,),
    "Cells": (0.125, 0.75, 0.5),
    "Cell Occupancy": (64.0,),
    "Cell Level": (4.0,),
    "Normal Bin": (0.25, 0.5, 0.875),
    "Reservoir Confidence": (16.0,),
    "Reservoir Weight": (100.0,),
    "Reuse Count": (8.0,),
    "Light Choice Entropy": (0.5**0.5,),
    "Light Choice Samples": (4096.0,),
    "Sample Count": (64.0,),
    "Guided": (0.5**0.5,),
    "Denoising Albedo": (0.25, 0.5, 0.75),
    "Denoising Normal": (0.0, 1.0, 0.0),
}


class FakeError(RuntimeError):
    """Plays cistern_core.Error."""


class Status(Enum):
    RUNNING = 0
    DONE = 1
    CANCELLED = 2
    FAILED = 3


class LightSampling(Enum):
    UNIFORM = 0
    POWER = 1
    TREE = 2


class PixelFilter(Enum):
    BOX = 0
    GAUSSIAN = 1
    BLACKMAN_HARRIS = 2


class FakeCore(ModuleType):
    """The module; its attributes `failure`, `non_finite_samples` and `settings` steer and record a test's renders."""

    def __init__(self):
        super().__init__("cistern_core")
        self.Error = FakeError
        self.Status = Status
        self.LightSampling = LightSampling
        self.PixelFilter = PixelFilter
        self.Settings = lambda **members: SimpleNamespace(**members)
        self.Session = lambda settings: FakeSession(self, settings)
        self.failure = ""
        self.non_finite_samples = 0
        self.non_finite_weights = 0
        self.caching = []  # shares of "Caching light" to tell of before the first sample
        self.settings = []
        self.cancelled_sessions = 0


class FakeSession:
    """Finishes one sample for every `wait`."""

    def __init__(self, core, settings):
        self.core = core
        self.settings = settings
        self.frames_done = 0
        self.caching = list(core.caching)
        self.status = Status.RUNNING
        core.settings.append(settings)

    def start(self, scene, cache, shutter):
        assert (scene, cache, shutter) == (SNAPSHOT, None, None)

    def wait(self, seconds):
        assert 0.05 <= seconds <= 0.2
        cached = self.caching.pop(0) if self.caching else None
        if cached is None and self.status is Status.RUNNING:
            self.frames_done += 1
            if self.core.failure:
                self.status = Status.FAILED
            elif self.frames_done == self.settings.samples:
                self.status = Status.DONE
        return SimpleNamespace(
            status=self.status,
            frames_done=self.frames_done,
            frames=self.settings.samples,
            expected_frames=self.settings.samples,
            noise=-1.0,
            mean_samples=float(self.frames_done),
            pixels_left=1.0,
            openings=2 if cached is None else 0,
            seconds=0.1 * self.frames_done,
            remaining_seconds=1.0,
            stage="Rendering" if cached is None else "Caching light",
            stage_done=1.0 if cached is None else cached,
            error=self.core.failure,
            memory_bytes=3_000_000,
            non_finite_samples=self.core.non_finite_samples,
            non_finite_weights=self.core.non_finite_weights,
            version=self.frames_done,
        )

    def cancel(self):
        if self.status is Status.RUNNING:
            self.status = Status.CANCELLED
            self.core.cancelled_sessions += 1

    def read(self, name):
        x, y, width, height = self.settings.region
        if name == "Combined":
            columns, rows = np.meshgrid(np.arange(x, x + width), np.arange(y, y + height))
            ones = np.ones_like(columns)
            return np.stack([columns, rows, self.frames_done * ones, ones], axis=2).astype(np.float32)
        assert name in self.settings.passes
        return np.broadcast_to(np.array(CONSTANTS[name], np.float32), (height, width, len(CONSTANTS[name])))


SNAPSHOT = SimpleNamespace(volume_name="", dispersive_name="", warnings=[], has_shadow_catchers=False)


def store_choice(scene, name, number):
    """In a setting, a number that no item has, as a file of a later version may."""
    settings = scene.cistern
    has_own_store = hasattr(settings, "bl_system_properties_get")  # from Blender 5.0 on
    (settings.bl_system_properties_get(do_create=True) if has_own_store else settings)[name] = number


class FakeExport:
    """Plays SceneSync; `instances` and `closed` count exporters, `syncs` and `cameras` hold what they were given."""

    instances = 0
    closed = 0
    syncs: list = []  # noqa: RUF012
    cameras: list = []  # noqa: RUF012
    warnings: tuple = ()
    failure: Exception | None = None

    def __init__(self):
        FakeExport.instances += 1
        self.builder = None

    def set_camera(self, **camera):
        FakeExport.cameras.append(camera)

    def drop(self):
        self.builder = None

    def close(self):
        FakeExport.closed += 1

    def sync(self, depsgraph, camera=None, motion=(), is_stopped=None, render=None):
        if FakeExport.failure is not None:
            raise FakeExport.failure
        self.builder = SimpleNamespace(snapshot=lambda **_: SNAPSHOT, set_camera=self.set_camera)
        FakeExport.syncs.append((depsgraph.scene_eval.frame_current, depsgraph.view_layer_eval.name))
        return SyncReport(warnings=list(FakeExport.warnings))


def install(monkeypatch):
    """Put the fakes in place for one test; returns the fake core."""
    core = FakeCore()
    module = ModuleType("addon.sync.scene")
    module.SceneSync = FakeExport
    monkeypatch.setitem(sys.modules, "cistern_core", core)
    monkeypatch.setitem(sys.modules, "addon.sync.scene", module)
    for name, value in (
        ("instances", 0),
        ("closed", 0),
        ("syncs", []),
        ("cameras", []),
        ("warnings", ()),
        ("failure", None),
    ):
        monkeypatch.setattr(FakeExport, name, value)
    return core


def fresh_scene(width=8, height=6, samples=2):
    """Blender's factory scene, to be rendered by our engine into a multilayer EXR."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.engine = "CISTERN"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.cistern.samples = samples
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER"
    image.color_depth = "32"
    return scene


def render(scene, folder: Path):
    """Render to a file; returns its channels and the reports of the render."""
    path = folder / "picture.exr"
    path.unlink(missing_ok=True)
    scene.render.filepath = str(path)
    addon.report.last.clear()
    bpy.ops.render.render(write_still=True)
    return read_channels(path), list(addon.report.last)


def read_channels(path: Path):
    """Channel name -> (height, width) array, row 0 at the bottom, from all parts of an EXR file."""
    reader = OpenImageIO.ImageInput.open(str(path))
    channels = {}
    part = 0
    while reader.seek_subimage(part, 0):
        spec = reader.spec()
        pixels = reader.read_image(part, 0, 0, spec.nchannels, OpenImageIO.FLOAT)
        for index, name in enumerate(spec.channelnames):
            channels[name] = np.flipud(pixels[..., index])
        part += 1
    reader.close()
    return channels
