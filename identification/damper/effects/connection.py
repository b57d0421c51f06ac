"""What a connection between load cell and damper carries, over the stretch between the two.

A spring that gives way, hardens as it is stretched, and has a gap in its middle, where a pin lies free and a
bolted joint has not closed yet. Without gap and hardening it is a linear spring.
"""

from typing import Any

FILM = 1e-4
"""[1] stiffness inside the gap over that outside: what keeps a pin from lying nowhere."""
_STEPS = 40


def carried(stretch: Any, give: Any, gap: Any, hardening: Any, inside: Any) -> Any:
    """Force [N] at a stretch [m].

    Args:
        stretch: actuator less damper [m].
        give: of the spring, hardly stretched [m/N].
        gap: free travel from side to side [m].
        hardening: growth of the secant stiffness over the squared stretch [1/m²].
        inside: stiffness in the gap over that outside, beside what a free pin has [1].
    """
    half = 0.5 * gap
    free = min(max(stretch, -half), half)
    bent = stretch - free
    return (bent * (1.0 + hardening * bent * bent) + (FILM + inside) * free) / give


def steepness(stretch: Any, give: Any, gap: Any, hardening: Any, inside: Any) -> Any:
    """Slope of that force over the stretch [N/m]."""
    half = 0.5 * gap
    if -half < stretch < half:
        return (FILM + inside) / give
    bent = stretch - min(max(stretch, -half), half)
    return (1.0 + 3.0 * hardening * bent * bent) / give


def stretched(force: Any, give: Any, gap: Any, hardening: Any, inside: Any) -> Any:
    """Stretch [m] at which the connection carries a force [N]; a free pin lies at an end of its gap."""
    held = 0.5 * gap * inside
    if abs(give * force) < held:
        return give * force / inside
    loose = give * force - (held if force > 0.0 else -held)
    bent = loose
    for _ in range(_STEPS):
        if hardening == 0.0:
            break
        rest = bent * (1.0 + hardening * bent * bent) - loose
        bent -= rest / (1.0 + 3.0 * hardening * bent * bent)
    return bent + (0.5 * gap if force > 0.0 else -0.5 * gap)
