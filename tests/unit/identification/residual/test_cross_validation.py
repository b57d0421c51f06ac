"""Choice of a residual's settings by the error on conditions that were left out."""

import numpy as np
import pytest

from identification.residual.cross_validation import CrossValidation
from identification.residual.gaussian_process import Basis, Moments, Posterior
from identification.threads import use_one_thread

CONDITIONS = 5


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    """Matrices are small, and threads only wait for each other."""
    with use_one_thread():
        yield


def make_validation(compute, noise=0.1, seed=1, columns=3):
    random = np.random.default_rng(seed)
    states = random.uniform(-2.0, 2.0, (1000, columns))
    residual = compute(states) + noise * random.standard_normal(len(states))
    condition = np.repeat(np.arange(CONDITIONS), 200)
    return CrossValidation(states, residual, condition, states[::20])


def test_a_variable_that_matters_is_kept_and_one_that_does_not_is_smooth_or_left_out():
    validation = make_validation(lambda s: 3.0 * np.sin(2.0 * s[:, 0]))
    choice = validation.choose(np.array([0.5, 0.5, 0.5]))
    assert choice.rates[0] >= 0.5
    assert max(choice.rates[1:]) <= 0.5
    assert choice.error < 0.01


def test_a_variable_by_which_conditions_cannot_be_predicted_from_each_other_is_left_out():
    validation = make_validation(lambda s: 3.0 * np.sin(2.0 * s[:, 0]))
    validation.states[:, 1] = 8.0 * validation.condition
    assert validation.choose(np.array([0.5, 0.5, 0.5])).rates[1] == 0.0


def test_a_variable_that_no_recording_varies_is_kept_so_that_nothing_is_predicted_at_other_values():
    validation = make_validation(lambda s: 3.0 * np.sin(2.0 * s[:, 0]))
    validation.states[:, 1] = 1.0
    choice = validation.choose(np.array([0.5, 0.5, 0.0]))
    assert choice.rates[1] > 0.0
    basis, posterior = validation.fit(choice)
    known, strange = np.array([[1.0, 1.0, 0.0], [1.0, 1.0 + 8.0 / choice.rates[1], 0.0]])
    values = basis.evaluate(np.stack([known, strange]) * choice.rates) @ posterior.weights
    assert values[0] == pytest.approx(3.0 * np.sin(2.0), abs=0.3)
    assert values[1] == pytest.approx(0.0, abs=1e-6)


def test_a_variable_without_which_the_search_starts_can_enter():
    validation = make_validation(lambda s: 3.0 * np.sin(2.0 * s[:, 2]))
    assert validation.choose(np.array([0.5, 0.0, 0.0])).rates[2] > 0.0


def test_a_choice_from_fewer_samples_is_that_from_all():
    validation = make_validation(lambda s: 3.0 * np.sin(2.0 * s[:, 0]))
    thinned = validation.thin(500)
    assert len(thinned.residual) == 500
    assert np.array_equal(thinned.points, validation.points)
    rates = thinned.choose(np.array([0.5, 0.5, 0.0])).rates
    assert validation.evaluate(rates).error == pytest.approx(thinned.evaluate(rates).error, abs=0.002)
    assert len(validation.thin(2000).residual) == 1000


def test_noise_is_not_predicted():
    assert make_validation(lambda s: 0.0 * s[:, 0], 1.0).choose(np.array([0.5, 0.5, 0.5])).error > 0.98


def test_a_force_that_only_one_condition_has_does_not_count_as_predicted():
    validation = make_validation(lambda s: np.where(np.arange(1000) < 200, 4.0, 0.0) * np.sin(s[:, 0]), 0.0)
    assert validation.choose(np.array([0.5, 0.5, 0.5])).error > 0.9


def test_the_error_is_that_of_fits_without_each_condition():
    validation = make_validation(lambda s: s[:, 0] * s[:, 1])
    choice = validation.choose(np.array([0.5, 0.5, 0.0]))
    basis = Basis.make(validation.points * choice.rates)
    values = basis.evaluate(validation.states * choice.rates)
    squares = 0.0
    for number in range(CONDITIONS):
        out = validation.condition == number
        fitted = Posterior.make(Moments.make(values[~out], validation.residual[~out]), choice.ridge)
        squares += np.sum((validation.residual[out] - values[out] @ fitted.weights) ** 2)
    assert choice.error == pytest.approx(squares / np.sum(validation.residual**2), rel=1e-6)


def test_the_rest_is_the_noise_that_no_residual_predicts():
    validation = make_validation(lambda s: 3.0 * np.sin(2.0 * s[:, 0]), 0.5)
    choice = validation.choose(np.array([0.5, 0.0, 0.0]))
    _, rest = validation.estimate_variances(choice)
    assert rest == pytest.approx(0.25, rel=0.1)
