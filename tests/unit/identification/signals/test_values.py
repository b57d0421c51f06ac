"""Estimates of motion and noise against numbers computed by hand."""

from dataclasses import replace

import numpy as np
import pytest

from identification.logs.recording import Segment
from identification.signals.actuator_compliance import (
    _fit_lag_gains,
    _smooth_triangular,
    estimate_compliance_motion,
)
from identification.signals.cutoff import choose_cutoffs, find_distortions, limit_length_slope
from identification.signals.harmonics import (
    Harmonics,
    _differentiate_by_phase,
    _find_cycle_run,
    _find_disturbances,
    _fit_significant,
    _make_basis,
    _regress,
    _select_harmonics,
    find_steady_cycles,
    fit_harmonics,
)
from identification.signals.motion import (
    _compute_unexplained,
    _count_overlap,
    _cut_wave,
    _is_continued,
    _join_segments,
    _make_expected_differences,
    _raise_end_cutoffs,
    estimate_displacement_noise,
    estimate_motion,
)
from identification.signals.motion_regions import (
    REST_CUTOFF,
    _find_runs,
    _label_regions,
    _mark_around,
    _widen,
    divide_stretch,
    find_disturbances,
)
from identification.signals.smoother import compute_penalty
from tests.support.strokes import recorded, sine, sine_segment, stretch

RATE = 1000.0


def cosine(order, amplitude=1.0, count=1000, cycles=5):
    """Return harmonics of a whole number of cycles."""
    return amplitude * np.cos(2.0 * np.pi * cycles * order * np.arange(count) / count)


def test_a_basis_holds_offset_slope_and_waves_about_the_first_position():
    basis = _make_basis(np.arange(-4.0, 4.0), 2, 1.0 / 8.0)
    angle = 2.0 * np.pi * np.arange(-4.0, 4.0) / 8.0
    rows = [
        np.ones(8),
        np.arange(-4.0, 4.0) / 4.0,
        np.cos(angle),
        np.sin(angle),
        np.cos(2 * angle),
        np.sin(2 * angle),
    ]
    np.testing.assert_allclose(basis, rows, atol=1e-12)
    np.testing.assert_allclose(_make_basis(np.array([0.5, 3.0]), 0, 0.1)[1], [0.5, 3.0])


def test_amplitudes_are_those_of_the_weighted_samples():
    basis = _make_basis(np.arange(-50.0, 50.0), 1, 0.02)
    values = np.array([1.0, 2.0, 3.0, -4.0]) @ basis
    values[::7] = 99.0
    assert _regress(basis, values, (np.arange(100) % 7 > 0).astype(float)) == pytest.approx([1.0, 2.0, 3.0, -4.0])


def test_the_derivative_over_the_phase_is_that_of_a_small_shift():
    amplitudes = np.array([5.0, 6.0, 1.0, 2.0, -3.0, 4.0, 0.5, -0.6, 0.7, 0.8])
    position, step = np.arange(-30.0, 30.0), 0.03
    shift = 1e-6 / (2.0 * np.pi * step)
    ahead, back = (amplitudes[2:] @ _make_basis(position + s * shift, 4, step)[2:] for s in (1.0, -1.0))
    found = _differentiate_by_phase(_make_basis(position, 4, step), amplitudes)
    np.testing.assert_allclose(found, (ahead - back) / 2e-6, atol=1e-6)


@pytest.mark.parametrize(("ratio", "orders"), [(1.02, (1, 3)), (0.98, (1,))])
def test_a_harmonic_is_significant_at_four_times_the_power_of_noise(ratio, orders):
    # Noise of one leaves a power of 4 / N; the amplitude at the limit is 4 / sqrt(N).
    values = cosine(3, ratio * 4.0 / 1000**0.5)
    found, wave = _fit_significant(values, np.ones(1000), 4, 5 / 1000, 1.0)
    assert found == orders
    np.testing.assert_allclose(wave, values if len(orders) == 2 else 0.0, atol=2e-3)


@pytest.mark.parametrize(("order", "extended"), [(16, True), (15, False)])
def test_more_harmonics_are_tried_if_the_last_quarter_is_significant(order, extended):
    values = sum(cosine(k, 1.0, 4000, 4) for k in (1, order, 25))
    assert (25 in _select_harmonics(values, np.ones(4000), RATE, 1.0, 1e-3)[0]) == extended


@pytest.mark.parametrize(
    ("rate", "frequency", "highest"), [(1000.0, 7.0, 8), (100.0, 7.0, 2), (1000.0, 70.0, 1), (1000.0, 30.0, 2)]
)
def test_harmonics_end_at_sixty_hertz_and_at_a_fifth_of_the_rate(rate, frequency, highest):
    time = np.arange(4000) / rate
    values = sum(np.cos(2.0 * np.pi * frequency * k * time) for k in range(1, 10))
    assert _select_harmonics(values, np.ones(4000), rate, frequency, 1e-3)[0] == tuple(range(1, highest + 1))


@pytest.mark.parametrize(("size", "found"), [(6.1, True), (5.9, False)])
@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_disturbance_is_six_deviations_off_the_wave(size, found, noise):
    deviation = np.tile([1.0, -1.0], 50) * (0.6745 if not noise else 0.1)
    deviation[40] = -size
    disturbed = _find_disturbances(deviation, slice(0, 100), np.ones(100), noise)
    np.testing.assert_array_equal(np.flatnonzero(disturbed), [40] if found else [])


def test_the_deviation_is_measured_in_the_part_and_where_weights_are():
    deviation = np.r_[np.full(50, 100.0), np.full(50, 1.0), np.full(50, 100.0)]
    weights = (np.arange(150) < 100).astype(float)
    assert _find_disturbances(deviation, slice(50, 150), weights, 0.1).sum() == 100
    assert _find_disturbances(deviation, slice(100, 150), weights, 1.0).sum() == 100


@pytest.mark.parametrize(
    ("count", "unsteady", "run"),
    [
        (1000, (), (0, 1000)),
        (1000, (720, 780), (0, 1000)),
        (1000, (700, 1000), (0, 700)),
        (1000, (0, 260), (300, 1000)),
        (1200, (700, 1000), (0, 1200)),
        (1400, (800, 1300), (0, 800)),
        (1040, (0, 10), (20, 1040)),
    ],
)
@pytest.mark.parametrize("as_disturbance", [False, True])
def test_a_stroke_is_steady_up_to_three_unsteady_cycles_in_a_row(count, unsteady, run, as_disturbance):
    deviation, disturbed = np.zeros(count), np.zeros(count, bool)
    if unsteady and as_disturbance:
        disturbed[slice(*unsteady)] = True
    elif unsteady:
        deviation[slice(*unsteady)] = 1.0
    if as_disturbance and unsteady in ((720, 780), (0, 10)):
        run = (0, count) if unsteady == (0, 10) else run
    assert _find_cycle_run(deviation, disturbed, 100.0, 0.3) == run


@pytest.mark.parametrize(("size", "steady"), [(0.99, True), (1.01, False)])
def test_a_cycle_is_steady_up_to_the_limit_of_its_undisturbed_samples(size, steady):
    deviation, disturbed = np.full(400, 0.1), np.zeros(400, bool)
    deviation[300:] = size
    disturbed[310:350] = True
    deviation[310:350] = 50.0
    assert _find_cycle_run(deviation, disturbed, 100.0, 1.0)[1] == (400 if steady else 300)


@pytest.mark.parametrize(("count", "found"), [(1999, False), (2001, True)])
def test_two_cycles_are_needed(count, found):
    values = 0.01 * np.sin(2.0 * np.pi * np.arange(count) / 1000.0)
    assert (find_steady_cycles(values, np.ones(count), RATE, 1.0, 1e-6) is not None) == found


def test_a_disturbance_is_reported_in_its_size_and_the_wave_without_it():
    values, _ = sine(0.01, 2.0)
    values[3000:3080] += 4e-4
    found = fit_harmonics(values, np.ones(len(values)), RATE, 2.0, 1e-6)
    assert np.median(found.disturbance[3010:3070]) == pytest.approx(4e-4, rel=0.02)
    assert not found.disturbance[:2900].any()
    assert found.values[3040] == pytest.approx(values[3040] - 4e-4, abs=5e-6)
    steady = find_steady_cycles(values, np.ones(len(values)), RATE, 2.0, 1e-6)
    assert (steady.start, steady.stop) == (0, len(values))
    assert len(steady.disturbance) == len(values)
    assert np.median(steady.disturbance[3010:3070]) == pytest.approx(4e-4, rel=0.02)


def test_edges_are_marked_within_the_stretch():
    np.testing.assert_array_equal(
        np.flatnonzero(_mark_around({2, 50, 99}, 100, 4)), [*range(6), *range(46, 54), *range(95, 100)]
    )
    np.testing.assert_array_equal(np.flatnonzero(_widen(np.arange(20) == 10, 3)), range(7, 14))
    assert [run.tolist() for run in _find_runs(np.array([1, 1, 0, 1, 0, 0, 1], bool))] == [[0, 1], [3], [6]]
    assert _find_runs(np.zeros(5, bool)) == []


def make_wave(start, stop, disturbance=0.0):
    return Harmonics(
        start, stop, 1.0, (1,), np.arange(float(stop - start)) ** 3, np.full(stop - start, disturbance)
    )


def test_regions_are_transitions_waves_parts_between_and_disturbances():
    found = _label_regions(
        [make_wave(2, 6), make_wave(8, 12)],
        np.isin(np.arange(14), [5, 8]),
        np.zeros(14, bool),
        [np.array([3]), np.array([10, 11])],
        shortest=2,
    )
    np.testing.assert_array_equal(found, [3, 3, 1, 6, 1, 0, 4, 4, 0, 2, 7, 7, 5, 5])


def test_a_rest_is_a_region_of_its_own_and_short_motion_beside_it_a_transition():
    rest = np.isin(np.arange(16), [5, 6, 7, 10, 11])
    found = _label_regions([make_wave(0, 3)], np.isin(np.arange(16), [3]), rest, [], shortest=3)
    np.testing.assert_array_equal(found, [1, 1, 1, 0, 0, 3, 3, 3, 0, 0, 4, 4, 2, 2, 2, 2])


def move_and_rest(rate=1000.0, noise=2e-6):
    """Displacement [m] of a rod that rests for a second, moves 5 mm within 0.2 s, and rests again."""
    time = np.arange(round(2.2 * rate)) / rate
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.clip((time - 1.0) / 0.2, 0.0, 1.0))
    return time, 0.005 * ramp, noise * np.random.default_rng(4).standard_normal(len(time))


def test_a_rest_is_smoothed_more_than_the_motion_beside_it():
    _, x, noise = move_and_rest()
    recorded = stretch(x + noise)
    motion = estimate_motion(recorded)
    error = motion.displacement - x
    resting, moving = np.r_[0:850, 1350:2200], slice(1000, 1200)
    assert motion.cutoff[resting].max() == REST_CUTOFF
    assert motion.cutoff[moving].min() > 2 * REST_CUTOFF
    assert np.std(error[resting]) < 0.2 * np.std(noise)
    assert np.std(error[moving]) < np.std(noise)


def test_the_smoothing_length_changes_gradually():
    cutoff = np.full(1000, 100.0)
    cutoff[300:700] = 10.0
    limited = limit_length_slope(cutoff, 1000.0)
    assert np.abs(np.diff(1.0 / limited)).max() == pytest.approx(0.25e-3)
    assert limited[500] == pytest.approx(1.0 / (0.01 + 0.25 * 0.2))
    assert np.all(limited > cutoff * (1.0 - 1e-12))
    np.testing.assert_allclose(limited[:300], 100.0, rtol=1e-12)


def test_a_move_between_two_strokes_is_not_distorted_where_its_cutoff_changes():
    """The cutoff of the part between is lower, and the motion is curved where it begins."""
    rate, noise = 2000.0, 1e-6
    time = np.arange(400) / rate
    curved = 2e-3 * np.sin(2.0 * np.pi * 8.0 * time) + 1e-3 * (time / 0.2) ** 2
    x = curved + noise * np.random.default_rng(3).standard_normal(400)
    cutoff = np.full(400, 83.0)
    cutoff[160:280] = 35.0
    recorded = replace(stretch(x), rate=rate, time=time)
    usual = estimate_motion(recorded)
    jump, gradual = (
        estimate_motion(recorded, usual._replace(cutoff=c)).displacement - curved
        for c in (cutoff, limit_length_slope(cutoff, rate))
    )
    inner = slice(100, 300)
    assert np.std(gradual[inner]) < noise < np.std(jump[inner])


def move_with_jump(count=6000, at=3000):
    """Slow motion [m] whose acceleration jumps at one sample, and noise of 1 µm."""
    time = np.arange(count) / 1000.0
    x = 0.01 * np.sin(2.0 * np.pi * 0.7 * time) + 10.0 * np.maximum(time - 0.001 * at, 0.0) ** 2
    return x, x + 1e-6 * np.random.default_rng(8).standard_normal(count)


def test_a_jump_of_the_acceleration_is_a_distortion_and_smooth_motion_is_none():
    cutoff = np.full(6000, 12.0)
    for x, expected in ((move_with_jump()[1], True), (move_with_jump(at=6000)[1], False)):
        found = find_distortions(x, np.ones(6000), np.zeros(5997), cutoff, 1000.0)
        assert found[2990:3010].any() == expected
        assert not found[100:2500].any()
        assert not found[3500:-100].any()


def test_the_motion_around_a_jump_of_the_acceleration_is_not_smoothed_away():
    x, recorded = move_with_jump()
    motion = estimate_motion(stretch(recorded))
    assert motion.cutoff[3000] > 2.0 * motion.cutoff[1000]
    assert np.abs(motion.displacement - x)[2900:3100].max() < 2e-6


def test_a_slow_stroke_is_no_rest():
    time = np.arange(4000) / 1000
    noise = 2e-6 * np.random.default_rng(5).standard_normal(4000)
    found = divide_stretch(stretch(0.001 * np.sin(2 * np.pi * time / 4) + noise), [], False, 2e-6)
    assert not found.rest.any()


def level(drive_step=None, seams=()):
    """A stretch of 1000 samples whose displacement has a deviation of one."""
    drive = np.zeros(1000) if drive_step is None else np.repeat([0.1, 0.4], [drive_step, 1000 - drive_step])
    return stretch(
        np.tile([1.0, -1.0], 500), drive=drive, segments=[sine_segment(a, b, 1.0, 1.0) for a, b in seams]
    )


@pytest.mark.parametrize(
    ("given", "size", "kept"),
    [
        (level(), 0.01, True),
        (level(drive_step=500), 0.01, False),
        (level(drive_step=500), 0.029, False),
        (level(drive_step=500), 0.031, True),
        (level(drive_step=531), 0.01, False),
        (level(drive_step=532), 0.01, True),
        (level(drive_step=470), 0.01, False),
        (level(drive_step=469), 0.01, True),
        (level(seams=[(100, 500), (500, 900)]), 0.01, False),
        (level(seams=[(100, 500)]), 0.01, True),
        (level(seams=[(500, 900)]), 0.01, True),
    ],
)
def test_a_small_departure_at_a_change_of_drive_or_stroke_is_no_disturbance(given, size, kept):
    deviation = np.zeros(1000)
    deviation[500:510] = size
    runs = find_disturbances(given, deviation)
    assert [(run[0], run[-1]) for run in runs] == ([(469, 540)] if kept else [])
    assert find_disturbances(given, np.zeros(1000)) == []


@pytest.mark.parametrize(("size", "unresolved"), [(0.0039, False), (0.0041, True)])
def test_a_disturbance_of_four_thousandths_of_the_stroke_is_unresolved(size, unresolved):
    wave = make_wave(100, 900)
    wave.disturbance[400:410] = size
    found = divide_stretch(level(), [wave], is_compliant=False, noise=0.0)
    np.testing.assert_array_equal(np.flatnonzero(found.disturbed), range(469, 541))
    np.testing.assert_array_equal(np.flatnonzero(found.unresolved), range(469, 541) if unresolved else [])
    np.testing.assert_array_equal(np.flatnonzero(found.regions == 0), [*range(69, 131), *range(869, 931)])
    assert found.regions[[0, 200, 500, 950]].tolist() == [2, 1, 4, 3]
    compliant = divide_stretch(level(), [wave], is_compliant=True, noise=0.0)
    assert compliant.regions[[0, 30, 31, 969, 968]].tolist() == [0, 0, 2, 0, 3]


def test_cutoffs_rise_by_half_towards_the_ends():
    found = _raise_end_cutoffs(np.full(41, 10.0), 100.0)
    np.testing.assert_allclose(found[[0, 5, 10, 20, 30, 35, 40]], [15.0, 12.5, 10.0, 10.0, 10.0, 12.5, 15.0])


def piece(start, stop, motion="sine", amplitude=0.01, frequency=2.0):
    return Segment(0, "s", start, stop, motion, amplitude, frequency, None)


@pytest.mark.parametrize(
    ("following", "continued"),
    [
        (piece(1000, 2000), True),
        (piece(1001, 2000), True),
        (piece(1002, 2000), False),
        (piece(1000, 30_000), True),
        (piece(1000, 30_001), False),
        (piece(1000, 2000, amplitude=0.011), False),
        (piece(1000, 2000, frequency=2.1), False),
        (piece(1000, 2000, motion="triangle"), False),
    ],
)
def test_a_stroke_continues_without_a_stop_for_at_most_thirty_seconds(following, continued):
    assert _is_continued((piece(0, 1000),), following, RATE) == continued


def test_only_periodic_segments_are_joined():
    segments = [
        piece(0, 500),
        piece(500, 900),
        piece(900, 950, "hold"),
        piece(950, 990, frequency=0.0),
        piece(990, 999),
    ]
    runs = _join_segments(replace(stretch(np.zeros(1000)), segments=tuple(segments)))
    assert [[s.start for s in run] for run in runs] == [[0, 500], [990]]


def test_a_wave_is_cut_to_a_segment():
    wave = make_wave(100, 200)
    cut = _cut_wave(wave, piece(150, 300))
    assert (cut.start, cut.stop, len(cut.disturbance)) == (150, 200, 50)
    np.testing.assert_array_equal(cut.values, wave.values[50:])
    assert [_count_overlap(wave, piece(*ends)) for ends in ((150, 300), (0, 120), (200, 300))] == [50, 20, 0]


def test_expected_differences_are_those_of_waves_and_of_compliance_inside():
    compliance = 2.0 * np.arange(50.0) ** 3
    found = _make_expected_differences(compliance, [make_wave(20, 30)], 5)
    expected = np.full(47, 12.0)
    expected[:5] = expected[-5:] = 0.0
    expected[20:27] += 6.0
    np.testing.assert_allclose(found, expected)


def test_noise_of_interpolated_or_missing_samples_is_found_from_every_other_one():
    noise = 3e-6 * np.random.default_rng(0).standard_normal(20_000)
    measured = np.arange(20_000) % 50 > 0
    noise[~measured] = 1.0
    for stride in (1, 2):
        assert estimate_displacement_noise(noise, measured, stride) == pytest.approx(3e-6, rel=0.03)
    cubic = (np.arange(300) / 300.0) ** 3
    assert estimate_displacement_noise(cubic, np.ones(300, bool), 2) < 1e-12


def test_a_damper_without_memory_explains_its_own_force():
    x, v = sine(0.01, 1.3)
    drive = np.repeat([0.2, 0.5], len(x) // 2)
    typical = np.std(v)
    force = (
        3.0
        + 20.0 * drive
        + 500.0 * x
        + (100.0 + 50.0 * drive) * v
        + (7.0 + 9.0 * drive) * np.tanh(v / (0.1 * typical))
    )
    given = stretch(x, force + 11.0 * drive * np.tanh(v / (0.5 * typical)), drive)
    assert _compute_unexplained(given, x, v) < 1e-9
    noisy = replace(given, force=given.force + 2.0 * np.random.default_rng(1).standard_normal(len(x)))
    assert _compute_unexplained(noisy, x, v) == pytest.approx(4.0, rel=0.05)


def test_a_triangle_of_weights_keeps_a_constant():
    impulse = np.zeros(11)
    impulse[5] = 9.0
    np.testing.assert_allclose(_smooth_triangular(impulse, 3), [0, 0, 0, 1, 2, 3, 2, 1, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(_smooth_triangular(np.full(8, 4.0), 3), 4.0)


def test_gains_of_lags_are_regressed_without_disturbances():
    random = np.random.default_rng(4)
    lagged = random.standard_normal((3, 2000))
    displacement = np.array([2.0, -1.0, 0.5]) @ lagged
    displacement[1000:1010] += 500.0
    gains, significance = _fit_lag_gains(lagged, displacement, 5)
    assert gains == pytest.approx([2.0, -1.0, 0.5], rel=1e-6)
    # Everything is explained: the share of one lies above the share of three gains in the samples.
    assert significance == pytest.approx((2000 - 10 - 10) / 3.0, rel=0.1)
    assert _fit_lag_gains(lagged, random.standard_normal(2000), 5)[1] < 4.0
    assert _fit_lag_gains(lagged, np.zeros(2000), 5)[1] == 0.0


def test_a_short_stretch_shows_no_compliance():
    x, v = sine(0.01, 20.0, 0.89)
    given = stretch(recorded(x - 1e-5 * np.sign(v), 1e-6), 300.0 * np.sign(v))
    assert not estimate_compliance_motion(given, np.ones(len(x)), 50.0).any()


@pytest.mark.parametrize(
    ("rate", "highest", "lowest"), [(100.0, 25.0, 0.3), (2000.0, 200.0, 6.0), (1e5, 600.0, None)]
)
def test_cutoffs_lie_between_the_band_of_strokes_and_three_thousandths_of_the_rate(rate, highest, lowest):
    random = np.random.default_rng(6).standard_normal(1200)
    regions = np.zeros(1200, np.intp)
    for noise, cutoff in ((0.0, highest), *([(1.0, lowest)] if lowest else [])):
        found = choose_cutoffs(random, np.ones(1200), np.zeros(1197), regions, rate, noise)
        assert found == pytest.approx([cutoff], rel=0.01 if noise == 0.0 else 0.9)


def test_each_region_has_its_own_cutoff():
    values = np.random.default_rng(6).standard_normal(2000)
    values[1000:] *= 1e-3
    regions = np.repeat(np.arange(2), 1000)
    found = choose_cutoffs(values, np.ones(2000), np.zeros(1997), regions, RATE, 1e-3)
    assert found[0] == pytest.approx(200.0)
    assert found[1] < 100.0


@pytest.mark.parametrize(("cutoff", "penalty"), [(500.0, 1.0 / 64.0), (1000.0 / 6.0, 1.0)])
def test_the_penalty_is_the_inverse_sixth_power_of_the_wave_of_a_difference(cutoff, penalty):
    assert compute_penalty(cutoff, RATE) == pytest.approx(penalty)
