"""The scoreboard: errors but for the noise of the reference, error x time, the time to an error after denoising."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.benchmark import convergence, motion, thesis_experiment
from tests.benchmark.scoreboard import __main__ as scoreboard
from tests.benchmark.scoreboard import report
from tests.benchmark.scoreboard.board import SceneScore, Shot
from tests.benchmark.scoreboard.catalogue import ENGINES, SCENES, engine_named
from tests.benchmark.scoreboard.errors import Errors, Reference
from tests.benchmark.scoreboard.render import Picture

TRUTH = np.linspace(0.5, 2.0, 256)[None, :, None] * np.ones((256, 1, 3))
DEVIATION = 0.05  # of a reference's half and of the picture


def noisy(seed):
    return TRUTH + np.random.default_rng(seed).normal(0.0, DEVIATION, TRUTH.shape)


def reference(seed=1):
    return Reference(noisy(seed), noisy(seed + 1), TRUTH, {}, 2)


def expected(side):
    """relMSE of a picture with that noise against the truth, in boxes of side x side pixels."""
    return float((DEVIATION**2 / (TRUTH**2 + 0.01)).mean()) / side**2


def test_the_noise_of_the_reference_does_not_count():
    """Standard deviations of the three, of 60 seeds: 0.7, 2.6 and 5.3 %; at least four of them are allowed: false
    alarms of 6e-5 each. Planted bug: by the mean of both halves alone, errors are 1.5 times as large."""
    found = reference().errors(noisy(7))
    for value, side, tolerance in ((found.untrimmed, 1, 0.045), (found.box4, 4, 0.12), (found.box8, 8, 0.23)):
        assert value == pytest.approx(expected(side), rel=tolerance)
    raw = reference().squares(noisy(7)).mean()
    assert raw != pytest.approx(expected(1), rel=0.045)


def test_a_reference_far_noisier_than_the_picture_still_tells_its_error():
    """Halves of which every second pixel is black and the others twice the truth, and a picture that is half as bright
    again. A standard deviation of 1.7 %, of 60 seeds; five allow false alarms of 6e-7. Planted bug: relative to what
    the reference shows, less its noise, the error is some 400 times as large."""
    halves = [2.0 * TRUTH * (np.random.default_rng(k).random((256, 256, 1)) < 0.5) for k in (1, 2)]
    coarse = Reference(halves[0], halves[1], TRUTH, {}, 2)
    picture = 1.5 * TRUTH
    wanted = float(((0.5 * TRUTH) ** 2 / (TRUTH**2 + 0.01)).mean())
    assert coarse.errors(picture).untrimmed == pytest.approx(wanted, rel=0.085)
    planted = replace(coarse, base=coarse.mean)
    assert planted.squares(picture).mean() - planted.noise.untrimmed > 100.0 * wanted


def test_an_error_too_small_to_be_told_counts_as_the_smallest_that_can():
    found, least = reference().errors(TRUTH), reference().resolution
    for scale in ("pixel", "box4", "box8", "untrimmed"):
        assert least.at(scale) <= found.at(scale) < 6.0 * least.at(scale)
    assert least.untrimmed < 0.05 * expected(1)


def test_what_two_noisy_pictures_have_in_common_is_no_noise():
    """Of two of the truth less than can be told from nothing, which is at least a standard error: five of them allow
    false alarms of 6e-7. Planted bug: of one with itself it is noise, and of two that are 10 % too bright 0.01."""
    halves = noisy(7), noisy(8)
    least = reference().least_common(halves)
    for scale in ("untrimmed", "box4", "box8"):
        assert abs(reference().common(halves).at(scale)) < 5.0 * least.at(scale)
        assert reference().common((halves[0], halves[0])).at(scale) > 5.0 * least.at(scale)
    brighter = reference().common((1.1 * halves[0], 1.1 * halves[1]))
    wanted = float(((0.1 * TRUTH) ** 2 / (TRUTH**2 + 0.01)).mean())
    assert brighter.untrimmed == pytest.approx(wanted, abs=5.0 * least.untrimmed)


def test_outliers_count_in_the_untrimmed_error_alone():
    picture = noisy(7)
    picture[3, 3] = 1e4
    found, before = reference().errors(picture), reference().errors(noisy(7))
    assert found.pixel == pytest.approx(before.pixel, rel=0.02)
    assert found.untrimmed > 100.0 * before.untrimmed


def test_a_pixel_that_is_not_finite_is_refused():
    picture = noisy(7)
    picture[0, 0, 0] = np.nan
    with pytest.raises(ValueError, match="1 pixels are not finite"):
        reference().errors(picture)


def shot(engine, samples, seconds, error):
    pixels = np.zeros((1, 1, 3), np.float32)
    picture = Picture(pixels, seconds + 0.5, 0.5, seconds, 0.0)
    errors = Errors(error, error / 4, error / 8, error, 1.0)
    return Shot(engine, samples, 1, picture, picture.combined, errors, errors)


def score(curve, engine=ENGINES[0]):
    """A scene in which the targets have errors about 0.1 and an engine passes through (seconds, error) points."""
    shots = [shot(engine, 4 ** (k + 1), *point) for k, point in enumerate(curve)]
    targets = [shot(ENGINES[0], 64, 10.0, error) for error in (0.05, 0.2)]
    return SceneScore(SCENES[0], reference(), targets, None, {engine.name: shots})


@pytest.mark.parametrize(
    ("curve", "seconds"),
    [
        ([(1.0, 0.4), (4.0, 0.2), (16.0, 0.05)], 8.0),  # between the two last, half way by their logarithms
        ([(1.0, 0.05), (4.0, 0.02)], 1.0),
        ([(1.0, 0.8), (4.0, 0.2)], 8.0),  # goes on as error ~ 1 / time
        ([(1.0, 0.2), (4.0, 0.2)], 4.0 * 2.0 ** (1.0 / 0.3)),  # flat: goes on with the slowest fall
    ],
)
def test_time_to_the_target(curve, seconds):
    other = engine_named("path")
    assert score(curve, other).time_to_target(other.name) == pytest.approx(seconds)


def test_the_time_of_cycles_to_its_own_error_is_that_of_the_targets():
    assert score([(1.0, 0.4), (2.0, 0.3)]).time_to_target(ENGINES[0].name) == pytest.approx(10.0)


def test_the_product_is_that_of_the_longest_render():
    found = score([(1.0, 0.4), (4.0, 0.2)])
    assert found.product(ENGINES[0].name, "pixel") == pytest.approx(0.8)
    assert found.best_cycles("pixel") == ENGINES[0].name


def test_renders_for_half_the_time_are_no_longest_ones():
    """The time per sample is not known exactly, so that half the time may have more than half the samples."""
    engine = ENGINES[0]
    shots = [shot(engine, samples, seconds, 0.1) for samples, seconds in ((33, 5.0), (34, 5.2), (65, 10.0), (66, 10.2))]
    found = SceneScore(SCENES[0], reference(), [], None, {engine.name: shots})
    assert found.product(engine.name, "pixel") == pytest.approx((1.0 * 1.02) ** 0.5)
    assert len(found.denoised_curve(engine.name)) == 2


def test_bars_compare_with_the_best_setting_of_cycles():
    """Of a hard scene, whose bars are 0.1, 0.33 and 0.2: errors x time of 4 and 2 against 0.3, with the errors of boxes
    of 8 an eighth as large for all. Planted bug: against the first setting, the first bar would be met."""
    errors = {"cycles": 4.0, "cycles-front": 2.0, "path": 0.2, "final": 0.3}
    shots = {name: [shot(engine_named(name), 16, 1.0, error)] for name, error in errors.items()}
    found = SceneScore(SCENES[0], reference(), [shot(ENGINES[0], 64, 10.0, 0.1)], None, shots)
    row = report.bars_table([found])[-1]
    assert row.startswith("| city_grid | hard | 0.15 (≤ 0.1) **missed** | 0.15 (≤ 0.33) met |")
    assert report.path_tracer_table([found])[-1] == "| city_grid |" + 3 * " 1.50 (≤ 1.1) **missed** |"
    assert "path tracer, ours 1.50 ×" in report.winners_table([found])[-1]
    assert report.history_of(found, shots["path"][0])["errors"]["pixel"] == 0.2


def test_all_scenes_are_drawn_at_a_glance(tmp_path):
    pytest.importorskip("matplotlib")
    from tests.benchmark.scoreboard import plots

    shots = {name: [shot(engine_named(name), 16, 1.0, 0.1)] for name in ("cycles", "path", "restir-gi", "final")}
    found = SceneScore(SCENES[0], reference(), [shot(ENGINES[0], 64, 10.0, 0.1)], None, shots)
    plots.draw_overview(tmp_path / "overview.png", [found, found])
    assert (tmp_path / "overview.png").stat().st_size > 0


@pytest.mark.parametrize(
    ("command", "arguments"),
    [
        (scoreboard, []),
        (thesis_experiment, []),
        (motion, ["--plot", "x.png"]),
        (convergence, ["--plot", "x.png"]),
    ],
)
def test_missing_matplotlib_ends_a_command_before_it_renders(command, arguments, monkeypatch, tmp_path):
    """With one line on standard error and status 1, as SystemExit of a text does."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)  # as if not installed
    monkeypatch.setattr(sys, "argv", [command.__name__, *arguments])
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match="pip install matplotlib") as ended:
        command.main()
    assert "\n" not in str(ended.value)
    assert not any(tmp_path.iterdir())
