"""Drift of the zero that slow noise explains."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.damper.effects import EFFECTS, Effect, Form
from identification.gap.noise import DRIFT_CURVE, compute_noise_drift
from identification.simulate import ActiveEffect

RATE, COUNT = 100.0, 6000


def make_problem(pieces=1):
    time = np.arange(COUNT) / RATE
    excitation = SimpleNamespace(time=time, sampled_drive=np.zeros(COUNT), rate=RATE)
    piece = SimpleNamespace(excitation=excitation, force=np.zeros(COUNT))
    return SimpleNamespace(pieces=(piece,) * pieces)


def make_fit(name="force_drift", form="sinusoidal", values=(3.0, 0.0, 30.0, 1e5)):
    return SimpleNamespace(active_effects=(ActiveEffect(EFFECTS[name], values, form),))


def test_a_drift_of_the_size_of_slow_noise_is_noise():
    drift = compute_noise_drift(make_fit(), make_problem(), 1.0)
    assert drift == pytest.approx(3.0 * np.cos(2.0 * np.pi * np.arange(COUNT) / RATE / 30.0), abs=0.01)


def test_a_drift_that_exceeds_slow_noise_is_an_effect():
    assert not compute_noise_drift(make_fit(), make_problem(), 0.1).any()
    assert not compute_noise_drift(make_fit(), make_problem(), 0.0).any()


def test_a_drift_with_faster_waves_may_contain_more_noise():
    """Both have a variance of 4.5, of which noise explains 10 for each factor e of the frequency."""
    slow, fast = make_fit(values=(3.0, 0.0, 60.0, 1e5)), make_fit(values=(3.0, 0.0, 5.0, 1e5))
    assert not compute_noise_drift(slow, make_problem(), 0.3).any()
    assert compute_noise_drift(fast, make_problem(), 0.3).any()


def test_a_change_of_the_mean_is_no_drift():
    settled = make_fit(form="settling", values=(5.0, 1e-3))
    assert np.abs(compute_noise_drift(settled, make_problem(), 1.0)).max() < 5.0
    assert compute_noise_drift(settled, make_problem(), 1.0).mean() == pytest.approx(0.0, abs=1e-9)


def test_other_effects_are_no_drift():
    hum = make_fit("mains_hum", EFFECTS["mains_hum"].forms[0].name, EFFECTS["mains_hum"].forms[0].starts[0])
    assert not compute_noise_drift(hum, make_problem(2), 1e9).any()
    assert len(compute_noise_drift(hum, make_problem(2), 1e9)) == 2 * COUNT


@pytest.mark.parametrize(("name", "is_noise"), [(DRIFT_CURVE, True), ("curve", False)])
def test_a_curve_over_time_in_place_of_a_drift_may_be_noise_as_well(name, is_noise):
    def follow(variables, size):
        return size * np.cos(2.0 * np.pi * variables["time"] / 30.0)

    curve = Effect("curve", "force_channel", "time", "", (Form(name, "channel_function", (), (), follow),))
    fit = SimpleNamespace(active_effects=(ActiveEffect(curve, (3.0,), name),))
    assert compute_noise_drift(fit, make_problem(), 1.0).any() == is_noise
    assert not compute_noise_drift(fit, make_problem(), 0.1).any()
