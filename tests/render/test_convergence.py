"""The mean squared error of independent samples falls like 1/N: a bias or correlated frames would bend the line."""

import numpy as np
import pytest

from tests.support.core_scenes import DEFAULTS, core
from tests.support.statistics import convergence_slope

from .test_determinism import room

SAMPLES = [16, 32, 64, 128, 256, 512, 1024]
LEAST_SEEDS = 48  # the slope then has a standard deviation of 0.012, as it is 0.023 with 12: false alarms, 1 in 30,000


def errors(sequence: str, bias: float = 0.0) -> dict[int, float]:
    """Variance over seeds around the mean of a far longer render, plus a planted bias."""
    scene = room()

    def picture(samples: int, seed: int) -> np.ndarray:
        members = DEFAULTS | dict(width=24, height=24, samples=samples, seed=seed, sequence=sequence, max_bounces=4)
        session = core.Session(core.Settings(**members))
        session.start(scene)
        assert session.wait(600.0).status is core.Status.DONE
        return session.read("Combined")[..., :3].astype(np.float64)

    reference = picture(16384, 999)
    result = {}
    for n in SAMPLES:
        seeds = range(max(LEAST_SEEDS, 1024 // n))
        result[n] = float(np.mean([np.mean((picture(n, seed) - reference * (1.0 + bias)) ** 2) for seed in seeds]))
    reference_noise = result[SAMPLES[-1]] * SAMPLES[-1] / 16384
    return {n: error - reference_noise for n, error in result.items()}


@pytest.mark.slow
def test_independent_samples_converge_with_slope_minus_one() -> None:
    assert convergence_slope(errors("RANDOM")) == pytest.approx(-1.0, abs=0.05)


@pytest.mark.slow
def test_sobol_converges_at_least_as_fast() -> None:
    assert convergence_slope(errors("SOBOL")) < -0.95


@pytest.mark.slow
def test_a_bias_of_five_percent_bends_the_line() -> None:
    """Planted bug."""
    assert convergence_slope(errors("RANDOM", bias=0.05)) > -0.95
