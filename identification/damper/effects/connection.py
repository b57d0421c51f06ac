"""Force of a connection between load cell and damper over its elongation.

The connection is a spring that yields under load, hardens with elongation, and has a gap in its middle: the free
travel of a pin, or a bolted joint that has not closed. Without gap and hardening it is a linear spring.
"""

from typing import Any

MIN_STIFFNESS_RATIO = 1e-4
"""Least stiffness inside the gap over that outside [1]: without it a free pin's position would be undefined."""
_ITERATIONS = 40


def compute_transmitted_force(
    elongation: Any, compliance: Any, gap: Any, hardening: Any, in_gap_ratio: Any
) -> Any:
    """Return the transmitted force [N] at an elongation [m].

    Args:
        elongation: displacement of the actuator less that of the damper [m].
        compliance: compliance of the spring at small elongation [m/N].
        gap: free travel from side to side [m].
        hardening: growth of the secant stiffness over the squared elongation [1/m²].
        in_gap_ratio: stiffness in the gap over that outside, in addition to the least one [1].
    """
    half = 0.5 * gap
    free = min(max(elongation, -half), half)
    engaged = elongation - free
    return (
        engaged * (1.0 + hardening * engaged * engaged) + (MIN_STIFFNESS_RATIO + in_gap_ratio) * free
    ) / compliance


def compute_tangent_stiffness(
    elongation: Any, compliance: Any, gap: Any, hardening: Any, in_gap_ratio: Any
) -> Any:
    """Return the derivative of the transmitted force over the elongation [N/m]."""
    half = 0.5 * gap
    if -half < elongation < half:
        return (MIN_STIFFNESS_RATIO + in_gap_ratio) / compliance
    engaged = elongation - min(max(elongation, -half), half)
    return (1.0 + 3.0 * hardening * engaged * engaged) / compliance


def compute_elongation(force: Any, compliance: Any, gap: Any, hardening: Any, in_gap_ratio: Any) -> Any:
    """Return the elongation [m] at which a force [N] is transmitted; a free pin is put at an end of its gap."""
    gap_force = 0.5 * gap * in_gap_ratio
    if abs(compliance * force) < gap_force:
        return compliance * force / in_gap_ratio
    linear = compliance * force - (gap_force if force > 0.0 else -gap_force)
    engaged = linear
    for _ in range(_ITERATIONS):
        if hardening == 0.0:
            break
        error = engaged * (1.0 + hardening * engaged * engaged) - linear
        engaged -= error / (1.0 + 3.0 * hardening * engaged * engaged)
    return engaged + (0.5 * gap if force > 0.0 else -0.5 * gap)
