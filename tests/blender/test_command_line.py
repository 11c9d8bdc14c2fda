"""Options after `--`; what they do to a render, the version matrix of tests/extension tests in each Blender."""

import contextlib
from types import SimpleNamespace

import bpy
import pytest

from addon import command_line, core, preferences, report
from tests.blender.engine_fakes import fresh_scene
from tests.support.compositing import show

pytestmark = pytest.mark.usefixtures("registered_addon")


def parse(*options):
    return command_line.parse(["blender", "-b", "scene.blend", "-f", "1", "--", *options])


def test_only_blenders_own_part_says_that_it_renders():
    assert command_line.is_render(["blender", "-b", "scene.blend", "-f", "1"])
    assert command_line.is_render(["blender", "-b", "scene.blend", "--render-anim", "--", "x"])
    assert not command_line.is_render(["blender", "-b", "--python", "script.py", "--", "-f", "1"])


def test_options_of_others_are_left_to_them():
    options = parse("--cycles-device", "CPU", "--cistern-samples", "12", "-s", "3")
    assert (options.samples, options.preset, options.resume) == (12, None, False)
    assert command_line.parse(["blender", "--cistern-samples", "0"]).samples is None


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--cistern-samples", "0"), "0 is not between 1 and"),
        (("--cistern-samples", "1e3"), "1e3 is not a whole number"),
        (("--cistern-preset", "BEST"), "FINAL"),
        (("--cistern-guiding", "YES"), "AUTO"),
        (("--cistern-time-limit", "-1"), "-1 is not between"),
        (("--cistern-time-limit", "inf"), "inf is not between 0 and 1000000000"),
        (("--cistern-noise-threshold", "few"), "few is not a number"),
        (("--cistern-threads", "1025"), "1025 is not between 0 and 1024"),
        (("--cistern-sample", "3"), "no option --cistern-sample"),
        (("--cistern-samples",), "--cistern-samples"),
    ],
)
def test_wrong_options_are_named(options, words):
    with pytest.raises(command_line.OptionError, match=words):
        parse(*options)


def test_values_reach_the_scene():
    scene = fresh_scene()
    scene.view_layers[0].samples = 99
    scene.cistern.light_sampler = "POWER"
    command_line.apply(
        parse(
            *("--cistern-samples", "12", "--cistern-preset", "restir_di", "--cistern-threads", "0"),
            *("--cistern-guiding", "auto"),
        ),
        scene,
    )
    assert scene.cistern.guiding == "AUTO"
    assert (scene.cistern.samples, scene.view_layers[0].samples) == (12, 0)
    assert (scene.cistern.preset, scene.render.threads_mode) == ("RESTIR_DI", "AUTO")
    assert not scene.cistern.is_property_set("light_sampler")  # or it would win over the preset
    command_line.apply(parse(), scene)
    assert (scene.cistern.samples, scene.render.use_overwrite) == (12, True)


def test_preferences_say_in_short_rows_why_there_is_no_core(monkeypatch):
    rows = []
    column = SimpleNamespace(label=lambda text, icon: rows.append((icon, text)))
    box = SimpleNamespace(layout=SimpleNamespace(column=lambda align: column))
    monkeypatch.setattr(core, "status", lambda: (False, "Cistern's native core " + 20 * "cannot be loaded "))
    preferences.CisternPreferences.draw(box, None)
    assert [icon for icon, _ in rows] == ["ERROR"] + ["BLANK1"] * (len(rows) - 1)
    assert len(rows) > 1 and max(len(text) for _, text in rows) <= preferences.LINE_LENGTH


def test_missing_core_names_what_is_supported(tmp_path):
    missing = ModuleNotFoundError("No module named 'cistern_core'", name="cistern_core")
    assert "Python 3.11 (Blender 4.2 to 5.0) and 3.13" in core.explain(missing, [tmp_path])


@pytest.fixture
def command_line_render(monkeypatch):
    """Renders of this process are watched as those of the command line are."""
    monkeypatch.setattr(command_line, "running", command_line.CommandLineRender(parse()))
    monkeypatch.setattr(report, "error_count", 0)  # of other tests in this process
    for event, handler in command_line.HANDLERS.items():
        getattr(bpy.app.handlers, event).append(handler)
    yield command_line.running
    command_line.unregister()


def write_a_movie(scene: bpy.types.Scene) -> None:
    image_settings = scene.render.image_settings
    if hasattr(image_settings, "media_type"):  # since 5.0
        image_settings.media_type = "VIDEO"
    image_settings.file_format = "FFMPEG"


@pytest.mark.parametrize("is_movie", [False, True])
def test_frames_of_scene_strips_come_to_their_place(command_line_render, tmp_path, is_movie):
    """Blender renders the scene of a strip within the frame of the other scene, with the same handlers."""
    shown = fresh_scene()
    cut = bpy.data.scenes.new("Cut")
    try:
        editor = cut.sequence_editor_create()
        strips = editor.strips if hasattr(editor, "strips") else editor.sequences
        strips.new_scene("strip", shown, 1, 1)
        cut.render.engine = "CISTERN"
        cut.render.resolution_x = cut.render.resolution_y = 16
        cut.frame_start, cut.frame_end = 1, 2
        cut.render.filepath = str(tmp_path / "cut_")
        if is_movie:
            write_a_movie(cut)
        before = (shown.render.filepath, cut.render.filepath)
        bpy.ops.render.render(animation=True, scene="Cut")
        names = ["cut_0001-0002"] if is_movie else ["cut_0001", "cut_0002"]
        assert sorted(file.stem for file in tmp_path.iterdir()) == names
        assert (shown.render.filepath, cut.render.filepath) == before
        assert command_line_render.unwritten is None and not command_line_render.has_failed
    finally:
        bpy.data.scenes.remove(cut)


@pytest.fixture
def plain_scene():
    scene = fresh_scene()
    scene.render.engine, scene.cistern.samples = "CISTERN", 1
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.frame_start = scene.frame_end = 1
    return scene


def render_animation() -> None:
    """Of which Blender's command line goes on after an error, too."""
    with contextlib.suppress(RuntimeError):
        bpy.ops.render.render(animation=True)


def lose_the_camera(scene: bpy.types.Scene) -> None:
    scene.camera = None
    write_a_movie(scene)


def make_it_too_small(scene: bpy.types.Scene) -> None:
    scene.render.resolution_percentage = 1


@pytest.mark.parametrize("spoil", [None, lose_the_camera, make_it_too_small])
def test_renders_that_end_before_their_time_have_failed(command_line_render, plain_scene, tmp_path, spoil):
    plain_scene.render.filepath = str(tmp_path / "frame_")
    if spoil:
        spoil(plain_scene)
    render_animation()
    assert command_line_render.exit_status() == (command_line.STATUS_FAILED if spoil else 0)


def test_other_engines_write_as_ever(command_line_render, plain_scene, tmp_path):
    places = []
    plain_scene.render.engine = "CYCLES"
    plain_scene.cycles.samples = 1
    plain_scene.render.filepath = str(tmp_path / "frame_")
    watch = lambda scene, _=None: places.append(scene.render.filepath)  # noqa: E731
    bpy.app.handlers.render_post.append(watch)
    try:
        render_animation()
        assert places == [plain_scene.render.filepath]
        plain_scene.render.engine = "CISTERN"
        render_animation()
        assert places[1] != places[0]  # the hidden folder
    finally:
        bpy.app.handlers.render_post.remove(watch)


def test_a_handler_may_choose_another_place(command_line_render, plain_scene, tmp_path):
    def choose(scene, _=None):
        scene.render.filepath = str(tmp_path / "chosen_")

    plain_scene.render.filepath = str(tmp_path / "frame_")
    bpy.app.handlers.render_pre.append(choose)
    try:
        render_animation()
    finally:
        bpy.app.handlers.render_pre.remove(choose)
    assert [file.name for file in tmp_path.iterdir()] == ["chosen_0001.exr"]
    assert plain_scene.render.filepath == str(tmp_path / "chosen_") and command_line_render.exit_status() == 0


@pytest.fixture
def shown_scene(plain_scene):
    """One that the compositor of another asks for."""
    other = bpy.data.scenes.new("Shown")
    other.render.engine, other.cistern.samples = "CISTERN", 1
    camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    other.collection.objects.link(camera)
    other.camera = camera
    yield other
    plain_scene.render.use_compositing = False
    bpy.data.scenes.remove(other)


@pytest.mark.parametrize("is_whole", [True, False])
def test_frames_that_lack_another_scene_are_left_out(command_line_render, plain_scene, shown_scene, tmp_path, is_whole):
    """Blender writes them, and says nothing."""
    show(plain_scene, shown_scene)
    if not is_whole:
        shown_scene.camera = None
    plain_scene.frame_end = 2
    before = plain_scene.render.filepath = str(tmp_path / "frame_")
    render_animation()
    names = ["frame_0001.exr", "frame_0002.exr"] if is_whole else []
    assert sorted(file.name for file in tmp_path.iterdir()) == names
    assert command_line_render.exit_status() == (0 if is_whole else command_line.STATUS_FAILED)
    assert plain_scene.render.filepath == before


def test_scenes_of_the_compositor_have_the_options_too(monkeypatch, command_line_render, plain_scene, shown_scene):
    show(plain_scene, shown_scene)
    monkeypatch.setattr(command_line_render, "options", parse("--cistern-samples", "3", "--cistern-seed", "9"))
    render_animation()
    assert (shown_scene.cistern.samples, shown_scene.cistern.seed) == (3, 9)


def test_a_compositor_may_write_its_own_files_alone(command_line_render, plain_scene, shown_scene, tmp_path):
    show(plain_scene, shown_scene, file_folder=str(tmp_path / "files"))
    plain_scene.frame_end = 2
    before = plain_scene.render.filepath = str(tmp_path / "frame_")
    render_animation()
    assert [file.name for file in tmp_path.iterdir()] == ["files"] and len(list((tmp_path / "files").iterdir())) == 2
    assert command_line_render.exit_status() == 0 and plain_scene.render.filepath == before


@pytest.mark.parametrize("name", ["proj{1}/frame_", "{{x}}/frame_", 240 * "n" + "_"])
def test_odd_names_come_to_their_place(command_line_render, plain_scene, tmp_path, name):
    """Braces stand around variables since Blender 4.5; names have 255 bytes at most."""
    folder = tmp_path / name
    path = str(folder).replace("{{", "{").replace("}}", "}") if bpy.app.version < (4, 5, 0) else str(folder)
    if name.startswith("proj"):  # of a file in such a folder
        bpy.ops.wm.save_as_mainfile(filepath=str(make_folder(folder.parent) / "scene.blend"))
        path = "//frame_"
    plain_scene.render.filepath = path
    render_animation()
    files = [file for file in tmp_path.rglob("*") if file.suffix == ".exr"]
    assert len(files) == 1 and not any(".partial" in str(file) for file in files)
    assert command_line_render.exit_status() == 0


def make_folder(folder):
    folder.mkdir(parents=True)
    return folder
