"""Play in the clevis: the pin crosses a gap before the damper moves.

Either the damper is held where it is while the actuator crosses the gap, as dry friction holds it (the play
operator): at the end of each sample it stands within half a gap of the actuator. Or the pin lies free in the gap
and carries nothing there: the damper unloads first, and the gap opens where the force changes its sign. Where
grease fills the gap it is crossed against a film, and the force halts at what the film carries before it goes on.
A ring that floats in the piston's groove lets oil pass until it has crossed its clearance, and looks the same.
"""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def follow(held: Any, x: Any, gap: Any) -> Any:
    """Displacement of the damper [m] when the actuator reaches x [m] and the damper stood at ``held`` [m]."""
    return min(max(held, x - gap / 2), x + gap / 2)


def pin(gap: Any, softness: Any) -> Any:
    """What the connection is: see ``connection.carried``; nothing is carried in the gap."""
    return softness * gap, gap, 0.0, 0.0, 0.0


def greased(gap: Any, softness: Any, film: Any) -> Any:
    """The same with grease in the gap."""
    return softness * gap, gap, 0.0, film, 0.0


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
        Form(
            "free_pin",
            "connection",
            (
                Quantity("gap", "m", 0.0, 2e-3, 1e-4, "free travel of the pin from side to side"),
                Quantity("softness", "1/N", 1e-6, 1e-2, 1e-4, "give of pin and eye in contact, over the gap"),
            ),
            ((3e-5, 2e-4), (1e-4, 1e-4), (3e-4, 3e-5)),
            pin,
        ),
        Form(
            "greased_pin",
            "connection",
            (
                Quantity("gap", "m", 0.0, 2e-3, 1e-4, "free travel of the pin from side to side"),
                Quantity("softness", "1/N", 1e-6, 1e-2, 1e-4, "give of pin and eye in contact, over the gap"),
                Quantity("film", "N s/m", 0.0, 1e6, 1e4, "damping of what fills the gap"),
            ),
            ((1e-4, 1e-4, 5e3), (3e-4, 1e-4, 2e4)),
            greased,
        ),
    ),
)
