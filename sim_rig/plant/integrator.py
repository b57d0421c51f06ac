"""Integrator of actuator and specimen: explicit Runge-Kutta of fourth order, with steps bound by the stiffness.

It is deliberately different from the implicit integrator of identification. Each command sample is divided into
substeps of at most an eighth of a millisecond, each substep into equal integration steps. At a reversal the
hysteretic variable relaxes at about 2e4 1/s, and the law has a corner where the slip velocity changes sign.
Substeps near a reversal are therefore divided into more steps.
"""

import math

import numba
import numpy as np

from identification.damper.effects import connection
from sim_rig.plant.derivatives import LOOKAHEAD, compute_rates
from sim_rig.plant.jit import (
    BINARY_TYPE,
    QUATERNARY_TYPE,
    SCALE_TYPE,
    Array,
    BinaryFunction,
    QuaternaryFunction,
    ScaleFunction,
    compile_function,
)
from sim_rig.plant.law import evaluate_coefficient
from sim_rig.plant.states import (
    ACTUATOR_COMPLIANCE,
    AMPLIFIER_RATE,
    BACKLASH,
    BASE_RATE,
    DAMPER,
    DEAD_TIME,
    FIELD,
    FIELD_MEMORY,
    FIXTURE_COMPLIANCE,
    HARDENING,
    OUTPUT,
    POSITION,
    SERVO_BANDWIDTH,
    STATE_COUNT,
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
MAX_STEPS = 2e5
"""Threshold on the steps of a substep: above it, the motion counts as divergent."""
_MIN_CORNER_MOVE = 1e-7
"""Threshold on the change of z relative to its saturation [1]: below it, a corner gets no further steps."""
_OUTPUT_TOLERANCE = 1e-7
"""Relative deviation from the drive [1] within which the amplifier's output is settled and needs no fine steps."""
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
    follower: BinaryFunction,
) -> float:
    """Return the steps that a substep of h [s] needs for stability, and for accuracy at reversals and contacts."""
    turn = 2.0 * abs(rate[VELOCITY]) * h
    fastest = abs(slip) + turn
    steps = 1.0
    if k[BACKLASH] != 0.0:
        moves = follower(x, s[POSITION] + s[VELOCITY] * LOOKAHEAD) != x
        moves_later = follower(x, s[POSITION] + s[VELOCITY] * h) != x
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


@compile_function
def _integrate_step(
    s: Array,
    last_damper: float,
    remanence: float,
    start: float,
    end: float,
    drive: float,
    delayed_output: float,
    h: float,
    k: Array,
    p: Array,
    follower: BinaryFunction,
    parallel_force: QuaternaryFunction,
    field_map: BinaryFunction,
    field_memory: BinaryFunction,
    scale_factors: ScaleFunction,
    work: Array,
) -> tuple[float, float]:
    """Take one classical Runge-Kutta step of h [s] in place; the command is linear from start to end [m].

    Returns:
        Displacement of the damper [m] and remanence of the iron [V or A].
    """
    a, b, c, d, mid = work[0], work[1], work[2], work[3], work[4]
    half, field = 0.5 * (start + end), s[FIELD]
    compute_rates(
        s,
        last_damper,
        remanence,
        start,
        drive,
        delayed_output,
        k,
        p,
        follower,
        parallel_force,
        field_map,
        scale_factors,
        a,
    )
    for j in range(STATE_COUNT):
        mid[j] = s[j] + 0.5 * h * a[j]
    compute_rates(
        mid,
        last_damper,
        remanence,
        half,
        drive,
        delayed_output,
        k,
        p,
        follower,
        parallel_force,
        field_map,
        scale_factors,
        b,
    )
    for j in range(STATE_COUNT):
        mid[j] = s[j] + 0.5 * h * b[j]
    compute_rates(
        mid,
        last_damper,
        remanence,
        half,
        drive,
        delayed_output,
        k,
        p,
        follower,
        parallel_force,
        field_map,
        scale_factors,
        c,
    )
    for j in range(STATE_COUNT):
        mid[j] = s[j] + h * c[j]
    compute_rates(
        mid,
        last_damper,
        remanence,
        end,
        drive,
        delayed_output,
        k,
        p,
        follower,
        parallel_force,
        field_map,
        scale_factors,
        d,
    )
    for j in range(STATE_COUNT):
        s[j] += h / 6.0 * (a[j] + 2.0 * (b[j] + c[j]) + d[j])
    # Once per step, from its end: stages are trial points that must not enter the memory of clevis and iron.
    if k[FIELD_MEMORY] != 0.0 and s[FIELD] != field:
        remanence = field_memory(remanence, s[FIELD] - field)
    return float(follower(last_damper, s[POSITION])), remanence


@compile_function
def _interpolate_output(output_history: Array, substep: int, delay: float) -> float:
    """Return the amplifier output that reaches the coil half way through a substep, after ``delay`` [substeps]."""
    position = max(substep + 0.5 - delay, 0.0)
    i = min(int(position), substep)
    t = min(position - i, 1.0) if i < substep else 0.0
    before, after = (
        output_history[i % len(output_history)],
        output_history[min(i + 1, substep) % len(output_history)],
    )
    return float(before + t * (after - before))


def _integrate(
    s: Array,
    last_damper: float,
    remanence: float,
    output_history: Array,
    first_substep: int,
    command: Array,
    drive: Array,
    h: float,
    substeps: int,
    k: Array,
    p: Array,
    follower: BinaryFunction,
    parallel_force: QuaternaryFunction,
    field_map: BinaryFunction,
    field_memory: BinaryFunction,
    scale_factors: ScaleFunction,
    positions: Array,
    forces: Array,
    outputs: Array,
    damper: Array,
    states: Array,
) -> tuple[float, float, int]:
    """Integrate the states through M command samples, in place.

    Args:
        s: (STATE_COUNT,) states at the first instant.
        last_damper: [m] displacement of the damper.
        remanence: [V or A] of the iron.
        output_history: ring buffer of the amplifier's output at the start of each substep, at least as long as
            the dead time.
        first_substep: substeps integrated so far.
        command: (M+1,) commanded displacement [m] at the start of each sample and the end of the last.
        drive: (M,) commanded drive [V or A], held through each sample.
        h: [s] one substep; ``substeps`` of them make a sample.
        k, p, follower, parallel_force, field_map, scale_factors: as in ``compute_rates``.
        field_memory: remanence over (last remanence, change of the field).
        positions, forces: (M substeps,) filled with actuator position [m] and force on the load cell [N] at the
            start of each substep.
        outputs: (M,) filled with the amplifier's output half way through each sample.
        damper: (M, 2) filled with displacement [m] and velocity [m/s] of the damper at each sample.
        states: (M, STATE_COUNT) filled with the states at each sample.

    Returns:
        Displacement of the damper [m], remanence [V or A], and the sample in which the motion diverged, or M.
    """
    work, rate = np.empty((5, STATE_COUNT)), np.empty(STATE_COUNT)
    for i in range(len(drive)):
        states[i] = s
        for j in range(substeps):
            start = command[i] + (command[i + 1] - command[i]) * j / substeps
            end = command[i] + (command[i + 1] - command[i]) * (j + 1) / substeps
            if abs(drive[i] - s[OUTPUT]) < _OUTPUT_TOLERANCE * (abs(drive[i]) + 1e-3):
                s[OUTPUT] = drive[i]
            substep = first_substep + i * substeps + j
            output_history[substep % len(output_history)] = s[OUTPUT]
            delayed_output = _interpolate_output(output_history, substep, k[DEAD_TIME] / h)
            force, x, v, slip = compute_rates(
                s,
                last_damper,
                remanence,
                start,
                drive[i],
                delayed_output,
                k,
                p,
                follower,
                parallel_force,
                field_map,
                scale_factors,
                rate,
            )
            positions[i * substeps + j], forces[i * substeps + j] = s[POSITION], force
            if j == 0:
                damper[i, 0], damper[i, 1] = x, v
            if j == substeps // 2:
                outputs[i] = s[OUTPUT]
            steps = count_steps(s, rate, x, slip, drive[i], h, k, p, follower)
            if not (steps <= MAX_STEPS and math.isfinite(force) and math.isfinite(s[Z])):
                return last_damper, remanence, i
            for step in range(int(steps)):
                step_start = start + (end - start) * step / steps
                step_end = start + (end - start) * (step + 1) / steps
                last_damper, remanence = _integrate_step(
                    s, last_damper, remanence, step_start, step_end, drive[i], delayed_output, h / steps, k, p,
                    follower, parallel_force, field_map, field_memory, scale_factors, work,
                )  # fmt: skip
    return last_damper, remanence, len(drive)


_VECTOR, _MATRIX, _SCALAR = numba.float64[::1], numba.float64[:, ::1], numba.float64
_SIGNATURE = (
    *(_VECTOR, _SCALAR, _SCALAR, _VECTOR, numba.int64, _VECTOR, _VECTOR, _SCALAR, numba.int64, _VECTOR, _VECTOR),
    *(
        BINARY_TYPE,
        QUATERNARY_TYPE,
        BINARY_TYPE,
        BINARY_TYPE,
        SCALE_TYPE,
        _VECTOR,
        _VECTOR,
        _VECTOR,
        _MATRIX,
        _MATRIX,
    ),
)
integrate = compile_function(_integrate, _SIGNATURE)
"""`_integrate`, compiled at the first import, once for all kinds of effects."""
