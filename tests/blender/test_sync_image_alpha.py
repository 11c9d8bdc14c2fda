"""Whether colours are multiplied by alpha: by file format, Blender's alpha mode, and where the pixels come from."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from fake_core import SceneBuilder

from addon.sync import SyncReport, image_alpha, versions
from addon.sync.images import ImageCache

TEXEL = np.array([0.6, 0.5, 0.4, 0.25])


def written(path: Path, channels: int, dtype: type, is_straight: bool) -> bpy.types.Image:
    """A file of 2 x 2 texels, TEXEL each, or as many channels of it; two are its first and its alpha."""
    oiio = versions.image_reader()
    kinds = {np.uint8: oiio.UINT8, np.uint16: oiio.UINT16, np.float16: oiio.HALF, np.float32: oiio.FLOAT}
    one = np.iinfo(dtype).max if np.issubdtype(dtype, np.integer) else 1.0
    texel = TEXEL[[0, 3]] if channels == 2 else TEXEL[:channels]
    spec = oiio.ImageSpec(2, 2, channels, kinds[dtype])
    if is_straight:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    output.write_image(np.tile(texel * one, (2, 2, 1)).astype(dtype))
    output.close()
    return bpy.data.images.load(str(path))


def added(image: bpy.types.Image, alpha_mode: str | None = None) -> dict:
    if alpha_mode is not None:
        image.alpha_mode = alpha_mode
    cache, builder = ImageCache(), SceneBuilder()
    cache.begin()
    assert cache.handle(image, None, builder, SyncReport()) == 0
    cache.close()
    return builder.of("add_image")[0]


@pytest.fixture
def by_files(monkeypatch):
    """Before Blender 5.1."""
    monkeypatch.setattr(image_alpha, "alpha_mode_decides", lambda: False)


@pytest.fixture
def by_settings(monkeypatch):
    monkeypatch.setattr(image_alpha, "alpha_mode_decides", lambda: True)


@pytest.mark.parametrize("suffix", [".png", ".exr", ".webp"])
def test_the_setting_decides_from_blender_5_1_on(by_settings, empty_scene, tmp_path, suffix):
    image = written(tmp_path / f"a{suffix}", 4, np.float16 if suffix == ".exr" else np.uint8, is_straight=True)
    assert [added(image, mode)["alpha"] for mode in ("STRAIGHT", "PREMUL")] == ["STRAIGHT", "PREMULTIPLIED"]
    assert added(image, "CHANNEL_PACKED")["alpha"] == "INDEPENDENT"
    of_two = written(tmp_path / "b.png", 2, np.uint8, is_straight=True)
    assert added(of_two, "STRAIGHT")["alpha"] == "PREMULTIPLIED"


def test_cycles_then_takes_buffers_of_blender_for_what_the_setting_says(by_settings, empty_scene, tmp_path):
    image = bpy.data.images.new("Made", 2, 2, alpha=True, float_buffer=True)
    assert [added(image, mode)["alpha"] for mode in ("STRAIGHT", "PREMUL")] == ["STRAIGHT", "PREMULTIPLIED"]
    packed = written(tmp_path / "a.exr", 4, np.float32, is_straight=False)
    packed.pack()
    call = added(packed, "STRAIGHT")  # which Blender has multiplied once
    assert call["alpha"] == "STRAIGHT" and call["pixels"][0, 0].tolist() == pytest.approx([0.15, 0.125, 0.1, 0.25])


@pytest.mark.parametrize(
    ("suffix", "channels", "dtype", "is_straight", "alpha"),
    [
        (".png", 4, np.uint8, True, "STRAIGHT"),
        (".png", 4, np.uint16, True, "STRAIGHT"),
        (".png", 2, np.uint8, True, "PREMULTIPLIED"),
        (".tif", 4, np.uint16, True, "STRAIGHT"),
        (".tif", 4, np.uint16, False, "PREMULTIPLIED"),
        (".tif", 4, np.uint8, False, "PREMULTIPLIED"),
        (".tga", 4, np.uint8, True, "STRAIGHT"),
        (".bmp", 4, np.uint8, True, "PREMULTIPLIED"),
        (".webp", 4, np.uint8, True, "PREMULTIPLIED"),
        (".exr", 4, np.float16, False, "PREMULTIPLIED"),
    ],
)
def test_the_file_decides_and_not_the_setting(
    by_files, empty_scene, tmp_path, suffix, channels, dtype, is_straight, alpha
):
    image = written(tmp_path / f"a{suffix}", channels, dtype, is_straight)
    assert [added(image, mode)["alpha"] for mode in (None, "STRAIGHT", "PREMUL")] == [alpha] * 3
    assert added(image, "CHANNEL_PACKED")["alpha"] == "INDEPENDENT"
    assert added(image, "NONE")["alpha"] == "IGNORED"
    image.colorspace_settings.name = "Non-Color"
    assert added(image, "STRAIGHT")["alpha"] == "INDEPENDENT" and added(image, "NONE")["alpha"] == "IGNORED"


@pytest.mark.parametrize(("is_float", "alpha"), [(False, "STRAIGHT"), (True, "PREMULTIPLIED")])
def test_buffers_of_blender_go_by_their_depth(by_files, empty_scene, is_float, alpha):
    image = bpy.data.images.new("Made", 2, 2, alpha=True, float_buffer=is_float)
    assert [added(image, mode)["alpha"] for mode in ("STRAIGHT", "PREMUL")] == [alpha] * 2


def test_float_buffers_are_linear_whatever_the_colour_space(empty_scene):
    image = bpy.data.images.new("Made", 2, 2, float_buffer=True)
    image.colorspace_settings.name = "sRGB"
    call = added(image)
    assert call["transfer"] == "LINEAR" and call["to_working_space"] is None


def test_packed_bytes_marked_premultiplied_are_divided_by_blender(by_files, empty_scene, tmp_path):
    image = written(tmp_path / "a.png", 4, np.uint8, is_straight=True)
    image.pack()
    assert added(image, "STRAIGHT")["pixels"][0, 0].tolist() == [153, 127, 102, 63]
    call = added(image, "PREMUL")
    assert call["alpha"] == "STRAIGHT" and call["pixels"][0, 0].tolist() == [255, 255, 255, 63]


def test_packed_encoded_floats_are_decoded_before_they_are_multiplied(by_files, empty_scene, tmp_path):
    image = written(tmp_path / "a.png", 4, np.uint16, is_straight=True)
    image.pack()
    call = added(image, "STRAIGHT")
    assert (call["transfer"], call["alpha"]) == ("LINEAR", "PREMULTIPLIED")
    decoded = ((0.6 + 0.055) / 1.055) ** 2.4
    assert call["pixels"][0, 0, 0] == pytest.approx(decoded * 0.25, rel=1e-3)


@pytest.mark.parametrize("channels", [1, 3])
def test_packed_encoded_floats_are_filtered_as_light(empty_scene, tmp_path, channels):
    """Files on disk as they are encoded, as in Cycles."""
    image = written(tmp_path / "a.png", channels, np.uint16, is_straight=True)
    assert added(image)["transfer"] == "SRGB"
    image.pack()
    call = added(image)
    assert call["transfer"] == "LINEAR"
    assert call["pixels"][0, 0, 0] == pytest.approx(((0.6 + 0.055) / 1.055) ** 2.4, rel=1e-3)


@pytest.mark.parametrize("mode", ["NONE", "CHANNEL_PACKED"])
def test_so_are_those_whose_alpha_is_no_transparency(empty_scene, tmp_path, mode):
    image = written(tmp_path / "a.png", 4, np.uint16, is_straight=True)
    image.pack()
    call = added(image, mode)
    assert call["transfer"] == "LINEAR"
    assert call["pixels"][0, 0, 0] == pytest.approx(((0.6 + 0.055) / 1.055) ** 2.4, rel=1e-3)


def test_packed_linear_floats_stay_as_stored(by_files, empty_scene, tmp_path):
    image = written(tmp_path / "a.exr", 4, np.float16, is_straight=False)
    image.pack()
    assert added(image, "PREMUL")["alpha"] == "PREMULTIPLIED" and added(image, "STRAIGHT")["alpha"] == "STRAIGHT"
    assert added(image)["pixels"].dtype == np.float16


@pytest.mark.parametrize(("suffix", "red"), [(".png", 0.3185 * 0.25), (".bmp", 1.929)])
def test_an_encoded_space_that_is_not_srgb_is_decoded_without_alpha(by_files, empty_scene, tmp_path, suffix, red):
    """A file with straight alpha gives decoded(0.6) * 0.25, another decoded(0.6 / 0.25) * 0.25 (alpha: 63 of 255)."""
    image = written(tmp_path / f"a{suffix}", 4, np.uint8, is_straight=True)
    image.colorspace_settings.name = "Display P3"
    call = added(image)
    assert (call["transfer"], call["alpha"]) == ("LINEAR", "PREMULTIPLIED")
    assert call["to_working_space"] is not None and call["pixels"].dtype == np.float16
    assert call["pixels"][0, 0, 0] == pytest.approx(red, rel=0.02)
    assert added(image, "CHANNEL_PACKED")["pixels"][0, 0, 0] == pytest.approx(0.3185, rel=0.002)
    image.colorspace_settings.name = "sRGB"
    assert added(image)["pixels"].dtype == np.uint8
