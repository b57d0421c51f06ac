"""The march through a recording: states alone, or with the slopes of the force over everything.

The slopes are exact derivatives of the discrete solution: each implicit step is differentiated as it was
taken, so that they agree with finite differences to rounding. Each sample is one step, but more where the
hysteretic variable turns: the number is chosen on the first march from how far zeta is about to move, and kept
as a plan, so that later marches with slopes or with nearby coordinates are smooth in them.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, compiled
from identification.simulate.step import (
    GAMMA,
    HALF,
    STRUCTURAL,
    WEIGHT_STAGE,
    WEIGHT_START,
    at_field,
    between,
    first_stage,
    rate_slopes,
    rates,
    second_stage,
    through_middle,
)

Plan = npt.NDArray[np.uint8]
"""(samples - 1,) steps in each sample; 0 where they are still to be chosen."""

_MOST_STEPS = 64
_STEPS_AT_TURN = 4
_FADED = 1e-200
"""[1] slope of zeta below which it counts as none."""
_FIELD_JUMP = 0.05
"""[1] relative change of the yield force in one sample above which the field counts as turning."""


@compiled
def choose_steps(
    fineness: float,
    s: Array,
    h: float,
    v0: float,
    v1: float,
    u0: float,
    u1: float,
    y_rate: float,
    zeta: float,
    zeta_rate: float,
) -> int:
    """Steps for one sample: the root of zeta's travel over ``fineness``; a few more where slip or field turn.

    The root, because the error of a step falls with its third power: many small travels add up as one large.
    """
    slip_before = v0 - y_rate
    slip_after = v1 - y_rate
    travel = abs(zeta_rate) * h
    if slip_after * zeta < 0.0:
        travel = max(travel, 2.0 * abs(slip_after) * h / s[2])
    steps = min(max(math.ceil(math.sqrt(travel / fineness)), 1), _MOST_STEPS)
    turns = slip_before * slip_after <= 0.0
    jumps = abs(s[1] * (u1 - u0)) > _FIELD_JUMP * abs(at_field(s[0], s[1], u0))
    return max(steps, _STEPS_AT_TURN) if turns or jumps else steps


@compiled
def _inputs(
    x: Array, v: Array, u: Array, u_middle: Array, h: float, i: int, t: float
) -> tuple[float, float, float]:
    """Displacement, velocity and field at the fraction t of sample i."""
    xs, vs = between(x[i], x[i + 1], v[i], v[i + 1], h, t)
    return xs, vs, through_middle(u[i], u_middle[i], u[i + 1], t)


@compiled
def scaled(s: Array, factors: Array, middle: Array, i: int, t: float, out: Array) -> None:
    """Structural coordinates (10,) with alpha, c0 and c1 scaled, at the fraction t of sample i."""
    a, b, c = factors[0, i], factors[1, i], factors[2, i]
    if t > 0.0:
        a = through_middle(a, middle[0, i], factors[0, i + 1], t)
        b = through_middle(b, middle[1, i], factors[1, i + 1], t)
        c = through_middle(c, middle[2, i], factors[2, i + 1], t)
    out[:] = s
    out[0], out[1] = a * s[0], a * s[1]
    out[5], out[6] = b * s[5], b * s[6]
    out[7], out[8] = c * s[7], c * s[8]


@compiled
def march(
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
    fineness: float,
    plan: Plan,
) -> tuple[Array, Array, Array]:
    """States along a recording.

    Args:
        s: (10,) structural coordinates.
        factors, factors_middle: (3, N) and (3, N-1) of alpha, c0 and c1 [1]; (3, 0) where nothing scales.
        x, v, u: (N,) displacement [m], velocity [m/s] and field [V or A] at the samples.
        u_middle: (N-1,) field half way between them.
        h: [s] time between samples.
        y0, zeta0: state at the first sample [m], [1].
        fineness: [1] travel of zeta in a sample above which it takes more than one step, where the plan is open.
        plan: filled in place where it is 0.

    Returns:
        y [m], zeta [1] and y' [m/s], each (N,).
    """
    count = len(x)
    ys, zetas, y_rates = np.empty(count), np.empty(count), np.empty(count)
    scales, sc = factors.shape[1] > 0, s.copy()
    y, zeta = y0, zeta0
    if scales:
        scaled(s, factors, factors_middle, 0, 0.0, sc)
    y_rate, zeta_rate = rates(sc, x[0], v[0], u[0], y, zeta)
    for i in range(count):
        ys[i], zetas[i], y_rates[i] = y, zeta, y_rate
        if i == count - 1:
            break
        if plan[i] == 0:
            plan[i] = choose_steps(fineness, s, h, v[i], v[i + 1], u[i], u[i + 1], y_rate, zeta, zeta_rate)
        weight = HALF * h / plan[i]
        for k in range(plan[i]):
            t = (k + GAMMA) / plan[i]
            xs, vs, us = _inputs(x, v, u, u_middle, h, i, t)
            if scales:
                scaled(s, factors, factors_middle, i, t, sc)
            y1, zeta1 = first_stage(sc, xs, vs, us, weight, y, zeta, y_rate, zeta_rate)
            t = (k + 1.0) / plan[i]
            xs, vs, us = _inputs(x, v, u, u_middle, h, i, t)
            if scales:
                scaled(s, factors, factors_middle, i, t, sc)
            y, zeta = second_stage(sc, xs, vs, us, weight, y, zeta, y1, zeta1)
            y_rate, zeta_rate = rates(sc, xs, vs, us, y, zeta)
    return ys, zetas, y_rates


class Derivatives(NamedTuple):
    """Derivatives of the inputs over E further unknowns: A of the field, then motion and factors.

    Those of the motion and of the factors both begin at the last of the field's: the delay moves everything.
    """

    du: Array
    """(A, N) field."""
    du_middle: Array
    """(A, N-1)"""
    dx: Array
    """(M, N) displacement."""
    dv: Array
    """(M, N) velocity."""
    df: Array
    """(S, 3, N) factors; S is 0 where nothing scales."""
    df_middle: Array
    """(S, 3, N-1)"""


@compiled
def march_with_slopes(
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
    fineness: float,
    plan: Plan,
    over: Derivatives,
) -> tuple[Array, Array, Array, Array]:
    """States along a recording, and the slopes of the dashpot force c1 y' over coordinates, y0 and inputs.

    Args:
        s, x, v, u, u_middle, factors, factors_middle, h, y0, zeta0, fineness, plan: as in ``march``.
        c1: (N,) roll-off dashpot at the samples [N s/m], unscaled.
        over: derivatives of the inputs over E further unknowns.

    Returns:
        y [m], zeta [1], y' [m/s], each (N,), and slopes (N, 10 + 1 + E): structural coordinates, y0, further.
    """
    field_rows, motion_rows, scale_rows = len(over.du), len(over.dx), len(over.df)
    columns = STRUCTURAL + 1 + max(field_rows, field_rows - 1 + max(motion_rows, scale_rows))
    count = len(x)
    ys, zetas, y_rates, slopes = np.empty(count), np.empty(count), np.empty(count), np.empty((count, columns))
    Sy, Sz, Sy1, Sz1 = np.zeros(columns), np.zeros(columns), np.zeros(columns), np.zeros(columns)
    fy, fz, gy, gz = np.zeros(columns), np.zeros(columns), np.zeros(columns), np.zeros(columns)
    over_y, over_zeta, stage_y, stage_zeta = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    over_inputs = np.zeros((2, 3))
    scales, sc = factors.shape[1] > 0, s.copy()
    Sy[STRUCTURAL] = 1.0
    y, zeta = y0, zeta0
    if scales:
        scaled(s, factors, factors_middle, 0, 0.0, sc)
    y_rate, zeta_rate = rate_slopes(sc, x[0], v[0], u[0], y, zeta, over_y, over_zeta, over_inputs, fy, fz)
    _from_inputs(over_inputs, over, s, sc, 0, 0.0, h, fy, fz)
    for i in range(count):
        ys[i], zetas[i], y_rates[i] = y, zeta, y_rate
        f1 = factors[2, i] if scales else 1.0
        _record(slopes[i], c1[i], f1, u[i], s[8], y_rate, over_y[0], over_zeta[0], Sy, Sz, fy, over, i)
        if i == count - 1:
            break
        if plan[i] == 0:
            plan[i] = choose_steps(fineness, s, h, v[i], v[i + 1], u[i], u[i + 1], y_rate, zeta, zeta_rate)
        weight = HALF * h / plan[i]
        for k in range(plan[i]):
            t = (k + GAMMA) / plan[i]
            xs, vs, us = _inputs(x, v, u, u_middle, h, i, t)
            if scales:
                scaled(s, factors, factors_middle, i, t, sc)
            y1, zeta1 = first_stage(sc, xs, vs, us, weight, y, zeta, y_rate, zeta_rate)
            rate_slopes(sc, xs, vs, us, y1, zeta1, stage_y, stage_zeta, over_inputs, gy, gz)
            _from_inputs(over_inputs, over, s, sc, i, t, h, gy, gz)
            # The slopes take the very steps that the states took, so they are those of the discrete solution.
            for j in range(columns):
                Sy1[j] = Sy[j] + weight * (over_y[0] * Sy[j] + over_zeta[0] * Sz[j] + fy[j] + gy[j])
                Sz1[j] = Sz[j] + weight * (over_y[1] * Sy[j] + over_zeta[1] * Sz[j] + fz[j] + gz[j])
            _solve(weight, stage_y, stage_zeta, Sy1, Sz1)
            t = (k + 1.0) / plan[i]
            xs, vs, us = _inputs(x, v, u, u_middle, h, i, t)
            if scales:
                scaled(s, factors, factors_middle, i, t, sc)
            y, zeta = second_stage(sc, xs, vs, us, weight, y, zeta, y1, zeta1)
            y_rate, zeta_rate = rate_slopes(sc, xs, vs, us, y, zeta, over_y, over_zeta, over_inputs, fy, fz)
            _from_inputs(over_inputs, over, s, sc, i, t, h, fy, fz)
            for j in range(columns):
                Sy[j] = WEIGHT_STAGE * Sy1[j] - WEIGHT_START * Sy[j] + weight * fy[j]
                Sz[j] = WEIGHT_STAGE * Sz1[j] - WEIGHT_START * Sz[j] + weight * fz[j]
            _solve(weight, over_y, over_zeta, Sy, Sz)
    return ys, zetas, y_rates, slopes


@compiled
def _from_inputs(
    over_inputs: Array,
    over: Derivatives,
    s: Array,
    sc: Array,
    i: int,
    t: float,
    h: float,
    fy: Array,
    fz: Array,
) -> None:
    """Slopes of the two rates over the unknowns that act through the inputs, at the fraction t of sample i."""
    field_rows, scale_rows = len(over.du), len(over.df)
    first = STRUCTURAL + 1
    for j in range(first, len(fy)):
        fy[j] = fz[j] = 0.0
    for e in range(field_rows):
        c = between_rows(over.du, over.du_middle, e, i, t)
        fy[first + e] = over_inputs[0, 2] * c
        fz[first + e] = over_inputs[1, 2] * c
    first += field_rows - 1
    for m in range(len(over.dx)):
        if t == 0.0:
            a, b = over.dx[m, i], over.dv[m, i]
        else:
            a, b = between(over.dx[m, i], over.dx[m, i + 1], over.dv[m, i], over.dv[m, i + 1], h, t)
        fy[first + m] += over_inputs[0, 0] * a + over_inputs[0, 1] * b
        fz[first + m] += over_inputs[1, 0] * a + over_inputs[1, 1] * b
    for m in range(scale_rows):
        # Slopes over the scaled coordinates stand in fy and fz: carried to the three factors.
        for k in range(3):
            a, b = _PAIRS[k]
            c = between_rows(over.df[m], over.df_middle[m], k, i, t)
            fy[first + m] += (s[a] * fy[a] + s[b] * fy[b]) * c
            fz[first + m] += (s[a] * fz[a] + s[b] * fz[b]) * c
    if scale_rows > 0:
        for k in range(3):
            a, b = _PAIRS[k]
            factor = sc[a] / s[a]
            fy[a] *= factor
            fy[b] *= factor
            fz[a] *= factor
            fz[b] *= factor


_PAIRS = ((0, 1), (5, 6), (7, 8))
"""Structural coordinates that each factor scales."""


@compiled
def between_rows(values: Array, middle: Array, row: int, i: int, t: float) -> float:
    """Value of a row at the fraction t of sample i, by the parabola through the sample's middle."""
    if t == 0.0:
        return float(values[row, i])
    return through_middle(values[row, i], middle[row, i], values[row, i + 1], t)


@compiled
def _solve(weight: float, over_y: Array, over_zeta: Array, Sy: Array, Sz: Array) -> None:
    """Solve (1 - weight J) S = S in place for every unknown at once; J is the 2 by 2 slope of the rates."""
    a, b = 1.0 - weight * over_y[0], -weight * over_zeta[0]
    c, d = -weight * over_y[1], 1.0 - weight * over_zeta[1]
    inverse = 1.0 / (a * d - b * c)
    for j in range(len(Sy)):
        first, second = Sy[j], Sz[j]
        Sy[j] = (d * first - b * second) * inverse
        steep = (a * second - c * first) * inverse
        # In saturation slopes fade away; the last digits before zero would be a hundred times slower to carry on.
        Sz[j] = steep if abs(steep) > _FADED else 0.0


@compiled
def _record(
    row: Array,
    c1: float,
    factor: float,
    u: float,
    c1_b: float,
    y_rate: float,
    over_y: float,
    over_zeta: float,
    Sy: Array,
    Sz: Array,
    fy: Array,
    over: Derivatives,
    i: int,
) -> None:
    """Write the slopes of the scaled c1 y' at one sample into its row."""
    for j in range(len(Sy)):
        row[j] = factor * c1 * (over_y * Sy[j] + over_zeta * Sz[j] + fy[j])
    row[7] += factor * y_rate
    row[8] += factor * u * y_rate
    for e in range(len(over.du)):
        row[STRUCTURAL + 1 + e] += factor * c1_b * over.du[e, i] * y_rate
    for m in range(len(over.df)):
        row[STRUCTURAL + len(over.du) + m] += c1 * over.df[m, 2, i] * y_rate
