"""A displacement channel that is not straight: what it adds to the true displacement.

A gain is visible to calibration alone, so both parts have none at the middle: a bow, even in x, and a curve, odd
in x. Both are bounded, so that strokes beyond those recorded are not distorted without limit.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def bent(x: Any, bow: Any, curve: Any, reach: Any) -> Any:
    """What the channel adds [m] at the true displacement x [m]."""
    part = x / reach
    even = part * part / (1.0 + part * part)
    return bow * even + curve * even * part / np.sqrt(1.0 + part * part)


DISPLACEMENT_NONLINEARITY = Effect(
    name="displacement_nonlinearity",
    stage="displacement_channel",
    meaning="the displacement channel is not straight",
    forms=(
        Form(
            "bow_and_curve",
            "displacement_map",
            (
                Quantity("bow", "m", -5e-3, 5e-3, 1e-4, "even part, far from the middle"),
                Quantity("curve", "m", -5e-3, 5e-3, 1e-4, "odd part, far from the middle"),
                Quantity("reach", "m", 3e-3, 0.3, 0.015, "displacement at which the parts level off"),
            ),
            ((0.0, 0.0, 0.01), (0.0, 0.0, 0.03)),
            bent,
        ),
    ),
)
