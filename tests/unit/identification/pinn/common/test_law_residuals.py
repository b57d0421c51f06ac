"""Residuals of the law at single points."""

import numpy as np
import pytest

from identification.pinn.common import law_residuals
from tests.support.pinn_problem import TRUTH


def test_the_residuals_vanish_on_a_solution_of_the_law():
    slip, z, n = np.array([0.02, -0.03]), np.array([0.4, -0.8]), TRUTH.n
    bend = TRUTH.rho * slip * np.abs(z) + (1 - TRUTH.rho) * np.abs(slip) * z
    rate = (slip - bend * np.abs(z) ** (n - 1)) / TRUTH.D_y
    values = TRUTH._asdict() | {"z": z, "z_rate": rate, "y_rate": 0.01 - slip, "v": 0.01}
    assert law_residuals.compute_hysteresis_residual(values) == pytest.approx([0.0, 0.0], abs=1e-12)
    y, y_rate, u, x, v = 1e-3, 0.01 - slip, np.array([0.1, 0.4]), 0.004, 0.01
    damping = TRUTH.c0_a + TRUTH.c1_a + (TRUTH.c0_b + TRUTH.c1_b) * u
    forces = (TRUTH.F_a + TRUTH.F_b * u) * z + TRUTH.k0 * (x - y) + (TRUTH.c0_a + TRUTH.c0_b * u) * v
    values |= {"u": u, "x": x, "y": y, "v": v, "y_rate": forces / damping}
    assert law_residuals.compute_balance_residual(values) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert law_residuals.compute_balance_residual(values | {"y_rate": y_rate}) == pytest.approx(
        damping * y_rate - forces
    )


POINT = TRUTH._asdict() | {
    "x": 0.004, "y": 0.003, "v": 0.05, "y_rate": 0.03, "z": 0.4, "z_rate": 20.0, "u": 0.3,
    "F_factor": 1.1, "c0_factor": 0.9, "c1_factor": 1.2, "parallel_force": 7.0,
}  # fmt: skip


@pytest.mark.parametrize("signs", [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])
@pytest.mark.parametrize(
    ("residual", "partials"),
    [
        (law_residuals.compute_hysteresis_residual, lambda p: law_residuals.differentiate_hysteresis(p, np.log)),
        (law_residuals.compute_balance_residual, law_residuals.differentiate_balance),
        (law_residuals.compute_balance_residual, law_residuals.differentiate_balance_inputs),
        (law_residuals.compute_force, law_residuals.differentiate_force),
        (law_residuals.compute_force, law_residuals.differentiate_force_inputs),
    ],
)
def test_partials_are_those_of_finite_differences(residual, partials, signs):
    z_sign, slip_sign = signs
    point = POINT | {"z": z_sign * POINT["z"], "v": POINT["y_rate"] + 0.02 * slip_sign}
    for name, partial in partials(point).items():
        step = 1e-6 * max(abs(point[name]), 1e-3)
        high, low = (residual(point | {name: point[name] + d}) for d in (step, -step))
        assert (high - low) / (2 * step) == pytest.approx(partial, rel=1e-4, abs=1e-7), name


def test_the_force_is_that_of_the_outer_dashpot_spring_and_preload():
    inner = 1.2 * (TRUTH.c1_a + 0.3 * TRUTH.c1_b) * 0.03
    force = inner + TRUTH.k1 * 0.004 - TRUTH.f0
    assert law_residuals.compute_force(POINT) == pytest.approx(force + 7.0)
    without = {name: value for name, value in POINT.items() if name != "parallel_force"}
    assert law_residuals.compute_force(without) == pytest.approx(force)
