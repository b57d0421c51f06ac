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
