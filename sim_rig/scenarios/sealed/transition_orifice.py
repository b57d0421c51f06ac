"""Flow that is laminar when slow, and turbulent after Blasius beyond a Reynolds number: v |v|^0.75 from there."""

from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import Form, Place, V


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N]."""
    reynolds = abs(now[V]) / values[1]
    turned = reynolds**4 / (1.0 + reynolds**4)
    return float(values[0] * now[V] * values[1] * reynolds**0.75 * turned)


TRANSITION_ORIFICE = Form(
    effect="orifice_turbulence",
    form="reynolds_transition",
    stage="damper",
    place=Place.PARALLEL,
    parameters=(
        Quantity("drag", "N s²/m²", 0.0, 1e6, 3000.0, "force over squared velocity where the flow turns"),
        Quantity("transition", "m/s", 1e-3, 1.0, 0.05, "velocity at which the flow turns"),
    ),
    meaning="the flow through the gap turns turbulent",
    act=force,
)
