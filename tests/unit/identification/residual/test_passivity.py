"""Limit that keeps law and residual passive."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from identification.residual.passivity import limit_residual

FORCES = arrays(float, 60, elements=st.floats(-1e3, 1e3))
VELOCITIES = arrays(float, 60, elements=st.floats(-1.0, 1.0))


@given(law=VELOCITIES, residual=FORCES, velocity=VELOCITIES)
def test_the_residual_returns_no_more_than_was_absorbed(law, residual, velocity):
    damping = 100.0 * np.abs(law) * velocity
    limited = limit_residual(damping, residual, velocity, 100.0)
    absorbed = np.cumsum((damping + limited) * velocity) / 100.0
    assert absorbed.min() >= -1e-9
    assert np.all((limited == residual) | (limited == 0.0))


@given(residual=FORCES, velocity=VELOCITIES)
def test_a_residual_that_absorbs_is_not_changed(residual, velocity):
    absorbing = np.abs(residual) * np.sign(velocity)
    assert np.array_equal(limit_residual(np.zeros(60), absorbing, velocity, 100.0), absorbing)


def test_a_residual_that_drives_the_rod_ends_when_the_store_is_empty():
    velocity = np.full(10, 0.1)
    law = np.where(np.arange(10) < 2, 300.0, 0.0)
    limited = limit_residual(law, np.full(10, -100.0), velocity, 10.0)
    # Two samples store 2 x (300 - 100) N; four more at -100 N empty the store.
    assert limited == pytest.approx([-100.0] * 6 + [0.0] * 4)
