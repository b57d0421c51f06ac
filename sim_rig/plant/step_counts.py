"""Number of integration steps in a substep, for stability and for accuracy at reversals and contacts."""

import math

from identification.damper.effects import connection
from sim_rig.plant.derivatives import LOOKAHEAD
from sim_rig.plant.jit import Array, BinaryFunction, compile_function
from sim_rig.plant.law import evaluate_coefficient
from sim_rig.plant.states import (
    ACTUATOR_COMPLIANCE,
    AMPLIFIER_RATE,
    BACKLASH,
    BASE_RATE,
    DAMPER,
    FIELD,
    FIXTURE_COMPLIANCE,
    HARDENING,
    OUTPUT,
    POSITION,
    SERVO_BANDWIDTH,
    VELOCITY,
    Z_SATURATION,
    Z,
)

STABILITY_LIMIT = 0.8
"""Limit on the product of rate and step [1]; the method is stable up to 2.78."""
MAX_Z_STEP = 0.015
"""Limit on the change of z in one step, relative to its saturation [1]."""
CORNER_STEPS = 24.0
"""Least number of steps in a substep that may contain a reversal."""
CONTACT_STEPS = 96.0
"""Least number of steps in a substep in which contact in the mounting begins or ends: the velocity jumps."""
_MIN_CORNER_MOVE = 1e-7
"""Threshold on the change of z relative to its saturation [1]: below it, a corner gets no further steps."""
_COMPLIANT_STEPS = 8.0
"""Least number of steps per substep with a compliant fixture: damper and actuator then differ in velocity."""

compute_tangent_stiffness = compile_function(connection.compute_tangent_stiffness)


@compile_function
def _bound_rate(s: Array, slip: float, drive: float, k: Array, p: Array) -> float:
    """Return an upper bound of the fastest rate [1/s] for a slip velocity of at most ``slip`` [m/s]."""
    dashpots = abs(evaluate_coefficient(p[6] + p[8], p[7] + p[9], s[FIELD]))
    tangent = 2.0 * abs(evaluate_coefficient(p[0], p[1], s[FIELD])) * p[5]
    hysteresis = p[12] * slip * p[5] / k[Z_SATURATION]
    inner = (tangent + abs(p[10])) / dashpots
    servo = k[SERVO_BANDWIDTH] * math.sqrt(k[ACTUATOR_COMPLIANCE] * (tangent + abs(p[10]) + abs(p[11])))
    settling = s[OUTPUT] != drive
    if k[FIXTURE_COMPLIANCE] > 0.0:
        c0, c1 = abs(evaluate_coefficient(p[6], p[7], s[FIELD])), abs(evaluate_coefficient(p[8], p[9], s[FIELD]))
        stiff = compute_tangent_stiffness(s[POSITION] - s[DAMPER], k[FIXTURE_COMPLIANCE], 0.0, k[HARDENING], 0.0)
        inner += (tangent + stiff) / c0 + stiff / c1
    return float(hysteresis + inner + servo + k[BASE_RATE] + (k[AMPLIFIER_RATE] if settling else 0.0))


@compile_function
def count_steps(
    s: Array,
    rate: Array,
    x: float,
    slip: float,
    drive: float,
    h: float,
    k: Array,
    p: Array,
    backlash_map: BinaryFunction,
) -> float:
    """Return the steps that a substep of h [s] needs for stability, and for accuracy at reversals and contacts."""
    turn = 2.0 * abs(rate[VELOCITY]) * h
    fastest = abs(slip) + turn
    steps = 1.0
    if k[BACKLASH] != 0.0:
        moves = backlash_map(x, s[POSITION] + s[VELOCITY] * LOOKAHEAD) != x
        moves_later = backlash_map(x, s[POSITION] + s[VELOCITY] * h) != x
        if moves != moves_later:  # contact in the clevis begins or ends within this substep
            steps = CONTACT_STEPS
            fastest += abs(s[VELOCITY])
    if k[FIXTURE_COMPLIANCE] > 0.0:
        steps = max(steps, _COMPLIANT_STEPS)
    per_slip = p[5] * h / k[Z_SATURATION]
    travel = abs(rate[Z]) * h / k[Z_SATURATION] + turn * per_slip
    # After a reversal z returns at twice the rate until it has its new sign.
    if slip * s[Z] < 0.0 or abs(slip) <= turn:
        travel = max(travel, 2.0 * fastest * per_slip)
    if abs(slip) <= turn and turn * per_slip > _MIN_CORNER_MOVE:
        steps = max(steps, CORNER_STEPS)
    stable = math.ceil(_bound_rate(s, fastest, drive, k, p) * h / STABILITY_LIMIT)
    return float(max(steps, stable, math.ceil(travel / MAX_Z_STEP)))
