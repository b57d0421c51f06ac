"""Play in the clevis: the pin crosses a gap before the damper moves.

The damper is held where it is while the actuator crosses the gap (the play operator): at the end of each
sample it stands within half a gap of the actuator.
"""

from typing import Any

from identification.damper.effects.effect import Effect
from identification.damper.parameters import Quantity


def follow(held: Any, x: Any, gap: Any) -> Any:
    """Displacement of the damper [m] when the actuator reaches x [m] and the damper stood at ``held`` [m]."""
    return min(max(held, x - gap / 2), x + gap / 2)


def slopes(held: Any, x: Any, gap: Any) -> tuple[Any, Any, Any]:
    """Slopes of the damper's displacement over held [1], x [1] and gap [1]."""
    if held < x - gap / 2:
        return 0.0, 1.0, -0.5
    if held > x + gap / 2:
        return 0.0, 1.0, 0.5
    return 1.0, 0.0, 0.0


CLEVIS_BACKLASH = Effect(
    name="clevis_backlash",
    stage="mounting",
    acts="displacement_follower",
    form="play",
    parameters=(Quantity("gap", "m", 0.0, 2e-3, 1e-4, "free travel of the pin from side to side"),),
    meaning="the pin has play, so the damper starts late after each reversal",
    act=follow,
    slopes=slopes,
)
