"""Intervals, covariances, clock drift and profiles against numbers computed by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.fitting import PER_LOG_PARAMETERS, Evaluation, Minimum
from identification.uncertainty.agreement import Agreement
from identification.uncertainty.clock_drift import (
    _add_drift_prior,
    _DriftTerms,
    _find_likeliest_drift,
    _make_knot_weights,
    _separate_knots,
    _solve_step,
    describe_clock_drift,
)
from identification.uncertainty.covariance import (
    Covariance,
    _compute_block_scores,
    estimate_covariance,
    find_strong_correlations,
    find_unobservable,
)
from identification.uncertainty.estimates import (
    make_coordinate_estimates,
    make_delay_estimate,
    make_per_log_estimate,
)
from identification.uncertainty.input_noise import _estimate_level_noise
from identification.uncertainty.interval import clip_interval, make_interval
from identification.uncertainty.profile import _find_end, _minimise_constrained
from tests.support.fit_problems import LABORATORY


def test_an_interval_is_symmetric_or_for_a_positive_quantity_a_factor():
    assert make_interval(5.0, 0.5, 2.0, positive=False) == pytest.approx((4.0, 6.0))
    assert make_interval(5.0, 2.5, 2.0, positive=True) == pytest.approx((5.0 / np.e, 5.0 * np.e))
    assert make_interval(1.0, 1e6, 2.0, positive=True) == pytest.approx((np.exp(-50.0), np.exp(50.0)))


@pytest.mark.parametrize(
    ("interval", "clipped"),
    [((0.5, 3.0), (1.0, 2.5)), ((1.2, 2.2), (1.2, 2.2)), ((2.1, 2.2), (2.0, 2.2)), ((1.2, 1.5), (1.2, 2.0))],
)
def test_an_interval_is_clipped_to_the_bounds_and_contains_its_value(interval, clipped):
    assert clip_interval(interval, 2.0, 1.0, 2.5) == clipped


def test_a_value_beyond_its_bounds_stays_in_its_interval():
    assert clip_interval((0.0, 9.0), 3.0, 4.0, 5.0) == (3.0, 5.0)
    assert clip_interval((0.0, 9.0), 6.0, 4.0, 5.0) == (4.0, 6.0)


@pytest.mark.parametrize(("largest", "consistent"), [(2.9, True), (2.91, False)])
def test_estimates_agree_up_to_the_largest_deviation_of_chance(largest, consistent):
    agreement = Agreement({"n": 0.1, "D_y": largest, "k0": 2.0})
    assert agreement.is_consistent == consistent
    assert agreement.worst_coordinate == "D_y"
    if not consistent:
        assert agreement.describe().startswith("disagree in D_y, most in D_y by 2.9 deviations")


@pytest.mark.parametrize(
    ("r", "found"), [(0.91, {"F_a,rho": 0.91}), (-0.91, {"F_a,rho": -0.91}), (0.89, {}), (-0.89, {})]
)
def test_only_strong_correlations_are_listed(r, found):
    spread = np.zeros((13, 13))
    spread[0, 0], spread[3, 3], spread[0, 3], spread[3, 0] = 0.04, 0.25, 0.1 * r, 0.1 * r
    assert find_strong_correlations(spread) == found


class LinearProblem:
    """Fit of constants to residuals: each unknown has a sensitivity of its own in each sample."""

    def __init__(self, residuals, rate, size=1):
        self.pieces = [SimpleNamespace(force=r, excitation=SimpleNamespace(rate=rate)) for r in residuals]
        self._residuals, self.samples = residuals, sum(map(len, residuals))
        self.free_mask = np.ones(size, bool)

    def find_columns(self, piece):
        return [0]

    def find_interior(self, unknowns):
        return self.free_mask

    def compute_residuals(self, unknowns, piece):
        return self._residuals[piece], np.ones((len(self._residuals[piece]), 1))


@pytest.mark.parametrize(
    ("durations", "blocks", "samples"), [((60,), 40, 15), ((2,), 4, 5), ((2000,), 100, 200), ((40, 20), 41, 15)]
)
def test_scores_are_summed_over_a_fortieth_of_the_recording_within_limits(durations, blocks, samples):
    problem = LinearProblem([np.full(10 * seconds, 2.0) for seconds in durations], 10.0)
    scores = _compute_block_scores(problem, np.zeros(1))
    assert scores.shape == (blocks, 1)
    assert scores[0, 0] == 2.0 * samples
    assert scores.sum() == 2.0 * problem.samples


def minimum_with(cost, *information):
    return Minimum(
        np.zeros(len(information)),
        Evaluation(cost, np.diag(np.array(information, float)), np.zeros(len(information))),
        1,
        True,
    )


ALTERNATING = np.tile([1.0, -1.0], 300)
BLOCKS = np.repeat(np.tile([1.0, -1.0], 20), 15)
"""Residuals of the sign of their block: each of 40 blocks has a score of 15."""


@pytest.mark.parametrize(
    ("residuals", "cost", "variance", "coloured"),
    [
        (ALTERNATING, 600.0, 1.0 / 600.0, False),
        (ALTERNATING, 300.0, 1.0 / 600.0, False),
        (ALTERNATING, 2400.0, 4.0 / 600.0, False),
        (BLOCKS, 600.0, 40 * 15.0**2 / 600.0**2, True),
    ],
)
def test_a_misfit_widens_the_variance_and_a_coloured_one_widens_it_to_the_sandwich(
    residuals, cost, variance, coloured
):
    found = estimate_covariance(LinearProblem([residuals], 10.0), minimum_with(cost, 600.0))
    assert found.unknowns[0, 0] == pytest.approx(variance)
    assert found.is_coloured == coloured


@pytest.mark.parametrize(("ratio", "coloured"), [(1.4, False), (1.6, True)])
def test_a_misfit_counts_as_coloured_from_one_and_a_half_times_the_variance(ratio, coloured):
    # 40 blocks of 15 samples: the sandwich is 15 times the variance for residuals of one.
    residuals = BLOCKS * np.sqrt(ratio / 15.0)
    assert (
        estimate_covariance(LinearProblem([residuals], 10.0), minimum_with(600.0, 600.0)).is_coloured == coloured
    )


def test_an_unknown_with_little_information_is_unobservable_and_input_noise_adds():
    problem = LinearProblem([ALTERNATING], 10.0, size=3)
    found = estimate_covariance(problem, minimum_with(600.0, 600.0, 0.009, 0.011), np.full((3, 3), 0.5))
    np.testing.assert_array_equal(found.observable, [True, False, True])
    assert np.diag(found.unknowns) == pytest.approx([0.5 + 1 / 600, 0.5, 0.5 + 1 / 0.011])


def test_a_coordinate_is_unobservable_or_at_a_bound_or_neither():
    observable, interior = np.ones(16, bool), np.ones(16, bool)
    observable[[2, 14]] = interior[[2, 4, 14]] = False
    assert find_unobservable(Covariance(np.zeros((16, 16)), observable, interior, False)) == ({"D_y"}, {"n"})


@pytest.mark.parametrize(
    ("value", "outside"), [(2.99e-5, False), (-2.99e-5, False), (3e-5, True), (-3e-5, True), (0.0, False)]
)
def test_a_delay_at_three_deviations_of_its_prior_is_outside_it(value, outside):
    assert make_delay_estimate(value, 1e-6, 1e-5, observable=True).outside_prior == outside


@pytest.mark.parametrize(("sd", "identifiable"), [(0.49, True), (0.51, False)])
def test_a_per_log_offset_has_symmetric_intervals(sd, identifiable):
    e = make_per_log_estimate(PER_LOG_PARAMETERS["offset"], 0.5, sd)
    assert (e.value, e.unit, e.identifiable) == (10.0, "N", identifiable)
    assert e.ci95 == pytest.approx((10 - 1.959964 * 20 * sd, 10 + 1.959964 * 20 * sd))
    assert e.ci99 == pytest.approx((10 - 2.575829 * 20 * sd, 10 + 2.575829 * 20 * sd))


@pytest.mark.parametrize(("relative", "identifiable"), [(0.49, True), (0.51, False)])
def test_a_coordinate_is_identifiable_below_half_of_its_value(relative, identifiable):
    spread = np.diag(np.square(relative * np.array(LABORATORY)))
    estimates = make_coordinate_estimates(LABORATORY, spread, set(), set(), "V")
    for name in ("F_a", "k0", "c0_b"):
        assert estimates[name].identifiable == identifiable, name


def test_the_noise_of_a_drive_is_that_of_its_constant_levels():
    drive = np.repeat([0.1, 0.5], 500) + 1e-3 * np.random.default_rng(1).standard_normal(1000)
    assert _estimate_level_noise(drive) == pytest.approx(np.full(1000, 1e-3), rel=0.1)
    assert not _estimate_level_noise(np.sin(np.arange(1000) / 50.0)).any()


@pytest.mark.parametrize(("count", "knots"), [(8001, 3), (1001, 2), (5001, 2), (11001, 4)])
def test_knots_of_a_drift_are_four_seconds_apart(count, knots):
    sparse = _make_knot_weights(count, 1000.0)
    # A dense table of a long recording would need a gigabyte.
    assert sparse.nnz <= 2 * count
    weights = sparse.toarray()
    assert weights.shape == (count, knots)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    if knots == 3:
        found = weights[[0, 1000, 2000, 4000, 7000]]
        np.testing.assert_allclose(found, [[1, 0, 0], [0.75, 0.25, 0], [0.5, 0.5, 0], [0, 1, 0], [0, 0.25, 0.75]])


def likeliest(ratio, clock_deviation=1e-4, knots=1):
    """Drift for knots of 1 µs deviation whose squared estimate is so many variances."""
    terms = _DriftTerms(1e12 * np.eye(knots), np.zeros((1, knots)), np.full(knots, np.sqrt(ratio) * 1e6))
    return _find_likeliest_drift(terms, np.eye(1), np.zeros(1), np.ones(1, bool), clock_deviation)


@pytest.mark.parametrize(
    ("ratio", "drift"), [(401.0, 20e-6), (101.0, 10e-6), (9.5, 2.915e-6), (9.0, 0.0), (0.5, 0.0)]
)
def test_the_likeliest_drift_explains_the_excess_over_chance(ratio, drift):
    assert likeliest(ratio) == pytest.approx(drift, rel=0.05)


def test_several_knots_show_a_smaller_drift_and_the_clocks_limit_it():
    assert likeliest(5.0, knots=4) == pytest.approx(2e-6, rel=0.05)
    assert likeliest(401.0, 5e-6) == pytest.approx(5e-6)
    assert likeliest(401.0, 0.0) == pytest.approx(2e-6)


def test_knots_lose_the_information_that_they_share_with_the_unknowns():
    terms = _DriftTerms(np.array([[5.0]]), np.array([[2.0]]), np.array([7.0]))
    size, slope = _separate_knots(terms, np.array([[4.0]]), np.array([3.0]), np.ones(1, bool))
    assert size == pytest.approx([4.0])
    assert np.abs(slope) == pytest.approx([5.5])
    wide = _DriftTerms(np.diag([1.0, 0.5, 1e-12]), np.zeros((1, 3)), np.ones(3))
    assert len(_separate_knots(wide, np.eye(1), np.zeros(1), np.ones(1, bool))[0]) == 2


def test_the_unknowns_follow_a_drift_and_keep_less_information():
    terms = _DriftTerms(np.array([[3.0]]), np.array([[2.0]]), np.array([2.0]))
    information, step = _solve_step(terms, np.array([[4.0]]), np.array([3.0]), np.ones(1, bool), 1.0)
    assert information == pytest.approx(np.array([[3.0]]))
    assert step == pytest.approx([-2.0 / 3.0])
    assert _add_drift_prior(terms, 0.5) == pytest.approx(np.array([[7.0]]))


def test_a_drift_is_noted_from_ten_microseconds_on():
    assert describe_clock_drift(9.9e-6) == ()
    (note,) = describe_clock_drift(12e-6)
    assert "drifts by 12 µs" in note


class OneCoordinate:
    """Problem of one unknown whose residual is a function of it."""

    free_mask = np.ones(1, bool)
    layout = SimpleNamespace(coordinates=slice(0, 1))
    space = SimpleNamespace(to_coordinates=lambda q: q, differentiate=lambda q: np.eye(1))

    def __init__(self, residual, slope):
        self._residual, self._slope = residual, slope

    def evaluate(self, unknowns):
        r, s = self._residual(float(unknowns[0])), self._slope(float(unknowns[0]))
        return Evaluation(r * r, np.array([[s * s]]), np.array([s * r]))

    def get_bounds(self):
        return np.full(1, -np.inf), np.full(1, np.inf)

    def measure_step(self, step):
        return float(np.abs(step).max())


LINE = OneCoordinate(lambda x: x, lambda x: 1.0)
STEEPENING = OneCoordinate(lambda x: x + 0.1 * x * abs(x), lambda x: 1 + 0.2 * abs(x))
FLATTENING = OneCoordinate(lambda x: x / (1 + 0.1 * abs(x)), lambda x: 1 / (1 + 0.1 * abs(x)) ** 2)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("problem", "deviation", "end"),
    [
        (LINE, 1.0, 1.96),
        (LINE, 3.0, 5.88),
        (STEEPENING, 1.0, 1.6783),
        (STEEPENING, 2.0, 3.0125),
        (FLATTENING, 1.0, 2.4378),
    ],
)
def test_a_profile_ends_where_the_cost_has_risen_by_the_allowed_amount(problem, deviation, end, side):
    best = Minimum(np.zeros(1), problem.evaluate(np.zeros(1)), 1, True)
    assert _find_end(problem, best, 0, side * deviation, 1.0) == pytest.approx(side * end, rel=0.03)


def test_a_profile_of_a_flat_cost_ends_within_some_widths():
    flat = OneCoordinate(lambda x: np.tanh(x), lambda x: 1.0 / np.cosh(x) ** 2)
    best = Minimum(np.zeros(1), flat.evaluate(np.zeros(1)), 1, True)
    assert 1.96 < _find_end(flat, best, 0, 1.0, 1.0) < 6.5 * 1.96


def test_a_step_that_overshoots_is_shortened_until_the_cost_falls():
    def evaluate(unknowns):
        x = float(unknowns[0])
        cost = 1e4 * (x - 1.0) ** 2 if x < 0.95 else 1e9
        return Evaluation(cost, np.array([[1e4]]), np.array([1e4 * (x - 1.0)])), cost

    unknowns, cost = _minimise_constrained(SimpleNamespace(evaluate=evaluate, problem=LINE), np.zeros(1))
    assert unknowns[0] == pytest.approx(1.0 / 1.1)
    assert cost == pytest.approx(1e4 / 11.0**2)
