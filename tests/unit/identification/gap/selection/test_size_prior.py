"""Effects with implausible sizes get a small weight."""

import numpy as np
import pytest

from identification.damper.effects import EFFECTS
from identification.gap.selection.size_prior import compute_size_weight
from identification.simulate import ActiveEffect

DISPLACEMENT = np.linspace(-0.01, 0.01, 100)
HIGHEST_MASS = EFFECTS["moving_mass"].forms[0].parameters[0].high


@pytest.mark.parametrize(
    ("name", "plausible", "implausible"),
    [
        ("displacement_nonlinearity", (1e-4, 0.0, 0.01), (4e-3, 0.0, 0.01)),
        ("force_drift", (5.0, 60.0), (5.0, 3.0)),
        ("end_stop", (2e4, 0.006, 1e-3), (5e3, 2e-4, 0.03)),
        ("viscous_heating", (2e-3, 40.0), (2e-3, 3.0)),
        ("moving_mass", (4.0,), (EFFECTS["moving_mass"].forms[0].parameters[0].high,)),
    ],
)
def test_an_implausible_size_counts_for_little(name, plausible, implausible):
    effect = EFFECTS[name]
    assert compute_size_weight(ActiveEffect(effect, plausible), DISPLACEMENT) == 1.0
    assert compute_size_weight(ActiveEffect(effect, implausible), DISPLACEMENT) < 0.1


@pytest.mark.parametrize(
    ("name", "values", "weight"),
    [
        ("end_stop", (2e4, 0.0031, 1e-3), 1.0),  # three tenths of the largest displacement of 10 mm
        ("end_stop", (2e4, 0.0029, 1e-3), 0.03),
        ("force_drift", (5.0, 8.1), 1.0),
        ("force_drift", (5.0, 7.9), 0.03),
        ("viscous_heating", (2e-3, 8.1), 1.0),
        ("viscous_heating", (2e-3, 7.9), 0.03),
        ("moving_mass", (HIGHEST_MASS * 0.998,), 1.0),  # a bound has a width of a thousandth
        ("moving_mass", (HIGHEST_MASS * 0.9995,), 0.03),
        ("moving_mass", (0.0,), 1.0),  # a bound of zero is not one
        ("magnetic_remanence", (0.1, 0.1, 1.0), 1.0),  # the first rise from zero is the usual history of iron
        ("magnetic_remanence", (EFFECTS["magnetic_remanence"].forms[0].parameters[0].high, 0.1, 1.0), 0.03),
    ],
)
def test_the_weight_falls_at_the_limit_of_plausibility(name, values, weight):
    assert compute_size_weight(ActiveEffect(EFFECTS[name], values), DISPLACEMENT) == weight


def test_one_of_several_sizes_at_its_bound_is_enough():
    seal = EFFECTS["seal_friction"]
    parameters = seal.forms[0].parameters
    sizes = [k for k, q in enumerate(parameters) if q.low <= 0.0]
    values = [0.4 * q.low + 0.1 * q.high if q.low > 0.0 else 0.5 * q.high for q in parameters]
    assert compute_size_weight(ActiveEffect(seal, tuple(values)), DISPLACEMENT) == 1.0
    values[sizes[0]] = parameters[sizes[0]].high
    assert compute_size_weight(ActiveEffect(seal, tuple(values)), DISPLACEMENT) == 0.03


@pytest.mark.parametrize(("period", "weight"), [(33.0, 1.0), (31.0, 0.03)])
def test_a_quarter_of_the_period_of_a_slow_drift_lasts_eight_seconds(period, weight):
    effect = EFFECTS["force_drift"]
    values = (1.0, 1.0, period, 100.0)
    assert compute_size_weight(ActiveEffect(effect, values, "sinusoidal"), DISPLACEMENT) == weight
