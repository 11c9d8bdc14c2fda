"""The version matrix: every Blender times every step, from installing the zip to a killed render, as one table.

    .venv/bin/python -m tests.extension.matrix                      # bpy 4.2, 4.5, 5.0, 5.2 and 5.3, all steps
    .venv/bin/python -m tests.extension.matrix --blender 5.0.1 --step render cycles_between
    python3 -m tests.extension.matrix --zip FILE --executable blender     # a Blender that is installed here

Environments with each bpy go into build/extension and are made once. Each step is a process of its own with an empty
user directory; it counts as passed only if the process also ends cleanly.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from . import command_line_steps, environments
from .environments import REPOSITORY

STEP_SECONDS = 300
INSIDE = Path(__file__).with_name("inside.py")

INSIDE_STEPS = (
    *("render", "cycles_between", "cycles_around", "mitsuba", "openimageio"),
    *("disable", "upgrade", "uninstall", "unsupported", "frames"),
)
STEPS = (*INSIDE_STEPS, *command_line_steps.STEPS)

# Renders fail here, as they should, and Blender's executable ends with 1 after a script with such a render.
STEPS_WITH_FAILED_RENDERS = ("unsupported", "frames")

PASSED, FAILED, LEFT_OUT = "pass", "FAIL", "–"


@dataclass(frozen=True)
class Blender:
    name: str
    python_version: str
    command: tuple[str, ...]  # runs inside.py with the step's name added
    executable: str | None = None  # a program with a command line, which the bpy module lacks


@dataclass(frozen=True)
class Extension:
    archive: Path
    newer: Path
    newer_version: str
    work: Path

    def environment(self, step: str, blender: Blender, user: Path) -> dict[str, str]:
        """The variables that a step reads."""
        values = dict(os.environ, BLENDER_USER_RESOURCES=str(user), CISTERN_ZIP=str(self.archive))
        values |= {"CISTERN_NEXT_ZIP": str(self.newer), "CISTERN_NEXT_VERSION": self.newer_version}
        if step in environments.NEIGHBOURS:
            values["CISTERN_BESIDE"] = str(environments.neighbour(step, blender.python_version, self.work))
        return values


def run_step(step: str, blender: Blender, extension: Extension) -> tuple[str, str]:
    """PASSED, FAILED or LEFT_OUT, and the output of the process."""
    if step in command_line_steps.STEPS and blender.executable is None:
        return LEFT_OUT, ""
    with tempfile.TemporaryDirectory(prefix="cistern-matrix-") as user:
        environment = extension.environment(step, blender, Path(user))
        if step in command_line_steps.STEPS:
            return run_on_command_line(command_line_steps.STEPS[step], blender, environment)
        # Blender 4.5 can hang after Python has ended: nothing but a kill stops it.
        command = ["timeout", "-k", "1", str(STEP_SECONDS), *blender.command, step]
        done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    statuses = (0, 1) if blender.executable and step in STEPS_WITH_FAILED_RENDERS else (0,)
    is_passed = done.returncode in statuses and f"STEP {step} passed" in done.stdout
    return PASSED if is_passed else FAILED, f"{done.stdout}\nstatus {done.returncode}"


def run_on_command_line(
    check: Callable[[str, dict[str, str]], None], blender: Blender, environment: dict[str, str]
) -> tuple[str, str]:
    try:
        check(blender.executable, environment)
    except (AssertionError, subprocess.SubprocessError) as error:
        return FAILED, f"{type(error).__name__}: {error}"
    return PASSED, ""


def find_blenders(arguments: argparse.Namespace) -> list[Blender]:
    found = []
    for version in arguments.blender:
        python = str(environments.blender_module(version, arguments.work))
        found.append(Blender(f"bpy {version}", environments.BLENDER_PYTHON[version], (python, str(INSIDE))))
    for executable in arguments.executable:
        command = (executable, "-b", "--factory-startup", "--python-exit-code", "1", "--python", str(INSIDE), "--")
        found.append(Blender(executable, environments.python_of(executable), command, executable))
    return found


def table(rows: dict[str, dict[str, str]], steps: list[str]) -> str:
    """Markdown: a row for each Blender, a column for each step."""
    lines = [["Blender", *steps], ["---"] * (len(steps) + 1)]
    lines += [[name, *(results.get(step, "") for step in steps)] for name, results in rows.items()]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def run_matrix(blenders: list[Blender], steps: list[str], extension: Extension) -> dict[str, dict[str, str]]:
    rows: dict[str, dict[str, str]] = {}
    for blender in blenders:
        results = rows.setdefault(blender.name, {})
        for step in steps:
            start = time.monotonic()
            results[step], output = run_step(step, blender, extension)
            print(f"{blender.name}, {step}: {results[step]} ({time.monotonic() - start:.0f} s)", flush=True)
            if results[step] == FAILED:
                print(output, flush=True)
    return rows


def find_archive(given: Path | None) -> Path:
    """The zip to test: the one given, or one built now from the sources."""
    if given is not None:
        return given.resolve()
    subprocess.run([sys.executable, REPOSITORY / "addon" / "package.py"], check=True)
    return max((REPOSITORY / "dist").glob("cistern-*-linux-x64.zip"), key=lambda archive: archive.stat().st_mtime)


def main() -> int:
    parser = argparse.ArgumentParser(description="Test the extension in every supported Blender.")
    parser.add_argument(
        "--blender", nargs="*", metavar="VERSION", help="bpy modules (default: all, or none with --executable)"
    )
    parser.add_argument(
        "--executable", nargs="*", default=[], metavar="PROGRAM", help="Blender programs to test as well"
    )
    parser.add_argument("--step", nargs="+", choices=STEPS, default=list(STEPS), help="some steps only")
    parser.add_argument("--zip", type=Path, help="the extension (default: built now)")
    parser.add_argument(
        "--work", type=Path, default=REPOSITORY / "build" / "extension", help="where environments are kept"
    )
    arguments = parser.parse_args()
    if arguments.blender is None:
        arguments.blender = [] if arguments.executable else list(environments.BLENDER_PYTHON)
    arguments.work.mkdir(parents=True, exist_ok=True)
    archive = find_archive(arguments.zip)
    newer, newer_version = environments.newer_extension(archive, arguments.work)
    extension = Extension(archive, newer, newer_version, arguments.work)
    rows = run_matrix(find_blenders(arguments), arguments.step, extension)
    print(table(rows, arguments.step))
    return 1 if any(FAILED in results.values() for results in rows.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
