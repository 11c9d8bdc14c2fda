"""The quick form of the version matrix: the extension built for one Python, in the Blender of this environment."""

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.extension import environments
from tests.extension.matrix import INSIDE, PASSED, Blender, Extension, run_step

PACKAGE = environments.REPOSITORY / "addon" / "package.py"
PACKAGING = environments.REPOSITORY / "build" / "package"
PYTHON = f"{sys.version_info.major}.{sys.version_info.minor}"
QUICK_STEPS = ("render", "cycles_around", "disable", "upgrade", "uninstall", "unsupported", "frames")
WORK = environments.REPOSITORY / "build" / "extension"


def package(output: Path, work: Path) -> Path:
    command = [sys.executable, PACKAGE, "--python", PYTHON, "--output", output, "--work", work]
    subprocess.run(command, check=True)
    [archive] = output.glob("cistern-*-linux-x64.zip")
    return archive


@pytest.fixture(scope="module")
def extension(tmp_path_factory) -> Extension:
    folder = tmp_path_factory.mktemp("extension")
    archive = package(folder, PACKAGING)
    newer, version = environments.newer_extension(archive, folder)
    return Extension(archive, newer, version, WORK)


@pytest.fixture(scope="module")
def blender_alone(tmp_path_factory) -> Path:
    """A folder with Blender and NumPy, but without the core that this environment has too."""
    folder = tmp_path_factory.mktemp("blender")
    for name in ("bpy", "numpy"):
        [place] = importlib.util.find_spec(name).submodule_search_locations
        (folder / name).symlink_to(place)
    return folder


@pytest.mark.parametrize("step", QUICK_STEPS)
def test_step(extension, blender_alone, step, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(blender_alone))
    blender = Blender("bpy here", PYTHON, (sys._base_executable, str(INSIDE)))
    outcome, output = run_step(step, blender, extension)
    assert outcome == PASSED, output


def test_nothing_runs_before_the_processor_is_checked(extension):
    """Initialisers of globals would: they run as the module is loaded, and on an older processor end Blender."""
    objects = sorted((PACKAGING.parent / "core").rglob("*.o"))
    assert len(objects) > 50
    listing = subprocess.run(["nm", "-A", *objects], check=True, capture_output=True, text=True).stdout
    found = [line for line in listing.splitlines() if "_GLOBAL__sub_I" in line and "/cistern_core" in line]
    assert not found, found


def test_packing_again_gives_the_same_bytes(extension, tmp_path):
    again = package(tmp_path, PACKAGING)
    assert again.read_bytes() == extension.archive.read_bytes()


@pytest.mark.slow
def test_building_from_nothing_gives_the_same_bytes(extension, tmp_path, monkeypatch):
    monkeypatch.setenv("CCACHE_DISABLE", "1")
    again = package(tmp_path, tmp_path / "work")
    assert again.read_bytes() == extension.archive.read_bytes()


def test_validation_refuses_a_broken_manifest(tmp_path):
    addon = tmp_path / "cistern"
    shutil.copytree(environments.REPOSITORY / "addon", addon / "addon", ignore=shutil.ignore_patterns("__pycache__"))
    environments.replace_in(addon / "addon" / "blender_manifest.toml", 'schema_version = "1.0.0"', "")
    archive = tmp_path / "broken.zip"
    environments.write_zip(addon / "addon", archive)
    specification = importlib.util.spec_from_file_location("cistern_package", addon / "addon" / "package.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    with pytest.raises(module.PackagingError, match="validate"):
        module.validate(archive)
