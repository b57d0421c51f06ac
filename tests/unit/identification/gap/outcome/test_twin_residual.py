"""Learned residual of a diagnosis and of its twin."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.documents import HeldOutError
from identification.fitting import DamperModel, HoldOut
from identification.gap.data import Cycles
from identification.gap.data.cycles import StrokeCondition
from identification.gap.diagnosis import make_candidate_pool, prepare_recordings
from identification.gap.outcome.explanation import _summarise_held_out
from identification.gap.outcome.held_out_strokes import measure_held_out_strokes
from identification.gap.outcome.twin_residual import learn_twin_residual, number_conditions
from identification.predict import predict_log
from identification.residual import LearnedResidual
from tests.support.candidate_pools import NOISE, fit_baseline, record
from tests.support.gaps import GAP


@pytest.fixture(scope="module")
def pool():
    return fit_baseline("orifice_turbulence")


@pytest.fixture(scope="module")
def residual(pool):
    return learn_twin_residual(pool.evaluation, pool.baseline, 1)


def make_evaluation(conditions, usable=8):
    """Return a recording with one cycle of two samples in each segment."""
    count = 2 * len(conditions)
    cycle = np.arange(count) // 2
    cycles = Cycles(cycle, np.zeros(count), np.arange(len(conditions)), tuple(conditions))
    return SimpleNamespace(cycles=cycles, usable=np.arange(count) < usable)


def test_equal_strokes_are_one_condition_whatever_the_drive():
    strokes = [(0.0, 0.01, 1.0), (0.5, 0.01, 1.0), (0.0, 0.01, 2.0), (0.0, 0.005, 1.0)]
    numbers = number_conditions(make_evaluation([StrokeCondition(*s) for s in strokes]))
    assert numbers[0] == numbers[2]
    assert len(set(numbers.tolist())) == 3


def test_few_strokes_are_divided_by_the_drive():
    strokes = [(u, 0.01, f) for f in (1.0, 2.0) for u in (0.0, 0.2, 0.5)]
    numbers = number_conditions(make_evaluation([StrokeCondition(*s) for s in strokes]))
    assert len(set(numbers.tolist())) == 3
    assert numbers[0] == numbers[6]


def test_a_random_motion_is_divided_in_time():
    evaluation = make_evaluation([StrokeCondition(0.1 * k, 0.01, 0.0) for k in range(5)], usable=10)
    assert number_conditions(evaluation).tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]


def test_what_an_unknown_effect_leaves_is_learned(pool, residual):
    assert residual.before_n == pytest.approx(pool.baseline.train_rmse, rel=0.2)
    assert residual.after_n < 0.9 * residual.before_n
    assert residual.conditions == 3
    assert residual.rest_n > 0.8 * NOISE


def test_a_recording_without_an_effect_gives_no_residual():
    pool = fit_baseline()
    assert learn_twin_residual(pool.evaluation, pool.baseline, 1) is None


def test_strokes_that_the_user_holds_out_are_not_read():
    recording = record("orifice_turbulence")
    spoiled = record("orifice_turbulence")
    part = spoiled.stretches[0].segments[-1]
    spoiled.stretches[0].force[part.start : part.stop] += 500.0
    learned = []
    for given in (recording, spoiled):
        prepared = prepare_recordings([given], HoldOut((part.name,)))
        pool = make_candidate_pool(prepared)
        pool.fit_law()
        learned.append(learn_twin_residual(pool.evaluation, pool.baseline, 1))
    assert learned[0] == learned[1]


def test_the_error_on_held_out_strokes_is_smaller_with_the_residual():
    prepared = prepare_recordings([record("orifice_turbulence")], HoldOut(("6mm_3Hz_0.2V",)))
    pool = make_candidate_pool(prepared)
    pool.fit_law()
    residual = learn_twin_residual(pool.evaluation, pool.baseline, 1)
    physics, both = (
        measure_held_out_strokes(prepared.dataset, pool.problems.full, pool.baseline, model)
        for model in (None, LearnedResidual(residual))
    )
    assert both.rmse_n < physics.rmse_n


def test_a_prediction_keeps_physics_and_residual_apart(pool, residual):
    other = record("orifice_turbulence", seed=2)
    coordinates = pool.baseline.fit.coordinates
    physics, alone = predict_log(DamperModel(coordinates), other)
    prediction, series = predict_log(DamperModel(coordinates, residual=LearnedResidual(residual)), other)
    assert physics.physics is None
    assert prediction.physics.rmse_n == pytest.approx(physics.rmse_n)
    assert prediction.physics.nrmse == pytest.approx(physics.nrmse)
    assert prediction.rmse_n < 0.9 * physics.rmse_n
    assert series.physics == pytest.approx(alone.simulated)
    assert np.std(series.simulated - series.force) == pytest.approx(prediction.rmse_n, rel=0.05)
    assert prediction.band.coverage > 0.85
    lower, upper = series.band
    assert np.all(lower < series.simulated)
    assert np.mean((lower < other.stretches[0].force) & (other.stretches[0].force < upper)) > 0.85


@pytest.mark.parametrize(
    ("held_out", "text"),
    [
        (None, ""),
        ({"rmse_n": 3.0, "nrmse": 0.1}, "; on the strokes held out 3 N"),
        (
            {"rmse_n": 3.0, "nrmse": 0.1, "with_residual": {"rmse_n": 2.5, "nrmse": 0.08}},
            "; on the strokes held out 3 N, with the learned residual 2.5 N",
        ),
    ],
)
def test_the_summary_states_both_errors(held_out, text):
    error = None if held_out is None else HeldOutError.model_validate(held_out)
    assert _summarise_held_out(GAP.model_copy(update={"held_out": error})) == text
