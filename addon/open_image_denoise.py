"""Open Image Denoise by its C interface: arrays in, array out, on the copy that Blender ships.

Nothing is bundled: the library that Cycles uses is mapped into the process once Blender has started, and both engines
use it by turns. Every function has its argument types, buffers live until the filter is released, and ctypes lets
other Python threads run meanwhile. Needs no scene and no user interface, only `bpy`.

Source: the library's documentation, version 2 (https://www.openimagedenoise.org/documentation.html).
"""

import ctypes
import functools
import re
from collections.abc import Callable
from ctypes import POINTER, c_bool, c_char_p, c_double, c_int, c_size_t, c_void_p
from pathlib import Path
from types import TracebackType
from typing import Self

import bpy
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.float32]  # (height, width, 3)

NAME = "Open Image Denoise"
LIBRARY = "libOpenImageDenoise.so.2"  # the interface of version 2; Blender 4.2 has 2.3, 5.2 has 2.5
MEMORY_MAP = Path("/proc/self/maps")

# Values of the library's enumerations.
CPU_DEVICE = 1
FLOAT3 = 3
NO_ERROR = 0
CANCELLED = 6
HIGH_QUALITY = 6
BALANCED_QUALITY = 5
FAST_QUALITY = 4  # from version 2.3 on

FIRST_WITH_FAST_QUALITY = 20300

# (user pointer, share done) -> whether to go on
ProgressMonitor = ctypes.CFUNCTYPE(c_bool, c_void_p, c_double)
# (user pointer, code, text)
ErrorFunction = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p)

SIGNATURES = {
    "oidnNewDevice": (c_void_p, [c_int]),
    "oidnSetDeviceBool": (None, [c_void_p, c_char_p, c_bool]),
    "oidnSetDeviceInt": (None, [c_void_p, c_char_p, c_int]),
    "oidnSetDeviceErrorFunction": (None, [c_void_p, ErrorFunction, c_void_p]),
    "oidnCommitDevice": (None, [c_void_p]),
    "oidnGetDeviceInt": (c_int, [c_void_p, c_char_p]),
    "oidnGetDeviceError": (c_int, [c_void_p, POINTER(c_char_p)]),
    "oidnReleaseDevice": (None, [c_void_p]),
    "oidnNewFilter": (c_void_p, [c_void_p, c_char_p]),
    "oidnSetSharedFilterImage": (
        None,
        [c_void_p, c_char_p, c_void_p, c_int, c_size_t, c_size_t, c_size_t, c_size_t, c_size_t],
    ),
    "oidnSetFilterBool": (None, [c_void_p, c_char_p, c_bool]),
    "oidnSetFilterInt": (None, [c_void_p, c_char_p, c_int]),
    "oidnSetFilterProgressMonitorFunction": (None, [c_void_p, ProgressMonitor, c_void_p]),
    "oidnCommitFilter": (None, [c_void_p]),
    "oidnExecuteFilter": (None, [c_void_p]),
    "oidnReleaseFilter": (None, [c_void_p]),
}


class DenoiserError(RuntimeError):
    """The library is not there, or gave up; the text is a sentence for the user."""


def mapped_folders() -> list[Path]:
    """Folders of the files with the library's name in this process; none where the system has no such map."""
    if not MEMORY_MAP.exists():
        return []
    files = re.findall(r"(/\S.*)/libOpenImageDenoise[^/\n]*$", MEMORY_MAP.read_text(errors="replace"), re.MULTILINE)
    return [Path(folder) for folder in dict.fromkeys(files)]


def installed_folders() -> list[Path]:
    """Where Blender keeps its libraries: beside the folder of its version, or beside its program."""
    program = bpy.app.binary_path  # "" where Blender is a Python module
    roots = [Path(bpy.utils.resource_path("LOCAL")).parent, *([Path(program).parent] if program else [])]
    return [root / "lib" for root in roots]


@functools.cache
def find_library() -> Path | None:
    """The library of this Blender, or None where it was built without."""
    for folder in mapped_folders() + installed_folders():
        if (folder / LIBRARY).is_file():
            return folder / LIBRARY
    return None


def is_there() -> bool:
    return find_library() is not None


def decoded(text: bytes | None) -> str:
    return (text or b"unknown error").decode(errors="replace")


@functools.cache
def bound_library(path: Path) -> ctypes.CDLL:
    """The library with the types of its functions. Raises DenoiserError."""
    try:
        library = ctypes.CDLL(str(path))
        for name, (result, arguments) in SIGNATURES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise DenoiserError(f"{NAME} cannot be loaded: {error}") from error
    return library


def load() -> ctypes.CDLL:
    """The library. Raises DenoiserError."""
    path = find_library()
    if path is None:
        raise DenoiserError(f"this Blender comes without {NAME}")
    return bound_library(path)


class Denoiser:
    """A device of the library on the processor, to be used in a `with` block; `threads` 0: one for each core.

    Errors are collected as they come: asked for afterwards, version 2.3.0 does not tell what happened in its own
    threads."""

    def __init__(self, threads: int = 0) -> None:
        """Raises DenoiserError."""
        self.library = load()
        self.errors = errors = list[tuple[int, str]]()
        self.error_function = ErrorFunction(lambda _user, code, text: errors.append((code, decoded(text))))
        self.device = self.library.oidnNewDevice(CPU_DEVICE)
        self.library.oidnSetDeviceErrorFunction(self.device, self.error_function, None)
        self.library.oidnSetDeviceBool(self.device, b"setAffinity", False)  # Blender's threads are not ours to pin
        self.library.oidnSetDeviceInt(self.device, b"numThreads", threads)
        self.library.oidnCommitDevice(self.device)
        try:
            self.check()
        except DenoiserError:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        if self.device is not None:
            self.library.oidnReleaseDevice(self.device)
            self.device = None

    def check(self) -> None:
        """Raises DenoiserError with the first error since the last check, unless that was an order to stop."""
        text = c_char_p()
        code = self.library.oidnGetDeviceError(self.device, ctypes.byref(text))  # and of the thread, without a device
        errors = [*self.errors, (code, decoded(text.value))]
        self.errors.clear()
        for code, sentence in errors:
            if code not in (NO_ERROR, CANCELLED):
                raise DenoiserError(f"{NAME} failed: {sentence}")

    def known_quality(self, quality: int) -> int:
        """The next that this version of the library has."""
        version = self.library.oidnGetDeviceInt(self.device, b"version")
        return max(quality, FAST_QUALITY if version >= FIRST_WITH_FAST_QUALITY else BALANCED_QUALITY)

    def filter(
        self,
        inputs: dict[str, Picture],
        is_hdr: bool = False,
        has_clean_guides: bool = False,
        quality: int = HIGH_QUALITY,
        is_wanted: Callable[[], bool] = lambda: True,
    ) -> Picture | None:
        """One run of the ray-tracing filter on `color`, `albedo` and `normal`, contiguous and of one size, of
        which the first is what is filtered; None if it was stopped. Raises DenoiserError."""
        output = np.empty_like(next(iter(inputs.values())))
        stops: list[bool] = []

        def go_on(_user: int | None, _done: float) -> bool:
            if not stops and not is_wanted():
                stops.append(True)
            return not stops

        monitor = ProgressMonitor(go_on)
        library = self.library
        handle = library.oidnNewFilter(self.device, b"RT")
        try:
            for name, picture in (inputs | {"output": output}).items():
                height, width = picture.shape[:2]
                address = picture.ctypes.data_as(c_void_p)
                library.oidnSetSharedFilterImage(handle, name.encode(), address, FLOAT3, width, height, 0, 0, 0)
            library.oidnSetFilterBool(handle, b"hdr", is_hdr)
            library.oidnSetFilterBool(handle, b"cleanAux", has_clean_guides)
            library.oidnSetFilterInt(handle, b"quality", self.known_quality(quality))
            library.oidnSetFilterProgressMonitorFunction(handle, monitor, None)
            library.oidnCommitFilter(handle)
            library.oidnExecuteFilter(handle)
        finally:
            library.oidnReleaseFilter(handle)
        self.check()
        return None if stops else output
