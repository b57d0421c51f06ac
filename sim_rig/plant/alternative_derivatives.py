"""Time derivatives of the states of the plant with alternative forms: law, forms, mounting and servo.

There are the states of actuator, law and amplifier, the damper's own displacement behind a compliant mounting, and
the states of at most three forms. The damper's velocity is the one at which the forces of mounting and damper are
equal. The inertia of a mass at the load cell does not act on the actuator. The actuator's own moving mass
(stiffness over squared bandwidth) is about 300 kg.
"""

from typing import Any

from sim_rig.effect_forms import MAX_STATES, Place, form
from sim_rig.plant.alternative_states import (
    COMMAND,
    DAMPER,
    FIELD,
    HAS_MOUNTING,
    MAX_FORMS,
    OUTPUT,
    PATH,
    POSITION,
    TEMPERATURE,
    VELOCITY,
    Y,
    Z,
)
from sim_rig.plant.jit import Array, compile_function, compile_inline
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

_NEWTON_STEPS = 4
"""Largest number of Newton steps for the velocity behind a mounting; one is enough except at corners."""
_VELOCITY_INCREMENT = 1e-6
"""[m/s] increment of the finite difference for the Newton slope."""
_FORCE_TOLERANCE = 1e-6
"""[N] difference up to which the two forces count as equal."""


@compile_inline
def _evaluate_form(i: int, s: Array, now: Array, forms: Any, rate: Array) -> float:
    """Evaluate the i-th form, which writes the rates of its own states."""
    start = DAMPER + 1 + i * MAX_STATES
    return float(forms[0][i](now, s[start : start + MAX_STATES], forms[2][i], rate[start : start + MAX_STATES]))


@compile_inline
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


@compile_inline
def _compute_mounting_force(v: float, s: Array, now: Array, forms: Any, rate: Array) -> float:
    """Return the force [N] of the mounting while the damper moves at v [m/s]."""
    now[_ELONGATION], now[_ELONGATION_RATE] = s[POSITION] - s[DAMPER], s[VELOCITY] - v
    for i in range(MAX_FORMS):
        if forms[1][i] == _MOUNTING_PLACE:
            return _evaluate_form(i, s, now, forms, rate)
    return 0.0


@compile_inline
def _balance_mounting(s: Array, now: Array, forms: Any, p: Array, rate: Array) -> tuple[float, float, float]:
    """Return the velocity [m/s] at which damper and mounting have equal forces; force and inner velocity there."""
    v = now[_V]
    for _ in range(_NEWTON_STEPS):
        mounting_force = _compute_mounting_force(v, s, now, forms, rate)
        force, y_rate = _compute_damper_force(v, s, now, forms, p, rate)
        imbalance = mounting_force - force
        if abs(imbalance) < _FORCE_TOLERANCE:
            return float(v), force, y_rate
        shifted = v + _VELOCITY_INCREMENT
        shifted_imbalance = (
            _compute_mounting_force(shifted, s, now, forms, rate)
            - _compute_damper_force(shifted, s, now, forms, p, rate)[0]
        )
        v -= imbalance * _VELOCITY_INCREMENT / (shifted_imbalance - imbalance)
    force, y_rate = _compute_damper_force(v, s, now, forms, p, rate)
    return float(v), force, y_rate


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
    if k[HAS_MOUNTING] != 0.0:
        now[_X] = s[DAMPER]
        v, force, y_rate = _balance_mounting(s, now, forms, p, rate)
    else:
        now[_X], v = s[POSITION], s[VELOCITY]
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
