"""Step responses of drive and force channel as defined effects: their force, and its derivatives."""

from dataclasses import replace

import numpy as np
import pytest

from identification.damper.effects import EFFECTS
from identification.simulate import ActiveEffect, SimulationModel, simulate
from tests.support.discoveries import define
from tests.support.effects import LABORATORY, active, sine
from tests.support.sensitivities import compute_worst_error

MODEL = SimulationModel(LABORATORY, y0=1e-4, force_delay=3.3e-4, drive_delay=1e-4)
LAG = 8e-3


def respond(expression="1-a*exp(-time/s)", **values):
    """An active step response of the force channel."""
    return define("force_channel", expression, ("force",), "step_response", **values)


def follow(expression="1-a*exp(-time/s)", **values):
    """An active step response of the drive."""
    return define("drive", expression, ("drive_history",), "step_response", **values)


def play(*effects):
    return simulate(replace(MODEL, effects=effects), sine()).force


def test_a_step_response_of_one_lag_is_the_filter_of_the_library():
    expected = play(ActiveEffect(EFFECTS["force_filter"], (LAG,)))
    assert np.abs(play(respond(a=1.0, s=LAG)) - expected).max() < 1e-3 * expected.std()
    assert np.abs(play() - expected).max() > 0.1 * expected.std()


def test_a_late_sharp_step_is_the_delay_of_the_library():
    expected = play(ActiveEffect(EFFECTS["force_delay"], (LAG,)))
    late = play(respond("0.5+0.5*tanh((time-m)/s)", m=LAG, s=2e-4))
    assert np.abs(late - expected)[20:].max() < 0.05 * expected.std()
    assert np.sqrt(np.mean((late - expected)[20:] ** 2)) < 0.005 * expected.std()


def test_a_step_response_acts_on_all_forces_of_the_channel():
    drift = active("force_drift")
    both = play(drift, respond(a=1.0, s=LAG))
    assert both == pytest.approx(play(drift, ActiveEffect(EFFECTS["force_filter"], (LAG,))), abs=1.0)


@pytest.mark.parametrize(("form", "values"), [("second_lag", (0.02,)), ("partial_lag", (0.02, 0.6))])
def test_a_step_response_of_the_drive_is_the_lag_of_the_library(form, values):
    expected = play(ActiveEffect(EFFECTS["coil_lag"], values, form))
    late = play(follow(a=values[1] if values[1:] else 1.0, s=values[0]))
    assert np.abs(late - expected).max() < 0.03 * np.abs(play() - expected).max()


@pytest.mark.parametrize(
    "effects",
    [
        (follow(a=0.7, s=0.02),),
        (active("coil_lag"), follow(a=0.7, s=LAG), active("field_saturation")),
        (respond(a=0.7, s=LAG),),
        (active("moving_mass"), active("force_drift"), respond("1-a*(1+time/s)*exp(-time/s)", a=1.2, s=LAG)),
        (active("fixture_compliance"), respond(a=0.7, s=LAG), active("force_filter")),
    ],
    ids=[
        "drive",
        "drive with lag and saturation",
        "one lag",
        "after inertia and drift",
        "on a compliant mount, before a filter",
    ],
)
def test_sensitivities_agree_with_central_differences(effects):
    assert compute_worst_error(replace(MODEL, effects=effects), sine()) < 1e-2
