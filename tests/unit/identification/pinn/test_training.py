"""Trainings: to the noise floor, stopped in time, judged honestly; settings that are refused."""

import json
from dataclasses import replace
from itertools import islice
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from made_up_problem import TRUTH, problem

from identification.damper.coordinates import to_coordinates
from identification.errors import IdentificationError
from identification.pinn import local_runs
from identification.pinn.beginning import starts
from identification.pinn.mlp import Network
from identification.pinn.paper_runs import PaperTraining
from identification.pinn.result import Moment
from identification.pinn.settings import PaperSettings, preset_names, read_settings
from identification.pinn.split import validation_masks
from identification.pinn.supervision import Stopped, Supervision
from identification.pinn.train import train
from identification.problem import COORDINATE_COUNT
from identification.refine import refine

QUICK_PAPER = PaperSettings(width=8, layers=2, adam_steps=300, lbfgs_steps=0, samples=128, validation_share=0.0)


@pytest.fixture(scope="module")
def trained():
    return train(problem(), read_settings("local"))


def test_the_local_network_reaches_the_noise_and_so_does_the_law_with_its_parameters(trained):
    noise = problem().noise
    assert trained.accepted
    assert trained.simulation.train == pytest.approx(noise, rel=0.03)
    assert trained.simulation.validation == pytest.approx(noise, rel=0.1)
    assert trained.reconstruction.train == pytest.approx(trained.simulation.train, rel=0.02)


def test_the_second_start_has_the_outer_dashpot_rise_with_the_drive():
    first, second = (start.coordinates for start in islice(starts(problem()), 2))
    assert second.c1_a == pytest.approx(first.c1_a / 5.0)
    assert second.c1_a + 0.5 * second.c1_b == pytest.approx(5.0 * (first.c1_a + 0.5 * first.c1_b))
    assert second[:8] == first[:8]


def test_two_starts_agree_as_far_as_their_misfits_still_waver():
    def moment(phase, force):
        return Moment(0.0, phase, force, 0.0, 0.0)

    last = SimpleNamespace(phase="last", history=[moment("first", 9.0), moment("last", 4.0), moment("last", 3.9)])
    assert local_runs._wavering(last) == pytest.approx(0.025)
    alone = SimpleNamespace(phase="last", history=[moment("first", 9.0), moment("last", 4.0)])
    assert local_runs._wavering(alone) == 0.0


def test_its_parameters_lie_within_their_deviations(trained):
    hidden = {"c1_b", "eta"}
    far = {
        name: (found - true) / deviation
        for name, found, true, deviation in zip(
            TRUTH._fields, trained.coordinates, TRUTH, trained.deviations, strict=True
        )
        if name not in hidden
    }
    assert np.isfinite(trained.deviations).all()
    assert max(map(abs, far.values())) < 3.5, far
    assert np.sqrt(np.mean(np.square(list(far.values())))) < 1.8, far


def test_its_deviations_are_those_that_the_simulated_force_allows(trained):
    given = problem()
    information = given.evaluate(given.start(TRUTH)).hessian
    bound = np.sqrt(np.diag(np.linalg.inv(information))[:COORDINATE_COUNT])
    found = np.sqrt(np.diag(trained.covariance))[:COORDINATE_COUNT]
    for name in ("F_a", "F_b", "D_y", "c0_a", "k0", "k1", "f0"):
        i = TRUTH._fields.index(name)
        assert found[i] == pytest.approx(bound[i], rel=0.6), name


def test_the_force_of_the_blocks_set_aside_was_not_learned():
    given = problem((0.3,), 2.0)
    settings = read_settings("local").model_copy(update={"take_back": False})
    aside = validation_masks(given.pieces, settings.validation_share, settings.seed)[0]
    piece = given.pieces[0]
    wild = np.where(aside > 0, piece.force + 3.0 * given.noise, piece.force)
    plain = train(given, settings)
    moved = train(replace(given, pieces=(replace(piece, force=wild),)), settings)
    assert moved.simulation.train == pytest.approx(plain.simulation.train, rel=0.03)
    assert moved.simulation.validation == pytest.approx(3.0 * given.noise, rel=0.25)


def test_of_a_long_recording_the_beginnings_are_learned_first_and_the_whole_in_the_end(monkeypatch):
    monkeypatch.setattr(local_runs, "_ENOUGH", 3.0)
    given = problem((0.0, 0.3), 3.0)
    found = train(given, read_settings("local"))
    noise = given.noise
    assert found.accepted
    assert found.simulation.validation == pytest.approx(noise, rel=0.15)
    beyond = slice(3200, None)
    assert np.isfinite(found.reconstructed[0][beyond]).all()
    assert np.std(found.simulated[0][beyond] - given.pieces[0].force[beyond]) == pytest.approx(noise, rel=0.05)


def test_a_law_that_lacks_something_still_gives_one_answer_and_its_note_says_how_far_it_is_off():
    given = problem((0.0, 0.4), 1.5)
    piece = given.pieces[0]
    beside = 25.0 * given.noise * np.tanh(piece.stroke.displacement / 2e-3)
    found = train(replace(given, pieces=(replace(piece, force=piece.force + beside),)), read_settings("local"))
    refined = refine(replace(given, pieces=(replace(piece, force=piece.force + beside),)))
    least = np.sqrt(refined.evaluation.cost / given.samples) * given.noise
    assert found.simulation.train == pytest.approx(least, rel=0.05)
    assert "times the noise" in found.note


def stopped_at_the(call):
    """A supervision that stops the training when it asks for the n-th time, and the list of its calls."""
    asked = []

    def stop() -> bool:
        asked.append(True)
        return len(asked) == call

    return Supervision(stop=stop), asked


@pytest.mark.parametrize("preset", ["local", "global"])
def test_a_training_stops_when_asked_before_anything_is_found(preset):
    supervision, asked = stopped_at_the(3)
    with pytest.raises(Stopped, match="on request"):
        train(problem((0.0, 0.4), 0.5), read_settings(preset), supervision)
    assert len(asked) == 3


@pytest.mark.parametrize("steps", [{"adam_steps": 100, "lbfgs_steps": 0}, {"adam_steps": 0, "lbfgs_steps": 100}])
def test_a_training_of_the_paper_network_stops_when_asked_with_what_it_has(steps):
    supervision, asked = stopped_at_the(2)
    found = train(problem((0.0, 0.4), 0.5), QUICK_PAPER.model_copy(update=steps), supervision)
    assert len(asked) == 2
    assert found.note.startswith("stopped on request")
    assert found.steps < 100


def test_a_training_ends_with_its_budget_and_says_so():
    said = []
    supervision = Supervision(progress=lambda what, error: said.append(what), budget=0.0)
    with pytest.raises(Stopped, match="budget of 0 s"):
        train(problem((0.0, 0.4), 0.5), read_settings("local"), supervision)
    assert len(said) == 1


def test_a_training_stopped_late_gives_what_it_has_and_does_not_call_it_accepted():
    said = []

    def stop() -> bool:
        return "multipliers" in said[-1]

    supervision = Supervision(progress=lambda what, error: said.append(what), stop=stop)
    found = train(problem(), read_settings("local"), supervision)
    assert not found.accepted
    assert "stopped on request" in found.note
    assert found.simulation.train < 1.1 * problem().noise


def test_rates_of_the_paper_network_are_those_along_the_trajectory():
    training = PaperTraining(problem((0.0, 0.4), 1.0), [np.zeros(2000)], QUICK_PAPER, Supervision())
    at = torch.tensor([200, 555, 1500])
    inputs = training.pieces[0].inputs

    def states(time):
        x, v = inputs.motion(time)
        d = training.data
        scale = np.array([np.abs(d.x.numpy()).max(), d.v.numpy().std(), 0.4, 0.9995])
        drive = inputs.drive(time, 0.0)
        shown = np.column_stack([x, v, drive, time - 0.9995]) / scale
        zero = torch.zeros(shown.shape, dtype=torch.float64)
        return training.network.forward(training.weights, torch.as_tensor(shown), zero)[0].detach().numpy()

    time = at.numpy() * inputs.h
    expected = (states(time + 1e-6) - states(time - 1e-6)) / 2e-6
    units = np.array([training.scales.u, training.scales.y, training.scales.z])
    _, rates = training._states(training.data.at(at))
    found = rates.detach().numpy().T
    assert found == pytest.approx(expected * units, rel=1e-3, abs=1e-9)


def test_the_derivative_carried_forward_is_that_of_automatic_differentiation():
    network = Network([3, 5, 4, 2])
    weights = network.begin(7, "cpu")
    inputs, rates = torch.randn(6, 3, dtype=torch.float64), torch.randn(6, 3, dtype=torch.float64)

    def outputs(shown):
        return network.forward(weights, shown, torch.zeros_like(shown))[0]

    _, expected = torch.autograd.functional.jvp(outputs, inputs, rates)
    assert torch.allclose(network.forward(weights, inputs, rates)[1], expected)


def test_the_way_back_through_outputs_and_rates_is_that_of_automatic_differentiation():
    network = Network([3, 5, 4, 2])
    weights = network.begin(7, "cpu").requires_grad_()
    inputs, rates = torch.randn(1100, 3, dtype=torch.float64), torch.randn(1100, 3, dtype=torch.float64)

    def automatic():
        value, rate, _ = network.forward(weights, inputs, rates)
        return value.T, rate.T

    def slopes(value, rate):
        return torch.autograd.grad((value * rate).sum() + (value[0] ** 3).sum() + (rate**2).sum(), weights)[0]

    def same(found, expected):
        return torch.allclose(found, expected, rtol=1e-11, atol=1e-11 * float(expected.detach().abs().max()))

    for found in [network.outputs(weights, inputs.T, rates.T) for _ in range(2)]:
        assert all(same(*pair) for pair in zip(found, automatic(), strict=True))
        assert same(slopes(*found), slopes(*automatic()))
    with torch.no_grad():
        assert all(map(same, network.outputs(weights, inputs.T, rates.T), automatic()))


def test_the_paper_network_learns_the_force_and_gives_parameters_of_a_damper():
    given = problem((0.0, 0.4), 1.0)
    found = train(given, QUICK_PAPER)
    errors = [moment.force for moment in found.history]
    assert errors[-1] < 0.8 * float(np.std(given.pieces[0].force))
    assert errors[-1] < errors[0]
    assert not found.accepted
    assert found.covariance is None
    assert to_coordinates(found.parameters).D_y > 0


def test_shipped_settings_are_complete_and_name_their_network():
    networks = {name: read_settings(name).network for name in preset_names()}
    assert networks == {"global": "global", "local": "local", "paper": "paper", "tuned": "local"}


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"network": "local"}, "local.layers"),
        ({"network": "paper", "learning_rate": 0.0}, "learning_rate.*greater than 0"),
        ({"network": "global", "depth": 3}, "depth.*not permitted"),
        ({"network": "deep"}, "does not match any of the expected tags"),
    ],
)
def test_wrong_settings_are_refused_with_their_place(tmp_path, settings, why):
    place = tmp_path / "settings.json"
    place.write_text(json.dumps(settings))
    with pytest.raises(IdentificationError, match=why):
        read_settings(place)


def test_an_unknown_preset_is_refused_with_those_there_are():
    with pytest.raises(IdentificationError, match=r"neither a preset .global, local, paper, tuned. nor a file"):
        read_settings("locl")
