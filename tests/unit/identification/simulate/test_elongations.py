"""Elongation of the mounting as a function of its force: in series with springs, and with derivatives."""

from dataclasses import replace

import numpy as np
import pytest

from identification.damper.definitions import EffectFile, make_effect
from identification.damper.effects import EFFECTS, compute_elongation
from identification.simulate import ActiveEffect, SimulationModel, simulate
from tests.support.effects import LABORATORY, active, sine
from tests.support.sensitivities import compute_worst_error

MODEL = SimulationModel(LABORATORY, y0=1e-4, force_delay=3.3e-4, drive_delay=1e-4)
COMPLIANCE = 1e-6
STIFFENING, JOINT = EFFECTS["fixture_compliance"].forms[1:]


def elongate(expression="a*force", curve=None, **values):
    """An active effect whose elongation is an expression with these parameters, or a curve."""
    file = EffectFile(
        name="own",
        stage="mounting",
        place="mounting",
        variables=["force"],
        expression=None if curve else expression,
        parameters={s: {"value": v, "unit": "m/N", "lo": -1.0, "hi": 1.0} for s, v in values.items()},
        curve=curve,
    )
    return ActiveEffect(make_effect(file), tuple(values.values()))


def play(*effects):
    return simulate(replace(MODEL, effects=effects), sine()).force


def spring(*values, form="linear"):
    return ActiveEffect(EFFECTS["fixture_compliance"], values, form)


def test_an_elongation_proportional_to_the_force_is_a_linear_spring():
    assert play(elongate(a=COMPLIANCE)) == pytest.approx(play(spring(COMPLIANCE)), abs=1e-6)


@pytest.mark.parametrize(("form", "values"), [(STIFFENING, (1e-6, 3e6)), (JOINT, (1e-6, 100.0, 2.5))])
def test_a_curve_of_a_spring_of_the_library_is_that_spring(form, values):
    compliance, gap, hardening, _, ratio = form.function(*values)
    forces = np.linspace(-3000.0, 3000.0, 1000)
    found = [compute_elongation(f, compliance, gap, hardening, ratio) for f in forces]
    curve = {"variable": "force", "unit": "m", "x": list(forces), "value": found}
    expected = play(spring(*values, form=form.name))
    assert np.abs(play(elongate(curve=curve)) - expected).max() < 2e-3 * expected.std()
    assert np.abs(play() - expected).max() > 0.1 * expected.std()


def test_an_elongation_is_in_series_with_a_spring_and_with_another():
    expected = play(spring(3 * COMPLIANCE))
    assert play(elongate(a=2 * COMPLIANCE), spring(COMPLIANCE)) == pytest.approx(expected, abs=1e-6)
    assert play(elongate(a=2 * COMPLIANCE), elongate(a=COMPLIANCE)) == pytest.approx(expected, abs=1e-6)


def test_a_decreasing_elongation_counts_as_rigid():
    rigid = play(elongate(a=0.0))
    assert np.array_equal(play(elongate(a=-COMPLIANCE)), rigid)
    assert np.abs(rigid - play()).max() < 0.01 * rigid.std()


@pytest.mark.parametrize(
    "effects",
    [
        (elongate(a=COMPLIANCE),),
        (elongate("a*tanh(force/50) + b*force", a=1e-4, b=1e-7),),
        (elongate(a=COMPLIANCE), active("clevis_backlash", "greased_pin"), active("fixture_compliance")),
    ],
    ids=["spring", "soft in the middle", "in series with film and spring"],
)
def test_sensitivities_agree_with_central_differences(effects):
    # The derivative is exact at the samples and interpolated between them.
    assert compute_worst_error(replace(MODEL, effects=effects), sine()) < 1e-2


def test_a_step_is_solved_where_the_mounting_is_much_softer_in_its_middle():
    force = play(elongate("a*tanh(force/2)", a=2e-4))
    assert np.isfinite(force).all()
    # The actuator has to cross the soft middle of 0.4 mm before the damper moves on.
    free = play(active("clevis_backlash", "free_pin")._replace(values=(4e-4, 1e-4)))
    assert np.sqrt(np.mean((force - free) ** 2)) < 0.05 * force.std()
    assert np.sqrt(np.mean((play() - free) ** 2)) > 0.1 * force.std()


@pytest.mark.parametrize("decimation", [1, 4, 10])
def test_a_very_stiff_mount_has_the_force_of_a_rigid_one_at_any_rate(decimation):
    stroke = sine().decimate(decimation)
    rigid = simulate(MODEL, stroke).force
    stiff = simulate(replace(MODEL, effects=(spring(1e-11),)), stroke).force
    assert np.abs(stiff - rigid).max() < 0.01 * rigid.std()
    assert np.sqrt(np.mean((stiff - rigid) ** 2)) < 1e-3 * rigid.std()
