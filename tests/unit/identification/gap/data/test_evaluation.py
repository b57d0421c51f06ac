"""Samples that are fitted and held out, and the residual on them."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.fitting import assemble
from identification.gap.data.cycles import Cycles
from identification.gap.data.evaluation import EvaluationData
from tests.support.candidate_pools import RATE, record


@pytest.fixture(scope="module")
def data():
    return EvaluationData.make(assemble([record()]))


def test_every_usable_sample_is_either_fitted_or_held_out(data):
    assert np.array_equal(data.usable, data.fitted_samples ^ data.held_out_samples)
    held_out = {bool(x) for x in data.held_out_cycles[data.cycles.cycle[data.held_out_samples]]}
    assert held_out == {True}


def test_the_start_is_recorded_but_not_used_before_the_damper_moved(data):
    x = data.pieces[0].excitation.displacement
    first = int(np.argmax(np.abs(x - x[0]) > 0.05 * np.ptp(x)))
    assert 0 < first < 0.1 * RATE
    assert not data.usable[:first].any()
    assert data.usable[round(0.1 * RATE) :].mean() > 0.9
    assert data.recorded[: round(0.1 * RATE)].all()


def test_a_residual_has_one_rmse_on_fitted_and_one_on_held_out_samples(data):
    offset = np.where(data.held_out_samples, 3.0, 1.0)
    residual = data.compute_residual([data.force - offset])
    assert data.compute_rmse(residual) == pytest.approx((1.0, 3.0))


def test_only_fitted_samples_are_marked_in_the_pieces_of_a_fit(data):
    (piece,) = data.select_fitted_pieces()
    assert np.array_equal(piece.train > 0, data.fitted_samples)


def test_a_cycle_with_one_usable_sample_has_an_error():
    cycles = Cycles(np.array([0, 0, 1, 1, 2]), np.zeros(5), np.zeros(3, int), ())
    usable = np.array([True, True, True, False, False])
    data = SimpleNamespace(
        cycles=cycles, usable=usable, force=np.zeros(5), held_out_cycles=np.array([False, True, False])
    )
    before, after = SimpleNamespace(values=np.full(5, 2.0)), SimpleNamespace(values=np.full(5, 1.0))
    errors = EvaluationData._compute_cycle_errors(data, before, after)
    np.testing.assert_array_equal(errors[2], [2, 1])
    np.testing.assert_array_equal(errors[0], [8.0, 4.0])
    np.testing.assert_array_equal(errors[1], [2.0, 1.0])
