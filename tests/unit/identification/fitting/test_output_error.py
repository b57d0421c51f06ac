"""Output-error fit: starts, minimisation, intervals, unobservable coordinates."""

from dataclasses import replace

import numpy as np
import pytest

from identification.damper.coordinates import Coordinates
from identification.damper.parameter_sets import find_parameter_set
from identification.fitting.initial_guess import (
    draw_random_start,
    estimate_least_damping,
    make_starting_points,
)
from identification.fitting.output_error import OptimiserSettings, fit_output_error, minimise
from identification.fitting.piece import Piece
from identification.fitting.prediction import compute_rmse, predict_piece
from identification.fitting.problem import Problem
from identification.fitting.search_space import SearchSpace
from identification.fitting.unknown_layout import COORDINATE_COUNT
from identification.progress import ignore_progress
from identification.simulate import SimulationModel, simulate
from identification.uncertainty.covariance import (
    compute_coordinate_covariance,
    estimate_covariance,
    find_strong_correlations,
)
from identification.uncertainty.estimates import (
    make_coordinate_estimates,
    make_delay_estimate,
    make_parameter_estimates,
)
from tests.support.fit_problems import LABORATORY, NOISE, SCALES, STROKES, problem_of, recorded, sine


@pytest.fixture(scope="module")
def fitted():
    problem = problem_of(LABORATORY, STROKES)
    return problem, fit_output_error(problem)


def test_fit_without_a_guess_reaches_the_noise(fitted):
    problem, minimum = fitted
    assert minimum.converged
    assert minimum.iterations < 15
    assert minimum.evaluation.cost / problem.samples == pytest.approx(1.0, abs=0.04)


def test_the_identified_damper_predicts_validation_strokes_as_well_as_the_true_one(fitted):
    problem, minimum = fitted
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    validation = sine(0.012, 1.5)
    piece = Piece("validation", validation, recorded(LABORATORY, validation, 99), np.ones(len(validation.drive)))
    found, true = (compute_rmse(predict_piece(piece, c).force - piece.force) for c in (point, LABORATORY))
    assert found < 1.01 * true


def test_true_values_lie_inside_the_99_percent_intervals(fitted):
    problem, minimum = fitted
    spread = compute_coordinate_covariance(problem, minimum, estimate_covariance(problem, minimum))
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    estimates = make_coordinate_estimates(point, spread, set(), set(), "V")
    for name, e in estimates.items():
        assert e.identifiable, name
        assert e.ci99[0] <= getattr(LABORATORY, name) <= e.ci99[1], name
        assert e.ci99[0] < e.ci95[0] < e.value < e.ci95[1] < e.ci99[1]


def test_the_papers_parameters_come_with_intervals_and_the_gauge_without(fitted):
    problem, minimum = fitted
    spread = compute_coordinate_covariance(problem, minimum, estimate_covariance(problem, minimum))
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    estimates = make_parameter_estimates(
        point, spread, make_coordinate_estimates(point, spread, set(), set(), "V"), "V"
    )
    assert not estimates["A"].identifiable
    assert "no recording determines it" in estimates["A"].note
    true = find_parameter_set("laboratory").parameters
    assert estimates["alpha_b"].unit == "N/(m V)"
    for name in ("alpha_a", "alpha_b", "beta", "gamma", "x0", "c1_a"):
        low, high = estimates[name].ci99
        assert low <= getattr(true, name) <= high, name


def test_with_one_drive_slopes_and_eta_are_unobservable():
    problem = problem_of(
        LABORATORY, [sine(0.01, 1.0, levels=(0.3,)), sine(0.01, 2.5, levels=(0.3,))], drives=(0.3, 0.3)
    )
    minimum = fit_output_error(problem)
    unobservable = {n for n, free in zip(Coordinates._fields, problem.space.free_mask, strict=True) if not free}
    assert unobservable == {"F_b", "c0_b", "c1_b", "eta"}
    spread = compute_coordinate_covariance(problem, minimum, estimate_covariance(problem, minimum))
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    eta = make_coordinate_estimates(point, spread, unobservable, set(), "V")["eta"]
    assert eta.ci95 is None
    assert "the drive never changes" in eta.note
    assert minimum.evaluation.cost / problem.samples == pytest.approx(1.0, abs=0.05)


def test_gradient_and_hessian_of_the_cost_agree_with_differences():
    problem = problem_of(LABORATORY, STROKES[:1], prior=1e-4)
    unknowns = problem.make_start(LABORATORY) + 0.01
    here = problem.evaluate(unknowns)
    for k in range(len(unknowns)):
        e = np.zeros(len(unknowns))
        e[k] = 1e-5
        slope = (problem.evaluate(unknowns + e).cost - problem.evaluate(unknowns - e).cost) / 2e-5
        size = np.sqrt(here.hessian[k, k] * here.cost)
        assert slope / 2 == pytest.approx(here.gradient[k], abs=2e-3 * size), k


def test_a_random_start_finds_the_same_minimum(fitted):
    problem, minimum = fitted
    start = draw_random_start(problem, make_starting_points(problem)[0], 3.0, seed=4)
    again = minimise(problem, start, 80, ignore_progress)
    assert again.evaluation.cost == pytest.approx(minimum.evaluation.cost, rel=1e-5)


def test_a_fit_of_the_first_half_also_reaches_the_noise(fitted):
    problem, _ = fitted
    masks = [p.train * (np.arange(len(p.train)) < len(p.train) // 2) for p in problem.pieces]
    half = fit_output_error(problem.replace_training(masks))
    assert half.converged
    assert half.evaluation.cost / problem.replace_training(masks).samples == pytest.approx(1.0, abs=0.06)


def test_a_damper_that_hardly_yields_is_found_from_a_low_slip_start():
    stiff = Coordinates(
        F_a=93.4, F_b=2030.0, D_y=16.2e-6, rho=0.44, n=1.35, eta=140.0, c0_a=1100.0, c0_b=5880.0,
        c1_a=6960.0, c1_b=25500.0, k0=1540.0, k1=1000.0, f0=5.9,
    )  # fmt: skip
    problem = problem_of(stiff, [sine(0.010, 1.0, 12.0, (0.0, 0.1, 0.2, 0.3, 0.4, 0.5))])
    usual, low_slip, _ = make_starting_points(problem)
    cost = {
        kind: minimise(problem, start, 60, ignore_progress).evaluation.cost / problem.samples
        for kind, start in (("usual", usual), ("low slip", low_slip))
    }
    assert cost["usual"] > 10.0, "else this damper needs no low-slip start"
    assert cost["low slip"] == pytest.approx(1.0, abs=0.04)
    assert fit_output_error(problem).evaluation.cost == pytest.approx(cost["low slip"] * problem.samples, rel=1e-3)


def test_a_damper_that_slides_at_low_drive_only_is_found_from_a_mixed_start():
    # It yields at 25 N without a drive. At the highest drive, 160 N are less than half of its yield force.
    c = Coordinates(
        F_a=25.0, F_b=183.0, D_y=4.3e-5, rho=0.66, n=3.0, eta=163.0, c0_a=960.0, c0_b=-87.0,
        c1_a=2200.0, c1_b=790.0, k0=1570.0, k1=5520.0, f0=-6.6,
    )  # fmt: skip
    levels = (0.0, 1.0, 2.25, 0.5, 2.0, 1.5)
    problem = problem_of(c, [sine(0.010, f, 12.0, levels) for f in (0.4, 0.85)], drives=(0.0, 2.25))
    usual, _, mixed = (
        minimise(problem, start, 60, ignore_progress).evaluation.cost / problem.samples
        for start in make_starting_points(problem)
    )
    assert usual > 1.1, "else this damper needs no mixed start"
    assert mixed == pytest.approx(1.0, abs=0.04)


def test_a_fit_with_a_preview_ends_in_the_minimum_of_all_samples():
    problem = problem_of(LABORATORY, [sine(0.010, 1.0, 30.0), sine(0.015, 2.0, 30.0)])
    found = fit_output_error(problem)
    plain = minimise(problem, make_starting_points(problem)[0], 60, ignore_progress)
    assert found.evaluation.cost == pytest.approx(plain.evaluation.cost, abs=0.1)
    assert found.iterations < plain.iterations


def test_a_channel_delay_beyond_its_prior_is_found():
    stroke = sine(0.01, 2.0)
    late = simulate(SimulationModel(LABORATORY, force_delay=0.002), stroke, max_travel=0.005).force
    noisy = late + NOISE * np.random.default_rng(3).standard_normal(len(late))
    pieces = (Piece("late", stroke, noisy, np.ones(len(noisy))),)
    problem = Problem(pieces, SearchSpace(0.0, 0.5, SCALES), NOISE, 5e-4)
    minimum = fit_output_error(problem)
    assert minimum.unknowns[COORDINATE_COUNT] * 5e-4 == pytest.approx(0.002, abs=1e-4)


def test_a_law_that_cannot_follow_widens_its_intervals():
    def spread_of(piece):
        problem = Problem((piece,), SearchSpace(0.0, 0.5, SCALES), NOISE, 1e-9)
        found = estimate_covariance(problem, fit_output_error(problem, OptimiserSettings(restarts=0)))
        return found.is_coloured, np.sqrt(found.unknowns[0, 0])

    stroke = sine(0.01, 1.0)
    good = Piece("law", stroke, recorded(LABORATORY, stroke, 5), np.ones(len(stroke.drive)))
    bad = replace(good, force=good.force + 60.0 * np.tanh(stroke.displacement / 0.002) ** 3)
    assert not spread_of(good)[0]
    assert spread_of(bad)[0]
    assert spread_of(bad)[1] > 3 * spread_of(good)[1]


def test_correlated_pairs_are_named():
    spread = np.eye(COORDINATE_COUNT)
    spread[10, 11] = spread[11, 10] = -0.97
    assert find_strong_correlations(spread) == {"k0,k1": -0.97}


def test_a_prediction_fits_an_offset_only_on_request():
    stroke = sine(0.01, 1.0)
    force = recorded(LABORATORY, stroke, 6) + 20.0
    piece = Piece("shifted", stroke, force, np.ones(len(force)))
    strict, free = (predict_piece(piece, LABORATORY, free_offset=f) for f in (False, True))
    assert strict.offset == 0.0
    assert free.offset == pytest.approx(20.0, abs=0.5)
    assert compute_rmse(free.force - force) == pytest.approx(NOISE, rel=0.05)
    assert free.y0 == pytest.approx(2e-4, abs=1e-4)


@pytest.mark.parametrize("drives", [(0.0, 0.5), (0.2, 1.0), (0.3, 0.3)])
def test_search_coordinates_are_inverted_and_differentiated_exactly(drives):
    space = SearchSpace(*drives, SCALES)
    c = LABORATORY if not space.has_one_drive else LABORATORY._replace(F_b=0.0, c0_b=0.0, c1_b=0.0)
    q = space.to_search(c)
    assert space.to_coordinates(q) == pytest.approx(c, rel=1e-12, abs=1e-12)
    for k in np.flatnonzero(space.free_mask):
        e = np.zeros(len(q))
        e[k] = 1e-6
        after, before = (np.array(space.to_coordinates(q + s * e)) for s in (1, -1))
        np.testing.assert_allclose(space.differentiate(q)[:, k], (after - before) / 2e-6, rtol=1e-6, atol=1e-6)


def test_an_inner_displacement_far_outside_the_stroke_has_a_high_cost():
    problem = problem_of(LABORATORY, STROKES[:1])
    quiet = replace(problem, noise=1e9)
    here, far = problem.make_start(LABORATORY), problem.make_start(LABORATORY)
    far[-1] += 10.0
    assert quiet.evaluate(far).cost - quiet.evaluate(here).cost == pytest.approx(100.0, rel=0.01)


def test_a_stiffness_at_which_the_inner_displacement_diverges_is_out_of_bounds():
    wild = LABORATORY._replace(k0=-9000.0)
    space = SearchSpace(0.0, 0.5, SCALES, lowest_k0=-1000.0)
    assert space.to_coordinates(space.to_search(wild)).k0 == pytest.approx(-1000.0)
    least = estimate_least_damping(problem_of(LABORATORY, STROKES).pieces, SCALES)
    assert 0.5 * LABORATORY.c0_a < least < LABORATORY.c0_a + LABORATORY.c1_a


def test_an_interval_stays_within_the_bounds():
    spread = np.zeros((COORDINATE_COUNT, COORDINATE_COUNT))
    spread[4, 4] = 0.2**2
    n = make_coordinate_estimates(LABORATORY._replace(n=1.1), spread, set(), set(), "V")["n"]
    assert n.ci95[0] == 1.0
    assert n.ci95[1] == pytest.approx(1.1 * np.exp(1.96 * 0.2 / 1.1), rel=1e-4)


def test_the_note_of_an_unobservable_coordinate_gives_the_reason():
    spread = np.diag([np.nan, *np.full(COORDINATE_COUNT - 1, 1e-6)])
    estimates = make_coordinate_estimates(LABORATORY, spread, {"eta", "k1"}, set(), "V")
    assert estimates["eta"].note.endswith("not observable, because the drive never changes in these strokes")
    assert estimates["k1"].note.endswith("not observable, because nothing in these strokes depends on it")
    assert "no covariance" in estimates["F_a"].note
    assert [estimates[name].ci95 for name in ("eta", "k1", "F_a")] == [None] * 3


def test_a_delay_that_only_its_prior_determines_has_no_interval():
    unobservable, observable = (make_delay_estimate(1e-5, 2e-5, 2e-5, observable=s) for s in (False, True))
    assert unobservable.ci95 is None
    assert "not observable" in unobservable.note
    assert observable.ci95 == pytest.approx((1e-5 - 1.96 * 2e-5, 1e-5 + 1.96 * 2e-5), rel=1e-4)
