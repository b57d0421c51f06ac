"""The fit in memory: start, descent, intervals, what cannot be seen."""

from dataclasses import replace

import numpy as np
import pytest

from identification.damper.coordinates import Coordinates, to_coordinates
from identification.damper.parameter_sets import parameter_set
from identification.piece import Piece
from identification.prediction import predict_piece, rmse
from identification.problem import COORDINATE_COUNT, Problem
from identification.refine import Settings, descend, refine
from identification.search_space import SearchSpace
from identification.simulate import Setting, Stroke, simulate
from identification.start import further_points, scattered, sliding_damping, starting_points
from identification.uncertainty import (
    coordinate_covariance,
    coordinate_estimates,
    covariance,
    delay_estimate,
    parameter_estimates,
    strong_correlations,
)

LABORATORY = to_coordinates(parameter_set("laboratory").parameters)
RATE, NOISE = 1000.0, 2.5
LEVELS = (0.0, 0.3, 0.1, 0.5, 0.2, 0.4)


def sine(amplitude, frequency, seconds=6.0, levels=LEVELS):
    t = np.arange(round(seconds * RATE)) / RATE
    w = 2 * np.pi * frequency
    drive = np.array(levels)[np.minimum((t * len(levels) / seconds).astype(int), len(levels) - 1)]
    x = amplitude * np.sin(w * t)
    return Stroke(RATE, x, amplitude * w * np.cos(w * t), -w * w * x, drive)


def recorded(c, stroke, seed, noise=NOISE):
    force = simulate(Setting(c, y0=2e-4), stroke, fineness=0.005).force
    return force + noise * np.random.default_rng(seed).standard_normal(len(force))


def problem_of(c, strokes, seed=0, drives=(0.0, 0.5), prior=20e-6):
    pieces = [Piece(f"s{i}", s, recorded(c, s, seed + i), np.ones(len(s.drive))) for i, s in enumerate(strokes)]
    return Problem(tuple(pieces), SearchSpace(*drives), NOISE, prior)


STROKES = [sine(0.005, 2.5), sine(0.010, 1.0), sine(0.015, 2.0)]


@pytest.fixture(scope="module")
def fitted():
    problem = problem_of(LABORATORY, STROKES)
    return problem, refine(problem)


def test_fit_without_a_guess_reaches_the_noise(fitted):
    problem, minimum = fitted
    assert minimum.converged
    assert minimum.iterations < 15
    assert minimum.evaluation.cost / problem.samples == pytest.approx(1.0, abs=0.04)


def test_identified_damper_predicts_unseen_strokes_as_well_as_the_true_one(fitted):
    problem, minimum = fitted
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    unseen = sine(0.012, 1.5)
    piece = Piece("unseen", unseen, recorded(LABORATORY, unseen, 99), np.ones(len(unseen.drive)))
    found, true = (rmse(predict_piece(piece, c).force - piece.force) for c in (point, LABORATORY))
    assert found < 1.01 * true


def test_true_values_lie_inside_the_99_percent_intervals(fitted):
    problem, minimum = fitted
    spread = coordinate_covariance(problem, minimum, covariance(problem, minimum))
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    estimates = coordinate_estimates(point, spread, set(), set(), "V")
    for name, e in estimates.items():
        assert e.identifiable, name
        assert e.ci99[0] <= getattr(LABORATORY, name) <= e.ci99[1], name
        assert e.ci99[0] < e.ci95[0] < e.value < e.ci95[1] < e.ci99[1]


def test_the_papers_parameters_come_with_intervals_and_the_gauge_without(fitted):
    problem, minimum = fitted
    spread = coordinate_covariance(problem, minimum, covariance(problem, minimum))
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    estimates = parameter_estimates(point, spread, coordinate_estimates(point, spread, set(), set(), "V"), "V")
    assert not estimates["A"].identifiable
    assert "no recording reveals it" in estimates["A"].note
    true = parameter_set("laboratory").parameters
    assert estimates["alpha_b"].unit == "N/(m V)"
    for name in ("alpha_a", "alpha_b", "beta", "gamma", "x0", "c1_a"):
        low, high = estimates[name].ci99
        assert low <= getattr(true, name) <= high, name


def test_one_drive_hides_slopes_and_eta():
    problem = problem_of(
        LABORATORY, [sine(0.01, 1.0, levels=(0.3,)), sine(0.01, 2.5, levels=(0.3,))], drives=(0.3, 0.3)
    )
    minimum = refine(problem)
    hidden = {n for n, free in zip(Coordinates._fields, problem.space.free, strict=True) if not free}
    assert hidden == {"F_b", "c0_b", "c1_b", "eta"}
    spread = coordinate_covariance(problem, minimum, covariance(problem, minimum))
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    eta = coordinate_estimates(point, spread, hidden, set(), "V")["eta"]
    assert eta.ci95 is None
    assert "the drive never changes" in eta.note
    assert minimum.evaluation.cost / problem.samples == pytest.approx(1.0, abs=0.05)


def test_gradient_and_hessian_of_the_cost_agree_with_differences():
    problem = problem_of(LABORATORY, STROKES[:1], prior=1e-4)
    unknowns = problem.start(LABORATORY) + 0.01
    here = problem.evaluate(unknowns)
    for k in range(len(unknowns)):
        e = np.zeros(len(unknowns))
        e[k] = 1e-5
        slope = (problem.evaluate(unknowns + e).cost - problem.evaluate(unknowns - e).cost) / 2e-5
        size = np.sqrt(here.hessian[k, k] * here.cost)
        assert slope / 2 == pytest.approx(here.gradient[k], abs=2e-3 * size), k


def test_a_scattered_start_finds_the_same_minimum(fitted):
    problem, minimum = fitted
    start = scattered(problem, starting_points(problem)[0], 3.0, seed=4)
    again = descend(problem, start, 80, lambda what, error: None)
    assert again.evaluation.cost == pytest.approx(minimum.evaluation.cost, rel=1e-5)


def test_a_fit_of_the_first_half_also_reaches_the_noise(fitted):
    problem, _ = fitted
    masks = [p.train * (np.arange(len(p.train)) < len(p.train) // 2) for p in problem.pieces]
    half = refine(problem.with_training(masks))
    assert half.converged
    assert half.evaluation.cost / problem.with_training(masks).samples == pytest.approx(1.0, abs=0.06)


def test_a_damper_that_hardly_breaks_through_is_found_from_the_second_kind_of_start():
    stiff = Coordinates(
        F_a=93.4, F_b=2030.0, D_y=16.2e-6, rho=0.44, n=1.35, eta=140.0, c0_a=1100.0, c0_b=5880.0,
        c1_a=6960.0, c1_b=25500.0, k0=1540.0, k1=1000.0, f0=5.9,
    )  # fmt: skip
    problem = problem_of(stiff, [sine(0.010, 1.0, 12.0, (0.0, 0.1, 0.2, 0.3, 0.4, 0.5))])
    cost = {
        kind: descend(problem, points(problem)[0], 60, lambda what, error: None).evaluation.cost / problem.samples
        for kind, points in (("breaks through", starting_points), ("hardly", further_points))
    }
    assert cost["breaks through"] > 10.0, "or this damper asks for no other start"
    assert cost["hardly"] == pytest.approx(1.0, abs=0.04)
    assert refine(problem).evaluation.cost == pytest.approx(cost["hardly"] * problem.samples, rel=1e-3)


def test_a_first_look_at_fewer_samples_ends_in_the_minimum_of_all():
    problem = problem_of(LABORATORY, [sine(0.010, 1.0, 30.0), sine(0.015, 2.0, 30.0)])
    found = refine(problem)
    plain = descend(problem, starting_points(problem)[0], 60, lambda what, error: None)
    assert found.evaluation.cost == pytest.approx(plain.evaluation.cost, abs=0.1)
    assert found.iterations < plain.iterations


def test_a_channel_delay_beyond_its_prior_is_found():
    stroke = sine(0.01, 2.0)
    late = simulate(Setting(LABORATORY, force_delay=0.002), stroke, fineness=0.005).force
    noisy = late + NOISE * np.random.default_rng(3).standard_normal(len(late))
    pieces = (Piece("late", stroke, noisy, np.ones(len(noisy))),)
    problem = Problem(pieces, SearchSpace(0.0, 0.5), NOISE, 5e-4)
    minimum = refine(problem)
    assert minimum.unknowns[COORDINATE_COUNT] * 5e-4 == pytest.approx(0.002, abs=1e-4)


def test_a_law_that_cannot_follow_widens_its_intervals():
    def spread_of(piece):
        problem = Problem((piece,), SearchSpace(0.0, 0.5), NOISE, 1e-9)
        found = covariance(problem, refine(problem, Settings(restarts=0)))
        return found.coloured, np.sqrt(found.unknowns[0, 0])

    stroke = sine(0.01, 1.0)
    good = Piece("law", stroke, recorded(LABORATORY, stroke, 5), np.ones(len(stroke.drive)))
    bad = replace(good, force=good.force + 60.0 * np.tanh(stroke.displacement / 0.002) ** 3)
    assert not spread_of(good)[0]
    assert spread_of(bad)[0]
    assert spread_of(bad)[1] > 3 * spread_of(good)[1]


def test_correlated_pairs_are_named():
    spread = np.eye(COORDINATE_COUNT)
    spread[10, 11] = spread[11, 10] = -0.97
    assert strong_correlations(spread) == {"k0,k1": -0.97}


def test_prediction_frees_y0_and_an_offset_only_if_asked():
    stroke = sine(0.01, 1.0)
    force = recorded(LABORATORY, stroke, 6) + 20.0
    piece = Piece("shifted", stroke, force, np.ones(len(force)))
    strict, free = (predict_piece(piece, LABORATORY, free_offset=f) for f in (False, True))
    assert strict.offset == 0.0
    assert free.offset == pytest.approx(20.0, abs=0.5)
    assert rmse(free.force - force) == pytest.approx(NOISE, rel=0.05)
    assert free.y0 == pytest.approx(2e-4, abs=1e-4)


@pytest.mark.parametrize("drives", [(0.0, 0.5), (0.2, 1.0), (0.3, 0.3)])
def test_search_numbers_go_there_and_back_with_exact_slopes(drives):
    space = SearchSpace(*drives)
    c = LABORATORY if not space.one_drive else LABORATORY._replace(F_b=0.0, c0_b=0.0, c1_b=0.0)
    q = space.to_search(c)
    assert space.to_coordinates(q) == pytest.approx(c, rel=1e-12, abs=1e-12)
    for k in np.flatnonzero(space.free):
        e = np.zeros(len(q))
        e[k] = 1e-6
        after, before = (np.array(space.to_coordinates(q + s * e)) for s in (1, -1))
        np.testing.assert_allclose(space.slopes(q)[:, k], (after - before) / 2e-6, rtol=1e-6, atol=1e-6)


def test_an_inner_displacement_far_outside_the_stroke_costs_dearly():
    problem = problem_of(LABORATORY, STROKES[:1])
    quiet = replace(problem, noise=1e9)
    here, far = problem.start(LABORATORY), problem.start(LABORATORY)
    far[-1] += 10 * 0.005 / 1e-3
    assert quiet.evaluate(far).cost - quiet.evaluate(here).cost == pytest.approx(100.0, rel=0.01)


def test_a_stiffness_that_lets_the_inner_displacement_run_away_is_out_of_bounds():
    wild = LABORATORY._replace(k0=-9000.0)
    space = SearchSpace(0.0, 0.5, lowest_k0=-1000.0)
    assert space.to_coordinates(space.to_search(wild)).k0 == pytest.approx(-1000.0)
    assert 10e3 < sliding_damping(problem_of(LABORATORY, STROKES).pieces) / 0.7 < 30e3


def test_an_interval_never_leaves_what_is_possible():
    spread = np.zeros((COORDINATE_COUNT, COORDINATE_COUNT))
    spread[4, 4] = 0.2**2
    n = coordinate_estimates(LABORATORY._replace(n=1.1), spread, set(), set(), "V")["n"]
    assert n.ci95[0] == 1.0
    assert n.ci95[1] == pytest.approx(1.1 * np.exp(1.96 * 0.2 / 1.1), rel=1e-4)


def test_what_cannot_be_seen_says_why():
    spread = np.diag([np.nan, *np.full(COORDINATE_COUNT - 1, 1e-6)])
    said = coordinate_estimates(LABORATORY, spread, {"eta", "k1"}, set(), "V")
    assert said["eta"].note.endswith("cannot be seen, the drive never changes in these strokes")
    assert said["k1"].note.endswith("cannot be seen, nothing in these strokes depends on it")
    assert "no covariance" in said["F_a"].note
    assert [said[name].ci95 for name in ("eta", "k1", "F_a")] == [None] * 3


def test_a_delay_that_only_its_prior_holds_has_no_interval():
    unseen, seen = (delay_estimate(1e-5, 2e-5, 2e-5, seen=s) for s in (False, True))
    assert unseen.ci95 is None
    assert "cannot be seen" in unseen.note
    assert seen.ci95 == pytest.approx((1e-5 - 1.96 * 2e-5, 1e-5 + 1.96 * 2e-5), rel=1e-4)
