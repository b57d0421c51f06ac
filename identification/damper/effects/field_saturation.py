"""Iron that saturates: the field grows ever less with the drive."""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

_STRAIGHT = 1e-9
"""[1/drive] added to the sharpness, so that none at all leaves the field as it is."""


def tanh(field: Any, sharpness: Any) -> Any:
    """Field that the damper sees [V or A] behind the coil's own; bounded by 1 / sharpness."""
    return np.tanh((sharpness + _STRAIGHT) * field) / (sharpness + _STRAIGHT)


def knee(field: Any, sharpness: Any, power: Any) -> Any:
    """The same with a knee between Froelich's gentle one (power 1) and a hard limit (power 8)."""
    return field / (1.0 + (np.abs(sharpness * field) + _STRAIGHT) ** power) ** (1.0 / power)


def magnetisation(field: Any, sharpness: Any, missing: Any, rise: Any) -> Any:
    """The same behind a slow beginning: permeability grows from its initial value first (Rayleigh 1887)."""
    begun = field * (1.0 - missing * np.exp(-np.abs(field) / rise))
    return begun / np.sqrt(1.0 + (sharpness * begun) ** 2)


_SHARPNESS = Quantity("sharpness", "1/{drive}", 0.0, 50.0, 1.0, "one over the drive at which the iron is full")

FIELD_SATURATION = Effect(
    name="field_saturation",
    stage="coil",
    meaning="the iron saturates, so more drive brings ever less field",
    forms=(
        Form("tanh", "field", (_SHARPNESS,), ((0.5,), (1.5,), (4.0,)), tanh),
        Form(
            "knee",
            "field",
            (_SHARPNESS, Quantity("power", "1", 1.0, 8.0, 2.0, "hardness of the knee")),
            ((0.4, 1.2), (1.5, 3.0), (2.5, 6.0)),
            knee,
        ),
        Form(
            "magnetisation",
            "field",
            (
                _SHARPNESS,
                Quantity("missing", "1", 0.0, 0.95, 0.3, "share of the permeability that a small field lacks"),
                Quantity("rise", "{drive}", 0.02, 2.0, 0.2, "drive over which that comes"),
            ),
            ((0.7, 0.4, 0.2), (1.5, 0.6, 0.4), (0.4, 0.3, 0.1)),
            magnetisation,
        ),
    ),
)
