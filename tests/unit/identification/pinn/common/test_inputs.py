"""Field of one piece at any time."""

import numpy as np
import pytest

from identification.pinn.common.inputs import PieceInputs
from identification.simulate import SimulationModel, simulate
from tests.support.pinn_problem import TRUTH, make_problem


def test_the_field_is_that_of_the_simulation_with_its_derivatives():
    piece = make_problem().pieces[0]
    inputs, time = PieceInputs(piece), np.array([1.4, 1.5004, 1.5101, 1.53, 3.002, 4.0])
    field = inputs.evaluate_field(time, TRUTH.eta, 0.0)
    assert field.u[2] == pytest.approx(0.3 * (1 - np.exp(-TRUTH.eta * 0.0101)), rel=1e-9)
    high, low = (inputs.evaluate_field(time, TRUTH.eta + d, 0.0).u for d in (1e-4, -1e-4))
    assert (high - low) / 2e-4 == pytest.approx(field.du_deta, rel=1e-5, abs=1e-10)
    later, earlier = (inputs.evaluate_field(time, TRUTH.eta, d).u for d in (1e-7, -1e-7))
    assert (later - earlier) / 2e-7 == pytest.approx(field.du_ddelay, rel=1e-4, abs=1e-6)
    assert np.isfinite(simulate(SimulationModel(TRUTH), piece.excitation).force).all()
