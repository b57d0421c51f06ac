"""Starts of a training."""

from dataclasses import replace
from itertools import islice
from types import SimpleNamespace

import numpy as np
import pytest

from identification.fitting.search_space import SearchSpace
from identification.pinn.common.initialisation import (
    InitialStates,
    MemorylessDamper,
    _estimate_misfit,
    _estimate_yield_displacement,
    _make_coordinates,
    _measure_slips,
    _normalise_drive,
    _select_samples,
    generate_starts,
    smooth_force,
)
from identification.pinn.common.training_pieces import make_training_pieces
from tests.support.fit_problems import SCALES
from tests.support.pinn_problem import TRUTH, make_problem


def test_in_the_second_start_the_outer_dashpot_increases_with_the_drive():
    first, second = (start.coordinates for start in islice(generate_starts(make_problem()), 2))
    assert second.c1_a == pytest.approx(first.c1_a / 5.0)
    assert second.c1_a + 0.5 * second.c1_b == pytest.approx(5.0 * (first.c1_a + 0.5 * first.c1_b))
    assert second[:8] == first[:8]


def test_the_third_start_has_three_times_the_yield_displacement():
    first, _, third = (start.coordinates for start in islice(generate_starts(make_problem()), 3))
    assert third.D_y == pytest.approx(3.0 * first.D_y)


MEMORYLESS = MemorylessDamper((10.0, 30.0), (100.0, 200.0), (400.0, 1000.0), 500.0, 20.0)


def test_the_first_start_is_near_the_truth():
    start = next(generate_starts(make_problem()))
    c = start.coordinates
    for name in ("c0_a", "c0_b", "F_b"):
        assert getattr(c, name) == pytest.approx(getattr(TRUTH, name), rel=0.35), name
    assert c.k0 + c.k1 == pytest.approx(TRUTH.k0 + TRUTH.k1, rel=0.3)
    assert c.f0 == pytest.approx(TRUTH.f0, rel=0.3)
    assert 0.3 < c.D_y / TRUTH.D_y < 3.0
    assert 0.0 < start.misfit < 100.0
    assert start.effects.shape == (0,)


def test_coefficients_of_the_regression_have_units():
    damper = MemorylessDamper.make(np.array([*np.log([10.0, 30.0, 100.0, 200.0, 400.0, 1000.0]), 0.5, 0.4]))
    assert damper[:3] == tuple(pytest.approx(pair) for pair in MEMORYLESS[:3])
    assert damper[3:] == pytest.approx((500.0, 20.0))


@pytest.mark.parametrize(
    ("v", "drive", "inner"),
    [
        (0.01, 0.0, 0.01),  # the dashpot carries 4 N, less than the yield force
        (0.1, 0.0, (10.0 + 10.0) / 500.0),
        (-0.1, 0.0, -(10.0 + 10.0) / 500.0),
        (0.1, 0.5, (20.0 + 15.0) / 850.0),  # half way between both drives
    ],
)
def test_the_inner_point_follows_the_stroke_until_it_yields(v, drive, inner):
    assert MEMORYLESS.compute_inner_velocity(np.array([v]), np.array([drive])) == pytest.approx([inner])
    c1 = 400.0 + 600.0 * drive
    force = MEMORYLESS.compute_force(np.array([0.003]), np.array([v]), np.array([drive]))
    assert force == pytest.approx([c1 * inner + 1.5 - 20.0])


def test_the_force_is_smoothed_over_an_odd_number_of_samples():
    pulse = np.zeros(9)
    pulse[[0, 5]] = 3.0
    assert smooth_force(pulse, 300.0) == pytest.approx([2.0, 1.0, 0, 0, 1.0, 1.0, 1.0, 0, 0])  # 2.4 samples: 3
    assert smooth_force(pulse, 100.0) == pytest.approx(pulse)


def test_slips_count_from_the_last_extreme_to_the_change_of_sign():
    hysteretic = np.array([1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0])
    slip = np.array([0.0, 2.0, 5.0, 4.0, 1.0, -3.0, -2.5, 0.0])
    # From the maximum 5 to 4, then from the minimum -3 to -2.5.
    assert _measure_slips(hysteretic, slip) == pytest.approx([1.0, 0.5])


@pytest.fixture(scope="module")
def states():
    (source,) = make_training_pieces(make_problem())
    return InitialStates(source, TRUTH), source


def test_initial_states_balance_the_forces_of_the_law(states):
    initial, source = states
    time = source.sample_times[200:-50]
    s = initial.evaluate(time)
    x, v = source.inputs.evaluate_motion(time)
    u = source.inputs.evaluate_field(time, TRUTH.eta, 0.0).u
    F, c0, c1 = (
        a + b * u for a, b in ((TRUTH.F_a, TRUTH.F_b), (TRUTH.c0_a, TRUTH.c0_b), (TRUTH.c1_a, TRUTH.c1_b))
    )
    balance = F * s.z + TRUTH.k0 * (x - s.y) + c0 * (v - s.y_rate) - c1 * s.y_rate
    assert np.median(np.abs(balance)) < 0.1 * np.median(F)
    force = c1 * s.y_rate + TRUTH.k1 * x - TRUTH.f0
    recorded = source.piece.force[200:-50]
    assert np.median(np.abs(force - recorded)) < 3.0 * make_problem().noise
    assert initial.make_slip_velocity()(time) == pytest.approx(v - s.y_rate)
    assert np.gradient(s.y, time) == pytest.approx(s.y_rate, abs=0.2 * np.abs(s.y_rate).max())
    assert np.abs(s.z).max() <= 1.0


def test_coordinates_are_lines_over_the_drive_and_split_the_stiffness():
    space = SearchSpace(0.2, 0.6, SCALES)
    c = _make_coordinates(SimpleNamespace(space=space), MEMORYLESS, 1e-4)
    # 10 at 0.2 V and 30 at 0.6 V are 0 + 50 u; 100 and 200: 50 + 250 u; 400 and 1000: 100 + 1500 u.
    assert (c.F_a, c.F_b, c.c0_a, c.c0_b, c.c1_a, c.c1_b) == pytest.approx((0, 50, 50, 250, 100, 1500), abs=1e-9)
    assert (c.k0 + c.k1, c.f0, c.D_y) == pytest.approx((500.0, 20.0, 1e-4))
    assert 0.0 < c.k1 < c.k0
    assert c.eta == pytest.approx(20.0 * SCALES.rate)
    one_drive = SearchSpace(0.2, 0.2, SCALES)
    constant = _make_coordinates(SimpleNamespace(space=one_drive), MEMORYLESS, 1e-4)
    assert (constant.F_a, constant.F_b) == (10.0, 0.0)


def test_drives_are_normalised_to_their_range():
    problem = SimpleNamespace(space=SimpleNamespace(lowest_drive=0.2, highest_drive=0.6))
    assert _normalise_drive(problem, np.array([0.1, 0.2, 0.3, 0.6, 0.9])) == pytest.approx([0, 0, 0.25, 1, 1])


def test_the_misfit_is_a_standard_deviation_from_the_median():
    piece = make_problem().pieces[0]
    shifted = replace(piece, force=np.full(len(piece.force), 80.0))
    problem = replace(make_problem(), pieces=(shifted,))
    rigid = MemorylessDamper((1.0, 1.0), (0.0, 0.0), (0.0, 0.0), 0.0, 20.0)._replace(c1=(1e-12, 1e-12))
    # The damper has a constant force of -20 N.
    assert _estimate_misfit(problem, rigid) == pytest.approx(1.4826 * 100.0)


def test_a_parallel_force_and_the_preload_shift_the_inner_velocity(states):
    initial, source = states
    shifted = InitialStates(source, TRUTH, 5.0)
    c1 = TRUTH.c1_a + TRUTH.c1_b * source.inputs.evaluate_field(source.sample_times, TRUTH.eta, 0.0).u
    time = source.sample_times
    assert initial.evaluate(time).y_rate - shifted.evaluate(time).y_rate == pytest.approx(5.0 / c1)


def test_the_inner_displacement_has_the_mean_of_the_stroke():
    piece = make_problem().pieces[0]
    excitation = replace(piece.excitation, displacement=piece.excitation.displacement + 0.004)
    (source,) = make_training_pieces(replace(make_problem(), pieces=(replace(piece, excitation=excitation),)))
    y = InitialStates(source, TRUTH).evaluate(source.sample_times).y
    assert np.mean(y) == pytest.approx(np.mean(excitation.displacement), rel=1e-6)


def test_the_yield_displacement_stays_between_its_shares_of_the_largest_half_stroke():
    problem = make_problem()
    short = replace(problem.pieces[0], excitation=replace(problem.pieces[0].excitation))
    both = replace(problem, pieces=(problem.pieces[0], short))
    still = MEMORYLESS._replace(c0=(1e9, 1e9))
    low, high = 1.5e-3 * 0.01, 5e-2 * 0.01
    for damper in (MEMORYLESS, still):
        assert low * 0.999 <= _estimate_yield_displacement(both, damper) <= high * 1.001
    true = MemorylessDamper(
        (TRUTH.F_a, TRUTH.F_a + 0.5 * TRUTH.F_b), (TRUTH.c0_a, TRUTH.c0_a + 0.5 * TRUTH.c0_b),
        (TRUTH.c1_a, TRUTH.c1_a + 0.5 * TRUTH.c1_b), TRUTH.k0 + TRUTH.k1, TRUTH.f0,
    )  # fmt: skip
    assert 0.3 < _estimate_yield_displacement(problem, true) / TRUTH.D_y < 3.0


@pytest.mark.parametrize(("pieces", "length", "count"), [(1, 900, 880), (2, 4500, 4480), (2, 900, 1760)])
def test_the_regression_uses_about_3000_fitted_samples(pieces, length, count):
    problem = make_problem()
    piece = problem.pieces[0]
    train = np.where(np.arange(len(piece.train)) < length, piece.train, 0.0)
    several = replace(problem, pieces=(replace(piece, train=train),) * pieces)
    assert [len(row) for row in _select_samples(several)] == [count] * 4
