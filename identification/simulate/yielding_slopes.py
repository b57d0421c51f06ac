"""Slopes of the march where the fixture gives way: the same steps, and what every unknown does to each of them.

``p`` and ``g`` hold the same numbers as in yielding.py. Each implicit stage is differentiated as it stands: the
slopes are those of the forces that come out, step by step, and not of the law in the limit.
"""

import math

import numpy as np

from identification.arrays import Array, compiled
from identification.damper import law
from identification.damper.effects import connection
from identification.simulate.kernel import Plan
from identification.simulate.step import GAMMA, HALF, at_field, hysteresis_rate, hysteresis_slopes, through_middle
from identification.simulate.yielding import (
    F0,
    FILM,
    FIXED,
    GAP,
    GIVE,
    HARDENING,
    INPUTS,
    INSIDE,
    K1,
    backward,
    carried,
    fill,
    law_at,
    left_over,
    on_cell,
    solve_stage,
    start_of,
    steepness_of,
    steps_of,
)


@compiled
def march_with_slopes(
    p: Array,
    at: Array,
    middle: Array,
    h: float,
    start: Array,
    fineness: float,
    plan: Plan,
    over: Array,
    over_middle: Array,
) -> tuple[Array, Array, Array, Array]:
    """States and force along a recording, and the force's slopes.

    Args:
        p, at, middle, h, start, fineness, plan: as in ``march``.
        over, over_middle: (E, 7, N) and (E, 7, N-1) derivatives of the inputs over further unknowns.

    Returns:
        y [m], zeta [1], force [N], each (N,), and slopes (N, 17 + 1 + E): the fixed numbers, y0, the further ones.
    """
    count, extra = at.shape[1], len(over)
    columns = FIXED + 1 + extra
    ys, zetas, forces, slopes = np.empty(count), np.empty(count), np.empty(count), np.empty((count, columns))
    S, S1, f, f1 = np.zeros((3, columns)), np.zeros((3, columns)), np.zeros((3, columns)), np.zeros((3, columns))
    J, J1, g = np.zeros((3, 3)), np.zeros((3, 3)), np.empty(INPUTS)
    S[0, FIXED] = 1.0
    y, zeta = start[0], start[1]
    fill(g, at, middle, 0, 0.0)
    X = start_of(p, g, y, zeta, start[2])
    _start_slopes(p, g, zeta, start[2], X, over, S)
    y_rate, zeta_rate, X_rate = _slopes(p, g, y, zeta, X, over, over_middle, 0, 0.0, J, f)
    for i in range(count):
        ys[i], zetas[i] = y, zeta
        forces[i] = on_cell(p, at[:, i], X, X_rate)
        _record(slopes[i], S, J, f, over[:, :, i], at[0, i] - X, at[6, i] - X_rate, p)
        if i == count - 1:
            break
        if plan[i] == 0:
            plan[i] = steps_of(fineness, p, at, h, i, X_rate, y_rate, zeta, zeta_rate)
        w = HALF * h / plan[i]
        for k in range(plan[i]):
            t = (k + GAMMA) / plan[i]
            fill(g, at, middle, i, t)
            y1, z1, X1 = solve_stage(p, g, y + w * y_rate, zeta + w * zeta_rate, X + w * X_rate, w, zeta, X)
            _slopes(p, g, y1, z1, X1, over, over_middle, i, t, J1, f1)
            _known_slopes(w, J, S, f, f1, S1)
            _solve(w, J1, S1)
            t = (k + 1.0) / plan[i]
            fill(g, at, middle, i, t)
            y, zeta, X = solve_stage(p, g, backward(y1, y), backward(z1, zeta), backward(X1, X), w, z1, X1)
            y_rate, zeta_rate, X_rate = _slopes(p, g, y, zeta, X, over, over_middle, i, t, J, f)
            _backward_slopes(w, f, S1, S)
            _solve(w, J, S)
    return ys, zetas, forces, slopes


@compiled
def _record(
    row: Array, S: Array, J: Array, f: Array, over: Array, stretch: float, stretching: float, p: Array
) -> None:
    """Write the slopes of the force at one sample into its row."""
    # The film feels the damper's velocity, which the state moves through the slopes of its rates.
    steep, film = steepness_of(stretch, p[GIVE], p[GAP], p[HARDENING], p[INSIDE]), p[FILM]
    for j in range(len(row)):
        X_rate = J[2, 0] * S[0, j] + J[2, 1] * S[1, j] + J[2, 2] * S[2, j] + f[2, j]
        row[j] = -S[2, j] * steep - film * X_rate
    for e in range(len(over)):
        row[FIXED + 1 + e] += over[e, 0] * steep + film * over[e, 6]
    row[FILM] += stretching
    over_give, over_gap, over_hardening, over_inside = _over_connection(stretch, p)
    row[GIVE] += over_give
    row[GAP] += over_gap
    row[HARDENING] += over_hardening
    row[INSIDE] += over_inside


@compiled
def _over_connection(stretch: float, p: Array) -> tuple[float, float, float, float]:
    """Slopes of what the connection carries over its give, gap, hardening and stiffness in the gap."""
    give, gap, hardening, inside = p[GIVE], p[GAP], p[HARDENING], p[INSIDE]
    half = 0.5 * gap
    free = min(max(stretch, -half), half)
    bent = stretch - free
    over_give = -carried(stretch, give, gap, hardening, inside) / give
    if bent == 0.0:
        return over_give, 0.0, 0.0, free / give
    side = 0.5 if bent > 0.0 else -0.5
    over_gap = side * ((connection.FILM + inside) / give - steepness_of(stretch, give, gap, hardening, inside))
    return over_give, over_gap, bent**3 / give, free / give


@compiled
def _known_slopes(w: float, J: Array, S: Array, f: Array, f1: Array, S1: Array) -> None:
    """Slopes of what the first stage knows, and its own explicit part, into S1."""
    for j in range(S.shape[1]):
        for a in range(3):
            moved = J[a, 0] * S[0, j] + J[a, 1] * S[1, j] + J[a, 2] * S[2, j]
            S1[a, j] = S[a, j] + w * (moved + f[a, j] + f1[a, j])


@compiled
def _backward_slopes(w: float, f: Array, S1: Array, S: Array) -> None:
    """The same of the second stage, in place."""
    for j in range(S.shape[1]):
        for a in range(3):
            S[a, j] = backward(S1[a, j], S[a, j]) + w * f[a, j]


@compiled
def _start_slopes(p: Array, g: Array, zeta0: float, v0: float, X: float, over: Array, S: Array) -> None:
    """Slopes of where the damper stands at first, written into S."""
    u = g[1]
    give = 1.0 / steepness_of(g[0] - X, p[GIVE], p[GAP], p[HARDENING], p[INSIDE])
    stiff = 1.0 + give * p[K1]
    S[2, 0], S[2, 1] = -give * g[2] * zeta0 / stiff, -give * u * g[2] * zeta0 / stiff
    S[2, 5], S[2, 6] = -give * g[3] * v0 / stiff, -give * u * g[3] * v0 / stiff
    S[2, K1], S[2, F0] = -give * X / stiff, give / stiff
    over_give, over_gap, over_hardening, over_inside = _over_connection(g[0] - X, p)
    S[2, GIVE] = give * over_give / stiff
    S[2, GAP] = give * over_gap / stiff
    S[2, HARDENING] = give * over_hardening / stiff
    S[2, INSIDE] = give * over_inside / stiff
    for e in range(len(over)):
        d = over[e, :, 0]
        change = (g[2] * p[1] * zeta0 + g[3] * p[6] * v0) * d[1] + d[5]
        change += d[2] * at_field(p[0], p[1], u) * zeta0 + d[3] * at_field(p[5], p[6], u) * v0
        S[2, FIXED + 1 + e] = (d[0] - give * change) / stiff


@compiled
def _slopes(
    p: Array,
    g: Array,
    y: float,
    zeta: float,
    X: float,
    over: Array,
    over_middle: Array,
    i: int,
    t: float,
    J: Array,
    f: Array,
) -> tuple[float, float, float]:
    """Rates of y, zeta and X; their slopes over the state into J (3, 3), over all else into f (3, columns)."""
    F, c0, c1 = law_at(p, g)
    k0 = p[9]
    steep = steepness_of(g[0] - X, p[GIVE], p[GAP], p[HARDENING], p[INSIDE])
    held = F * zeta + k0 * (X - y)
    R = left_over(p, g, X, held, c0, c1)
    y_rate, slip = R / c1, (R - held) / c0
    A = 1.0 / p[2]
    beta = p[3] * A
    rate = hysteresis_rate(slip, zeta, A, beta, A - beta, p[4])
    over_slip, over_zeta = hysteresis_slopes(slip, zeta, A, beta, A - beta, p[4])
    stiffness = steep + p[K1]
    J[0, 0] = J[0, 1] = 0.0
    J[0, 2] = -stiffness / c1
    J[1, 0], J[1, 1], J[1, 2] = k0 / c0, -F / c0, -(stiffness + k0) / c0
    # Row 1 of J and f holds slopes of the slip until the end, where they become those of zeta' and X'.
    _over_fixed(p, g, X, y, zeta, y_rate, slip, c0, c1, f)
    for e in range(len(over)):
        f[0, FIXED + 1 + e] = f[1, FIXED + 1 + e] = 0.0
        for k in range(INPUTS):
            d = over[e, k, i]
            if t > 0.0:
                d = through_middle(d, over_middle[e, k, i], over[e, k, i + 1], t)
            if d != 0.0:
                over_y, over_s = _over_input(p, g, k, steep, zeta, y_rate, slip, c0, c1)
                f[0, FIXED + 1 + e] += over_y * d
                f[1, FIXED + 1 + e] += over_s * d
    _through_film(p[FILM], c0, c1, over_slip, f)
    _through_film(p[FILM], c0, c1, over_slip, J)
    J[1, 1] += over_zeta
    size = abs(zeta)
    power = (size + law.Z_GUARD) ** (p[4] - 1.0)
    f[1, 2] -= rate * A
    f[1, 3] += (abs(slip) * zeta - slip * size) * power * A
    turned = (A - beta) * abs(slip) * zeta + beta * slip * size
    f[1, 4] -= turned * power * math.log(size + law.Z_GUARD)
    return y_rate, rate, slip + y_rate


@compiled
def _through_film(film: float, c0: float, c1: float, over_slip: float, rows: Array) -> None:
    """Slopes of y' and of the slip at a fixed X' become those of y', zeta' and X': the film feels X', too."""
    weaker = 1.0 / (1.0 + film * (1.0 / c0 + 1.0 / c1))
    for j in range(rows.shape[1]):
        X_rate = weaker * (rows[0, j] + rows[1, j])
        rows[0, j] -= film / c1 * X_rate
        rows[1, j] = over_slip * (rows[1, j] - film / c0 * X_rate)
        rows[2, j] = X_rate


@compiled
def _over_input(
    p: Array, g: Array, k: int, steep: float, zeta: float, y_rate: float, slip: float, c0: float, c1: float
) -> tuple[float, float]:
    """Slopes of y' and of the slip over the k-th input."""
    u = g[1]
    if k == 0:
        return steep / c1, steep / c0
    if k == 1:
        return -y_rate * g[4] * p[8] / c1, -(g[2] * p[1] * zeta + slip * g[3] * p[6]) / c0
    if k == 2:
        return 0.0, -at_field(p[0], p[1], u) * zeta / c0
    if k == 3:
        return 0.0, -slip * at_field(p[5], p[6], u) / c0
    if k == 4:
        return -y_rate * at_field(p[7], p[8], u) / c1, 0.0
    if k == 5:
        return -1.0 / c1, -1.0 / c0
    return p[FILM] / c1, p[FILM] / c0


@compiled
def _over_fixed(
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
    """Slopes of y' (row 0) and of the slip (row 1) over the fixed numbers and y0."""
    u = g[1]
    for j in range(FIXED + 1):
        f[0, j] = f[1, j] = 0.0
    f[1, 0], f[1, 1] = -g[2] * zeta / c0, -u * g[2] * zeta / c0
    f[1, 5], f[1, 6] = -slip * g[3] / c0, -u * slip * g[3] / c0
    f[0, 7], f[0, 8] = -y_rate * g[4] / c1, -u * y_rate * g[4] / c1
    f[1, 9] = -(X - y) / c0
    f[0, K1], f[1, K1] = -X / c1, -X / c0
    f[0, F0], f[1, F0] = 1.0 / c1, 1.0 / c0
    over_give, over_gap, over_hardening, over_inside = _over_connection(g[0] - X, p)
    f[0, GIVE], f[1, GIVE] = over_give / c1, over_give / c0
    f[0, GAP], f[1, GAP] = over_gap / c1, over_gap / c0
    f[0, HARDENING], f[1, HARDENING] = over_hardening / c1, over_hardening / c0
    f[0, INSIDE], f[1, INSIDE] = over_inside / c1, over_inside / c0
    stretching = g[6] - slip - y_rate
    f[0, FILM], f[1, FILM] = stretching / c1, stretching / c0


@compiled
def _solve(w: float, J: Array, S: Array) -> None:
    """Solve (1 - w J) S = S in place for every unknown at once, by the inverse of the 3 by 3 matrix."""
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
