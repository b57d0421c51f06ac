"""Backlash in the clevis: the pin crosses a gap before the damper moves.

- ``backlash``: dry friction holds the damper while the actuator crosses the gap (play operator). At the end of
  each sample the damper is within half a gap of the actuator.
- ``free_pin``: the pin transmits nothing inside the gap. The damper unloads first, and the gap opens where the
  force changes its sign.
- ``greased_pin``: a film fills the gap, and the force pauses at the film's damping force while the pin crosses.

A ring that floats in the piston's groove passes oil until it has crossed its clearance, and looks the same.
"""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def apply_backlash(previous: Any, x: Any, gap: Any) -> Any:
    """Return the damper's displacement [m] when the actuator reaches x [m], from the damper's previous one [m]."""
    return min(max(previous, x - gap / 2), x + gap / 2)


def make_free_pin(gap: Any, contact_compliance: Any) -> Any:
    """Return the numbers of the connection, as the action "connection" takes them, with a free gap."""
    return contact_compliance * gap, gap, 0.0, 0.0, 0.0


def make_greased_pin(gap: Any, contact_compliance: Any, film_damping: Any) -> Any:
    """Return the numbers of the connection with a viscous film in the gap."""
    return contact_compliance * gap, gap, 0.0, film_damping, 0.0


_GAP = Quantity("gap", "m", 0.0, 2e-3, 1e-4, "free travel of the pin from side to side")
_CONTACT_COMPLIANCE = Quantity(
    "contact_compliance", "1/N", 1e-6, 1e-2, 1e-4, "compliance of pin and eye in contact, over the gap"
)

CLEVIS_BACKLASH = Effect(
    name="clevis_backlash",
    stage="mounting",
    variable="travel_since_reversal",
    meaning="the pin has backlash, so the damper starts late after each reversal",
    forms=(
        Form("backlash", "displacement_backlash", (_GAP,), ((3e-5,), (1e-4,), (3e-4,)), apply_backlash),
        Form(
            "free_pin",
            "connection",
            (_GAP, _CONTACT_COMPLIANCE),
            ((3e-5, 2e-4), (1e-4, 1e-4), (3e-4, 3e-5)),
            make_free_pin,
        ),
        Form(
            "greased_pin",
            "connection",
            (
                _GAP,
                _CONTACT_COMPLIANCE,
                Quantity("film_damping", "N s/m", 0.0, 1e6, 1e4, "damping of the film in the gap"),
            ),
            ((1e-4, 1e-4, 5e3), (3e-4, 1e-4, 2e4)),
            make_greased_pin,
        ),
    ),
)
