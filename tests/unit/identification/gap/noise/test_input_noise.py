"""Noise of the displacement in the simulated force."""

from dataclasses import replace

import numpy as np
import pytest

from identification.fitting.initial_guess import make_starting_points
from identification.gap.noise.input_noise import propagate_input_noise, resample_motion
from tests.support.candidate_pools import NOISE, make_pool


@pytest.fixture(scope="module")
def problem_and_stretch():
    pool = make_pool()
    (stretch,) = pool.noise_model.stretches
    return pool.problems.full, stretch, pool.evaluation.fitted_samples


def propagate(problem, stretch, draws):
    start = make_starting_points(problem)[0]
    motions = resample_motion([stretch], problem.pieces, problem.simulate(start), NOISE, 1, draws)
    return propagate_input_noise(problem, start, motions)


def test_the_change_of_the_force_grows_with_the_noise_of_the_displacement(problem_and_stretch):
    problem, stretch, fitted = problem_and_stretch
    squares = propagate(problem, stretch, range(2))
    assert squares.shape == (2, len(stretch.time))
    size = np.sqrt(squares[:, fitted].mean())
    assert 0.0 < size < 0.5 * NOISE
    noise = 6e-6 * np.random.default_rng(3).standard_normal(len(stretch.time))
    noisier = replace(stretch, displacement=stretch.displacement + noise)
    assert np.sqrt(propagate(problem, noisier, range(2))[:, fitted].mean()) > 1.5 * size


def test_a_draw_is_reproduced_by_its_number(problem_and_stretch):
    problem, stretch, _ = problem_and_stretch
    first, second = propagate(problem, stretch, range(2))
    assert np.array_equal(propagate(problem, stretch, [1])[0], second)
    assert not np.array_equal(first, second)
