"""Integration of the states and the force on a compliant mount."""

import numpy as np

from identification.arrays import Array, njit_cached
from identification.simulate.compliant_mount.springs import FILM_DAMPING, compute_spring_force
from identification.simulate.compliant_mount.stacked_inputs import INPUT_COUNT, interpolate_inputs
from identification.simulate.compliant_mount.stages import (
    compute_rates,
    find_start_position,
    solve_first_stage,
    solve_second_stage,
)
from identification.simulate.kernel import StepCounts
from identification.simulate.step import GAMMA, RATE_WEIGHT, choose_steps


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
    y_rate, zeta_rate, X_rate = compute_rates(p, g, y, zeta, X)
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
            x1 = g[0]
            y1, z1, X1 = solve_first_stage(p, g, y, zeta, X, y_rate, zeta_rate, X_rate, w, x0, v0)
            interpolate_inputs(g, at, middle, h, i, (k + 1.0) / step_counts[i])
            y, zeta, X = solve_second_stage(p, g, y, zeta, X, y1, z1, X1, w, x0, x1)
            y_rate, zeta_rate, X_rate = compute_rates(p, g, y, zeta, X)
    return ys, zetas, forces


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
