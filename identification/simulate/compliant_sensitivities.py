"""Sensitivities of the integration on a compliant mount.

``p`` and ``g`` are those of ``compliant_mount``, and the steps are the same. Each implicit stage is differentiated
as it was taken, so the sensitivities are derivatives of the discrete solution, not of the exact one.
"""

import math

import numpy as np

from identification.arrays import Array, njit_cached
from identification.damper import law
from identification.damper.effects import connection
from identification.simulate.compliant_mount import (
    COMPLIANCE,
    F0,
    FILM_DAMPING,
    FIXED_COUNT,
    GAP,
    HARDENING,
    IN_GAP_RATIO,
    INPUT_COUNT,
    K1,
    choose_sample_steps,
    combine_stages,
    compute_cell_force,
    compute_dashpot_force,
    compute_spring_force,
    compute_spring_stiffness,
    compute_start_rates,
    correct_first_stage,
    correct_second_stage,
    evaluate_law,
    find_start_position,
    interpolate_inputs,
    solve_stage,
)
from identification.simulate.kernel import StepCounts
from identification.simulate.step import (
    GAMMA,
    RATE_WEIGHT,
    compute_hysteresis_rate,
    differentiate_hysteresis_rate,
    evaluate_coefficient,
)


@njit_cached
def integrate_with_sensitivities(
    p: Array,
    at: Array,
    middle: Array,
    h: float,
    start: Array,
    max_travel: float,
    step_counts: StepCounts,
    over: Array,
    over_middle: Array,
    table_rows: Array,
) -> tuple[Array, Array, Array, Array]:
    """Integrate states and force along an excitation, and the sensitivities of the force.

    Args:
        p, at, middle, h, start, max_travel, step_counts: as in ``integrate``.
        over, over_middle: (E, 7, N) and (E, 7, N-1) derivatives of the inputs over further unknowns.
        table_rows: (T, G) derivatives of a tabulated elongation over its parameters [m].

    Returns:
        y [m], zeta [1], force [N], each (N,), and sensitivities (N, 17 + 1 + E + T) over fixed values, y0, further
        unknowns and the parameters of the table.
    """
    count, extra = at.shape[1], len(over)
    columns = FIXED_COUNT + 1 + extra + len(table_rows)
    ys, zetas, forces, sensitivities = (
        np.empty(count),
        np.empty(count),
        np.empty(count),
        np.empty((count, columns)),
    )
    S, S1, f, f1 = np.zeros((3, columns)), np.zeros((3, columns)), np.zeros((3, columns)), np.zeros((3, columns))
    J, J1, g = np.zeros((3, 3)), np.zeros((3, 3)), np.empty(INPUT_COUNT)
    D, D1, D2 = np.empty((extra, INPUT_COUNT)), np.empty((extra, INPUT_COUNT)), np.empty((extra, INPUT_COUNT))
    S[0, FIXED_COUNT] = 1.0
    y, zeta = start[0], start[1]
    interpolate_inputs(g, at, middle, h, 0, 0.0)
    _interpolate_derivatives(D, over, over_middle, h, 0, 0.0)
    X = find_start_position(p, g, y, zeta)
    _differentiate_start(p, g, y, zeta, X, D, table_rows, S)
    y_rate, zeta_rate, X_rate = _differentiate_rates(p, g, y, zeta, X, D, table_rows, J, f)
    for i in range(count):
        ys[i], zetas[i] = y, zeta
        forces[i] = compute_cell_force(p, g, X, X_rate)
        _record_row(sensitivities[i], S, J, f, D, table_rows, g[0] - X, g[6] - X_rate, p)
        if i == count - 1:
            break
        if step_counts[i] == 0:
            step_counts[i] = choose_sample_steps(max_travel, p, at, h, i, X_rate, y_rate, zeta, zeta_rate)
        w = RATE_WEIGHT * h / step_counts[i]
        for k in range(step_counts[i]):
            x0, v0 = g[0], g[6]
            t = (k + GAMMA) / step_counts[i]
            interpolate_inputs(g, at, middle, h, i, t)
            _interpolate_derivatives(D1, over, over_middle, h, i, t)
            x1, v1 = g[0], g[6]
            known = X + w * X_rate + correct_first_stage(w, x0, x1, v0, v1)
            y1, z1, X1 = solve_stage(p, g, y + w * y_rate, zeta + w * zeta_rate, known, w, zeta, X)
            _differentiate_rates(p, g, y1, z1, X1, D1, table_rows, J1, f1)
            _propagate_first_stage(w, J, S, f, f1, D, D1, S1)
            _solve(w, J1, S1)
            t = (k + 1.0) / step_counts[i]
            interpolate_inputs(g, at, middle, h, i, t)
            _interpolate_derivatives(D2, over, over_middle, h, i, t)
            known = combine_stages(X1, X) + correct_second_stage(w, x0, x1, g[0], g[6])
            y, zeta, X = solve_stage(p, g, combine_stages(y1, y), combine_stages(z1, zeta), known, w, z1, X1)
            y_rate, zeta_rate, X_rate = _differentiate_rates(p, g, y, zeta, X, D2, table_rows, J, f)
            _propagate_second_stage(w, f, S1, D, D1, D2, S)
            _solve(w, J, S)
            D[:] = D2
    return ys, zetas, forces, sensitivities


@njit_cached
def _interpolate_derivatives(D: Array, over: Array, over_middle: Array, h: float, i: int, t: float) -> None:
    """Write the derivatives of the inputs at the fraction t of sample i into D (E, 7)."""
    for e in range(len(over)):
        interpolate_inputs(D[e], over[e], over_middle[e], h, i, t)


@njit_cached
def _record_row(
    row: Array,
    S: Array,
    J: Array,
    f: Array,
    D: Array,
    table_rows: Array,
    elongation: float,
    elongation_rate: float,
    p: Array,
) -> None:
    """Write the sensitivities of the force at one sample into its row."""
    # The film's force depends on X', whose derivative over the unknowns follows from the state.
    steep, film = (
        compute_spring_stiffness(p, elongation),
        p[FILM_DAMPING],
    )
    for j in range(len(row)):
        X_rate = J[2, 0] * S[0, j] + J[2, 1] * S[1, j] + J[2, 2] * S[2, j] + f[2, j]
        row[j] = -S[2, j] * steep - film * X_rate
    for e in range(len(D)):
        row[FIXED_COUNT + 1 + e] += D[e, 0] * steep + film * D[e, 6]
    first = FIXED_COUNT + 1 + len(D)
    for k in range(len(table_rows)):
        row[first + k] -= steep * _interpolate_row(p, table_rows[k], elongation)
    row[FILM_DAMPING] += elongation_rate
    over_compliance, over_gap, over_hardening, over_in_gap_ratio = _differentiate_connection(elongation, p)
    row[COMPLIANCE] += over_compliance
    row[GAP] += over_gap
    row[HARDENING] += over_hardening
    row[IN_GAP_RATIO] += over_in_gap_ratio


@njit_cached
def _differentiate_connection(elongation: float, p: Array) -> tuple[float, float, float, float]:
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
def _interpolate_row(p: Array, row: Array, elongation: float) -> float:
    """Return the derivative of the elongation over a parameter of the table [m], at an elongation [m]."""
    return float(np.interp(elongation, p[FIXED_COUNT:], row))


@njit_cached
def _propagate_first_stage(
    w: float, J: Array, S: Array, f: Array, f1: Array, D: Array, D1: Array, S1: Array
) -> None:
    """Write the derivatives of the known part of the first stage and of its explicit part into S1."""
    for j in range(S.shape[1]):
        for a in range(3):
            moved = J[a, 0] * S[0, j] + J[a, 1] * S[1, j] + J[a, 2] * S[2, j]
            S1[a, j] = S[a, j] + w * (moved + f[a, j] + f1[a, j])
    for e in range(len(D)):
        S1[2, FIXED_COUNT + 1 + e] += correct_first_stage(w, D[e, 0], D1[e, 0], D[e, 6], D1[e, 6])


@njit_cached
def _propagate_second_stage(w: float, f: Array, S1: Array, D: Array, D1: Array, D2: Array, S: Array) -> None:
    """Replace S by the derivatives of the known part of the second stage and of its explicit part."""
    for j in range(S.shape[1]):
        for a in range(3):
            S[a, j] = combine_stages(S1[a, j], S[a, j]) + w * f[a, j]
    for e in range(len(D)):
        S[2, FIXED_COUNT + 1 + e] += correct_second_stage(w, D[e, 0], D1[e, 0], D2[e, 0], D2[e, 6])


@njit_cached
def _differentiate_start(
    p: Array, g: Array, y0: float, zeta0: float, X: float, D: Array, table_rows: Array, S: Array
) -> None:
    """Write the derivatives of the initial X into S."""
    u = g[1]
    part, y_rate, slip = compute_start_rates(p, g, y0, zeta0, X)
    compliance = 1.0 / compute_spring_stiffness(p, g[0] - X)
    stiff = 1.0 + compliance * (p[K1] + part * p[9])
    # Each is the derivative of the load of the connection, times compliance.
    scale = -compliance / stiff
    over_yield, over_c0, over_c1 = part * zeta0, part * slip, (1.0 - part) * y_rate
    S[2, 0], S[2, 1] = scale * g[2] * over_yield, scale * u * g[2] * over_yield
    S[2, 5], S[2, 6] = scale * g[3] * over_c0, scale * u * g[3] * over_c0
    S[2, 7], S[2, 8] = scale * g[4] * over_c1, scale * u * g[4] * over_c1
    S[2, 9], S[2, FIXED_COUNT] = scale * part * (X - y0), -scale * part * p[9]
    S[2, K1], S[2, F0] = scale * X, -scale
    over_compliance, over_gap, over_hardening, over_in_gap_ratio = _differentiate_connection(g[0] - X, p)
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
        S[2, first + k] = -_interpolate_row(p, table_rows[k], g[0] - X) / stiff


@njit_cached
def _differentiate_rates(
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
    k0 = p[9]
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
        change = -steep * _interpolate_row(p, table_rows[e], g[0] - X)
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
    f[1, 9] = -(X - y) / c0
    f[0, K1], f[1, K1] = -X / c1, -X / c0
    f[0, F0], f[1, F0] = 1.0 / c1, 1.0 / c0
    over_compliance, over_gap, over_hardening, over_in_gap_ratio = _differentiate_connection(g[0] - X, p)
    f[0, COMPLIANCE], f[1, COMPLIANCE] = over_compliance / c1, over_compliance / c0
    f[0, GAP], f[1, GAP] = over_gap / c1, over_gap / c0
    f[0, HARDENING], f[1, HARDENING] = over_hardening / c1, over_hardening / c0
    f[0, IN_GAP_RATIO], f[1, IN_GAP_RATIO] = over_in_gap_ratio / c1, over_in_gap_ratio / c0
    elongation_rate = g[6] - slip - y_rate
    f[0, FILM_DAMPING], f[1, FILM_DAMPING] = elongation_rate / c1, elongation_rate / c0


@njit_cached
def _solve(w: float, J: Array, S: Array) -> None:
    """Replace S by the solution of (1 - w J) X = S for all unknowns, by the inverse of the 3 by 3 matrix."""
    a, b, c = 1.0 - w * J[0, 0], -w * J[0, 1], -w * J[0, 2]
    d, e, f = -w * J[1, 0], 1.0 - w * J[1, 1], -w * J[1, 2]
    g, h, i = -w * J[2, 0], -w * J[2, 1], 1.0 - w * J[2, 2]
    A, B, C = e * i - f * h, c * h - b * i, b * f - c * e
    D, E, F = f * g - d * i, a * i - c * g, c * d - a * f
    G, H, K = d * h - e * g, b * g - a * h, a * e - b * d
    inverse = 1.0 / (a * A + b * D + c * G)
    for j in range(S.shape[1]):
        x, y, z = S[0, j], S[1, j], S[2, j]
        S[0, j] = (A * x + B * y + C * z) * inverse
        S[1, j] = (D * x + E * y + F * z) * inverse
        S[2, j] = (G * x + H * y + K * z) * inverse
