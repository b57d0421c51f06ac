"""Noise may have any spectrum; bursts, beats, drift and repeating parts are not noise."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.signal import lfilter

from identification.gap.data.cycles import Cycles, StrokeCondition
from identification.gap.data.residual_map import Residual
from identification.gap.noise.coloured_noise import (
    _average_residual,
    _bin_by_phase,
    _compute_power_variation,
    _compute_spectrum,
    _has_drift,
    _has_line,
    _sum_repeating_power,
    estimate_coloured_floor,
    is_stationary,
)

RATE = 1000.0
SECONDS = 60
COUNT = round(RATE * SECONDS)
TIME = np.arange(COUNT) / RATE
CYCLES = Cycles(
    cycle=(2.0 * TIME).astype(int),
    phase=(2.0 * TIME) % 1.0,
    segment=np.arange(2 * SECONDS) // 20,
    conditions=tuple(StrokeCondition(0.2, 0.01, 2.0) for _ in range(6)),
)


def make_noise(seed=1, slow=1.2):
    """White noise of 2 N and slow noise with a correlation time of 50 ms."""
    random = default_rng(seed)
    decay = np.exp(-1.0 / (RATE * 0.05))
    shocks = slow * np.sqrt(1.0 - decay**2) * random.standard_normal(COUNT)
    return 2.0 * random.standard_normal(COUNT) + lfilter([1.0], [1.0, -decay], shocks)


def make_residual(values):
    drive = np.full(COUNT, 0.2)
    return Residual(values, np.zeros(COUNT), drive, TIME, np.ones(COUNT, bool), ((COUNT, RATE),))


@pytest.mark.parametrize("seed", range(1, 6))
def test_coloured_noise_is_estimated_completely(seed):
    assert estimate_coloured_floor(make_residual(make_noise(seed)), CYCLES) == pytest.approx(
        np.hypot(2.0, 1.2), rel=0.03
    )


def test_the_repeating_part_of_a_residual_is_not_noise():
    locked = 3.0 * np.sin(2.0 * np.pi * CYCLES.phase) ** 3
    floor = estimate_coloured_floor(make_residual(make_noise() + locked), CYCLES)
    assert floor is None or floor == pytest.approx(np.hypot(2.0, 1.2), rel=0.05)


@pytest.mark.parametrize(
    "disturbance",
    [
        4.0 * np.exp(-5.0 * (1.0 - np.cos(2.0 * np.pi * TIME / 4.0))) * np.sin(2.0 * np.pi * 11.0 * TIME),
        2.0 * np.sin(2.0 * np.pi * 8.3 * TIME),
        3.0 * (1.0 - np.exp(-TIME / 20.0)),
        8.0 * (TIME % 9.0 < 0.3),
    ],
    ids=["bursts", "beat", "drift", "sticking"],
)
def test_a_disturbance_is_not_stationary_noise(disturbance):
    assert not is_stationary(make_residual(make_noise(slow=0.0) + disturbance))


def test_the_floor_scales_with_the_residual():
    values = make_noise()
    floor = estimate_coloured_floor(make_residual(values), CYCLES)
    assert estimate_coloured_floor(make_residual(1e-6 * values), CYCLES) == pytest.approx(1e-6 * floor)


def test_the_repeating_part_is_subtracted_from_the_floor():
    # Twenty periods in a cycle average out in 25 ms, so that they are no line. In 64 bins, 0.847^2 of their power
    # of 2 N^2 is found.
    locked = 2.0 * np.cos(2.0 * np.pi * 20.0 * CYCLES.phase)
    floor = estimate_coloured_floor(make_residual(make_noise() + locked), CYCLES)
    alone = estimate_coloured_floor(make_residual(make_noise()), CYCLES)
    assert floor**2 == pytest.approx(alone**2 + 2.0 - 2.0 * 0.847**2, rel=0.02)


def test_without_comparable_cycles_there_is_no_floor():
    conditions = tuple(StrokeCondition(0.2, 0.01, 0.0) for _ in range(6))
    assert estimate_coloured_floor(make_residual(make_noise()), replace(CYCLES, conditions=conditions)) is None


def test_a_residual_with_a_disturbance_has_no_floor():
    beat = 2.0 * np.sin(2.0 * np.pi * 8.3 * TIME)
    assert estimate_coloured_floor(make_residual(make_noise(slow=0.0) + beat), CYCLES) is None


def make_strokes(pattern, offsets, frequency=1.0):
    """Cycles of a segment with a pattern of sixteen samples that is offset from cycle to cycle."""
    count = len(offsets)
    cycles = Cycles(
        np.repeat(np.arange(count), 16),
        np.tile(np.arange(16) / 16.0, count),
        np.zeros(count, int),
        (StrokeCondition(0.2, 0.01, frequency),),
    )
    values = np.concatenate([np.array(pattern, float) + offset for offset in offsets])
    return cycles, values


def sum_power(cycles, values, drive=None, valid=None):
    count = len(values)
    drive = np.full(count, 0.2) if drive is None else drive
    valid = np.ones(count, bool) if valid is None else valid
    residual = Residual(values, np.zeros(count), drive, np.arange(count) / 16.0, valid, ((count, 16.0),))
    return _sum_repeating_power(residual, cycles)


STEPS = np.repeat([2.0, -1.0, 0.0, 1.0], 4)
"""Four phase bins; the mean square is 1.5."""


def test_the_repeating_power_excludes_the_share_of_noise_in_the_mean_of_the_cycles():
    # Offsets of -1, 0, 1 have a variance of 1 and a mean square of 2/3; a third of the variance is in the mean.
    assert sum_power(*make_strokes(STEPS, (-1.0, 0.0, 1.0))) == pytest.approx(
        (48.0 * (1.5 - 1.0 / 3.0), 48.0 * (1.5 + 2.0 / 3.0))
    )
    assert sum_power(*make_strokes(0.0 * STEPS, (-1.0, 0.0, 1.0))) == pytest.approx((0.0, 32.0))


def test_cycles_are_compared_only_at_a_steady_drive():
    cycles, values = make_strokes(STEPS, (0.0, 0.0, 0.0, 9.0))
    segments = replace(cycles, segment=np.array([0, 0, 0, 1]), conditions=cycles.conditions * 2)
    drive = np.where(np.arange(64) == 63, 1.0, 0.0)
    for change, total in ((0.019, 72.0), (0.021, 0.0)):
        drive[5] = change  # the drive's range is 1
        assert sum_power(segments, values, drive) == pytest.approx((total, total))


def test_invalid_samples_and_those_outside_all_cycles_do_not_count():
    cycles, values = make_strokes(STEPS, (0.0, 0.0, 0.0, 5.0, 7.0))
    cycles = replace(cycles, cycle=np.where(cycles.cycle == 3, -1, cycles.cycle))
    valid = cycles.cycle != 4
    assert sum_power(cycles, values, valid=valid) == pytest.approx((72.0, 72.0))


@pytest.mark.parametrize(
    ("cycles", "samples", "bins"), [(3, 16, 4), (3, 15, None), (2, 16, None), (3, 400, 64), (4, 24, 6)]
)
def test_phase_bins_hold_at_least_four_samples(cycles, samples, bins):
    phase = np.tile(np.arange(samples) / samples, cycles)
    table = _bin_by_phase(np.ones(len(phase)), np.repeat(np.arange(cycles), samples), phase)
    assert (None if table is None else table.shape) == (None if bins is None else (cycles, bins))


def test_a_cycle_with_an_empty_phase_bin_is_left_out():
    phase, cycle = np.tile(np.arange(32) / 32.0, 4), np.repeat([5, 6, 7, 8], 32)
    phase, cycle = np.append(phase, phase[:16]), np.append(cycle, np.full(16, 5))
    bins = np.floor(8.0 * phase)
    empty = (cycle == 7) & (bins == 2)
    single = (cycle == 6) & (bins == 4) & (phase > 0.5)
    kept = ~empty & ~single  # 137 samples of four cycles: eight bins
    table = _bin_by_phase((10.0 * cycle + bins)[kept], cycle[kept], phase[kept])
    assert table.tolist() == [[10.0 * k + b for b in range(8)] for k in (5, 6, 8)]


def make_white(count, rate, seed=3):
    return make_stretches((default_rng(seed).standard_normal(count), rate))


def make_stretches(*stretches):
    values = np.concatenate([v for v, _ in stretches])
    count = len(values)
    rates = tuple((len(v), rate) for v, rate in stretches)
    return Residual(values, np.zeros(count), np.zeros(count), np.arange(count) * 1.0, np.ones(count, bool), rates)


@pytest.mark.parametrize(("count", "stationary"), [(320, True), (319, False)])
def test_stationarity_needs_eight_seconds(count, stationary):
    assert is_stationary(make_white(count, 40.0)) == stationary


@pytest.mark.parametrize("longest", [0, 1])
def test_the_longest_stretch_decides(longest):
    noise, beat = (
        default_rng(3).standard_normal(20_000),
        3.0 * np.sin(2 * np.pi * 8.3 * np.arange(10_000) / 1000.0),
    )
    stretches = [(noise, 1000.0), (beat, 1000.0)]
    assert is_stationary(make_stretches(*(stretches if longest == 0 else stretches[::-1])))
    assert not is_stationary(make_stretches((noise[:9000], 1000.0), (beat, 1000.0)))


def test_averages_omit_invalid_samples_and_the_mean():
    values, valid = np.arange(10.0), np.array([1, 1, 1, 0, 0, 0, 1, 1, 1, 1], bool)
    # Averages 0.5, 2 and 6.5, less their mean of 3; one pair is invalid, one sample is half of a pair.
    assert _average_residual(values[:9], valid[:9], 2) == pytest.approx([-2.5, -1.0, 3.5])


def test_a_spectrum_has_the_frequencies_of_averages_over_25_milliseconds():
    frequency, power = _compute_spectrum(np.cos(2 * np.pi * 3.0 * np.arange(8) / 8.0))
    assert frequency == pytest.approx([5.0, 10.0, 15.0, 20.0])
    assert power == pytest.approx([0.0, 0.0, 16.0, 0.0], abs=1e-12)


def test_the_power_variation_is_the_relative_deviation_between_seconds():
    # Forty averages are one second. Powers of the windows: 1 and 9, mean 5, deviation 4.
    rows = np.array([np.repeat([1.0, 3.0, 50.0], [40, 40, 20]), np.ones(100)])
    assert _compute_power_variation(rows) == pytest.approx([0.8, 0.0])


def test_a_line_has_thirty_times_the_median_power_around_it():
    def find(ratio):
        spectrum = np.exp(2j * np.pi * default_rng(0).uniform(size=401))
        spectrum[[0, -1]] = 1.0
        spectrum[90] *= np.sqrt(ratio)
        return _has_line(np.fft.irfft(spectrum))

    assert find(31.0)
    assert not find(29.0)


def test_drift_has_three_times_the_power_per_frequency_of_the_band_above():
    def find(ratio, high=1.0):
        # Forty seconds: 0.025 Hz to 0.175 Hz are drift, 0.2 Hz to 1.175 Hz the reference.
        spectrum = np.ones(801)
        spectrum[1:8] = np.sqrt(ratio)
        spectrum[48:] = high
        return _has_drift(np.fft.irfft(spectrum))

    assert find(3.1)
    assert not find(2.9)
    assert find(3.1, high=30.0)
    assert not find(2.9, high=0.01)
