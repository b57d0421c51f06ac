"""Backlash in the clevis filled with grease: a squeeze film between pin and eye, and a Hertzian contact."""

from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import ELONGATION, ELONGATION_RATE, AlternativeForm, Place

CONTACT_STIFFNESS, CONTACT_DEPTH = 3e8, 5e-6
"""[N/m] stiffness of pin on eye at an indentation [m].

Without a gap almost no compliance may remain, otherwise the true effect would be compliance and not backlash.
"""
CONTACT_DAMPING = 30.0
"""[s/m] contact damping over contact force."""
MIN_FILM = 0.05
"""[1] smallest film between pin and eye over half the gap; it bounds the film force."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the force [N] that the pin transmits."""
    half = 0.5 * values[0]
    inside = min(max(now[ELONGATION], -half), half)
    indentation, squeeze = now[ELONGATION] - inside, (inside / half) ** 2 if half > 0.0 else 1.0
    film_force = values[1] * now[ELONGATION_RATE] / (1.0 + MIN_FILM - squeeze)
    damping_factor = 1.0 + CONTACT_DAMPING * (now[ELONGATION_RATE] if indentation > 0.0 else -now[ELONGATION_RATE])
    contact_force = CONTACT_STIFFNESS * indentation * (abs(indentation) / CONTACT_DEPTH) ** 0.5
    return float(film_force + contact_force * max(damping_factor, 0.0))


def compute_max_rate(gap: float, film_damping: float) -> float:
    """Return the fastest rate [1/s]: that of the contact against the damper's own damping."""
    return 2e4


SQUEEZE_FILM_BACKLASH = AlternativeForm(
    effect="clevis_backlash",
    form="squeeze_film",
    stage="mounting",
    place=Place.MOUNTING,
    parameters=(
        Quantity("gap", "m", 0.0, 5e-3, 8e-5, "free travel of the pin from side to side"),
        Quantity("film_damping", "N s/m", 1.0, 1e4, 60.0, "damping of the grease film at mid-gap"),
    ),
    meaning="the pin has backlash, filled with grease",
    function=compute_force,
    max_rate=compute_max_rate,
    former_symbols={"film": "film_damping"},
)
