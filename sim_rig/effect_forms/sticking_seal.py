"""Unknown to the library: a nicked seal catches periodically over the path travelled."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import PATH, AlternativeForm, Place, V

PEAK_EXPONENT = 12
"""[1] exponent that makes the catch short."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the friction force [N] of the catches."""
    direction = now[V] / (now[V] * now[V] + 4e-6) ** 0.5
    catch = max(math.cos(2.0 * math.pi * now[PATH] / values[1]), 0.0) ** PEAK_EXPONENT
    return float(values[0] * catch * direction)


STICKING_SEAL = AlternativeForm(
    effect="sticking_seal",
    form="every_nth_stroke",
    stage="damper",
    place=Place.PARALLEL_FORCE,
    parameters=(
        Quantity("catch_force", "N", 0.0, 2000.0, 30.0, "largest force of a catch"),
        Quantity("period_path", "m", 1e-3, 2.0, 0.13, "path from catch to catch"),
    ),
    meaning="a nicked seal catches now and then",
    function=compute_force,
    in_library=False,
    former_symbols={"catch": "catch_force", "path": "period_path"},
)
