"""Pixels that images may be made of."""

import pickle

import cistern_core as core
import numpy as np
import pytest

FORMATS = ("uint8", "uint16", "float16", "float32")


@pytest.mark.parametrize("name", FORMATS)
def test_equal_types_of_pixels_need_not_be_one_object(name: str) -> None:
    pixels = pickle.loads(pickle.dumps(np.zeros((2, 3, 4), name)))
    assert pixels.dtype == np.dtype(name) and pixels.dtype is not np.dtype(name)
    builder = core.SceneBuilder()
    assert builder.add_image("Photo", pixels) == 0
    assert builder.add_image("Photo", np.zeros((2, 3, 4), name)) == 1


@pytest.mark.parametrize("name", FORMATS[1:])
def test_pixels_of_another_byte_order_are_refused(name: str) -> None:
    foreign = np.zeros((2, 3, 4), np.dtype(name).newbyteorder("S"))
    with pytest.raises(core.Error, match=r"Photo.*byte order"):
        core.SceneBuilder().add_image("Photo", foreign)


@pytest.mark.parametrize("name", ["bool", "int8", "int16", "uint32", "int32", "float64", "complex64", "U1"])
def test_other_types_of_pixels_are_refused(name: str) -> None:
    with pytest.raises(core.Error, match=r"Photo.*uint8, uint16, float16 or float32"):
        core.SceneBuilder().add_image("Photo", np.zeros((2, 3, 4), name))
