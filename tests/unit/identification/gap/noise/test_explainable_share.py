"""The explainable share separates structure from noise."""

from functools import partial

import numpy as np
import pytest
from numpy.random import default_rng

from identification.fitting import Piece, assemble
from identification.gap.noise.explainable_share import (
    _build_piece_features,
    _subsample,
    build_features,
    explain_residual,
)
from identification.gap.noise.simulated_noise import simulate_noise
from identification.simulate import Excitation
from tests.support.candidate_pools import record
from tests.support.noise import make_pink_noise, make_residual


def test_structure_is_explainable_and_noise_is_not():
    random = default_rng(0)
    features = random.standard_normal((8000, 4))
    noise = random.standard_normal(8000)
    train = np.arange(8000) % 4 != 2
    structure = 3.0 * np.sin(features[:, 0]) * features[:, 1]
    assert explain_residual(features, structure + noise, train, ~train, 1.0).share > 0.8
    assert explain_residual(features, 2.0 * noise, train, ~train, 1.0).share < 0.1


def test_at_the_floor_nothing_is_explainable():
    features, noise = default_rng(0).standard_normal((400, 2)), default_rng(1).standard_normal(400)
    train = np.arange(400) % 2 == 0
    assert explain_residual(features, 0.5 * noise, train, ~train, 1.0).share == 0.0


def test_slow_noise_between_neighbouring_samples_is_not_explainable():
    # A sweep passes each state once, so slow noise looks like a function of the state.
    time = np.linspace(0.0, 1.0, 8000)
    features = np.column_stack([time, np.sin(40.0 * time**2)])
    slow = make_pink_noise(8000, default_rng(3))
    train = np.arange(8000) // 100 % 4 != 2
    structure = 2.0 * np.sin(3.0 * features[:, 1])
    explain = partial(explain_residual, features, train=train, held_out=~train, floor=0.1)
    by_chance = explain(slow, noise=simulate_noise(make_residual(slow), 8, 0.25))
    assert by_chance.share > 0.2
    assert by_chance.certain_share < 0.05
    both = slow + 3.0 * structure
    found = explain(both, noise=simulate_noise(make_residual(both), 8, 0.25))
    assert found.share > found.certain_share > 0.5


def test_features_of_a_recording_are_standardised():
    dataset = assemble([record()])
    features = build_features(dataset.pieces)
    assert len(features) == len(dataset.pieces[0].force)
    assert np.allclose(features.mean(axis=0), 0.0, atol=1e-9)
    assert np.allclose(features.std(axis=0), 1.0)


def make_piece(x, v, drive, rate=100.0):
    x, v, drive = (np.array(values, float) for values in (x, v, drive))
    return Piece("p", Excitation(rate, x, v, 0.5 * v, drive), 0.0 * x, np.ones(len(x)))


def test_features_have_the_direction_and_the_distance_from_the_last_reversal():
    v = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
    x = np.array([0.0, 1e-5, 5e-5, 4e-5, 2e-5, 0.0, 1e-5, 3e-5])
    columns = _build_piece_features(make_piece(x, v, np.ones(8))).T
    assert columns[:4].tolist() == [x.tolist(), v.tolist(), (0.5 * v).tolist(), [1.0] * 8]
    # The standard deviation of the velocity is 1; its sign is smoothed over a tenth of it.
    assert columns[4] == pytest.approx(np.tanh(v / 0.1))
    hundredths = np.array([0.0, 1.0, 0.0, 1.0, 3.0, 0.0, 1.0, 3.0])  # of a millimetre
    distances = 1e-5 * hundredths / (1e-3 * 2.5e-5)  # over a thousandth of half the stroke
    assert columns[5] == pytest.approx(np.log(1.0 + distances) * np.sign(v))
    assert columns[8:] == pytest.approx(np.ones((2, 8)))  # the past of a constant drive
    assert len(columns) == 10


def test_the_smoothed_direction_is_relative_to_the_scatter_of_the_velocity():
    v = 1e-3 * np.array([1.0, -1.0, 0.1, -0.1])
    columns = _build_piece_features(make_piece(0.0 * v, v, 0.0 * v)).T
    assert columns[4] == pytest.approx(np.tanh(v / (0.1 * np.std(v))))


@pytest.mark.parametrize(("tau", "column"), [(0.01, 6), (0.1, 7)])
def test_the_past_velocity_forgets_with_its_time_constant(tau, column):
    v = np.array([2.0, 5.0, 5.0, 5.0])
    columns = _build_piece_features(make_piece(0.0 * v, v, 0.0 * v)).T
    decay = np.exp(-0.01 / tau)
    assert columns[column] == pytest.approx(5.0 - 3.0 * decay ** np.arange(4.0))


def test_time_runs_over_all_pieces():
    v = np.array([1.0, -1.0, 1.0, -1.0])
    features = build_features([make_piece(v, v, v), make_piece(v, v, v)])
    time = features[:, -1]
    assert np.diff(time) == pytest.approx(np.full(7, 1.0 / 7.0 / np.std(np.arange(8.0) / 7.0)))


@pytest.mark.parametrize(
    ("count", "kept"), [(24_000, 24_000), (47_999, 47_999), (48_000, 24_000), (72_000, 24_000)]
)
def test_a_regression_uses_about_24000_evenly_spaced_samples(count, kept):
    mask = np.ones(count + 5, bool)
    mask[:5] = False
    rows = _subsample(mask)
    assert len(rows) == kept
    assert rows[0] == 5
    assert set(np.diff(rows)) == {count // kept}


def test_the_share_of_a_linear_structure_is_that_of_the_excess_variance():
    # Structure 3 x and unpredictable noise of variance 1, of which 0.25 counts as the floor.
    random = default_rng(5)
    features, noise = random.standard_normal((6000, 1)), random.standard_normal(6000)
    train = np.arange(6000) % 2 == 0
    residual = 3.0 * features[:, 0] + noise
    share = explain_residual(features, residual, train, ~train, 0.5).share
    structure = np.mean((3.0 * features[~train, 0]) ** 2)
    assert share == pytest.approx(structure / (np.mean(residual[~train] ** 2) - 0.25), abs=0.03)


def test_the_share_of_a_small_residual_is_the_same():
    random = default_rng(5)
    features = random.standard_normal((1200, 1))
    residual = 3e-3 * features[:, 0] + 1e-3 * random.standard_normal(1200)
    train = np.arange(1200) % 2 == 0
    small, large = (explain_residual(features, s * residual, train, ~train, s * 5e-4).share for s in (1.0, 1e3))
    assert small == pytest.approx(large, rel=1e-6)
    assert small > 0.5
