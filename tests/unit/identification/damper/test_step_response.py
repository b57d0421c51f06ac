"""Step response of a channel: the weights of its last samples, and its response to a signal."""

import numpy as np
import pytest

from identification.damper.effects import step_response
from identification.simulate.curves import apply_lag

H = 1e-3


def one_lag(variables, fraction, lag):
    return 1.0 - fraction * np.exp(-variables["time"] / lag)


def delay(variables, late):
    return np.where(variables["time"] < late, 0.0, 1.0)


@pytest.fixture
def signal():
    return np.cumsum(np.random.default_rng(5).standard_normal(3000))


@pytest.mark.parametrize("lag", [2e-3, 0.02, 0.3])
def test_a_step_response_of_one_lag_is_a_first_order_lag(signal, lag):
    weights = step_response.compute_weights(one_lag, (1.0, lag), H)
    found, expected = step_response.apply_weights(weights, signal), apply_lag(signal, lag, H)
    assert np.abs(found - expected).max() < 0.01 * np.abs(signal - expected).max()


def test_a_delay_of_whole_samples_is_a_shift(signal):
    weights = step_response.compute_weights(delay, (7 * H,), H)
    # A change between two samples arrives between them as well.
    assert np.flatnonzero(np.abs(weights) > 1e-12).tolist() == [7]
    found = step_response.apply_weights(weights, signal)
    np.testing.assert_allclose(found[7:], signal[:-7], atol=1e-9)
    np.testing.assert_allclose(found[:7], signal[0], atol=1e-9)


def test_weights_add_up_to_the_final_value_and_end_where_it_is_reached():
    weights = step_response.compute_weights(one_lag, (0.4, 0.01), H)
    assert weights.sum() == pytest.approx(1.0, abs=1e-11)
    assert 0.01 / H < len(weights) < 40 * 0.01 / H
    assert step_response.compute_weights(one_lag, (0.0, 0.01), H).tolist() == [1.0]


def test_a_response_that_has_not_settled_ends_at_the_horizon():
    weights = step_response.compute_weights(one_lag, (1.0, 100.0), H)
    assert len(weights) == step_response.HORIZON / H
    assert weights.sum() == pytest.approx(1.0 - np.exp(-step_response.HORIZON / 100.0), rel=1e-3)


def test_the_first_value_lasted_before_the_signal():
    weights = step_response.compute_weights(one_lag, (1.0, 0.1), H)
    np.testing.assert_allclose(step_response.apply_weights(weights, np.full(50, 3.0)), 3.0, rtol=1e-12)


def test_columns_are_convolved_one_by_one(signal):
    weights = step_response.compute_weights(one_lag, (0.7, 0.03), H)
    columns = np.stack([signal, signal[::-1] ** 2], axis=1)
    found = step_response.apply_weights(weights, columns)
    for k in range(2):
        padded = np.concatenate([np.full(len(weights) - 1, columns[0, k]), columns[:, k]])
        expected = np.convolve(padded, weights, "valid")
        np.testing.assert_allclose(found[:, k], expected, atol=1e-9 * np.abs(expected).max())
