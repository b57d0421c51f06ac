from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.interpolate import CubicSpline
from scipy.signal import butter, lfilter

from identification.signals.harmonics import fit_harmonics
from identification.signals.motion import estimate_displacement_noise, estimate_motion, estimate_recorded_noise
from identification.signals.smoother import compute_penalty, compute_step_covariance, differentiate, smooth_signal
from tests.support.strokes import RATE, hysteresis, random_motion, recorded, sine, sine_segment, stretch

DAMPING = 2000.0
"""[N s/m] by which noise of the velocity becomes noise of the force."""


def force_error(velocity, truth):
    return DAMPING * (velocity - truth)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(("amplitude", "frequency"), [(5e-3, 2.5), (10e-3, 1.0), (15e-3, 2.0)])
@pytest.mark.parametrize("noise", [2e-6, 5e-6])
def test_a_sine_loses_less_than_a_tenth_of_a_newton_to_displacement_noise(amplitude, frequency, noise):
    displacement, velocity = sine(amplitude, frequency)
    segment = sine_segment(0, len(displacement), amplitude, frequency)
    motion = estimate_motion(stretch(recorded(displacement, noise), segments=[segment]))
    assert rms(force_error(motion.velocity, velocity)) < 0.1


def test_a_random_stroke_loses_less_than_half_a_newton():
    displacement, velocity = random_motion()
    motion = estimate_motion(stretch(recorded(displacement, 5e-6)))
    assert rms(force_error(motion.velocity, velocity)) < 0.5


def test_the_ends_of_a_random_stroke_show_no_artefact():
    displacement, velocity = random_motion()
    motion = estimate_motion(stretch(recorded(displacement, 2e-6)))
    ends = np.r_[0:20, -20:0]
    assert np.max(np.abs(force_error(motion.velocity, velocity)[ends])) < 3.0


def compliant_actuator(seconds=8.0, stiffness=2e7):
    """A stroke whose actuator deforms by some 20 µm, at a drive that steps every 2 s."""
    command, velocity = sine(10e-3, 1.5, seconds)
    level = np.repeat([0.2, 1.0, 0.4, 0.7], round(seconds * RATE) // 4)
    force = hysteresis(velocity, level)
    displacement = command - lfilter(*butter(2, 40.0, fs=RATE), force) / stiffness
    return displacement, force, level


def test_compliance_motion_is_followed_through_drive_steps():
    displacement, force, level = compliant_actuator()
    noisy = force + 2.5 * default_rng(3).standard_normal(len(force))
    segment = sine_segment(0, len(displacement), 10e-3, 1.5)
    motion = estimate_motion(stretch(recorded(displacement, 2e-6), noisy, level, [segment]))
    error = force_error(motion.velocity, differentiate(displacement, RATE))[100:-100]
    assert rms(error) < 0.25
    assert "compliance motion" in motion.description[0]


def test_the_fast_motion_of_a_soft_actuator_is_followed():
    displacement, force, level = compliant_actuator(stiffness=1e6)
    assert np.std(force / 1e6) > 0.03 * np.std(displacement), "softer than an actuator can be"
    noisy = force + 2.5 * default_rng(3).standard_normal(len(force))
    motions = [estimate_motion(stretch(recorded(displacement, 2e-6), f, level)) for f in (0.0 * force, noisy)]
    velocity = differentiate(displacement, RATE)
    assert all(rms(force_error(m.velocity, velocity)[100:-100]) < 0.42 for m in motions)
    assert "compliance motion" in motions[1].description[0]


def test_a_force_that_the_displacement_does_not_follow_is_left_alone():
    displacement, velocity = random_motion()
    motion = estimate_motion(stretch(recorded(displacement, 2e-6), hysteresis(velocity)))
    assert "force" not in motion.description[0]


def test_a_soft_start_and_end_are_handled_by_the_smoother():
    displacement, _ = sine(10e-3, 2.0, 10.0)
    place = np.arange(len(displacement)) / len(displacement)
    ramp = np.clip(5.0 * np.minimum(place, 1.0 - place), 0.0, 1.0)
    displacement = displacement * ramp**2 * (3.0 - 2.0 * ramp)
    segment = sine_segment(0, len(displacement), 10e-3, 2.0)
    motion = estimate_motion(stretch(recorded(displacement, 2e-6), segments=[segment]))
    assert motion.description[0].startswith("2 Hz with harmonics 1")
    assert rms(force_error(motion.velocity, differentiate(displacement, RATE))) < 0.25


def test_the_method_of_estimation_is_described_for_each_segment():
    displacement, _ = sine(10e-3, 2.0)
    hold = np.full(1000, displacement[-1])
    first = sine_segment(0, len(displacement), 10e-3, 2.0)
    second = sine_segment(len(displacement), len(displacement) + 1000, 0.0, 0.0)
    joined = stretch(recorded(np.concatenate([displacement, hold]), 2e-6), segments=[first, second])
    sine_text, hold_text = estimate_motion(joined).description
    assert "harmonics" in sine_text
    assert hold_text.startswith("smoothed below")


def test_the_noise_of_the_displacement_is_reported():
    displacement, _ = sine(10e-3, 1.0)
    segment = sine_segment(0, len(displacement), 10e-3, 1.0)
    motion = estimate_motion(stretch(recorded(displacement, 4e-6, digit=1e-9), segments=[segment]))
    assert motion.noise == pytest.approx(4e-6, rel=0.03)


def test_lost_samples_do_not_disturb_the_motion():
    displacement, velocity = random_motion()
    broken = stretch(recorded(displacement, 2e-6))
    for lost in range(500, 7500, 250):
        broken.displacement[lost : lost + 4] = 0.1
        broken.measured[lost : lost + 4] = False
    error = force_error(estimate_motion(broken).velocity, velocity)
    assert rms(error[100:-100]) < 0.5


@pytest.mark.parametrize(("noise", "taken"), [(1e-6, True), (5e-3, False)])
def test_a_recorded_velocity_is_used_only_where_the_force_follows_it_as_well(noise, taken):
    displacement, velocity = random_motion(highest=30.0)
    sensor = velocity + noise * default_rng(2).standard_normal(len(velocity))
    force = hysteresis(velocity)
    motion = estimate_motion(stretch(recorded(displacement, 20e-6), force, velocity=sensor))
    assert ("velocity as recorded" in motion.description[0]) == taken
    assert np.array_equal(motion.velocity, sensor) == taken


@pytest.mark.parametrize("count", [50, 200, 3000])
def test_a_specimen_at_rest_has_no_motion(count):
    motion = estimate_motion(stretch(np.full(count, 1e-3)))
    assert np.allclose(motion.velocity, 0.0, atol=1e-9)
    assert np.allclose(motion.displacement, 1e-3)


def test_quantisation_counts_as_displacement_noise():
    displacement, _ = sine(10e-3, 0.7)
    stepped = recorded(displacement, 0.0, 3e-6)
    noise = estimate_displacement_noise(stepped, np.ones(len(stepped), bool))
    assert noise == pytest.approx(3e-6 / 12**0.5, rel=0.15)


def test_the_achieved_frequency_is_found():
    displacement, _ = sine(5e-3, 4.0687)
    fit = fit_harmonics(recorded(displacement, 2e-6), np.ones(len(displacement)), RATE, 4.0, 2e-6)
    assert fit is not None
    assert fit.frequency == pytest.approx(4.0687, rel=1e-5)
    assert fit.orders[0] == 1


def test_shocks_in_some_cycles_leave_no_echo_in_the_others():
    displacement, _ = sine(5e-3, 2.0)
    disturbed = recorded(displacement, 2e-6)
    for cycle in (2, 5, 6, 9, 13):
        disturbed[500 * cycle + 100 : 500 * cycle + 108] += 25e-6
    fit = fit_harmonics(disturbed, np.ones(len(disturbed)), RATE, 2.0, 2e-6)
    assert fit is not None
    assert (fit.start, fit.stop, fit.orders) == (0, len(disturbed), (1,))
    assert rms(fit.values - displacement) < 0.15e-6


def test_noise_of_interpolated_samples_is_not_underestimated():
    displacement, _ = sine(10e-3, 1.0)
    measured = recorded(displacement, 4e-6, digit=1e-9)
    half_way = CubicSpline(np.arange(len(measured)), measured)(np.arange(len(measured) - 1) + 0.5)
    moved = replace(stretch(half_way), interpolated=True)
    passed = rms(half_way - CubicSpline(np.arange(len(measured)), displacement)(np.arange(len(half_way)) + 0.5))
    assert estimate_recorded_noise(moved) == pytest.approx(passed, rel=0.1)
    assert estimate_displacement_noise(half_way, moved.measured) < 0.7 * passed


def test_fewer_than_two_cycles_have_no_harmonics():
    displacement, _ = sine(5e-3, 0.2)
    assert fit_harmonics(displacement, np.ones(len(displacement)), RATE, 0.2, 2e-6) is None


@pytest.mark.parametrize(("twicing", "share"), [(False, 0.5), (True, 0.75)])
def test_the_smoother_keeps_a_half_or_three_quarters_of_a_wave_at_its_cutoff(twicing, share):
    wave, _ = sine(1.0, 20.0, 4.0)
    count = len(wave)
    penalty = np.full(count - 3, float(compute_penalty(20.0, RATE)))
    smooth = smooth_signal(wave, np.ones(count), penalty, np.zeros(count - 3), twicing=twicing)
    assert np.max(np.abs(smooth[500:-500] - share * wave[500:-500])) < 1e-4


def test_the_smoother_solves_its_normal_equations():
    rng = default_rng(0)
    values, weights = rng.standard_normal(40), (rng.random(40) > 0.2).astype(float)
    penalty, expected = 10.0 * rng.random(37), rng.standard_normal(37)
    third = np.diff(np.eye(40), 3, axis=0)
    matrix = np.diag(weights) + third.T @ (penalty[:, None] * third)
    solution = np.linalg.solve(matrix, weights * values + third.T @ (penalty * expected))
    assert np.allclose(smooth_signal(values, weights, penalty, expected), solution)
    again = np.linalg.solve(matrix, weights * (values - solution))
    assert np.allclose(smooth_signal(values, weights, penalty, expected, twicing=True), solution + again)


@pytest.mark.parametrize("twicing", [False, True])
def test_the_step_covariance_is_that_of_smoothed_and_measured_differences(twicing):
    noise = default_rng(1).standard_normal(200_000)
    penalty = np.full(len(noise) - 3, float(compute_penalty(60.0, RATE)))
    smooth = smooth_signal(noise, np.ones(len(noise)), penalty, np.zeros(len(noise) - 3), twicing=twicing)
    covariance = np.mean(np.diff(smooth) * np.diff(noise))
    assert compute_step_covariance(60.0, RATE, twicing=twicing) == pytest.approx(covariance, rel=0.05)


def test_the_derivative_is_exact_for_a_parabola_up_to_its_ends_and_for_a_fifth_power_inside():
    time = np.arange(100) / RATE
    assert np.allclose(differentiate(time**2, RATE), 2.0 * time, atol=1e-12)
    assert np.allclose(differentiate(time**5, RATE)[3:-3], 5.0 * time[3:-3] ** 4, atol=1e-12)


def test_the_velocity_at_an_end_of_a_recording_at_rest_is_small():
    """A resting damper must not seem to slide: its hysteresis would start saturated (decision 0038)."""
    noise = 1e-6
    recorded = noise * default_rng(3).standard_normal((200, 400))
    weights, penalty = np.ones(400), np.full(397, float(compute_penalty(150.0, RATE)))
    ends = [differentiate(smooth_signal(x, weights, penalty, np.zeros(397)), RATE)[0] for x in recorded]
    assert np.std(ends) < 1.5 * noise * RATE


def test_a_similar_recording_takes_the_same_cutoffs():
    displacement, velocity = sine(10e-3, 2.0, 6.0)
    first, second = (stretch(recorded(displacement, 2e-6, seed=s), hysteresis(velocity)) for s in (1, 2))
    motion = estimate_motion(first)
    similar = estimate_motion(second, motion)
    assert similar.cutoff is motion.cutoff
    assert similar.stroke_cutoff == motion.stroke_cutoff
    assert np.std(similar.displacement - motion.displacement) < 2e-6
    again = estimate_motion(first, motion)
    np.testing.assert_array_equal(again.displacement, motion.displacement)
