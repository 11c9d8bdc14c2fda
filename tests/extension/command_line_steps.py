"""The steps of the matrix that need Blender's own command line: options, exit status, killed renders.

Each takes the Blender program and the environment of its processes, and fails by an AssertionError.
"""

import json
import subprocess
import time
from pathlib import Path

SECONDS = 120
LAST_FRAME = 3
PNG_END = b"IEND\xaeB`\x82"

# Large and slow to compress, so that a kill can meet Blender as it writes.
SCENE = """
import bpy
render = bpy.context.scene.render
render.resolution_x, render.resolution_y, render.resolution_percentage = {width}, {height}, 100
render.image_settings.file_format, render.image_settings.compression = 'PNG', 100
if {without_camera}:
    bpy.data.objects.remove(bpy.context.scene.camera)
bpy.ops.wm.save_as_mainfile(filepath={file!r})
"""


def blender(program: str, environment: dict[str, str], *arguments: str) -> subprocess.CompletedProcess:
    command = ["timeout", "-k", "1", str(SECONDS), program, "-b", *arguments]
    return subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def prepare(program: str, environment: dict[str, str], width: int, height: int, without_camera: bool = False) -> Path:
    """Install the extension; returns a scene file in the user directory, beside which pictures may lie."""
    install = ("extension", "install-file", "--repo", "user_default", "--enable", environment["CISTERN_ZIP"])
    done = blender(program, environment, "--command", *install)
    assert done.returncode == 0, done.stdout
    file = Path(environment["BLENDER_USER_RESOURCES"]) / "scene.blend"
    script = SCENE.format(width=width, height=height, without_camera=without_camera, file=str(file))
    done = blender(program, environment, "--python-exit-code", "1", "--python-expr", script)
    assert done.returncode == 0, done.stdout
    return file


def frames_arguments(file: Path, frames: str, *options: str) -> list[str]:
    place = str(file.parent / "out" / "picture_####")
    return [str(file), "-E", "CISTERN", "-o", place, "-F", "PNG", "-f", frames, "--", *options]


def pictures(file: Path) -> dict[str, bytes]:
    """What lies in the output folder and is not hidden."""
    folder = file.parent / "out"
    found = sorted(folder.iterdir()) if folder.is_dir() else []
    return {place.name: place.read_bytes() for place in found if not place.name.startswith(".")}


def reports(output: str) -> list[dict]:
    return [json.loads(line.partition(" ")[2]) for line in output.splitlines() if line.startswith("CISTERN {")]


def options(program: str, environment: dict[str, str]) -> None:
    """A still and a range of frames with options after `--`; equal seeds and any threads give equal pictures."""
    file = prepare(program, environment, 48, 36)
    done = blender(
        program, environment, *frames_arguments(file, "1", "--cistern-samples", "5", "--cistern-threads", "1")
    )
    assert done.returncode == 0 and [report["samples"] for report in reports(done.stdout)] == [5], done.stdout
    first = pictures(file)
    done = blender(program, environment, *frames_arguments(file, f"1..{LAST_FRAME}", "--cistern-samples", "5"))
    assert done.returncode == 0 and [report["frame"] for report in reports(done.stdout)] == [1, 2, 3], done.stdout
    again = pictures(file)
    assert sorted(again) == [f"picture_{frame:04}.png" for frame in (1, 2, 3)], sorted(again)
    # Not the files, which carry the time of the render.
    assert len(first["picture_0001.png"]) > 0 and again["picture_0001.png"].endswith(PNG_END)
    limited = ("--cistern-samples", "100000", "--cistern-time-limit", "0.5")
    done = blender(program, environment, *frames_arguments(file, "1", *limited))
    assert done.returncode == 0 and 0 < reports(done.stdout)[0]["samples"] < 100000, done.stdout


def status(program: str, environment: dict[str, str]) -> None:
    """0 for success is in the other steps; here 2 for bad options, 1 for frames that fail or cannot be written."""
    file = prepare(program, environment, 48, 36)
    for wrong in (("--cistern-samples", "0"), ("--cistern-sampels", "4"), ("--cistern-preset", "BEST")):
        done = blender(program, environment, *frames_arguments(file, "1", *wrong))
        assert done.returncode == 2 and "cistern: " in done.stdout and wrong[0] in done.stdout, done.stdout
        assert "Traceback" not in done.stdout, done.stdout
    (file.parent / "out").write_text("a file where the folder should be")
    done = blender(program, environment, *frames_arguments(file, "1", "--cistern-samples", "1"))
    assert done.returncode == 1, done.stdout
    (file.parent / "out").unlink()
    no_core = ("--python-expr", "import sys; sys.modules['cistern_core'] = None")
    done = blender(program, environment, *no_core, *frames_arguments(file, "1..2"))
    assert done.returncode == 1 and not pictures(file), done.stdout
    assert len(reports(done.stdout)) == 2 and reports(done.stdout)[0]["error"], done.stdout
    file = prepare(program, environment, 48, 36, without_camera=True)
    done = blender(program, environment, *frames_arguments(file, "1"))
    assert done.returncode == 1 and not pictures(file), done.stdout


def killed(program: str, environment: dict[str, str]) -> None:
    """Killed as it writes a frame, it leaves only whole pictures; a resumed render makes the missing ones."""
    file = prepare(program, environment, 1600, 1200)
    arguments = frames_arguments(file, f"1..{LAST_FRAME}", "--cistern-samples", "1", "--cistern-resume")
    kill_while_writing([program, "-b", *arguments], environment, file.parent / "out", frame=2)
    left = pictures(file)
    assert list(left) == ["picture_0001.png"] and left["picture_0001.png"].endswith(PNG_END), list(left)
    done = blender(program, environment, *arguments)
    assert done.returncode == 0 and [report["frame"] for report in reports(done.stdout)] == [2, 3], done.stdout
    completed = pictures(file)
    assert len(completed) == LAST_FRAME and completed["picture_0001.png"] == left["picture_0001.png"]
    assert all(content.endswith(PNG_END) for content in completed.values())
    assert not list((file.parent / "out").glob(".*")), "a hidden folder is left"


def kill_while_writing(command: list[str], environment: dict[str, str], folder: Path, frame: int) -> None:
    """SIGKILL as soon as a part of the frame's file is there."""
    partial = folder / f".picture_{frame:04}.png.partial" / f"picture_{frame:04}.png"
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        end = time.monotonic() + SECONDS
        while not partial.exists() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.001)
        process.kill()
    assert process.returncode == -9, f"ended with {process.returncode} before it could be killed"
    assert not partial.read_bytes().endswith(PNG_END), "killed too late to prove anything"


STEPS = {"cli_options": options, "cli_status": status, "cli_killed": killed}
