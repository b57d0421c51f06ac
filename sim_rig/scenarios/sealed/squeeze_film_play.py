"""Play in the clevis with grease in it: the film drags more as it thins, and pin and eye press after Hertz."""

from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import STRETCH, STRETCH_RATE, Form, Place

STIFFNESS, DENT = 3e8, 5e-6
"""[N/m] of pin on eye at a dent [m]: without a gap next to nothing may be left, or the truth is give, not play."""
LOSS = 30.0
"""[s/m] damping of the contact over its force."""
THIN = 0.05
"""[1] film that remains between pin and eye, over half the gap: bounds its drag."""


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N] that the pin carries."""
    half = 0.5 * values[0]
    inside = min(max(now[STRETCH], -half), half)
    dent, squeezed = now[STRETCH] - inside, (inside / half) ** 2 if half > 0.0 else 1.0
    carried = values[1] * now[STRETCH_RATE] / (1.0 + THIN - squeezed)
    pressing = 1.0 + LOSS * (now[STRETCH_RATE] if dent > 0.0 else -now[STRETCH_RATE])
    return float(carried + STIFFNESS * dent * (abs(dent) / DENT) ** 0.5 * max(pressing, 0.0))


def fastest(gap: float, film: float) -> float:
    """Fastest rate [1/s]: of the contact, which the damper itself damps."""
    return 2e4


SQUEEZE_FILM_PLAY = Form(
    effect="clevis_backlash",
    form="squeeze_film",
    stage="mounting",
    place=Place.CONNECTION,
    parameters=(
        Quantity("gap", "m", 0.0, 5e-3, 8e-5, "free travel of the pin from side to side"),
        Quantity("film", "N s/m", 1.0, 1e4, 60.0, "drag of the grease"),
    ),
    meaning="the pin has play, with grease in it",
    act=force,
    fastest=fastest,
)
