"""The add-on without its core, and its registration."""

import subprocess
import sys
from pathlib import Path

import bpy
import pytest

import addon
from addon import core, engine, report, techniques
from tests.blender.engine_fakes import fresh_scene

pytestmark = pytest.mark.usefixtures("registered_addon")


def test_registering_again_leaves_nothing_behind():
    addon.unregister()
    assert not hasattr(bpy.types.Scene, "cistern")
    assert not hasattr(bpy.types, "CISTERN_RENDER_PT_sampling")
    addon.register()
    addon.unregister()
    addon.register()
    assert fresh_scene().cistern.samples == 2


def test_the_engine_stays_while_it_renders_in_a_window(monkeypatch):
    """Its class going would crash Blender (tests/gui/final_renders.py). Timers do not run here."""
    monkeypatch.setattr(engine, "is_rendering_in_window", lambda: True)
    fresh_scene()
    addon.unregister()
    assert engine.registered_class() is engine.CisternEngine and not hasattr(bpy.types.Scene, "cistern")
    with pytest.raises(RuntimeError, match="Cistern has been disabled"):
        bpy.ops.render.render()
    addon.register()
    assert not bpy.app.timers.is_registered(engine.unregister_later)
    addon.unregister()
    assert engine.unregister_later() == engine.WAIT_SECONDS
    monkeypatch.setattr(engine, "is_rendering_in_window", lambda: False)
    assert engine.unregister_later() is None and engine.registered_class() is None
    bpy.app.timers.unregister(engine.unregister_later)
    addon.register()
    assert engine.registered_class() is engine.CisternEngine


def test_an_upgrade_waits_for_the_engine_that_renders(monkeypatch):
    monkeypatch.setattr(engine, "is_rendering_in_window", lambda: True)
    assert engine.registered_class() is not None
    engine.register()  # as the newer module does
    assert bpy.app.timers.is_registered(engine.register_later)
    assert engine.register_later() == engine.WAIT_SECONDS
    monkeypatch.setattr(engine, "is_rendering_in_window", lambda: False)
    assert engine.register_later() is None and engine.registered_class() is engine.CisternEngine
    bpy.app.timers.unregister(engine.register_later)


def test_jobs_that_render_are_known_to_blender():
    assert not any(map(bpy.app.is_job_running, engine.RENDER_JOBS))


def test_a_report_that_nobody_reads_any_more_is_kept(monkeypatch):
    class Closed:
        def write(self, _text):
            raise BrokenPipeError

    monkeypatch.setattr(sys, "stdout", Closed())
    report.publish(report.RenderReport(7, "unread"))
    monkeypatch.undo()
    assert report.last_report().layer == "unread"


def test_registering_does_not_load_the_core():
    program = "import sys, bpy, addon; addon.register(); addon.unregister(); assert 'cistern_core' not in sys.modules"
    root = Path(addon.__file__).parent.parent
    command = ["timeout", "-k", "1", "60", sys.executable, "-c", program]
    subprocess.run(command, cwd=root, check=True, timeout=70)


def test_render_without_the_core_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "cistern_core", None)
    fresh_scene()
    with pytest.raises(RuntimeError, match="native core"):
        bpy.ops.render.render()
    assert "native core" in report.last_report().error


def test_sentences_for_a_core_that_cannot_be_loaded(tmp_path):
    missing = ModuleNotFoundError("No module named 'cistern_core'", name="cistern_core")
    assert "not installed" in core.explain(missing, [tmp_path])
    (tmp_path / "cistern_core.cpython-399-x86_64-linux-gnu.so").touch()
    assert "cpython-399" in core.explain(missing, [tmp_path])
    refused = ImportError("Embree 4.4.1 answered, this module was built for 3.13.5")
    assert "Embree 4.4.1" in core.explain(refused, [tmp_path])


def test_technique_set_by_a_script_wins_over_the_preset():
    settings = fresh_scene().cistern
    assert settings.preset == "FINAL"
    assert techniques.settings_in_force(settings)["light_sampler"] == "TREE"
    settings.light_sampler = "POWER"
    assert techniques.settings_in_force(settings)["light_sampler"] == "POWER"


def test_preset_button_takes_over_a_preset_whole():
    settings = fresh_scene().cistern
    settings.light_sampler = "POWER"
    bpy.ops.cistern.choose_preset(preset="CUSTOM")
    assert (settings.preset, settings.light_sampler) == ("CUSTOM", "POWER")
    bpy.ops.cistern.choose_preset(preset="FINAL")
    assert settings.preset == "FINAL"
    assert techniques.settings_in_force(settings)["light_sampler"] == "TREE"
    bpy.ops.cistern.choose_preset(preset="CUSTOM")
    assert settings.light_sampler == "TREE"


def test_every_setting_explains_itself():
    scene = fresh_scene()
    for owner in (scene.cistern, scene.view_layers[0].cistern):
        for prop in owner.bl_rna.properties:
            if prop.identifier not in {"name", "rna_type"}:
                assert len(prop.description) > 20, prop.identifier


def test_zero_samples_cannot_be_set():
    settings = fresh_scene().cistern
    settings.samples = 0
    assert settings.samples == 1
