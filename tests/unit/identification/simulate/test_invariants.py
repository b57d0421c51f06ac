"""Invariants of the integrators: energy balance, order of convergence between reversals, symmetry."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from identification.arrays import Array
from identification.damper import Coordinates
from identification.simulate import ActiveEffect, Excitation, Response, SimulationModel, simulate
from tests.support.damper_box import LABORATORY_BOX
from tests.support.effects import LABORATORY, active

DRIVE = 0.3
SYMMETRIC = (
    "seal_friction",
    "orifice_turbulence",
    "end_stop",
    "clevis_backlash",
    "fixture_compliance",
    "moving_mass",
    "shear_thinning",
    "force_filter",
)
"""Effects without a direction in their usual form."""


def cycles(rate: float, count: int, amplitude: float = 0.01, frequency: float = 2.0) -> Excitation:
    """Return some cycles of a sine at one drive, with their last point."""
    t, w = np.arange(round(count / frequency * rate) + 1) / rate, 2 * np.pi * frequency
    x, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
    return Excitation(rate, x, v, -(w**2) * x, np.full(len(t), DRIVE), power=400.0 * np.abs(v))


def one_way(rate: float) -> Excitation:
    """Return 0.3 s of motion in one direction, from rest, with a velocity that rises and oscillates smoothly."""
    t, w = np.arange(round(0.3 * rate) + 1) / rate, 2 * np.pi * 5.0
    x = 0.01 * t**2 + 0.004 * (t - np.sin(w * t) / w)
    v, a = 0.02 * t + 0.004 * (1 - np.cos(w * t)), 0.02 + 0.004 * w * np.sin(w * t)
    return Excitation(rate, x, v, a, np.full(len(t), DRIVE))


def draw_passive(random: np.random.Generator) -> Coordinates:
    """Draw coordinates whose elements all dissipate: no negative spring, and gamma not below the size of beta."""
    values = {q.symbol: random.uniform(q.low, q.high) for q in LABORATORY_BOX}
    values |= {
        q.symbol: float(np.exp(random.uniform(np.log(q.low), np.log(q.high)))) for q in LABORATORY_BOX if q.low > 0
    }
    values |= {"c0_b": 0.0, "c1_b": 0.0, "k0": abs(values["k0"]), "rho": min(values["rho"], 0.5)}
    return Coordinates(**values)


def force_with(steps: int, model: SimulationModel, stroke: Excitation) -> Array:
    """Return the force (N,) [N] with a number of steps in every sample."""
    return simulate(model, stroke, np.full(len(stroke.drive) - 1, steps, np.uint8)).force


def integrate_energy(c: Coordinates, stroke: Excitation, response: Response) -> dict[str, float]:
    """Return work on the damper, dissipated and stored energy of its elements [J] over an excitation."""
    x, v, y, zeta = stroke.displacement, stroke.velocity, response.y, response.zeta
    yield_force, c0, c1 = c.F_a + c.F_b * DRIVE, c.c0_a + c.c0_b * DRIVE, c.c1_a + c.c1_b * DRIVE
    y_rate = (response.force - c.k1 * x + c.f0) / c1
    slip, size = v - y_rate, np.abs(zeta)
    # zeta' = (slip - loss) / D_y, so F zeta slip is F D_y zeta zeta' (stored) plus F zeta loss (dissipated power).
    loss = ((1 - c.rho) * np.abs(slip) * zeta + c.rho * slip * size) * size ** (c.n - 1)
    stored = 0.5 * (c.k1 * x**2 + c.k0 * (x - y) ** 2 + yield_force * c.D_y * zeta**2) - c.f0 * x
    dt = 1.0 / stroke.rate
    return {
        "work": float(trapezoid(response.force * v, dx=dt)),
        "dashpots": float(trapezoid(c1 * y_rate**2 + c0 * slip**2, dx=dt)),
        "hysteresis": float(trapezoid(yield_force * zeta * loss, dx=dt)),
        "stored": float(stored[-1] - stored[0]),
    }


@pytest.mark.parametrize("count", [1, 2.25])
def test_work_is_dissipated_plus_stored_energy(count):
    stroke = cycles(20_000.0, count)
    energy = integrate_energy(LABORATORY, stroke, simulate(SimulationModel(LABORATORY), stroke))
    balance = energy["dashpots"] + energy["hysteresis"] + energy["stored"]
    assert balance == pytest.approx(energy["work"], rel=1e-4)
    assert min(energy["dashpots"], energy["hysteresis"]) > 0.05 * energy["work"]


def test_a_passive_damper_dissipates_over_every_closed_cycle():
    random, stroke = np.random.default_rng(5), cycles(2000.0, 3)
    period = (len(stroke.drive) - 1) // 3
    for _ in range(40):
        c = draw_passive(random)
        response = simulate(SimulationModel(c), stroke)
        power = response.force * stroke.velocity
        for start in (period, 2 * period):
            assert trapezoid(power[start : start + period + 1], dx=1 / stroke.rate) > 0.0, c
        whole = integrate_energy(c, stroke, response)
        assert whole["dashpots"] > 0.0, c
        assert whole["hysteresis"] > 0.0, c


@pytest.mark.parametrize("effects", [(), ("fixture_compliance",)], ids=["rigid", "compliant mount"])
def test_halving_the_step_between_reversals_converges_with_second_order(effects):
    stroke, model = one_way(1000.0), SimulationModel(LABORATORY, effects=tuple(map(active, effects)))
    exact, halvings = force_with(240, model, stroke), 5
    errors = [np.std(force_with(2**k, model, stroke) - exact) for k in range(halvings + 1)]
    assert np.all(np.diff(errors) < 0.0)
    assert np.log2(errors[0] / errors[-1]) / halvings == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("effects", [(), ("fixture_compliance",)], ids=["rigid", "compliant mount"])
def test_smaller_steps_converge_across_reversals(effects):
    stroke, model = cycles(1000.0, 2), SimulationModel(LABORATORY, effects=tuple(map(active, effects)))
    exact = force_with(240, model, stroke)
    errors = [np.std(force_with(steps, model, stroke) - exact) for steps in (1, 4, 16, 64)]
    assert np.all(np.diff(errors) < 0.0)
    assert errors[-1] < 0.02 * errors[0]


@pytest.mark.parametrize("name", [None, *SYMMETRIC])
def test_the_force_reverses_with_the_motion(name):
    effects: tuple[ActiveEffect, ...] = () if name is None else (active(name),)
    model = SimulationModel(LABORATORY._replace(f0=0.0), y0=1e-4, effects=effects)
    stroke = cycles(1000.0, 2.25, amplitude=0.015)
    reversed_stroke = replace(
        stroke, displacement=-stroke.displacement, velocity=-stroke.velocity, acceleration=-stroke.acceleration
    )
    forward, back = simulate(model, stroke), simulate(replace(model, y0=-1e-4), reversed_stroke)
    scale = np.abs(forward.force).max()
    np.testing.assert_allclose(back.force, -forward.force, rtol=0, atol=1e-8 * scale)
    np.testing.assert_allclose(back.zeta, -forward.zeta, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(back.step_counts, forward.step_counts)
