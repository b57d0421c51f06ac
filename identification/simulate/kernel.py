"""Integration of the law along an excitation, with or without the sensitivities of the force.

The sensitivities are exact derivatives of the discrete solution, because each implicit step is differentiated as
it was taken. They agree with finite differences to rounding. A sample is one step, or several where the hysteretic
variable changes fast. The first integration chooses the number from the expected change of zeta. Later
integrations with sensitivities or nearby coordinates reuse these step counts, which keeps the force smooth in the
unknowns.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, njit_cached, njit_inline
from identification.simulate.step import (
    GAMMA,
    RATE_WEIGHT,
    STRUCTURAL_COUNT,
    WEIGHT_STAGE,
    WEIGHT_START,
    choose_steps,
    compute_rates,
    differentiate_rates,
    interpolate_motion,
    interpolate_parabola,
    solve_first_stage,
    solve_second_stage,
)

StepCounts = npt.NDArray[np.uint8]
"""(N-1,) number of steps in each sample; 0 where it is not yet chosen."""

ColumnIndices = npt.NDArray[np.int64]
"""Column numbers in a matrix of sensitivities."""

_MIN_SENSITIVITY = 1e-200
"""Size of a derivative of zeta below which it is set to zero."""


@njit_inline
def _interpolate_inputs(
    x: Array, v: Array, u: Array, u_middle: Array, h: float, i: int, t: float
) -> tuple[float, float, float]:
    """Return displacement, velocity and field at the fraction t of sample i."""
    xs, vs = interpolate_motion(x[i], x[i + 1], v[i], v[i + 1], h, t)
    return xs, vs, interpolate_parabola(u[i], u_middle[i], u[i + 1], t)


@njit_inline
def scale_coefficients(s: Array, factors: Array, middle: Array, i: int, t: float, out: Array) -> None:
    """Write alpha, c0 and c1 of coordinates ``s`` (10,), scaled at the fraction t of sample i, into ``out``."""
    a, b, c = factors[0, i], factors[1, i], factors[2, i]
    if t > 0.0:
        a = interpolate_parabola(a, middle[0, i], factors[0, i + 1], t)
        b = interpolate_parabola(b, middle[1, i], factors[1, i + 1], t)
        c = interpolate_parabola(c, middle[2, i], factors[2, i + 1], t)
    out[0], out[1] = a * s[0], a * s[1]
    out[5], out[6] = b * s[5], b * s[6]
    out[7], out[8] = c * s[7], c * s[8]


@njit_cached
def integrate(
    s: Array,
    x: Array,
    v: Array,
    u: Array,
    u_middle: Array,
    factors: Array,
    factors_middle: Array,
    h: float,
    y0: float,
    zeta0: float,
    max_travel: float,
    step_counts: StepCounts,
) -> tuple[Array, Array, Array]:
    """Integrate the states along an excitation.

    Args:
        s: (10,) structural coordinates.
        x, v, u: (N,) displacement [m], velocity [m/s] and field [V or A] at the samples.
        u_middle: (N-1,) field half way between the samples.
        factors, factors_middle: (3, N) and (3, N-1) factors of alpha, c0 and c1 [1]; (3, 0) without scaling.
        h: time between samples [s].
        y0, zeta0: state at the first sample [m], [1].
        max_travel: change of zeta above which a sample without a step count takes more than one step [1].
        step_counts: (N-1,) steps per sample; zeros are filled in place.

    Returns:
        y [m], zeta [1] and y' [m/s], each (N,).
    """
    count = len(x)
    ys, zetas, y_rates = np.empty(count), np.empty(count), np.empty(count)
    scales, sc = factors.shape[1] > 0, s.copy()
    y, zeta = y0, zeta0
    if scales:
        scale_coefficients(s, factors, factors_middle, 0, 0.0, sc)
    y_rate, zeta_rate = compute_rates(sc, x[0], v[0], u[0], y, zeta)
    for i in range(count):
        ys[i], zetas[i], y_rates[i] = y, zeta, y_rate
        if i == count - 1:
            break
        if step_counts[i] == 0:
            step_counts[i] = choose_steps(
                max_travel, s, h, v[i], v[i + 1], u[i], u[i + 1], y_rate, zeta, zeta_rate
            )
        weight = RATE_WEIGHT * h / step_counts[i]
        for k in range(step_counts[i]):
            t = (k + GAMMA) / step_counts[i]
            xs, vs, us = _interpolate_inputs(x, v, u, u_middle, h, i, t)
            if scales:
                scale_coefficients(s, factors, factors_middle, i, t, sc)
            y1, zeta1 = solve_first_stage(sc, xs, vs, us, weight, y, zeta, y_rate, zeta_rate)
            t = (k + 1.0) / step_counts[i]
            xs, vs, us = _interpolate_inputs(x, v, u, u_middle, h, i, t)
            if scales:
                scale_coefficients(s, factors, factors_middle, i, t, sc)
            y, zeta, y_rate, zeta_rate = solve_second_stage(sc, xs, vs, us, weight, y, zeta, y1, zeta1)
    return ys, zetas, y_rates


class InputDerivatives(NamedTuple):
    """Derivatives of the inputs over E further unknowns: A of the field, then those of motion and factors.

    The unknowns of the motion and of the factors both begin at the last one of the field, the force delay, which
    shifts all inputs.
    """

    du: Array
    """(A, N) derivatives of the field."""
    du_middle: Array
    """(A, N-1) derivatives of the field half way between samples."""
    dx: Array
    """(M, N) derivatives of the displacement."""
    dv: Array
    """(M, N) derivatives of the velocity."""
    df: Array
    """(S, 3, N) derivatives of the factors; S is 0 without scaling."""
    df_middle: Array
    """(S, 3, N-1) derivatives of the factors half way between samples."""


@njit_cached
def integrate_with_sensitivities(
    s: Array,
    c1: Array,
    x: Array,
    v: Array,
    u: Array,
    u_middle: Array,
    factors: Array,
    factors_middle: Array,
    h: float,
    y0: float,
    zeta0: float,
    max_travel: float,
    step_counts: StepCounts,
    over: InputDerivatives,
    columns: ColumnIndices,
    sensitivities: Array,
) -> tuple[Array, Array, Array]:
    """Integrate the states, and the sensitivities of the dashpot force c1 y' over coordinates, y0 and inputs.

    Args:
        s, x, v, u, u_middle, factors, factors_middle, h, y0, zeta0, max_travel, step_counts: as in ``integrate``.
        c1: (N,) roll-off dashpot at the samples [N s/m], unscaled.
        over: derivatives of the inputs over E further unknowns.
        columns: (10 + 1 + E,) columns of structural coordinates, y0 and further unknowns in ``sensitivities``.
        sensitivities: (N, U), filled in place in these columns.

    Returns:
        y [m], zeta [1] and y' [m/s], each (N,).
    """
    count = len(x)
    ys, zetas, y_rates = np.empty(count), np.empty(count), np.empty(count)
    width = len(columns)
    # Row 0 belongs to y, row 1 to zeta. S1: state at the first stage; S: state after the step; S_rate: its rate.
    S1, S, S_rate = np.zeros((2, width)), np.zeros((2, width)), np.zeros((2, width))
    f1, f = np.zeros((2, width)), np.zeros((2, width))
    J1, J, over_inputs = np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((2, 3))
    scales, sc = factors.shape[1] > 0, s.copy()
    S[0, STRUCTURAL_COUNT] = 1.0
    y, zeta = y0, zeta0
    if scales:
        scale_coefficients(s, factors, factors_middle, 0, 0.0, sc)
    y_rate, zeta_rate = differentiate_rates(sc, x[0], v[0], u[0], y, zeta, J, over_inputs, f)
    _propagate_inputs(over_inputs, over, s, sc, 0, 0.0, h, f)
    for j in range(width):
        S_rate[0, j] = J[0, 0] * S[0, j] + J[0, 1] * S[1, j] + f[0, j]
        S_rate[1, j] = J[1, 0] * S[0, j] + J[1, 1] * S[1, j] + f[1, j]
    for i in range(count):
        ys[i], zetas[i], y_rates[i] = y, zeta, y_rate
        factor = factors[2, i] if scales else 1.0
        _record_row(sensitivities, columns, c1[i], factor, u[i], s[8], y_rate, S_rate, over, i)
        if i == count - 1:
            break
        if step_counts[i] == 0:
            step_counts[i] = choose_steps(
                max_travel, s, h, v[i], v[i + 1], u[i], u[i + 1], y_rate, zeta, zeta_rate
            )
        weight = RATE_WEIGHT * h / step_counts[i]
        for k in range(step_counts[i]):
            t = (k + GAMMA) / step_counts[i]
            xs, vs, us = _interpolate_inputs(x, v, u, u_middle, h, i, t)
            if scales:
                scale_coefficients(s, factors, factors_middle, i, t, sc)
            y1, zeta1 = solve_first_stage(sc, xs, vs, us, weight, y, zeta, y_rate, zeta_rate)
            differentiate_rates(sc, xs, vs, us, y1, zeta1, J1, over_inputs, f1)
            _propagate_inputs(over_inputs, over, s, sc, i, t, h, f1)
            # The sensitivities take the same steps as the states: they differentiate the discrete solution.
            _advance_first_stage(weight, J1, f1, S, S_rate, S1)
            t = (k + 1.0) / step_counts[i]
            xs, vs, us = _interpolate_inputs(x, v, u, u_middle, h, i, t)
            if scales:
                scale_coefficients(s, factors, factors_middle, i, t, sc)
            y, zeta, _, _ = solve_second_stage(sc, xs, vs, us, weight, y, zeta, y1, zeta1)
            y_rate, zeta_rate = differentiate_rates(sc, xs, vs, us, y, zeta, J, over_inputs, f)
            _propagate_inputs(over_inputs, over, s, sc, i, t, h, f)
            _advance_second_stage(weight, J, f, S1, S, S_rate)
    return ys, zetas, y_rates


@njit_inline
def _advance_first_stage(weight: float, J: Array, f: Array, S: Array, S_rate: Array, S1: Array) -> None:
    """Write the sensitivities S1 of the first stage, from those of the step's start; all (2, columns).

    S1 solves (1 - weight J) S1 = S + weight (S' + f), where J (2, 2) holds the derivatives of rates over states.
    """
    a, b, c, d = _invert_stage_matrix(weight, J)
    for j in range(S.shape[1]):
        first = S[0, j] + weight * (S_rate[0, j] + f[0, j])
        second = S[1, j] + weight * (S_rate[1, j] + f[1, j])
        S1[0, j] = a * first + b * second
        steep = c * first + d * second
        # In saturation the sensitivities decay. Denormal numbers would slow the integration a hundred times.
        S1[1, j] = steep if abs(steep) > _MIN_SENSITIVITY else 0.0


@njit_inline
def _advance_second_stage(weight: float, J: Array, f: Array, S1: Array, S: Array, S_rate: Array) -> None:
    """Replace the sensitivities S of the step's start by those of its end, and write their rates."""
    a, b, c, d = _invert_stage_matrix(weight, J)
    per_weight = 1.0 / weight
    for j in range(S.shape[1]):
        y_known = WEIGHT_STAGE * S1[0, j] - WEIGHT_START * S[0, j]
        zeta_known = WEIGHT_STAGE * S1[1, j] - WEIGHT_START * S[1, j]
        first, second = y_known + weight * f[0, j], zeta_known + weight * f[1, j]
        y = a * first + b * second
        steep = c * first + d * second
        zeta = steep if abs(steep) > _MIN_SENSITIVITY else 0.0
        S[0, j], S[1, j] = y, zeta
        S_rate[0, j], S_rate[1, j] = (y - y_known) * per_weight, (zeta - zeta_known) * per_weight


@njit_inline
def _invert_stage_matrix(weight: float, J: Array) -> tuple[float, float, float, float]:
    """Return the inverse of the matrix 1 - weight J (2, 2), row by row."""
    a, b = 1.0 - weight * J[0, 0], -weight * J[0, 1]
    c, d = -weight * J[1, 0], 1.0 - weight * J[1, 1]
    per_determinant = 1.0 / (a * d - b * c)
    return d * per_determinant, -b * per_determinant, -c * per_determinant, a * per_determinant


@njit_inline
def _propagate_inputs(
    over_inputs: Array, over: InputDerivatives, s: Array, sc: Array, i: int, t: float, h: float, f: Array
) -> None:
    """Write the derivatives of the rates over the unknowns of the inputs into f, at the fraction t of sample i."""
    first = STRUCTURAL_COUNT + 1
    for j in range(first, f.shape[1]):
        f[0, j] = f[1, j] = 0.0
    for e in range(len(over.du)):
        c = over.du[e, i]
        if t > 0.0:
            c = interpolate_parabola(c, over.du_middle[e, i], over.du[e, i + 1], t)
        f[0, first + e] = over_inputs[0, 2] * c
        f[1, first + e] = over_inputs[1, 2] * c
    first += len(over.du) - 1
    for m in range(len(over.dx)):
        a, b = over.dx[m, i], over.dv[m, i]
        if t > 0.0:
            a, b = interpolate_motion(a, over.dx[m, i + 1], b, over.dv[m, i + 1], h, t)
        f[0, first + m] += over_inputs[0, 0] * a + over_inputs[0, 1] * b
        f[1, first + m] += over_inputs[1, 0] * a + over_inputs[1, 1] * b
    if len(over.df) > 0:
        _propagate_factors(over, s, sc, i, t, f, first)


@njit_inline
def _propagate_factors(
    over: InputDerivatives, s: Array, sc: Array, i: int, t: float, f: Array, first: int
) -> None:
    """Convert derivatives over scaled coordinates in f to those over the factors and over ``s``."""
    for m in range(len(over.df)):
        for k in range(3):
            a, b = _SCALED_PAIRS[k]
            c = over.df[m, k, i]
            if t > 0.0:
                c = interpolate_parabola(c, over.df_middle[m, k, i], over.df[m, k, i + 1], t)
            f[0, first + m] += (s[a] * f[0, a] + s[b] * f[0, b]) * c
            f[1, first + m] += (s[a] * f[1, a] + s[b] * f[1, b]) * c
    for k in range(3):
        a, b = _SCALED_PAIRS[k]
        factor = sc[a] / s[a]
        f[0, a] *= factor
        f[0, b] *= factor
        f[1, a] *= factor
        f[1, b] *= factor


_SCALED_PAIRS = ((0, 1), (5, 6), (7, 8))
"""Pairs of structural coordinates that each factor scales."""


@njit_inline
def _record_row(
    sensitivities: Array,
    columns: ColumnIndices,
    c1: float,
    factor: float,
    u: float,
    c1_b: float,
    y_rate: float,
    S_rate: Array,
    over: InputDerivatives,
    i: int,
) -> None:
    """Write the sensitivities of the scaled c1 y' at one sample into its row."""
    for j in range(len(columns)):
        sensitivities[i, columns[j]] = factor * c1 * S_rate[0, j]
    sensitivities[i, columns[7]] += factor * y_rate
    sensitivities[i, columns[8]] += factor * u * y_rate
    for e in range(len(over.du)):
        sensitivities[i, columns[STRUCTURAL_COUNT + 1 + e]] += factor * c1_b * over.du[e, i] * y_rate
    for m in range(len(over.df)):
        sensitivities[i, columns[STRUCTURAL_COUNT + len(over.du) + m]] += c1 * over.df[m, 2, i] * y_rate
