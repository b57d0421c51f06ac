"""Checks of a recording and its invalid samples, at each limit and just beside it."""

from dataclasses import replace

import numpy as np
import pytest

from identification.errors import UnusableDataError
from identification.logs.recording import Segment
from identification.signals.data_quality import (
    _check_force,
    _check_motion,
    _check_passivity,
    _check_sampling,
    _clean_stretch,
    _describe_limitations,
    _mask_clipped_force,
    describe_outlier_logs,
)
from identification.signals.drive import average_drive_levels, bin_drive, find_drive_steps
from identification.signals.invalid_samples import (
    find_clipped_runs,
    find_clipping,
    find_jumps,
    find_spikes,
    find_stuck_force,
    interpolate_invalid,
)
from identification.signals.noise import estimate_deviation, estimate_white_noise
from tests.support.strokes import stretch

T = np.arange(4000) / 1000.0
NOISE = np.random.default_rng(3).standard_normal(4000)
RAMP = np.arange(1000.0)


@pytest.mark.parametrize(
    ("amplitude", "noise", "stands_still"),
    [(5e-6, 1e-6, True), (2e-5, 1e-6, False), (1e-4, 2e-5, False), (2e-5, 2e-5, True), (1e-6, 0.0, False)],
)
def test_a_damper_moves_above_twenty_times_the_noise_or_a_fifth_of_a_millimetre(amplitude, noise, stands_still):
    given = stretch(amplitude * np.sin(6.0 * T) + noise * NOISE)
    if stands_still:
        with pytest.raises(UnusableDataError, match="the damper stands still"):
            _check_motion([given])
    else:
        _check_motion([given])


def test_a_damper_at_rest_is_described_in_micrometres():
    x = 1e-6 * NOISE
    x[:2] = 9e-6, -9e-6
    with pytest.raises(UnusableDataError, match=r"varies by 18 µm with a noise of (0\.9\d|1) µm"):
        _check_motion([stretch(x)])


def test_the_largest_travel_and_the_smallest_noise_of_all_stretches_count():
    still, moving = stretch(1e-6 * NOISE), stretch(1e-2 * np.sin(6.0 * T) + 2e-4 * NOISE)
    _check_motion([still, moving])
    _check_motion([moving, still])


def wave(samples, size=0.01):
    return stretch(size * np.sin(2.0 * np.pi * np.arange(2000) / samples))


def test_a_cycle_needs_ten_samples():
    _check_sampling(wave(10.2))
    with pytest.raises(UnusableDataError, match=r"5 samples a cycle .* record at 2000 Hz or more, not at 1000 Hz"):
        _check_sampling(wave(5.0))
    with pytest.raises(UnusableDataError):
        _check_sampling(wave(9.8))
    with pytest.raises(UnusableDataError, match="2 samples a cycle"):
        _check_sampling(stretch(np.where(np.arange(201) % 2, 0.01, -0.01)))
    _check_sampling(stretch(np.zeros(100)))


def test_a_fast_wave_of_a_fiftieth_of_the_stroke_is_no_stroke():
    _check_motion([wave(100.0), wave(4.0, 1.9e-4)])
    with pytest.raises(UnusableDataError, match="samples a cycle"):
        _check_motion([wave(100.0), wave(4.0, 2.1e-4)])


@pytest.mark.parametrize(
    ("amplitude", "noise", "refused"),
    [(8.0, 1.0, False), (6.0, 1.0, True), (0.3, 0.0, False), (0.0, 0.0, True)],
)
def test_a_force_changes_above_five_times_its_noise(amplitude, noise, refused):
    given = stretch(np.zeros(4000), amplitude * np.sin(6.0 * T) + noise * NOISE)
    if refused:
        with pytest.raises(UnusableDataError, match="the force hardly changes"):
            _check_force([given])
    else:
        _check_force([given])


@pytest.mark.parametrize("correlation", [1.0, 0.0, -0.29, -0.31, -1.0])
def test_a_force_against_the_motion_has_the_wrong_sign(correlation):
    angle = 2.0 * np.pi * T
    force = 50.0 + 300.0 * (correlation * np.cos(angle) + (1 - correlation**2) ** 0.5 * np.sin(angle))
    given = stretch(0.01 * np.sin(angle), force)
    if correlation < -0.3:
        with pytest.raises(UnusableDataError, match=rf"correlation with the velocity {correlation:.2f}"):
            _check_passivity([given])
    else:
        _check_passivity([given])


def segment(amplitude, frequency):
    return Segment(0, "s", 0, 10, "sine", amplitude, frequency, 0.3)


@pytest.mark.parametrize(
    ("step", "strokes", "notes"),
    [
        (0.0, [(0.01, 1.0), (0.02, 1.0)], ["the drive never changes (0.3)"]),
        (5e-10, [(0.01, 1.0), (0.01, 2.0)], ["the drive never changes"]),
        (5e-9, [(0.01, 1.0), (0.0125, 1.5)], []),
        (0.1, [(0.0125, 1.5), (0.012501, 1.5)], ["all strokes are alike (12.5 mm, 1.5 Hz)"]),
        (0.1, [(None, 1.5)], []),
        (0.1, [(0.01, None)], []),
        (0.1, [], []),
    ],
)
def test_a_drive_or_a_stroke_that_never_changes_is_noted(step, strokes, notes):
    given = stretch(np.zeros(10), drive=0.3 + step * (np.arange(10) > 5), segments=[segment(*s) for s in strokes])
    found = _describe_limitations([given])
    assert len(found) == len(notes)
    assert all(expected in note for expected, note in zip(notes, found, strict=True))


@pytest.mark.parametrize(
    ("ratio", "worst", "noted"), [(1.3, 4.2, 1), (1.3, 3.9, 0), (1.19, 9.0, 0), (1.21, 9.0, 1)]
)
def test_a_log_with_twice_the_error_of_the_best_is_an_outlier(ratio, worst, noted):
    errors = [np.array([2.0, -2.0]), np.array([3.0]), np.full(4, -worst)]
    notes = describe_outlier_logs(["a", "b", "c"], errors, ratio)
    assert len(notes) == noted
    if noted:
        assert notes[0].startswith(f"c: force error {worst:.3g} N, {worst / 2:.2g} times that of the best log")
    assert describe_outlier_logs(["a", "a", "a"], errors, ratio) == []


def test_the_error_of_a_log_is_that_of_all_its_stretches():
    errors = [np.full(1, 2.0), np.full(3, 6.0), np.full(1, 2.0)]
    (note,) = describe_outlier_logs(["a", "b", "b"], errors, 2.0)
    assert note.startswith("b: force error 5.29 N")


@pytest.mark.parametrize(("clipped", "refused"), [(200, False), (201, True)])
def test_a_fifth_of_the_force_may_be_clipped(clipped, refused):
    force = np.minimum(RAMP, 1000.0 - clipped)
    notes = []
    given = replace(stretch(RAMP, force), force_valid=np.arange(1000) > 0)
    if refused:
        with pytest.raises(UnusableDataError, match=r"log: 20% of the force samples are clipped at 799 N"):
            _mask_clipped_force(given, "log", notes)
        with pytest.raises(UnusableDataError, match=r"log, synthetic: 20% of the force samples are clipped"):
            _clean_stretch(given, "log", notes)
        return
    found = _mask_clipped_force(given, "log", notes)
    assert np.count_nonzero(found.valid_mask) == 799
    assert "clipped at 800 N in 20.0% of the samples" in notes[0]
    assert np.count_nonzero(_clean_stretch(given, "log", notes).valid_mask) == 799
    assert "20.00% of the force samples are clipped at 800 N" in notes[1]


@pytest.mark.parametrize(("count", "clipped"), [(5, True), (4, False)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_five_samples_at_an_extreme_are_clipped(count, clipped, sign):
    force = RAMP.copy()
    force[500 : 500 + count] = 2000.0
    force[700] = 2000.0 - 5e-7
    force[800] = 2000.0 - 5e-5
    expected = np.zeros(1000, bool)
    if clipped:
        expected[[*range(500, 500 + count), 700]] = True
    np.testing.assert_array_equal(find_clipping(sign * force), expected)
    assert not find_clipping(np.full(1000, 3.0)).any()


@pytest.mark.parametrize(("count", "clipped"), [(5, True), (4, False)])
@pytest.mark.parametrize("limit", [2000.0, -2000.0])
def test_a_run_at_an_extreme_shows_that_single_samples_there_are_clipped_as_well(count, clipped, limit):
    force = RAMP.copy()
    force[500 : 500 + count] = force[700] = limit
    expected = np.zeros(1000, bool)
    if clipped:
        expected[[*range(500, 500 + count), 700]] = True
    np.testing.assert_array_equal(find_clipped_runs(force), expected)
    assert not find_clipped_runs(np.full(1000, 3.0)).any()


def test_the_range_of_the_force_does_not_matter():
    force = np.minimum(RAMP / 990.0, 1.0)
    np.testing.assert_array_equal(np.flatnonzero(find_clipped_runs(force)), range(990, 1000))
    np.testing.assert_array_equal(np.flatnonzero(find_clipping(1e-3 * force)), range(990, 1000))


@pytest.mark.parametrize(("run", "clipped"), [(21, True), (19, False)])
def test_a_run_counts_from_five_times_the_usual_one(run, clipped):
    coarse = np.repeat(np.arange(250.0), 4)
    force = np.concatenate([coarse, np.full(run, 300.0), coarse])
    assert find_clipped_runs(force).any() == clipped


@pytest.mark.parametrize(
    ("count", "value", "speed", "stuck"),
    [(20, 0.5, 1e-5, True), (19, 0.5, 1e-5, False), (20, 2000.0, 1e-5, False), (20, -1.0, 1e-5, False),
     (20, 0.5, 0.0, False)],
)  # fmt: skip
def test_a_force_is_stuck_for_twenty_samples_between_its_extremes_while_the_rod_moves(count, value, speed, stuck):
    force, x = RAMP + 1.0, 1e-3 * np.sin(RAMP)
    force[500 : 500 + count] = value
    force[[0, 1]] = (-0.5, 1999.0) if value == 0.5 else (0.5, 1.5)
    x[500:520] = 1e-4 + speed * np.arange(20)
    assert find_stuck_force(stretch(x, force)).any() == stuck
    if stuck:
        np.testing.assert_array_equal(np.flatnonzero(find_stuck_force(stretch(x, force))), range(500, 520))


def test_a_stuck_force_needs_a_travel_of_a_fiftieth_of_the_stroke():
    force = RAMP.copy()
    force[500:520] = 0.5
    for travel, stuck in ((0.019, False), (0.021, True)):
        x = np.zeros(1000)
        x[600], x[500:520] = 1.0, np.linspace(0.0, travel, 20)
        assert find_stuck_force(stretch(x, force)).any() == stuck


@pytest.mark.parametrize(("size", "found"), [(26.0, [700]), (-26.0, [700]), (13.0, [])])
def test_a_spike_is_twelve_times_the_noise_above_the_local_spread(size, found):
    values = NOISE.copy()
    values[700] = size
    np.testing.assert_array_equal(np.flatnonzero(find_spikes(values)), found)


@pytest.mark.parametrize(("height", "found"), [(90.0, [703]), (-90.0, [703]), (10.0, [])])
def test_a_single_spike_is_found_where_the_values_around_it_change_by_more(height, found):
    values = 300.0 * np.sin(np.arange(2000) / 15.0) + NOISE[:2000]
    values[703] += height
    np.testing.assert_array_equal(np.flatnonzero(find_spikes(values)), found)


def test_a_step_and_a_corner_are_no_spikes():
    step, corner = NOISE[:2000].copy(), 10.0 * np.abs(np.arange(2000.0) - 1000.0) + NOISE[:2000]
    step[1000:] += 500.0
    assert not find_spikes(step).any()
    assert not find_spikes(corner).any()


def test_only_the_largest_deviation_is_a_jump():
    x = 1e-5 * RAMP + 1e-7 * NOISE[:1000]
    x[300] += 1e-3
    np.testing.assert_array_equal(np.flatnonzero(find_jumps(x)), [300])
    x[300] -= 2e-3
    np.testing.assert_array_equal(np.flatnonzero(find_jumps(x)), [300])


def test_two_steps_of_a_coarse_converter_are_no_spike():
    values = np.zeros(1000)
    values[::50], values[700] = 1.0, 2.0
    assert not find_spikes(values).any()
    values[700] = 2.5
    values[750:752] = 0.5
    assert find_spikes(values)[700]
    assert not find_spikes(np.zeros(100)).any()


def test_invalid_samples_are_bridged_by_straight_lines():
    values, invalid = np.array([9.0, 1.0, 7.0, 7.0, 4.0]), np.array([True, False, True, True, False])
    assert interpolate_invalid(values, invalid) == pytest.approx([1.0, 1.0, 2.0, 3.0, 4.0])
    assert interpolate_invalid(values, np.zeros(5, bool)) is values


@pytest.mark.parametrize("order", [1, 2, 4])
def test_white_noise_is_found_in_differences_of_any_order(order):
    assert estimate_white_noise(3.0 * NOISE + T ** (order - 1), order) == pytest.approx(3.0, rel=0.05)
    assert estimate_white_noise(np.zeros(order), order) == 0.0


def test_the_deviation_is_that_of_the_median_magnitude():
    assert estimate_deviation(np.array([-0.6745, 5.0, 0.1])) == pytest.approx(1.0)


def test_a_drive_steps_above_eight_times_its_noise():
    noise = estimate_white_noise(NOISE, 2)
    for ratio, steps in ((7.9, []), (8.1, [2000]), (-8.1, [2000])):
        drive = NOISE.copy()
        drive[2000:] += ratio * noise - (drive[2000] - drive[1999])
        np.testing.assert_array_equal(find_drive_steps(drive), steps)
    np.testing.assert_array_equal(find_drive_steps(np.repeat([0.0, 5e-12, 5e-12 + 5e-13], 10)), [10])
    np.testing.assert_array_equal(find_drive_steps(np.repeat([0.2, 0.1], 10)), [10])


@pytest.mark.parametrize(("count", "averaged"), [(5, True), (4, False)])
def test_a_level_of_five_samples_is_averaged(count, averaged):
    drive = np.concatenate([np.zeros(300), np.full(count, 1.0), np.zeros(300)]) + 1e-3 * NOISE[: 600 + count]
    level = average_drive_levels(drive)[300 : 300 + count]
    assert (np.ptp(level) == 0.0) == averaged


def test_drives_within_rounding_are_one_bin():
    near = np.repeat([0.3, 0.3 + 5e-10], 50)
    apart = np.repeat([0.3, 0.3 + 5e-9], 50)
    assert [(value, len(at)) for value, at in bin_drive(near)] == [(0.3, 100)]
    assert [len(at) for _, at in bin_drive(apart)] == [50, 50]


@pytest.mark.parametrize(("levels", "bins"), [(2, 2), (12, 12), (13, 8)])
def test_up_to_twelve_levels_have_bins_of_their_own(levels, bins):
    found = bin_drive(np.repeat(np.arange(levels) / 10.0, 100))
    assert len(found) == bins
    if bins == levels:
        assert [value for value, _ in found] == pytest.approx(list(np.arange(levels) / 10.0))
        np.testing.assert_array_equal(found[1][1], range(100, 200))


@pytest.mark.parametrize(("between", "bins"), [(90, 2), (110, 8)])
def test_a_tenth_of_the_samples_may_lie_between_the_levels(between, bins):
    # One sample at each place between the levels: below the hundredth that makes a level.
    levels = np.repeat([0.0, 1.0], (1000 - between) // 2)
    found = bin_drive(np.concatenate([levels, np.linspace(0.05, 0.95, between)]))
    assert len(found) == bins
    assert sum(len(at) for _, at in found) == 1000


def test_a_varying_drive_is_binned_in_equal_widths():
    found = bin_drive(np.linspace(1.0, 3.0, 801), max_bins=4)
    assert [value for value, _ in found] == pytest.approx([1.25, 1.75, 2.25, 2.75])
    assert [len(at) for _, at in found] == [200, 200, 200, 201]
