"""The march where the fixture gives way: the damper's displacement is a third state.

With R = carried(x - X) + d (x' - X') - k1 X + f0 - p the force that is left for the dashpot c1 (X where the damper
stands, x where the actuator does, d the film of the connection, p the force beside the law), the law reads

    y' = R / c1      X' = slip + y'      slip = (R - F zeta - k0 (X - y)) / c0      zeta' = g(slip, zeta)

so that each implicit stage of a linear spring is linear in y and X and leaves one scalar equation in zeta, as on a
rigid fixture; one with a gap, or one that hardens, is taken straight about where it stands until it stands there.
The force on the cell is what the connection carries. Forces beside the law are taken at the actuator's motion.

``p`` below holds 16 fixed numbers: the ten structural coordinates, k1, f0, and give, gap, hardening and film of
the connection; ``g`` the seven inputs at one instant: x, u, factors of alpha, c0, c1, force beside the law, x'.
"""

import math

import numpy as np

from identification.arrays import Array, compiled
from identification.damper import law
from identification.damper.effects import connection
from identification.simulate.curves import half_way
from identification.simulate.inputs import Field
from identification.simulate.kernel import Plan, choose_steps
from identification.simulate.motion import Motion
from identification.simulate.scaling import Factors
from identification.simulate.step import (
    GAMMA,
    HALF,
    ITERATIONS,
    LARGEST_MOVE,
    TOLERANCE,
    WEIGHT_STAGE,
    WEIGHT_START,
    at_field,
    hysteresis_rate,
    hysteresis_slopes,
    through_middle,
)

_FIXED, _INPUTS = 16, 7
_K1, _F0, _GIVE, _GAP, _HARDENING, _FILM = 10, 11, 12, 13, 14, 15
_MOST_MOVES = 12
"""Times that a connection is taken straight anew in one stage."""
_NEAR = 1e-8
"""[1] relative error of what it carries at which it stands there."""
_BEYOND = 1e-12
"""[m] past the edge of its gap, from where it is taken straight on the other side."""

_carried = compiled(connection.carried)
_steepness = compiled(connection.steepness)
_stretched = compiled(connection.stretched)


def inputs_of(motion: Motion, field: Field, scales: Factors, beside: Array, h: float) -> tuple[Array, Array]:
    """The seven inputs at the samples (7, N) and half way between them (7, N-1)."""
    x, v = half_way(motion.x, motion.v, h)
    ones, middles = np.ones((3, len(motion.x))), np.ones((3, len(x)))
    scaled = scales.at.shape[1] > 0
    between = 0.5 * (beside[1:] + beside[:-1])
    at = np.vstack([motion.x, field.u, scales.at if scaled else ones, beside, motion.v])
    middle = np.vstack([x, field.middle, scales.middle if scaled else middles, between, v])
    return np.ascontiguousarray(at), np.ascontiguousarray(middle)


def derivatives_of(
    motion: Motion, field: Field, scales: Factors, over_motion: Array, own: list[tuple[int, Array]], h: float
) -> tuple[Array, Array]:
    """Their derivatives (E, 7, N) and (E, 7, N-1): unknowns of field, motion and factors, then of forces."""
    first, count = len(field.du) - 1, len(motion.x)
    inner = first + max(1 + len(motion.columns), len(scales.over))
    at = np.zeros((inner + len(own), _INPUTS, count))
    middle = np.zeros((inner + len(own), _INPUTS, count - 1))
    at[: first + 1, 1], middle[: first + 1, 1] = field.du, field.dmiddle
    moving = slice(first, first + len(motion.dx))
    at[moving, 0], at[moving, 6] = motion.dx, motion.dv
    middle[moving, 0], middle[moving, 6] = half_way(motion.dx, motion.dv, h)
    scaling = slice(first, first + len(scales.over))
    if len(scales.over):
        at[scaling, 2:5], middle[scaling, 2:5] = scales.over, scales.over_middle
    at[moving, 5] = over_motion
    for k, (_, row) in enumerate(own):
        at[inner + k, 5] = row
    middle[:, 5] = 0.5 * (at[:, 5, 1:] + at[:, 5, :-1])
    return at, middle


@compiled
def _fill(g: Array, at: Array, middle: Array, i: int, t: float) -> None:
    """The inputs at the fraction t of sample i."""
    for k in range(_INPUTS):
        g[k] = at[k, i] if t == 0.0 else through_middle(at[k, i], middle[k, i], at[k, i + 1], t)


@compiled
def _law(p: Array, g: Array) -> tuple[float, float, float]:
    """Yield force, c0 and c1 at the inputs."""
    return g[2] * at_field(p[0], p[1], g[1]), g[3] * at_field(p[5], p[6], g[1]), g[4] * at_field(p[7], p[8], g[1])


@compiled
def _rates(p: Array, g: Array, y: float, zeta: float, X: float) -> tuple[float, float, float]:
    """Rates of y, zeta and X."""
    F, c0, c1 = _law(p, g)
    held = F * zeta + p[9] * (X - y)
    R = _left(p, g, X, held, c0, c1)
    y_rate = R / c1
    slip = (R - held) / c0
    beta = p[3] / p[2]
    return y_rate, hysteresis_rate(slip, zeta, 1.0 / p[2], beta, 1.0 / p[2] - beta, p[4]), slip + y_rate


@compiled
def _left(p: Array, g: Array, X: float, held: float, c0: float, c1: float) -> float:
    """The force R that is left for the dashpot c1; ``held`` is what hysteresis and k0 hold of it."""
    spring = _carried(g[0] - X, p[_GIVE], p[_GAP], p[_HARDENING]) - p[_K1] * X + p[_F0] - g[5]
    film = p[_FILM]
    return float((spring + film * (g[6] + held / c0)) / (1.0 + film * (1.0 / c0 + 1.0 / c1)))


@compiled
def _solve_stage(
    p: Array, g: Array, yk: float, zk: float, Xk: float, w: float, zeta: float, X: float
) -> tuple[float, float, float]:
    """State at the end of a stage: state = known + w * rates(state), by Newton from ``zeta`` and ``X``."""
    give, gap, hardening = p[_GIVE], p[_GAP], p[_HARDENING]
    stretch, y = g[0] - X, yk
    for _ in range(_MOST_MOVES):
        force, steep = _carried(stretch, give, gap, hardening), _steepness(stretch, give, gap, hardening)
        y, zeta, X = _solve_straight(p, g, yk, zk, Xk, w, zeta, force - steep * stretch, steep)
        if gap == 0.0 and hardening == 0.0:
            break
        moved = g[0] - X
        straight = force + steep * (moved - stretch)
        if abs(_carried(moved, give, gap, hardening) - straight) < _NEAR * (1.0 + abs(straight)):
            break
        stretch = _next_stretch(stretch, moved, 0.5 * gap)
    return y, zeta, X


@compiled
def _next_stretch(stretch: float, moved: float, half: float) -> float:
    """Where to take the connection straight next: at most on the other side of the next edge of its gap."""
    if stretch <= -half < moved:
        return -half + _BEYOND
    if stretch >= half > moved:
        return half - _BEYOND
    if abs(stretch) < half <= abs(moved):
        return half + _BEYOND if moved > 0.0 else -half - _BEYOND
    return moved


@compiled
def _solve_straight(
    p: Array, g: Array, yk: float, zk: float, Xk: float, w: float, zeta: float, force: float, steep: float
) -> tuple[float, float, float]:
    """The same where the connection carries ``force + steep * stretch``."""
    F, c0, c1 = _law(p, g)
    k0, k1 = p[9], p[_K1]
    # The film's force d (x' - X') is one more spring over this stage: X' = (X - known) / w there.
    rho = force + steep * g[0] + p[_F0] - g[5] + p[_FILM] * (g[6] + Xk / w)
    stiffness = steep + k1 + p[_FILM] / w
    q = 1.0 + c0 / c1 + k0 * w / c1
    inverse = 1.0 / (c0 / w + k0 + stiffness * q)
    constant, slope = (c0 * Xk / w + k0 * yk + rho * q) * inverse, -F * inverse
    slip0 = (constant - Xk) / w - (rho - stiffness * constant) / c1
    slip1 = slope / w + stiffness * slope / c1
    A = 1.0 / p[2]
    beta = p[3] * A
    for _ in range(ITERATIONS):
        slip = slip0 + slip1 * zeta
        rate = hysteresis_rate(slip, zeta, A, beta, A - beta, p[4])
        over_slip, over_zeta = hysteresis_slopes(slip, zeta, A, beta, A - beta, p[4])
        steepness = 1.0 - w * (over_zeta + over_slip * slip1)
        move = (zk + w * rate - zeta) / max(steepness, 0.2)
        zeta += min(max(move, -LARGEST_MOVE), LARGEST_MOVE)
        if abs(move) < TOLERANCE:
            break
    X = constant + slope * zeta
    return yk + w * (rho - stiffness * X) / c1, zeta, X


@compiled
def _start(p: Array, g: Array, y0: float, zeta0: float, v0: float) -> float:
    """Where the damper stands at first: the fixture loaded as by the saturated law."""
    F, c0, _ = _law(p, g)
    load = F * zeta0 + c0 * v0 + g[5] - p[_F0]
    X = g[0]
    for _ in range(_MOST_MOVES):
        X = g[0] - _stretched(load + p[_K1] * X, p[_GIVE], p[_GAP], p[_HARDENING])
    return float(X)


@compiled
def march(
    p: Array, at: Array, middle: Array, h: float, start: Array, fineness: float, plan: Plan
) -> tuple[Array, Array, Array]:
    """States and force along a recording.

    Args:
        p: (16,) fixed numbers.
        at, middle: (7, N) and (7, N-1) inputs.
        h: [s] time between samples.
        start: y [m], zeta [1] and velocity of the actuator [m/s] at the first sample.
        fineness, plan: as on a rigid fixture.

    Returns:
        y [m], zeta [1], force on the load cell [N], each (N,).
    """
    count = at.shape[1]
    ys, zetas, forces, g = np.empty(count), np.empty(count), np.empty(count), np.empty(_INPUTS)
    y, zeta = start[0], start[1]
    _fill(g, at, middle, 0, 0.0)
    X = _start(p, g, y, zeta, start[2])
    y_rate, zeta_rate, X_rate = _rates(p, g, y, zeta, X)
    for i in range(count):
        ys[i], zetas[i] = y, zeta
        forces[i] = _on_cell(p, at[:, i], X, X_rate)
        if i == count - 1:
            break
        if plan[i] == 0:
            plan[i] = _steps(fineness, p, at, h, i, X_rate, y_rate, zeta, zeta_rate)
        w = HALF * h / plan[i]
        for k in range(plan[i]):
            _fill(g, at, middle, i, (k + GAMMA) / plan[i])
            y1, z1, X1 = _solve_stage(p, g, y + w * y_rate, zeta + w * zeta_rate, X + w * X_rate, w, zeta, X)
            _fill(g, at, middle, i, (k + 1.0) / plan[i])
            y, zeta, X = _solve_stage(p, g, _backward(y1, y), _backward(z1, zeta), _backward(X1, X), w, z1, X1)
            y_rate, zeta_rate, X_rate = _rates(p, g, y, zeta, X)
    return ys, zetas, forces


@compiled
def _backward(stage: float, start: float) -> float:
    return WEIGHT_STAGE * stage - WEIGHT_START * start


@compiled
def _steps(
    fineness: float,
    p: Array,
    at: Array,
    h: float,
    i: int,
    X_rate: float,
    y_rate: float,
    zeta: float,
    zeta_rate: float,
) -> int:
    """Steps for one sample: as many as the actuator's change of velocity asks for, taken to the damper."""
    speed = (at[0, i + 1] - at[0, i]) / h
    return choose_steps(fineness, p, h, X_rate, speed, at[1, i], at[1, i + 1], y_rate, zeta, zeta_rate)


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
        y [m], zeta [1], force [N], each (N,), and slopes (N, 16 + 1 + E): the fixed numbers, y0, the further ones.
    """
    count, extra = at.shape[1], len(over)
    columns = _FIXED + 1 + extra
    ys, zetas, forces, slopes = np.empty(count), np.empty(count), np.empty(count), np.empty((count, columns))
    S, S1, f, f1 = np.zeros((3, columns)), np.zeros((3, columns)), np.zeros((3, columns)), np.zeros((3, columns))
    J, J1, g = np.zeros((3, 3)), np.zeros((3, 3)), np.empty(_INPUTS)
    S[0, _FIXED] = 1.0
    y, zeta = start[0], start[1]
    _fill(g, at, middle, 0, 0.0)
    X = _start(p, g, y, zeta, start[2])
    _start_slopes(p, g, zeta, start[2], X, over, S)
    y_rate, zeta_rate, X_rate = _slopes(p, g, y, zeta, X, over, over_middle, 0, 0.0, J, f)
    for i in range(count):
        ys[i], zetas[i] = y, zeta
        forces[i] = _on_cell(p, at[:, i], X, X_rate)
        _record(slopes[i], S, J, f, over[:, :, i], at[0, i] - X, at[6, i] - X_rate, p)
        if i == count - 1:
            break
        if plan[i] == 0:
            plan[i] = _steps(fineness, p, at, h, i, X_rate, y_rate, zeta, zeta_rate)
        w = HALF * h / plan[i]
        for k in range(plan[i]):
            t = (k + GAMMA) / plan[i]
            _fill(g, at, middle, i, t)
            y1, z1, X1 = _solve_stage(p, g, y + w * y_rate, zeta + w * zeta_rate, X + w * X_rate, w, zeta, X)
            _slopes(p, g, y1, z1, X1, over, over_middle, i, t, J1, f1)
            _known_slopes(w, J, S, f, f1, S1)
            _solve(w, J1, S1)
            t = (k + 1.0) / plan[i]
            _fill(g, at, middle, i, t)
            y, zeta, X = _solve_stage(p, g, _backward(y1, y), _backward(z1, zeta), _backward(X1, X), w, z1, X1)
            y_rate, zeta_rate, X_rate = _slopes(p, g, y, zeta, X, over, over_middle, i, t, J, f)
            _backward_slopes(w, f, S1, S)
            _solve(w, J, S)
    return ys, zetas, forces, slopes


@compiled
def _on_cell(p: Array, g: Array, X: float, X_rate: float) -> float:
    """What the connection carries [N]."""
    return float(_carried(g[0] - X, p[_GIVE], p[_GAP], p[_HARDENING]) + p[_FILM] * (g[6] - X_rate))


@compiled
def _record(
    row: Array, S: Array, J: Array, f: Array, over: Array, stretch: float, stretching: float, p: Array
) -> None:
    """Write the slopes of the force at one sample into its row."""
    steep, film = _steepness(stretch, p[_GIVE], p[_GAP], p[_HARDENING]), p[_FILM]
    for j in range(len(row)):
        X_rate = J[2, 0] * S[0, j] + J[2, 1] * S[1, j] + J[2, 2] * S[2, j] + f[2, j]
        row[j] = -S[2, j] * steep - film * X_rate
    for e in range(len(over)):
        row[_FIXED + 1 + e] += over[e, 0] * steep + film * over[e, 6]
    row[_FILM] += stretching
    over_give, over_gap, over_hardening = _over_connection(stretch, p)
    row[_GIVE] += over_give
    row[_GAP] += over_gap
    row[_HARDENING] += over_hardening


@compiled
def _over_connection(stretch: float, p: Array) -> tuple[float, float, float]:
    """Slopes of what the connection carries over its give, gap and hardening."""
    give, gap, hardening = p[_GIVE], p[_GAP], p[_HARDENING]
    half = 0.5 * gap
    bent = stretch - min(max(stretch, -half), half)
    over_give = -_carried(stretch, give, gap, hardening) / give
    if bent == 0.0:
        return over_give, 0.0, 0.0
    side = 0.5 if bent > 0.0 else -0.5
    over_gap = side * (connection.FILM / give - _steepness(stretch, give, gap, hardening))
    return over_give, over_gap, bent**3 / give


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
            S[a, j] = _backward(S1[a, j], S[a, j]) + w * f[a, j]


@compiled
def _start_slopes(p: Array, g: Array, zeta0: float, v0: float, X: float, over: Array, S: Array) -> None:
    """Slopes of where the damper stands at first, written into S."""
    u = g[1]
    give = 1.0 / _steepness(g[0] - X, p[_GIVE], p[_GAP], p[_HARDENING])
    stiff = 1.0 + give * p[_K1]
    S[2, 0], S[2, 1] = -give * g[2] * zeta0 / stiff, -give * u * g[2] * zeta0 / stiff
    S[2, 5], S[2, 6] = -give * g[3] * v0 / stiff, -give * u * g[3] * v0 / stiff
    S[2, _K1], S[2, _F0] = -give * X / stiff, give / stiff
    over_give, over_gap, over_hardening = _over_connection(g[0] - X, p)
    S[2, _GIVE] = give * over_give / stiff
    S[2, _GAP] = give * over_gap / stiff
    S[2, _HARDENING] = give * over_hardening / stiff
    for e in range(len(over)):
        d = over[e, :, 0]
        change = (g[2] * p[1] * zeta0 + g[3] * p[6] * v0) * d[1] + d[5]
        change += d[2] * at_field(p[0], p[1], u) * zeta0 + d[3] * at_field(p[5], p[6], u) * v0
        S[2, _FIXED + 1 + e] = (d[0] - give * change) / stiff


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
    F, c0, c1 = _law(p, g)
    k0 = p[9]
    steep = _steepness(g[0] - X, p[_GIVE], p[_GAP], p[_HARDENING])
    held = F * zeta + k0 * (X - y)
    R = _left(p, g, X, held, c0, c1)
    y_rate, slip = R / c1, (R - held) / c0
    A = 1.0 / p[2]
    beta = p[3] * A
    rate = hysteresis_rate(slip, zeta, A, beta, A - beta, p[4])
    over_slip, over_zeta = hysteresis_slopes(slip, zeta, A, beta, A - beta, p[4])
    stiffness = steep + p[_K1]
    J[0, 0] = J[0, 1] = 0.0
    J[0, 2] = -stiffness / c1
    J[1, 0], J[1, 1], J[1, 2] = k0 / c0, -F / c0, -(stiffness + k0) / c0
    # Row 1 of J and f holds slopes of the slip until the end, where they become those of zeta' and X'.
    _over_fixed(p, g, X, y, zeta, y_rate, slip, c0, c1, f)
    for e in range(len(over)):
        f[0, _FIXED + 1 + e] = f[1, _FIXED + 1 + e] = 0.0
        for k in range(_INPUTS):
            d = over[e, k, i]
            if t > 0.0:
                d = through_middle(d, over_middle[e, k, i], over[e, k, i + 1], t)
            if d != 0.0:
                over_y, over_s = _over_input(p, g, k, steep, zeta, y_rate, slip, c0, c1)
                f[0, _FIXED + 1 + e] += over_y * d
                f[1, _FIXED + 1 + e] += over_s * d
    _through_film(p[_FILM], c0, c1, over_slip, f)
    _through_film(p[_FILM], c0, c1, over_slip, J)
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
    return p[_FILM] / c1, p[_FILM] / c0


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
    for j in range(_FIXED + 1):
        f[0, j] = f[1, j] = 0.0
    f[1, 0], f[1, 1] = -g[2] * zeta / c0, -u * g[2] * zeta / c0
    f[1, 5], f[1, 6] = -slip * g[3] / c0, -u * slip * g[3] / c0
    f[0, 7], f[0, 8] = -y_rate * g[4] / c1, -u * y_rate * g[4] / c1
    f[1, 9] = -(X - y) / c0
    f[0, _K1], f[1, _K1] = -X / c1, -X / c0
    f[0, _F0], f[1, _F0] = 1.0 / c1, 1.0 / c0
    over_give, over_gap, over_hardening = _over_connection(g[0] - X, p)
    f[0, _GIVE], f[1, _GIVE] = over_give / c1, over_give / c0
    f[0, _GAP], f[1, _GAP] = over_gap / c1, over_gap / c0
    f[0, _HARDENING], f[1, _HARDENING] = over_hardening / c1, over_hardening / c0
    stretching = g[6] - slip - y_rate
    f[0, _FILM], f[1, _FILM] = stretching / c1, stretching / c0


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
