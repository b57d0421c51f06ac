"""Iron that remembers: at the same drive the field is higher on the way down than on the way up.

What is remembered is the distance of the seen field from the coil's own. After a long way up it is below by the
residue, after a long way down above; in between it follows exponentially over a width of drive, or as play does.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

_NARROWEST = 1e-6


def lifted(field: Any, remembered: Any, residue: Any, width: Any) -> Any:
    """Field that the damper sees [V or A]; what is remembered is a share [1] of the residue."""
    return field + residue * remembered


def followed(remembered: Any, change: Any, residue: Any, width: Any) -> Any:
    """Share [1] of the residue after a change of the field [V or A] in one sense."""
    target = -1.0 if change > 0.0 else 1.0
    return target + (remembered - target) * np.exp(-abs(change) / max(width, _NARROWEST))


def closing(field: Any, remembered: Any, residue: Any, width: Any, tip: Any) -> Any:
    """The same of a loop whose branches meet again far beyond a field [V or A]."""
    return field + residue * remembered / (1.0 + (field / tip) ** 2)


def followed_closing(remembered: Any, change: Any, residue: Any, width: Any, tip: Any) -> Any:
    """Share [1] of the residue after a change of the field [V or A] in one sense."""
    target = -1.0 if change > 0.0 else 1.0
    return target + (remembered - target) * np.exp(-abs(change) / max(width, _NARROWEST))


def held_back(field: Any, remembered: Any, residue: Any) -> Any:
    """Field that the damper sees [V or A]; what is remembered is its distance from the coil's own."""
    return field + remembered


def dragged(remembered: Any, change: Any, residue: Any) -> Any:
    """Distance [V or A] after a change of the field."""
    return min(max(remembered - change, -residue), residue)


MAGNETIC_REMANENCE = Effect(
    name="magnetic_remanence",
    stage="coil",
    meaning="the iron keeps a rest of the field that it had before",
    forms=(
        Form(
            "exponential",
            "field_memory",
            (
                Quantity("residue", "{drive}", 0.0, 1.0, 0.02, "distance that remains after a long way"),
                Quantity("width", "{drive}", 5e-3, 5.0, 0.1, "change of drive over which it turns"),
            ),
            ((0.0, 0.05), (0.0, 0.3)),
            lifted,
            followed,
        ),
        Form(
            "closing",
            "field_memory",
            (
                Quantity("residue", "{drive}", 0.0, 1.0, 0.02, "distance that remains after a long way"),
                Quantity("width", "{drive}", 5e-3, 5.0, 0.1, "change of drive over which it turns"),
                Quantity("tip", "{drive}", 0.02, 20.0, 0.5, "field at which half of the distance is left"),
            ),
            ((0.0, 0.05, 0.4), (0.0, 0.15, 0.4), (0.0, 0.3, 1.5)),
            closing,
            followed_closing,
        ),
        Form(
            "play",
            "field_memory",
            (Quantity("residue", "{drive}", 0.0, 1.0, 0.02, "distance that remains after a long way"),),
            ((0.01,), (0.04,)),
            held_back,
            dragged,
        ),
    ),
)
