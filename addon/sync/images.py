"""Images to pixel arrays in their native depth.

Files are decoded by OpenImageIO on a thread pool that starts before the materials are compiled; what it cannot open,
movies, and images painted or generated inside Blender, come from Blender's own pixels.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Set
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from . import SyncReport, versions
from .changes import original_uid
from .colour import ImageColour, image_colour, srgb_to_linear
from .image_alpha import (
    FilePixels,
    alpha_of_buffer,
    alpha_of_file,
    alpha_of_packed,
    decoded,
    is_straight,
    packed_needs_blender,
)
from .image_source import FIRST_TILE, ImageSource, file_source, image_path, is_packed, packed_file, packed_source

if TYPE_CHECKING:
    from cistern_core import SceneBuilder

_MISSING = -1
_NATIVE_TYPES = (np.uint8, np.uint16, np.float16, np.float32)
_DECODE_THREADS = 4
_POLL_SECONDS = 0.1  # how often one who waits for a file looks whether it is still wanted


class ImageCache:
    """Decoded files, kept from sync to sync. `begin` starts a sync, `handle` adds an image to the builder once."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(_DECODE_THREADS, thread_name_prefix="cistern-image")
        self._decoded: dict[ImageSource, Future] = {}
        self._used: set[ImageSource] = set()
        self._handles: dict[tuple, int] = {}
        self._before: dict[tuple, int] = {}
        self._free_handles: list[int] = []
        self._looks: dict[tuple, tuple] = {}
        """What images were taken over by beside their files, by the keys of their handles."""
        self._warnings: dict[tuple, list[str]] = {}
        """What there is to tell of images, by the keys of their handles."""
        self._packed: dict[tuple[int, int | None, int], ImageSource] = {}
        """By image, tile and size: to look at all bytes takes 1.4 ms for each megabyte."""
        self._scene_frame: int | None = None

    def begin(self, scene_frame: int | None = None) -> None:
        """Forget the builder's handles, and the files that the sync before did not use. `scene_frame` moves movies and
        sequences; None: as they were evaluated."""
        self._decoded = {source: pixels for source, pixels in self._decoded.items() if source in self._used}
        self._used, self._packed = set(), {}
        self._handles, self._before, self._free_handles = {}, {}, []
        self._looks, self._warnings = {}, {}
        self._scene_frame = scene_frame

    def begin_again(self, has_changes: bool, scene_frame: int | None = None) -> None:
        """Go on with the same builder. With changes, images keep their handles but are taken over anew, save for files
        that are as they were."""
        self._decoded, self._used = {}, set()
        self._scene_frame = scene_frame
        if has_changes:
            self._before, self._handles = self._handles | self._before, {}
            self._packed = {}

    def free_unused(self, builder: SceneBuilder, used: Set[int]) -> None:
        """Drop the pixels of images that no program uses; their handles are given to others."""
        both = {**self._before, **self._handles}
        gone = {handle for handle in both.values() if handle != _MISSING} - used
        for handle in gone:
            builder.add_image("unused", np.zeros((1, 1, 1), np.uint8), replace=handle)
        self._free_handles += gone
        self._handles = {key: handle for key, handle in both.items() if handle in used}
        self._warnings = {key: texts for key, texts in self._warnings.items() if key in self._handles}
        self._before = {}

    def close(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)

    def prefetch(self, image: bpy.types.Image, image_user: bpy.types.ImageUser | None) -> None:
        """Start decoding an image that `handle` will be asked for."""
        for tile in tile_numbers(image) or [None]:
            source = self._source(image, image_user, tile)
            key = (original_uid(image), source)
            is_file = source is not None and not source.is_movie
            if is_file and not (key in self._handles or self._is_as_before(image, source, key)):
                self._decode(source, image, tile)

    def handle(
        self, image: bpy.types.Image, image_user: bpy.types.ImageUser | None, builder: SceneBuilder, report: SyncReport
    ) -> int:
        """The builder's handle, or -1 after a warning for an image that cannot be read."""
        source = self._source(image, image_user)
        key = (original_uid(image), source)
        if key not in self._handles:
            self._handles[key] = self._add(image, source, builder, report, key)
        if self._handles[key] == _MISSING:
            path = image_path(image) if source is None else source.path
            report.warn(f"Image '{image.name}': {path!r} cannot be read, shown magenta")
        self._warn_of(key, report)
        return self._handles[key]

    def tile_handles(self, image: bpy.types.Image, builder: SceneBuilder, report: SyncReport) -> list[int]:
        """Of a tiled image: the handles of its tiles from 1001 on, -1 where there is none. A warning names those that
        cannot be read."""
        numbers, missing = tile_numbers(image), []
        handles = [_MISSING] * (max(numbers, default=FIRST_TILE) - FIRST_TILE + 1)
        for number in numbers:
            source = self._source(image, None, number)
            key = (original_uid(image), source or number)
            if key not in self._handles:
                self._handles[key] = self._add(image, source, builder, report, key, number)
            missing += [number] if self._handles[key] == _MISSING else []
            self._warn_of(key, report)
            handles[number - FIRST_TILE] = self._handles[key]
        if missing:
            tiles = ", ".join(map(str, missing))
            report.warn(f"Image '{image.name}': tiles of {image.filepath!r} cannot be read, shown magenta: {tiles}")
        return handles

    def table_handle(self, key: tuple, name: str, make: Callable[[], NDArray], builder: SceneBuilder) -> int:
        """The builder's handle of colours (height, width, 3) in the working space, made where `key` is new."""
        if key in self._before:
            self._handles[key] = self._before.pop(key)
        if key not in self._handles:
            self._handles[key] = builder.add_image(name, make(), alpha="IGNORED", replace=self._handle_for(None))
        return self._handles[key]

    def _source(
        self, image: bpy.types.Image, image_user: bpy.types.ImageUser | None, tile: int | None = None
    ) -> ImageSource | None:
        if not is_packed(image):
            return file_source(image, image_user, self._scene_frame, tile)
        file = packed_file(image, tile)
        if file is None:
            return None
        key = (original_uid(image), tile, file.size)
        if key not in self._packed:
            data = file.data
            self._packed[key] = packed_source(image, data, tile)
            self._decode(self._packed[key], image, tile, data)
        return self._packed[key]

    def _decode(
        self, source: ImageSource, image: bpy.types.Image, tile: int | None = None, packed: bytes | None = None
    ) -> Future:
        self._used.add(source)
        if source not in self._decoded:
            if source.packed_in and packed is None:
                packed = packed_file(image, tile).data
            self._decoded[source] = self._pool.submit(read_file, source.path, packed)
        return self._decoded[source]

    def _add(
        self,
        image: bpy.types.Image,
        source: ImageSource | None,
        builder: SceneBuilder,
        report: SyncReport,
        key: tuple,
        tile: int | None = None,
    ) -> int:
        """The new handle, or -1 for what cannot be read."""
        if self._is_as_before(image, source, key):
            return self._before.pop(key)
        before = self._before.pop(key, None)
        self._warnings.pop(key, None)
        self._looks[key] = _look(image)
        colour = image_colour(image.colorspace_settings.name, versions.working_space())
        is_file = source is not None and not source.is_movie
        file = _awaited(self._decode(source, image, tile), report) if is_file else None
        content = _content(image, source, file, colour)
        if content is None:
            return _MISSING
        texts = []
        if not colour.is_known:
            texts.append(f"Image '{image.name}': colour space {image.colorspace_settings.name} is read as sRGB")
        if content.repaired > 0:
            texts.append(
                f"Image '{image.name}': {content.repaired} pixels are not finite: infinite halves count as the "
                "largest half, others as black"
            )
        if texts:
            self._warnings[key] = texts
        return builder.add_image(
            image.name,
            content.pixels,
            transfer=content.colour.transfer,
            to_working_space=content.colour.matrix,
            alpha=content.alpha,
            replace=self._handle_for(before),
        )

    def _is_as_before(self, image: bpy.types.Image, source: ImageSource | None, key: tuple) -> bool:
        """Whether the builder has the pixels of this file on disk, and would take them over in the same way."""
        is_file = source is not None and source.stamp and not (source.packed_in or source.is_movie)
        return is_file and self._before.get(key, _MISSING) != _MISSING and self._looks.get(key) == _look(image)

    def _warn_of(self, key: tuple, report: SyncReport) -> None:
        for text in self._warnings.get(key, ()):
            report.warn(text)

    def _handle_for(self, before: int | None) -> int | None:
        if before is None or before == _MISSING:
            return self._free_handles.pop() if self._free_handles else None
        return before


def _look(image: bpy.types.Image) -> tuple:
    """What makes other colours of the same pixels."""
    return image.colorspace_settings.name, image.alpha_mode, versions.working_space()


def _awaited(decoding: Future, report: SyncReport) -> FilePixels | None:
    """Raises SyncStoppedError where nobody wants it any more."""
    while not decoding.done():
        report.look_up()
        wait([decoding], _POLL_SECONDS)
    return decoding.result()


def tile_numbers(image: bpy.types.Image) -> list[int]:
    """Of a tiled image, 1001 the first; empty for others."""
    return [tile.number for tile in image.tiles] if image.source == "TILED" else []


@dataclass(frozen=True)
class _Content:
    pixels: NDArray
    colour: ImageColour
    alpha: str
    is_packed: bool = False
    repaired: int = 0
    """Pixels that were not finite."""

    @property
    def is_filtered_linear(self) -> bool:
        """Whether it is interpolated as light, not as it is encoded: so Blender has what is packed and no bytes."""
        is_deep = self.pixels.dtype != np.uint8
        return self.colour.is_filtered_linear or (self.is_packed and is_deep and self.colour.transfer != "LINEAR")


def _content(
    image: bpy.types.Image, source: ImageSource | None, file: FilePixels | None, colour: ImageColour
) -> _Content | None:
    content = _stored_content(image, source, file, colour)
    if content is None:
        return None
    pixels, repaired = finite(content.pixels)
    content = replace(content, pixels=pixels, repaired=repaired)
    if not content.is_filtered_linear:
        return content
    alpha = "PREMULTIPLIED" if content.alpha == "STRAIGHT" else content.alpha
    pixels = decoded(pixels, content.alpha, content.colour.decode or srgb_to_linear)
    return replace(content, pixels=pixels, colour=replace(content.colour, transfer="LINEAR"), alpha=alpha)


def _stored_content(
    image: bpy.types.Image, source: ImageSource | None, file: FilePixels | None, colour: ImageColour
) -> _Content | None:
    """The file's pixels, or those of Blender's buffer where there is no file or Cycles would see another picture."""
    mode, is_data = image.alpha_mode, colour.is_data
    is_packed = source is not None and source.packed_in != 0
    if file is not None and not is_packed:
        return _Content(file.pixels, colour, alpha_of_file(mode, is_data, file.is_straight, file.pixels.shape[2]))
    if file is not None and not packed_needs_blender(mode, is_data, file.pixels, colour.transfer == "LINEAR"):
        return _Content(file.pixels, colour, alpha_of_packed(mode, is_data), is_packed)
    if image.source == "TILED":  # Blender gives the pixels of the first tile alone
        return None if file is None else _Content(file.pixels, colour, alpha_of_packed(mode, is_data), is_packed)
    pixels = blender_pixels(image, None if source is None else source.frame)
    if pixels is None:
        return None
    if pixels.dtype == np.float32:  # decoded by Blender already
        colour = ImageColour("LINEAR", None, colour.is_known, is_data)
    return _Content(pixels, colour, alpha_of_buffer(mode, is_data, pixels))


def finite(pixels: NDArray) -> tuple[NDArray, int]:
    """Pixels (height, width, channels) without what is not finite, and how many had it.

    Infinite halves are what was too bright for them, as suns are. Otherwise all channels of the pixel become 0: without
    one of them it would have another colour."""
    if not np.issubdtype(pixels.dtype, np.floating) or np.isfinite(pixels).all():
        return pixels, 0
    repaired = int(np.count_nonzero(~np.isfinite(pixels).all(axis=2)))
    if pixels.dtype == np.float16:
        largest = np.finfo(np.float16).max
        pixels = np.clip(pixels, -largest, largest)  # NaN stays
    return np.where(np.isfinite(pixels).all(axis=2, keepdims=True), pixels, pixels.dtype.type(0.0)), repaired


def read_file(path: str, packed: bytes | None = None) -> FilePixels | None:
    """Pixels (height, width, channels), row 0 at the bottom, in the file's own depth; None if it cannot be decoded."""
    oiio = versions.image_reader()
    if oiio is None:
        return None
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)  # PNG and TIFF as stored; EXR stores premultiplied colours
    with _file(path, packed) as name:
        reader = oiio.ImageInput.open(name, config)
        if reader is None:
            oiio.geterror()  # else OpenImageIO prints it as the thread ends
            return None
        try:
            spec = reader.spec()
            pixels = reader.read_image(spec.format)
            has_straight_alpha = is_straight(reader.format_name(), spec.nchannels, spec.get_int_attribute)
        finally:
            reader.close()
    if pixels is None or pixels.ndim != 3:
        return None
    return FilePixels(_native(pixels), has_straight_alpha)


def _native(pixels: NDArray) -> NDArray:
    """Other integers as floats of which 1 is their largest, other floats as they are."""
    if pixels.dtype not in _NATIVE_TYPES:
        largest = np.iinfo(pixels.dtype).max if np.issubdtype(pixels.dtype, np.integer) else 1.0
        pixels = (pixels / largest).astype(np.float32)
    return np.ascontiguousarray(pixels[::-1, :, :4])


@contextmanager
def _file(path: str, packed: bytes | None) -> Iterator[str]:
    """A name under which the bytes of a packed file can be opened: OpenImageIO's binding reads only files."""
    if packed is None:
        yield path
    elif hasattr(os, "memfd_create"):
        descriptor = os.memfd_create("image")
        try:
            with open(descriptor, "wb", closefd=False) as memory:
                memory.write(packed)
            yield f"/proc/self/fd/{descriptor}"
        finally:
            os.close(descriptor)
    else:
        with tempfile.TemporaryDirectory() as folder:
            name = Path(folder) / f"image{Path(path).suffix}"
            name.write_bytes(packed)
            yield str(name)


def blender_pixels(image: bpy.types.Image, frame: int | None = None) -> NDArray | None:
    """Blender's own copy: uint8 for byte images (the stored code values), float32 (linear) otherwise.

    `frame`: of a movie or sequence, 1 the first; without it they are those of the frame that was decoded last."""
    with _decoded_frame(image, frame) if frame is not None and not image.is_dirty else nullcontext():
        width, height = image.size
        if width == 0 or height == 0:
            return None
        pixels = np.empty((height, width, image.channels), np.float32)
        image.pixels.foreach_get(pixels.ravel())
        if image.is_float:
            return pixels
    return np.rint(np.clip(pixels, 0.0, 1.0) * 255.0).astype(np.uint8)


@contextmanager
def _decoded_frame(image: bpy.types.Image, frame: int) -> Iterator[None]:
    """Lets `image.pixels` be those of a frame.

    Of all that Python may call without a GPU only `scale` decodes a frame that it is told. To the size that the image
    has it does no more, but marks it as painted, which is undone by dropping what is decoded."""
    try:
        with suppress(RuntimeError):  # where there is no such frame
            if not any(image.size):  # as long as nothing was decoded
                image.scale(1, 1, frame=max(frame, 0))
                image.buffers_free()
            image.scale(*image.size, frame=max(frame, 0))
        yield
    finally:
        image.buffers_free()
