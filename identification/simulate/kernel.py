"""The march through a recording: states alone, or states with the slopes of the force over everything.

The slopes are exact derivatives of the discrete solution: each implicit step is differentiated as it was
taken, so that they agree with finite differences to rounding. Each sample is one step, but more where the
hysteretic variable turns: the number is chosen on the first march from how far zeta is about to move, and kept
as a plan, so that later marches with slopes or with nearby coordinates are smooth in them.
"""

import math

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
    rate_slopes,
    rates,
    solve_stage,
    through_middle,
)

Plan = npt.NDArray[np.uint8]
"""(samples - 1,) steps in each sample; 0 where they are still to be chosen."""

_MOST_STEPS = 64
_STEPS_AT_REVERSAL = 4


@compiled
def _choose_steps(
    fineness: float, h: float, D_y: float, v0: float, v1: float, y_rate: float, zeta: float, zeta_rate: float
) -> int:
    """Steps for one sample, so that zeta moves by about ``fineness`` in each; a few more where the slip turns."""
    slip_before = v0 - y_rate
    slip_after = v1 - y_rate
    travel = abs(zeta_rate) * h
    if slip_after * zeta < 0.0:
        travel = max(travel, 2.0 * abs(slip_after) * h / D_y)
    steps = min(max(math.ceil(travel / fineness), 1), _MOST_STEPS)
    return max(steps, _STEPS_AT_REVERSAL) if slip_before * slip_after <= 0.0 else steps


@compiled
def march(
    s: Array,
    x: Array,
    v: Array,
    u: Array,
    u_middle: Array,
    h: float,
    y0: float,
    zeta0: float,
    fineness: float,
    plan: Plan,
) -> tuple[Array, Array, Array]:
    """States along a recording.

    Args:
        s: (10,) structural coordinates.
        x, v, u: (N,) displacement [m], velocity [m/s] and field [V or A] at the samples.
        u_middle: (N-1,) field half way between them.
        h: [s] time between samples.
        y0, zeta0: state at the first sample [m], [1].
        fineness: [1] largest move of zeta in one step, for the samples whose plan is still open.
        plan: filled in place where it is 0.

    Returns:
        y [m], zeta [1] and y' [m/s], each (N,).
    """
    count = len(x)
    ys, zetas, y_rates = np.empty(count), np.empty(count), np.empty(count)
    y, zeta = y0, zeta0
    y_rate, zeta_rate = rates(s, x[0], v[0], u[0], y, zeta)
    ys[0], zetas[0], y_rates[0] = y, zeta, y_rate
    for i in range(count - 1):
        if plan[i] == 0:
            plan[i] = _choose_steps(fineness, h, s[2], v[i], v[i + 1], y_rate, zeta, zeta_rate)
        steps = plan[i]
        weight = HALF * h / steps
        for k in range(steps):
            t = (k + GAMMA) / steps
            xs, vs = between(x[i], x[i + 1], v[i], v[i + 1], h, t)
            us = through_middle(u[i], u_middle[i], u[i + 1], t)
            y1, zeta1 = solve_stage(
                s, xs, vs, us, y + weight * y_rate, zeta + weight * zeta_rate, weight, zeta
            )
            t = (k + 1.0) / steps
            xs, vs = between(x[i], x[i + 1], v[i], v[i + 1], h, t)
            us = through_middle(u[i], u_middle[i], u[i + 1], t)
            y, zeta = solve_stage(
                s,
                xs,
                vs,
                us,
                WEIGHT_STAGE * y1 - WEIGHT_START * y,
                WEIGHT_STAGE * zeta1 - WEIGHT_START * zeta,
                weight,
                zeta1,
            )
            y_rate, zeta_rate = rates(s, xs, vs, us, y, zeta)
        ys[i + 1], zetas[i + 1], y_rates[i + 1] = y, zeta, y_rate
    return ys, zetas, y_rates


@compiled
def march_with_slopes(
    s: Array,
    c1: Array,
    x: Array,
    v: Array,
    u: Array,
    u_middle: Array,
    h: float,
    y0: float,
    zeta0: float,
    plan: Plan,
    dx: Array,
    dv: Array,
    du: Array,
    du_middle: Array,
) -> tuple[Array, Array]:
    """y' along a recording and the slopes of the dashpot force c1 y' over coordinates, y0 and inputs.

    Args:
        s, x, v, u, u_middle, h, y0, zeta0: as in ``march``; ``plan`` must be filled.
        c1: (N,) roll-off dashpot at the samples [N s/m].
        dx, dv, du: (E, N) derivatives of the inputs over E further unknowns; du_middle (E, N-1).

    Returns:
        y' (N,) [m/s] and slopes (N, 10 + 1 + E): structural coordinates, y0, further unknowns.
    """
    count, extra = len(x), len(dx)
    columns = STRUCTURAL + 1 + extra
    y_rates, slopes = np.empty(count), np.empty((count, columns))
    Sy, Sz = np.zeros(columns), np.zeros(columns)
    Sy1, Sz1 = np.zeros(columns), np.zeros(columns)
    fy, fz = np.zeros(columns), np.zeros(columns)
    gy, gz = np.zeros(columns), np.zeros(columns)
    of_y, of_zeta = np.zeros(STRUCTURAL + 3), np.zeros(STRUCTURAL + 3)
    over_y, over_zeta = np.zeros(2), np.zeros(2)
    end_y, end_zeta = np.zeros(2), np.zeros(2)
    Sy[STRUCTURAL] = 1.0
    y, zeta = y0, zeta0
    y_rate, zeta_rate = rates(s, x[0], v[0], u[0], y, zeta)
    rate_slopes(s, x[0], v[0], u[0], y, zeta, over_y, over_zeta, of_y, of_zeta)
    _explicit(of_y, of_zeta, dx, dv, du, du_middle, 0, 0.0, h, fy, fz)
    _record(slopes, y_rates, 0, c1[0], u[0], s[8], y_rate, over_y, over_zeta, Sy, Sz, fy, du)
    for i in range(count - 1):
        steps = plan[i]
        weight = HALF * h / steps
        for k in range(steps):
            t = (k + GAMMA) / steps
            xs, vs = between(x[i], x[i + 1], v[i], v[i + 1], h, t)
            us = through_middle(u[i], u_middle[i], u[i + 1], t)
            y1, zeta1 = solve_stage(
                s, xs, vs, us, y + weight * y_rate, zeta + weight * zeta_rate, weight, zeta
            )
            rate_slopes(s, xs, vs, us, y1, zeta1, end_y, end_zeta, of_y, of_zeta)
            _explicit(of_y, of_zeta, dx, dv, du, du_middle, i, t, h, gy, gz)
            for j in range(columns):
                Sy1[j] = Sy[j] + weight * (over_y[0] * Sy[j] + over_zeta[0] * Sz[j] + fy[j] + gy[j])
                Sz1[j] = Sz[j] + weight * (over_y[1] * Sy[j] + over_zeta[1] * Sz[j] + fz[j] + gz[j])
            _solve(weight, end_y, end_zeta, Sy1, Sz1)
            t = (k + 1.0) / steps
            xs, vs = between(x[i], x[i + 1], v[i], v[i + 1], h, t)
            us = through_middle(u[i], u_middle[i], u[i + 1], t)
            y, zeta = solve_stage(
                s,
                xs,
                vs,
                us,
                WEIGHT_STAGE * y1 - WEIGHT_START * y,
                WEIGHT_STAGE * zeta1 - WEIGHT_START * zeta,
                weight,
                zeta1,
            )
            y_rate, zeta_rate = rates(s, xs, vs, us, y, zeta)
            rate_slopes(s, xs, vs, us, y, zeta, over_y, over_zeta, of_y, of_zeta)
            _explicit(of_y, of_zeta, dx, dv, du, du_middle, i, t, h, fy, fz)
            for j in range(columns):
                Sy[j] = WEIGHT_STAGE * Sy1[j] - WEIGHT_START * Sy[j] + weight * fy[j]
                Sz[j] = WEIGHT_STAGE * Sz1[j] - WEIGHT_START * Sz[j] + weight * fz[j]
            _solve(weight, over_y, over_zeta, Sy, Sz)
        _record(slopes, y_rates, i + 1, c1[i + 1], u[i + 1], s[8], y_rate, over_y, over_zeta, Sy, Sz, fy, du)
    return y_rates, slopes


@compiled
def _explicit(
    of_y: Array,
    of_zeta: Array,
    dx: Array,
    dv: Array,
    du: Array,
    du_middle: Array,
    i: int,
    t: float,
    h: float,
    fy: Array,
    fz: Array,
) -> None:
    """Explicit slopes of the two rates over every unknown, at the fraction t of sample i."""
    for j in range(STRUCTURAL):
        fy[j] = of_y[j]
        fz[j] = of_zeta[j]
    for e in range(len(dx)):
        if t == 0.0:
            a, b, c = dx[e, i], dv[e, i], du[e, i]
        else:
            a, b = between(dx[e, i], dx[e, i + 1], dv[e, i], dv[e, i + 1], h, t)
            c = through_middle(du[e, i], du_middle[e, i], du[e, i + 1], t)
        j = STRUCTURAL + 1 + e
        fy[j] = of_y[10] * a + of_y[11] * b + of_y[12] * c
        fz[j] = of_zeta[10] * a + of_zeta[11] * b + of_zeta[12] * c


@compiled
def _solve(weight: float, over_y: Array, over_zeta: Array, Sy: Array, Sz: Array) -> None:
    """Solve (1 - weight J) S = S in place for every unknown at once; J is the 2 by 2 slope of the rates."""
    a, b = 1.0 - weight * over_y[0], -weight * over_zeta[0]
    c, d = -weight * over_y[1], 1.0 - weight * over_zeta[1]
    inverse = 1.0 / (a * d - b * c)
    for j in range(len(Sy)):
        first, second = Sy[j], Sz[j]
        Sy[j] = (d * first - b * second) * inverse
        Sz[j] = (a * second - c * first) * inverse


@compiled
def _record(
    slopes: Array,
    y_rates: Array,
    i: int,
    c1: float,
    u: float,
    c1_b: float,
    y_rate: float,
    over_y: Array,
    over_zeta: Array,
    Sy: Array,
    Sz: Array,
    fy: Array,
    du: Array,
) -> None:
    """Write y' and the slopes of c1 y' at sample i."""
    y_rates[i] = y_rate
    for j in range(len(Sy)):
        slopes[i, j] = c1 * (over_y[0] * Sy[j] + over_zeta[0] * Sz[j] + fy[j])
    slopes[i, 7] += y_rate
    slopes[i, 8] += u * y_rate
    for e in range(len(du)):
        slopes[i, STRUCTURAL + 1 + e] += c1_b * du[e, i] * y_rate
