"""Open Image Denoise, the library that Blender brings along, by its C interface."""

from __future__ import annotations

import ctypes
import importlib.util
from ctypes import c_bool, c_char_p, c_int, c_size_t, c_void_p
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

LIBRARY = "libOpenImageDenoise.so.2"
CPU_DEVICE = 1
FLOAT3 = 3
SIGNATURES = {
    "oidnNewDevice": (c_void_p, [c_int]),
    "oidnCommitDevice": (None, [c_void_p]),
    "oidnNewFilter": (c_void_p, [c_void_p, c_char_p]),
    "oidnSetSharedFilterImage": (
        None,
        [c_void_p, c_char_p, c_void_p, c_int, c_size_t, c_size_t, c_size_t, c_size_t, c_size_t],
    ),
    "oidnSetFilterBool": (None, [c_void_p, c_char_p, c_bool]),
    "oidnCommitFilter": (None, [c_void_p]),
    "oidnExecuteFilter": (None, [c_void_p]),
    "oidnReleaseFilter": (None, [c_void_p]),
    "oidnGetDeviceError": (c_int, [c_void_p, ctypes.POINTER(c_char_p)]),
}


@cache
def library() -> ctypes.CDLL:
    """The one in the folder of Python's bpy module. OSError where it is missing."""
    package = importlib.util.find_spec("bpy")
    if package is None or not package.submodule_search_locations:
        raise OSError("Python's bpy module, whose denoiser is used, is not installed")
    found = ctypes.CDLL(str(Path(package.submodule_search_locations[0]) / "lib" / LIBRARY))
    for name, (result, arguments) in SIGNATURES.items():
        function = getattr(found, name)
        function.restype, function.argtypes = result, arguments
    return found


@cache
def device() -> c_void_p:
    handle = library().oidnNewDevice(CPU_DEVICE)
    library().oidnCommitDevice(handle)
    return handle


def denoise(picture: NDArray, albedo: NDArray, normal: NDArray) -> NDArray[np.float32]:
    """(height, width, 3), linear, unbounded; the guides are taken to be free of noise. RuntimeError where it fails."""
    oidn, output = library(), np.zeros(picture.shape, np.float32)
    planes = {"color": picture, "albedo": np.clip(albedo, 0.0, 1.0), "normal": normal, "output": output}
    planes = {name: np.ascontiguousarray(plane, np.float32) for name, plane in planes.items()}
    handle = oidn.oidnNewFilter(device(), b"RT")
    height, width = picture.shape[:2]
    for name, plane in planes.items():
        oidn.oidnSetSharedFilterImage(handle, name.encode(), plane.ctypes.data, FLOAT3, width, height, 0, 0, 0)
    oidn.oidnSetFilterBool(handle, b"hdr", True)
    oidn.oidnSetFilterBool(handle, b"cleanAux", True)
    oidn.oidnCommitFilter(handle)
    oidn.oidnExecuteFilter(handle)
    oidn.oidnReleaseFilter(handle)
    message = c_char_p()
    if oidn.oidnGetDeviceError(device(), ctypes.byref(message)):
        raise RuntimeError(f"Open Image Denoise: {message.value.decode()}")
    return planes["output"]
