"""A displacement channel that is not straight: what it adds to the true displacement.

A gain is visible to calibration alone, so bow (even in x) and curve (odd in x) have none at the middle. They level
off far from it, or follow powers as a polynomial calibration would leave them; or the error is a wave, as uneven
windings or the pitch of a scale make it.
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


def powers(x: Any, bow: Any, curve: Any) -> Any:
    """The same by powers of x: bow and curve are what the channel adds at ``_ARM`` [m]."""
    part = x / _ARM
    return part * part * (bow + curve * part)


def wave(x: Any, cosine: Any, sine: Any, pitch: Any) -> Any:
    """The same as a wave along the stroke, zero at the middle."""
    angle = 2.0 * np.pi * x / pitch
    return cosine * (1.0 - np.cos(angle)) + sine * np.sin(angle)


_ARM = 0.01
"""[m] from the middle at which the coefficients of the powers are told."""

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
        Form(
            "powers",
            "displacement_map",
            (
                Quantity("bow", "m", -5e-3, 5e-3, 5e-5, "even part, 10 mm from the middle"),
                Quantity("curve", "m", -5e-3, 5e-3, 5e-5, "odd part, 10 mm from the middle"),
            ),
            ((0.0, 0.0),),
            powers,
        ),
        Form(
            "wave",
            "displacement_map",
            (
                Quantity("cosine", "m", -5e-3, 5e-3, 5e-5, "even part of the wave"),
                Quantity("sine", "m", -5e-3, 5e-3, 5e-5, "odd part of the wave"),
                Quantity("pitch", "m", 4e-3, 0.08, 0.02, "length of the wave"),
            ),
            ((0.0, 0.0, 0.01), (0.0, 0.0, 0.02), (0.0, 0.0, 0.04)),
            wave,
        ),
    ),
)
