"""Integrator of the plant with alternative forms: Runge-Kutta of fourth order, with steps bound by stiffness."""

import math
from typing import Any

import numba

from sim_rig.effect_forms import X
from sim_rig.plant.alternative_derivatives import compute_rates
from sim_rig.plant.alternative_states import (
    DAMPER,
    FIELD,
    HAS_MOUNTING,
    MAX_FORM_RATE,
    MOUNTING_RATE,
    OUTPUT,
    POSITION,
    STATE_COUNT,
    VELOCITY,
    Z,
)
from sim_rig.plant.jit import Array, borrow, compile_function
from sim_rig.plant.law import evaluate_coefficient
from sim_rig.plant.states import ACTUATOR_COMPLIANCE, AMPLIFIER_RATE, SERVO_BANDWIDTH, Z_SATURATION

STABILITY_LIMIT = 1.2
"""Limit on the product of rate and step [1]; the method is stable up to 2.78."""
CORNER_STEPS = 10
"""Least number of steps in a substep in which the slip velocity may change its sign."""
MAX_STEPS = 20_000
"""Threshold on the steps of a substep: above it, the motion counts as divergent."""

_VECTOR, _MATRIX, _SCALAR = numba.float64[::1], numba.float64[:, ::1], numba.float64
FORM_SIGNATURE = _SCALAR(_VECTOR, _VECTOR, _VECTOR, _VECTOR)
"""Signature of every form's function."""
FORM_TYPE = numba.types.FunctionType(FORM_SIGNATURE)
"""Type of such a function as an argument."""


@compile_function
def _count_steps(s: Array, rate: Array, slip: float, drive: float, h: float, k: Array, p: Array) -> float:
    """Return the steps that a substep of h [s] needs for stability, and for accuracy at reversals."""
    turn = 2.0 * abs(rate[VELOCITY]) * h + 2e-4 * k[HAS_MOUNTING]
    fastest = abs(slip) + turn
    c0, c1 = abs(evaluate_coefficient(p[6], p[7], s[FIELD])), abs(evaluate_coefficient(p[8], p[9], s[FIELD]))
    tangent = 2.0 * abs(evaluate_coefficient(p[0], p[1], s[FIELD])) * p[5] + abs(p[10])
    stiff = p[12] * fastest * p[5] / k[Z_SATURATION] + tangent / (c0 + c1) + k[MAX_FORM_RATE]
    stiff += k[SERVO_BANDWIDTH] * math.sqrt(k[ACTUATOR_COMPLIANCE] * (tangent + abs(p[11])))
    stiff += k[HAS_MOUNTING] * max(tangent * (c0 + c1) / (c0 * c1), k[MOUNTING_RATE])
    if s[OUTPUT] != drive:
        stiff += k[AMPLIFIER_RATE]
    steps = math.ceil(stiff * h / STABILITY_LIMIT)
    return float(max(steps, CORNER_STEPS if abs(slip) <= turn else 1, 1))


@compile_function
def _integrate_step(
    s: Array,
    time: float,
    start: float,
    end: float,
    drive: float,
    h: float,
    now: Array,
    forms: Any,
    k: Array,
    p: Array,
    work: Array,
) -> None:
    """Take one classical Runge-Kutta step of h [s] in place; the command is linear from start to end [m]."""
    a, b, c, d, mid = work[0], work[1], work[2], work[3], work[4]
    half = 0.5 * (start + end)
    compute_rates(s, time, start, drive, now, forms, k, p, a)
    for j in range(STATE_COUNT):
        mid[j] = s[j] + 0.5 * h * a[j]
    compute_rates(mid, time + 0.5 * h, half, drive, now, forms, k, p, b)
    for j in range(STATE_COUNT):
        mid[j] = s[j] + 0.5 * h * b[j]
    compute_rates(mid, time + 0.5 * h, half, drive, now, forms, k, p, c)
    for j in range(STATE_COUNT):
        mid[j] = s[j] + h * c[j]
    compute_rates(mid, time + h, end, drive, now, forms, k, p, d)
    for j in range(STATE_COUNT):
        s[j] += h / 6.0 * (a[j] + 2.0 * (b[j] + c[j]) + d[j])


def _integrate(
    s: Array,
    now: Array,
    time: float,
    command: Array,
    drive: Array,
    h: float,
    substeps: int,
    k: Array,
    p: Array,
    first: Any,
    second: Any,
    third: Any,
    places: Any,
    values: Array,
    exponents: Array,
    forces: Array,
    positions: Array,
    velocities: Array,
    outputs: Array,
    damper: Array,
    states: Array,
    work: Array,
) -> int:
    """Integrate the states through M command samples, in place.

    Args:
        s: (STATE_COUNT,) states at the first instant.
        now: (INPUT_COUNT,) inputs of the forms.
        time: [s] of the first instant.
        command: (M+1,) commanded displacement [m] at the start of each sample and the end of the last.
        drive: (M,) commanded drive [V or A], held through each sample.
        h: [s] one substep; ``substeps`` of them make a sample.
        k, p: as in ``compute_rates``.
        first, second, third: functions of the forms.
        places, values, exponents: (3,), (3, MAX_PARAMETERS) and (3, 3) of the forms.
        forces, positions, velocities: (M substeps,) filled with the force after the force channel [N] and the
            actuator's position [m] and velocity [m/s], at the start of each substep.
        outputs: (M,) filled with the amplifier's output half way through each sample.
        damper: (M, 2) filled with displacement [m] and velocity [m/s] of the damper at each sample.
        states: (M, STATE_COUNT) filled with the states at each sample.
        work: (6, STATE_COUNT) memory of one integration step.

    Returns:
        The sample in which the motion diverged, or M.
    """
    s, now, k, p, work = borrow(s), borrow(now), borrow(k), borrow(p), borrow(work)
    rate = work[5]
    forms = ((first, second, third), borrow(places), borrow(values), borrow(exponents))
    for i in range(len(drive)):
        states[i] = s
        for j in range(substeps):
            start = command[i] + (command[i + 1] - command[i]) * j / substeps
            end = command[i] + (command[i + 1] - command[i]) * (j + 1) / substeps
            instant = time + (i * substeps + j) * h
            # An output that approaches its target asymptotically would otherwise need fine steps forever.
            if abs(drive[i] - s[OUTPUT]) < 1e-7 * (abs(drive[i]) + 1e-3):
                s[OUTPUT] = drive[i]
            force, slip = compute_rates(s, instant, start, drive[i], now, forms, k, p, rate)
            forces[i * substeps + j], positions[i * substeps + j] = force, s[POSITION]
            velocities[i * substeps + j] = s[VELOCITY]
            if j == 0:
                damper[i, 0], damper[i, 1] = now[X], rate[DAMPER]
            if j == substeps // 2:
                outputs[i] = s[OUTPUT]
            steps = _count_steps(s, rate, slip, drive[i], h, k, p)
            if not (steps <= MAX_STEPS and math.isfinite(force) and math.isfinite(s[Z])):
                return i
            for step in range(int(steps)):
                step_start = start + (end - start) * step / steps
                step_end = start + (end - start) * (step + 1) / steps
                step_time = instant + step * h / steps
                _integrate_step(s, step_time, step_start, step_end, drive[i], h / steps, now, forms, k, p, work)
    return len(drive)


_INDEX_VECTOR = numba.int64[::1]
integrate = compile_function(
    _integrate,
    (
        *(_VECTOR, _VECTOR, _SCALAR, _VECTOR, _VECTOR, _SCALAR, numba.int64, _VECTOR, _VECTOR),
        *(
            FORM_TYPE,
            FORM_TYPE,
            FORM_TYPE,
            _INDEX_VECTOR,
            _MATRIX,
            _MATRIX,
            _VECTOR,
            _VECTOR,
            _VECTOR,
            _VECTOR,
            _MATRIX,
            _MATRIX,
            _MATRIX,
        ),
    ),
)
"""`_integrate`, compiled at the first import, once for all forms."""
