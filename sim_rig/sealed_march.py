"""The motion with sealed forms at their places: the same law as the plant's, explicit steps, more states.

Beside the states of actuator, law and amplifier it has the damper's own displacement, where a connection gives
way, and the memory of at most three forms. A connection carries what the damper resists: the damper's velocity is
the one at which both forces agree. The inertia of what hangs at the load cell is not felt by the actuator, whose
own moving mass (stiffness over squared bandwidth) is some three hundred kilograms.
"""

import math
from typing import Any

import numba
import numpy as np

from sim_rig.compiled import Array, compiled
from sim_rig.compiled_law import at_field, damper_force, field_rate, hysteresis_rate, inner_velocity
from sim_rig.scenarios.sealed import form
from sim_rig.scenarios.sealed.form import MEMORY, Place
from sim_rig.sealed_states import (
    COMMAND,
    CONNECTED,
    CONTACT,
    DAMPER,
    FASTEST,
    FIELD,
    MOST_FORMS,
    OUTPUT,
    PATH,
    POSITION,
    SPEED,
    STATES,
    TEMPERATURE,
    Y,
    Z,
)
from sim_rig.states import (
    AMBIENT,
    AMPLIFIER,
    COIL,
    COMPLIANCE,
    DAMPING,
    HEAT_CAPACITY,
    HEAT_LOSS,
    LAG,
    SATURATED,
    SERVO,
)

_COIL, _SCALE, _PARALLEL = int(Place.COIL), int(Place.SCALE), int(Place.PARALLEL)
_CONNECTION, _CELL, _CHANNEL = int(Place.CONNECTION), int(Place.CELL), int(Place.CHANNEL)
_TIME, _X, _V, _ACCELERATION = form.TIME, form.X, form.V, form.ACCELERATION
_FIELD, _FIELD_RATE, _OUTPUT, _FORCE = form.FIELD, form.FIELD_RATE, form.OUTPUT, form.FORCE
_POWER, _PATH, _STRETCH, _STRETCH_RATE = form.POWER, form.PATH, form.STRETCH, form.STRETCH_RATE

STABLE = 1.2
"""[1] largest product of rate and step; the method is stable up to 2.78."""
CORNER_STEPS = 10
"""Steps in a block in which the slip velocity may change its sign."""
MOST_STEPS = 20_000
"""Steps in a block beyond which the motion is taken for lost."""
_TRIALS = 4
"""Newton steps for the velocity behind a connection; all but a corner take one."""
_NUDGE = 1e-6
"""[m/s] over which its slope is taken."""
_AGREED = 1e-6
"""[N] within which the two forces count as one."""

_ROW, _TABLE, _NUMBER = numba.float64[::1], numba.float64[:, ::1], numba.float64
ACT_SIGNATURE = _NUMBER(_ROW, _ROW, _ROW, _ROW)
"""Of every form's function."""
_ACT = numba.types.FunctionType(ACT_SIGNATURE)


@compiled
def _call(i: int, s: Array, now: Array, forms: Any, rate: Array) -> float:
    """What the i-th form returns; it writes the rates of its own memory."""
    start = DAMPER + 1 + i * MEMORY
    return float(forms[0][i](now, s[start : start + MEMORY], forms[2][i], rate[start : start + MEMORY]))


@compiled
def _damper_force(v: float, s: Array, now: Array, forms: Any, p: Array, rate: Array) -> tuple[float, float]:
    """Force [N] and inner velocity [m/s] of the damper at a velocity [m/s], forms beside the law included."""
    x, u = now[_X], now[_FIELD]
    now[_V] = v
    alpha, c0, c1 = at_field(p[0], p[1], u), at_field(p[6], p[7], u), at_field(p[8], p[9], u)
    beside = 0.0
    for i in range(MOST_FORMS):
        if forms[1][i] == _SCALE:
            factor, weights = _call(i, s, now, forms, rate), forms[3][i]
            alpha, c0, c1 = alpha * factor ** weights[0], c0 * factor ** weights[1], c1 * factor ** weights[2]
        elif forms[1][i] == _PARALLEL:
            beside += _call(i, s, now, forms, rate)
    y_rate = inner_velocity(x, v, s[Y], s[Z], alpha, c0, c1, p[10])
    return float(damper_force(y_rate, x, c1, p[11], p[13]) + beside), float(y_rate)


@compiled
def _carried(v: float, s: Array, now: Array, forms: Any, rate: Array) -> float:
    """Force [N] of the connection while the damper moves at v [m/s]."""
    now[_STRETCH], now[_STRETCH_RATE] = s[POSITION] - s[DAMPER], s[SPEED] - v
    for i in range(MOST_FORMS):
        if forms[1][i] == _CONNECTION:
            return _call(i, s, now, forms, rate)
    return 0.0


@compiled
def _velocity_behind(s: Array, now: Array, forms: Any, p: Array, rate: Array) -> float:
    """Velocity [m/s] of the damper at which it resists with just the force that its connection carries."""
    v = now[_V]
    for _ in range(_TRIALS):
        short = _carried(v, s, now, forms, rate) - _damper_force(v, s, now, forms, p, rate)[0]
        if abs(short) < _AGREED:
            break
        ahead = v + _NUDGE
        more = _carried(ahead, s, now, forms, rate) - _damper_force(ahead, s, now, forms, p, rate)[0]
        v -= short * _NUDGE / (more - short)
    return float(v)


@compiled
def rates(
    s: Array, time: float, command: float, drive: float, now: Array, forms: Any, k: Array, p: Array, rate: Array
) -> tuple[float, float]:
    """Rates of all states, written to ``rate``.

    Args:
        s: (STATES,) the states.
        time: [s] since the start.
        command: [m] commanded displacement now.
        drive: [V or A] commanded drive.
        now: (NOW,) what the forms see; kept from call to call as a first guess.
        forms: functions, places (3,), values (3, VALUES), weights (3, 3).
        k: (CONSTANTS,) constants of actuator, amplifier and heat.
        p: (14,) the parameters of the law in the paper's order.
        rate: (STATES,) the answer.

    Returns:
        Force that the channel passes on [N] and slip velocity [m/s].
    """
    now[_TIME], now[_OUTPUT], now[_PATH] = time, s[OUTPUT], s[PATH]
    rate[FIELD] = field_rate(s[FIELD], s[OUTPUT], p[4])
    now[_FIELD], now[_FIELD_RATE] = s[FIELD], rate[FIELD]
    for i in range(MOST_FORMS):
        if forms[1][i] == _COIL:
            now[_FIELD] = _call(i, s, now, forms, rate)
    v = s[SPEED]
    now[_X] = s[POSITION]
    if k[CONNECTED] != 0.0:
        now[_X] = s[DAMPER]
        v = _velocity_behind(s, now, forms, p, rate)
    force, y_rate = _damper_force(v, s, now, forms, p, rate)
    now[_POWER] = abs(force * v)
    _servo(s, command, force, k, rate)
    rate[Y], rate[PATH], rate[DAMPER] = y_rate, abs(v), v
    rate[Z] = hysteresis_rate(v - y_rate, s[Z], p[5], p[2], p[3], p[12])
    rate[OUTPUT] = k[AMPLIFIER] * (drive - s[OUTPUT])
    heat = now[_POWER] + k[COIL] * s[OUTPUT] * s[OUTPUT]
    rate[TEMPERATURE] = (heat - k[HEAT_LOSS] * (s[TEMPERATURE] - k[AMBIENT])) / k[HEAT_CAPACITY]
    now[_ACCELERATION] = rate[SPEED]
    return _passed_on(force, s, now, forms, rate), v - y_rate


@compiled
def _servo(s: Array, command: float, force: float, k: Array, rate: Array) -> None:
    """Rates of the actuator under a load [N]."""
    rate[COMMAND] = k[LAG] * (command - s[COMMAND])
    rate[POSITION] = s[SPEED]
    error = s[COMMAND] - s[POSITION] - k[COMPLIANCE] * force
    rate[SPEED] = k[SERVO] * (k[SERVO] * error - 2.0 * k[DAMPING] * s[SPEED])


@compiled
def _passed_on(force: float, s: Array, now: Array, forms: Any, rate: Array) -> float:
    """What the force channel makes of the damper's force and of what else the cell feels [N]."""
    # Whatever the cell feels comes first: the channel makes its own of all of that.
    now[_FORCE] = force
    for i in range(MOST_FORMS):
        if forms[1][i] == _CELL:
            now[_FORCE] += _call(i, s, now, forms, rate)
    for i in range(MOST_FORMS):
        if forms[1][i] == _CHANNEL:
            now[_FORCE] = _call(i, s, now, forms, rate)
    return float(now[_FORCE])


@compiled
def _steps_for(s: Array, rate: Array, slip: float, drive: float, h: float, k: Array, p: Array) -> float:
    """Steps that a block of h [s] needs for stability, and for accuracy where the loop turns."""
    turn = 2.0 * abs(rate[SPEED]) * h + 2e-4 * k[CONNECTED]
    fastest = abs(slip) + turn
    c0, c1 = abs(at_field(p[6], p[7], s[FIELD])), abs(at_field(p[8], p[9], s[FIELD]))
    tangent = 2.0 * abs(at_field(p[0], p[1], s[FIELD])) * p[5] + abs(p[10])
    stiff = p[12] * fastest * p[5] / k[SATURATED] + tangent / (c0 + c1) + k[FASTEST]
    stiff += k[SERVO] * math.sqrt(k[COMPLIANCE] * (tangent + abs(p[11])))
    stiff += k[CONNECTED] * max(tangent * (c0 + c1) / (c0 * c1), k[CONTACT])
    if s[OUTPUT] != drive:
        stiff += k[AMPLIFIER]
    steps = math.ceil(stiff * h / STABLE)
    return float(max(steps, CORNER_STEPS if abs(slip) <= turn else 1, 1))


@compiled
def _step(
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
    """One classical Runge-Kutta step of h [s], in place; the command goes straight from start to end [m]."""
    a, b, c, d, mid = work[0], work[1], work[2], work[3], work[4]
    half = 0.5 * (start + end)
    rates(s, time, start, drive, now, forms, k, p, a)
    for j in range(STATES):
        mid[j] = s[j] + 0.5 * h * a[j]
    rates(mid, time + 0.5 * h, half, drive, now, forms, k, p, b)
    for j in range(STATES):
        mid[j] = s[j] + 0.5 * h * b[j]
    rates(mid, time + 0.5 * h, half, drive, now, forms, k, p, c)
    for j in range(STATES):
        mid[j] = s[j] + h * c[j]
    rates(mid, time + h, end, drive, now, forms, k, p, d)
    for j in range(STATES):
        s[j] += h / 6.0 * (a[j] + 2.0 * (b[j] + c[j]) + d[j])


def _march(
    s: Array,
    now: Array,
    time: float,
    command: Array,
    drive: Array,
    h: float,
    blocks: int,
    k: Array,
    p: Array,
    first: Any,
    second: Any,
    third: Any,
    places: Any,
    values: Array,
    weights: Array,
    forces: Array,
    positions: Array,
    outputs: Array,
    damper: Array,
    states: Array,
) -> int:
    """Move the states on through M command samples, in place.

    Args:
        s: (STATES,) states at the first instant.
        now: (NOW,) what the forms see.
        time: [s] of the first instant.
        command: (M+1,) commanded displacement [m] at the start of each sample and the end of the last.
        drive: (M,) commanded drive [V or A], held through each sample.
        h: [s] one block; ``blocks`` of them make a sample.
        k, p: as in ``rates``.
        first, second, third: functions of the forms.
        places, values, weights: (3,), (3, VALUES) and (3, 3) of the forms.
        forces, positions: (M blocks,) filled with what the force channel passes on [N] and the actuator's
            position [m], at the start of each block.
        outputs: (M,) filled with the amplifier's output half way through each sample.
        damper: (M, 2) filled with displacement [m] and velocity [m/s] of the damper at each sample.
        states: (M, STATES) filled with the states at each sample.

    Returns:
        The sample in which the motion was lost, or M.
    """
    work, rate = np.zeros((5, STATES)), np.zeros(STATES)
    forms = ((first, second, third), places, values, weights)
    for i in range(len(drive)):
        states[i] = s
        for j in range(blocks):
            start = command[i] + (command[i + 1] - command[i]) * j / blocks
            end = command[i] + (command[i + 1] - command[i]) * (j + 1) / blocks
            instant = time + (i * blocks + j) * h
            # An output that has all but arrived would ask for fine steps for ever.
            if abs(drive[i] - s[OUTPUT]) < 1e-7 * (abs(drive[i]) + 1e-3):
                s[OUTPUT] = drive[i]
            force, slip = rates(s, instant, start, drive[i], now, forms, k, p, rate)
            forces[i * blocks + j], positions[i * blocks + j] = force, s[POSITION]
            if j == 0:
                damper[i, 0], damper[i, 1] = now[_X], rate[DAMPER]
            if j == blocks // 2:
                outputs[i] = s[OUTPUT]
            steps = _steps_for(s, rate, slip, drive[i], h, k, p)
            if not (steps <= MOST_STEPS and math.isfinite(force) and math.isfinite(s[Z])):
                return i
            for step in range(int(steps)):
                one = start + (end - start) * step / steps
                other = start + (end - start) * (step + 1) / steps
                at = instant + step * h / steps
                _step(s, at, one, other, drive[i], h / steps, now, forms, k, p, work)
    return len(drive)


_PLACES = numba.int64[::1]
march = compiled(
    _march,
    (
        *(_ROW, _ROW, _NUMBER, _ROW, _ROW, _NUMBER, numba.int64, _ROW, _ROW),
        *(_ACT, _ACT, _ACT, _PLACES, _TABLE, _TABLE, _ROW, _ROW, _ROW, _TABLE, _TABLE),
    ),
)
"""``_march`` compiled when first imported, once for all forms."""
