"""The command line of examples/render.py: what its words mean, and what it sets for either engine."""

from pathlib import Path

import OpenImageIO
import pytest

from addon import techniques
from tests.support.blender_scenes import add_camera

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

pytestmark = pytest.mark.usefixtures("registered_addon")


@pytest.fixture
def script(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    monkeypatch.chdir(tmp_path)
    import render

    return render


@pytest.mark.parametrize(
    ("line", "blend", "settings"),
    [
        ("--samples 4", None, []),
        ("max_bounces=4 --samples 4", None, ["max_bounces=4"]),
        ("scene.blend --samples 4 max_bounces=4", "scene.blend", ["max_bounces=4"]),
        ("max_bounces=4 --samples 4 scene.blend", "scene.blend", ["max_bounces=4"]),
        ("max_bounces=4 scene.blend clamp_direct=1", "scene.blend", ["max_bounces=4", "clamp_direct=1"]),
        ("max_bounces=4 a=1.blend", "a=1.blend", ["max_bounces=4"]),
        ("a=1.blend max_bounces=4", "a=1.blend", ["max_bounces=4"]),
        ("max_bounces=4 b=1.blend", None, ["max_bounces=4", "b=1.blend"]),
    ],
)
def test_the_file_may_stand_anywhere(script, tmp_path, line, blend, settings):
    (tmp_path / "a=1.blend").touch()
    arguments = script.parse_arguments(line.split())
    assert (arguments.blend, arguments.settings) == (blend and Path(blend), settings)


@pytest.mark.parametrize("line", ["scene.blend max_bounces", "max_bounces=4 scene.blend --samples 4 other.blend"])
def test_other_words_are_refused_before_a_scene_is_opened(script, capsys, line):
    with pytest.raises(SystemExit) as end:
        script.parse_arguments(line.split())
    assert end.value.code == 2
    assert f"expected SETTING=VALUE, found {line.split()[-1]!r}" in capsys.readouterr().err


def test_settings_of_cistern(script, empty_scene, capsys):
    line = "--preset RIS --light-sampler POWER --seed 7 --samples 3 max_bounces=4"
    script.apply_settings(empty_scene, script.parse_arguments(line.split()))
    cistern = empty_scene.cistern
    found = (cistern.preset, cistern.light_sampler, cistern.seed, cistern.samples, cistern.max_bounces)
    assert found == ("RIS", "POWER", 7, 3, 4)
    assert "Warning" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("line", "warning"),
    [
        ("", ""),
        (
            "--preset RIS --light-sampler POWER max_bounces=4",
            "Warning: preset, light_sampler, max_bounces are settings of Cistern and are left out\n",
        ),
        ("max_bounces=4", "Warning: max_bounces is a setting of Cistern and is left out\n"),
    ],
)
def test_cycles_takes_samples_and_seed_alone(script, empty_scene, capsys, line, warning):
    arguments = script.parse_arguments(["--engine", "CYCLES", "--seed", "7", "--samples", "3", *line.split()])
    script.apply_settings(empty_scene, arguments)
    assert (empty_scene.cycles.seed, empty_scene.cycles.samples) == (7, 3)
    assert capsys.readouterr().out == warning


def test_a_seed_that_cycles_cannot_have_is_refused(script, empty_scene):
    arguments = script.parse_arguments(["--engine", "CYCLES", "--seed", "-1"])
    with pytest.raises(script.UserError, match="seed is -1"):
        script.apply_settings(empty_scene, arguments)


@pytest.mark.parametrize("aspect", [1.0, 1.5])
def test_files_of_pixels_that_are_not_square(script, empty_scene, tmp_path, aspect):
    """Of these Blender 5.0 writes no parts; of others there are as many as passes."""
    add_camera(empty_scene)
    render = empty_scene.render
    render.engine, render.pixel_aspect_x = "CISTERN", aspect
    render.resolution_x = render.resolution_y = 4
    empty_scene.cistern.samples = 1
    exr, png = script.render_files(empty_scene, tmp_path)
    reader = OpenImageIO.ImageInput.open(str(exr))
    names = reader.spec().channelnames
    reader.close()
    has_parts = hasattr(render.image_settings, "use_exr_interleave") and aspect == 1.0
    assert png.is_file() and ("ViewLayer.Direct.R" in names) != has_parts


def test_a_preset_wins_over_what_the_file_has_set_by_hand(script, empty_scene):
    empty_scene.cistern.preset, empty_scene.cistern.direct = "CUSTOM", "RESTIR"
    script.apply_settings(empty_scene, script.parse_arguments(["--preset", "path_tracing"]))
    assert techniques.settings_in_force(empty_scene.cistern)["direct"] == "NEE"
    with pytest.raises(script.UserError, match="there is no preset BEST; there are FINAL"):
        script.apply_settings(empty_scene, script.parse_arguments(["--preset", "best"]))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("--width 1", "no pictures of 1 × 1 pixels"),
        ("--width 70000 --height 8", "no pictures of 70000 × 8 pixels"),
        ("--frame 2000000", "no frame 2000000"),
        ("use_denoising=maybe", "'maybe' is no value for use_denoising: that is on or off"),
    ],
)
def test_what_blender_would_clamp_is_refused(script, empty_scene, line, message):
    with pytest.raises(script.UserError, match=message):
        script.apply_settings(empty_scene, script.parse_arguments(line.split()))


def test_what_cycles_has_set_and_is_left_out_is_told(script, empty_scene, capsys):
    empty_scene.cycles.use_fast_gi = True
    script.apply_settings(empty_scene, script.parse_arguments(["--cycles-settings"]))
    assert "Warning: of Cycles' settings: no Fast GI Approximation" in capsys.readouterr().out


def test_views_are_all_written(script, empty_scene, tmp_path):
    add_camera(empty_scene)
    render = empty_scene.render
    render.engine, render.use_multiview = "CISTERN", True
    render.resolution_x = render.resolution_y = 4
    empty_scene.cistern.samples = 1
    files = script.render_files(empty_scene, tmp_path)
    assert files and all(file.name.startswith("picture") and file.suffix == ".exr" for file in files)


def test_no_half_copy_is_left(script, tmp_path):
    with pytest.raises(OSError):
        script.deliver(tmp_path, tmp_path / "picture.png")  # a folder cannot be copied as a file
    assert not list(tmp_path.iterdir())
