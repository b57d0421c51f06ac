"""LuGre friction of the seal: bristles deflect before they slip; the Stribeck curve follows Hess and Soom."""

from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import AlternativeForm, Place, V

BRISTLE_DAMPING_TIME = 2e-5
"""[s] bristle damping over bristle stiffness: small enough to stay passive."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the force [N]; the state is the deflection of the bristles over the presliding distance [1]."""
    v, presliding_distance = now[V], values[2]
    strength = 1.0 + values[1] / (1.0 + (v / values[3]) ** 2)
    rate[0] = (v - abs(v) * memory[0] / strength) / presliding_distance
    return float(values[0] * (memory[0] + BRISTLE_DAMPING_TIME * rate[0]))


def compute_max_rate(sliding: float, peak: float, presliding_distance: float, stribeck: float) -> float:
    """Return the fastest rate [1/s], that at 0.5 m/s."""
    return 0.5 / presliding_distance


LUGRE_FRICTION = AlternativeForm(
    effect="seal_friction",
    form="lugre",
    stage="damper",
    place=Place.PARALLEL_FORCE,
    parameters=(
        Quantity("sliding", "N", 0.0, 2000.0, 15.0, "friction while sliding"),
        Quantity("peak", "1", 0.0, 3.0, 0.7, "increase of the static friction over sliding, relative"),
        Quantity("presliding_distance", "m", 5e-6, 1e-3, 5e-5, "presliding distance"),
        Quantity("stribeck", "m/s", 1e-3, 0.2, 0.02, "velocity at which the peak has fallen by half"),
    ),
    meaning="the seals stick and rub",
    function=compute_force,
    max_rate=compute_max_rate,
    former_symbols={"bend": "presliding_distance"},
)
