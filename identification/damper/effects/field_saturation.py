"""Magnetic saturation of the iron: the field grows less and less with the drive."""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

_MIN_SHARPNESS = 1e-9
"""Number added to the sharpness [1/drive]: with zero sharpness the field passes unchanged."""


def saturate_tanh(field: Any, sharpness: Any) -> Any:
    """Return the field that the damper sees [V or A], bounded by 1 / sharpness."""
    return np.tanh((sharpness + _MIN_SHARPNESS) * field) / (sharpness + _MIN_SHARPNESS)


def saturate_knee(field: Any, sharpness: Any, power: Any) -> Any:
    """Return the field behind a knee between Froelich's gentle one (power 1) and a hard limit (power 8)."""
    return field / (1.0 + (sharpness * np.abs(field) + _MIN_SHARPNESS) ** power) ** (1.0 / power)


def saturate_magnetisation(field: Any, sharpness: Any, initial_loss: Any, initial_drive: Any) -> Any:
    """Return the saturated field where the permeability first grows from its initial value (Rayleigh 1887)."""
    unsaturated = field * (1.0 - initial_loss * np.exp(-np.abs(field) / initial_drive))
    return unsaturated / np.sqrt(1.0 + (sharpness * unsaturated) ** 2)


_SHARPNESS = Quantity("sharpness", "1/{drive}", 0.0, 50.0, 1.0, "inverse of the drive at which the iron saturates")

FIELD_SATURATION = Effect(
    name="field_saturation",
    stage="coil",
    variable="drive",
    meaning="the iron saturates, so more drive brings less and less field",
    forms=(
        Form("tanh", "field", (_SHARPNESS,), ((0.5,), (1.5,), (4.0,)), saturate_tanh),
        Form(
            "knee",
            "field",
            (_SHARPNESS, Quantity("power", "1", 1.0, 8.0, 2.0, "hardness of the knee")),
            ((0.4, 1.2), (1.5, 3.0), (2.5, 6.0)),
            saturate_knee,
        ),
        Form(
            "magnetisation",
            "field",
            (
                _SHARPNESS,
                Quantity(
                    "initial_loss", "1", 0.0, 0.95, 0.3, "share of the permeability that a small field lacks"
                ),
                Quantity("initial_drive", "{drive}", 0.02, 2.0, 0.2, "drive over which the permeability rises"),
            ),
            ((0.7, 0.4, 0.2), (1.5, 0.6, 0.4), (0.4, 0.3, 0.1)),
            saturate_magnetisation,
        ),
    ),
)
