"""Force of a connection between load cell and damper over its elongation.

The connection is a spring that yields under load, hardens with elongation, and has a gap in its middle: the free
travel of a pin, or a bolted joint that has not closed. Without gap and hardening it is a linear spring.

A connection of any other shape is a table: its elongation at the forces ``FORCES``, between which it is linear.
"""

from typing import Any

import numpy as np

MIN_STIFFNESS_RATIO = 1e-4
"""Least stiffness inside the gap over that outside [1]: without it a free pin's position would be undefined."""
_ITERATIONS = 40
_SMALLEST_FORCE, _LARGEST_FORCE = 1e-3, 1e7
"""Range of forces of either sign that a table resolves [N]."""
_POINTS_PER_DECADE = 200
"""Points of a table in each decade of the force; they are even in the logarithm."""
_POSITIVE = np.geomspace(
    _SMALLEST_FORCE, _LARGEST_FORCE, round(np.log10(_LARGEST_FORCE / _SMALLEST_FORCE)) * _POINTS_PER_DECADE + 1
)
FORCES = np.concatenate([-_POSITIVE[::-1], [0.0], _POSITIVE])
"""(G,) forces [N] at which a table gives the elongation, increasing."""


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


def tabulate_elongation(elongation: Any, least_compliance: float) -> Any:
    """Return a table (G,) of a connection [m] that elongates at every increase of the force.

    Args:
        elongation: (G,) elongation at ``FORCES`` [m], which may decrease.
        least_compliance: least slope of the table [m/N]; with none, no elongation would belong to one force only.
    """
    steps = np.maximum(np.diff(elongation), least_compliance * np.diff(FORCES))
    return _accumulate(steps, np.asarray(elongation)[len(FORCES) // 2])


def differentiate_table(elongation: Any, derivative: Any) -> Any:
    """Return the derivative (G,) of a table from that of the elongation (G,), both over one parameter.

    A part that decreases has none. A rigid connection has the derivative of a growing elongation.
    """
    steps = np.where(np.diff(elongation) < 0.0, 0.0, np.diff(derivative))
    return _accumulate(steps, np.asarray(derivative)[len(FORCES) // 2])


def _accumulate(steps: Any, middle: Any) -> Any:
    # Summed from the middle: the small steps there would drown in the elongation at the ends.
    half = len(steps) // 2
    below, above = -np.cumsum(steps[:half][::-1])[::-1], np.cumsum(steps[half:])
    return np.concatenate([below, [0.0], above]) + middle


def interpolate_force(elongation: Any, table: Any, first: int) -> tuple[Any, Any]:
    """Return the force [N] and its derivative [N/m] at an elongation [m]; beyond its ends, a table is linear.

    Args:
        elongation: displacement of the actuator less that of the damper [m].
        table: array whose last G values are the elongations at ``FORCES`` [m].
        first: position of the first of these.
    """
    low, high = 0, len(FORCES) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if table[first + middle] > elongation:
            high = middle
        else:
            low = middle
    stiffness = (FORCES[high] - FORCES[low]) / (table[first + high] - table[first + low])
    return FORCES[low] + stiffness * (elongation - table[first + low]), stiffness
