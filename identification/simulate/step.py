"""One implicit integration step of the law, the number of steps per sample, and derivatives of the rates.

TR-BDF2 (Bank et al. 1985): a trapezoidal stage to gamma h, then a second-order backward difference to h. It is
L-stable. The law needs this, because the hysteretic variable relaxes at about 2e4 1/s after a reversal. In the
regular coordinates the hysteretic variable is zeta = z / z_ss with A = 1/D_y, and y is linear in it. Each stage is
therefore one scalar Newton iteration.

``s`` holds the ten structural coordinates, which enter the rates of the states directly: F_a F_b D_y rho n c0_a
c0_b c1_a c1_b k0.
"""

import math

from identification.arrays import Array, njit_inline
from identification.damper import law

GAMMA = 2.0 - math.sqrt(2.0)
"""Position of the first stage in the step [1]; with this value both stages have the same matrix."""
RATE_WEIGHT = GAMMA / 2.0
"""Weight of the rates at the end of each stage, relative to the step [1]."""
WEIGHT_STAGE = 1.0 / (GAMMA * (2.0 - GAMMA))
WEIGHT_START = (1.0 - GAMMA) ** 2 / (GAMMA * (2.0 - GAMMA))

STRUCTURAL_COUNT = 10
"""Number of structural coordinates."""

_TOLERANCE = 1e-11
"""Change of zeta below which the Newton iteration of a stage ends [1]."""
_MAX_MOVE = 0.5
"""Largest change of zeta in one iteration [1]; zeta lies between -1 and 1."""
_MAX_ITERATIONS = 40
_MAX_STEPS = 64
"""Largest number of steps in a sample; it bounds the time of a fit for all parameters inside the bounds."""
_STEPS_AT_TURN = 4
"""Smallest number of steps in a sample in which the slip reverses or the field jumps."""
_FIELD_JUMP = 0.05
"""Threshold on the relative change of the yield force in one sample [1]: above it, the field jumps."""

evaluate_coefficient = njit_inline(law.evaluate_coefficient)
compute_inner_velocity = njit_inline(law.compute_inner_velocity)
compute_hysteresis_rate = njit_inline(law.compute_hysteresis_rate)
differentiate_hysteresis_rate = njit_inline(law.differentiate_hysteresis_rate)


@njit_inline
def interpolate_motion(x0: float, x1: float, v0: float, v1: float, h: float, t: float) -> tuple[float, float]:
    """Return displacement [m] and velocity [m/s] at the fraction t of a sample of h [s], by a Hermite cubic."""
    d = x1 - x0
    square = 3.0 * d - h * (2.0 * v0 + v1)
    cube = h * (v0 + v1) - 2.0 * d
    return x0 + t * (h * v0 + t * (square + t * cube)), v0 + t * (2.0 * square + 3.0 * t * cube) / h


@njit_inline
def interpolate_parabola(start: float, middle: float, end: float, t: float) -> float:
    """Return the value at the fraction t of a sample, by the parabola through its start, middle and end."""
    bend = 2.0 * (start + end) - 4.0 * middle
    return start + t * (end - start - bend + t * bend)


@njit_inline
def _compute_y_rate(s: Array, x: float, v: float, u: float, y: float, zeta: float) -> float:
    """Return the rate y' [m/s]."""
    alpha, c0, c1 = (
        evaluate_coefficient(s[0], s[1], u),
        evaluate_coefficient(s[5], s[6], u),
        evaluate_coefficient(s[7], s[8], u),
    )
    return float(compute_inner_velocity(x, v, y, zeta, alpha, c0, c1, s[9]))


@njit_inline
def compute_rates(s: Array, x: float, v: float, u: float, y: float, zeta: float) -> tuple[float, float]:
    """Return the rates y' [m/s] and zeta' [1/s]."""
    y_rate = _compute_y_rate(s, x, v, u, y, zeta)
    return y_rate, compute_hysteresis_rate(v - y_rate, zeta, 1.0 / s[2], s[3] / s[2], (1.0 - s[3]) / s[2], s[4])


@njit_inline
def choose_steps(
    max_travel: float,
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
    """Choose the number of steps for one sample from the expected change (travel) of zeta.

    It is the square root of the travel over ``max_travel``, because the error of a step falls with its third
    power. A sample in which the slip reverses or the field jumps takes at least ``_STEPS_AT_TURN`` steps.
    """
    slip_before = v0 - y_rate
    slip_after = v1 - y_rate
    travel = abs(zeta_rate) * h
    # After a reversal zeta changes at up to twice slip / D_y, whatever its rate before the reversal.
    if slip_after * zeta < 0.0:
        travel = max(travel, 2.0 * abs(slip_after) * h / s[2])
    steps = min(max(math.ceil(math.sqrt(travel / max_travel)), 1), _MAX_STEPS)
    turns = slip_before * slip_after <= 0.0
    jumps = abs(s[1] * (u1 - u0)) > _FIELD_JUMP * abs(evaluate_coefficient(s[0], s[1], u0))
    return max(steps, _STEPS_AT_TURN) if turns or jumps else steps


@njit_inline
def solve_hysteresis(s: Array, zeta_known: float, weight: float, slip0: float, slip1: float, zeta: float) -> float:
    """Solve zeta = known + weight * rate for a slip of ``slip0 + slip1 * zeta``, from ``zeta``.

    This is Newton's method in a bracket. At a zeta of 1 or -1 its rate points inwards, whatever the slip. A
    solution therefore lies between them, or between one of them and a known part beyond it. Without the bracket
    the method can leave this range for good. An example is a compliant mount linearised far from its elongation.
    """
    A = 1.0 / s[2]
    beta = s[3] * A
    gamma = A - beta
    low, high = min(-1.0, zeta_known), max(1.0, zeta_known)
    for _ in range(_MAX_ITERATIONS):
        slip = slip0 + slip1 * zeta
        rate = compute_hysteresis_rate(slip, zeta, A, beta, gamma, s[4])
        over_slip, over_zeta = differentiate_hysteresis_rate(slip, zeta, A, beta, gamma, s[4])
        error = zeta_known + weight * rate - zeta
        # Just after a reversal the derivative may be small or negative. A bounded change passes this region.
        move = error / max(1.0 - weight * (over_zeta + over_slip * slip1), 0.2)
        if abs(move) < _TOLERANCE:
            return float(zeta + move)
        if error > 0.0:
            low = max(low, zeta)
        else:
            high = min(high, zeta)
        moved = zeta + min(max(move, -_MAX_MOVE), _MAX_MOVE)
        zeta = moved if low <= moved <= high else 0.5 * (low + high)
    return float(zeta)


@njit_inline
def solve_stage(
    s: Array, x: float, v: float, u: float, y_known: float, zeta_known: float, weight: float, zeta: float
) -> tuple[float, float]:
    """Solve state = known + weight * rates(state) for y [m] and zeta [1], by Newton's method from ``zeta``."""
    c0 = evaluate_coefficient(s[5], s[6], u)
    both = c0 + evaluate_coefficient(s[7], s[8], u)
    inverse = 1.0 / (both + weight * s[9])
    constant = (both * y_known + weight * (c0 * v + s[9] * x)) * inverse
    slope = weight * evaluate_coefficient(s[0], s[1], u) * inverse
    slip0 = v - (constant - y_known) / weight
    zeta = solve_hysteresis(s, zeta_known, weight, slip0, -slope / weight, zeta)
    return constant + slope * zeta, zeta


@njit_inline
def solve_first_stage(
    s: Array, x: float, v: float, u: float, weight: float, y: float, zeta: float, y_rate: float, zeta_rate: float
) -> tuple[float, float]:
    """Return the state at the fraction GAMMA of a step from (y, zeta), for the inputs there.

    The weight is RATE_WEIGHT times the step.
    """
    return solve_stage(s, x, v, u, y + weight * y_rate, zeta + weight * zeta_rate, weight, zeta)


@njit_inline
def solve_second_stage(
    s: Array, x: float, v: float, u: float, weight: float, y: float, zeta: float, y1: float, zeta1: float
) -> tuple[float, float, float, float]:
    """Return the state at the end of the step and its rates, from its start and its first stage (y1, zeta1)."""
    y_known = WEIGHT_STAGE * y1 - WEIGHT_START * y
    zeta_known = WEIGHT_STAGE * zeta1 - WEIGHT_START * zeta
    y, zeta = solve_stage(s, x, v, u, y_known, zeta_known, weight, zeta1)
    # zeta' follows from the stage equation, which saves a power. y' determines the force and comes from the law.
    return y, zeta, _compute_y_rate(s, x, v, u, y, zeta), (zeta - zeta_known) / weight


@njit_inline
def differentiate_rates(
    s: Array, x: float, v: float, u: float, y: float, zeta: float, over_state: Array, over_inputs: Array, of: Array
) -> tuple[float, float]:
    """Compute the rates y' and zeta', and write their derivatives into the given arrays.

    Args:
        s: (10,) structural coordinates.
        x, v, u: displacement [m], velocity [m/s] and field [V or A].
        y, zeta: state [m], [1].
        over_state: (2, 2) derivatives of y' and zeta' over y and zeta.
        over_inputs: (2, 3) derivatives of y' and zeta' over x, v and u.
        of: (2, 10 or more); the derivatives over the structural coordinates fill the first ten columns.
    """
    yield_force = evaluate_coefficient(s[0], s[1], u)
    c0 = evaluate_coefficient(s[5], s[6], u)
    c1 = evaluate_coefficient(s[7], s[8], u)
    inverse = 1.0 / (c0 + c1)
    y_rate = compute_inner_velocity(x, v, y, zeta, yield_force, c0, c1, s[9])
    slip = v - y_rate
    A = 1.0 / s[2]
    beta = s[3] * A
    gamma = A - beta
    zeta_rate = compute_hysteresis_rate(slip, zeta, A, beta, gamma, s[4])
    over_slip, steep = differentiate_hysteresis_rate(slip, zeta, A, beta, gamma, s[4])
    of[0, 0] = zeta * inverse
    of[0, 1] = u * zeta * inverse
    of[0, 2] = 0.0
    of[0, 3] = 0.0
    of[0, 4] = 0.0
    of[0, 5] = slip * inverse
    of[0, 6] = u * slip * inverse
    of[0, 7] = -y_rate * inverse
    of[0, 8] = -u * y_rate * inverse
    of[0, 9] = (x - y) * inverse
    for k in range(STRUCTURAL_COUNT):
        of[1, k] = -over_slip * of[0, k]
    size = abs(zeta)
    power = (size + law.Z_GUARD) ** (s[4] - 1.0)
    of[1, 2] -= zeta_rate * A
    of[1, 3] += (abs(slip) * zeta - slip * size) * power * A
    of[1, 4] -= (gamma * abs(slip) * zeta + beta * slip * size) * power * math.log(size + law.Z_GUARD)
    over_inputs[0, 0] = s[9] * inverse
    over_inputs[0, 1] = c0 * inverse
    over_inputs[0, 2] = (s[1] * zeta + s[6] * v - (s[6] + s[8]) * y_rate) * inverse
    over_inputs[1, 0] = -over_slip * over_inputs[0, 0]
    over_inputs[1, 1] = over_slip * (1.0 - over_inputs[0, 1])
    over_inputs[1, 2] = -over_slip * over_inputs[0, 2]
    over_state[0, 0] = -s[9] * inverse
    over_state[1, 0] = -over_slip * over_state[0, 0]
    over_state[0, 1] = yield_force * inverse
    over_state[1, 1] = steep - over_slip * over_state[0, 1]
    return y_rate, zeta_rate
