import numpy as np
import pytest
from numpy.random import default_rng
from scipy.signal import butter, lfilter

from identification.signals.motion import estimate_motion
from identification.signals.noise_floor import (
    NoiseFloorEstimate,
    combine_floors,
    estimate_floor,
    estimate_high_frequency_noise,
)
from tests.support.strokes import RATE, hysteresis, random_motion, recorded, sine, sine_segment, stretch

NOISE = 2.5


def white(count, seed=0):
    return NOISE * default_rng(seed).standard_normal(count)


def floor_of(displacement, force, drive=None, frequency=None):
    segments = [sine_segment(0, len(displacement), 10e-3, frequency)] if frequency else []
    given = stretch(recorded(displacement, 2e-6, seed=1), force, drive, segments)
    return estimate_floor(given, estimate_motion(given))


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
    hum = 10.0 * np.sin(2.0 * np.pi * 50.5 * np.arange(len(velocity)) / RATE)
    floor = floor_of(displacement, hysteresis(velocity) + hum + white(len(velocity)), frequency=2.0)
    assert floor.noise == pytest.approx((NOISE**2 + 50.0) ** 0.5, rel=0.05)
    assert "some force does not repeat" in floor.basis


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
    displacement, velocity = sine(10e-3, 5.0, 0.7)
    floor = floor_of(displacement, hysteresis(velocity) + white(len(velocity)), frequency=5.0)
    assert floor.cycle_to_cycle is None
    assert "samples in repeated cycles" in floor.basis


def test_digits_of_the_force_do_not_bias_the_high_frequency_estimate():
    force = np.round(white(20_000) / 3.0) * 3.0
    assert estimate_high_frequency_noise(force) == pytest.approx((NOISE**2 + 9.0 / 12.0) ** 0.5, rel=0.03)


def test_floors_are_combined_by_samples():
    short, long = stretch(np.zeros(1000)), stretch(np.zeros(3000))
    combined = combine_floors(
        [short, long],
        [
            NoiseFloorEstimate(2.0, None, 2.0, "high frequency"),
            NoiseFloorEstimate(4.0, 4.0, 4.0, "cycle to cycle"),
        ],
    )
    assert combined.noise == pytest.approx(13.0**0.5)
    assert combined.cycle_to_cycle == 4.0
    assert combined.basis.startswith("cycle to cycle in 1 of 2 stretches")


def test_floors_without_any_repeated_cycle_keep_their_reason():
    given = stretch(np.zeros(1000))
    combined = combine_floors([given, given], [NoiseFloorEstimate(2.0, None, 2.0, "high frequency: why")] * 2)
    assert combined.cycle_to_cycle is None
    assert combined.basis == "high frequency: why"
