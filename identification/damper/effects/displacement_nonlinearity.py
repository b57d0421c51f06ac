"""Nonlinearity of the displacement channel: an error over the true displacement.

A gain error is visible to calibration only, so the even and odd parts have zero slope at the middle.

- ``saturating``: the parts level off far from the middle.
- ``polynomial``: the parts follow powers, as a polynomial calibration leaves them.
- ``periodic``: a wave along the stroke, from uneven windings or the pitch of a scale.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def compute_saturating_error(x: Any, even: Any, odd: Any, reach: Any) -> Any:
    """Return the channel's error [m] at the true displacement x [m]."""
    relative = x / reach
    level = relative * relative / (1.0 + relative * relative)
    return even * level + odd * level * relative / np.sqrt(1.0 + relative * relative)


def compute_polynomial_error(x: Any, even: Any, odd: Any) -> Any:
    """Return the channel's error [m] as a polynomial; ``even`` and ``odd`` [m] hold at 10 mm."""
    relative = x / _REFERENCE_DISPLACEMENT
    return relative * relative * (even + odd * relative)


def compute_periodic_error(x: Any, cosine: Any, sine: Any, pitch: Any) -> Any:
    """Return the channel's error [m] as a wave along the stroke, zero at the middle."""
    angle = 2.0 * np.pi * x / pitch
    return cosine * (1.0 - np.cos(angle)) + sine * np.sin(angle)


_REFERENCE_DISPLACEMENT = 0.01
"""Distance from the middle at which the coefficients of the polynomial hold [m]."""

DISPLACEMENT_NONLINEARITY = Effect(
    name="displacement_nonlinearity",
    stage="displacement_channel",
    variable="displacement",
    meaning="the displacement channel is not linear",
    forms=(
        Form(
            "saturating",
            "displacement_map",
            (
                Quantity("even", "m", -5e-3, 5e-3, 1e-4, "even part of the error, far from the middle"),
                Quantity("odd", "m", -5e-3, 5e-3, 1e-4, "odd part of the error, far from the middle"),
                Quantity("reach", "m", 3e-3, 0.3, 0.015, "displacement at which both parts level off"),
            ),
            ((0.0, 0.0, 0.01), (0.0, 0.0, 0.03)),
            compute_saturating_error,
        ),
        Form(
            "polynomial",
            "displacement_map",
            (
                Quantity("even", "m", -5e-3, 5e-3, 5e-5, "even part of the error, 10 mm from the middle", "1/m"),
                Quantity("odd", "m", -5e-3, 5e-3, 5e-5, "odd part of the error, 10 mm from the middle", "1/m^2"),
            ),
            ((0.0, 0.0),),
            compute_polynomial_error,
        ),
        Form(
            "periodic",
            "displacement_map",
            (
                Quantity("cosine", "m", -5e-3, 5e-3, 5e-5, "even part of the wave"),
                Quantity("sine", "m", -5e-3, 5e-3, 5e-5, "odd part of the wave"),
                Quantity("pitch", "m", 4e-3, 0.08, 0.02, "length of the wave"),
            ),
            ((0.0, 0.0, 0.01), (0.0, 0.0, 0.02), (0.0, 0.0, 0.04)),
            compute_periodic_error,
        ),
    ),
)
