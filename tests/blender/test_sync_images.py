"""Images from files of every depth, packed, painted, generated and missing."""

import os
from pathlib import Path

import bpy
import numpy as np
import pytest
from fake_core import SceneBuilder

from addon.sync import SyncReport, colour, colour_config, images, versions
from addon.sync.colour import image_colour, known_space, luminance_weights, rgb_to_xyz
from addon.sync.image_source import packed_source
from addon.sync.images import ImageCache, blender_pixels, read_file
from tests.support.blender_scenes import tiled_image

# 2 x 3 pixels, the first row is the top of the picture.
ROWS = np.array([[[0, 10, 20, 255], [30, 40, 50, 128]], [[1, 2, 3, 4], [5, 6, 7, 8]], [[9, 9, 9, 0], [250, 0, 0, 64]]])


def write(path: Path, pixels: np.ndarray) -> Path:
    oiio = versions.image_reader()
    height, width, channels = pixels.shape
    names = {"float16": "half", "float32": "float"}
    kind = oiio.TypeDesc(names.get(str(pixels.dtype), str(pixels.dtype)))
    spec = oiio.ImageSpec(width, height, channels, kind)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("compression", "none")
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    output.write_image(np.ascontiguousarray(pixels))
    output.close()
    return path


@pytest.fixture
def cache():
    cache = ImageCache()
    yield cache
    cache.close()


def added(cache: ImageCache, image: bpy.types.Image, image_user=None) -> tuple[dict | None, SyncReport]:
    builder, report = SceneBuilder(), SyncReport()
    cache.begin()
    handle = cache.handle(image, image_user, builder, report)
    return (builder.of("add_image")[0] if handle >= 0 else None), report


@pytest.mark.parametrize(
    ("suffix", "dtype"),
    [
        (".png", np.uint8),
        (".png", np.uint16),
        (".tif", np.uint16),
        (".exr", np.float16),
        (".exr", np.float32),
        (".hdr", np.float32),
    ],
)
def test_files_keep_their_depth_and_start_at_the_bottom(empty_scene, tmp_path, suffix, dtype) -> None:
    channels = 3 if suffix == ".hdr" else 4
    pixels = np.ascontiguousarray(ROWS[:, :, :channels]).astype(dtype)
    decoded = read_file(str(write(tmp_path / f"image{suffix}", pixels))).pixels
    assert decoded.dtype == dtype and decoded.flags.c_contiguous
    assert decoded == pytest.approx(pixels[::-1], rel=0.02 if suffix == ".hdr" else 0, abs=1 if suffix == ".hdr" else 0)


def test_a_file_is_decoded_once_and_again_when_it_changes(empty_scene, cache, tmp_path) -> None:
    path = write(tmp_path / "a.png", ROWS.astype(np.uint8))
    image = bpy.data.images.load(str(path))
    first, _ = added(cache, image)
    assert first["transfer"] == "SRGB" and first["to_working_space"] is None
    assert first["alpha"] == "STRAIGHT"
    assert added(cache, image)[0]["pixels"] is first["pixels"]
    write(path, 255 - ROWS.astype(np.uint8))
    os.utime(path, (1, 1))
    assert (added(cache, image)[0]["pixels"] == 255 - first["pixels"]).all()


def test_a_file_that_changes_at_one_time_and_size_is_decoded_again(empty_scene, cache, tmp_path) -> None:
    """As a copy does that keeps the time."""
    path = write(tmp_path / "a.tif", ROWS.astype(np.uint8))
    image = bpy.data.images.load(str(path))
    first, _ = added(cache, image)
    before = path.stat()
    write(path, 255 - ROWS.astype(np.uint8))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_size == before.st_size
    assert (added(cache, image)[0]["pixels"] == 255 - first["pixels"]).all()


def test_after_an_edit_files_are_read_again_only_where_they_would_look_different(
    empty_scene, cache, tmp_path, monkeypatch
) -> None:
    paths = [write(tmp_path / f"{name}.png", ROWS.astype(np.uint8)) for name in "abc"]
    same, other_file, other_colours = (bpy.data.images.load(str(path)) for path in paths)
    builder, report = SceneBuilder(), SyncReport()
    cache.begin()
    handles = [cache.handle(image, None, builder, report) for image in (same, other_file, other_colours)]
    reads = []
    monkeypatch.setattr(images, "read_file", lambda path, packed: reads.append(path) or read_file(path, packed))
    for _ in range(2):
        write(paths[1], 255 - ROWS.astype(np.uint8))
        os.utime(paths[1], (len(reads), 1))
        other_colours.colorspace_settings.name = "Non-Color" if not reads else "sRGB"
        cache.begin_again(has_changes=True)
        for image in (same, other_file, other_colours):
            cache.prefetch(image, None)
        assert handles[0] == cache.handle(same, None, builder, report)
        cache.handle(other_colours, None, builder, report)
        cache.handle(other_file, None, builder, report)
    assert reads == 2 * [str(paths[1]), str(paths[2])]


def test_packed_pixels_that_change_at_one_size_are_decoded_again(empty_scene, cache) -> None:
    image = bpy.data.images.new("Painted", 4, 4, float_buffer=True)
    sizes = set()
    for color in ((1, 0, 0, 1), (0, 1, 0, 1)):
        image.pixels.foreach_set(np.tile(np.float32(color), 16))
        image.pack()
        sizes.add(image.packed_file.size)
        assert added(cache, image)[0]["pixels"].argmax(axis=2).tolist() == np.full((4, 4), color.index(1)).tolist()
    assert len(sizes) == 1


def test_packed_bytes_are_looked_at_once_in_a_sync(empty_scene, cache, tmp_path, monkeypatch) -> None:
    image = bpy.data.images.load(str(write(tmp_path / "a.png", ROWS.astype(np.uint8))))
    image.pack()
    looks = []
    monkeypatch.setattr(images, "packed_source", lambda *given: looks.append(given) or packed_source(*given))
    builder, report = SceneBuilder(), SyncReport()
    cache.begin()
    for _ in range(2):
        cache.prefetch(image, None)
        cache.handle(image, None, builder, report)
    cache.begin_again(has_changes=False)
    cache.handle(image, None, builder, report)
    assert len(looks) == 1
    cache.begin_again(has_changes=True)
    cache.handle(image, None, builder, report)
    assert len(looks) == 2


def test_one_handle_for_one_image(empty_scene, cache, tmp_path) -> None:
    image = bpy.data.images.load(str(write(tmp_path / "a.png", ROWS.astype(np.uint8))))
    builder, report = SceneBuilder(), SyncReport()
    assert cache.handle(image, None, builder, report) == cache.handle(image, None, builder, report) == 0
    assert len(builder.calls) == 1


def test_other_integers_are_shares_of_their_largest(tmp_path) -> None:
    """As in Cycles; elevation models have them."""
    values = np.array([0.0, 0.25, 0.5, 1.0], np.float64).reshape(2, 2, 1)
    file = read_file(str(write(tmp_path / "a.tif", (values * np.iinfo(np.int16).max).astype(np.int16))))
    assert file.pixels.dtype == np.float32
    np.testing.assert_allclose(file.pixels[::-1, :, :], values, atol=1e-4)


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_packed_files(empty_scene, cache, tmp_path, suffix) -> None:
    dtype = np.uint8 if suffix == ".png" else np.float16
    path = write(tmp_path / f"a{suffix}", ROWS.astype(dtype))
    image = bpy.data.images.load(str(path))
    image.pack()
    path.unlink()
    cache.prefetch(image, None)
    call, report = added(cache, image)
    assert (call["pixels"] == ROWS[::-1].astype(dtype)).all() and not report.warnings


def test_packed_files_of_one_path_are_told_apart(empty_scene, cache, tmp_path) -> None:
    packed = []
    for value in (10, 20):
        path = write(tmp_path / "same.tif", np.full((2, 2, 3), value, np.uint8))
        packed.append(bpy.data.images.load(str(path)))
        packed[-1].pack()
    assert packed[0].packed_file.size == packed[1].packed_file.size
    builder, report = SceneBuilder(), SyncReport()
    for image in packed:
        cache.handle(image, None, builder, report)
    assert [call["pixels"].max() for call in builder.of("add_image")] == [10, 20]


def test_alpha_modes_and_colour_spaces(empty_scene, cache, tmp_path) -> None:
    image = bpy.data.images.load(str(write(tmp_path / "a.exr", ROWS.astype(np.float32))))
    call, _ = added(cache, image)
    assert call["alpha"] == "PREMULTIPLIED" and call["transfer"] == "LINEAR"
    image.alpha_mode, image.colorspace_settings.name = "NONE", "sRGB"
    call, _ = added(cache, image)
    assert call["alpha"] == "IGNORED" and call["transfer"] == "SRGB"
    image.alpha_mode, image.colorspace_settings.name = "CHANNEL_PACKED", "Non-Color"
    call, _ = added(cache, image)
    assert call["alpha"] == "INDEPENDENT" and call["transfer"] == "LINEAR"
    image.alpha_mode = "STRAIGHT"
    assert added(cache, image)[0]["alpha"] == "INDEPENDENT", "data"


def test_a_missing_file_is_named(empty_scene, cache) -> None:
    image = bpy.data.images.new("Bark", 1, 1)
    image.source, image.filepath = "FILE", "//nowhere/bark.png"
    call, report = added(cache, image)
    assert call is None
    assert "'Bark'" in report.warnings[0] and "bark.png" in report.warnings[0]


def test_a_broken_file_is_named(empty_scene, cache, tmp_path) -> None:
    path = tmp_path / "broken.png"
    path.write_bytes(b"no picture")
    image = bpy.data.images.new("Broken", 1, 1)
    image.source, image.filepath = "FILE", str(path)
    call, report = added(cache, image)
    assert call is None and "'Broken'" in report.warnings[0]


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_pixels_that_are_not_finite_are_told(empty_scene, cache, tmp_path, dtype) -> None:
    pixels = ROWS.astype(dtype)
    pixels[0, 0, 1], pixels[2, 1, 0] = np.nan, np.inf
    first, report = added(cache, bpy.data.images.load(str(write(tmp_path / "a.exr", pixels))))
    expected = pixels[::-1].copy()
    expected[2, 0] = 0.0
    expected[0, 1] = (np.finfo(np.float16).max, 0, 0, 64) if dtype == np.float16 else 0.0
    assert first["pixels"].dtype == dtype and np.array_equal(first["pixels"], expected)
    assert len(report.warnings) == 1 and "'a.exr': 2 pixels are not finite" in report.warnings[0]


@pytest.mark.parametrize("is_float", [False, True])
def test_generated_images(empty_scene, cache, is_float) -> None:
    image = bpy.data.images.new("Made", 4, 2, alpha=True, float_buffer=is_float)
    image.generated_color = (0.5, 0.25, 1.0, 1.0)
    call, report = added(cache, image)
    assert call["pixels"].shape == (2, 4, 4) and not report.warnings
    assert call["pixels"].dtype == (np.float32 if is_float else np.uint8)
    assert call["transfer"] == ("LINEAR" if is_float else "SRGB")


def test_painted_images_come_from_blender(empty_scene, cache, tmp_path) -> None:
    image = bpy.data.images.load(str(write(tmp_path / "a.png", ROWS.astype(np.uint8))))
    image.pixels[0] = 1.0
    assert image.is_dirty
    call, _ = added(cache, image)
    assert call["pixels"][0, 0].tolist() == [255, 9, 9, 0]  # the bottom left
    assert (call["pixels"][1:] == ROWS[::-1][1:]).all()
    assert (blender_pixels(image) == call["pixels"]).all()


def test_sequences_follow_the_frame(empty_scene, cache, tmp_path) -> None:
    for frame in (1, 2, 3):
        write(tmp_path / f"s{frame:04}.png", np.full((2, 2, 3), frame, np.uint8))
    image = bpy.data.images.load(str(tmp_path / "s0001.png"))
    image.source = "SEQUENCE"
    tree = bpy.data.materials.new("M")
    tree.use_nodes = True
    node = tree.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, user = image, node.image_user
    user.frame_duration, user.frame_start, user.use_auto_refresh = 3, 1, True
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.materials.append(tree)
    for frame in (1, 3):
        empty_scene.frame_set(frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        evaluated = tree.evaluated_get(depsgraph).node_tree.nodes[node.name]
        call, _ = added(cache, evaluated.image, evaluated.image_user)
        assert (call["pixels"] == frame).all()


def write_tiles(folder: Path, name: str) -> bpy.types.Image:
    """Tiles 1001 and 1012, whose pixels are 1 and 12; the list has 1003 too."""
    for tile, uv in ((1001, "u1_v1"), (1012, "u2_v2")):
        pixels = np.full((2, 2, 3), tile - 1000, np.uint8)
        write(folder / name.replace("<UDIM>", str(tile)).replace("<UVTILE>", uv), pixels)
    return tiled_image(str(folder / name), (1001, 1003, 1012))


def added_tiles(cache: ImageCache, image: bpy.types.Image) -> tuple[dict[int, int], SyncReport]:
    """Pixels by tile."""
    builder, report = SceneBuilder(), SyncReport()
    cache.begin()
    cache.prefetch(image, None)
    handles = cache.tile_handles(image, builder, report)
    pixels = [call["pixels"] for call in builder.of("add_image")]
    assert len(pixels) == len(set(handles) - {-1}) and handles == cache.tile_handles(image, builder, report)
    return {1001 + k: int(pixels[handle].max()) for k, handle in enumerate(handles) if handle >= 0}, report


@pytest.mark.parametrize("name", ["t.<UDIM>.png", "t_<UVTILE>.png"])
def test_each_tile_is_read_and_missing_ones_are_named(empty_scene, cache, tmp_path, name) -> None:
    found, report = added_tiles(cache, write_tiles(tmp_path, name))
    assert found == {1001: 1, 1012: 12}
    assert len(report.warnings) == 1 and "'tiles'" in report.warnings[0] and report.warnings[0].endswith(": 1003")


def test_packed_tiles(empty_scene, cache, tmp_path) -> None:
    image = write_tiles(tmp_path, "t.<UDIM>.png")
    image.tiles.remove(image.tiles.get(1003))
    image.pack()
    for file in tmp_path.glob("*.png"):
        file.unlink()
    image.tiles.new(1005)
    found, report = added_tiles(cache, image)
    assert found == {1001: 1, 1012: 12} and report.warnings[0].endswith(": 1005")


def test_no_tile_can_be_read(empty_scene, cache, tmp_path) -> None:
    found, report = added_tiles(cache, tiled_image(str(tmp_path / "t.<UDIM>.png"), (1001, 1002)))
    assert found == {} and report.warnings[0].endswith(": 1001, 1002")


def test_a_tile_that_changes_is_decoded_again(empty_scene, cache, tmp_path) -> None:
    image = write_tiles(tmp_path, "t.<UDIM>.png")
    added_tiles(cache, image)
    write(tmp_path / "t.1012.png", np.full((2, 3, 3), 77, np.uint8))
    assert added_tiles(cache, image)[0] == {1001: 1, 1012: 77}


def test_a_tiled_environment_cannot_be_read(empty_scene, cache, tmp_path) -> None:
    """As in Cycles, which looks for a file whose name holds the token."""
    call, report = added(cache, write_tiles(tmp_path, "t.<UDIM>.png"))
    assert call is None and "<UDIM>" in report.warnings[0]


def test_colour_matrices() -> None:
    assert image_colour("sRGB", "Linear Rec.709").matrix is None
    assert image_colour("Non-Color", "ACEScg").matrix is None
    assert image_colour("Linear Rec.2020", "Linear Rec.2020").matrix is None
    to_2020 = np.reshape(image_colour("sRGB", "Linear Rec.2020").matrix, (3, 3))
    assert to_2020[0] == pytest.approx((0.6274, 0.3293, 0.0433), abs=2e-4)  # ITU-R BT.2087
    to_ap1 = np.reshape(image_colour("Linear Rec.709", "ACEScg").matrix, (3, 3))
    assert to_ap1[0] == pytest.approx((0.6131, 0.3395, 0.0474), abs=3e-4)  # ACES, Bradford-adapted
    for space in ("Linear Rec.2020", "ACEScg", "ACES2065-1", "Display P3", "Linear DCI-P3 D65", "Linear CIE-XYZ E"):
        matrix = np.reshape(image_colour(space, "Linear Rec.709").matrix, (3, 3))
        assert matrix @ np.ones(3) == pytest.approx(np.ones(3), abs=2e-4)  # white stays white
    assert np.isfinite(rgb_to_xyz(((0.64, 0.33), (0.3, 0.6), (0.15, 0.06)), (0.3127, 0.329))).all()


GREYS = np.repeat(np.array([[0, 60, 128], [155, 200, 255]], np.uint8)[..., None], 3, axis=2)


def log_image(folder: Path) -> bpy.types.Image:
    image = bpy.data.images.load(str(write(folder / "a.png", GREYS)))
    image.colorspace_settings.name = "Filmic Log"
    return image


@pytest.mark.skipif(versions.colour_reader() is None, reason="this Blender has no OpenColorIO for Python")
def test_other_colour_spaces_are_those_of_blenders_configuration(empty_scene, cache, tmp_path) -> None:
    """Filmic Log holds the logarithm of light, 16.5 doublings of it, of which 10 lie below middle grey (0.18)."""
    call, report = added(cache, log_image(tmp_path))
    assert report.warnings == [] and call["transfer"] == "LINEAR" and call["to_working_space"] is None
    assert call["pixels"] == pytest.approx(0.18 * 2.0 ** (16.5 * (GREYS[::-1] / 255.0) - 10.0), rel=0.01)


def test_a_colour_space_without_a_configuration_is_named(empty_scene, cache, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(colour, "decoder", lambda name, working_space: None)
    call, report = added(cache, log_image(tmp_path))
    assert call["transfer"] == "SRGB" and "Filmic Log" in report.warnings[0]


def test_greys_of_other_colour_spaces_stay_grey() -> None:
    decode = colour_config.decoder("Rec.1886", "Linear Rec.709")
    if decode is not None:
        assert decode(np.full((2, 1, 1), 0.5, np.float32)) == pytest.approx(np.full((2, 1, 1), 0.5**2.4), rel=1e-3)


def test_a_space_that_the_configuration_lacks() -> None:
    assert colour_config.decoder("No Such Space", "Linear Rec.709") is None


@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("Linear Rec.709", "Linear Rec.709"),
        ("ACEScg", "ACEScg"),
        ("ACES - ACEScg", "ACEScg"),
        ("Utility - Linear - Rec.2020", "Linear Rec.2020"),
        ("whatever", "Linear Rec.709"),
    ],
)
def test_working_spaces_of_other_configurations(name, known) -> None:
    """By what of their names is known, else taken for Rec. 709."""
    assert known_space(name) == known
    assert luminance_weights(name) == luminance_weights(known)
    assert sum(luminance_weights(name)) == pytest.approx(1.0)
    assert image_colour("Linear Rec.709", name).matrix == image_colour("Linear Rec.709", known).matrix
