"""The joint fit finds the effects of a simulated recording, and screening ranks them first."""

from dataclasses import replace

import numpy as np
import pytest

from identification.fitting import EffectModel, Evaluation, Piece, Problem, SearchSpace, assemble
from identification.gap.fits import FitOptions, fit_jointly, predict_joint_step, refit_all_samples
from identification.gap.selection.screening import list_effect_models, screen
from identification.pipeline import make_problem
from identification.simulate import Excitation, SimulationModel, simulate
from tests.support.effects import LABORATORY, MEDIUM, active
from tests.support.fit_problems import SCALES
from tests.support.runs import run

NOISE = 2.0
RATE = 500.0
EFFECTS = (
    "gas_spring",
    "viscous_heating",
    "field_saturation",
    "moving_mass",
    "force_drift",
    "seal_friction",
)
DECIMATED = FitOptions(decimation=2)


def generate_strokes():
    """Two amplitudes and frequencies across drives, twelve seconds each."""
    t = np.arange(round(12 * RATE)) / RATE
    drive = np.array([0.0, 0.3, 0.1, 0.5, 0.2])[(t / 1.3).astype(int) % 5]
    for amplitude, frequency in ((0.012, 1.0), (0.006, 2.5)):
        w = 2 * np.pi * frequency
        x, v, a = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), -amplitude * w * w * np.sin(w * t)
        yield Excitation(RATE, x, v, a, drive, power=(150.0 + 500.0 * drive) * np.abs(v))


def simulate_problem(*names, seed=1):
    """The problem of the law alone on recordings of the laboratory damper with some effects."""
    random, pieces = np.random.default_rng(seed), []
    model = SimulationModel(LABORATORY, effects=tuple(map(active, names)))
    for k, stroke in enumerate(generate_strokes()):
        force = simulate(model, stroke).force
        train = np.ones(len(force))
        train[:20] = 0.0
        pieces.append(Piece(f"stroke {k}", stroke, force + NOISE * random.standard_normal(len(force)), train))
    return Problem(tuple(pieces), SearchSpace(0.0, 0.5, SCALES), NOISE, 2e-5)


@pytest.fixture(scope="module")
def baselines():
    problems = {name: simulate_problem(name) for name in EFFECTS}
    return {name: (problem, fit_jointly(problem, (), options=DECIMATED)) for name, problem in problems.items()}


@pytest.mark.parametrize("name", EFFECTS)
def test_the_fit_with_the_true_effect_reaches_the_floor_and_its_parameters(baselines, name):
    problem, baseline = baselines[name]
    model = EffectModel.from_name(name)
    joint = fit_jointly(problem, (model,), baseline, DECIMATED)
    assert joint.converged
    assert joint.ratio < 1.02 < baseline.ratio
    for quantity, true in zip(model.quantities, MEDIUM[name][model.form_name], strict=True):
        value, deviation = joint.values[name][quantity.symbol], joint.deviations[name][quantity.symbol]
        assert abs(value - true) < 4.0 * deviation


@pytest.mark.parametrize("name", EFFECTS)
def test_screening_ranks_the_true_effect_first(baselines, name):
    problem, baseline = baselines[name]
    gains = screen(problem, baseline, list_effect_models(), decimation=2)
    assert gains[0].effect_model.name == name
    assert gains[0].predicted_gain > 0.5


def test_no_effect_gains_anything_without_a_gap():
    problem = simulate_problem()
    baseline = fit_jointly(problem, (), options=DECIMATED)
    assert baseline.ratio == pytest.approx(1.0, abs=0.02)
    small = 40.0 / problem.samples
    excess = max(baseline.minimum.evaluation.cost - problem.samples, 1.0) / problem.samples
    gains = screen(problem, baseline, list_effect_models(EFFECTS), decimation=2)
    assert all(g.achieved_gain * excess < small for g in gains)


def test_held_out_samples_are_not_fitted():
    problem = simulate_problem("gas_spring")
    first_half = [np.arange(len(p.force)) < len(p.force) // 2 for p in problem.pieces]
    fitted = problem.replace_training([p.train * h for p, h in zip(problem.pieces, first_half, strict=True)])
    joint = fit_jointly(fitted, (EffectModel.from_name("gas_spring"),), options=DECIMATED)
    assert joint.problem.samples < 0.51 * problem.samples
    held_out = np.concatenate([e[~h] for e, h in zip(joint.force_errors, first_half, strict=True)])
    assert np.sqrt(np.mean(held_out**2)) == pytest.approx(NOISE, rel=0.03)


def test_an_earlier_fit_passes_its_effects_on():
    problem = simulate_problem("gas_spring", "moving_mass")
    first = fit_jointly(problem, (EffectModel.from_name("gas_spring"),), options=DECIMATED)
    both = fit_jointly(problem, (*first.effects, EffectModel.from_name("moving_mass")), first, DECIMATED)
    assert set(both.values) == {"gas_spring", "moving_mass"}
    assert both.rmse < first.rmse


@pytest.mark.parametrize("model", list_effect_models(), ids=lambda m: f"{m.name}-{m.form_name}")
def test_search_coordinates_and_values_are_equivalent(model):
    values = MEDIUM[model.name][model.form_name]
    assert model.to_values(model.to_search(values)) == pytest.approx(values, rel=1e-12)
    low, high = model.get_bounds()
    outside = tuple(q.high + abs(q.high) for q in model.quantities)
    assert np.all(model.to_search(outside) <= high + 1e-12)
    assert np.all(low <= high)


def test_the_fit_keeps_effects_inside_their_bounds():
    """A mass cannot be negative, even if the force asks for it."""
    problem = simulate_problem()
    pieces = tuple(replace(p, force=p.force - 3.0 * p.excitation.acceleration) for p in problem.pieces)
    joint = fit_jointly(
        replace(problem, pieces=pieces), (EffectModel.from_name("moving_mass"),), options=DECIMATED
    )
    assert joint.values["moving_mass"]["mass"] == 0.0


def test_a_refit_on_all_samples_reaches_the_exact_simulation():
    problem = simulate_problem("moving_mass")
    options = replace(DECIMATED, refit_full=False)
    near = fit_jointly(problem.make_fast().decimate(4), (EffectModel.from_name("moving_mass"),), options=options)
    simulated = problem.replace_effects(near.effects).simulate(near.minimum.unknowns)
    full = refit_all_samples(problem, near, simulated, 15)
    assert full.problem.samples == problem.samples
    exact = problem.replace_effects(near.effects).compute_cost(full.minimum.unknowns)
    assert full.minimum.evaluation.cost == pytest.approx(exact, rel=1e-3)
    assert full.ratio == pytest.approx(1.0, abs=0.02)


def test_a_slower_recording_is_decimated_less():
    problem = make_problem(assemble([run()]))
    fast = problem.pieces[0]
    both = replace(problem, pieces=(fast, fast.decimate(5)))
    assert [p.excitation.rate for p in both.decimate(4).pieces] == [125.0, 100.0]
    assert [p.excitation.rate for p in problem.decimate(4).pieces] == [125.0]


def test_a_point_where_the_simulation_diverges_predicts_no_gain():
    problem = simulate_problem("gas_spring")
    diverged = Evaluation(np.inf, np.full((len(problem.free_mask),) * 2, np.nan), np.zeros(len(problem.free_mask)))
    step, predicted = predict_joint_step(problem, diverged, np.zeros(len(problem.free_mask)))
    assert not step.any()
    assert predicted == np.inf
