"""3D viewports show what final renders show, with the built core: shadow catchers and panoramas."""

from types import SimpleNamespace

import numpy as np
import pytest

from addon import settings
from addon.sync.live import LiveSync
from addon.viewport_catchers import Caches, ShadowedSession
from addon.viewport_render import Job, ViewportRender
from tests.blender.test_against_cycles_shadow_catchers import footage
from tests.blender.test_viewport_denoise import has_library
from tests.blender.test_viewport_render import wait_until
from tests.blender.viewport_fakes import look_through_camera
from tests.support import blender_scenes as build
from tests.support.engines import prepare, render

pytestmark = pytest.mark.usefixtures("registered_addon")

SIZE = (48, 32)


def camera_job(core, scene, sync, samples) -> Job:
    """What a viewport asks for that looks through the camera and is as large as the picture."""
    view = look_through_camera(scene, SIZE, sync)
    snapshot = sync.builder.snapshot()
    arguments = settings.viewport_settings(core, scene, snapshot.has_shadow_catchers)
    arguments["passes"] = tuple(arguments["passes"])
    members, is_denoised = tuple(sorted(arguments.items())), settings.is_viewport_denoised(scene)
    limits = (("samples", samples),)
    return Job(snapshot, view, members, "COMBINED", limits, 1, is_denoised, snapshot.has_shadow_catchers)


def shown(core, scene, samples):
    """What the viewport shows at the end."""
    sync, viewport = LiveSync(core), ViewportRender(core, lambda: None)
    is_denoised = settings.is_viewport_denoised(scene)
    try:
        viewport.submit(camera_job(core, scene, sync, samples))
        wait_until(lambda: viewport.error or (viewport.picture and f"{samples}/{samples}" in viewport.picture.status))
        wait_until(lambda: viewport.error or (viewport.picture.denoised is not None) == is_denoised)
        assert (viewport.error, viewport.warnings) == (None, [])
        return viewport.picture.pixels
    finally:
        viewport.stop(waits=True)
        sync.close()


@pytest.mark.parametrize("film_transparent", [True, False], ids=["transparent", "opaque"])
def test_pictures_are_those_of_final_renders(empty_scene, built_core, film_transparent):
    """Planted: without catchers."""
    scene = footage(empty_scene)
    prepare(scene, *SIZE)
    scene.render.film_transparent = film_transparent
    final = render(scene, "CISTERN", 8, 0)
    assert np.allclose(shown(built_core, scene, 8), final, atol=2e-5)
    scene.objects["Floor"].is_shadow_catcher = False
    assert not np.allclose(shown(built_core, scene, 8), final, atol=0.1)


@pytest.mark.parametrize("kind", ["EQUIRECTANGULAR", "FISHEYE_EQUISOLID"])
def test_panoramas(empty_scene, built_core, kind):
    """Planted: a lens that sees more."""
    build.stage(empty_scene, build.principled("ball"))
    data = empty_scene.camera.data
    data.type, data.panorama_type = "PANO", kind
    empty_scene.cistern.viewport_preset = "PATH_TRACING"
    prepare(empty_scene, *SIZE)
    final = render(empty_scene, "CISTERN", 8, 0)
    assert np.allclose(shown(built_core, empty_scene, 8), final, atol=1e-3)
    data.longitude_max, data.fisheye_lens = 3.0, 10.0
    assert not np.allclose(shown(built_core, empty_scene, 8), final, atol=0.1)


def test_where_no_shadow_falls_there_is_no_noise(empty_scene, built_core):
    scene = footage(empty_scene)
    prepare(scene, *SIZE)
    alpha = shown(built_core, scene, 1)[..., 3]
    assert np.all(alpha[:2] == 0.0) and np.all(alpha[:, :2] == 0.0)
    assert np.mean(alpha > 0.0) > 0.1


def begun(core, scene, sync, **limits) -> ShadowedSession:
    job = camera_job(core, scene, sync, 1)
    session = ShadowedSession(core, dict(job.settings) | {"width": SIZE[0], "height": SIZE[1]} | limits)
    session.start(job.scene, Caches(core))
    return session


@pytest.mark.parametrize("limits", [{"samples": 200, "noise_threshold": 0.03}, {"samples": 1 << 20, "time_limit": 0.5}])
def test_what_ends_early_is_of_as_many_samples(empty_scene, built_core, limits):
    """That of one that goes on, when it has so many."""
    scene = footage(empty_scene)
    prepare(scene, *SIZE)
    sync = LiveSync(built_core)
    ended = begun(built_core, scene, sync, **limits)
    wait_until(lambda: ended.wait(0.002).status is not built_core.Status.RUNNING)
    progress = ended.wait(0.0)
    assert progress.status is built_core.Status.DONE and 8 < progress.frames_done < limits["samples"]
    going_on = begun(built_core, scene, sync, samples=limits["samples"])
    wait_until(lambda: going_on.wait(0.0).frames_done == progress.frames_done)
    assert np.array_equal(ended.read("Combined"), going_on.read("Combined"))
    going_on.cancel()
    sync.close()


@has_library
def test_denoising_leaves_shadows(empty_scene, built_core):
    scene = footage(empty_scene)
    prepare(scene, *SIZE)
    scene.render.film_transparent = False
    long = shown(built_core, scene, 256)
    noisy = shown(built_core, scene, 1)
    scene.cistern.use_viewport_denoising = True
    clean = shown(built_core, scene, 1)
    before, after = (np.mean((picture - long)[..., :3] ** 2) for picture in (noisy, clean))
    assert after < 0.7 * before


def test_a_failure_of_one_session_is_that_of_all(empty_scene, built_core, monkeypatch):
    scene = footage(empty_scene)
    prepare(scene, *SIZE)
    sync = LiveSync(built_core)
    session = begun(built_core, scene, sync, samples=4)
    failed = SimpleNamespace(status=built_core.Status.FAILED, error="out of memory", frames_done=0, version=0)
    with monkeypatch.context() as patch:
        patch.setattr(session, "_sessions", [session._scene, SimpleNamespace(wait=lambda seconds: failed)])
        progress = session.wait(0.0)
    assert (progress.status, progress.error) == (built_core.Status.FAILED, "out of memory")
    session.cancel()
    other = begun(built_core, scene, sync, samples=1 << 20)
    other.cancel()
    assert other.wait(0.0).status is built_core.Status.CANCELLED
    sync.close()
