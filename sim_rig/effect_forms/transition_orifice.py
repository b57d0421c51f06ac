"""Flow through the gap that turns turbulent beyond a critical velocity: above it, force v |v|^0.75 (Blasius)."""

from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import AlternativeForm, Place, V


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the turbulent part of the force [N]."""
    reynolds = abs(now[V]) / values[1]
    turbulent_part = reynolds**4 / (1.0 + reynolds**4)
    return float(values[0] * now[V] * values[1] * reynolds**0.75 * turbulent_part)


TRANSITION_ORIFICE = AlternativeForm(
    effect="orifice_turbulence",
    form="reynolds_transition",
    stage="damper",
    place=Place.PARALLEL_FORCE,
    parameters=(
        Quantity("drag", "N s²/m²", 0.0, 1e6, 3000.0, "force over squared velocity at the transition"),
        Quantity("transition", "m/s", 1e-3, 1.0, 0.05, "velocity at which the flow turns turbulent"),
    ),
    meaning="the flow through the gap turns turbulent",
    function=compute_force,
)
