"""Bolted joint whose gaps close under load: compliant at first, three times as stiff when closed, and damped."""

from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import ELONGATION, ELONGATION_RATE, AlternativeForm, Place

RETARDATION_TIME = 5e-4
"""[s] damping over the initial stiffness."""
STIFFENING = 2.0
"""[1] additional stiffness of the closed joint over the initial stiffness."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the force [N] that the joint transmits."""
    closed = now[ELONGATION] ** 2 / (now[ELONGATION] ** 2 + values[1] ** 2)
    return float(
        (now[ELONGATION] * (1.0 + STIFFENING * closed) + RETARDATION_TIME * now[ELONGATION_RATE]) / values[0]
    )


def compute_max_rate(compliance: float, closing_deflection: float) -> float:
    """Return the fastest rate [1/s] of the damped joint."""
    return (1.0 + 1.5 * STIFFENING) / RETARDATION_TIME


CLOSING_JOINT = AlternativeForm(
    effect="fixture_compliance",
    form="closing_joint",
    stage="mounting",
    place=Place.MOUNTING,
    parameters=(
        Quantity("compliance", "m/N", 0.0, 1e-5, 1e-7, "initial compliance"),
        Quantity("closing_deflection", "m", 1e-6, 1.0, 1e-4, "deflection at which half of the gaps are closed"),
    ),
    meaning="the fixture bends under the load",
    function=compute_force,
    max_rate=compute_max_rate,
    former_symbols={"give": "compliance", "closes": "closing_deflection"},
)
