"""Zip files that hold the same bytes whenever and wherever they are made from the same files, and wheels as folders."""

import base64
import hashlib
import re
import zipfile
from pathlib import Path

# The earliest date that a zip file can hold.
DATE = (1980, 1, 1, 0, 0, 0)
FILE_MODE = 0o100644
COMPRESSION_LEVEL = 9


def write_zip(folder: Path, archive: Path) -> None:
    """All files below `folder` in the order of their names, with one date and mode. Appears whole or not at all."""
    partial = archive.with_name(f".{archive.name}.partial")
    with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED, compresslevel=COMPRESSION_LEVEL) as target:
        for file in sorted(folder.rglob("*"), key=lambda path: path.relative_to(folder).as_posix()):
            if file.is_file():
                entry = zipfile.ZipInfo(file.relative_to(folder).as_posix(), DATE)
                entry.external_attr = FILE_MODE << 16
                # A wheel is compressed already.
                entry.compress_type = zipfile.ZIP_STORED if file.suffix == ".whl" else zipfile.ZIP_DEFLATED
                target.writestr(entry, file.read_bytes())
    partial.replace(archive)


def unpack(archive: Path, folder: Path) -> None:
    with zipfile.ZipFile(archive) as source:
        source.extractall(folder)


def pack_wheel(folder: Path, wheel: Path) -> None:
    """An unpacked wheel as a file again; its RECORD of files and hashes is written anew."""
    [metadata] = folder.glob("*.dist-info")
    record = metadata / "RECORD"
    record.unlink()
    lines = [_record_line(file, folder) for file in sorted(folder.rglob("*")) if file.is_file()]
    record.write_text("\n".join([*lines, f"{record.relative_to(folder).as_posix()},,", ""]), encoding="utf-8")
    write_zip(folder, wheel)


def _record_line(file: Path, folder: Path) -> str:
    content = file.read_bytes()
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{file.relative_to(folder).as_posix()},sha256={digest},{len(content)}"


def oldest_glibc(wheels: list[Path]) -> tuple[int, int]:
    """The version of the GNU C library from which on all of the wheels run: the newest of what each asks for."""
    return max(min(_manylinux_tags(wheel)) for wheel in wheels)


def _manylinux_tags(wheel: Path) -> list[tuple[int, int]]:
    tags = [(int(major), int(minor)) for major, minor in re.findall(r"manylinux_(\d+)_(\d+)_", wheel.name)]
    if not tags:
        raise ValueError(f"{wheel.name} names no manylinux platform")
    return tags
