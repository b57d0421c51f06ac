"""Digital filters have the output of `scipy.signal`, which takes a second to load."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import signal

from identification.simulate import compute_settled_state, design_low_pass, filter_series

VALUES = np.random.default_rng(1).standard_normal(300)


@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("share", [0.04, 0.3])
def test_a_low_pass_has_the_coefficients_of_scipy(order, share):
    analogue = signal.butter(order, 2 * np.pi * share * 1e3, analog=True)
    numerator, denominator, _ = signal.cont2discrete(analogue, 1e-3, method="foh")
    b, a = design_low_pass(order, share * 1e3, 1e-3)
    assert b == pytest.approx(np.ravel(numerator), abs=1e-12)
    assert a == pytest.approx(denominator, abs=1e-12)


@pytest.mark.parametrize("order", [1, 3])
def test_the_output_is_that_of_scipy_from_any_state(order):
    b, a = signal.butter(order, 0.1)
    state = compute_settled_state(b, a)
    assert state == pytest.approx(signal.lfilter_zi(b, a), rel=1e-9)
    expected, _ = signal.lfilter(b, a, VALUES, zi=state * 2.0)
    assert filter_series(b, a, VALUES, state * 2.0).tolist() == expected.tolist()
    assert filter_series(b, a, VALUES).tolist() == signal.lfilter(b, a, VALUES).tolist()


def test_the_state_that_was_given_stays_as_it_was():
    b, a = signal.butter(2, 0.1)
    state = np.ones(2)
    filter_series(b, a, VALUES, state)
    assert state.tolist() == [1.0, 1.0]


@pytest.mark.parametrize(
    "package", ["identification.pipeline", "identification.gap", "sim_rig.server", "bench.agent"]
)
def test_what_every_process_loads_has_no_signal_processing_of_scipy(package):
    code = f"import sys, {package}; print([m for m in ('scipy.signal', 'scipy.stats') if m in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
