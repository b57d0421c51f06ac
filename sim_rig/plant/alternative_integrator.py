"""Integrator of the plant with alternative forms: the law of the plant, explicit Runge-Kutta, and further states.

In addition to the states of actuator, law and amplifier there are the damper's own displacement behind a compliant
mounting, and the states of at most three forms. The damper's velocity is the one at which the forces of mounting
and damper are equal. The inertia of a mass at the load cell does not act on the actuator, whose own moving mass
(stiffness over squared bandwidth) is about three hundred kilograms.
"""

import math
from typing import Any

import numba
import numpy as np

from sim_rig.effect_forms import MAX_STATES, Place, form
from sim_rig.plant.alternative_states import (
    COMMAND,
    DAMPER,
    FIELD,
    HAS_MOUNTING,
    MAX_FORM_RATE,
    MAX_FORMS,
    MOUNTING_RATE,
    OUTPUT,
    PATH,
    POSITION,
    STATE_COUNT,
    TEMPERATURE,
    VELOCITY,
    Y,
    Z,
)
from sim_rig.plant.jit import Array, compile_function
from sim_rig.plant.law import (
    compute_field_rate,
    compute_force,
    compute_hysteresis_rate,
    compute_inner_velocity,
    evaluate_coefficient,
)
from sim_rig.plant.states import (
    ACTUATOR_COMPLIANCE,
    AMBIENT,
    AMPLIFIER_RATE,
    COIL_HEAT,
    COMMAND_LAG,
    HEAT_CAPACITY,
    HEAT_LOSS,
    SERVO_BANDWIDTH,
    SERVO_DAMPING,
    Z_SATURATION,
)

_FIELD_PLACE, _GAIN_PLACE, _PARALLEL_PLACE = int(Place.FIELD), int(Place.DAMPER_GAIN), int(Place.PARALLEL_FORCE)
_MOUNTING_PLACE, _LOAD_CELL_PLACE, _CHANNEL_PLACE = (
    int(Place.MOUNTING),
    int(Place.LOAD_CELL_FORCE),
    int(Place.FORCE_CHANNEL),
)
_TIME, _X, _V, _ACCELERATION = form.TIME, form.X, form.V, form.ACCELERATION
_FIELD, _FIELD_RATE, _OUTPUT, _FORCE = form.FIELD, form.FIELD_RATE, form.OUTPUT, form.FORCE
_POWER, _PATH, _ELONGATION, _ELONGATION_RATE = form.POWER, form.PATH, form.ELONGATION, form.ELONGATION_RATE

STABILITY_LIMIT = 1.2
"""Limit on the product of rate and step [1]; the method is stable up to 2.78."""
CORNER_STEPS = 10
"""Least number of steps in a substep in which the slip velocity may change its sign."""
MAX_STEPS = 20_000
"""Threshold on the steps of a substep: above it, the motion counts as divergent."""
_NEWTON_STEPS = 4
"""Largest number of Newton steps for the velocity behind a mounting; one is enough except at corners."""
_VELOCITY_INCREMENT = 1e-6
"""[m/s] increment of the finite difference for the Newton slope."""
_FORCE_TOLERANCE = 1e-6
"""[N] difference up to which the two forces count as equal."""

_VECTOR, _MATRIX, _SCALAR = numba.float64[::1], numba.float64[:, ::1], numba.float64
FORM_SIGNATURE = _SCALAR(_VECTOR, _VECTOR, _VECTOR, _VECTOR)
"""Signature of every form's function."""
_FORM_TYPE = numba.types.FunctionType(FORM_SIGNATURE)


@compile_function
def _evaluate_form(i: int, s: Array, now: Array, forms: Any, rate: Array) -> float:
    """Evaluate the i-th form, which writes the rates of its own states."""
    start = DAMPER + 1 + i * MAX_STATES
    return float(forms[0][i](now, s[start : start + MAX_STATES], forms[2][i], rate[start : start + MAX_STATES]))


@compile_function
def _compute_damper_force(
    v: float, s: Array, now: Array, forms: Any, p: Array, rate: Array
) -> tuple[float, float]:
    """Return force [N] and inner velocity [m/s] of the damper at a velocity [m/s], parallel forms included."""
    x, u = now[_X], now[_FIELD]
    now[_V] = v
    alpha, c0, c1 = (
        evaluate_coefficient(p[0], p[1], u),
        evaluate_coefficient(p[6], p[7], u),
        evaluate_coefficient(p[8], p[9], u),
    )
    parallel_force = 0.0
    for i in range(MAX_FORMS):
        if forms[1][i] == _GAIN_PLACE:
            factor, exponents = _evaluate_form(i, s, now, forms, rate), forms[3][i]
            alpha, c0, c1 = (
                alpha * factor ** exponents[0],
                c0 * factor ** exponents[1],
                c1 * factor ** exponents[2],
            )
        elif forms[1][i] == _PARALLEL_PLACE:
            parallel_force += _evaluate_form(i, s, now, forms, rate)
    y_rate = compute_inner_velocity(x, v, s[Y], s[Z], alpha, c0, c1, p[10])
    return float(compute_force(y_rate, x, c1, p[11], p[13]) + parallel_force), float(y_rate)


@compile_function
def _compute_mounting_force(v: float, s: Array, now: Array, forms: Any, rate: Array) -> float:
    """Return the force [N] of the mounting while the damper moves at v [m/s]."""
    now[_ELONGATION], now[_ELONGATION_RATE] = s[POSITION] - s[DAMPER], s[VELOCITY] - v
    for i in range(MAX_FORMS):
        if forms[1][i] == _MOUNTING_PLACE:
            return _evaluate_form(i, s, now, forms, rate)
    return 0.0


@compile_function
def _solve_damper_velocity(s: Array, now: Array, forms: Any, p: Array, rate: Array) -> float:
    """Return the velocity [m/s] at which the damper's force equals that of its mounting."""
    v = now[_V]
    for _ in range(_NEWTON_STEPS):
        imbalance = (
            _compute_mounting_force(v, s, now, forms, rate) - _compute_damper_force(v, s, now, forms, p, rate)[0]
        )
        if abs(imbalance) < _FORCE_TOLERANCE:
            break
        shifted = v + _VELOCITY_INCREMENT
        shifted_imbalance = (
            _compute_mounting_force(shifted, s, now, forms, rate)
            - _compute_damper_force(shifted, s, now, forms, p, rate)[0]
        )
        v -= imbalance * _VELOCITY_INCREMENT / (shifted_imbalance - imbalance)
    return float(v)


@compile_function
def compute_rates(
    s: Array, time: float, command: float, drive: float, now: Array, forms: Any, k: Array, p: Array, rate: Array
) -> tuple[float, float]:
    """Write the rates of all states to ``rate``.

    Args:
        s: (STATE_COUNT,) states.
        time: [s] since the start.
        command: [m] commanded displacement now.
        drive: [V or A] commanded drive.
        now: (INPUT_COUNT,) inputs of the forms; reused from call to call as a first guess.
        forms: functions, places (3,), values (3, MAX_PARAMETERS), exponents (3, 3).
        k: (CONSTANT_COUNT,) constants of actuator, amplifier and heat.
        p: (14,) parameters of the law in the paper's order.
        rate: (STATE_COUNT,) result.

    Returns:
        Force after the force channel [N] and slip velocity [m/s].
    """
    now[_TIME], now[_OUTPUT], now[_PATH] = time, s[OUTPUT], s[PATH]
    rate[FIELD] = compute_field_rate(s[FIELD], s[OUTPUT], p[4])
    now[_FIELD], now[_FIELD_RATE] = s[FIELD], rate[FIELD]
    for i in range(MAX_FORMS):
        if forms[1][i] == _FIELD_PLACE:
            now[_FIELD] = _evaluate_form(i, s, now, forms, rate)
    v = s[VELOCITY]
    now[_X] = s[POSITION]
    if k[HAS_MOUNTING] != 0.0:
        now[_X] = s[DAMPER]
        v = _solve_damper_velocity(s, now, forms, p, rate)
    force, y_rate = _compute_damper_force(v, s, now, forms, p, rate)
    now[_POWER] = abs(force * v)
    _compute_servo_rates(s, command, force, k, rate)
    rate[Y], rate[PATH], rate[DAMPER] = y_rate, abs(v), v
    rate[Z] = compute_hysteresis_rate(v - y_rate, s[Z], p[5], p[2], p[3], p[12])
    rate[OUTPUT] = k[AMPLIFIER_RATE] * (drive - s[OUTPUT])
    heat = now[_POWER] + k[COIL_HEAT] * s[OUTPUT] * s[OUTPUT]
    rate[TEMPERATURE] = (heat - k[HEAT_LOSS] * (s[TEMPERATURE] - k[AMBIENT])) / k[HEAT_CAPACITY]
    now[_ACCELERATION] = rate[VELOCITY]
    return _compute_channel_force(force, s, now, forms, rate), v - y_rate


@compile_function
def _compute_servo_rates(s: Array, command: float, force: float, k: Array, rate: Array) -> None:
    """Write the rates of the actuator under a load [N]."""
    rate[COMMAND] = k[COMMAND_LAG] * (command - s[COMMAND])
    rate[POSITION] = s[VELOCITY]
    error = s[COMMAND] - s[POSITION] - k[ACTUATOR_COMPLIANCE] * force
    rate[VELOCITY] = k[SERVO_BANDWIDTH] * (k[SERVO_BANDWIDTH] * error - 2.0 * k[SERVO_DAMPING] * s[VELOCITY])


@compile_function
def _compute_channel_force(force: float, s: Array, now: Array, forms: Any, rate: Array) -> float:
    """Return the force [N] after the force channel, from the damper's force and further forces on the cell."""
    # All forces on the cell are added first, because the channel acts on their sum.
    now[_FORCE] = force
    for i in range(MAX_FORMS):
        if forms[1][i] == _LOAD_CELL_PLACE:
            now[_FORCE] += _evaluate_form(i, s, now, forms, rate)
    for i in range(MAX_FORMS):
        if forms[1][i] == _CHANNEL_PLACE:
            now[_FORCE] = _evaluate_form(i, s, now, forms, rate)
    return float(now[_FORCE])


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
    outputs: Array,
    damper: Array,
    states: Array,
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
        forces, positions: (M substeps,) filled with the force after the force channel [N] and the actuator's
            position [m], at the start of each substep.
        outputs: (M,) filled with the amplifier's output half way through each sample.
        damper: (M, 2) filled with displacement [m] and velocity [m/s] of the damper at each sample.
        states: (M, STATE_COUNT) filled with the states at each sample.

    Returns:
        The sample in which the motion diverged, or M.
    """
    work, rate = np.zeros((5, STATE_COUNT)), np.zeros(STATE_COUNT)
    forms = ((first, second, third), places, values, exponents)
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
            if j == 0:
                damper[i, 0], damper[i, 1] = now[_X], rate[DAMPER]
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
            _FORM_TYPE,
            _FORM_TYPE,
            _FORM_TYPE,
            _INDEX_VECTOR,
            _MATRIX,
            _MATRIX,
            _VECTOR,
            _VECTOR,
            _VECTOR,
            _MATRIX,
            _MATRIX,
        ),
    ),
)
"""`_integrate`, compiled at the first import, once for all forms."""
