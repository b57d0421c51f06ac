"""Sensitivities of the integration on a compliant mount.

The steps are those of the integration. Each implicit stage is differentiated as it was taken, so the sensitivities
are derivatives of the discrete solution, not of the exact one.
"""

import numpy as np

from identification.arrays import Array, njit_cached
from identification.simulate.compliant_mount.integration import choose_sample_steps, compute_cell_force
from identification.simulate.compliant_mount.rate_derivatives import (
    differentiate_connection,
    differentiate_rates,
    differentiate_start,
    interpolate_row,
)
from identification.simulate.compliant_mount.springs import (
    COMPLIANCE,
    FILM_DAMPING,
    FIXED_COUNT,
    GAP,
    HARDENING,
    IN_GAP_RATIO,
    compute_spring_stiffness,
)
from identification.simulate.compliant_mount.stacked_inputs import INPUT_COUNT, interpolate_inputs
from identification.simulate.compliant_mount.stages import (
    combine_stages,
    correct_first_stage,
    correct_second_stage,
    find_start_position,
    solve_first_stage,
    solve_second_stage,
)
from identification.simulate.kernel import StepCounts
from identification.simulate.step import GAMMA, RATE_WEIGHT


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
    differentiate_start(p, g, y, zeta, X, D, table_rows, S)
    y_rate, zeta_rate, X_rate = differentiate_rates(p, g, y, zeta, X, D, table_rows, J, f)
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
            x1 = g[0]
            y1, z1, X1 = solve_first_stage(p, g, y, zeta, X, y_rate, zeta_rate, X_rate, w, x0, v0)
            differentiate_rates(p, g, y1, z1, X1, D1, table_rows, J1, f1)
            _propagate_first_stage(w, J, S, f, f1, D, D1, S1)
            _solve(w, J1, S1)
            t = (k + 1.0) / step_counts[i]
            interpolate_inputs(g, at, middle, h, i, t)
            _interpolate_derivatives(D2, over, over_middle, h, i, t)
            y, zeta, X = solve_second_stage(p, g, y, zeta, X, y1, z1, X1, w, x0, x1)
            y_rate, zeta_rate, X_rate = differentiate_rates(p, g, y, zeta, X, D2, table_rows, J, f)
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
        row[first + k] -= steep * interpolate_row(p, table_rows[k], elongation)
    row[FILM_DAMPING] += elongation_rate
    over_compliance, over_gap, over_hardening, over_in_gap_ratio = differentiate_connection(elongation, p)
    row[COMPLIANCE] += over_compliance
    row[GAP] += over_gap
    row[HARDENING] += over_hardening
    row[IN_GAP_RATIO] += over_in_gap_ratio


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
