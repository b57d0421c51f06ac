"""The march through a recording: states alone, or with the slopes of the force over everything.

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
_FIELD_JUMP = 0.05
"""[1] relative change of the yield force in one sample above which the field counts as turning."""


@compiled
def _choose_steps(
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
        fineness: [1] travel of zeta in a sample above which it takes more than one step, where the plan is open.
        plan: filled in place where it is 0.

    Returns:
        y [m], zeta [1] and y' [m/s], each (N,).
    """
    count = len(x)
    ys, zetas, y_rates = np.empty(count), np.empty(count), np.empty(count)
    y, zeta = y0, zeta0
    y_rate, zeta_rate = rates(s, x[0], v[0], u[0], y, zeta)
    for i in range(count):
        ys[i], zetas[i], y_rates[i] = y, zeta, y_rate
        if i == count - 1:
            break
        if plan[i] == 0:
            plan[i] = _choose_steps(fineness, s, h, v[i], v[i + 1], u[i], u[i + 1], y_rate, zeta, zeta_rate)
        weight = HALF * h / plan[i]
        for k in range(plan[i]):
            xs, vs, us = _inputs(x, v, u, u_middle, h, i, (k + GAMMA) / plan[i])
            y1, zeta1 = first_stage(s, xs, vs, us, weight, y, zeta, y_rate, zeta_rate)
            xs, vs, us = _inputs(x, v, u, u_middle, h, i, (k + 1.0) / plan[i])
            y, zeta = second_stage(s, xs, vs, us, weight, y, zeta, y1, zeta1)
            y_rate, zeta_rate = rates(s, xs, vs, us, y, zeta)
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
    fineness: float,
    plan: Plan,
    dx: Array,
    dv: Array,
    du: Array,
    du_middle: Array,
) -> tuple[Array, Array, Array, Array]:
    """States along a recording, and the slopes of the dashpot force c1 y' over coordinates, y0 and inputs.

    Args:
        s, x, v, u, u_middle, h, y0, zeta0, fineness, plan: as in ``march``.
        c1: (N,) roll-off dashpot at the samples [N s/m].
        du, du_middle: (E, N) and (E, N-1) derivatives of the field over E further unknowns.
        dx, dv: (M, N) derivatives of the motion over the last M of them; the others leave it alone.

    Returns:
        y [m], zeta [1], y' [m/s], each (N,), and slopes (N, 10 + 1 + E): structural coordinates, y0, further.
    """
    count, columns = len(x), STRUCTURAL + 1 + len(du)
    ys, zetas, y_rates, slopes = np.empty(count), np.empty(count), np.empty(count), np.empty((count, columns))
    Sy, Sz, Sy1, Sz1 = np.zeros(columns), np.zeros(columns), np.zeros(columns), np.zeros(columns)
    fy, fz, gy, gz = np.zeros(columns), np.zeros(columns), np.zeros(columns), np.zeros(columns)
    over_y, over_zeta, stage_y, stage_zeta = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    over_inputs = np.zeros((2, 3))
    Sy[STRUCTURAL] = 1.0
    y, zeta = y0, zeta0
    y_rate, zeta_rate = rate_slopes(s, x[0], v[0], u[0], y, zeta, over_y, over_zeta, over_inputs, fy, fz)
    _from_inputs(over_inputs, dx, dv, du, du_middle, 0, 0.0, h, fy, fz)
    for i in range(count):
        ys[i], zetas[i], y_rates[i] = y, zeta, y_rate
        _record(slopes[i], c1[i], u[i], s[8], y_rate, over_y[0], over_zeta[0], Sy, Sz, fy, du[:, i])
        if i == count - 1:
            break
        if plan[i] == 0:
            plan[i] = _choose_steps(fineness, s, h, v[i], v[i + 1], u[i], u[i + 1], y_rate, zeta, zeta_rate)
        weight = HALF * h / plan[i]
        for k in range(plan[i]):
            t = (k + GAMMA) / plan[i]
            xs, vs, us = _inputs(x, v, u, u_middle, h, i, t)
            y1, zeta1 = first_stage(s, xs, vs, us, weight, y, zeta, y_rate, zeta_rate)
            rate_slopes(s, xs, vs, us, y1, zeta1, stage_y, stage_zeta, over_inputs, gy, gz)
            _from_inputs(over_inputs, dx, dv, du, du_middle, i, t, h, gy, gz)
            # The slopes take the very steps that the states took, so they are those of the discrete solution.
            for j in range(columns):
                Sy1[j] = Sy[j] + weight * (over_y[0] * Sy[j] + over_zeta[0] * Sz[j] + fy[j] + gy[j])
                Sz1[j] = Sz[j] + weight * (over_y[1] * Sy[j] + over_zeta[1] * Sz[j] + fz[j] + gz[j])
            _solve(weight, stage_y, stage_zeta, Sy1, Sz1)
            t = (k + 1.0) / plan[i]
            xs, vs, us = _inputs(x, v, u, u_middle, h, i, t)
            y, zeta = second_stage(s, xs, vs, us, weight, y, zeta, y1, zeta1)
            y_rate, zeta_rate = rate_slopes(s, xs, vs, us, y, zeta, over_y, over_zeta, over_inputs, fy, fz)
            _from_inputs(over_inputs, dx, dv, du, du_middle, i, t, h, fy, fz)
            for j in range(columns):
                Sy[j] = WEIGHT_STAGE * Sy1[j] - WEIGHT_START * Sy[j] + weight * fy[j]
                Sz[j] = WEIGHT_STAGE * Sz1[j] - WEIGHT_START * Sz[j] + weight * fz[j]
            _solve(weight, over_y, over_zeta, Sy, Sz)
    return ys, zetas, y_rates, slopes


@compiled
def _from_inputs(
    over_inputs: Array,
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
    """Slopes of the two rates over the unknowns that act through the inputs, at the fraction t of sample i."""
    still = len(du) - len(dx)
    for e in range(len(du)):
        j = STRUCTURAL + 1 + e
        c = du[e, i] if t == 0.0 else through_middle(du[e, i], du_middle[e, i], du[e, i + 1], t)
        fy[j] = over_inputs[0, 2] * c
        fz[j] = over_inputs[1, 2] * c
        if e < still:
            continue
        m = e - still
        if t == 0.0:
            a, b = dx[m, i], dv[m, i]
        else:
            a, b = between(dx[m, i], dx[m, i + 1], dv[m, i], dv[m, i + 1], h, t)
        fy[j] += over_inputs[0, 0] * a + over_inputs[0, 1] * b
        fz[j] += over_inputs[1, 0] * a + over_inputs[1, 1] * b


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
    row: Array,
    c1: float,
    u: float,
    c1_b: float,
    y_rate: float,
    over_y: float,
    over_zeta: float,
    Sy: Array,
    Sz: Array,
    fy: Array,
    du: Array,
) -> None:
    """Write the slopes of c1 y' at one sample into its row."""
    for j in range(len(Sy)):
        row[j] = c1 * (over_y * Sy[j] + over_zeta * Sz[j] + fy[j])
    row[7] += y_rate
    row[8] += u * y_rate
    for e in range(len(du)):
        row[STRUCTURAL + 1 + e] += c1_b * du[e] * y_rate
