"""Renders started by Blender's command line: `blender -b FILE -E CISTERN -o OUT -f 1 -- --cistern-samples 64 ...`.

Options come after `--`, as those of Cycles do. Each frame is written into a hidden folder beside its place and moved
there when it is whole, since Blender killed while it writes leaves half a file; what a killed render left in such a
folder goes when the frame is rendered again. Blender's exit status is 1 when any frame failed. Renders of other
engines are none of our business.
"""

import argparse
import atexit
import hashlib
import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import bpy
from bpy.app.handlers import persistent

from . import cycles_settings, report, techniques
from .engine import CisternEngine
from .properties import MAX_INT, MAX_NUMBER, MAX_SAMPLES
from .sync.nodes.graph import all_nodes

RENDER_OPTIONS = frozenset({"-f", "--render-frame", "-a", "--render-anim"})
OPTION_PREFIX = "--cistern-"

STATUS_FAILED = 1
STATUS_BAD_OPTIONS = 2

MAX_THREADS = 1024  # Blender's own limit
MAX_NAME_BYTES = 240  # of a file, so that what is added to hide it still makes a name
NUMBER_NAMES = {int: "whole number", float: "number"}


class OptionError(Exception):
    """An option that cannot be obeyed; the text says why."""


class _OptionParser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise OptionError(message)


@dataclass
class CommandLineRender:
    """What the command line asked for, and how it went."""

    options: argparse.Namespace
    is_under_way: bool = False  # whether a job has begun that has not come to its end
    unwritten: Path | None = None  # the folder of the frame that is being rendered
    path_in_scene: str = ""  # which the one below takes the place of meanwhile
    path_of_folder: str = ""
    scene_name: str = ""  # whose frame is under way, if any
    is_rendered: bool = False  # whether it only has to be written
    errors_before: int = 0
    has_failed: bool = False

    def exit_status(self) -> int:
        failed = self.has_failed or self.is_under_way or self.unwritten is not None or report.error_count > 0
        return STATUS_FAILED if failed else 0


def is_render(argv: list[str]) -> bool:
    """Whether Blender's own part of the command line renders."""
    own = argv[: argv.index("--")] if "--" in argv else argv
    return not RENDER_OPTIONS.isdisjoint(own)


def _number(kind: type, low: float, high: float) -> Callable[[str], float]:
    def number(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text} is not a {NUMBER_NAMES[kind]}") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is not between {low:.10g} and {high:.10g}")
        return value

    return number


def parse(argv: list[str]) -> argparse.Namespace:
    """The options after `--` that begin with `--cistern-`; others are left to their owners. Raises OptionError."""
    parser = _OptionParser(prog="blender", add_help=False, allow_abbrev=False)
    add = parser.add_argument
    add("--cistern-samples", dest="samples", type=_number(int, 1, MAX_SAMPLES))
    add("--cistern-preset", dest="preset", type=str.upper, choices=[item[0] for item in techniques.PRESET_ITEMS])
    add("--cistern-guiding", dest="guiding", type=str.upper, choices=[item[0] for item in techniques.GUIDING_ITEMS])
    add("--cistern-seed", dest="seed", type=_number(int, 0, MAX_INT))
    add("--cistern-threads", dest="threads", type=_number(int, 0, MAX_THREADS))
    add("--cistern-noise-threshold", dest="noise_threshold", type=_number(float, 0.0, MAX_NUMBER))
    add("--cistern-time-limit", dest="time_limit", type=_number(float, 0.0, MAX_NUMBER))
    add("--cistern-cycles-settings", dest="cycles_settings", action="store_true")
    add("--cistern-resume", dest="resume", action="store_true")
    after = argv[argv.index("--") + 1 :] if "--" in argv else []
    options, others = parser.parse_known_args(after)
    unknown = [other for other in others if other.startswith(OPTION_PREFIX)]
    if unknown:
        raise OptionError(f"there is no option {unknown[0]}")
    return options


def take_cycles_settings(scene: bpy.types.Scene) -> None:
    if not cycles_settings.is_there(scene):
        sys.stderr.write("cistern: Cycles is not enabled: there are no settings to take from it\n")
        return
    for words in cycles_settings.take_over(scene):
        sys.stderr.write(f"cistern: of Cycles' settings: {words}\n")


def apply(options: argparse.Namespace, scene: bpy.types.Scene) -> None:
    """Give the scene the values that the command line names; single ones win over those of Cycles."""
    settings, render = scene.cistern, scene.render
    if options.cycles_settings:
        take_cycles_settings(scene)
    if options.preset is not None:
        techniques.choose_preset(settings, options.preset)
    if options.guiding is not None:
        settings.guiding = options.guiding
    if options.samples is not None:
        settings.samples = options.samples
        for layer in scene.view_layers:
            layer.samples = 0  # its own number would win
    if options.seed is not None:
        settings.seed = options.seed
    if options.noise_threshold is not None:
        settings.noise_threshold = options.noise_threshold
    if options.time_limit is not None:
        settings.time_limit = options.time_limit
    if options.threads is not None:
        render.threads_mode = "FIXED" if options.threads > 0 else "AUTO"
        if options.threads > 0:
            render.threads = options.threads
    if options.resume:
        render.use_overwrite = render.use_placeholder = False


running: CommandLineRender | None = None


def is_for_strip(scene: bpy.types.Scene) -> bool:
    """Whether this scene is rendered for a strip of another one, whose frame is under way; it writes no file itself."""
    return running.scene_name not in ("", scene.name)


def is_ours(scene: bpy.types.Scene) -> bool:
    return scene.render.engine == CisternEngine.bl_idname


def hidden_folder(place: Path) -> Path:
    """Where a file is written that is to come to `place`: beside it, or it could not simply be moved."""
    is_long = len(os.fsencode(place.name)) > MAX_NAME_BYTES
    name = hashlib.sha256(os.fsencode(place.name)).hexdigest() if is_long else place.name
    return place.parent / f".{name}.partial"


def as_path_setting(path: Path) -> str:
    """The path as a setting: since Blender 4.5 braces there stand around names of variables."""
    text = str(path)
    return text.replace("{", "{{").replace("}", "}}") if bpy.app.version >= (4, 5, 0) else text


def scenes_shown_by(scene: bpy.types.Scene) -> set[bpy.types.Scene]:
    """Others of this engine that its compositor asks for: Blender renders them within the frame, without a handler."""
    in_group = hasattr(scene, "compositing_node_group")  # since 5.0
    tree = scene.compositing_node_group if in_group else scene.node_tree if scene.use_nodes else None
    if tree is None or not scene.render.use_compositing:
        return set()
    shown = {getattr(node, "scene", None) for node in all_nodes([tree])}
    return {other for other in shown - {None, scene} if is_ours(other)}


@persistent
def begin_job(scene: bpy.types.Scene, _depsgraph: object = None) -> None:
    """Blender copies the scene's render settings after this."""
    for one in (scene, *scenes_shown_by(scene)):
        apply(running.options, one)
    if is_ours(scene) and not is_for_strip(scene):
        running.has_failed |= running.is_under_way
        running.is_under_way = True


@persistent
def begin_frame(scene: bpy.types.Scene, _depsgraph: object = None) -> None:
    """Point Blender to a hidden folder beside the file's place; it makes the folder when it writes. Movies stay."""
    if is_for_strip(scene):
        return
    leave_frame(scene)
    running.scene_name, running.is_rendered, running.errors_before = scene.name, False, report.error_count
    if scene.render.is_movie_format or not is_ours(scene):
        return
    place = Path(bpy.path.abspath(scene.render.frame_path(frame=scene.frame_current)))
    running.unwritten = hidden_folder(place)
    shutil.rmtree(running.unwritten, ignore_errors=True)
    running.path_in_scene = scene.render.filepath
    name = os.path.basename(running.path_in_scene)  # noqa: PTH119  (pathlib would drop a slash at the end)
    running.path_of_folder = scene.render.filepath = f"{as_path_setting(running.unwritten)}/{name}"


def restore_path(scene: bpy.types.Scene) -> bool:
    """Give the scene its own path back, unless a handler of the file has given it another one meanwhile."""
    is_as_left = scene.render.filepath == running.path_of_folder
    if is_as_left:
        scene.render.filepath = running.path_in_scene
    return is_as_left


def leave_frame(scene: bpy.types.Scene) -> None:
    """Of a frame that has ended without being written: that is no failure of one that was rendered and left to the
    File Output nodes of a compositor that has nothing else to show."""
    if running.unwritten is not None:
        running.has_failed |= not running.is_rendered or running.unwritten.exists()
        restore_path(scene)
        running.unwritten = None


@persistent
def note_rendered(scene: bpy.types.Scene, _depsgraph: object = None) -> None:
    if not is_for_strip(scene):
        running.is_rendered = True


@persistent
def end_frame(scene: bpy.types.Scene, _depsgraph: object = None) -> None:
    """The frame's files (one, or one for each view) are whole: move them to their place."""
    if running.unwritten is None:
        return
    folder, running.unwritten = running.unwritten, None
    if not restore_path(scene) and not folder.exists():
        return  # it was written where a handler wants it
    if report.error_count > running.errors_before:  # of a scene that this one shows, which stops nothing
        sys.stderr.write(f"cistern: frame {scene.frame_current} is not whole, and left out\n")
        shutil.rmtree(folder, ignore_errors=True)
        running.has_failed = True
        return
    try:
        for file in sorted(folder.iterdir()):
            sys.stdout.write(f"Wrote {file.replace(folder.parent / file.name)}\n")
        folder.rmdir()
    except OSError as error:
        sys.stderr.write(f"cistern: a frame cannot be moved to its place: {error}\n")
        running.has_failed = True


@persistent
def abandon_frame(scene: bpy.types.Scene, _depsgraph: object = None) -> None:
    """The frame failed, or could not be written."""
    if is_for_strip(scene):
        return
    running.scene_name = ""
    running.has_failed |= is_ours(scene)
    if running.unwritten is not None:
        restore_path(scene)
        running.unwritten = None


@persistent
def end_job(scene: bpy.types.Scene, _depsgraph: object = None) -> None:
    if not is_for_strip(scene):
        leave_frame(scene)
        running.scene_name, running.is_under_way = "", False


HANDLERS = {
    "render_init": begin_job,
    "render_pre": begin_frame,
    "render_post": note_rendered,
    "render_write": end_frame,
    "render_cancel": abandon_frame,
    "render_complete": end_job,
}


def exit_now(status: int) -> NoReturn:
    """End the process with this status. Blender offers no other way to give one, and its temporary files go with it."""
    sys.stdout.flush()
    sys.stderr.flush()
    if bpy.app.tempdir:
        shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
    os._exit(status)


def exit_with_status() -> None:
    """As Blender ends: nothing to do unless a frame failed."""
    status = running.exit_status() if running else 0
    if status != 0:
        exit_now(status)


def start(argv: list[str]) -> None:
    """Watch the renders of this process. Raises OptionError."""
    global running
    running = CommandLineRender(parse(argv))
    for event, handler in HANDLERS.items():
        getattr(bpy.app.handlers, event).append(handler)


def register() -> None:
    if not (bpy.app.background and bpy.app.binary_path and is_render(sys.argv)):
        return
    try:
        start(sys.argv)
    except OptionError as error:
        sys.stderr.write(f"cistern: {error}\n")
        exit_now(STATUS_BAD_OPTIONS)
    atexit.register(exit_with_status)


def unregister() -> None:
    for event, handler in HANDLERS.items():
        handlers = getattr(bpy.app.handlers, event)
        if handler in handlers:
            handlers.remove(handler)
