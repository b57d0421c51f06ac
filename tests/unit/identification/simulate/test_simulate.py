"""Compiled simulation against an independent integrator, and its sensitivities against differences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from identification.damper import law
from identification.damper.coordinates import Coordinates, to_coordinates
from identification.damper.effects import EFFECTS
from identification.damper.parameter_sets import find_parameter_set
from identification.simulate import SENSITIVITY_COLUMNS, ActiveEffect, Excitation, SimulationModel, simulate
from tests.support.damper_box import LABORATORY_BOX
from tests.support.sensitivities import compare_sensitivities

LABORATORY = to_coordinates(find_parameter_set("laboratory").parameters)
RATE = 1000.0
LEVELS = np.array([0.0, 0.3, 0.1, 0.5, 0.2])
SOME_EFFECTS = (
    ActiveEffect(EFFECTS["gas_spring"], (90.0, 0.05)),
    ActiveEffect(EFFECTS["seal_friction"], (20.0, 10.0, 0.015)),
    ActiveEffect(EFFECTS["clevis_backlash"], (2e-4,)),
    ActiveEffect(EFFECTS["force_delay"], (0.0021,)),
)


def sine(amplitude=0.015, frequency=2.5, seconds=2.0, drive=None):
    t = np.arange(round(seconds * RATE)) / RATE
    w = 2 * np.pi * frequency
    steps = LEVELS[(t / 0.41).astype(int) % len(LEVELS)] if drive is None else np.full(len(t), drive)
    return Excitation(
        RATE, amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), -amplitude * w * w * np.sin(w * t), steps
    )


def reference(c: Coordinates, amplitude: float, frequency: float, seconds: float, drive: float):
    """Force by scipy's Radau at tight tolerance from the law as written."""
    w = 2 * np.pi * frequency
    A, beta, gamma = 1 / c.D_y, c.rho / c.D_y, (1 - c.rho) / c.D_y
    alpha, c0, c1 = c.F_a + c.F_b * drive, c.c0_a + c.c0_b * drive, c.c1_a + c.c1_b * drive

    def y_rate(t, y, z):
        return law.compute_inner_velocity(
            amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), y, z, alpha, c0, c1, c.k0
        )

    def rates(t, state):
        slip = amplitude * w * np.cos(w * t) - y_rate(t, *state)
        return [y_rate(t, *state), law.compute_hysteresis_rate(slip, state[1], A, beta, gamma, c.n)]

    t = np.arange(round(seconds * RATE)) / RATE
    # The stroke starts at its highest speed, twenty times that of rest.
    start = [0.0, 400.0 / 401.0]
    found = solve_ivp(rates, (0, t[-1]), start, "Radau", t, rtol=1e-9, atol=1e-12, max_step=1e-3)
    return law.compute_force(y_rate(t, *found.y), amplitude * np.sin(w * t), c1, c.k1, c.f0 / c.k1)


@pytest.mark.parametrize(
    ("name", "amplitude", "frequency", "drive"),
    [("laboratory", 0.01, 1.0, 0.3), ("laboratory", 0.005, 2.5, 0.0), ("spencer_1997", 0.015, 2.5, 1.5)],
)
def test_force_agrees_with_an_independent_integrator(name, amplitude, frequency, drive):
    c = to_coordinates(find_parameter_set(name).parameters)
    exact = reference(c, amplitude, frequency, 1.2, drive)
    found = simulate(SimulationModel(c), sine(amplitude, frequency, 1.2, drive)).force
    assert np.sqrt(np.mean((found - exact) ** 2)) < 2e-4 * exact.std()
    fine = simulate(SimulationModel(c), sine(amplitude, frequency, 1.2, drive), max_travel=0.005).force
    assert np.abs(fine - exact).max() < 1e-4 * np.abs(exact).max()


@pytest.mark.parametrize("effects", [(), SOME_EFFECTS[:2], SOME_EFFECTS], ids=["law", "forces", "all"])
def test_sensitivities_agree_with_central_differences_within_1e_6(effects):
    model = SimulationModel(LABORATORY, y0=1e-4, force_delay=3.3e-4, drive_delay=1e-4, effects=effects)
    for name, sensitivity, difference in compare_sensitivities(model, sine(), 2e-5):
        assert np.sqrt(np.mean((sensitivity - difference) ** 2)) < 1e-6 * np.sqrt(np.mean(sensitivity**2)), name


def test_sensitivities_do_not_change_the_force():
    plain, rich = (simulate(SimulationModel(LABORATORY), sine(), sensitivities=s) for s in (False, True))
    np.testing.assert_allclose(plain.force, rich.force, rtol=1e-11, atol=1e-9)


def test_every_corner_of_the_search_bounds_gives_a_finite_force():
    """Only k0 >= 0 is tested, because the law itself is unstable for k0 < 0."""
    random = np.random.default_rng(7)
    stroke = sine(seconds=1.0)
    for _ in range(200):
        corner = {q.symbol: random.choice([q.low, q.high]) for q in LABORATORY_BOX}
        corner |= {"c0_b": 0.0, "c1_b": 0.0, "k0": abs(corner["k0"])}
        found = simulate(SimulationModel(Coordinates(**corner)), stroke, sensitivities=True)
        assert np.isfinite(found.force).all()
        assert np.isfinite(found.sensitivities).all()
        assert np.abs(found.zeta).max() < 2.0


def test_force_is_accurate_for_random_dampers_all_over_the_search_bounds():
    random = np.random.default_rng(3)
    stroke = sine(0.01, 2.0, 2.0)
    finest = np.full(len(stroke.drive) - 1, 250, np.uint8)
    for _ in range(60):
        values = {q.symbol: random.uniform(q.low, q.high) for q in LABORATORY_BOX}
        values |= {
            q.symbol: np.exp(random.uniform(np.log(q.low), np.log(q.high))) for q in LABORATORY_BOX if q.low > 0
        }
        slopes = {"c0_b": values["c0_a"], "c1_b": values["c1_a"]}
        values |= {name: random.uniform(-1.8, 4.0) * base for name, base in slopes.items()}
        c = Coordinates(**values)._replace(k0=abs(values["k0"]))
        exact = simulate(SimulationModel(c), stroke, finest).force
        error = simulate(SimulationModel(c), stroke).force - exact
        assert error[20:].std() < 5e-4 * exact.std(), c


def test_steps_are_refined_only_where_the_loop_turns():
    plan = simulate(SimulationModel(LABORATORY), sine(0.01, 1.0, 3.0, 0.3)).step_counts
    assert plan.max() >= 4
    assert (plan == 1).mean() > 0.95


def test_eta_is_invisible_at_constant_drive():
    found = simulate(SimulationModel(LABORATORY), sine(drive=0.3), sensitivities=True)
    assert np.abs(found.sensitivities[:, SENSITIVITY_COLUMNS.index("eta")]).max() == 0.0


def test_field_follows_a_step_with_its_rate_constant():
    stroke = sine(seconds=0.5)
    drive = np.where(np.arange(len(stroke.drive)) < 100, 0.0, 0.4)
    field = simulate(SimulationModel(LABORATORY), replace(stroke, drive=drive)).field
    at = 100 + 25
    assert field[at] == pytest.approx(0.4 * (1 - np.exp(-LABORATORY.eta * 0.025)), rel=1e-12)


def test_force_delay_shifts_the_force():
    late = simulate(SimulationModel(LABORATORY, force_delay=0.004), sine(drive=0.3)).force
    prompt = simulate(SimulationModel(LABORATORY), sine(drive=0.3)).force
    np.testing.assert_allclose(late[300:], prompt[296:-4], rtol=0, atol=2e-3 * np.abs(prompt).max())
