"""Priors of effects in a problem: they add to cost, gradient and curvature, and draw a fit towards zero."""

from dataclasses import replace

import numpy as np
import pytest

from identification.fitting import EffectModel, minimise
from identification.fitting.problem import Problem
from identification.progress import ignore_progress
from tests.support.discoveries import all_curves, find_curve, make_problem, make_stroke
from tests.support.fit_problems import LABORATORY, NOISE, SCALES, SHORT, problem_of

CURVE = find_curve("parallel_force", "displacement").model
SPRING = EffectModel.from_name("gas_spring")
DEVIATIONS = tuple(np.geomspace(0.01, 2.0, len(CURVE.quantities)))


def make_pair(deviations=DEVIATIONS) -> tuple[Problem, Problem]:
    """Return a problem of two effects without and with priors of the second."""
    problem = problem_of(LABORATORY, [SHORT])
    return tuple(
        problem.replace_effects((SPRING, m)) for m in (CURVE, replace(CURVE, prior_deviations=deviations))
    )


def draw_unknowns(problem):
    """Return unknowns with coefficients that are not zero, and the columns of these."""
    unknowns = problem.make_start(LABORATORY)
    columns = list(problem.iterate_effects())[-1][1]
    unknowns[columns] = np.random.default_rng(3).normal(0.0, 0.05, len(CURVE.quantities))
    return unknowns, columns


def test_cost_gradient_and_curvature_include_the_prior():
    free, bound = make_pair()
    unknowns, columns = draw_unknowns(free)
    weights = np.zeros(len(unknowns))
    weights[columns] = 1.0 / np.array(DEVIATIONS) ** 2
    here, there = free.evaluate(unknowns), bound.evaluate(unknowns)
    expected = float(np.sum(weights * unknowns**2))
    assert expected > 1.0
    assert there.cost - here.cost == pytest.approx(expected)
    assert bound.compute_cost(unknowns) - free.compute_cost(unknowns) == pytest.approx(expected)
    np.testing.assert_allclose(there.gradient - here.gradient, weights * unknowns, atol=1e-6 * weights.max())
    np.testing.assert_allclose(
        there.hessian - here.hessian, np.diag(weights), atol=1e-9 * np.abs(here.hessian).max()
    )


def test_the_gradient_is_that_of_the_cost():
    _, problem = make_pair()
    unknowns, columns = draw_unknowns(problem)
    gradient = problem.evaluate(unknowns).gradient
    for column in (columns.start, columns.start + 5, columns.stop - 1):
        move = np.zeros(len(unknowns))
        move[column] = 1e-5
        slope = (problem.compute_cost(unknowns + move) - problem.compute_cost(unknowns - move)) / 4e-5
        assert gradient[column] == pytest.approx(slope, rel=1e-3)


def test_an_effect_without_a_prior_has_none():
    assert EffectModel.from_name("gas_spring").prior_deviations == ()
    assert all(c.model.prior_deviations == c.linear_model.prior_deviations == () for c in all_curves().values())
    free, bound = make_pair()
    columns = list(free.iterate_effects())[-1][1]
    assert (free.shared_prior_weights[free.layout.shared_columns.index(columns.start) :] == 0.0).all()
    # The prior of one effect leaves those before it as they are.
    spring = next(iter(bound.iterate_effects()))[1]
    weights = dict(zip(bound.layout.shared_columns, bound.shared_prior_weights, strict=True))
    assert [weights[k] for k in range(spring.start, spring.stop)] == [0.0] * len(SPRING.quantities)
    assert [weights[k] for k in range(columns.start, columns.stop)] == pytest.approx(1.0 / np.array(DEVIATIONS))


def test_a_prior_is_in_search_coordinates():
    # The growth of a curve is searched over its scale, the inverse of the highest drive.
    curve = find_curve("parallel_force", "displacement", "drive").model
    model = replace(curve, prior_deviations=(1.0,) * len(curve.quantities))
    values = (*np.zeros(len(curve.quantities) - 1), 3.0 / SCALES.drive)
    costs = []
    for effect in (curve, model):
        problem = make_problem(make_stroke(seconds=0.2)).replace_effects((effect,))
        unknowns = problem.make_start(LABORATORY)
        unknowns[problem.layout.effects] = effect.to_search(values)
        costs.append(problem.compute_cost(unknowns))
    assert costs[1] - costs[0] == pytest.approx(9.0, rel=1e-6)


@pytest.mark.parametrize(("deviation", "low", "high"), [(1e-6, 0.0, 1e-5), (1.0, 0.02, 1.0)])
def test_a_narrow_prior_keeps_a_curve_at_zero(deviation, low, high):
    problem = problem_of(LABORATORY, [SHORT])
    bent = replace(
        problem.pieces[0], force=problem.pieces[0].force + 20.0 * NOISE * (SHORT.displacement / 0.01) ** 2
    )
    model = replace(CURVE, prior_deviations=(deviation,) * len(CURVE.quantities))
    problem = replace(problem, pieces=(bent,)).replace_effects((model,))
    found = minimise(problem, problem.make_start(LABORATORY), 15, ignore_progress).unknowns[problem.layout.effects]
    assert low <= np.abs(found).max() < high
