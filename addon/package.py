"""Builds the extension: `python addon/package.py` writes dist/cistern-<version>-linux-x64.zip.

One zip serves Blender 4.2 to 5.3. Two runs over the same sources with the same Debian packages write the same bytes.
Needs what examples/setup.sh installs, Python 3.11 and 3.13 with their headers, and runs in an environment that has
`bpy`, whose own tool checks the result.
"""

import argparse
import importlib.util
import shutil
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path

from extension_build import archives, wheels
from extension_build.wheels import PackagingError

ADDON = Path(__file__).resolve().parent
REPOSITORY = ADDON.parent

LEFT_OUT = {"README.md", "package.py", "extension_build", "__pycache__"}

# Debian packages whose libraries the core's wheel bundles; their licences go into the zip.
BUNDLED_PACKAGES = {
    "embree": "libembree3-3",
    "onetbb": "libtbb12",
    "opensubdiv": "libosdcpu3.5.0",
    "libgomp": "libgomp1",
}

# Of the oldest systems that the README names. A newer one than this can come in by a single function of the C library.
NEWEST_GLIBC = (2, 34)

BYTES_PER_MB = 1e6


def extension_version() -> str:
    """The version in the manifest. Raises PackagingError if the core has another."""
    manifest = tomllib.loads((ADDON / "blender_manifest.toml").read_text(encoding="utf-8"))
    core = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    if manifest["version"] != core:
        raise PackagingError(f"the manifest says version {manifest['version']}, pyproject.toml {core}")
    return core


def check_pythons(versions: Sequence[str]) -> None:
    """Raises PackagingError where one is missing: it would show only when the others are compiled."""
    for version in versions:
        try:
            wheels.find_python(version)
        except PackagingError as error:
            others = " ".join(other for other in versions if other != version)
            hint = f"; with --python {others} the zip goes without it" if others else ""
            raise PackagingError(f"{error}{hint}") from error


def gather_wheels(versions: Sequence[str], work: Path, target: Path) -> list[Path]:
    check_pythons(versions)
    found = []
    for version in versions:
        print(f"Python {version}: compiling the core", flush=True)
        found.append(wheels.build_core(version, REPOSITORY, work, target))
        found.append(wheels.fetch_openimageio(version, work, target))
    return found


def lay_out(stage: Path, found: list[Path]) -> None:
    """The files of the extension; the wheels lie in its folder `wheels` already."""
    for source in sorted(ADDON.rglob("*")):
        place = source.relative_to(ADDON)
        if source.is_file() and not LEFT_OUT & set(place.parts):
            (stage / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, stage / place)
    shutil.copyfile(REPOSITORY / "LICENSE", stage / "LICENSE")
    (stage / "licenses").mkdir()
    for name, package in BUNDLED_PACKAGES.items():
        shutil.copyfile(Path("/usr/share/doc") / package / "copyright", stage / "licenses" / f"{name}.txt")
    write_manifest(stage / "blender_manifest.toml", found)


def write_manifest(manifest: Path, found: list[Path]) -> None:
    """Lists the wheels where the manifest in the sources has a comment in their place."""
    listing = "wheels = [\n" + "".join(f'  "./wheels/{wheel.name}",\n' for wheel in found) + "]\n"
    text = manifest.read_text(encoding="utf-8")
    before, comment, after = text.partition("# wheels:")
    if not comment:
        raise PackagingError("blender_manifest.toml has lost its line '# wheels:'")
    manifest.write_text(before + listing + after.partition("\n")[2], encoding="utf-8")


def check_glibc(found: list[Path]) -> tuple[int, int]:
    """The C library that the wheels need. Raises PackagingError where it is newer than what is promised."""
    needed = archives.oldest_glibc(found)
    if needed > NEWEST_GLIBC:
        versions = [".".join(map(str, version)) for version in (needed, NEWEST_GLIBC)]
        raise PackagingError(
            "the wheels need glibc {}, newer than the {} of the systems they are for".format(*versions)
        )
    return needed


def validate(archive: Path) -> None:
    """Has Blender's own tool for extensions read the zip. Raises PackagingError with its words."""
    blender = importlib.util.find_spec("bpy")
    folders = list(blender.submodule_search_locations or []) if blender else []
    tools = [
        tool for folder in folders for tool in Path(folder).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    ]
    if not tools:
        raise PackagingError(f"{sys.executable} has no bpy, whose tool validates the zip: use .venv/bin/python")
    wheels.run(sys.executable, tools[0], "validate", archive)


def package(output: Path, work: Path, versions: Sequence[str] = wheels.PYTHON_VERSIONS) -> Path:
    """Builds everything in `work`, and the core beside it; writes the zip into `output`. Raises PackagingError,
    OSError, ValueError."""
    name = f"cistern-{extension_version()}-linux-x64.zip"
    stage = work / "stage"
    shutil.rmtree(stage, ignore_errors=True)
    found = gather_wheels(versions, work, stage / "wheels")
    major, minor = check_glibc(found)
    lay_out(stage, found)
    unchecked = work / name
    archives.write_zip(stage, unchecked)
    validate(unchecked)
    output.mkdir(parents=True, exist_ok=True)
    archive = unchecked.replace(output / name)
    print(f"{archive}: {archive.stat().st_size / BYTES_PER_MB:.1f} MB, needs glibc {major}.{minor} or newer")
    return archive


def main() -> int:
    parser = argparse.ArgumentParser(description="Build Cistern's extension for Blender 4.2 to 5.3 on Linux.")
    parser.add_argument("--output", type=Path, default=REPOSITORY / "dist", help="folder of the zip (default: dist)")
    parser.add_argument(
        "--work",
        type=Path,
        default=REPOSITORY / "build" / "package",
        help="folder for what is kept; the core is compiled beside it",
    )
    parser.add_argument(
        "--python", nargs="+", choices=wheels.PYTHON_VERSIONS, default=wheels.PYTHON_VERSIONS, help="for these only"
    )
    arguments = parser.parse_args()
    try:
        package(arguments.output.resolve(), arguments.work.resolve(), arguments.python)
    except (PackagingError, OSError, ValueError) as error:
        print(f"package.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
