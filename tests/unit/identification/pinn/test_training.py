"""Trainings to the noise floor, their evaluation, and stopped trainings."""

from dataclasses import replace

import numpy as np
import pytest

from identification.fitting.budget import Budget
from identification.fitting.output_error import fit_output_error
from identification.fitting.unknown_layout import COORDINATE_COUNT
from identification.pinn.common.settings import read_settings
from identification.pinn.common.training_monitor import TrainingMonitor, TrainingStopped
from identification.pinn.common.validation_split import make_validation_masks
from identification.pinn.training import train
from tests.support.pinn_problem import TRUTH, make_problem


@pytest.fixture(scope="module")
def trained():
    return train(make_problem(), read_settings("elements"))


def test_the_network_of_elements_reaches_the_noise_and_so_does_the_law_with_its_parameters(trained):
    noise = make_problem().noise
    assert trained.accepted
    assert trained.simulation.train == pytest.approx(noise, rel=0.03)
    assert trained.simulation.validation == pytest.approx(noise, rel=0.1)
    assert trained.reconstruction.train == pytest.approx(trained.simulation.train, rel=0.02)


def test_parameters_agree_with_the_truth_within_their_deviations(trained):
    unobservable = {"c1_b", "eta"}
    distances = {
        name: (estimate - true) / deviation
        for name, estimate, true, deviation in zip(
            TRUTH._fields, trained.coordinates, TRUTH, trained.deviations, strict=True
        )
        if name not in unobservable
    }
    assert np.isfinite(trained.deviations).all()
    assert max(map(abs, distances.values())) < 3.5, distances
    assert np.sqrt(np.mean(np.square(list(distances.values())))) < 1.8, distances


def test_deviations_are_those_of_the_cramer_rao_bound(trained):
    problem = make_problem()
    information = problem.evaluate(problem.make_start(TRUTH)).hessian
    bound = np.sqrt(np.diag(np.linalg.inv(information))[:COORDINATE_COUNT])
    deviations = np.sqrt(np.diag(trained.covariance))[:COORDINATE_COUNT]
    for name in ("F_a", "F_b", "D_y", "c0_a", "k0", "k1", "f0"):
        i = TRUTH._fields.index(name)
        assert deviations[i] == pytest.approx(bound[i], rel=0.6), name


def test_the_force_of_validation_blocks_is_not_learned():
    problem = make_problem((0.3,), 2.0)
    settings = read_settings("elements").model_copy(update={"refit_on_all": False})
    mask = make_validation_masks(problem.pieces, settings.validation_share, settings.seed)[0]
    piece = problem.pieces[0]
    shifted = np.where(mask > 0, piece.force + 3.0 * problem.noise, piece.force)
    plain = train(problem, settings)
    moved = train(replace(problem, pieces=(replace(piece, force=shifted),)), settings)
    assert moved.simulation.train == pytest.approx(plain.simulation.train, rel=0.03)
    assert moved.simulation.validation == pytest.approx(3.0 * problem.noise, rel=0.25)


def test_of_a_long_recording_the_first_part_is_learned_first_and_all_of_it_at_the_end():
    problem = make_problem((0.0, 0.3), 3.0)
    result = train(problem, read_settings("elements").model_copy(update={"opening_length": 3.0}))
    noise = problem.noise
    assert result.accepted
    assert result.simulation.validation == pytest.approx(noise, rel=0.15)
    later = slice(3200, None)
    assert np.isfinite(result.reconstructed_force[0][later]).all()
    assert np.std(result.simulated_force[0][later] - problem.pieces[0].force[later]) == pytest.approx(
        noise, rel=0.05
    )


def test_with_an_incomplete_law_the_result_is_the_best_simulated_fit_and_its_note_states_the_misfit():
    problem = make_problem((0.0, 0.4), 1.5)
    piece = problem.pieces[0]
    friction = 25.0 * problem.noise * np.tanh(piece.excitation.displacement / 2e-3)
    problem = replace(problem, pieces=(replace(piece, force=piece.force + friction),))
    result = train(problem, read_settings("elements"))
    least = np.sqrt(fit_output_error(problem).evaluation.cost / problem.samples) * problem.noise
    assert result.simulation.train == pytest.approx(least, rel=0.05)
    assert "times the noise" in result.note


def make_stopping_monitor(call):
    """Return a monitor that stops the training at its n-th request, and the list of its requests."""
    requests = []

    def should_stop() -> bool:
        requests.append(True)
        return len(requests) == call

    return TrainingMonitor(should_stop=should_stop), requests


@pytest.mark.parametrize("preset", ["elements", "dense"])
def test_a_training_that_is_stopped_before_its_first_result_raises(preset):
    monitor, requests = make_stopping_monitor(3)
    with pytest.raises(TrainingStopped, match="on request"):
        train(make_problem((0.0, 0.4), 0.5), read_settings(preset), monitor)
    assert len(requests) == 3


def test_a_training_ends_with_its_budget_and_its_message_states_it():
    messages = []
    spent = Budget(seconds=0.0)
    monitor = TrainingMonitor(progress=lambda message, error: messages.append(message), budget=spent)
    with pytest.raises(TrainingStopped, match="budget of 0 s"):
        train(make_problem((0.0, 0.4), 0.5), read_settings("elements"), monitor)
    assert len(messages) == 1


def test_a_training_that_is_stopped_late_returns_its_present_result_without_accepting_it():
    messages = []

    def should_stop() -> bool:
        return "multipliers" in messages[-1]

    monitor = TrainingMonitor(progress=lambda message, error: messages.append(message), should_stop=should_stop)
    result = train(make_problem(), read_settings("elements"), monitor)
    assert not result.accepted
    assert "stopped on request" in result.note
    assert result.simulation.train < 1.1 * make_problem().noise
