"""Rates of the states on a compliant mount, their start, and the implicit stages of a step.

With the force on the dashpot c1, R = transmitted(x - X) + d (x' - X') - k1 X + f0 - p (x displacement of the
actuator, d film damping of the connection, p parallel force), the law reads

    y' = R / c1      X' = slip + y'      slip = (R - F zeta - k0 (X - y)) / c0      zeta' = g(slip, zeta)

For a linear spring, each implicit stage is linear in y and X. It reduces to one scalar equation in zeta, as on a
rigid mount. Any other connection is linearised repeatedly until its elongation no longer changes.
The force on the load cell is the force of the connection. Parallel forces are evaluated at the actuator's motion.
``p`` holds the fixed values (``springs``), and ``g`` the inputs at one instant (``stacked_inputs``).
"""

import numpy as np

from identification.arrays import Array, njit_cached
from identification.simulate.compliant_mount.springs import (
    F0,
    FILM_DAMPING,
    FIXED_COUNT,
    GAP,
    HARDENING,
    K0,
    K1,
    compute_elongation,
    compute_spring_force,
    evaluate_spring,
)
from identification.simulate.step import (
    WEIGHT_STAGE,
    WEIGHT_START,
    compute_hysteresis_rate,
    evaluate_coefficient,
    solve_hysteresis,
)

_MAX_LINEARISATIONS = 12
"""Largest number of linearisations of a connection in one stage."""
_MAX_TABLE_LINEARISATIONS = 60
"""The same for a table, of which a bisection finds every cell."""
_FORCE_TOLERANCE = 1e-8
"""Relative error of the connection's force below which the linearisation is accepted [1]."""
_EDGE_OFFSET = 1e-12
"""Distance beyond an edge of the gap at which the other side is linearised [m]."""


@njit_cached
def evaluate_law(p: Array, g: Array) -> tuple[float, float, float]:
    """Return yield force [N], c0 and c1 [N s/m] at the inputs."""
    return (
        g[2] * evaluate_coefficient(p[0], p[1], g[1]),
        g[3] * evaluate_coefficient(p[5], p[6], g[1]),
        g[4] * evaluate_coefficient(p[7], p[8], g[1]),
    )


@njit_cached
def compute_rates(p: Array, g: Array, y: float, zeta: float, X: float) -> tuple[float, float, float]:
    """Return the rates of y [m/s], zeta [1/s] and X [m/s]."""
    F, c0, c1 = evaluate_law(p, g)
    held = F * zeta + p[K0] * (X - y)
    R = compute_dashpot_force(p, g, X, held, c0, c1)
    y_rate = R / c1
    slip = (R - held) / c0
    beta = p[3] / p[2]
    return y_rate, compute_hysteresis_rate(slip, zeta, 1.0 / p[2], beta, 1.0 / p[2] - beta, p[4]), slip + y_rate


@njit_cached
def compute_dashpot_force(p: Array, g: Array, X: float, held: float, c0: float, c1: float) -> float:
    """Compute the force R [N] on the dashpot c1; ``held`` is the part of hysteresis and k0."""
    spring = compute_spring_force(p, g[0] - X) - p[K1] * X + p[F0] - g[5]
    film = p[FILM_DAMPING]
    return float((spring + film * (g[6] + held / c0)) / (1.0 + film * (1.0 / c0 + 1.0 / c1)))


@njit_cached
def find_start_position(p: Array, g: Array, y0: float, zeta0: float) -> float:
    """Find the initial X [m], at which the damper has the velocity of the actuator."""
    X = g[0]
    # k0 and k1 act at X. Each iteration reduces the error by the factor of both times compliance, which is small.
    for _ in range(_MAX_LINEARISATIONS):
        _, y_rate, _ = compute_start_rates(p, g, y0, zeta0, X)
        c1 = evaluate_law(p, g)[2]
        X = g[0] - compute_elongation(p, c1 * y_rate + p[K1] * X - p[F0] + g[5])
    return float(X)


@njit_cached
def compute_start_rates(p: Array, g: Array, y0: float, zeta0: float, X: float) -> tuple[float, float, float]:
    """Return c1 over c0 + c1 [1], and y' and slip [m/s] of a damper that has the velocity of the actuator."""
    F, c0, c1 = evaluate_law(p, g)
    y_rate = (c0 * g[6] + F * zeta0 + p[K0] * (X - y0)) / (c0 + c1)
    return c1 / (c0 + c1), y_rate, g[6] - y_rate


@njit_cached
def solve_stage(
    p: Array, g: Array, yk: float, zk: float, Xk: float, w: float, zeta: float, X: float
) -> tuple[float, float, float]:
    """Solve state = known + w * rates(state) for y, zeta and X at the end of a stage, from ``zeta`` and ``X``."""
    tabulated, half = len(p) > FIXED_COUNT, 0.5 * p[GAP]
    elongation, y = g[0] - X, yk
    low, high = -np.inf, np.inf
    for _ in range(_MAX_TABLE_LINEARISATIONS if tabulated else _MAX_LINEARISATIONS):
        force, steep = evaluate_spring(p, elongation)
        y, zeta, X = _solve_linearised(p, g, yk, zk, Xk, w, zeta, force - steep * elongation, steep)
        # A linear spring needs one linearisation.
        if not tabulated and half == 0.0 and p[HARDENING] == 0.0:
            break
        moved = g[0] - X
        straight = force + steep * (moved - elongation)
        if abs(compute_spring_force(p, moved) - straight) < _FORCE_TOLERANCE * (1.0 + abs(straight)):
            break
        if not tabulated:
            elongation = _choose_elongation(elongation, moved, half)
            continue
        # The force grows with the elongation and the load of the damper decreases, so the step shows the side.
        low, high = (elongation, high) if moved > elongation else (low, elongation)
        elongation = moved if low < moved < high else 0.5 * (low + high)
    return y, zeta, X


@njit_cached
def _choose_elongation(elongation: float, moved: float, half: float) -> float:
    """Return the elongation of the next linearisation: at most just beyond the next edge of the gap."""
    if elongation <= -half < moved:
        return -half + _EDGE_OFFSET
    if elongation >= half > moved:
        return half - _EDGE_OFFSET
    if abs(elongation) < half <= abs(moved):
        return half + _EDGE_OFFSET if moved > 0.0 else -half - _EDGE_OFFSET
    return moved


@njit_cached
def _solve_linearised(
    p: Array, g: Array, yk: float, zk: float, Xk: float, w: float, zeta: float, force: float, steep: float
) -> tuple[float, float, float]:
    """Solve the stage for a connection that transmits ``force + steep * elongation``."""
    F, c0, c1 = evaluate_law(p, g)
    k0, k1 = p[K0], p[K1]
    # With X' = (X - known) / w, the film's force d (x' - X') acts as one more spring in this stage.
    rho = force + steep * g[0] + p[F0] - g[5] + p[FILM_DAMPING] * (g[6] + Xk / w)
    stiffness = steep + k1 + p[FILM_DAMPING] / w
    q = 1.0 + c0 / c1 + k0 * w / c1
    inverse = 1.0 / (c0 / w + k0 + stiffness * q)
    constant, slope = (c0 * Xk / w + k0 * yk + rho * q) * inverse, -F * inverse
    slip0 = (constant - Xk) / w - (rho - stiffness * constant) / c1
    slip1 = slope / w + stiffness * slope / c1
    zeta = solve_hysteresis(p, zk, w, slip0, slip1, zeta)
    X = constant + slope * zeta
    return yk + w * (rho - stiffness * X) / c1, zeta, X


@njit_cached
def combine_stages(stage: float, start: float) -> float:
    """Return the known part of the second stage, from the first stage and the start of the step."""
    return WEIGHT_STAGE * stage - WEIGHT_START * start


@njit_cached
def solve_first_stage(
    p: Array,
    g: Array,
    y: float,
    zeta: float,
    X: float,
    y_rate: float,
    zeta_rate: float,
    X_rate: float,
    w: float,
    x0: float,
    v0: float,
) -> tuple[float, float, float]:
    """Return y, zeta and X at the first stage, from the start of the step and the actuator's motion there."""
    known = X + w * X_rate + correct_first_stage(w, x0, g[0], v0, g[6])
    return solve_stage(p, g, y + w * y_rate, zeta + w * zeta_rate, known, w, zeta, X)


@njit_cached
def solve_second_stage(
    p: Array,
    g: Array,
    y: float,
    zeta: float,
    X: float,
    y1: float,
    z1: float,
    X1: float,
    w: float,
    x0: float,
    x1: float,
) -> tuple[float, float, float]:
    """Return y, zeta and X at the end of the step, from its start, its first stage and the actuator's path."""
    known = combine_stages(X1, X) + correct_second_stage(w, x0, x1, g[0], g[6])
    return solve_stage(p, g, combine_stages(y1, y), combine_stages(z1, zeta), known, w, z1, X1)


@njit_cached
def correct_first_stage(w: float, x0: float, x1: float, v0: float, v1: float) -> float:
    """Return what the weights miss of the actuator's path up to the first stage [m].

    With it, the elongation is the integrated state, and X follows from it. On a stiff connection the damper then
    has the velocity of the actuator, also at coarse steps.
    """
    return x1 - x0 - w * (v0 + v1)


@njit_cached
def correct_second_stage(w: float, x0: float, x1: float, x2: float, v2: float) -> float:
    """Return what the weights miss of the actuator's path up to the end of the step [m]."""
    return x2 - combine_stages(x1, x0) - w * v2
