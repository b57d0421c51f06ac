"""Noise floor of a stretch, and of several."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.signal import butter, lfilter

from identification.logs.recording import Segment
from identification.noise.noise_floor import (
    NoiseFloorEstimate,
    _average,
    _compare,
    _compute_white_probability,
    _Estimate,
    _explain_missing_repeats,
    _mix,
    estimate_floor,
)
from identification.noise.time_scales import ScaleVariance, list_scales, measure_scale_variance
from identification.signals.motion import estimate_motion
from tests.support.noise import make_pink_noise
from tests.support.strokes import RATE, hysteresis, random_motion, recorded, sine, sine_segment, stretch

NOISE = 2.5


def white(count, seed=0):
    return NOISE * default_rng(seed).standard_normal(count)


def floor_of(displacement, force, drive=None, frequency=None):
    segments = [sine_segment(0, len(displacement), 10e-3, frequency)] if frequency else []
    given = stretch(recorded(displacement, 2e-6, seed=1), force, drive, segments)
    return estimate_floor([given], [estimate_motion(given)])


@pytest.mark.parametrize("frequency", [1.0, 1.3, 2.37])
def test_white_noise_on_repeated_cycles_is_found_within_three_percent(frequency):
    displacement, velocity = sine(10e-3, frequency, 14.0)
    floor = floor_of(displacement, hysteresis(velocity) + white(len(velocity)), frequency=frequency)
    assert floor.noise == pytest.approx(NOISE, rel=0.03)
    assert floor.cycle_to_cycle == pytest.approx(NOISE, rel=0.03)
    assert "agrees" in floor.basis


def test_drive_steps_and_their_transients_are_excluded():
    displacement, velocity = sine(10e-3, 2.0, 12.0)
    drive = np.repeat([0.1, 0.5, 0.3], len(velocity) // 3)
    settled = lfilter([0.08], [1.0, -0.92], drive)
    force = hysteresis(velocity, settled) + white(len(velocity))
    floor = floor_of(displacement, force, drive + 1e-4 * default_rng(4).standard_normal(len(drive)), 2.0)
    assert floor.cycle_to_cycle == pytest.approx(NOISE, rel=0.05)


def test_a_drifting_offset_is_not_noise():
    displacement, velocity = sine(10e-3, 2.0, 12.0)
    drift = np.linspace(0.0, 60.0, len(velocity))
    floor = floor_of(displacement, hysteresis(velocity) + drift + white(len(velocity)), frequency=2.0)
    assert floor.cycle_to_cycle == pytest.approx(NOISE, rel=0.03)


def test_force_explained_by_the_achieved_motion_is_not_noise():
    displacement, velocity = sine(10e-3, 2.0, 12.0)
    offset = 1e-4 * np.sin(2.0 * np.pi * 0.37 * np.arange(len(velocity)) / RATE)
    force = 2e5 * (displacement + offset) + white(len(velocity))
    floor = floor_of(displacement + offset, force, frequency=2.0)
    assert floor.cycle_to_cycle == pytest.approx(NOISE, rel=0.1)


def test_a_disturbed_cycle_is_not_noise():
    time = np.arange(5000) / RATE
    late = time - 8e-3 * np.exp(-(((time - 2.26) / 0.05) ** 2))
    displacement = 10e-3 * np.sin(2.0 * np.pi * late)
    force = hysteresis(np.gradient(displacement) * RATE) + white(len(time))
    floor = floor_of(displacement, force, frequency=1.0)
    assert floor.cycle_to_cycle == pytest.approx(NOISE, rel=0.05)
    assert "agrees" in floor.basis


def test_force_that_does_not_repeat_is_noted():
    displacement, velocity = sine(10e-3, 2.0, 12.0)
    rattle = 10.0 * np.sin(2.0 * np.pi * 70.5 * np.arange(len(velocity)) / RATE)
    floor = floor_of(displacement, hysteresis(velocity) + rattle + white(len(velocity)), frequency=2.0)
    assert floor.noise == pytest.approx((NOISE**2 + 50.0) ** 0.5, rel=0.05)
    assert "some force does not repeat" in floor.basis


def test_a_mains_line_is_no_noise():
    displacement, velocity = sine(10e-3, 2.0, 12.0)
    line = 10.0 * np.sin(2.0 * np.pi * 50.5 * np.arange(len(velocity)) / RATE + 0.7)
    floor = floor_of(displacement, hysteresis(velocity) + line + white(len(velocity)), frequency=2.0)
    assert floor.noise == pytest.approx(NOISE, rel=0.03)
    assert "a mains line of 7.0" in floor.basis
    assert "at 50.50 Hz" in floor.basis


def test_a_fast_force_that_repeats_is_noted():
    displacement, velocity = sine(10e-3, 2.0, 12.0)
    hum = 200.0 * np.sin(2.0 * np.pi * 400.0 * np.arange(len(velocity)) / RATE)
    floor = floor_of(displacement, hysteresis(velocity) + hum + white(len(velocity)), frequency=2.0)
    assert floor.noise == pytest.approx(NOISE, rel=0.05)
    assert "repeats with the stroke" in floor.basis


def test_coloured_noise_is_measured_by_the_cycles():
    displacement, velocity = sine(10e-3, 2.0, 14.0)
    coloured = lfilter(*butter(1, 60.0, fs=RATE), 10.0 * white(len(velocity)))
    floor = floor_of(displacement, hysteresis(velocity) + coloured, frequency=2.0)
    assert floor.noise == pytest.approx(float(np.std(coloured)), rel=0.1)
    assert floor.noise > 1.1 * floor.high_frequency


def test_a_motion_that_does_not_repeat_falls_back_to_high_frequency():
    displacement, velocity = random_motion()
    floor = floor_of(displacement, hysteresis(velocity) + white(len(velocity)))
    assert floor.cycle_to_cycle is None
    assert floor.noise == pytest.approx(NOISE, rel=0.05)
    assert "no periodic motion" in floor.basis


def test_a_drive_that_never_repeats_falls_back_to_high_frequency():
    displacement, velocity = sine(10e-3, 2.0)
    drive = np.linspace(0.0, 1.0, len(velocity))
    floor = floor_of(displacement, hysteresis(velocity, drive) + white(len(velocity)), drive, 2.0)
    assert floor.cycle_to_cycle is None
    assert "no two cycles" in floor.basis


def test_too_few_repeated_samples_fall_back_to_high_frequency():
    displacement, velocity = sine(10e-3, 20.0, 0.16)
    floor = floor_of(displacement, hysteresis(velocity) + white(len(velocity)), frequency=20.0)
    assert floor.cycle_to_cycle is None
    assert "samples in repeated cycles" in floor.basis


def test_slow_noise_in_too_few_cycles_falls_back_to_high_frequency():
    displacement, velocity = sine(10e-3, 8.0, 0.3)
    force = hysteresis(velocity) + lfilter([1.0], [1.0, -np.exp(-0.2)], white(len(velocity)))
    floor = floor_of(displacement, force, frequency=8.0)
    assert (floor.deviation, floor.cycle_to_cycle) == (None, None)
    assert floor.noise == floor.high_frequency
    assert "samples in repeated cycles only give" in floor.basis


def test_slow_noise_is_measured_and_lies_in_the_interval():
    displacement, velocity = sine(10e-3, 1.0, 40.0)
    slow = lfilter([1.0], [1.0, -np.exp(-0.05)], white(len(velocity)))
    floor = floor_of(displacement, hysteresis(velocity) + slow, frequency=1.0)
    low, high = floor.get_interval(np.inf)
    assert low < float(np.std(slow)) < high
    assert high - low < 0.2 * floor.noise
    assert floor.high_frequency < 0.5 * floor.noise


def make_stretch(noise, seconds=12.0, seed=0, repeats=True):
    displacement, velocity = sine(10e-3, 2.0, seconds)
    segments = [sine_segment(0, len(displacement), 10e-3, 2.0)] if repeats else []
    force = hysteresis(velocity) + noise * default_rng(seed).standard_normal(len(velocity))
    return stretch(recorded(displacement, 2e-6, seed=seed), force, None, segments)


def test_the_floor_of_several_stretches_is_that_of_all_their_cycles():
    stretches = [make_stretch(2.0, 12.0), make_stretch(4.0, 36.0, seed=1)]
    found = estimate_floor(stretches, [estimate_motion(s) for s in stretches])
    assert found.cycle_to_cycle == pytest.approx(13.0**0.5, rel=0.03)
    assert found.high_frequency == pytest.approx(13.0**0.5, rel=0.03)
    assert found.basis.startswith("cycle to cycle over 94 cycles in 2 of 2 stretches")


def test_a_stretch_without_repeated_cycles_has_the_noise_of_the_others():
    stretches = [make_stretch(4.0), make_stretch(2.0, seed=1, repeats=False)]
    found = estimate_floor(stretches, [estimate_motion(s) for s in stretches])
    assert found.noise == pytest.approx(4.0, rel=0.03)
    assert found.cycle_to_cycle == pytest.approx(4.0, rel=0.03)
    assert "in 1 of 2 stretches" in found.basis


def test_estimates_of_one_noise_are_averaged_by_their_precision():
    assert _average(_Estimate(2.0, 0.1), _Estimate(2.2, 0.05)) == pytest.approx((2.16, 0.1 / 5.0**0.5))
    assert _average(_Estimate(0.0, 0.0), _Estimate(0.0, 0.0)) == (0.0, 0.0)


def test_noise_is_white_where_two_precise_estimates_agree():
    precise = _Estimate(1.0, 0.001)
    assert _compute_white_probability(_Estimate(1.0, 0.01), precise) > 0.98
    assert _compute_white_probability(_Estimate(1.02, 0.01), precise) == pytest.approx(0.92, abs=0.02)
    assert _compute_white_probability(_Estimate(1.05, 0.01), precise) < 1e-3
    assert _compute_white_probability(_Estimate(0.95, 0.01), precise) < 1e-3
    # An estimate that cannot tell gives the prior probability back, up to its width.
    assert 0.3 < _compute_white_probability(_Estimate(1.5, 0.4), precise) < 0.7


def test_a_probable_noise_hardly_changes_with_the_estimates():
    fast = _Estimate(1.0, 0.002)
    found = []
    for repeated in np.arange(0.9, 1.5, 0.002):
        estimate = _Estimate(float(repeated), 0.06)
        found.append(_mix(_compute_white_probability(estimate, fast), _average(estimate, fast), estimate))
    noise, deviation = np.transpose(found)
    assert np.abs(np.diff(noise)).max() < 0.01
    assert np.abs(np.diff(deviation)).max() < 0.01
    # Between the two answers, the interval contains both.
    middle = np.argmin(np.abs(noise - 1.06))
    assert noise[middle] - 1.96 * deviation[middle] < 1.0 < 1.12 < noise[middle] + 1.96 * deviation[middle]


def test_without_repeated_cycles_the_floor_lies_between_its_lower_bound_and_the_error_of_a_model():
    floor = NoiseFloorEstimate(2.0, None, 2.0, "high frequency: why")
    assert floor.get_interval(3.0) == (2.0, 3.0)
    assert floor.get_interval(1.9) == (1.9, 2.0)
    assert NoiseFloorEstimate(2.0, 2.0, 2.0, "", 0.1).get_interval(9.0) == pytest.approx((1.804, 2.196))
    assert NoiseFloorEstimate(2.0, 2.0, 2.0, "", 5.0).get_interval(9.0)[0] == 0.0


@pytest.mark.parametrize(
    ("cycles", "high", "white", "text"),
    [
        (1.05, 1.0, 0.6, "the high-frequency estimate agrees"),
        (1.12, 1.0, 0.4, "1.12 times the high-frequency estimate: some force does not repeat"),
        (1.0, 1.25, 0.0, "only 0.80 of the high-frequency estimate"),
        (0.0, 0.0, 1.0, "agrees"),
        (2.0, 0.0, 0.0, "some force does not repeat"),
    ],
)
def test_the_likelier_relation_of_two_estimates_is_described(cycles, high, white, text):
    assert text in _compare(cycles, high, white)


def test_missing_repeats_are_explained():
    periodic = stretch(np.zeros(10), segments=[sine_segment(0, 10, 1.0, 1.0)])
    assert _explain_missing_repeats([stretch(np.zeros(10))], 0).startswith("no periodic motion")
    assert _explain_missing_repeats([periodic], 0).startswith("no two cycles")
    assert _explain_missing_repeats([periodic], 9) == "only 9 samples in repeated cycles (minimum 200)"


def test_only_periodic_segments_with_a_frequency_show_repeated_cycles():
    x, v = sine(0.01, 2.0, 12.0)
    given = stretch(recorded(x, 2e-6), 800.0 * v + white(len(v)))
    for motion, frequency, repeats in (("sine", 2.0, True), ("hold", 2.0, False), ("sine", None, False)):
        part = Segment(0, "s", 0, len(x), motion, 0.01, frequency, None)
        periodic = replace(given, segments=(part,))
        assert (estimate_floor([periodic], [estimate_motion(given)]).cycle_to_cycle is not None) == repeats


def test_only_coloured_noise_has_a_coloured_share():
    assert NoiseFloorEstimate(4.0, 4.0, 2.0, "", 0.1).coloured_share == pytest.approx(0.75)
    assert NoiseFloorEstimate(4.0, 4.0, 5.0, "", 0.1).coloured_share == 0.0
    assert NoiseFloorEstimate(3.9, 4.0, 3.8, "", 0.1).coloured_share == pytest.approx(0.05, abs=0.01)
    assert NoiseFloorEstimate(4.0, None, 4.0, "").coloured_share == 0.0
    assert [NoiseFloorEstimate(4.0, c, 4.0, "", d).is_known for c, d in ((4.0, 0.1), (None, None))] == [
        True,
        False,
    ]


def test_the_chance_of_white_noise_is_that_of_independent_samples():
    scales = tuple(ScaleVariance(2**k, 2.0 / 2**k, 0.0) for k in range(10))
    known = NoiseFloorEstimate(2.0, 2.0, 2.0, "", 0.1, scales)
    assert known.compute_chance(5000) == pytest.approx(math.sqrt(2.0 / 5000), rel=1e-3)
    assert NoiseFloorEstimate(2.0, None, 2.0, "").compute_chance(5000) == pytest.approx(math.sqrt(2.0 / 5000))


def test_the_mean_square_of_slow_noise_varies_more():
    slow = NoiseFloorEstimate(2.0, 2.0, 1.0, "", 0.1, (ScaleVariance(1, 0.1, 0.0), ScaleVariance(64, 3.9, 0.0)))
    assert slow.compute_chance(5000) == pytest.approx(3.9 / 4.0 * math.sqrt(4.0 * 64 / 5000), rel=0.01)
    slower = NoiseFloorEstimate(2.0, 2.0, 1.0, "", 0.1, (ScaleVariance(1, 0.1, 0.0), ScaleVariance(64, 0.9, 0.0)))
    assert slower.compute_chance(5000) > 3.0 / 4.0 * math.sqrt(8.0 * 64 / 5000)
    assert slower.compute_chance(10) < 2.5


def test_the_mean_square_of_short_blocks_varies_as_that_of_their_noise():
    """The parts of the noise that are slower than a block add up to one value in it."""
    pink = make_pink_noise(60_000, default_rng(4))
    valid = np.ones(len(pink), bool)
    measured = [(m, *measure_scale_variance(pink, valid, m)) for m in list_scales(len(pink))]
    scales = tuple(ScaleVariance.from_signal(*scale) for scale in measured)
    known = NoiseFloorEstimate(1.0, 1.0, 0.3, "", 0.1, scales)
    for samples in (20, 70, 300):
        blocks = pink[: len(pink) // samples * samples].reshape(-1, samples)
        assert known.compute_chance(samples) == pytest.approx(np.std(np.mean(blocks**2, axis=1)), rel=0.3)


@pytest.mark.parametrize("share", [0.0, 0.8])
def test_the_scales_contain_the_variance_of_the_noise(share):
    displacement, velocity = sine(10e-3, 2.0, 14.0)
    slow = lfilter([np.sqrt(1.0 - 0.98**2)], [1.0, -0.98], white(len(velocity), 7))
    noise = np.sqrt(1.0 - share) * white(len(velocity), 8) + np.sqrt(share) * slow
    estimate = floor_of(displacement, hysteresis(velocity) + noise, frequency=2.0)
    assert sum(s.variance for s in estimate.scales) == pytest.approx(estimate.cycle_to_cycle**2, rel=0.1)
    assert estimate.scales[0].variance / estimate.noise**2 == pytest.approx(0.5 * (1.0 - share), abs=0.05)
