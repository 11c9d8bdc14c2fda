"""The denoiser alone: the library on pictures of known noise, on bad input, beside Cycles, and where it lies."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from addon import open_image_denoise
from addon.denoise import DenoiserError, Layers, denoise, denoise_layers, denoise_quickly

ROOT = Path(__file__).resolve().parents[2]

has_library = pytest.mark.skipif(not open_image_denoise.is_there(), reason="this Blender has no Open Image Denoise")


def error(picture, truth):
    return float(((picture - truth) ** 2 / (truth**2 + 0.01)).mean())


class Board:
    """A wall with a fine pattern and an edge, unevenly lit; noise in its light of the law of 8 exponential samples."""

    side = 128

    def __init__(self):
        y, x = np.mgrid[: self.side, : self.side].astype(np.float32)
        checks = ((x // 9 + y // 7) % 2)[..., None]
        self.albedo = (0.1 + 0.8 * checks * np.array([1.0, 0.6, 0.3])).astype(np.float32)
        is_left = (x < 60)[..., None]
        self.normal = np.where(is_left, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)).astype(np.float32)
        light = (0.2 + x / self.side)[..., None] * np.where(is_left, 1.0, 4.0)
        self.truth = (self.albedo * light).astype(np.float32)
        noise = np.random.default_rng(7).gamma(8.0, 1.0 / 8.0, (self.side, self.side, 1))
        self.noisy = (self.truth * noise).astype(np.float32)


@pytest.fixture(scope="module")
def board():
    return Board()


@has_library
def test_noise_falls_to_a_tenth_and_pattern_and_edge_stay(board):
    clean = denoise(board.noisy, board.albedo, board.normal)
    assert (clean.dtype, clean.shape) == (np.float32, board.noisy.shape)
    assert error(clean, board.truth) < 0.1 * error(board.noisy, board.truth)
    assert clean.mean() == pytest.approx(board.truth.mean(), rel=0.02)


@has_library
def test_each_guide_has_its_own_part(board):
    """Planted: albedo and normal swapped, or one of them missing."""
    right = error(denoise(board.noisy, board.albedo, board.normal), board.truth)
    nothing = np.zeros_like(board.noisy)
    assert error(denoise(board.noisy, board.normal, board.albedo), board.truth) > 2.0 * right
    assert error(denoise(board.noisy, nothing, board.normal), board.truth) > 2.0 * right


@has_library
def test_quickly_most_noise_goes_and_guides_may_have_some(board):
    """Planted: noisy guides passed off as clean."""
    noise = np.random.default_rng(8).normal(0.0, 0.1, board.albedo.shape).astype(np.float32)
    guides = (board.albedo + noise, board.normal + noise)
    quick, trusted = (denoise_quickly(Layers(board.noisy), *guides, clean, 0, lambda: True) for clean in (False, True))
    assert error(quick, board.truth) < 0.8 * error(board.noisy, board.truth)
    assert error(quick, board.truth) < 0.8 * error(trusted, board.truth)


@has_library
def test_quickly_clean_guides_keep_patterns(board):
    guides = (board.albedo, board.normal)
    noisy, clean = (denoise_quickly(Layers(board.noisy), *guides, clean, 0, lambda: True) for clean in (False, True))
    assert error(clean, board.truth) < 0.15 * error(board.noisy, board.truth)
    assert error(clean, board.truth) < 0.8 * error(noisy, board.truth)


@has_library
@pytest.mark.parametrize(("version", "qualities"), [(20203, [5, 5, 6]), (20300, [4, 5, 6])])
def test_libraries_that_have_no_fast_quality_get_the_next(monkeypatch, version, qualities):
    with open_image_denoise.Denoiser() as denoiser:
        library = SimpleNamespace(oidnGetDeviceInt=lambda *_: version, oidnReleaseDevice=lambda _: None)
        monkeypatch.setattr(denoiser, "library", library)
        assert [denoiser.known_quality(quality) for quality in (4, 5, 6)] == qualities
        monkeypatch.undo()


@has_library
def test_noise_in_the_guides_is_taken_out_first(board):
    """Planted: noisy guides passed off as clean."""
    noise = np.random.default_rng(8).normal(0.0, 0.1, board.albedo.shape).astype(np.float32)
    guides = (board.albedo + noise, board.normal + noise)
    filtered, trusted = (denoise(board.noisy, *guides, has_clean_guides=clean) for clean in (False, True))
    assert error(filtered, board.truth) < 0.8 * error(trusted, board.truth)


@has_library
def test_numbers_that_are_not_finite_stay_where_they_are(board):
    planes = [board.noisy.copy(), board.albedo.copy(), board.normal.copy()]
    for index, bad in enumerate((np.nan, np.inf, -np.inf)):
        for picture in planes:
            picture[20 + 9 * index, 30 + 9 * index] = bad
    clean = denoise(*planes)
    assert np.isfinite(clean).all()
    assert error(clean, board.truth) < 0.12 * error(board.noisy, board.truth)


@has_library
@pytest.mark.parametrize("factor", [1e-4, 1e6])
def test_pictures_have_no_upper_or_lower_limit_of_brightness(board, factor):
    clean = denoise(board.noisy * np.float32(factor), board.albedo, board.normal)
    assert error(clean / factor, board.truth) < 0.1 * error(board.noisy, board.truth)


@has_library
@pytest.mark.parametrize("shape", [(1, 1, 3), (1, 300, 3), (300, 2, 3), (33, 65, 3)])
def test_small_and_narrow_pictures_keep_their_brightness(shape):
    """The library alone makes 0.13 of a single pixel of 0.7."""
    grey = np.full(shape, 0.7, np.float32)
    np.testing.assert_allclose(denoise(grey, grey, np.zeros_like(grey)), grey, rtol=0.05)


@has_library
def test_any_float_array_is_taken_and_none_is_changed(board):
    color = np.asfortranarray(board.noisy.astype(np.float64))[::-1]
    before = color.copy()
    flipped = denoise(color, board.albedo[::-1], board.normal[::-1])
    assert np.array_equal(color, before)
    np.testing.assert_array_equal(
        flipped, denoise(np.ascontiguousarray(board.noisy[::-1]), board.albedo[::-1], board.normal[::-1])
    )


@has_library
def test_layers_are_denoised_each_by_itself_and_added(board):
    guides = (board.albedo, board.normal)
    parts = (board.noisy, 0.5 * board.noisy[::-1].copy())
    assert np.array_equal(denoise_layers(Layers(*parts), *guides), sum(denoise(part, *guides) for part in parts))
    kept = np.where(board.albedo > 0.5, board.noisy, 0.0).astype(np.float32)
    assert np.array_equal(denoise_layers(Layers(board.noisy, kept=kept), *guides), denoise(board.noisy, *guides) + kept)


@has_library
def test_layers_that_are_black_are_not_denoised(board, monkeypatch):
    runs = []
    monkeypatch.setattr(
        open_image_denoise.Denoiser, "filter", lambda self, inputs, **_: runs.append(inputs) or inputs["color"]
    )
    black = np.zeros_like(board.noisy)
    clean = denoise_layers(Layers(black, board.noisy), board.albedo, board.normal, has_clean_guides=True)
    assert len(runs) == 1 and np.array_equal(clean, board.noisy)


def test_pictures_of_different_sizes_are_refused(board):
    with pytest.raises(ValueError, match="shapes"):
        denoise(board.noisy, board.albedo[:64], board.normal)


@has_library
@pytest.mark.parametrize("calls", [0, 1, 6, 60])
def test_it_stops_when_it_is_no_longer_wanted(board, calls):
    answers = iter([True] * calls)
    assert denoise(board.noisy, board.albedo, board.normal, is_wanted=lambda: next(answers, False)) is None


@has_library
def test_what_the_library_refuses_is_an_error_in_its_words(board):
    with (
        open_image_denoise.Denoiser() as denoiser,
        pytest.raises(DenoiserError, match=r"Open Image Denoise failed: .*size"),
    ):
        denoiser.filter({"color": board.noisy, "albedo": board.albedo[:64].copy()}, is_hdr=True)


def test_a_library_that_cannot_be_loaded_is_an_error(tmp_path):
    (tmp_path / open_image_denoise.LIBRARY).write_text("not a library")
    with pytest.raises(DenoiserError, match="cannot be loaded"):
        open_image_denoise.bound_library(tmp_path / open_image_denoise.LIBRARY)


@has_library
def test_both_ways_to_the_library_find_the_same(monkeypatch):
    """By the files of this process, and by Blender's folders where the system has no list of those."""
    folders = open_image_denoise.mapped_folders()
    monkeypatch.setattr(open_image_denoise, "MEMORY_MAP", Path("/nowhere"))
    assert open_image_denoise.mapped_folders() == []
    assert set(folders) & set(open_image_denoise.installed_folders())


def test_folders_with_spaces_are_found_in_the_list_of_files(monkeypatch, tmp_path):
    listing = tmp_path / "maps"
    listing.write_text(
        "7f00-7f10 r-xp 00000000 08:01 12 /opt/my blender/lib/libOpenImageDenoise_core.so.2.3.3\n"
        "7f10-7f20 r-xp 00000000 08:01 13 /opt/other/lib/libtbb.so.12\n"
        "7f20-7f30 r--p 00000000 00:00 0 [heap]\n"
    )
    monkeypatch.setattr(open_image_denoise, "MEMORY_MAP", listing)
    assert open_image_denoise.mapped_folders() == [Path("/opt/my blender/lib")]


BESIDE_CYCLES = """
import sys
sys.path.insert(0, {root!r})
import bpy
import numpy as np
from addon.denoise import denoise

def cycles():
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.denoiser = 2, True, "OPENIMAGEDENOISE"
    bpy.ops.render.render()

noise = np.random.default_rng(1).gamma(8.0, 1.0 / 8.0, (96, 96, 3)).astype(np.float32)
grey = np.full_like(noise, 0.5)
results = [denoise(noise, grey, grey)]
for _ in range(2):
    cycles()
    results.append(denoise(noise, grey, grey))
assert all(np.array_equal(result, results[0]) for result in results)
assert abs(results[0] - 1.0).mean() < 0.1
print("SAME")
"""


@has_library
def test_cycles_denoises_before_and_after_in_the_same_process():
    script = BESIDE_CYCLES.format(root=str(ROOT))
    finished = subprocess.run([sys.executable, "-c", script], timeout=240, check=False, capture_output=True, text=True)
    assert finished.returncode == 0 and "SAME" in finished.stdout, finished.stderr
