"""Effects with implausible sizes get a small weight."""

import numpy as np
import pytest

from identification.damper.effects import EFFECTS
from identification.gap.selection.size_prior import compute_size_weight
from identification.simulate import ActiveEffect

DISPLACEMENT = np.linspace(-0.01, 0.01, 100)


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
