"""The law: the same numbers from floats, arrays, compiled code and tensors, and the corrected signs."""

import subprocess
import sys

import numba
import numpy as np
import pytest
import torch

from identification.damper import law
from identification.damper.parameter_sets import find_parameter_set

P = find_parameter_set("spencer_1997").parameters
STATE = {"x": 0.004, "velocity": 0.05, "y": 0.001, "z": 0.0021}


def _force(x, velocity, y, z, u):
    alpha, c0 = law.evaluate_coefficient(P.alpha_a, P.alpha_b, u), law.evaluate_coefficient(P.c0_a, P.c0_b, u)
    c1 = law.evaluate_coefficient(P.c1_a, P.c1_b, u)
    y_rate = law.compute_inner_velocity(x, velocity, y, z, alpha, c0, c1, P.k0)
    return law.compute_force(y_rate, x, c1, P.k1, P.x0)


def test_force_is_the_same_for_floats_arrays_and_tensors():
    plain = _force(**STATE, u=0.7)
    array = _force(**{k: np.array([v]) for k, v in STATE.items()}, u=np.array([0.7]))
    tensor = _force(
        **{k: torch.tensor(v, dtype=torch.float64) for k, v in STATE.items()},
        u=torch.tensor(0.7, dtype=torch.float64),
    )
    assert array[0] == plain
    assert float(tensor) == pytest.approx(plain, rel=1e-15)


def test_hysteresis_rate_is_the_same_when_compiled():
    compiled = numba.njit(law.compute_hysteresis_rate)
    for slip, z in ((0.03, 0.001), (-0.03, 0.001), (0.02, -0.004), (0.0, 0.0)):
        arguments = (slip, z, P.A, P.beta, P.gamma, 1.6)
        assert compiled(*arguments) == pytest.approx(law.compute_hysteresis_rate(*arguments), rel=1e-14)


def test_series_form_equals_parallel_form_of_the_force():
    """Eq. 2 is eq. 1 rewritten: both must give the same force at any state."""
    x, v, y, z, u = 0.004, 0.05, 0.001, 0.0021, 0.7
    alpha, c0 = law.evaluate_coefficient(P.alpha_a, P.alpha_b, u), law.evaluate_coefficient(P.c0_a, P.c0_b, u)
    c1 = law.evaluate_coefficient(P.c1_a, P.c1_b, u)
    y_rate = law.compute_inner_velocity(x, v, y, z, alpha, c0, c1, P.k0)
    parallel = alpha * z + c0 * (v - y_rate) + P.k0 * (x - y) + P.k1 * (x - P.x0)
    assert law.compute_force(y_rate, x, c1, P.k1, P.x0) == pytest.approx(parallel, rel=1e-12)


def test_gradients_reach_every_input_at_rest_and_at_zero_z():
    z = torch.zeros(1, dtype=torch.float64, requires_grad=True)
    slip = torch.full((1,), 0.01, dtype=torch.float64, requires_grad=True)
    n = torch.tensor(1.3, dtype=torch.float64, requires_grad=True)
    law.compute_hysteresis_rate(slip, z, P.A, P.beta, P.gamma, n).sum().backward()
    assert all(torch.isfinite(t.grad).all() for t in (z, slip, n))
    assert float(slip.grad) == pytest.approx(P.A)


@pytest.mark.parametrize("slip", [0.03, -0.03])
@pytest.mark.parametrize("z", [0.001, -0.004])
def test_hysteresis_slopes_are_the_gradients_of_the_rate(slip, z):
    s, t = (torch.tensor(v, dtype=torch.float64, requires_grad=True) for v in (slip, z))
    law.compute_hysteresis_rate(s, t, P.A, P.beta, P.gamma, 1.7).backward()
    over_slip, over_z = law.differentiate_hysteresis_rate(slip, z, P.A, P.beta, P.gamma, 1.7)
    assert over_slip == pytest.approx(float(s.grad), rel=1e-12)
    assert over_z == pytest.approx(float(t.grad), rel=1e-12)


def test_field_returns_to_the_drive():
    """The printed sign of eq. 8 would run away from it."""
    assert law.compute_field_rate(1.0, 0.4, 60.0) < 0 < law.compute_field_rate(0.0, 0.4, 60.0)


def test_steady_sliding_saturates_at_the_yield_displacement():
    saturated = (P.A / (P.beta + P.gamma)) ** (1 / P.n)
    assert law.compute_hysteresis_rate(0.02, saturated, P.A, P.beta, P.gamma, P.n) == pytest.approx(0.0, abs=1e-12)
    assert law.compute_hysteresis_rate(-0.02, -saturated, P.A, P.beta, P.gamma, P.n) == pytest.approx(
        0.0, abs=1e-12
    )


def test_importing_the_damper_loads_no_compiler_and_no_framework():
    code = (
        "import sys; from identification.damper import effects, law, parameter_sets;"
        "print([m for m in ('torch', 'numba', 'scipy') if m in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
