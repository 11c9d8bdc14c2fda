"""Where the pixels of an image come from: a file, one of a sequence, a packed one, or a frame of a movie."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import bpy

from .changes import original_uid

FIRST_TILE = 1001
_TILES_IN_ROW = 10
_ANIMATED = {"SEQUENCE", "MOVIE"}


@dataclass(frozen=True)
class ImageSource:
    """Equal sources give equal pixels."""

    path: str
    stamp: tuple[int, ...] = ()
    """Of a file on disk: size, times of change in nanoseconds, number; of a packed one: size and hash of its bytes."""
    packed_in: int = 0
    """Session id of the image that carries the file; 0 for a file on disk. Packed files may share a path."""
    frame: int | None = None
    """Of a movie or sequence, 1 the first."""
    is_movie: bool = False
    """Movies are decoded by Blender; others are files that can be read."""


def is_packed(image: bpy.types.Image) -> bool:
    """Whether the image is read from bytes of the .blend. Of a tiled one they are read whatever was painted on it."""
    is_read = image.source == "TILED" or (image.source == "FILE" and not image.is_dirty)
    return image.packed_file is not None and is_read


def packed_file(image: bpy.types.Image, tile: int | None = None) -> bpy.types.PackedFile | None:
    """The bytes of an image that is packed, or of one of its tiles; None for a tile that is not there."""
    if tile is None:
        return image.packed_file
    return next((file.packed_file for file in image.packed_files if file.tile_number == tile), None)


def packed_source(image: bpy.types.Image, data: bytes, tile: int | None = None) -> ImageSource:
    """`data`: the packed bytes. Their hash is another one in each session."""
    return ImageSource(image_path(image, tile=tile), (len(data), hash(data)), packed_in=original_uid(image))


def file_source(
    image: bpy.types.Image,
    image_user: bpy.types.ImageUser | None,
    scene_frame: int | None = None,
    tile: int | None = None,
) -> ImageSource | None:
    """The file on disk behind an image, or None where only Blender has its pixels or there is no file.

    A frame of a movie or sequence is never None: Blender's pixels may be those of another frame. Files of sequences and
    tiles are read whatever was painted on them, as in Cycles."""
    is_painted = image.is_dirty and image.source not in {"SEQUENCE", "TILED"}
    if is_painted or image.source not in {"FILE", "SEQUENCE", "TILED", "MOVIE"}:
        return None
    path = image_path(image, image_user, scene_frame, tile)
    is_animated = image.source in _ANIMATED and image_user is not None
    try:
        status = Path(path).stat() if path else None  # nothing would be the working folder
    except OSError:
        status = None
    stamp = ()
    if status is not None:
        stamp = (status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino)
    if not (stamp or is_animated):
        return None
    frame = shown_frame(image_user, scene_frame) if is_animated else None
    return ImageSource(path, stamp, frame=frame, is_movie=image.source == "MOVIE")


def image_path(
    image: bpy.types.Image,
    image_user: bpy.types.ImageUser | None = None,
    scene_frame: int | None = None,
    tile: int | None = None,
) -> str:
    """Absolute path of an image, of the shown frame of a sequence, or of a tile (1001 the first)."""
    path = image.filepath
    if image.source == "SEQUENCE" and image_user is not None:
        path = image.filepath_from_user(image_user=image_user)
        frame = shown_frame(image_user, scene_frame)
        if frame != image_user.frame_current:
            path = _with_number(path, frame)
    if tile is not None:
        row, column = divmod(tile - FIRST_TILE, _TILES_IN_ROW)
        path = path.replace("<UDIM>", str(tile)).replace("<UVTILE>", f"u{column + 1}_v{row + 1}")
    return bpy.path.abspath(path, library=image.library)


def shown_frame(image_user: bpy.types.ImageUser, scene_frame: int | None) -> int:
    """The frame of a sequence or movie, 1 the first, at a frame of the scene; None: as last evaluated.

    Blender evaluates it where Auto Refresh is on; renders of Cycles follow the scene without it too. The rule is
    Blender's `BKE_image_user_frame_get`."""
    if scene_frame is None:
        return image_user.frame_current
    length = image_user.frame_duration
    if length == 0:
        return 0
    frame = scene_frame - image_user.frame_start + 1
    if image_user.use_cyclic:
        frame = frame % length or length
    return min(max(frame, 0), length) + image_user.frame_offset


def animated_source(
    image: bpy.types.Image, image_user: bpy.types.ImageUser, scene_frame: int
) -> tuple[int, ImageSource | None] | None:
    """What changes with the scene's frame though nothing is touched; None for an image that does not follow it."""
    if image.source not in _ANIMATED or not image_user.use_auto_refresh:
        return None
    return original_uid(image), file_source(image, image_user, scene_frame)


def _with_number(path: str, number: int) -> str:
    """The path with the last digits of its stem replaced, as many or more."""
    file = Path(path)
    digits = re.search(r"\d+(?=\D*$)", file.stem)
    if digits is None:
        return path
    start, end = digits.span()
    numbered = f"{max(number, 0):0{end - start}}"
    return str(file.with_name(file.stem[:start] + numbered + file.stem[end:] + file.suffix))
