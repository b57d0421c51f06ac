"""Defined effects in the simulated chain: each place, exact sensitivities, and formulas of library effects."""

from dataclasses import replace

import numpy as np
import pytest

from identification.damper.definitions import STAGE_OF, EffectFile, make_effect
from identification.simulate import (
    ActiveEffect,
    DamperVariables,
    Excitation,
    SimulationModel,
    make_coil_variables,
    simulate,
)
from tests.support.effects import LABORATORY, active, sine
from tests.support.sensitivities import compute_worst_error

MODEL = SimulationModel(LABORATORY, y0=1e-4, force_delay=3.3e-4, drive_delay=1e-4)
CASES = {
    "drive": ("a*tanh(drive/2) + b*drive_history + c*time*drive", ("drive", "drive_history", "time"), 0.02),
    "field": ("a*drive*drive + b*drive_history + c*time*drive", ("drive", "drive_history", "time"), 0.02),
    "damper_gain": ("a*tanh(velocity/0.05) + b*displacement/0.01", ("velocity", "displacement"), 0.05),
    "parallel_force": ("(a + b*drive)*tanh(velocity/0.02) + c*displacement/0.01", None, 10.0),
    "mounting": ("a*acceleration/10 + b*travel_since_reversal/0.01", None, 5.0),
    "force_channel": ("a*sin(20*time) + b*tanh(force/300)", ("time", "force"), 5.0),
    "displacement_channel": ("a*(displacement/0.01)**2 + b*velocity/0.1", ("displacement", "velocity"), 1e-4),
}
DAMPER = ("velocity", "displacement", "drive"), ("acceleration", "travel_since_reversal")


def define(place, expression, variables, size):
    """Return an active effect whose parameters a, b, c have this size as far as the expression uses them."""
    variables = variables or next(v for v in DAMPER if all(name in expression for name in v))
    symbols = [s for s in "abc" if f"{s}*" in expression or f"({s}" in expression or f"{s} " in expression]
    parameters = {s: {"value": size, "unit": "1", "lo": -1e3, "hi": 1e3} for s in symbols}
    file = EffectFile(
        name="own",
        stage=STAGE_OF[place],
        place=place,
        variables=list(variables),
        expression=expression,
        parameters=parameters,
    )
    return ActiveEffect(make_effect(file), (size,) * len(symbols))


@pytest.mark.parametrize("place", CASES)
def test_sensitivities_agree_with_central_differences(place):
    effect = define(place, *CASES[place])
    # A gain is interpolated half way between samples, and a derivative over time is one of differences.
    limit = 2e-3 if place in ("damper_gain", "displacement_channel") else 2e-5
    assert compute_worst_error(replace(MODEL, effects=(effect,)), sine()) < limit


@pytest.mark.parametrize("place", CASES)
def test_a_defined_effect_shows_in_the_force(place):
    plain = simulate(MODEL, sine()).force
    force = simulate(replace(MODEL, effects=(define(place, *CASES[place]),)), sine()).force
    assert 0.5 < np.sqrt(np.mean((force - plain) ** 2)) < 0.5 * np.std(plain)


@pytest.mark.parametrize(
    ("place", "expression", "variables", "library"),
    [
        ("mounting", "m*acceleration", ["acceleration"], "moving_mass"),
        ("parallel_force", "m*velocity*abs(velocity)", ["velocity"], "orifice_turbulence"),
    ],
)
def test_a_formula_of_the_library_gives_the_same_force(place, expression, variables, library):
    known = active(library)
    parameters = {"m": {"value": known.values[0], "unit": "1", "lo": 0.0, "hi": 1e9}}
    own = EffectFile(
        name="own",
        stage=STAGE_OF[place],
        place=place,
        variables=variables,
        expression=expression,
        parameters=parameters,
    )
    if library == "orifice_turbulence" and len(known.values) > 1:
        pytest.fail("the reference of this test needs a form of one parameter")
    forces = [
        simulate(replace(MODEL, effects=(effect,)), sine()).force
        for effect in (known, ActiveEffect(make_effect(own), known.values[:1]))
    ]
    assert forces[1] == pytest.approx(forces[0], abs=1e-9 * np.abs(forces[0]).max())


def test_variables_of_the_past_follow_reversals_rests_and_energy():
    x = np.concatenate([np.linspace(0, 2e-3, 101), np.linspace(2e-3, 1e-3, 51)[1:], np.full(300, 1e-3)])
    x = np.concatenate([x, np.linspace(1e-3, 3e-3, 101)[1:]])
    stroke = Excitation(1e3, x, *np.zeros((2, len(x))), np.zeros(len(x)), power=np.full(len(x), 5.0))
    variables = DamperVariables(stroke, x, stroke.velocity, stroke.acceleration)
    reversal, rest = variables["travel_since_reversal"], variables["travel_since_rest"]
    assert reversal[100] == pytest.approx(2e-3, abs=3e-6)
    assert reversal[150] == pytest.approx(1e-3, abs=3e-6)
    assert reversal[-1] == pytest.approx(2e-3, abs=3e-6)
    assert rest[150] == pytest.approx(3e-3, abs=3e-6)
    assert rest[440] == 0.0
    assert rest[-1] == pytest.approx(2e-3, abs=3e-6)
    assert variables["dissipated_energy"][-1] == pytest.approx(5.0 * (len(x) - 1) / 1e3)


def test_the_history_of_a_drive_is_its_last_reversal():
    drive = np.array([0.0, 1.0, 3.0, 3.0, 2.0, 1.0, 1.0, 4.0])
    found = make_coil_variables(drive, 2.0, 0.5)
    assert found["drive_history"].tolist() == [0.0, 0.0, 0.0, 0.0, 3.0, 3.0, 3.0, 1.0]
    assert found["time"][:2].tolist() == [2.0, 2.5]
