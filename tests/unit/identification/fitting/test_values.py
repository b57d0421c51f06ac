"""Parts of a fit against numbers computed by hand: unknowns, search coordinates, starts, masks, clocks, steps."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from identification.damper.effects import EFFECTS
from identification.errors import UnusableDataError
from identification.fitting.dataset import (
    HoldOut,
    _check_hold_out,
    _combine_clock_errors,
    _estimate_clock_error,
    _exclude_unresolved,
    _make_low_pass,
    _make_piece,
    assemble,
)
from identification.fitting.effect_model import EffectModel
from identification.fitting.force_channel import LowPass, compute_filter_delay
from identification.fitting.initial_guess import (
    _make_low_slip_start,
    _make_sliding_start,
    _regress_force,
    draw_random_start,
    estimate_least_damping,
)
from identification.fitting.log_correction import PER_LOG_PARAMETERS, LogCorrection
from identification.fitting.output_error import (
    _decimate_for_preview,
    minimise,
    solve_bounded_step,
)
from identification.fitting.prediction import compute_drive_errors, compute_nrmse, compute_rmse, make_piece_model
from identification.fitting.problem import Evaluation, Problem
from identification.fitting.recording_scales import measure_scales
from identification.fitting.search_space import SearchSpace
from identification.fitting.unknown_layout import UnknownLayout
from identification.logs.channel_info import ChannelFilter
from identification.logs.recording import Recording, Segment
from identification.progress import ignore_progress
from identification.simulate import Excitation
from tests.support.fit_problems import (
    LABORATORY,
    NOISE,
    SCALES,
    SHORT,
    SLIDING,
    SLIDING_STROKES,
    linear_force,
    piece_of,
    recorded,
    sine,
)
from tests.support.strokes import stretch


def problem_of(*pieces, space=None, **more):
    return Problem(tuple(pieces), space or SearchSpace(0.0, 0.5, SCALES), NOISE, 2e-5, **more)


LAYOUT = UnknownLayout(piece_count=3, effect_sizes=(2, 1), log_size=2, further_logs=2)


def test_unknowns_are_coordinates_delays_starts_effects_and_per_log_parameters():
    assert LAYOUT.size == 13 + 2 + 3 + 3 + 4
    assert (LAYOUT.delays, LAYOUT.y0, LAYOUT.effects) == (slice(13, 15), slice(15, 18), slice(18, 21))
    assert LAYOUT.effect_slices == [slice(18, 20), slice(20, 21)]
    assert LAYOUT.per_log == slice(21, 25)
    assert LAYOUT.shared_columns == [*range(15), *range(18, 25)]
    assert [LAYOUT.find_log_columns(log) for log in range(3)] == [[], [21, 22], [23, 24]]
    assert LAYOUT.find_piece_columns(1, 2) == [*range(15), 16, 18, 19, 20, 23, 24]


BACKLASH, CONTACT = EffectModel.from_name("clevis_backlash"), EffectModel.from_name("clevis_backlash", "free_pin")


def test_an_effect_is_searched_by_its_size_or_by_its_logarithm():
    q = CONTACT.to_search((2e-4, 1e-3))
    assert q == pytest.approx([2.0, np.log(1e-3)])
    assert CONTACT.to_values(q) == pytest.approx((2e-4, 1e-3))
    assert CONTACT.differentiate(q) == pytest.approx([1e-4, 1e-3])
    np.testing.assert_array_equal(CONTACT.log_mask, [False, True])
    low, high = CONTACT.get_bounds()
    assert low == pytest.approx([0.0, np.log(1e-6)])
    assert high == pytest.approx([20.0, np.log(1e-2)])
    assert CONTACT.to_search((-1.0, 1e-9)) == pytest.approx(low)
    assert CONTACT.to_search((1.0, 1.0)) == pytest.approx(high)


def test_the_search_space_is_bounded_in_units_of_the_recording():
    space = SearchSpace(0.1, 0.5, SCALES, lowest_k0=-3000.0)
    low, high = space.get_bounds()
    assert np.exp([low[0], low[1], high[1]]) == pytest.approx([0.02, 0.2, 6e3])
    assert np.exp([low[2], high[2]]) == pytest.approx([1e-7, 0.03])
    assert np.exp([low[5], high[5]]) == pytest.approx([0.2, 4000.0])
    assert np.exp([low[6], high[7], low[8], high[9]]) == pytest.approx([0.02, 6e4, 2.0, 2e8])
    assert (low[10], high[10], low[11], high[11]) == pytest.approx((-0.15, 10.0, -10.0, 10.0))
    assert (low[12], high[12]) == pytest.approx((-50.0, 50.0))
    q = space.to_search(LABORATORY)
    assert q[[0, 1]] == pytest.approx(np.log([135.0, 495.0]))
    assert q[[10, 11, 12]] == pytest.approx([0.11, 0.04, 0.08])


def test_a_damper_that_is_negative_at_an_end_of_the_drives_starts_at_the_lowest_bound():
    q = SearchSpace(0.0, 0.5, SCALES).to_search(LABORATORY._replace(c0_a=-5.0, c0_b=0.0, F_a=10.0, F_b=-100.0))
    assert np.exp(q[[6, 7]]) == pytest.approx([0.02, 0.02])
    assert np.exp(q[[0, 1]]) == pytest.approx([10.0, 0.2])


@pytest.mark.parametrize(("width", "one"), [(0.0, True), (5e-10, True), (5e-9, False), (0.5, False)])
def test_a_drive_without_width_hides_slopes_and_eta(width, one):
    space = SearchSpace(0.3, 0.3 + width, SCALES)
    assert space.has_one_drive == one
    np.testing.assert_array_equal(np.flatnonzero(~space.free_mask), [1, 5, 7, 9] if one else [])
    mask = problem_of(piece_of(SHORT), space=space).free_mask
    assert (mask[13], mask[14]) == (True, not one)


COEFFICIENTS = [50.0, 400.0, 600.0, 1500.0, 3000.0, -20.0]


def test_a_regression_finds_the_force_of_a_sliding_damper():
    assert _regress_force(SLIDING, SCALES) == pytest.approx(COEFFICIENTS)
    spoilt = replace(SLIDING[0], force=SLIDING[0].force + 1e4 * (np.arange(6000) < 3000))
    masked = replace(spoilt, train=(np.arange(6000) >= 3000).astype(float))
    assert _regress_force([masked, SLIDING[1]], SCALES) == pytest.approx(
        [50.0, 400.0, 600.0, 1500.0, 3000.0, -20.0]
    )


def test_only_samples_above_three_tenths_of_the_peak_speed_count_as_sliding():
    stroke = SLIDING_STROKES[0]
    slow = np.abs(stroke.velocity) < 0.299 * np.abs(stroke.velocity).max()
    force = np.where(slow, 1e4, linear_force(stroke))
    assert _regress_force([piece_of(stroke, force)], SCALES) == pytest.approx(
        [50.0, 400.0, 600.0, 1500.0, 3000.0, -20.0]
    )
    slightly_faster = np.abs(stroke.velocity) < 0.32 * np.abs(stroke.velocity).max()
    found = _regress_force([piece_of(stroke, np.where(slightly_faster, 1e4, linear_force(stroke)))], SCALES)
    assert abs(found[0] - 50.0) > 1.0


def test_a_long_recording_is_thinned_and_gives_the_same_coefficients():
    long = sine(0.01, 2.0, seconds=60.0)
    assert _regress_force([piece_of(long, linear_force(long))], SCALES) == pytest.approx(
        [50.0, 400.0, 600.0, 1500.0, 3000.0, -20.0]
    )


def test_samples_after_a_step_of_the_drive_are_not_used():
    """The force follows each step 30 ms late: the time in which the field of this recording settles."""
    spoilt = []
    for stroke in SLIDING_STROKES:
        drive = stroke.sampled_drive
        late = np.concatenate([np.full(30, drive[0]), drive[:-30]])
        spoilt.append(piece_of(stroke, linear_force(replace(stroke, drive=late))))
    assert _regress_force(spoilt, SCALES) == pytest.approx(COEFFICIENTS)


def test_a_drive_that_never_settles_is_used():
    stroke = replace(SHORT, drive=0.25 + 0.25 * np.sin(400.0 * np.arange(len(SHORT.drive)) / 1000.0))
    assert _regress_force([piece_of(stroke, linear_force(stroke))], SCALES)[0] == pytest.approx(50.0)


SPACE = SearchSpace(0.0, 0.5, SCALES)


def test_the_first_start_has_the_coefficients_of_the_regression():
    c = _make_sliding_start(_regress_force(SLIDING, SCALES), SPACE)
    assert c == pytest.approx(
        (50.0, 400.0, 8e-5, 0.5, 1.7, 200.0, 600.0, 1500.0, 7200.0, 18000.0, 2100.0, 900.0, 20.0)
    )


def test_the_first_start_has_at_least_a_fiftieth_of_the_peak_force():
    c = _make_sliding_start(np.array([-50.0, 400.0, 600.0, 0.0, 3000.0, -20.0]), SPACE)
    assert (c.F_a, c.F_a + 0.5 * c.F_b) == pytest.approx((0.02 * 10.0, 150.0))
    assert c.c0_a == pytest.approx(600.0)


def test_least_damping_is_that_of_the_regression_or_a_fiftieth_of_the_unit():
    assert estimate_least_damping(SLIDING, SCALES) == pytest.approx(600.0)
    negative = [piece_of(s, linear_force(s, -1.0)) for s in SLIDING_STROKES]
    assert estimate_least_damping(negative, SCALES) == pytest.approx(40.0)


def test_the_low_slip_start_shares_the_peak_force():
    c = _make_low_slip_start(_regress_force(SLIDING, SCALES), SPACE)
    assert (c.F_a, c.F_b) == pytest.approx((0.8 * 110.0, 0.8 * 275.0 / 0.5))
    assert (c.c0_a, c.c0_b) == pytest.approx((220.0, 1100.0))
    assert (c.c1_a, c.c1_b) == pytest.approx((6.0 * 220.0, 6.0 * 1100.0))
    assert (c.D_y, c.k0, c.k1, c.f0) == pytest.approx((2e-4, 2100.0, 900.0, 20.0))


def test_scales_are_those_of_the_fitted_samples():
    stroke, used = SLIDING_STROKES[0], (np.arange(6000) < 3000).astype(float)
    force = np.where(used > 0, linear_force(stroke), 1e6)
    scales = measure_scales([replace(piece_of(stroke, force), train=used), replace(SLIDING[1], train=0.0 * used)])
    assert scales.force == pytest.approx(linear_force(stroke)[:3000].std())
    assert (scales.length, scales.velocity, scales.sampling_rate) == pytest.approx(
        (0.01, 0.04 * np.pi, 1000.0), rel=1e-3
    )
    assert (scales.rate, scales.stiffness, scales.damping) == pytest.approx(
        (4.0 * np.pi, scales.force / 0.01, scales.force / (0.04 * np.pi)), rel=1e-3
    )


def test_a_drift_is_held_after_the_last_fitted_sample_of_the_run():
    late = replace(SLIDING_STROKES[0], start=20.0)
    used = (np.arange(6000) < 3000).astype(float)
    scales = measure_scales([SLIDING[1], replace(piece_of(late), train=used)])
    model = EffectModel(EFFECTS["force_drift"], "harmonic", scales.damper_size)
    low, high = model.get_bounds()
    assert scales.duration == pytest.approx(23.0)
    assert (np.exp(low[-1]), np.exp(high[-1])) == pytest.approx((23.0, 23.0))


def test_the_scales_of_a_recording_at_rest_can_be_divided_by():
    rest = replace(SHORT, displacement=0.0 * SHORT.displacement, velocity=0.0 * SHORT.velocity)
    scales = measure_scales([piece_of(rest)])
    assert np.isfinite([scales.rate, scales.stiffness, scales.damping]).all()


def test_a_random_start_moves_coordinates_alone_by_at_most_the_factor():
    problem = problem_of(*SLIDING)
    start = problem.make_start(LABORATORY)
    moves = np.array([draw_random_start(problem, start, 3.0, seed) - start for seed in range(40)])
    assert not moves[:, 13:].any()
    assert np.log(3.0) * 0.9 < np.abs(moves[:, 0]).max() <= np.log(3.0)
    assert np.log(3.0) * 0.09 < np.abs(moves[:, 12]).max() <= np.log(3.0) * 0.1
    assert moves[:, 0].min() < 0.0 < moves[:, 0].max()


def test_priors_hold_the_delays_and_keep_y_near_the_stroke():
    problem = problem_of(*SLIDING)
    centre, weight = problem._compute_priors()
    assert weight[13:15] == pytest.approx([1.0, 1.0])
    assert weight[15:] == pytest.approx([1.0, 1.0])
    assert centre == pytest.approx(np.zeros(17), abs=1e-3)
    shifted = piece_of(replace(SHORT, displacement=SHORT.displacement + 0.02))
    assert problem_of(shifted)._compute_priors()[0][15] == pytest.approx(2.0)
    assert problem_of(shifted).make_start(LABORATORY)[15] == pytest.approx(2.0)


def test_the_size_of_a_step_is_that_of_its_coordinates_and_a_tenth_of_the_effects():
    problem = problem_of(piece_of(SHORT), effects=(CONTACT,))
    step = np.zeros(problem.layout.size)
    step[13:16] = 9.0
    assert problem.measure_step(step) == 0.0
    step[4] = -0.3
    assert problem.measure_step(step) == pytest.approx(0.3)
    step[16] = -5.0
    assert problem.measure_step(step) == pytest.approx(0.5)
    step[17] = 0.7
    assert problem.measure_step(step) == pytest.approx(0.7)


@pytest.mark.parametrize(("distance", "interior"), [(5e-10, False), (5e-9, True), (-1.0, False)])
def test_an_unknown_at_a_bound_is_not_interior(distance, interior):
    problem = problem_of(piece_of(SHORT), delay_limit=3.0)
    low, high = problem.get_bounds()
    unknowns = problem.make_start(LABORATORY)
    for bound, sign in ((low, 1.0), (high, -1.0)):
        for k in (4, 13):
            moved = unknowns.copy()
            moved[k] = bound[k] + sign * distance
            assert problem.find_interior(moved)[k] == interior
    assert (low[13], high[14]) == (-3.0, 3.0)


def test_delays_are_counted_in_deviations_and_add_to_the_known_ones():
    problem = problem_of(piece_of(SHORT, force_delay=1e-3, drive_delay=2e-3))
    unknowns = problem.make_start(LABORATORY)
    unknowns[13:16] = 2.0, -1.0, 0.3
    model = problem.make_model(unknowns, 0)
    assert (model.force_delay, model.drive_delay, model.y0) == pytest.approx((1.04e-3, 1.98e-3, 3e-3))
    same = make_piece_model(problem.pieces[0], LABORATORY, (4e-5, -2e-5), 3e-3, ())
    assert (same.force_delay, same.drive_delay, same.y0) == pytest.approx((1.04e-3, 1.98e-3, 3e-3))


def test_the_cost_counts_squared_errors_in_noise_and_priors():
    problem = problem_of(piece_of(SHORT, recorded(LABORATORY, SHORT, 1)))
    unknowns = problem.make_start(LABORATORY)
    here = problem.evaluate(unknowns)
    errors = (problem.simulate(unknowns)[0] - problem.pieces[0].force) / NOISE
    assert here.cost == pytest.approx(float(errors @ errors))
    assert problem.compute_cost(unknowns) == pytest.approx(here.cost)
    unknowns[13] = 2.0
    errors = (problem.simulate(unknowns)[0] - problem.pieces[0].force) / NOISE
    assert problem.evaluate(unknowns).cost == pytest.approx(float(errors @ errors) + 4.0)
    assert problem.compute_cost(unknowns) == pytest.approx(float(errors @ errors) + 4.0)


def test_decimation_thins_faster_recordings_more():
    slow = replace(SHORT, rate=500.0)
    thinned = problem_of(piece_of(SHORT), piece_of(slow)).decimate(4)
    assert [p.excitation.rate for p in thinned.pieces] == [250.0, 250.0]
    assert [len(p.force) for p in thinned.pieces] == [250, 500]
    thinned = problem_of(piece_of(SHORT), piece_of(slow)).decimate(2)
    assert [p.excitation.rate for p in thinned.pieces] == [500.0, 500.0]


def test_a_decimated_piece_keeps_the_delay_of_its_filter():
    low_pass = LowPass(ChannelFilter("butterworth", 2, 100.0), 1000.0, 4)
    thin = piece_of(SHORT, np.arange(1000.0), force_delay=1e-3, low_pass=low_pass).decimate(3)
    assert thin.low_pass is None
    assert thin.force_delay == pytest.approx(1e-3 + 1.0 / (2 * np.pi * 100.0 * np.sin(np.pi / 4)))
    np.testing.assert_array_equal(thin.force[:3], [0, 3, 6])
    assert len(thin.force) == len(thin.train) == len(thin.excitation.displacement)
    assert thin.backlash_oversampling == 8
    assert piece_of(SHORT, backlash_oversampling=2).decimate(3).backlash_oversampling == 6


@pytest.mark.parametrize(
    ("order", "cutoff", "delay"), [(1, 100.0, 1.5915e-3), (2, 50.0, 4.5016e-3), (4, 200.0, 2.0795e-3)]
)
def test_a_butterworth_filter_delays_slow_signals(order, cutoff, delay):
    assert compute_filter_delay(ChannelFilter("butterworth", order, cutoff)) == pytest.approx(delay, rel=1e-3)
    assert compute_filter_delay(None) == 0.0
    # A first-order filter behind a ramp lags by its delay.
    ramp = np.arange(4000.0) / 1000.0
    both = LowPass(ChannelFilter("butterworth", order, cutoff), 1000.0).apply(np.column_stack([ramp, ramp + 5.0]))
    assert both[-1, 0] == pytest.approx(ramp[-1] - delay, abs=1e-5)
    assert both[:, 1] == pytest.approx(both[:, 0] + 5.0)


@pytest.mark.parametrize("samples", [40, 41])
def test_a_filter_treats_every_series_of_a_table_as_if_it_were_alone(samples):
    low_pass = LowPass(ChannelFilter("butterworth", 2, 100.0), 1000.0, oversampling=4)
    table = np.random.default_rng(3).standard_normal((samples, 3))
    alone = np.stack([low_pass.apply(table[:, k]) for k in range(3)], axis=1)
    assert alone.shape == table[::4].shape
    np.testing.assert_array_equal(low_pass.apply(table), alone)


@pytest.mark.parametrize(("rate", "oversampling"), [(1000.0, 4), (4000.0, 1), (8000.0, 1), (500.0, 8)])
def test_a_filtered_force_is_simulated_at_four_kilohertz(rate, oversampling):
    given = stretch(np.zeros(10), rate=rate)
    assert _make_low_pass(given) is None
    filtered = replace(given, force_filter=ChannelFilter("butterworth", 2, 100.0))
    assert _make_low_pass(filtered).oversampling == oversampling


def test_delays_are_relative_to_the_displacement_and_its_filter():
    given = replace(
        stretch(np.zeros(10)), force_delay=5e-3, displacement_delay=1e-3, drive_delay=4e-3,
        displacement_filter=ChannelFilter("butterworth", 1, 1000.0 / (2 * np.pi)),
    )  # fmt: skip
    piece = _make_piece(given, Excitation(1000.0, *np.zeros((4, 10))), np.arange(10) > 4)
    assert (piece.force_delay, piece.drive_delay) == pytest.approx((3e-3, -2e-3))
    np.testing.assert_array_equal(piece.train, [0, 0, 0, 0, 0, 1, 1, 1, 1, 1])


def clock(bound, *channels, key="clock_error_bound_s"):
    return json.dumps({"channels": channels, key: bound})


@pytest.mark.parametrize(
    ("records", "error"),
    [
        ({}, 0.0),
        ({"a": clock(4e-5, "force")}, 0.0),
        ({"a": clock(3e-4, "force"), "b": clock(4e-4, "displacement")}, 2.5e-4),
        ({"a": clock(3e-4, "force"), "b": clock(1e-5, "coil_current"), "c": clock(4e-4, "displacement")}, 2.5e-4),
        ({"a": clock(3e-4, "force"), "b": clock(4e-4, "temperature")}, 0.0),
        ({"a": clock(3e-4, "force", key="skew_s"), "b": clock(4e-4, "coil_voltage")}, 2.5e-4),
        ({"a": "for a person", "b": clock(4e-4, "force"), "c": "[1]"}, 0.0),
    ],
)
def test_a_delay_is_as_uncertain_as_the_two_worst_clocks(records, error):
    assert _combine_clock_errors(records) == pytest.approx(error)


def log(source, rates=(1000.0,), **metadata):
    stretches = tuple(stretch(np.zeros(10), rate=rate) for rate in rates)
    return Recording(Path("x.mcap"), "0", "coil_v", "V", stretches, {"run": {"source": source}, **metadata})


def test_an_imported_log_knows_a_delay_to_half_its_shortest_sample():
    assert _estimate_clock_error(log("import", (1000.0, 500.0))) == pytest.approx(5e-4)
    assert _estimate_clock_error(log("run")) == pytest.approx(20e-6)
    bounds = {"a": clock(3e-4, "force"), "b": clock(4e-4, "displacement")}
    assert _estimate_clock_error(log("run", clock_error_bounds=bounds)) == pytest.approx(2.5e-4)
    assert _estimate_clock_error(log("run", clock_skew=bounds)) == pytest.approx(2.5e-4)
    assert _estimate_clock_error(log("run", clocks=bounds)) == pytest.approx(2.5e-4)


def test_held_out_are_named_stretches_named_segments_or_the_end():
    parts = (
        Segment(0, "slow_1", 0, 4, "sine", 0.01, 1.0, 0.1),
        Segment(1, "fast_1", 4, 8, "sine", 0.01, 2.0, 0.1),
    )
    given = stretch(np.zeros(10), segments=parts)
    for hold_out, expected in (
        (HoldOut(), []),
        (HoldOut(("fast*", "none")), [4, 5, 6, 7]),
        (HoldOut(("none", "synth*")), range(10)),
        (HoldOut(after_fraction=0.76), [8, 9]),
        (HoldOut(("slow*",), 0.9), [0, 1, 2, 3, 9]),
    ):
        np.testing.assert_array_equal(np.flatnonzero(hold_out.make_mask(given)), expected)


@pytest.mark.parametrize(("excluded", "kept"), [(5, False), (6, True)])
def test_disturbed_samples_are_excluded_unless_they_are_most_of_a_stretch(excluded, kept):
    notes = []
    given = replace(stretch(np.zeros(10)), force_valid=np.arange(10) != 9)
    found = _exclude_unresolved(given, np.arange(10) < excluded, 0.5, notes)
    np.testing.assert_array_equal(found.valid_mask, (np.arange(10) != 9) & (kept | (np.arange(10) >= excluded)))
    assert ("record again" in notes[0]) == kept
    assert f"{excluded * 10:.2f}%" in notes[0]


def test_a_hold_out_must_match_something_and_leave_200_samples():
    masks = [np.zeros(300, bool), np.arange(300) < 5]
    enough, few = (SimpleNamespace(train=np.arange(300) < count) for count in (200, 199))
    _check_hold_out(HoldOut(("a",)), masks, [enough])
    with pytest.raises(UnusableDataError, match="199 samples remain for the fit, fewer than 200"):
        _check_hold_out(HoldOut(("a",)), masks, [few])
    with pytest.raises(UnusableDataError, match="--hold-out a matches no stretch"):
        _check_hold_out(HoldOut(("a",)), masks[:1], [enough])
    _check_hold_out(HoldOut(), masks[:1], [enough])


def test_logs_with_different_drives_are_refused():
    with pytest.raises(UnusableDataError, match=r"different ways \(coil_a, coil_v\)"):
        assemble([log("run"), replace(log("run"), drive_kind="coil_a")])


def test_errors_are_root_mean_squares_over_all_samples_or_per_drive():
    error, force = np.array([3.0, -4.0]), np.array([-10.0, 10.0])
    assert compute_rmse(error) == pytest.approx(12.5**0.5)
    assert np.isnan(compute_rmse(np.zeros(0)))
    assert compute_nrmse(error, force) == pytest.approx(12.5**0.5 / 10.0)
    drives = [np.repeat([0.1, 0.5], 50), np.repeat(0.5, 100)]
    errors = [np.repeat([3.0, 4.0], 50), np.repeat(-2.0, 100)]
    first, second = compute_drive_errors(drives, errors, [np.tile([-10.0, 10.0], 50)] * 2, "V")
    assert (first.drive, first.rmse_n, first.nrmse, first.samples) == pytest.approx((0.1, 3.0, 0.3, 50))
    assert (second.drive, second.rmse_n, second.samples) == pytest.approx((0.5, (1200 / 150) ** 0.5, 150))


def test_a_log_correction_shifts_the_preload_and_scales_all_damping():
    correction = LogCorrection.from_unknowns({"offset": 0.5, "viscosity": -1.0})
    factor = np.exp(-0.3)
    assert (correction.offset, correction.viscosity) == pytest.approx((10.0, factor))
    c = correction.apply(LABORATORY)
    assert (c.f0, c.c0_a, c.c1_b, c.k0) == pytest.approx((26.0, 700 * factor, 26e3 * factor, 2200.0))
    rows = correction.apply_chain_rule(np.ones((2, 16)))
    assert rows[0] == pytest.approx([1, 1, 1, 1, 1, 1, factor, factor, factor, factor, 1, 1, 1, 1, 1, 1])
    offset, viscosity = PER_LOG_PARAMETERS["offset"], PER_LOG_PARAMETERS["viscosity"]
    assert offset.value(0.5, 0.1) == pytest.approx((10.0, 2.0))
    assert viscosity.value(-1.0, 0.1) == pytest.approx((factor, factor * 0.03))
    assert offset.differentiate(LABORATORY)[12] == pytest.approx(20.0)
    assert viscosity.differentiate(LABORATORY)[[6, 9]] == pytest.approx([210.0, 7800.0])


@pytest.mark.parametrize(
    ("rate", "samples", "factor"),
    [(1000.0, 40_000, 4), (1000.0, 29_999, 2), (1000.0, 19_999, 1), (499.0, 90_000, 1), (500.0, 90_000, 2)],
)
def test_a_preview_takes_25_samples_a_unit_of_time_and_ten_thousand_samples(rate, samples, factor):
    problem = SimpleNamespace(
        pieces=[SimpleNamespace(excitation=SimpleNamespace(rate=r)) for r in (rate, 100.0)],
        space=SPACE,
        samples=samples,
        decimate=lambda n: n,
    )
    assert _decimate_for_preview(problem) == (factor if factor > 1 else problem)


class Parabola:
    """Problem with a parabola as its cost; its second unknown is the delay."""

    free_mask, delay_mask = np.ones(2, bool), np.array([False, True])
    noise, samples = 1.0, 100

    def __init__(self, centre, hessian=((4.0, 1.0), (1.0, 2.0)), low=-10.0, high=10.0):
        self._centre, self._hessian = np.array(centre), np.array(hessian)
        self._bounds = np.full(2, low), np.full(2, high)

    def evaluate(self, unknowns):
        d = unknowns - self._centre
        return Evaluation(100.0 + float(d @ self._hessian @ d), self._hessian, self._hessian @ d)

    def get_bounds(self):
        return self._bounds

    def measure_step(self, step):
        return float(np.abs(step).max())


@pytest.mark.parametrize(
    ("centre", "bounds", "step"),
    [
        ((1.0, -0.5), (-10.0, 10.0), (1.0, -0.5)),
        ((3.0, 1.0), (-10.0, 10.0), (1.5, 0.5)),
        # With the first unknown at 0.4 the second follows by 0.6 / 2.
        ((1.0, -0.5), (-10.0, 0.4), (0.4, -0.2)),
        ((-1.0, 0.5), (-0.4, 10.0), (-0.4, 0.2)),
    ],
)
def test_a_step_is_bounded_and_the_other_unknowns_follow(centre, bounds, step):
    problem = Parabola(centre, low=bounds[0], high=bounds[1])
    here = problem.evaluate(np.zeros(2))
    assert solve_bounded_step(problem, here, np.ones(2, bool), np.zeros(2), np.zeros(2)) == pytest.approx(step)


def test_damping_shortens_a_step_and_a_fixed_unknown_stays():
    problem = Parabola((1.0, -0.5))
    here = problem.evaluate(np.zeros(2))
    fixed = solve_bounded_step(problem, here, np.array([True, False]), np.array([3.0, 0.0]), np.zeros(2))
    assert fixed == pytest.approx([3.5 / 7.0, 0.0])


def test_there_is_no_step_from_a_point_where_the_simulation_diverges():
    problem = Parabola((1.0, -0.5))
    diverged = Evaluation(np.inf, np.array([[0.0, 0.0], [0.0, np.nan]]), np.array([np.nan, 1.0]))
    step = solve_bounded_step(problem, diverged, np.ones(2, bool), np.full(2, np.nan), np.zeros(2))
    assert step.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("centre", [(1.0, -0.5), (8.0, 6.0), (0.0, 3.0)])
def test_a_parabola_is_minimised_with_the_delays_freed_at_its_end(centre):
    reports = []
    found = minimise(Parabola(centre), np.zeros(2), 60, lambda name, error: reports.append((name, error)))
    assert found.converged
    assert found.unknowns == pytest.approx(centre, abs=0.05)
    assert reports[-1] == ("refine", pytest.approx(1.0, rel=1e-3))
    assert not minimise(Parabola((8.0, 6.0)), np.zeros(2), 3, ignore_progress).converged


def test_every_effect_has_a_search_space_that_contains_its_starts():
    for effect in EFFECTS.values():
        for form in effect.forms:
            model = EffectModel.from_name(effect.name, form.name)
            for start in form.starts:
                assert model.to_values(model.to_search(start)) == pytest.approx(start, abs=1e-12)
