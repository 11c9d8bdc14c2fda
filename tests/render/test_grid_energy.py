"""The number for a visible grid: 1 for noise and for blotches, large for errors that follow the cells."""

import numpy as np
import pytest

from tests.support import grid_energy

EDGE = np.full(3, 0.5)
ORIGIN = np.array([-4.0, -4.0, -0.25])


def floor_points(size: int = 160) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(np.linspace(-3.99, 3.99, size), np.linspace(-3.99, 3.99, size))
    positions = np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3)
    return positions, np.broadcast_to([0.0, 0.0, 1.0], positions.shape)


def measure(errors: np.ndarray) -> grid_energy.GridEnergy:
    return grid_energy.grid_energy(errors, grid_energy.make_grids(*floor_points(), ORIGIN, EDGE))


def noise(channels: int = 3) -> np.ndarray:
    return np.random.default_rng(1).normal(size=(160 * 160, channels))


def test_noise_has_no_grid() -> None:
    """The ratio is that of means of 3 x 256 squares: a deviation of 0.05. The bounds are 4 deviations: 6e-5."""
    found = measure(noise())
    assert found.ratio == pytest.approx(1.0, abs=0.21)
    assert found.amplitude < 0.08


def test_blotches_that_do_not_follow_the_cells_are_no_grid() -> None:
    """Discs of 0.35 m at random: correlated over many pixels, with a ratio spread below 0.1."""
    random = np.random.default_rng(2)
    positions, _ = floor_points()
    errors = 0.3 * noise(1)
    for center in random.uniform(-4.0, 4.0, (300, 2)):
        errors[np.hypot(*(positions[:, :2] - center).T) < 0.35] += random.normal()
    found = measure(errors)
    assert found.aligned > 3.0
    assert found.ratio == pytest.approx(1.0, abs=0.3)


@pytest.mark.parametrize("amplitude", [0.5, 1.0])
def test_planted_grid_is_found_and_its_amplitude_told(amplitude: float) -> None:
    labels = grid_energy.cell_labels(*floor_points(), ORIGIN, EDGE)
    steps = np.random.default_rng(3).normal(size=labels.max() + 1)
    found = measure(noise(1) + amplitude * steps[labels][:, None])
    assert found.ratio > 1.5 and found.z > 8.0
    assert 0.5 * amplitude < found.amplitude < 1.1 * amplitude  # displaced cells catch a part of the steps too


def test_bins_tell_the_faces_of_a_cube_apart_and_keep_noise_about_an_axis() -> None:
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    assert len(set(grid_energy.normal_bins(axes))) == 6
    tilted = axes + np.random.default_rng(4).normal(scale=0.02, size=(50, 6, 3))
    for k in range(50):
        np.testing.assert_array_equal(grid_energy.normal_bins(tilted[k]), grid_energy.normal_bins(axes))


def test_cells_of_few_pixels_are_refused() -> None:
    positions, normals = floor_points()
    with pytest.raises(ValueError, match="pixels"):
        grid_energy.grid_energy(noise(), grid_energy.make_grids(positions, normals, ORIGIN, np.full(3, 1e-3)))
