"""The march where the fixture gives way: the damper's displacement is a third state.

With R = carried(x - X) + d (x' - X') - k1 X + f0 - p the force that is left for the dashpot c1 (X where the damper
stands, x where the actuator does, d the film of the connection, p the force beside the law), the law reads

    y' = R / c1      X' = slip + y'      slip = (R - F zeta - k0 (X - y)) / c0      zeta' = g(slip, zeta)

so that each implicit stage of a linear spring is linear in y and X and leaves one scalar equation in zeta, as on a
rigid fixture; one with a gap, or one that hardens, is taken straight about where it stands until it stands there.
The force on the cell is what the connection carries. Forces beside the law are taken at the actuator's motion.

``p`` below holds 17 fixed numbers: the ten structural coordinates, k1, f0, and give, gap, hardening, film and
stiffness in the gap of the connection; ``g`` the seven inputs at one instant: x, u, factors of alpha, c0, c1,
force beside the law, x'.
"""

import numpy as np

from identification.arrays import Array, compiled
from identification.damper.effects import connection
from identification.simulate.curves import half_way
from identification.simulate.inputs import Field
from identification.simulate.kernel import Plan
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
    choose_steps,
    hysteresis_rate,
    hysteresis_slopes,
    through_middle,
)

FIXED, INPUTS = 17, 7
K1, F0, GIVE, GAP, HARDENING, FILM, INSIDE = 10, 11, 12, 13, 14, 15, 16
_MOST_MOVES = 12
"""Times that a connection is taken straight anew in one stage."""
_NEAR = 1e-8
"""[1] relative error of what it carries at which it stands there."""
_BEYOND = 1e-12
"""[m] past the edge of its gap, from where it is taken straight on the other side."""

carried = compiled(connection.carried)
steepness_of = compiled(connection.steepness)
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
    at = np.zeros((inner + len(own), INPUTS, count))
    middle = np.zeros((inner + len(own), INPUTS, count - 1))
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
def fill(g: Array, at: Array, middle: Array, i: int, t: float) -> None:
    """The inputs at the fraction t of sample i."""
    for k in range(INPUTS):
        g[k] = at[k, i] if t == 0.0 else through_middle(at[k, i], middle[k, i], at[k, i + 1], t)


@compiled
def law_at(p: Array, g: Array) -> tuple[float, float, float]:
    """Yield force, c0 and c1 at the inputs."""
    return g[2] * at_field(p[0], p[1], g[1]), g[3] * at_field(p[5], p[6], g[1]), g[4] * at_field(p[7], p[8], g[1])


@compiled
def _rates(p: Array, g: Array, y: float, zeta: float, X: float) -> tuple[float, float, float]:
    """Rates of y, zeta and X."""
    F, c0, c1 = law_at(p, g)
    held = F * zeta + p[9] * (X - y)
    R = left_over(p, g, X, held, c0, c1)
    y_rate = R / c1
    slip = (R - held) / c0
    beta = p[3] / p[2]
    return y_rate, hysteresis_rate(slip, zeta, 1.0 / p[2], beta, 1.0 / p[2] - beta, p[4]), slip + y_rate


@compiled
def left_over(p: Array, g: Array, X: float, held: float, c0: float, c1: float) -> float:
    """The force R that is left for the dashpot c1; ``held`` is what hysteresis and k0 hold of it."""
    spring = carried(g[0] - X, p[GIVE], p[GAP], p[HARDENING], p[INSIDE]) - p[K1] * X + p[F0] - g[5]
    film = p[FILM]
    return float((spring + film * (g[6] + held / c0)) / (1.0 + film * (1.0 / c0 + 1.0 / c1)))


@compiled
def solve_stage(
    p: Array, g: Array, yk: float, zk: float, Xk: float, w: float, zeta: float, X: float
) -> tuple[float, float, float]:
    """State at the end of a stage: state = known + w * rates(state), by Newton from ``zeta`` and ``X``."""
    give, gap, hardening, inside = p[GIVE], p[GAP], p[HARDENING], p[INSIDE]
    stretch, y = g[0] - X, yk
    for _ in range(_MOST_MOVES):
        force = carried(stretch, give, gap, hardening, inside)
        steep = steepness_of(stretch, give, gap, hardening, inside)
        y, zeta, X = _solve_straight(p, g, yk, zk, Xk, w, zeta, force - steep * stretch, steep)
        # A linear spring is straight everywhere.
        if gap == 0.0 and hardening == 0.0:
            break
        moved = g[0] - X
        straight = force + steep * (moved - stretch)
        if abs(carried(moved, give, gap, hardening, inside) - straight) < _NEAR * (1.0 + abs(straight)):
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
    F, c0, c1 = law_at(p, g)
    k0, k1 = p[9], p[K1]
    # The film's force d (x' - X') is one more spring over this stage: X' = (X - known) / w there.
    rho = force + steep * g[0] + p[F0] - g[5] + p[FILM] * (g[6] + Xk / w)
    stiffness = steep + k1 + p[FILM] / w
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
def start_of(p: Array, g: Array, y0: float, zeta0: float, v0: float) -> float:
    """Where the damper stands at first: the fixture loaded as by the saturated law."""
    F, c0, _ = law_at(p, g)
    load = F * zeta0 + c0 * v0 + g[5] - p[F0]
    X = g[0]
    # k1 pulls where the damper stands: each round leaves k1 times the give of the error, a small part.
    for _ in range(_MOST_MOVES):
        X = g[0] - _stretched(load + p[K1] * X, p[GIVE], p[GAP], p[HARDENING], p[INSIDE])
    return float(X)


@compiled
def march(
    p: Array, at: Array, middle: Array, h: float, start: Array, fineness: float, plan: Plan
) -> tuple[Array, Array, Array]:
    """States and force along a recording.

    Args:
        p: (17,) fixed numbers.
        at, middle: (7, N) and (7, N-1) inputs.
        h: [s] time between samples.
        start: y [m], zeta [1] and velocity of the actuator [m/s] at the first sample.
        fineness, plan: as on a rigid fixture.

    Returns:
        y [m], zeta [1], force on the load cell [N], each (N,).
    """
    count = at.shape[1]
    ys, zetas, forces, g = np.empty(count), np.empty(count), np.empty(count), np.empty(INPUTS)
    y, zeta = start[0], start[1]
    fill(g, at, middle, 0, 0.0)
    X = start_of(p, g, y, zeta, start[2])
    y_rate, zeta_rate, X_rate = _rates(p, g, y, zeta, X)
    for i in range(count):
        ys[i], zetas[i] = y, zeta
        forces[i] = on_cell(p, at[:, i], X, X_rate)
        if i == count - 1:
            break
        if plan[i] == 0:
            plan[i] = steps_of(fineness, p, at, h, i, X_rate, y_rate, zeta, zeta_rate)
        w = HALF * h / plan[i]
        for k in range(plan[i]):
            fill(g, at, middle, i, (k + GAMMA) / plan[i])
            y1, z1, X1 = solve_stage(p, g, y + w * y_rate, zeta + w * zeta_rate, X + w * X_rate, w, zeta, X)
            fill(g, at, middle, i, (k + 1.0) / plan[i])
            y, zeta, X = solve_stage(p, g, backward(y1, y), backward(z1, zeta), backward(X1, X), w, z1, X1)
            y_rate, zeta_rate, X_rate = _rates(p, g, y, zeta, X)
    return ys, zetas, forces


@compiled
def backward(stage: float, start: float) -> float:
    """What the second stage knows of the first, and of the start of the step."""
    return WEIGHT_STAGE * stage - WEIGHT_START * start


@compiled
def steps_of(
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
def on_cell(p: Array, g: Array, X: float, X_rate: float) -> float:
    """What the connection carries [N]."""
    return float(carried(g[0] - X, p[GIVE], p[GAP], p[HARDENING], p[INSIDE]) + p[FILM] * (g[6] - X_rate))
