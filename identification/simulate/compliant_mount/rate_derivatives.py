"""Derivatives of the rates of the states on a compliant mount, and of their start.

``D`` holds the derivatives (E, 7) of the inputs over further unknowns at one instant. The columns of a derivative
are those of the fixed values, y0, these unknowns, and the parameters of a tabulated elongation.
"""

import math

import numpy as np

from identification.arrays import Array, njit_cached
from identification.damper import law
from identification.damper.effects import connection
from identification.simulate.compliant_mount.springs import (
    COMPLIANCE,
    F0,
    FILM_DAMPING,
    FIXED_COUNT,
    GAP,
    HARDENING,
    IN_GAP_RATIO,
    K0,
    K1,
    compute_spring_force,
    compute_spring_stiffness,
)
from identification.simulate.compliant_mount.stacked_inputs import INPUT_COUNT
from identification.simulate.compliant_mount.stages import compute_dashpot_force, compute_start_rates, evaluate_law
from identification.simulate.step import (
    compute_hysteresis_rate,
    differentiate_hysteresis_rate,
    evaluate_coefficient,
)


@njit_cached
def differentiate_start(
    p: Array, g: Array, y0: float, zeta0: float, X: float, D: Array, table_rows: Array, S: Array
) -> None:
    """Write the derivatives of the initial X into S."""
    u = g[1]
    part, y_rate, slip = compute_start_rates(p, g, y0, zeta0, X)
    compliance = 1.0 / compute_spring_stiffness(p, g[0] - X)
    stiff = 1.0 + compliance * (p[K1] + part * p[K0])
    # Each is the derivative of the load of the connection, times compliance.
    scale = -compliance / stiff
    over_yield, over_c0, over_c1 = part * zeta0, part * slip, (1.0 - part) * y_rate
    S[2, 0], S[2, 1] = scale * g[2] * over_yield, scale * u * g[2] * over_yield
    S[2, 5], S[2, 6] = scale * g[3] * over_c0, scale * u * g[3] * over_c0
    S[2, 7], S[2, 8] = scale * g[4] * over_c1, scale * u * g[4] * over_c1
    S[2, K0], S[2, FIXED_COUNT] = scale * part * (X - y0), -scale * part * p[K0]
    S[2, K1], S[2, F0] = scale * X, -scale
    over_compliance, over_gap, over_hardening, over_in_gap_ratio = differentiate_connection(g[0] - X, p)
    S[2, COMPLIANCE], S[2, GAP] = -scale * over_compliance, -scale * over_gap
    S[2, HARDENING], S[2, IN_GAP_RATIO] = -scale * over_hardening, -scale * over_in_gap_ratio
    for e in range(len(D)):
        d = D[e]
        change = (g[2] * p[1] * over_yield + g[3] * p[6] * over_c0 + g[4] * p[8] * over_c1) * d[1] + d[5]
        change += d[2] * evaluate_coefficient(p[0], p[1], u) * over_yield
        change += d[3] * evaluate_coefficient(p[5], p[6], u) * over_c0
        change += d[4] * evaluate_coefficient(p[7], p[8], u) * over_c1
        change += part * g[3] * evaluate_coefficient(p[5], p[6], u) * d[6]
        S[2, FIXED_COUNT + 1 + e] = d[0] / stiff + scale * change
    first = FIXED_COUNT + 1 + len(D)
    for k in range(len(table_rows)):
        S[2, first + k] = -interpolate_row(p, table_rows[k], g[0] - X) / stiff


@njit_cached
def differentiate_rates(
    p: Array,
    g: Array,
    y: float,
    zeta: float,
    X: float,
    D: Array,
    table_rows: Array,
    J: Array,
    f: Array,
) -> tuple[float, float, float]:
    """Return the rates of y, zeta and X.

    Their derivatives over the state are written into J (3, 3), those over all unknowns into f (3, columns).
    """
    F, c0, c1 = evaluate_law(p, g)
    k0 = p[K0]
    steep = compute_spring_stiffness(p, g[0] - X)
    held = F * zeta + k0 * (X - y)
    R = compute_dashpot_force(p, g, X, held, c0, c1)
    y_rate, slip = R / c1, (R - held) / c0
    A = 1.0 / p[2]
    beta = p[3] * A
    rate = compute_hysteresis_rate(slip, zeta, A, beta, A - beta, p[4])
    over_slip, over_zeta = differentiate_hysteresis_rate(slip, zeta, A, beta, A - beta, p[4])
    stiffness = steep + p[K1]
    J[0, 0] = J[0, 1] = 0.0
    J[0, 2] = -stiffness / c1
    J[1, 0], J[1, 1], J[1, 2] = k0 / c0, -F / c0, -(stiffness + k0) / c0
    # Row 1 of J and f holds derivatives of the slip. At the end they are converted to those of zeta' and X'.
    _differentiate_by_fixed(p, g, X, y, zeta, y_rate, slip, c0, c1, f)
    for e in range(len(D)):
        f[0, FIXED_COUNT + 1 + e] = f[1, FIXED_COUNT + 1 + e] = 0.0
        for k in range(INPUT_COUNT):
            if D[e, k] != 0.0:
                over_y, over_s = _differentiate_by_input(p, g, k, steep, zeta, y_rate, slip, c0, c1)
                f[0, FIXED_COUNT + 1 + e] += over_y * D[e, k]
                f[1, FIXED_COUNT + 1 + e] += over_s * D[e, k]
    first = FIXED_COUNT + 1 + len(D)
    for e in range(len(table_rows)):
        change = -steep * interpolate_row(p, table_rows[e], g[0] - X)
        f[0, first + e], f[1, first + e] = change / c1, change / c0
    _apply_film_damping(p[FILM_DAMPING], c0, c1, over_slip, f)
    _apply_film_damping(p[FILM_DAMPING], c0, c1, over_slip, J)
    J[1, 1] += over_zeta
    size = abs(zeta)
    power = (size + law.Z_GUARD) ** (p[4] - 1.0)
    f[1, 2] -= rate * A
    f[1, 3] += (abs(slip) * zeta - slip * size) * power * A
    turned = (A - beta) * abs(slip) * zeta + beta * slip * size
    f[1, 4] -= turned * power * math.log(size + law.Z_GUARD)
    return y_rate, rate, slip + y_rate


@njit_cached
def _apply_film_damping(film: float, c0: float, c1: float, over_slip: float, rows: Array) -> None:
    """Convert derivatives of y' and slip at fixed X' to those of y', zeta' and X', on which the film depends."""
    weaker = 1.0 / (1.0 + film * (1.0 / c0 + 1.0 / c1))
    for j in range(rows.shape[1]):
        X_rate = weaker * (rows[0, j] + rows[1, j])
        rows[0, j] -= film / c1 * X_rate
        rows[1, j] = over_slip * (rows[1, j] - film / c0 * X_rate)
        rows[2, j] = X_rate


@njit_cached
def _differentiate_by_input(
    p: Array, g: Array, k: int, steep: float, zeta: float, y_rate: float, slip: float, c0: float, c1: float
) -> tuple[float, float]:
    """Return the derivatives of y' and of the slip over the k-th input."""
    u = g[1]
    if k == 0:
        return steep / c1, steep / c0
    if k == 1:
        return -y_rate * g[4] * p[8] / c1, -(g[2] * p[1] * zeta + slip * g[3] * p[6]) / c0
    if k == 2:
        return 0.0, -evaluate_coefficient(p[0], p[1], u) * zeta / c0
    if k == 3:
        return 0.0, -slip * evaluate_coefficient(p[5], p[6], u) / c0
    if k == 4:
        return -y_rate * evaluate_coefficient(p[7], p[8], u) / c1, 0.0
    if k == 5:
        return -1.0 / c1, -1.0 / c0
    return p[FILM_DAMPING] / c1, p[FILM_DAMPING] / c0


@njit_cached
def _differentiate_by_fixed(
    p: Array,
    g: Array,
    X: float,
    y: float,
    zeta: float,
    y_rate: float,
    slip: float,
    c0: float,
    c1: float,
    f: Array,
) -> None:
    """Write the derivatives of y' (row 0) and of the slip (row 1) over the fixed values and y0 into f."""
    u = g[1]
    for j in range(FIXED_COUNT + 1):
        f[0, j] = f[1, j] = 0.0
    f[1, 0], f[1, 1] = -g[2] * zeta / c0, -u * g[2] * zeta / c0
    f[1, 5], f[1, 6] = -slip * g[3] / c0, -u * slip * g[3] / c0
    f[0, 7], f[0, 8] = -y_rate * g[4] / c1, -u * y_rate * g[4] / c1
    f[1, K0] = -(X - y) / c0
    f[0, K1], f[1, K1] = -X / c1, -X / c0
    f[0, F0], f[1, F0] = 1.0 / c1, 1.0 / c0
    over_compliance, over_gap, over_hardening, over_in_gap_ratio = differentiate_connection(g[0] - X, p)
    f[0, COMPLIANCE], f[1, COMPLIANCE] = over_compliance / c1, over_compliance / c0
    f[0, GAP], f[1, GAP] = over_gap / c1, over_gap / c0
    f[0, HARDENING], f[1, HARDENING] = over_hardening / c1, over_hardening / c0
    f[0, IN_GAP_RATIO], f[1, IN_GAP_RATIO] = over_in_gap_ratio / c1, over_in_gap_ratio / c0
    elongation_rate = g[6] - slip - y_rate
    f[0, FILM_DAMPING], f[1, FILM_DAMPING] = elongation_rate / c1, elongation_rate / c0


@njit_cached
def differentiate_connection(elongation: float, p: Array) -> tuple[float, float, float, float]:
    """Differentiate the force of the connection over compliance, gap, hardening and in-gap stiffness ratio.

    Those of a table are zero: its parameters act as a displacement of the actuator.
    """
    if len(p) > FIXED_COUNT:
        return 0.0, 0.0, 0.0, 0.0
    compliance, half = p[COMPLIANCE], 0.5 * p[GAP]
    free = min(max(elongation, -half), half)
    engaged = elongation - free
    over_compliance = -compute_spring_force(p, elongation) / compliance
    if engaged == 0.0:
        return over_compliance, 0.0, 0.0, free / compliance
    side = 0.5 if engaged > 0.0 else -0.5
    over_gap = side * (
        (connection.MIN_STIFFNESS_RATIO + p[IN_GAP_RATIO]) / compliance - compute_spring_stiffness(p, elongation)
    )
    return over_compliance, over_gap, engaged**3 / compliance, free / compliance


@njit_cached
def interpolate_row(p: Array, row: Array, elongation: float) -> float:
    """Return the derivative of the elongation over a parameter of the table [m], at an elongation [m]."""
    return float(np.interp(elongation, p[FIXED_COUNT:], row))
