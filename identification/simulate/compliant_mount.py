"""Integration on a compliant mount, where the displacement X of the damper is a third state.

With the force on the dashpot c1, R = transmitted(x - X) + d (x' - X') - k1 X + f0 - p (x displacement of the
actuator, d film damping of the connection, p parallel force), the law reads

    y' = R / c1      X' = slip + y'      slip = (R - F zeta - k0 (X - y)) / c0      zeta' = g(slip, zeta)

For a linear spring, each implicit stage is linear in y and X. It reduces to one scalar equation in zeta, as on a
rigid mount. Any other connection is linearised repeatedly until its elongation no longer changes.
The force on the load cell is the force of the connection. Parallel forces are evaluated at the actuator's motion.

``p`` holds 17 fixed values: the ten structural coordinates, k1, f0, and compliance, gap, hardening, film damping
and in-gap stiffness ratio of the connection. Where the elongation is a table, its G values follow, and only the
film damping of the five counts. ``g`` holds the seven inputs at one instant: x, u, factors of alpha,
c0 and c1, parallel force, x'.
"""

import numpy as np

from identification.arrays import Array, njit_cached
from identification.damper.effects import connection
from identification.simulate.curves import interpolate_midpoints
from identification.simulate.inputs import DamperField
from identification.simulate.kernel import StepCounts
from identification.simulate.motion import DamperMotion
from identification.simulate.scaling import ScaleFactors
from identification.simulate.step import (
    GAMMA,
    RATE_WEIGHT,
    WEIGHT_STAGE,
    WEIGHT_START,
    choose_steps,
    compute_hysteresis_rate,
    evaluate_coefficient,
    interpolate_motion,
    interpolate_parabola,
    solve_hysteresis,
)

FIXED_COUNT, INPUT_COUNT, CONNECTION_COUNT = 17, 7, 5
K1, F0, COMPLIANCE, GAP, HARDENING, FILM_DAMPING, IN_GAP_RATIO = 10, 11, 12, 13, 14, 15, 16
_MAX_LINEARISATIONS = 12
"""Largest number of linearisations of a connection in one stage."""
_MAX_TABLE_LINEARISATIONS = 60
"""The same for a table, of which a bisection finds every cell."""
_FORCE_TOLERANCE = 1e-8
"""Relative error of the connection's force below which the linearisation is accepted [1]."""
_EDGE_OFFSET = 1e-12
"""Distance beyond an edge of the gap at which the other side is linearised [m]."""

_compute_transmitted_force = njit_cached(connection.compute_transmitted_force)
_compute_tangent_stiffness = njit_cached(connection.compute_tangent_stiffness)
_compute_formula_elongation = njit_cached(connection.compute_elongation)
_interpolate_force = njit_cached(connection.interpolate_force)
_FORCES = connection.FORCES


def stack_inputs(
    motion: DamperMotion, field: DamperField, scales: ScaleFactors, parallel_force: Array, h: float
) -> tuple[Array, Array]:
    """Return the seven inputs at the samples (7, N) and half way between them (7, N-1)."""
    x, v = interpolate_midpoints(motion.x, motion.v, h)
    ones, middles = np.ones((3, len(motion.x))), np.ones((3, len(x)))
    scaled = scales.values.shape[1] > 0
    between = 0.5 * (parallel_force[1:] + parallel_force[:-1])
    at = np.vstack([motion.x, field.u, scales.values if scaled else ones, parallel_force, motion.v])
    middle = np.vstack([x, field.middle, scales.midpoints if scaled else middles, between, v])
    return np.ascontiguousarray(at), np.ascontiguousarray(middle)


def stack_derivatives(
    motion: DamperMotion,
    field: DamperField,
    scales: ScaleFactors,
    over_motion: Array,
    own: list[tuple[int, Array]],
    h: float,
) -> tuple[Array, Array]:
    """Return the derivatives of the inputs, (E, 7, N) at the samples and (E, 7, N-1) half way between.

    The E unknowns are those of field, motion and factors, then those of parallel forces.
    """
    first, count = len(field.du) - 1, len(motion.x)
    inner = first + max(1 + len(motion.columns), len(scales.derivatives))
    at = np.zeros((inner + len(own), INPUT_COUNT, count))
    middle = np.zeros((inner + len(own), INPUT_COUNT, count - 1))
    at[: first + 1, 1], middle[: first + 1, 1] = field.du, field.dmiddle
    moving = slice(first, first + len(motion.dx))
    at[moving, 0], at[moving, 6] = motion.dx, motion.dv
    middle[moving, 0], middle[moving, 6] = interpolate_midpoints(motion.dx, motion.dv, h)
    scaling = slice(first, first + len(scales.derivatives))
    if len(scales.derivatives):
        at[scaling, 2:5], middle[scaling, 2:5] = scales.derivatives, scales.midpoint_derivatives
    at[moving, 5] = over_motion
    for k, (_, row) in enumerate(own):
        at[inner + k, 5] = row
    middle[:, 5] = 0.5 * (at[:, 5, 1:] + at[:, 5, :-1])
    return at, middle


@njit_cached
def interpolate_inputs(g: Array, at: Array, middle: Array, h: float, i: int, t: float) -> None:
    """Write the inputs at the fraction t of sample i into g (7,); a Hermite cubic interpolates the motion."""
    for k in range(INPUT_COUNT):
        g[k] = at[k, i]
    if t > 0.0:
        g[0], g[6] = interpolate_motion(at[0, i], at[0, i + 1], at[6, i], at[6, i + 1], h, t)
        for k in range(1, INPUT_COUNT - 1):
            g[k] = interpolate_parabola(at[k, i], middle[k, i], at[k, i + 1], t)


@njit_cached
def evaluate_law(p: Array, g: Array) -> tuple[float, float, float]:
    """Return yield force [N], c0 and c1 [N s/m] at the inputs."""
    return (
        g[2] * evaluate_coefficient(p[0], p[1], g[1]),
        g[3] * evaluate_coefficient(p[5], p[6], g[1]),
        g[4] * evaluate_coefficient(p[7], p[8], g[1]),
    )


@njit_cached
def _compute_rates(p: Array, g: Array, y: float, zeta: float, X: float) -> tuple[float, float, float]:
    """Return the rates of y [m/s], zeta [1/s] and X [m/s]."""
    F, c0, c1 = evaluate_law(p, g)
    held = F * zeta + p[9] * (X - y)
    R = compute_dashpot_force(p, g, X, held, c0, c1)
    y_rate = R / c1
    slip = (R - held) / c0
    beta = p[3] / p[2]
    return y_rate, compute_hysteresis_rate(slip, zeta, 1.0 / p[2], beta, 1.0 / p[2] - beta, p[4]), slip + y_rate


@njit_cached
def compute_dashpot_force(p: Array, g: Array, X: float, held: float, c0: float, c1: float) -> float:
    """Compute the force R [N] on the dashpot c1; ``held`` is the part of hysteresis and k0."""
    spring = compute_spring_force(p, g[0] - X) - p[K1] * X + p[F0] - g[5]
    film = p[FILM_DAMPING]
    return float((spring + film * (g[6] + held / c0)) / (1.0 + film * (1.0 / c0 + 1.0 / c1)))


@njit_cached
def compute_spring_force(p: Array, elongation: float) -> float:
    """Compute the force of the connection [N] at an elongation [m], without that of its film."""
    if len(p) > FIXED_COUNT:
        return float(_interpolate_force(elongation, p, FIXED_COUNT)[0])
    return float(_compute_transmitted_force(elongation, p[COMPLIANCE], p[GAP], p[HARDENING], p[IN_GAP_RATIO]))


@njit_cached
def compute_spring_stiffness(p: Array, elongation: float) -> float:
    """Compute the derivative of this force over the elongation [N/m]."""
    if len(p) > FIXED_COUNT:
        return float(_interpolate_force(elongation, p, FIXED_COUNT)[1])
    return float(_compute_tangent_stiffness(elongation, p[COMPLIANCE], p[GAP], p[HARDENING], p[IN_GAP_RATIO]))


@njit_cached
def _compute_elongation(p: Array, force: float) -> float:
    """Compute the elongation of the connection [m] under a force [N]."""
    if len(p) > FIXED_COUNT:
        return float(np.interp(force, _FORCES, p[FIXED_COUNT:]))
    return float(_compute_formula_elongation(force, p[COMPLIANCE], p[GAP], p[HARDENING], p[IN_GAP_RATIO]))


@njit_cached
def solve_stage(
    p: Array, g: Array, yk: float, zk: float, Xk: float, w: float, zeta: float, X: float
) -> tuple[float, float, float]:
    """Solve state = known + w * rates(state) for y, zeta and X at the end of a stage, from ``zeta`` and ``X``."""
    tabulated, half = len(p) > FIXED_COUNT, 0.5 * p[GAP]
    elongation, y = g[0] - X, yk
    low, high = -np.inf, np.inf
    for _ in range(_MAX_TABLE_LINEARISATIONS if tabulated else _MAX_LINEARISATIONS):
        force, steep = compute_spring_force(p, elongation), compute_spring_stiffness(p, elongation)
        y, zeta, X = _solve_linearised(p, g, yk, zk, Xk, w, zeta, force - steep * elongation, steep)
        # A linear spring needs one linearisation.
        if not tabulated and half == 0.0 and p[HARDENING] == 0.0:
            break
        moved = g[0] - X
        straight = force + steep * (moved - elongation)
        if abs(compute_spring_force(p, moved) - straight) < _FORCE_TOLERANCE * (1.0 + abs(straight)):
            break
        if not tabulated:
            elongation = _choose_elongation(elongation, moved, half)
            continue
        # The force grows with the elongation and the load of the damper decreases, so the step shows the side.
        low, high = (elongation, high) if moved > elongation else (low, elongation)
        elongation = moved if low < moved < high else 0.5 * (low + high)
    return y, zeta, X


@njit_cached
def _choose_elongation(elongation: float, moved: float, half: float) -> float:
    """Return the elongation of the next linearisation: at most just beyond the next edge of the gap."""
    if elongation <= -half < moved:
        return -half + _EDGE_OFFSET
    if elongation >= half > moved:
        return half - _EDGE_OFFSET
    if abs(elongation) < half <= abs(moved):
        return half + _EDGE_OFFSET if moved > 0.0 else -half - _EDGE_OFFSET
    return moved


@njit_cached
def _solve_linearised(
    p: Array, g: Array, yk: float, zk: float, Xk: float, w: float, zeta: float, force: float, steep: float
) -> tuple[float, float, float]:
    """Solve the stage for a connection that transmits ``force + steep * elongation``."""
    F, c0, c1 = evaluate_law(p, g)
    k0, k1 = p[9], p[K1]
    # With X' = (X - known) / w, the film's force d (x' - X') acts as one more spring in this stage.
    rho = force + steep * g[0] + p[F0] - g[5] + p[FILM_DAMPING] * (g[6] + Xk / w)
    stiffness = steep + k1 + p[FILM_DAMPING] / w
    q = 1.0 + c0 / c1 + k0 * w / c1
    inverse = 1.0 / (c0 / w + k0 + stiffness * q)
    constant, slope = (c0 * Xk / w + k0 * yk + rho * q) * inverse, -F * inverse
    slip0 = (constant - Xk) / w - (rho - stiffness * constant) / c1
    slip1 = slope / w + stiffness * slope / c1
    zeta = solve_hysteresis(p, zk, w, slip0, slip1, zeta)
    X = constant + slope * zeta
    return yk + w * (rho - stiffness * X) / c1, zeta, X


@njit_cached
def find_start_position(p: Array, g: Array, y0: float, zeta0: float) -> float:
    """Find the initial X [m], at which the damper has the velocity of the actuator."""
    X = g[0]
    # k0 and k1 act at X. Each iteration reduces the error by the factor of both times compliance, which is small.
    for _ in range(_MAX_LINEARISATIONS):
        _, y_rate, _ = compute_start_rates(p, g, y0, zeta0, X)
        c1 = evaluate_law(p, g)[2]
        X = g[0] - _compute_elongation(p, c1 * y_rate + p[K1] * X - p[F0] + g[5])
    return float(X)


@njit_cached
def compute_start_rates(p: Array, g: Array, y0: float, zeta0: float, X: float) -> tuple[float, float, float]:
    """Return c1 over c0 + c1 [1], and y' and slip [m/s] of a damper that has the velocity of the actuator."""
    F, c0, c1 = evaluate_law(p, g)
    y_rate = (c0 * g[6] + F * zeta0 + p[9] * (X - y0)) / (c0 + c1)
    return c1 / (c0 + c1), y_rate, g[6] - y_rate


@njit_cached
def integrate(
    p: Array, at: Array, middle: Array, h: float, start: Array, max_travel: float, step_counts: StepCounts
) -> tuple[Array, Array, Array]:
    """Integrate the states and the force along an excitation.

    Args:
        p: (17,) fixed values, or (17 + G,) with a table.
        at, middle: (7, N) and (7, N-1) inputs.
        h: time between samples [s].
        start: y [m] and zeta [1] at the first sample.
        max_travel, step_counts: as on a rigid mount.

    Returns:
        y [m], zeta [1], force on the load cell [N], each (N,).
    """
    count = at.shape[1]
    ys, zetas, forces, g = np.empty(count), np.empty(count), np.empty(count), np.empty(INPUT_COUNT)
    y, zeta = start[0], start[1]
    interpolate_inputs(g, at, middle, h, 0, 0.0)
    X = find_start_position(p, g, y, zeta)
    y_rate, zeta_rate, X_rate = _compute_rates(p, g, y, zeta, X)
    for i in range(count):
        ys[i], zetas[i] = y, zeta
        forces[i] = compute_cell_force(p, at[:, i], X, X_rate)
        if i == count - 1:
            break
        if step_counts[i] == 0:
            step_counts[i] = choose_sample_steps(max_travel, p, at, h, i, X_rate, y_rate, zeta, zeta_rate)
        w = RATE_WEIGHT * h / step_counts[i]
        for k in range(step_counts[i]):
            x0, v0 = g[0], g[6]
            interpolate_inputs(g, at, middle, h, i, (k + GAMMA) / step_counts[i])
            x1, v1 = g[0], g[6]
            known = X + w * X_rate + correct_first_stage(w, x0, x1, v0, v1)
            y1, z1, X1 = solve_stage(p, g, y + w * y_rate, zeta + w * zeta_rate, known, w, zeta, X)
            interpolate_inputs(g, at, middle, h, i, (k + 1.0) / step_counts[i])
            known = combine_stages(X1, X) + correct_second_stage(w, x0, x1, g[0], g[6])
            y, zeta, X = solve_stage(p, g, combine_stages(y1, y), combine_stages(z1, zeta), known, w, z1, X1)
            y_rate, zeta_rate, X_rate = _compute_rates(p, g, y, zeta, X)
    return ys, zetas, forces


@njit_cached
def combine_stages(stage: float, start: float) -> float:
    """Return the known part of the second stage, from the first stage and the start of the step."""
    return WEIGHT_STAGE * stage - WEIGHT_START * start


@njit_cached
def correct_first_stage(w: float, x0: float, x1: float, v0: float, v1: float) -> float:
    """Return what the weights miss of the actuator's path up to the first stage [m].

    With it, the elongation is the integrated state, and X follows from it. On a stiff connection the damper then
    has the velocity of the actuator, also at coarse steps.
    """
    return x1 - x0 - w * (v0 + v1)


@njit_cached
def correct_second_stage(w: float, x0: float, x1: float, x2: float, v2: float) -> float:
    """Return what the weights miss of the actuator's path up to the end of the step [m]."""
    return x2 - combine_stages(x1, x0) - w * v2


@njit_cached
def choose_sample_steps(
    max_travel: float,
    p: Array,
    at: Array,
    h: float,
    i: int,
    X_rate: float,
    y_rate: float,
    zeta: float,
    zeta_rate: float,
) -> int:
    """Choose the number of steps for one sample as if the damper reached the actuator's velocity at its end."""
    v1 = at[6, i + 1]
    return choose_steps(max_travel, p, h, X_rate, v1, at[1, i], at[1, i + 1], y_rate, zeta, zeta_rate)


@njit_cached
def compute_cell_force(p: Array, g: Array, X: float, X_rate: float) -> float:
    """Compute the force of the connection on the load cell [N]."""
    return float(compute_spring_force(p, g[0] - X) + p[FILM_DAMPING] * (g[6] - X_rate))
