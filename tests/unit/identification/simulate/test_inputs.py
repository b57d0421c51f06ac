"""Inputs of the integration against closed forms: field, interpolation, lags, delays, memory and heat."""

from dataclasses import replace

import numpy as np
import pytest

from identification.damper import Quantity
from identification.damper.effects import EFFECTS
from identification.simulate import ActiveEffect, Excitation, SimulationModel
from identification.simulate.curves import (
    apply_lag,
    differentiate_by_argument,
    differentiate_by_parameters,
    interpolate_hermite,
    interpolate_midpoints,
)
from identification.simulate.inputs import apply_two_lags, compute_damper_field, compute_field
from identification.simulate.memories import estimate_settled_hysteresis, trace_memory
from identification.simulate.motion import compile_once, compute_damper_motion
from identification.simulate.scaling import compute_scale_factors
from identification.simulate.stored_energy import compute_stored_energy
from identification.simulate.variables import apply_deadband
from tests.support.effects import LABORATORY, active, sine

H, ETA, LAG = 1e-3, 80.0, 0.004
DELAYS = [0.0, 2e-4, 4e-4, 5e-4, 7e-4, 1.2e-3, 1.8e-3, -3e-4, -2.6e-3]
COUNT = 12


def step_at(sample):
    """Return a drive (12,) that steps from 0.2 to 0.7 V at a sample."""
    return np.where(np.arange(COUNT) < sample, 0.2, 0.7)


def elapsed(sample, delay, half_samples=False):
    """Return the time [s] since the delayed step; zero before it and before the first sample."""
    time = np.arange(2 * COUNT - 1) * H / 2 if half_samples else np.arange(COUNT) * H
    # A held drive is constant before the first sample, so an earlier step counts from there.
    return np.maximum(time - max(sample * H + delay, 0.0), 0.0)


@pytest.mark.parametrize("delay", DELAYS)
@pytest.mark.parametrize("sample", [4, 9])
def test_the_field_approaches_a_delayed_step_exponentially(sample, delay):
    u, middle, du, dmiddle = compute_field(step_at(sample), ETA, delay, H)
    t = elapsed(sample, delay, half_samples=True)
    rest = np.where(t > 0.0, 0.5 * np.exp(-ETA * t), 0.5)
    for found, part in ((u, slice(None, None, 2)), (middle, slice(1, None, 2))):
        np.testing.assert_allclose(found, 0.7 - rest[part], rtol=1e-12)
    after = t > 1e-12
    for found, part in ((du, slice(None, None, 2)), (dmiddle, slice(1, None, 2))):
        np.testing.assert_allclose(found[0], (t * rest)[part], atol=1e-15)
        np.testing.assert_allclose(found[1][after[part]], (-ETA * rest)[part][after[part]], rtol=1e-9)


@pytest.mark.parametrize("delay", DELAYS)
@pytest.mark.parametrize("lag", [0.0, LAG, 1.0 / ETA, 0.05])
@pytest.mark.parametrize("sample", [4, 9])
def test_a_field_behind_two_lags_approaches_a_delayed_step(sample, lag, delay):
    found = apply_two_lags(step_at(sample), ETA, lag, delay, H)
    t = elapsed(sample, delay, half_samples=True)
    rest = np.exp(-ETA * t)
    if lag == 1.0 / ETA:
        rest *= 1.0 + ETA * t
    elif lag:
        rest = (np.exp(-ETA * t) / ETA - lag * np.exp(-t / lag)) / (1.0 / ETA - lag)
    np.testing.assert_allclose(found, 0.7 - 0.5 * rest, rtol=1e-9)


@pytest.mark.parametrize("delay", [-1e-3, 0.0, 1e-3])
def test_a_drive_is_held_before_its_first_and_after_its_last_sample(delay):
    drive = np.array([0.1, 0.4, 0.4, 0.4, 0.9])
    expected = {-1e-3: [0.1, 0.4, 0.4, 0.4, 0.9], 0.0: [0.1, 0.1, 0.4, 0.4, 0.4], 1e-3: [0.1, 0.1, 0.1, 0.4, 0.4]}
    # A field this fast reaches the drive within a sample.
    u, middle, _, _ = compute_field(drive, 1e6, delay, H)
    np.testing.assert_allclose(u, expected[delay])
    np.testing.assert_allclose(middle, expected[delay][1:])
    np.testing.assert_allclose(apply_two_lags(drive, 1e6, 0.0, delay, H)[::2], expected[delay])


@pytest.mark.parametrize("name", [None, "second_lag", "two_layer_lag"])
@pytest.mark.parametrize("times", [2, 3, 4])
def test_a_decimated_motion_sees_the_field_of_all_samples_of_the_drive(name, times):
    effects = () if name is None else (active("coil_lag", name),)
    model = SimulationModel(LABORATORY, drive_delay=3e-4, effects=effects)
    fine = compute_damper_field(model, sine(seconds=1.201))
    coarse = compute_damper_field(model, sine(seconds=1.201).decimate(times))
    np.testing.assert_allclose(coarse.u, fine.u[::times][: len(coarse.u)], rtol=1e-12)
    between = fine.u[times // 2 :: times] if times % 2 == 0 else fine.middle[times // 2 :: times]
    np.testing.assert_allclose(coarse.middle, between[: len(coarse.middle)], rtol=1e-12)


@pytest.mark.parametrize(("form", "lags"), [("partial_lag", 1), ("two_layer_lag", 2)])
def test_a_slow_fraction_of_the_field_passes_its_own_lags(form, lags):
    count, lag, fraction = 400, 0.02, 0.4
    drive = np.where(np.arange(count) < 50, 0.0, 0.5)
    stroke = Excitation(1.0 / H, *np.zeros((3, count)), drive)
    effect = ActiveEffect(EFFECTS["coil_lag"], (lag, fraction), form)
    found = compute_damper_field(SimulationModel(LABORATORY._replace(eta=1e5), effects=(effect,)), stroke, False)
    t = np.arange(count - 50) * H
    slow = np.exp(-t / lag) * (1.0 if lags == 1 else 1.0 + t / lag)
    np.testing.assert_allclose(found.u[51:], 0.5 * (1.0 - fraction * slow[1:]), atol=1e-3)


def test_a_memory_changes_with_the_field_only():
    play = EFFECTS["magnetic_remanence"].find_form("play_operator")
    found = trace_memory(compile_once(play.memory), 1, 1.0, np.array([0.01, 1.5, 1.5, 1.49, 1.0]), 0.02, 1.0)
    np.testing.assert_allclose(found, [-0.01, -0.02, -0.02, -0.01, 0.02], atol=1e-15)


@pytest.mark.parametrize(("rise", "expected"), [(1.0, -0.02), (0.01, -0.01), (0.0, 0.0), (-1.0, 0.02)])
def test_a_memory_begins_with_the_change_to_the_first_field(rise, expected):
    play = EFFECTS["magnetic_remanence"].find_form("play_operator")
    effect = ActiveEffect(EFFECTS["magnetic_remanence"], (0.02, rise), "play_operator")
    assert trace_memory(compile_once(play.memory), 1, rise, np.ones(3), 0.02, rise) == pytest.approx(
        [expected] * 3
    )
    stroke = Excitation(1.0 / H, *np.zeros((3, 5)), np.ones(5))
    field = compute_damper_field(SimulationModel(LABORATORY, effects=(effect,)), stroke)
    np.testing.assert_allclose(field.u, 1.0 + expected)
    over_rise = field.du[field.columns.index(1) + 2]
    np.testing.assert_allclose(over_rise, -1.0 if abs(expected) < 0.02 else 0.0, atol=1e-6)


def test_memories_of_a_prandtl_ishlinskii_operator_are_the_mean_of_their_plays():
    form = EFFECTS["magnetic_remanence"].find_form("prandtl_ishlinskii")
    u = np.array([1.0, 0.2, 0.6, 0.5, -0.4, 1.0])
    expected = np.zeros(len(u))
    for order in (np.arange(form.memories) + 0.5) / form.memories:
        width, level = 0.5 * order**2.0, 0.0
        for i, value in enumerate(u):
            level = min(max(level, value - width), value + width)
            expected[i] += (level - value) / form.memories
    found = trace_memory(compile_once(form.memory), form.memories, 1.0, u, 0.3, 0.5, 2.0, 1.0)
    np.testing.assert_allclose(found, expected, atol=1e-15)


def test_a_deadband_follows_only_what_leaves_it():
    found = apply_deadband(np.array([0.0, 5e-7, 3e-6, 2.5e-6, 5e-7, -4e-6]), 1e-6)
    np.testing.assert_allclose(found, [0.0, 0.0, 2e-6, 2e-6, 1.5e-6, -3e-6], atol=1e-18)


@pytest.mark.parametrize("highest", [0.01, 0.2, 3.0])
@pytest.mark.parametrize(
    ("share", "zeta"), [(0.05, 0.5), (-0.1, -0.8), (0.0, 0.0), (0.001, 0.0004), (-1.0, -0.9975)]
)
def test_the_hysteresis_starts_saturated_in_motion_and_empty_at_rest(highest, share, zeta):
    velocity = highest * np.array([share, 0.3, -1.0, 0.5])
    assert estimate_settled_hysteresis(velocity) == pytest.approx(zeta, abs=1e-4)


def test_a_damper_that_never_moves_starts_with_an_empty_hysteresis():
    assert estimate_settled_hysteresis(np.zeros(3)) == 0.0


def cubic(t):
    """Return value, first and second derivative of a cubic."""
    return 2.0 - t + 3.0 * t**2 - 4.0 * t**3, -1.0 + 6.0 * t - 12.0 * t**2, 6.0 - 24.0 * t


def test_hermite_interpolation_is_exact_for_cubics():
    value, slope, _ = cubic(0.1 * np.arange(6))
    i, t = np.array([0, 2, 4]), np.array([0.25, 0.5, 0.9])
    for found, expected in zip(
        interpolate_hermite(value, slope, i, t, 0.1), cubic(0.1 * (i + t))[:2], strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-12)
    for found, expected in zip(
        interpolate_midpoints(value, slope, 0.1), cubic(0.1 * (np.arange(5) + 0.5))[:2], strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("lag", [0.0, 1e-7, 1e-5, 3e-3, 0.5])
def test_a_lag_follows_a_ramp_from_rest(lag):
    t = np.arange(40) * H
    ramp = np.where(t < 0.01, 5.0, 5.0 + 3.0 * (t - 0.01))
    since = np.maximum(t - 0.01, 0.0)
    behind = lag * (1.0 - np.exp(-since / lag)) if lag else 0.0
    both = apply_lag(np.column_stack([ramp, -ramp]), lag, H)
    np.testing.assert_allclose(
        both[:, 0], 5.0 + 3.0 * (since - behind), atol=1e-6 * lag + 1e-12 if lag > 1e-6 else 2e-7
    )
    np.testing.assert_array_equal(both[:, 1], -both[:, 0])


def test_derivatives_of_a_form_are_one_sided_at_a_bound():
    asked = []

    def form(p, q):
        asked.append((p, q))
        return p**3 + np.exp(q)

    quantities = (Quantity("p", "1", -10.0, 10.0, 5.0, ""), Quantity("q", "1", 0.0, 1.0, 5.0, ""))
    assert differentiate_by_parameters(form, (2.0, 0.0), quantities) == pytest.approx([12.0, 1.0], rel=1e-6)
    assert min(q for _, q in asked) == 0.0
    assert min(p for p, _ in asked) < 2.0 < max(p for p, _ in asked)
    np.testing.assert_allclose(differentiate_by_argument(lambda x: x**3, np.array([2.0]), 1e-4), 12.0, rtol=1e-8)


@pytest.mark.parametrize("delay", [2.4e-3, 5e-3, -1.3e-3])
def test_a_delayed_motion_is_that_of_an_earlier_instant(delay):
    t = np.arange(30) * H
    x, v, a = cubic(t)
    found = compute_damper_motion(
        SimulationModel(LABORATORY, force_delay=delay), Excitation(1.0 / H, x, v, a, np.zeros(30))
    )
    early = np.clip(t - delay, 0.0, t[-1])
    for array, expected in zip((found.x, found.v, found.a), cubic(early), strict=True):
        np.testing.assert_allclose(array, expected, rtol=1e-11)
    inside = (t - delay > 1e-9) & (t - delay < t[-1] - 1e-9)
    _, v, a = cubic(early)
    np.testing.assert_allclose(found.dx[0], np.where(inside, -v, 0.0), rtol=1e-9)
    np.testing.assert_allclose(found.dv[0], np.where(inside, -a, 0.0), rtol=1e-9)
    np.testing.assert_allclose(found.da, np.where(inside, 24.0, 0.0), rtol=1e-9)


def test_delays_of_force_and_displacement_act_against_each_other():
    effects = (
        ActiveEffect(EFFECTS["force_delay"], (0.003,)),
        ActiveEffect(EFFECTS["displacement_delay"], (0.005,)),
    )
    both = compute_damper_motion(SimulationModel(LABORATORY, force_delay=0.001, effects=effects), sine())
    plain = compute_damper_motion(SimulationModel(LABORATORY, force_delay=-0.001), sine())
    np.testing.assert_allclose(both.x, plain.x, rtol=1e-9)
    np.testing.assert_array_equal(both.dx[1], -both.dx[0])
    np.testing.assert_array_equal(both.dv[1], -both.dv[0])


@pytest.mark.parametrize(
    ("form", "values"), [("saturating", (1.5e-4, -2e-4, 0.012)), ("polynomial", (3e-5, 5e-5))]
)
def test_a_nonlinear_displacement_channel_is_inverted(form, values):
    true = 0.015 * np.sin(np.linspace(0.0, 6.0, 400))
    error = EFFECTS["displacement_nonlinearity"].find_form(form).function
    gain = 1.0 + (error(true + 1e-6, *values) - error(true - 1e-6, *values)) / 2e-6
    stroke = Excitation(1.0 / H, true + error(true, *values), 0.1 * gain, np.zeros(400), np.zeros(400))
    effect = ActiveEffect(EFFECTS["displacement_nonlinearity"], values, form)
    found = compute_damper_motion(SimulationModel(LABORATORY, effects=(effect,)), stroke)
    np.testing.assert_allclose(found.x, true, atol=1e-10)
    np.testing.assert_allclose(found.v, 0.1, rtol=1e-6)


def heated(power):
    return Excitation(1.0 / H, *np.zeros((3, len(power))), np.zeros(len(power)), power=power)


def test_stored_energy_approaches_power_times_recovery_time():
    t = np.arange(500) * H
    np.testing.assert_allclose(
        compute_stored_energy(heated(np.full(500, 30.0)), 0.2),
        6.0 * (1.0 - np.exp(-t / 0.2)),
        rtol=1e-12,
        atol=1e-15,
    )
    assert compute_stored_energy(heated(np.array([0.0, 10.0, 30.0])), 1e9) == pytest.approx([0.0, 5e-3, 25e-3])
    assert not compute_stored_energy(replace(heated(t), power=None), 0.2).any()


def test_heat_softens_at_the_samples_and_between_them():
    stroke = heated(np.full(4, 1000.0))
    effect = ActiveEffect(EFFECTS["viscous_heating"], (0.1, 1e9))
    model = SimulationModel(LABORATORY, effects=(effect,))
    found = compute_scale_factors(model, stroke, compute_damper_motion(model, stroke), sensitivities=False)
    # One joule per sample and a tenth of softening per joule.
    np.testing.assert_allclose(found.values[1], [1.0, 1 / 1.1, 1 / 1.2, 1 / 1.3], rtol=1e-6)
    np.testing.assert_allclose(found.midpoints[2], [1 / 1.05, 1 / 1.15, 1 / 1.25], rtol=1e-6)
    np.testing.assert_array_equal(found.values[0], 1.0)


def test_factors_of_two_effects_multiply():
    stroke = sine(seconds=0.2)
    both = tuple(active(name) for name in ("direction_asymmetry", "shear_thinning"))
    found = []
    for effects in (both, both[:1], both[1:]):
        model = SimulationModel(LABORATORY, effects=effects)
        found.append(compute_scale_factors(model, stroke, compute_damper_motion(model, stroke)).values)
    np.testing.assert_allclose(found[0], found[1] * found[2], rtol=1e-12)


def make_stroke():
    x, v, a = cubic(np.arange(8) * 0.1)
    return Excitation(10.0, x, v, a, np.arange(15.0), start=3.0, power=np.arange(8.0), drive_oversampling=2)


def test_an_excitation_counts_time_from_the_start_of_the_run():
    np.testing.assert_allclose(make_stroke().time, [3.0, 3.1, 3.2, 3.3, 3.4, 3.5, 3.6, 3.7])
    np.testing.assert_array_equal(make_stroke().sampled_drive, [0, 2, 4, 6, 8, 10, 12, 14])


def test_decimation_keeps_every_nth_sample_and_the_whole_drive_up_to_the_last():
    thin = make_stroke().decimate(3)
    np.testing.assert_array_equal(thin.displacement, make_stroke().displacement[[0, 3, 6]])
    np.testing.assert_array_equal(thin.velocity, make_stroke().velocity[[0, 3, 6]])
    np.testing.assert_array_equal(thin.acceleration, make_stroke().acceleration[[0, 3, 6]])
    np.testing.assert_array_equal(thin.power, [0, 3, 6])
    np.testing.assert_array_equal(thin.drive, np.arange(13.0))
    assert (thin.rate, thin.drive_oversampling, thin.start) == (pytest.approx(10 / 3), 6, 3.0)
    assert len(make_stroke().decimate(7).displacement) == 2


@pytest.mark.parametrize("times", [2, 3])
def test_oversampling_interpolates_the_motion_and_holds_the_drive(times):
    fine = make_stroke().oversample(times)
    t = np.arange(7 * times + 1) * 0.1 / times
    assert fine.rate == 10.0 * times
    for found, expected in zip((fine.displacement, fine.velocity, fine.acceleration), cubic(t), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(fine.power, 10.0 * t, atol=1e-12)
    np.testing.assert_array_equal(fine.drive, np.append(np.repeat(2.0 * np.arange(7), times), 14.0))
    assert (fine.start, fine.drive_oversampling) == (3.0, 1)


def test_columns_count_the_parameters_of_all_effects():
    model = SimulationModel(LABORATORY, effects=tuple(map(active, ("gas_spring", "moving_mass", "end_stop"))))
    assert [at for at, _, _ in model.select_forms("parallel_force")] == [0, 3]
    assert [at for at, _, _ in model.select_forms("inertia")] == [2]
