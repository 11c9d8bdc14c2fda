"""What the version matrix needs: environments with Blender's Python module, neighbours, and a newer extension."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY / "addon"))

from extension_build.archives import pack_wheel, unpack, write_zip  # noqa: E402
from extension_build.wheels import find_python, run  # noqa: E402

# Long-term releases and the newest of the others, with the Python that each is built for.
BLENDER_PYTHON = {"4.2.23": "3.11", "4.5.15": "3.11", "5.0.1": "3.11", "5.2.3": "3.13", "5.3.0": "3.13"}

# Mitsuba bundles an Embree 3; this OpenImageIO is newer than the extension's.
NEIGHBOURS = {"mitsuba": ("mitsuba==3.7.1", "drjit==1.2.0"), "openimageio": ("OpenImageIO==3.2.2.0",)}


def blender_module(version: str, work: Path) -> Path:
    """The interpreter of an environment that has this bpy; made once."""
    python = work / f"blender-{version}" / "bin" / "python"
    if not (python.parent.parent / ".ready").exists():
        run(find_python(BLENDER_PYTHON[version]), "-m", "venv", "--clear", python.parent.parent)
        run(python, "-m", "pip", "install", "--disable-pip-version-check", f"bpy=={version}")
        (python.parent.parent / ".ready").touch()
    return python


def neighbour(name: str, python_version: str, work: Path) -> Path:
    """A folder with another package to be loaded beside the extension; made once."""
    folder = work / f"{name}-{python_version}"
    if not (folder / ".ready").exists():
        shutil.rmtree(folder, ignore_errors=True)
        python = find_python(python_version)
        run(
            *(python, "-m", "pip", "install", "--disable-pip-version-check", "--no-deps"),
            "--target",
            folder,
            *NEIGHBOURS[name],
        )
        (folder / ".ready").touch()
    return folder


def python_of(executable: str) -> str:
    """The version of the Python inside a Blender executable, such as 3.13."""
    program = "import sys; print('PYTHON %d.%d' % sys.version_info[:2])"
    command = [executable, "-b", "--factory-startup", "--python-expr", program]
    output = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout
    return re.search(r"^PYTHON (\S+)$", output, re.MULTILINE).group(1)


def version_of(archive: Path) -> str:
    return re.fullmatch(r"cistern-(.+)-linux-x64\.zip", archive.name).group(1)


def newer_extension(archive: Path, work: Path) -> tuple[Path, str]:
    """The same extension and core under the next version number, as an upgrade would bring. Also that number."""
    old = version_of(archive)
    new = re.sub(r"\d+$", lambda last: str(int(last[0]) + 1), old)
    folder = work / "newer"
    shutil.rmtree(folder, ignore_errors=True)
    unpack(archive, folder / "extension")
    for wheel in (folder / "extension/wheels").glob(f"cistern_core-{old}-*.whl"):
        content = folder / wheel.stem
        unpack(wheel, content)
        metadata = (content / f"cistern_core-{old}.dist-info").rename(content / f"cistern_core-{new}.dist-info")
        replace_in(metadata / "METADATA", f"Version: {old}", f"Version: {new}")
        pack_wheel(content, wheel.with_name(wheel.name.replace(old, new, 1)))
        wheel.unlink()
    manifest = folder / "extension/blender_manifest.toml"
    replace_in(manifest, f'version = "{old}"', f'version = "{new}"')
    replace_in(manifest, f"cistern_core-{old}", f"cistern_core-{new}")
    newer = work / archive.name.replace(old, new)
    write_zip(folder / "extension", newer)
    return newer, new


def replace_in(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text, f"{file} has no {old}"
    file.write_text(text.replace(old, new), encoding="utf-8")
