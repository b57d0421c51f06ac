"""What a connection between load cell and damper carries, over the stretch between the two.

A spring that gives way, hardens as it is stretched, and has a gap in its middle where the pin lies free. Without
gap and hardening it is a linear spring.
"""

from typing import Any

FILM = 1e-4
"""[1] stiffness inside the gap over that outside: what keeps a pin from lying nowhere."""
_STEPS = 40


def carried(stretch: Any, give: Any, gap: Any, hardening: Any) -> Any:
    """Force [N] at a stretch [m].

    Args:
        stretch: actuator less damper [m].
        give: of the spring, hardly stretched [m/N].
        gap: free travel from side to side [m].
        hardening: growth of the secant stiffness over the squared stretch [1/m²].
    """
    half = 0.5 * gap
    inside = min(max(stretch, -half), half)
    bent = stretch - inside
    return (bent * (1.0 + hardening * bent * bent) + FILM * inside) / give


def steepness(stretch: Any, give: Any, gap: Any, hardening: Any) -> Any:
    """Slope of that force over the stretch [N/m]."""
    half = 0.5 * gap
    if -half < stretch < half:
        return FILM / give
    bent = stretch - min(max(stretch, -half), half)
    return (1.0 + 3.0 * hardening * bent * bent) / give


def stretched(force: Any, give: Any, gap: Any, hardening: Any) -> Any:
    """Stretch [m] at which the connection carries a force [N] outside its gap."""
    bent = give * force
    for _ in range(_STEPS):
        if hardening == 0.0:
            break
        rest = bent * (1.0 + hardening * bent * bent) - give * force
        bent -= rest / (1.0 + 3.0 * hardening * bent * bent)
    return bent + (0.5 * gap if force > 0.0 else -0.5 * gap)
