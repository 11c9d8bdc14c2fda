"""Gives the libraries bundled in a wheel names that nothing else in Blender's process has.

Blender's executable has an Embree, a oneTBB and their symbols in its global scope, where the dynamic linker looks
first: a bundled copy would be mapped, and yet every call answered by Blender's. So both the file name (`DT_SONAME`,
or a copy bundled by another package is taken for ours) and every exported symbol get a prefix, in the libraries and in
all that use them.
"""

import re
import subprocess
from pathlib import Path

PREFIX = "cistern_"

# Lines of `nm -D`: the address where the symbol is defined, its type, its name and version.
SYMBOL_LINE = re.compile(r"^(?P<address>[0-9a-f]*) +(?P<type>\S) (?P<name>[^@\s]+)", re.MULTILINE)


class Patchelf:
    """The tool that edits the dynamic section of shared libraries. One change a call: several at once go wrong."""

    def __init__(self, program: Path) -> None:
        self.program = program

    def __call__(self, *arguments: str | Path) -> str:
        command = [str(self.program), *map(str, arguments)]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def exported_symbols(library: Path) -> set[str]:
    """Names that `library` defines for others."""
    return {name for defined, name in _dynamic_symbols(library) if defined}


def imported_symbols(library: Path) -> set[str]:
    """Names that `library` takes from others."""
    return {name for defined, name in _dynamic_symbols(library) if not defined}


def _dynamic_symbols(library: Path) -> list[tuple[bool, str]]:
    listing = subprocess.run(["nm", "-D", str(library)], check=True, capture_output=True, text=True).stdout
    return [(bool(match["address"].strip()), match["name"]) for match in SYMBOL_LINE.finditer(listing)]


def make_private(libraries: list[Path], modules: list[Path], patchelf: Patchelf, scratch: Path) -> list[Path]:
    """Rename `libraries` and their symbols, in `modules` (the libraries' users) too. Returns the new library files."""
    symbols = sorted(set().union(*(exported_symbols(library) for library in libraries)))
    names = scratch / "private_symbols.txt"
    names.write_text("".join(f"{symbol} {PREFIX}{symbol}\n" for symbol in symbols), encoding="ascii")
    renamed = {library.name: _private_name(library.name) for library in libraries}
    for binary in [*libraries, *modules]:
        patchelf("--rename-dynamic-symbols", names, binary)
        needed = patchelf("--print-needed", binary).split()
        for old, new in renamed.items():
            if old in needed:
                patchelf("--replace-needed", old, new, binary)
    for library in libraries:
        patchelf("--set-soname", renamed[library.name], library)
    private = [library.rename(library.with_name(renamed[library.name])) for library in libraries]
    check_private([*private, *modules], set(symbols))
    return private


def _private_name(file_name: str) -> str:
    """`libtbb-1a2b.so.12.8` becomes `libcistern_tbb-1a2b.so.12.8`."""
    return f"lib{PREFIX}{file_name.removeprefix('lib')}"


def check_private(binaries: list[Path], public_symbols: set[str]) -> None:
    """Raises ValueError if a public name is left, or a private one that none of the binaries defines."""
    exported = set().union(*(exported_symbols(binary) for binary in binaries))
    for binary in binaries:
        left = public_symbols & (exported_symbols(binary) | imported_symbols(binary))
        if left:
            raise ValueError(f"{binary.name} still has the public names {', '.join(sorted(left))}")
        missing = {name for name in imported_symbols(binary) if name.startswith(PREFIX)} - exported
        if missing:
            raise ValueError(f"{binary.name} needs {', '.join(sorted(missing))}, which nothing here defines")
