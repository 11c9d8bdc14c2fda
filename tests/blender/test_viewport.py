"""A viewport between Blender's callbacks and the rendering thread, and its camera, without a window."""

import gc
import math
import threading
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector

import addon.engine
from addon import core as core_loader
from addon import viewport as viewport_module
from addon.session_render import RenderFailedError
from addon.sync import changes, live
from addon.viewport import Viewport
from addon.viewport_camera import WHOLE, viewport_view
from addon.viewport_draw import Screen
from tests.blender import viewport_fakes
from tests.blender.engine_fakes import fresh_scene
from tests.blender.test_viewport_render import wait_until
from tests.blender.viewport_fakes import FakeEngine, FakeViewportCore, fake_context

pytestmark = pytest.mark.usefixtures("registered_addon")


class StillSync:
    """Plays LiveSync: counts exports and records the camera."""

    def __init__(self, core):
        self.exported = live.Exported(instances=True)
        self.builder = self
        self.changes, self.cameras, self.diced = [], [], []
        self.failure = None
        self.volume_name = ""

    def sync(self, depsgraph, changes, space):
        self.changes.append(changes)
        self.builder = None if self.failure is not None else self
        if self.failure is not None:
            raise self.failure
        return live.SyncReport()

    def set_camera(self, **camera):
        self.cameras.append(camera)

    def set_dicing(self, owner, width, height, **view):
        self.diced.append((len(self.cameras), (width, height), view))

    def snapshot(self):
        return SimpleNamespace(volume_name=self.volume_name, dispersive_name="", warnings=[], has_shadow_catchers=False)

    def close(self):
        self.changes.append("closed")


@pytest.fixture
def core():
    return FakeViewportCore()


@pytest.fixture
def drawn(monkeypatch):
    """What `view_draw` put on the screen."""
    pictures = []
    monkeypatch.setattr(Screen, "draw", lambda self, engine, scene, picture, size: pictures.append((picture, size)))
    monkeypatch.setattr(viewport_module, "switches", lambda: ())
    monkeypatch.setattr(live, "LiveSync", StillSync)
    return pictures


@pytest.fixture
def scene():
    return fresh_scene()


@pytest.fixture
def viewport(core, drawn, scene):
    viewport = Viewport(core, lambda: None)
    yield viewport
    viewport.stop(waits=True)


def depsgraph():
    return bpy.context.evaluated_depsgraph_get()


def test_an_update_exports_and_a_draw_draws(viewport, core, drawn, scene):
    context, engine = fake_context(scene), FakeEngine()
    viewport.update(engine, context, depsgraph())
    assert len(viewport._sync.changes) == 1
    wait_until(lambda: viewport._render.picture is not None)
    viewport.draw(engine, context, depsgraph())
    assert drawn[-1][1] == viewport_fakes.REGION and "Rendering" in engine.stats
    assert len(viewport._sync.changes) == 1


def test_drawing_again_asks_for_nothing_new(viewport, core, drawn, scene):
    context, engine = fake_context(scene), FakeEngine()
    viewport.update(engine, context, depsgraph())
    for _ in range(5):
        viewport.draw(engine, context, depsgraph())
    assert viewport._render.requests == 1


def test_an_evaluation_that_changed_nothing_goes_on_with_the_picture(viewport, drawn, scene):
    context, engine = fake_context(scene), FakeEngine()
    viewport.update(engine, context, depsgraph())
    viewport._sync.exported = live.Exported()
    viewport.update(engine, context, depsgraph())
    assert (viewport._render.requests, len(viewport._sync.changes)) == (1, 2)


def test_a_moved_view_only_moves_the_camera(viewport, drawn, scene):
    engine = FakeEngine()
    viewport.update(engine, fake_context(scene), depsgraph())
    for distance in (6.0, 7.0):
        moved = fake_context(scene, view_matrix=Matrix.Translation((0.0, 0.0, -distance)))
        viewport.draw(engine, moved, depsgraph())
    assert [camera["camera_to_world"][2, 3] for camera in viewport._sync.cameras] == [5.0, 6.0, 7.0]
    assert (len(viewport._sync.changes), viewport._render.requests) == (1, 3)


def test_meshes_are_subdivided_for_the_view(viewport, drawn, scene):
    """What is there already stays as it is."""
    engine = FakeEngine()
    viewport.update(engine, fake_context(scene), depsgraph())
    diced = viewport._sync.diced
    [(cameras, size, view)] = diced
    assert (cameras, size, view["rate"], view["stays_diced"]) == (1, viewport_fakes.REGION, 8.0, True)
    moved = fake_context(scene, view_matrix=Matrix.Translation((0.0, 0.0, -6.0)))
    viewport.draw(engine, moved, depsgraph())
    assert [cameras for cameras, *_ in diced] == [1, 2]
    viewport.draw(engine, moved, depsgraph())
    assert len(diced) == 2
    scene.cycles.preview_dicing_rate = 4.0
    viewport.draw(engine, moved, depsgraph())
    assert len(diced) == 3 and diced[2][2]["rate"] == 4.0


def test_a_resized_region_needs_no_export(viewport, core, drawn, scene):
    engine, context = FakeEngine(), fake_context(scene)
    viewport.update(engine, context, depsgraph())
    context.region.width = 32
    viewport.draw(engine, context, depsgraph())
    wait_until(lambda: core.sessions and core.sessions[-1].settings.width == 32)
    assert len(viewport._sync.changes) == 1


def test_local_view_is_exported_although_nothing_was_evaluated(viewport, drawn, scene):
    engine = FakeEngine()
    viewport.update(engine, fake_context(scene), depsgraph())
    viewport.draw(engine, fake_context(scene, local_view=object()), depsgraph())
    assert len(viewport._sync.changes) == 2 and viewport._sync.changes[1].has_unlisted


def test_local_view_is_exported_with_an_edit_at_the_same_moment(viewport, drawn, scene, monkeypatch):
    """An edit that by itself needs no look at every object."""
    engine = FakeEngine()
    listed = changes.Changes(has_unlisted=False, is_everything=False, shading=frozenset({1}))
    monkeypatch.setattr(changes, "read_changes", lambda depsgraph: listed)
    viewport.update(engine, fake_context(scene), depsgraph())
    viewport.update(engine, fake_context(scene, local_view=object()), depsgraph())
    assert viewport._sync.changes[1].has_unlisted and viewport._sync.changes[1].shading == {1}


@pytest.mark.parametrize(
    ("member", "value", "seen"),
    [
        ("viewport_view", "CELLS", lambda settings: "Cells" in settings.passes),
        ("viewport_samples", 7, lambda settings: settings.samples in (1, 7)),
        ("use_viewport_denoising", True, lambda settings: "Denoising Albedo" in settings.passes),
        ("viewport_preset", "RESTIR_DI", lambda settings: settings.direct == "RESTIR" and settings.indirect == "PATH"),
        ("max_bounces", 3, lambda settings: settings.max_bounces == 3),
    ],
)
def test_a_changed_setting_starts_anew(viewport, core, drawn, scene, member, value, seen):
    context, engine = fake_context(scene), FakeEngine()
    viewport.update(engine, context, depsgraph())
    setattr(scene.cistern, member, value)
    viewport.draw(engine, context, depsgraph())
    assert viewport._render.requests == 2
    wait_until(lambda: core.sessions and seen(core.sessions[-1].settings))


def test_techniques_of_viewport_and_final_render_are_apart(viewport, core, drawn, scene):
    scene.cistern.direct, scene.cistern.samples = "RIS", 9
    context, engine = fake_context(scene), FakeEngine()
    viewport.update(engine, context, depsgraph())
    wait_until(lambda: core.sessions)
    assert core.sessions[0].settings.direct != "RIS"
    scene.cistern.viewport_preset = "RENDER"
    viewport.draw(engine, context, depsgraph())
    wait_until(lambda: core.sessions[-1].settings.direct == "RIS")


def test_the_corner_tells_of_volumes(viewport, drawn, scene):
    """INTERACTIVE keeps light from view to view; where there are volumes it cannot."""
    viewport._sync.volume_name = "Fog"
    context, engine = fake_context(scene), FakeEngine()
    viewport.update(engine, context, depsgraph())
    assert "'Fog' has a volume" in viewport.status(False)
    scene.cistern.viewport_preset = "PATH_TRACING"
    viewport.draw(engine, context, depsgraph())
    assert "volume" not in viewport.status(False)


def test_paused_nothing_is_asked_for(viewport, core, drawn, scene):
    context, engine = fake_context(scene), FakeEngine()
    viewport.update(engine, context, depsgraph())
    scene.cistern.viewport_pause = True
    for distance in (5.0, 6.0):
        viewport.draw(engine, fake_context(scene, view_matrix=Matrix.Translation((0, 0, -distance))), depsgraph())
    assert viewport._render.requests == 1 and "paused" in engine.stats
    scene.cistern.viewport_pause = False
    viewport.draw(engine, context, depsgraph())
    assert viewport._render.requests == 2


def test_two_viewports_render_apart(core, drawn, scene):
    viewports = [Viewport(core, lambda: None) for _ in range(2)]
    for distance, viewport in enumerate(viewports, 5):
        context = fake_context(scene, view_matrix=Matrix.Translation((0, 0, -distance)))
        viewport.update(FakeEngine(), context, depsgraph())
    wait_until(lambda: all(viewport._render.picture is not None for viewport in viewports))
    assert len({id(session.cache) for session in core.sessions}) == 2
    for viewport in viewports:
        viewport.stop(waits=True)


class Engine(FakeEngine):
    """The engine's viewport callbacks on an object that can be made without a window."""

    viewport = None
    view_update = addon.engine.CisternEngine.view_update
    view_draw = addon.engine.CisternEngine.view_draw
    call_viewport = addon.engine.CisternEngine.call_viewport


def test_an_engine_that_goes_ends_its_viewport(core, drawn, scene, monkeypatch):
    monkeypatch.setattr(core_loader, "load", lambda: core)
    engine = Engine()
    engine.view_update(fake_context(scene), depsgraph())
    render = engine.viewport._render
    wait_until(lambda: render.picture is not None)
    assert engine.redraws > 0
    del engine
    gc.collect()
    wait_until(lambda: not render.is_alive)


def test_errors_become_the_line_in_the_corner_and_go_away(core, drawn, scene, monkeypatch):
    monkeypatch.setattr(core_loader, "load", lambda: core)
    engine, context = Engine(), fake_context(scene)
    engine.view_update(context, depsgraph())
    sync = engine.viewport._sync
    sync.failure = RenderFailedError("Light 'Lamp': energy is nan")
    engine.view_update(context, depsgraph())
    assert engine.stats == "Error: Light 'Lamp': energy is nan"
    for _ in range(2):
        engine.view_draw(context, depsgraph())
        assert engine.stats == "Error: Light 'Lamp': energy is nan", "the picture is still the one before"
    sync.failure = None
    engine.view_update(context, depsgraph())
    engine.view_draw(context, depsgraph())
    assert "Error" not in engine.stats
    engine.viewport.stop(waits=True)


def test_without_a_core_the_corner_says_why(scene, monkeypatch):
    def refuse():
        raise core_loader.CoreUnavailableError("not installed")

    monkeypatch.setattr(core_loader, "load", refuse)
    engine = Engine()
    engine.view_update(fake_context(scene), depsgraph())
    assert engine.stats == "Error: not installed" and engine.viewport is None


def test_unregistering_ends_all_threads(core, drawn, scene):
    viewport = Viewport(core, lambda: None)
    viewport.update(FakeEngine(), fake_context(scene), depsgraph())
    addon.viewport_render.stop_all()
    assert not any(thread.name == "cistern-viewport" for thread in threading.enumerate())


def seen_at(view, point):
    """Where a point of the scene is seen, as fractions of the region."""
    camera = view.camera_arguments()
    place = np.linalg.inv(camera["camera_to_world"].astype(float)) @ (*point, 1.0)
    x, y = place[:2] / (-place[2] if camera["type"] == "PERSPECTIVE" else 1.0)
    return (
        (x - camera["left"]) / (camera["right"] - camera["left"]),
        (y - camera["bottom"]) / (camera["top"] - camera["bottom"]),
    )


@pytest.mark.parametrize(
    "window",
    [
        viewport_fakes.perspective(),
        viewport_fakes.perspective(shift=(0.3, -0.2), zoom=3.0),
        viewport_fakes.orthographic(),
    ],
)
def test_a_point_is_seen_where_blender_draws_it(scene, window):
    view_matrix = Matrix.LocRotScale(Vector((1.0, 2.0, -9.0)), Matrix.Rotation(0.4, 3, "X"), None)
    view = viewport_view(fake_context(scene, window, view_matrix), depsgraph())
    for point in ((0.0, 0.0, 0.0), (1.0, -0.5, 2.0)):
        clip = window @ view_matrix @ Vector((*point, 1.0))
        expected = (0.5 + 0.5 * clip.x / clip.w, 0.5 + 0.5 * clip.y / clip.w)
        assert seen_at(view, point) == pytest.approx(expected, abs=1e-5)


def test_an_orthographic_viewport_sees_what_lies_behind_it(scene):
    view = viewport_view(fake_context(scene, viewport_fakes.orthographic()), depsgraph())
    camera = view.camera_arguments()
    assert camera["camera_to_world"][2, 3] == pytest.approx(5.0 + 50.0)
    assert (camera["clip_start"], camera["clip_end"]) == (0.0, 100.0)


def camera_context(scene, **space):
    """A region of the shape of the picture, whose camera frame fills half its width."""
    render = scene.render
    render.resolution_x, render.resolution_y = 400, 300
    data = scene.camera.data
    window = viewport_fakes.perspective(zoom=data.lens / data.sensor_width)
    view_matrix = scene.camera.matrix_world.inverted()
    return fake_context(scene, window, view_matrix, "CAMERA", **space)


def test_a_camera_view_has_the_cameras_lens(scene):
    dof = scene.camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 3.0, 2.0
    bpy.context.view_layer.update()
    camera = viewport_view(camera_context(scene), depsgraph()).camera_arguments()
    assert camera["focus_distance"] == pytest.approx(3.0)
    assert camera["aperture_radius"] == pytest.approx(scene.camera.data.lens * 1e-3 / 4.0)
    assert camera["clip_end"] == scene.camera.data.clip_end and camera["name"] == scene.camera.name


def test_the_border_of_a_camera_view_lies_in_the_cameras_frame(scene):
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.0, 0.5
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0
    view = viewport_view(camera_context(scene), depsgraph())
    assert view.shown == pytest.approx((0.25, 0.5, 0.5, 0.75), abs=1e-5)


def test_a_panorama_fills_the_cameras_frame(scene):
    data = scene.camera.data
    data.type, data.panorama_type = "PANO", "EQUIRECTANGULAR"
    bpy.context.view_layer.update()
    view = viewport_view(camera_context(scene), depsgraph())
    camera = view.camera_arguments()
    assert view.shown == pytest.approx((0.25, 0.25, 0.75, 0.75), abs=1e-5)
    assert (camera["type"], camera["panorama"]["type"]) == ("PANORAMIC", "EQUIRECTANGULAR")
    window = [camera[side] for side in ("left", "bottom", "right", "top")]
    assert window == pytest.approx([-0.5, -0.5, 1.5, 1.5], abs=1e-4)


def test_an_opaque_passepartout_saves_what_it_covers(scene):
    assert viewport_view(camera_context(scene), depsgraph()).shown == WHOLE
    scene.camera.data.show_passepartout, scene.camera.data.passepartout_alpha = True, 1.0
    bpy.context.view_layer.update()
    view = viewport_view(camera_context(scene), depsgraph())
    assert view.shown == pytest.approx((0.25, 0.25, 0.75, 0.75), abs=1e-5)


def test_the_border_of_a_free_view_is_its_own(scene):
    scene.render.use_border = True
    border = {f"render_border_{end}_{axis}": value for axis in "xy" for end, value in (("min", 0.1), ("max", 0.6))}
    view = viewport_view(fake_context(scene, use_render_border=True, **border), depsgraph())
    assert view.shown == (0.1, 0.1, 0.6, 0.6)
    assert viewport_view(fake_context(scene, use_render_border=False, **border), depsgraph()).shown == WHOLE


def test_views_are_equal_where_their_pictures_are(scene):
    views = [viewport_view(fake_context(scene), depsgraph()) for _ in range(2)]
    turned = fake_context(scene, view_matrix=Matrix.Rotation(math.pi / 2, 4, "X"))
    assert views[0] == views[1] != viewport_view(turned, depsgraph())
