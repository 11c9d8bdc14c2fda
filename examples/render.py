"""Renders one frame of a .blend file, or of the demo scene, and writes a PNG and a multilayer EXR.

Runs in the virtual environment that examples/setup.sh makes; examples/run.sh does both.
"""

import argparse
import atexit
import shutil
import sys
import tempfile
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import addon
import make_demo_scene
from addon import cycles_settings, report, techniques

REPOSITORY = Path(__file__).resolve().parent.parent
PROGRESS_SECONDS = 10.0
SWITCHES = {"1": True, "true": True, "on": True, "0": False, "false": False, "off": False}
PICTURE = "picture"  # what files are called until they get the name of the scene


class UserError(Exception):
    """Something the user can put right; the text says what."""


def sentence(error: RuntimeError) -> str:
    """What Blender reported when an operator failed."""
    return str(error).removeprefix("Error: ").strip()


def positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value} is not positive")
    return value


def parse_arguments(words: list[str] | None = None) -> argparse.Namespace:
    """Of the command line, unless other words are given."""
    parser = argparse.ArgumentParser(
        prog="run.sh", description="Render a .blend file, or the demo scene, with Cistern."
    )
    parser.add_argument("blend", nargs="?", help="the file to render (default: the demo scene)")
    parser.add_argument("settings", nargs="*", metavar="SETTING=VALUE", help="any setting of scene.cistern")
    parser.add_argument("--samples", type=positive, help="samples per pixel")
    parser.add_argument("--width", type=positive, help="pixels; the height follows unless given")
    parser.add_argument("--height", type=positive, help="pixels; the width follows unless given")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--preset", help="FINAL, INTERACTIVE, RIS, RESTIR_DI, CELL_CACHE ... (README: Settings)")
    parser.add_argument("--light-sampler", help="UNIFORM, POWER or TREE")
    parser.add_argument("--frame", type=int, help="frame number (default: the file's current frame)")
    parser.add_argument("--cycles-settings", action="store_true", help="with what the file has set for Cycles")
    parser.add_argument("--output", type=Path, default=REPOSITORY / "out", help="folder (default: out)")
    parser.add_argument(
        "--engine",
        choices=("CISTERN", "CYCLES"),
        default="CISTERN",
        help="CYCLES renders the same picture with Cycles, to compare",
    )
    arguments = parser.parse_intermixed_args(words)
    positionals = [] if arguments.blend is None else [arguments.blend, *arguments.settings]
    arguments.blend, arguments.settings = sort_positionals(positionals)
    for setting in arguments.settings:
        if "=" not in setting:
            parser.error(f"expected SETTING=VALUE, found {setting!r}")
    return arguments


def sort_positionals(words: list[str]) -> tuple[Path | None, list[str]]:
    """The file to render, wherever it stands, and the others: files that exist go first, whatever their names."""
    files = [word for word in words if Path(word).is_file()] or [word for word in words if "=" not in word]
    if not files:
        return None, words
    return Path(files[0]), [word for word in words if word is not files[0]]


def open_scene(blend: Path | None, output: Path) -> str:
    """Opens the file, or the demo scene, built anew where its scripts are newer; returns a name for the pictures."""
    if blend is None:
        blend = make_demo_scene.ensure(output / "cistern_demo.blend")
    elif not blend.is_file():
        raise UserError(f"there is no file {blend}")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(blend.resolve()), load_ui=False)
    except RuntimeError as error:
        raise UserError(f"Blender {bpy.app.version_string} cannot open {blend}: {sentence(error)}") from error
    return blend.stem


def set_property(owner: bpy.types.bpy_struct, name: str, text: str) -> None:
    """Gives a setting the value that `text` writes, by the type of the setting."""
    prop = owner.bl_rna.properties.get(name)
    if prop is None or name == "rna_type":
        names = ", ".join(p.identifier for p in owner.bl_rna.properties if p.identifier not in ("rna_type", "name"))
        raise UserError(f"there is no setting {name!r}; there are {names}")
    try:
        if prop.type == "BOOLEAN":
            if text.lower() not in SWITCHES:
                raise ValueError("that is on or off")
            value = SWITCHES[text.lower()]
        else:
            value = {"INT": int, "FLOAT": float, "ENUM": str.upper, "STRING": str}[prop.type](text)
        setattr(owner, name, value)
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{text!r} is no value for {name}: {error}") from error
    if prop.type in ("INT", "FLOAT") and not prop.hard_min <= value <= prop.hard_max:  # Blender has clamped it
        raise UserError(f"{name} is {text}, and may be {prop.hard_min} to {prop.hard_max}")


def set_resolution(render: bpy.types.RenderSettings, width: int | None, height: int | None) -> None:
    """One of the two keeps the shape of the picture, both together set a new one."""
    aspect = render.resolution_x / render.resolution_y
    if width is None and height is None:
        return
    render.resolution_percentage = 100
    wanted = (
        width if width is not None else max(1, round(height * aspect)),
        height if height is not None else max(1, round(width / aspect)),
    )
    render.resolution_x, render.resolution_y = wanted
    if (render.resolution_x, render.resolution_y) != wanted:  # Blender has clamped it
        raise UserError(f"Blender renders no pictures of {wanted[0]} × {wanted[1]} pixels")


def apply_settings(scene: bpy.types.Scene, arguments: argparse.Namespace) -> None:
    scene.render.engine = arguments.engine
    set_resolution(scene.render, arguments.width, arguments.height)
    if arguments.frame is not None:
        scene.frame_set(arguments.frame)
        if scene.frame_current != arguments.frame:
            raise UserError(f"Blender has no frame {arguments.frame}")
    if arguments.cycles_settings:
        for words in cycles_settings.take_over(scene):
            print(f"Warning: of Cycles' settings: {words}")
    of_both = [("samples", arguments.samples), ("seed", arguments.seed)]
    of_cistern = [("light_sampler", arguments.light_sampler)]
    of_cistern += [tuple(setting.split("=", 1)) for setting in arguments.settings]
    if arguments.engine == "CYCLES":
        set_properties(scene.cycles, of_both)
        if arguments.samples is not None:
            scene.cycles.use_denoising = False
        settings = [("preset", arguments.preset), *of_cistern]
        warn_of_settings([name for name, value in settings if value is not None])
    else:
        if arguments.preset is not None:
            choose_preset(scene.cistern, arguments.preset.upper())
        set_properties(scene.cistern, of_both + of_cistern)


def choose_preset(settings: bpy.types.PropertyGroup, preset: str) -> None:
    """Whole: what the file has set besides its own preset would win."""
    names = [identifier for identifier, *_ in techniques.PRESET_ITEMS]
    if preset not in names:
        raise UserError(f"there is no preset {preset}; there are {', '.join(names)}")
    techniques.choose_preset(settings, preset)


def set_properties(owner: bpy.types.bpy_struct, settings: list[tuple[str, object]]) -> None:
    """Gives each setting its value, in this order, unless that is None."""
    for name, value in settings:
        if value is not None:
            set_property(owner, name, str(value))


def warn_of_settings(names: list[str]) -> None:
    if names:
        are = "are settings of Cistern and are" if len(names) > 1 else "is a setting of Cistern and is"
        print(f"Warning: {', '.join(names)} {are} left out")


def set_format(settings: bpy.types.ImageFormatSettings, file_format: str) -> None:
    multilayer = file_format == "OPEN_EXR_MULTILAYER"
    if hasattr(settings, "media_type"):  # Blender 5.0 and later
        settings.media_type = "MULTI_LAYER_IMAGE" if multilayer else "IMAGE"
    settings.file_format = file_format
    settings.color_mode = "RGBA"
    settings.color_depth = "32" if multilayer else "8"


def write_as_one_part(render: bpy.types.RenderSettings) -> None:
    """Where pixels are not square: Blender 5.0 cannot write them in files of several parts (there may be a choice)."""
    if render.pixel_aspect_x != render.pixel_aspect_y and hasattr(render.image_settings, "use_exr_interleave"):
        render.image_settings.use_exr_interleave = True


def check_report(engine: str) -> None:
    """An error that the add-on reported of a view layer ends the script."""
    if engine != "CISTERN":
        return
    for layer in report.last:
        if layer.error:
            raise UserError(f"the render failed: {layer.error}")


def tell_progress() -> None:
    """Has Blender call a handler whenever the engine has news, of which one line in PROGRESS_SECONDS is printed."""
    told = time.monotonic()

    def tell(status: str, _: object = None) -> None:
        nonlocal told
        if time.monotonic() - told >= PROGRESS_SECONDS:
            told = time.monotonic()
            print(status, flush=True)

    bpy.app.handlers.render_stats.append(tell)


def render_files(scene: bpy.types.Scene, folder: Path) -> list[Path]:
    """Renders into `folder`: the multilayer EXR as the render's own file (or several, of several views), the PNG from
    the same result."""
    exr, png = folder / f"{PICTURE}.exr", folder / f"{PICTURE}.png"
    scene.render.use_file_extension = False
    scene.render.filepath = str(exr)
    set_format(scene.render.image_settings, "OPEN_EXR_MULTILAYER")
    write_as_one_part(scene.render)
    try:
        bpy.ops.render.render(write_still=True)
    except RuntimeError as error:  # whatever an engine reports as an error
        check_report(scene.render.engine)
        raise UserError(f"the render failed: {sentence(error)}") from error
    check_report(scene.render.engine)
    if scene.render.use_multiview:
        print("Warning: of pictures of several views there is no .png")
        return sorted(folder.iterdir())
    set_format(scene.render.image_settings, "PNG")
    bpy.data.images["Render Result"].save_render(str(png), scene=scene)
    return [exr, png]


def deliver(file: Path, destination: Path) -> None:
    """Copies a picture; it gets its name when it is whole, so that no half picture ever carries it."""
    partial = destination.with_name(f".{destination.name}.partial")
    try:
        shutil.copyfile(file, partial)
        partial.replace(destination)
    finally:
        partial.unlink(missing_ok=True)
    print(f"Wrote {destination}")


def run(arguments: argparse.Namespace, scratch: Path) -> None:
    """Opens, sets up, renders, writes. Raises UserError and OSError."""
    output: Path = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=output):  # or the render would be for nothing
        pass
    name = open_scene(arguments.blend, output)
    scene = bpy.context.scene
    apply_settings(scene, arguments)
    if arguments.frame is not None:
        name += f"_{arguments.frame:04d}"
    if arguments.engine != "CISTERN":
        name += f"_{arguments.engine.lower()}"
    tell_progress()
    start = time.monotonic()
    files = render_files(scene, scratch)
    print(f"Rendered in {time.monotonic() - start:.1f} s")
    for file in files:
        deliver(file, output / file.name.replace(PICTURE, name, 1))


def main() -> int:
    arguments = parse_arguments()
    addon.register()
    atexit.register(addon.unregister)
    with tempfile.TemporaryDirectory(prefix="cistern-") as scratch:
        try:
            run(arguments, Path(scratch))
        except (UserError, OSError) as error:
            print(f"run.sh: {error}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.exit(status)
