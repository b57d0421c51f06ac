"""The joint fit finds what was put in, and the first look ranks it first."""

from dataclasses import replace

import numpy as np
import pytest
from effect_examples import LABORATORY, MEDIUM, active
from made_up_runs import run

from identification.assemble import assemble
from identification.effect_choice import EffectChoice
from identification.gap.explain import Effort, fit_with
from identification.gap.screen import every_choice, screen
from identification.identify import fit_problem
from identification.piece import Piece
from identification.problem import Problem
from identification.search_space import SearchSpace
from identification.simulate import Setting, Stroke, simulate

NOISE = 2.0
RATE = 500.0
SOME = ("gas_spring", "viscous_heating", "field_saturation", "moving_mass", "force_drift", "seal_friction")


def strokes():
    """Two amplitudes and frequencies across drives, twelve seconds each."""
    t = np.arange(round(12 * RATE)) / RATE
    drive = np.array([0.0, 0.3, 0.1, 0.5, 0.2])[(t / 1.3).astype(int) % 5]
    for amplitude, frequency in ((0.012, 1.0), (0.006, 2.5)):
        w = 2 * np.pi * frequency
        x, v, a = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), -amplitude * w * w * np.sin(w * t)
        yield Stroke(RATE, x, v, a, drive, power=(150.0 + 500.0 * drive) * np.abs(v))


def problem(effects, seed=1):
    """Recordings of the laboratory damper with effects, as a problem of the plain law."""
    random, pieces = np.random.default_rng(seed), []
    for k, stroke in enumerate(strokes()):
        force = simulate(Setting(LABORATORY, effects=effects), stroke).force
        train = np.ones(len(force))
        train[:20] = 0.0
        pieces.append(Piece(f"stroke {k}", stroke, force + NOISE * random.standard_normal(len(force)), train))
    return Problem(tuple(pieces), SearchSpace(0.0, 0.5), NOISE, 2e-5)


@pytest.fixture(scope="module")
def baselines():
    return {name: (p := problem((active(name),)), fit_with(p, (), effort=Effort(thin=2))) for name in SOME}


@pytest.mark.parametrize("name", SOME)
def test_the_joint_fit_returns_to_the_floor_with_the_values_that_were_put_in(baselines, name):
    plain, baseline = baselines[name]
    choice = EffectChoice.of(name)
    joint = fit_with(plain, (choice,), baseline, Effort(thin=2))
    assert joint.converged
    assert joint.ratio < 1.02 < baseline.ratio
    for quantity, true in zip(choice.quantities, MEDIUM[name][choice.form_name], strict=True):
        value, deviation = joint.values[name][quantity.symbol], joint.deviations[name][quantity.symbol]
        assert abs(value - true) < 4.0 * deviation


@pytest.mark.parametrize("name", SOME)
def test_the_first_look_ranks_what_was_put_in_first(baselines, name):
    plain, baseline = baselines[name]
    gains = screen(plain, baseline, every_choice(), thin=2)
    assert gains[0].choice.name == name
    assert gains[0].gain > 0.5


def test_nothing_is_gained_where_nothing_is_missing():
    plain = problem(())
    baseline = fit_with(plain, (), effort=Effort(thin=2))
    assert baseline.ratio == pytest.approx(1.0, abs=0.02)
    small = 40.0 / plain.samples
    excess = max(baseline.minimum.evaluation.cost - plain.samples, 1.0) / plain.samples
    assert all(g.achieved * excess < small for g in screen(plain, baseline, every_choice(SOME), thin=2))


def test_held_out_samples_are_scored_but_not_fitted():
    plain = problem((active("gas_spring"),))
    half = [np.arange(len(p.force)) < len(p.force) // 2 for p in plain.pieces]
    fitted = plain.with_training([p.train * h for p, h in zip(plain.pieces, half, strict=True)])
    joint = fit_with(fitted, (EffectChoice.of("gas_spring"),), effort=Effort(thin=2))
    assert joint.problem.samples < 0.51 * plain.samples
    assert joint.rmse_on([~h for h in half]) == pytest.approx(NOISE, rel=0.03)


def test_an_earlier_fit_hands_its_effects_on():
    plain = problem((active("gas_spring"), active("moving_mass")))
    first = fit_with(plain, (EffectChoice.of("gas_spring"),), effort=Effort(thin=2))
    both = fit_with(plain, (*first.effects, EffectChoice.of("moving_mass")), first, Effort(thin=2))
    assert set(both.values) == {"gas_spring", "moving_mass"}
    assert both.rmse < first.rmse
    assert "gas_spring (polytropic) and moving_mass (rigid)" in both.words


@pytest.mark.parametrize("choice", every_choice(), ids=lambda c: f"{c.name}-{c.form_name}")
def test_search_numbers_and_values_are_the_same_thing(choice):
    values = MEDIUM[choice.name][choice.form_name]
    assert choice.to_values(choice.to_search(values)) == pytest.approx(values, rel=1e-12)
    low, high = choice.bounds()
    outside = tuple(q.high + abs(q.high) for q in choice.quantities)
    assert np.all(choice.to_search(outside) <= high + 1e-12)
    assert np.all(low < high)


def test_the_fit_keeps_effects_inside_their_bounds():
    """A mass cannot be negative, however much the force would like it."""
    plain = problem(())
    pieces = tuple(replace(p, force=p.force - 3.0 * p.stroke.acceleration) for p in plain.pieces)
    joint = fit_with(replace(plain, pieces=pieces), (EffectChoice.of("moving_mass"),), effort=Effort(thin=2))
    assert joint.values["moving_mass"]["mass"] == 0.0


def test_a_first_look_leaves_out_fewer_samples_of_a_slower_recording():
    problem = fit_problem(assemble([run()]))
    fast = problem.pieces[0]
    both = replace(problem, pieces=(fast, fast.coarser(5)))
    assert [p.stroke.rate for p in both.coarser(4).pieces] == [125.0, 100.0]
    assert [p.stroke.rate for p in problem.coarser(4).pieces] == [125.0]
