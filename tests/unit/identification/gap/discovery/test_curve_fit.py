"""Fit of curves: screening, starts, bounds, and the prior that follows from the coefficients."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identification.fitting import minimise
from identification.gap.data import compute_evidence
from identification.gap.discovery import curve_fit
from identification.gap.discovery.curve_basis import MAX_GROWTH
from identification.gap.discovery.curve_effects import CurvePlace, list_curve_effects
from identification.gap.discovery.curve_evidence import CurveEvidence
from identification.gap.discovery.curve_fit import (
    FittedCurve,
    ScreenedCurve,
    _drop_variants,
    _find_linear_solution,
    _search_line,
    _set_prior,
    _update_prior,
    compute_full_correlation_length,
    fit_best_curves,
    refit_curve,
    screen_curves,
)
from identification.gap.fits import JointFit, insert_effect_unknowns
from identification.progress import ignore_progress
from tests.support.candidate_pools import NOISE
from tests.support.discoveries import FILM, GAIN, GROWING, LENGTH, SPRING, fitted_with, pool_with

OVER_DISPLACEMENT = CurvePlace("parallel_force", ("displacement",))
GROWING_OVER_DISPLACEMENT = CurvePlace("parallel_force", ("displacement", "drive"), grows_with_drive=True)


def screen(*effects):
    pool = pool_with(*effects)
    return screen_curves(pool, pool.baseline)


def make_curve(place, *variables, effects=(GAIN,)):
    """Return a curve of a recording, with its problem and the unknowns at a curve of zero."""
    pool = pool_with(*effects)
    problem, unknowns = pool.problems.screening, pool.baseline.fit.minimum.unknowns
    curves = list_curve_effects(problem, problem.simulate(unknowns))
    curve = next(c for c in curves if (c.at.place, c.at.variables) == (place, variables))
    joint = problem.replace_effects((_set_prior(curve, 0.1),))
    zero = np.zeros(len(curve.model.quantities))
    return curve, joint, insert_effect_unknowns(problem, unknowns, zero)


@pytest.mark.parametrize(
    ("effect", "place", "variables"),
    [(GAIN, "damper_gain", ("displacement",)), (GROWING, "parallel_force", ("displacement", "drive"))],
)
def test_the_right_place_and_variable_come_first(effect, place, variables):
    first, second, *others = screen(effect)
    assert (first.curve.at.place, first.curve.at.variables) == (place, variables)
    assert first.evidence.log_odds > 100.0
    # A viscous force over the same variables is nearly the same; every other curve is far less probable.
    rival = next(s for s in (second, *others) if s.curve.at.variables[0] != variables[0])
    assert first.evidence.log_odds > 5.0 * rival.evidence.log_odds
    odds = [s.evidence.log_odds for s in (second, *others)]
    assert odds == sorted(odds, reverse=True)


def test_a_film_is_viscous_and_no_friction():
    first = _drop_variants(screen(FILM))[0].curve
    assert (first.at.is_viscous, first.at.variables[0], first.unit) == (True, "travel_since_reversal", "N s/m")


def test_without_an_effect_no_curve_is_probable():
    assert screen()[0].evidence.log_odds < 8.0


def test_a_gain_over_the_displacement_is_found_up_to_a_factor_of_the_law():
    fitted = fitted_with(GAIN)
    assert fitted.parent.held_out_rmse > 15.0 * NOISE
    assert fitted.candidate.train_rmse == pytest.approx(NOISE, rel=0.03)
    assert fitted.candidate.held_out_rmse == pytest.approx(NOISE, rel=0.05)
    x = np.linspace(-0.98, 0.98, 50) * LENGTH
    found = fitted.curve.function({"displacement": x}, *fitted.values)
    true = 0.4 * (x / LENGTH) ** 2 + 0.3 * (x / LENGTH) ** 3
    ratio = (1.0 + found) / (1.0 + true)
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=5e-3)


def test_a_force_that_grows_with_the_drive_is_found_with_its_growth():
    fitted = fitted_with(GROWING)
    assert fitted.candidate.held_out_rmse == pytest.approx(NOISE, rel=0.05)
    assert fitted.values[-1] == pytest.approx(6.0, rel=0.03)
    x = np.linspace(-0.98, 0.98, 50) * LENGTH
    found = fitted.curve.function.evaluate({"displacement": x}, np.array(fitted.values[:-1]))
    np.testing.assert_allclose(found, 30.0 * (x / LENGTH) ** 2, atol=1.0)


def test_odds_are_those_on_all_samples():
    fitted, pool = fitted_with(GAIN), pool_with(GAIN)
    assert fitted.parent is pool.baseline
    before, after = fitted.parent.residual, fitted.candidate.residual
    assert fitted.log_odds == compute_evidence(before, after, pool.problems.block_length)
    assert fitted.log_odds > 5.0


@pytest.mark.parametrize(
    ("place", "variables", "effects", "count"),
    [
        ("damper_gain", ("displacement",), 1, 2),
        ("damper_gain", ("dissipated_energy",), 1, 3),
        ("parallel_force", ("travel_since_rest", "velocity"), 1, 4),
        ("parallel_force", ("displacement", "drive"), 3, 5),
    ],
)
def test_every_variable_and_effect_has_to_lower_the_error_by_three_percent(place, variables, effects, count):
    for train, held_out in ((2.0, 1.0), (1.0, 2.0)):
        fit = SimpleNamespace(effects=(None,) * effects)
        candidate = SimpleNamespace(train_rmse=train, held_out_rmse=held_out, fit=fit)
        fitted = FittedCurve(SimpleNamespace(at=CurvePlace(place, variables)), candidate, None, 0.0)
        assert fitted.loss == pytest.approx(np.log(2.0) + 0.03 * count)


def test_values_and_covariance_are_those_of_the_last_effect():
    fitted = fitted_with(GROWING)
    count = len(fitted.curve.model.quantities)
    assert len(fitted.values) == count
    assert fitted.covariance.shape == (count, count)
    fit = fitted.candidate.fit
    np.testing.assert_array_equal(
        fit.effects[-1].to_values(fit.minimum.unknowns[fit.problem.layout.effects]), fitted.values
    )
    assert (np.diag(fitted.covariance) > 0.0).all()


def test_the_best_curves_are_fitted_and_the_one_with_the_smallest_loss_comes_first(monkeypatch):
    monkeypatch.setattr(curve_fit, "_FITTED_CURVES", 2)
    pool, screened = pool_with(GAIN), screen(GAIN)
    force = next(s for s in screened if s.curve.at.place == "force_channel")
    fitted = fit_best_curves(pool, pool.baseline, [force, screened[0], screened[2]])
    assert [f.curve.at for f in fitted] == [screened[0].curve.at, force.curve.at]
    assert fitted[0].loss < fitted[1].loss


def test_the_most_probable_curve_is_found_where_its_first_fit_stays_at_the_law(monkeypatch):
    # A gain of this size has moved the law to values that hide it: the first fit ends where it begins.
    monkeypatch.setattr(curve_fit, "_FINISHED_CURVES", 1)
    pool, screened = pool_with(GAIN), screen(GAIN)
    first = curve_fit._continue_linear_model(pool, pool.baseline, screened[0])
    assert first.candidate.held_out_rmse > 0.9 * pool.baseline.held_out_rmse
    others = [s for s in screened if s.curve.at.place.endswith("_channel")][:2]
    best = fit_best_curves(pool, pool.baseline, [screened[0], *others])[0]
    assert best.curve.at == screened[0].curve.at
    assert best.candidate.held_out_rmse == pytest.approx(NOISE, rel=0.05)


def test_of_two_curves_that_differ_in_growth_alone_the_more_probable_is_fitted():
    screened = screen(GROWING)
    kept = _drop_variants(screened)
    assert kept[0] is screened[0]
    pairs = [find_pair(s.curve.at) for s in screened]
    assert [find_pair(s.curve.at) for s in kept] == list(dict.fromkeys(pairs))
    for s in kept:
        assert s is next(other for other in screened if find_pair(other.curve.at) == find_pair(s.curve.at))


def find_pair(at):
    """Return a place without the growth with the drive."""
    variables = at.variables[:-1] if at.grows_with_drive else at.variables
    return at._replace(variables=variables, grows_with_drive=False)


def test_without_growth_a_curve_that_needs_none_has_the_smaller_loss():
    # The gain of a spring does not grow with the drive.
    pool = pool_with(SPRING)
    screened = [s for s in screen(SPRING) if s.curve.at in (OVER_DISPLACEMENT, GROWING_OVER_DISPLACEMENT)]
    growing = sorted(screened, key=lambda s: not s.curve.at.grows_with_drive)
    fitted = fit_best_curves(pool, pool.baseline, growing)
    assert fitted[0].curve.at == OVER_DISPLACEMENT
    assert {f.curve.at for f in fitted} == {OVER_DISPLACEMENT, GROWING_OVER_DISPLACEMENT}


def test_the_prior_returns_to_the_size_of_the_curve():
    fitted = fitted_with(GROWING)
    settled = fitted.candidate.fit.effects[-1].prior_deviations[0]
    for wrong in (0.02, 50.0):
        model = _set_prior(fitted.curve, wrong * settled)
        problem = fitted.candidate.fit.problem.replace_effects((model,))
        fit = JointFit(problem, minimise(problem, fitted.candidate.fit.minimum.unknowns, 25, ignore_progress))
        for _ in range(4):
            fit = _update_prior(fit, fitted.curve)
        assert fit.effects[-1].prior_deviations[0] == pytest.approx(settled, rel=0.25)
        count = fitted.curve.function.basis.size
        found, values = np.array(fit.active_effects[-1].values), np.array(fitted.values)
        assert np.linalg.norm(found[:count] - values[:count]) < 0.25 * np.linalg.norm(values[:count])


def test_the_prior_is_the_size_of_the_coefficients_over_those_that_are_determined():
    # MacKay 1992: the variance of the prior is the sum of squares over the number of determined coefficients.
    fitted = fitted_with(GROWING)
    fit, count = fitted.candidate.fit, fitted.curve.function.basis.size
    deviation = fit.effects[-1].prior_deviations[0]
    coefficients = np.array(fitted.values[:count])
    determined = np.sum(coefficients**2) / deviation**2
    assert 1.0 < determined < count + 0.5


def test_samples_with_the_same_error_count_as_one(monkeypatch):
    # With a quarter of the information, the same size of the coefficients needs half the deviation.
    fitted = fitted_with(GROWING)
    deviations = []
    for length in (1.0, 4.0):
        monkeypatch.setattr(curve_fit, "compute_residual_correlation_length", lambda errors, length=length: length)
        deviations.append(_update_prior(fitted.candidate.fit, fitted.curve).effects[-1].prior_deviations[0])
    assert deviations[1] == pytest.approx(0.5 * deviations[0], rel=1e-9)


def test_slow_errors_of_all_samples_do_not_overrule_the_prior(monkeypatch):
    fitted, pool = fitted_with(GROWING), pool_with(GROWING)
    few = fitted.candidate.fit.force_errors
    monkeypatch.setattr(
        curve_fit, "compute_residual_correlation_length", lambda errors: 2.0 if errors is few else 18.0
    )
    monkeypatch.setattr(type(pool), "refit_all_samples", lambda self, candidate: candidate)
    before, after = (f.effects[-1].prior_deviations for f in (fitted.candidate.fit, refit_curve(pool, fitted).fit))
    count = fitted.curve.function.basis.size
    assert after[:count] == pytest.approx([d / 3.0 for d in before[:count]])
    assert after[count:] == before[count:]


def test_neighbours_in_slow_noise_have_the_same_error():
    noise = np.random.default_rng(3).standard_normal(4000)
    slow = np.convolve(noise, np.ones(10) / 10.0, mode="same")
    pool = SimpleNamespace(problems=SimpleNamespace(full=SimpleNamespace(pieces=(SimpleNamespace(force=noise),))))
    candidates = [SimpleNamespace(residual=SimpleNamespace(values=values)) for values in (noise, slow)]
    lengths = [compute_full_correlation_length(pool, candidate) for candidate in candidates]
    assert lengths == pytest.approx([1.0, 10.0], rel=0.3)


def test_a_curve_of_zero_keeps_a_prior():
    curve, joint, zero = make_curve("mounting", "acceleration")
    evaluation = joint.evaluate(zero)
    fit = JointFit(joint, replace(fitted_with(GAIN).candidate.fit.minimum, unknowns=zero, evaluation=evaluation))
    again = _update_prior(fit, curve)
    assert again.effects[-1].prior_deviations[0] == curve_fit._SMALLEST_DEVIATION
    columns = next(iter(again.problem.iterate_effects()))[1]
    assert np.abs(again.minimum.unknowns[columns]).max() < 1e-4


def test_growth_has_a_prior_of_its_own():
    curve, joint, _ = make_curve("parallel_force", "displacement", "drive", effects=(GROWING,))
    deviations = joint.effects[-1].prior_deviations
    assert deviations == (0.1,) * curve.function.basis.size + (1.0,)
    assert len(_set_prior(fitted_with(GAIN).curve, 0.1).prior_deviations) == 12


def test_the_end_of_the_linear_model_has_its_law_and_curve():
    curve, joint, zero = make_curve("damper_gain", "displacement")
    step = np.arange(1.0, len(zero) + 1.0)
    problem = joint.replace_effects(())
    first = problem.layout.per_log.start
    unknowns = np.delete(zero, slice(first, first + 12))
    found = _find_linear_solution(problem, unknowns, ScreenedCurve(curve, CurveEvidence(0.0, 1.0, step)))
    np.testing.assert_array_equal(found, zero + step)


def test_the_end_of_the_linear_model_of_a_growing_curve_gives_the_same_force():
    curve, joint, zero = make_curve("parallel_force", "displacement", "drive", effects=(GROWING,))
    problem = joint.replace_effects(())
    first, count = problem.layout.per_log.start, curve.function.basis.size
    unknowns = np.delete(zero, slice(first, first + count + 1))
    coefficients = 0.05 * np.random.default_rng(1).standard_normal(count)
    step = np.zeros(len(unknowns) + 2 * count)
    step[0] = 0.01
    step[first : first + 2 * count] = np.concatenate([coefficients, 2.5 * coefficients])
    found = _find_linear_solution(problem, unknowns, ScreenedCurve(curve, CurveEvidence(0.0, 1.0, step)))
    linear = problem.replace_effects((curve.linear_model,))
    start = insert_effect_unknowns(problem, unknowns, np.zeros(2 * count)) + step
    for product, sum_ in zip(joint.simulate(found), linear.simulate(start), strict=True):
        np.testing.assert_allclose(product, sum_, rtol=1e-9, atol=1e-9)


def test_a_start_lies_inside_the_bounds_and_costs_least():
    curve, joint, zero = make_curve("parallel_force", "displacement", "drive", effects=(GROWING,))
    target = zero.copy()
    columns = next(iter(joint.iterate_effects()))[1]
    target[columns] = 1e6 * np.random.default_rng(2).standard_normal(len(curve.model.quantities))
    chosen = _search_line(joint, zero, target)
    low, high = joint.get_bounds()
    assert (low <= chosen).all()
    assert (chosen <= high).all()
    np.testing.assert_array_equal(chosen, zero)
    near = zero.copy()
    near[columns] = fitted_with(GROWING).candidate.fit.minimum.unknowns[columns]
    assert joint.compute_cost(_search_line(joint, zero, near)) < 0.8 * joint.compute_cost(zero)
    assert joint.compute_cost(_search_line(joint, near, zero)) <= joint.compute_cost(near)


def test_coefficients_and_growth_stay_inside_their_bounds():
    curve, joint, zero = make_curve("parallel_force", "displacement", "drive", effects=(GROWING,))
    low, high = (bound[next(iter(joint.iterate_effects()))[1]] for bound in joint.get_bounds())
    assert (low[:-1] == -100.0).all()
    assert (high[:-1] == 100.0).all()
    # Search coordinates of the growth are over the inverse of the highest drive.
    assert (low[-1], high[-1]) == pytest.approx((-0.95, MAX_GROWTH))
    values = curve.model.to_values(np.array([*zero[:12], -5.0]))
    assert curve.model.to_search(values)[-1] == pytest.approx(-0.95)
