"""Play in the clevis: the pin crosses a gap before the damper moves.

The damper is held where it is while the actuator crosses the gap (the play operator): at the end of each
sample it stands within half a gap of the actuator.
"""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def follow(held: Any, x: Any, gap: Any) -> Any:
    """Displacement of the damper [m] when the actuator reaches x [m] and the damper stood at ``held`` [m]."""
    return min(max(held, x - gap / 2), x + gap / 2)


CLEVIS_BACKLASH = Effect(
    name="clevis_backlash",
    stage="mounting",
    meaning="the pin has play, so the damper starts late after each reversal",
    forms=(
        Form(
            "play",
            "displacement_follower",
            (Quantity("gap", "m", 0.0, 2e-3, 1e-4, "free travel of the pin from side to side"),),
            ((3e-5,), (1e-4,), (3e-4,)),
            follow,
        ),
    ),
)
