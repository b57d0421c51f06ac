"""The gap by stroke condition and phase, its harmonics and its drift."""

import numpy as np
import pytest
from numpy.random import default_rng

from identification.gap.data.cycles import Cycles, StrokeCondition
from identification.gap.data.residual_map import (
    Residual,
    compute_harmonics,
    estimate_drift,
    find_strongest_line,
    map_gap,
)
from tests.unit.identification.gap.data.test_cycles import record

NOISE = 2.0


def make_residual(recorded, values, simulated=None):
    return Residual(
        values,
        np.sin(np.arange(len(values))) if simulated is None else simulated,
        recorded.drive,
        recorded.time,
        np.ones(len(values), bool),
        ((len(values), recorded.rate),),
    )


def test_the_map_locates_the_gap_by_drive_and_phase_without_the_noise():
    recorded, cycles = record()
    bump = 10.0 * ((recorded.drive > 0.3) & (np.abs(cycles.phase - 0.25) < 0.06))
    values = bump + NOISE * default_rng(0).standard_normal(len(bump))
    entries = map_gap(make_residual(recorded, values), cycles, NOISE)
    assert entries[0].drive == pytest.approx(0.4)
    assert abs(entries[0].phase - 0.25) < 0.1
    assert entries[0].gap_n > 5.0
    assert all(entry.gap_n < 1.0 for entry in entries if entry.drive < 0.3)


def test_harmonics_are_separated_by_their_order():
    recorded, cycles = record()
    values = 4.0 * np.sqrt(2.0) * np.cos(3 * 2 * np.pi * cycles.phase)
    rms = {h.order: h.rms_n for h in compute_harmonics(make_residual(recorded, values), cycles)}
    assert rms[3] == pytest.approx(4.0, rel=0.02)
    assert rms[2] < 0.1


@pytest.fixture(scope="module")
def drifting():
    recorded, cycles = record(segments=20)
    noise = NOISE * default_rng(1).standard_normal(len(recorded.time))

    def estimate(values, force=None):
        return estimate_drift(make_residual(recorded, values(recorded.time) + noise, force), cycles)

    return recorded.time, estimate


def test_a_rising_mean_has_a_slope_and_no_line(drifting):
    _, estimate = drifting
    drift = estimate(lambda time: 0.5 * time)
    assert drift.slope_n_per_s == pytest.approx(0.5, rel=0.05)
    assert drift.line_hz is None


def test_a_fading_force_changes_its_size(drifting):
    time, estimate = drifting
    force = 300.0 * np.sin(2 * np.pi * 2.0 * time)
    assert estimate(lambda t: -0.1 * force * t / t[-1], force).size_change == pytest.approx(-0.1, rel=0.1)


def test_a_line_is_reported_with_frequency_and_amplitude(drifting):
    _, estimate = drifting
    drift = estimate(lambda time: 3.0 * np.sin(2 * np.pi * 50.3 * time))
    assert drift.line_hz == pytest.approx(50.3, abs=0.1)
    assert drift.line_n == pytest.approx(3.0, rel=0.1)


def make_cycles(cycle, phase, segment, *conditions):
    conditions = tuple(StrokeCondition(*c) for c in conditions)
    return Cycles(np.array(cycle), np.array(phase, float), np.array(segment), conditions)


def make_plain(values, *, simulated=None, time=None, valid=None, rates=((10, 1.0),)):
    """A residual of hand-made samples."""
    values = np.array(values, float)
    count = len(values)
    return Residual(
        values,
        np.ones(count) if simulated is None else np.array(simulated, float),
        np.zeros(count),
        np.arange(count, dtype=float) if time is None else np.array(time, float),
        np.ones(count, bool) if valid is None else np.array(valid, bool),
        rates,
    )


def test_the_map_has_the_gap_of_every_condition_and_phase_the_largest_first():
    # Samples: outside all cycles, invalid, three in segment 0, two in segment 1 without a frequency.
    cycles = make_cycles(
        [-1, 0, 0, 0, 0, 1, 1], [0, 0, 0.3, 0.3, 0.99, 0, 0], [0, 1], (0.5, 0.01, 2.0), (0.123456, 0.02, 0.0)
    )
    residual = make_plain([99, 99, 5, 7, 1, 2, 2], valid=[1, 0, 1, 1, 1, 1, 1])
    entries = map_gap(residual, cycles, 1.0)
    found = [(e.drive, e.amplitude_m, e.frequency_hz, e.phase, e.gap_n) for e in entries]
    # Mean squares 37, 4 and 1 less the noise of 1.
    assert found == [
        pytest.approx((0.5, 0.01, 2.0, 2.5 / 8.0, 6.0)),
        pytest.approx((0.123, 0.02, 0.0, 0.0, np.sqrt(3.0))),
        pytest.approx((0.5, 0.01, 2.0, 7.5 / 8.0, 0.0)),
    ]


def test_a_part_below_the_noise_has_no_gap():
    cycles = make_cycles([0, 0], [0, 0], [0], (0.5, 0.01, 2.0))
    assert [e.gap_n for e in map_gap(make_plain([1, 1]), cycles, 2.0)] == [0.0]


@pytest.mark.parametrize("order", [1, 2, 9])
def test_harmonics_are_averaged_over_the_cycles_of_periodic_segments(order):
    phase = np.tile(np.arange(20) / 20.0, 3)
    cycles = make_cycles(np.repeat([0, 1, 2], 20), phase, [0, 0, 1], (0.0, 0.01, 0.5), (0.0, 0.01, 0.0))
    # The amplitude is 4 in the first cycle and 0 in the second; the last segment is not periodic.
    values = np.repeat([4.0, 0.0, 7.0], 20) * np.cos(order * 2 * np.pi * phase + 0.3)
    rms = [h.rms_n for h in compute_harmonics(make_plain(values), cycles)]
    assert rms == pytest.approx(np.where(np.arange(1, 10) == order, np.sqrt(2.0), 0.0), abs=1e-9)


def test_without_a_periodic_segment_there_are_no_harmonics():
    assert compute_harmonics(make_plain([1, 2]), make_cycles([0, 0], [0, 0], [0], (0.0, 0.01, 0.0))) == []


def test_drift_compares_the_means_and_sizes_of_segments():
    cycles = make_cycles([0, 0, 1, 1, 1], [0] * 5, [0, 1], (0.0, 0.01, 1.0), (0.0, 0.01, 1.0))
    # Segment 0: mean 1 at 0.5 s, segment 1: mean 4 at 3 s; recorded over simulated: 1.1 and 1.4.
    residual = make_plain([2, 0, 3, 4, 5], simulated=[20, -180, 7.5, 10, 12.5])
    drift = estimate_drift(residual, cycles)
    assert drift.slope_n_per_s == pytest.approx(3.0 / 2.5)
    # Weights 2 and 3 around 2.8: (2 x 1.8^2 + 3 x 1.2^2) / 5 = 2.16.
    assert drift.mean_rms_n == pytest.approx(np.sqrt(2.16))
    first = 2 * 20 / (20**2 + 180**2)
    assert drift.size_change == pytest.approx((0.4 - first) / 2.5 * 4.0)


def test_a_segment_of_a_single_sample_counts_and_one_segment_alone_has_no_slope():
    two = make_cycles([0, 0, 1], [0] * 3, [0, 1], (0.0, 0.01, 1.0), (0.0, 0.01, 1.0))
    assert estimate_drift(make_plain([1, 1, 4]), two).slope_n_per_s == pytest.approx(3.0 / 1.5)
    one = make_cycles([0, 0, -1], [0] * 3, [0], (0.0, 0.01, 1.0))
    assert estimate_drift(make_plain([1, 3, 9]), one).slope_n_per_s == 0.0


def test_three_segments_have_the_slope_of_their_weighted_regression():
    cycles = make_cycles([0, 1, 1, 2], [0] * 4, [0, 1, 2], *[(0.0, 0.01, 1.0)] * 3)
    # Times 0, 1.5, 3 with weights 1, 2, 1 and means 1, 0, 4: (-1.5 x 1 + 1.5 x 4) / 4.5.
    drift = estimate_drift(make_plain([1, 1, -1, 4]), cycles)
    assert drift.slope_n_per_s == pytest.approx(1.0)


def line(count, rate, **amplitudes):
    """Sines of amplitudes at numbers of periods in the record, as a residual of one stretch."""
    turns = np.arange(count) / count
    values = 1e-3 * default_rng(0).standard_normal(count)
    for periods, amplitude in amplitudes.items():
        values = values + amplitude * np.sin(2 * np.pi * int(periods[1:]) * turns)
    return make_plain(values, rates=((count, rate),))


@pytest.mark.parametrize(
    ("residual", "frequency", "amplitude"),
    [
        (line(2000, 1000.0, p600=3.0), 300.0, 3.0),
        (line(2000, 1000.0, p80=3.0), 40.0, 3.0),  # the lowest frequency
        (line(2000, 1000.0, p70=3.0, p600=0.5), 300.0, 0.5),  # 35 Hz is below it
        (line(2000, 1000.0, p600=3.3, p500=1.0), 300.0, 3.3),  # power ratio 10.9
        (line(2000, 1000.0, p600=3.0, p500=1.0), None, 0.0),  # power ratio 9
        (line(2000, 1000.0, p650=3.0, p440=2.0), 325.0, 3.0),  # beyond its neighbourhood
        (line(2000, 1000.0, p650=3.0, p460=2.0), None, 0.0),
        (line(2000, 1000.0, p650=3.0, p840=2.0), None, 0.0),
        (line(868, 1000.0, p217=3.0), 250.0, 3.0),  # 400 frequencies from 40 Hz on
        (line(864, 1000.0, p216=3.0), None, 0.0),  # 398
        (line(1000, 20_000.0, p2=3.0), 40.0, 3.0),  # at the edge of the spectrum
        (line(2000, 1000.0), None, 0.0),
    ],
)
def test_a_line_exceeds_its_neighbourhood_above_the_lowest_frequency(residual, frequency, amplitude):
    found, size = find_strongest_line(residual)
    assert found == (frequency if frequency is None else pytest.approx(frequency, rel=1e-4))
    assert size == pytest.approx(amplitude, rel=0.01)


@pytest.mark.parametrize("between", [0.0, 0.1, 0.3, 0.5, 0.9])
def test_a_line_between_two_frequencies_of_the_spectrum_is_found_within_a_twentieth_of_their_distance(between):
    time = np.arange(4000) / 1000.0
    frequency = 60.0 + 0.25 * between
    wave = 3.0 * np.cos(2.0 * np.pi * frequency * time)
    found, size = find_strongest_line(make_plain(wave, rates=((4000, 1000.0),)))
    assert found == pytest.approx(frequency, abs=0.25 / 20.0)
    assert 0.84 * 3.0 < size <= 3.01  # up to 1.4 dB are lost between two frequencies


def test_the_strongest_line_of_any_stretch_counts():
    first, second = line(2000, 1000.0, p600=1.0), line(1500, 500.0, p300=2.0)
    both = make_plain(np.concatenate([first.values, second.values]), rates=(*first.rates, *second.rates))
    assert find_strongest_line(both) == pytest.approx((100.0, 2.0), rel=0.01)
