"""Fixed values of the integration on a compliant mount, and the spring of its connection.

``p`` holds 17 fixed values: the ten structural coordinates, k1, f0, and compliance, gap, hardening, film damping
and in-gap stiffness ratio of the connection. Where the elongation is a table, its G values follow, and only the
film damping of the five counts.
"""

import numpy as np

from identification.arrays import Array, njit_cached
from identification.damper.effects import connection

FIXED_COUNT, CONNECTION_COUNT = 17, 5
K0, K1, F0, COMPLIANCE, GAP, HARDENING, FILM_DAMPING, IN_GAP_RATIO = 9, 10, 11, 12, 13, 14, 15, 16

_compute_transmitted_force = njit_cached(connection.compute_transmitted_force)
_compute_tangent_stiffness = njit_cached(connection.compute_tangent_stiffness)
_compute_formula_elongation = njit_cached(connection.compute_elongation)
_interpolate_force = njit_cached(connection.interpolate_force)
_FORCES = connection.FORCES


@njit_cached
def evaluate_spring(p: Array, elongation: float) -> tuple[float, float]:
    """Return the force of the connection [N] without its film, and its derivative [N/m], at an elongation [m]."""
    if len(p) > FIXED_COUNT:
        return _interpolate_force(elongation, p, FIXED_COUNT)
    return (
        float(_compute_transmitted_force(elongation, p[COMPLIANCE], p[GAP], p[HARDENING], p[IN_GAP_RATIO])),
        float(_compute_tangent_stiffness(elongation, p[COMPLIANCE], p[GAP], p[HARDENING], p[IN_GAP_RATIO])),
    )


@njit_cached
def compute_spring_force(p: Array, elongation: float) -> float:
    """Compute the force of the connection [N] at an elongation [m], without that of its film."""
    return evaluate_spring(p, elongation)[0]


@njit_cached
def compute_spring_stiffness(p: Array, elongation: float) -> float:
    """Compute the derivative of this force over the elongation [N/m]."""
    return evaluate_spring(p, elongation)[1]


@njit_cached
def compute_elongation(p: Array, force: float) -> float:
    """Compute the elongation of the connection [m] under a force [N]."""
    if len(p) > FIXED_COUNT:
        return float(np.interp(force, _FORCES, p[FIXED_COUNT:]))
    return float(_compute_formula_elongation(force, p[COMPLIANCE], p[GAP], p[HARDENING], p[IN_GAP_RATIO]))
