"""Time derivatives of the states of the plant: the damper's law, its effects and the servo.

The law is that of ``identification.damper.law``, compiled. The actuator is a servo: a first-order lag of the
command, followed by a second-order position loop that the force on the rod deflects by force / stiffness. It is
integrated in the same steps as the specimen, so that displacement, velocity and acceleration are continuous
between command samples.
"""

from identification.damper.effects import connection
from sim_rig.plant.jit import (
    Array,
    BinaryFunction,
    QuaternaryFunction,
    ScaleFunction,
    compile_function,
    compile_inline,
)
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
    BACKLASH,
    BRISTLE_RATE,
    COIL_HEAT,
    COMMAND,
    COMMAND_LAG,
    COOLING_RATE,
    DAMPER,
    DEAD_TIME,
    ENERGY,
    FIELD,
    FILM_DAMPING,
    FIXTURE_COMPLIANCE,
    GAP,
    GAS_POSITION,
    HARDENING,
    HEAT_CAPACITY,
    HEAT_EXCHANGE_RATE,
    HEAT_LOSS,
    IN_GAP_STIFFNESS,
    LAG_COUNT,
    LAGGED,
    LAGGED_FRACTION,
    LAGGED_TWICE,
    LIP_BEND,
    MASS,
    OUTPUT,
    POSITION,
    SECOND_LAG_RATE,
    SERVO_BANDWIDTH,
    SERVO_DAMPING,
    TEMPERATURE,
    VELOCITY,
    Y,
    Z,
)

_VELOCITY_TOLERANCE = 1e-9
"""[m/s] tolerance of the velocity of the damper behind a compliant fixture."""
LOOKAHEAD = 1e-6
"""[s] time over which the mounting looks ahead to determine whether it moves the damper."""

compute_transmitted_force = compile_function(connection.compute_transmitted_force)


@compile_function
def _compute_damper_motion(
    position: float, velocity: float, last: float, backlash: float, follower: BinaryFunction
) -> tuple[float, float]:
    """Return displacement [m] and velocity [m/s] of the damper behind its mounting, from its last one [m]."""
    if backlash == 0.0:
        return position, velocity
    x = follower(last, position)
    return x, (follower(x, position + velocity * LOOKAHEAD) - x) / LOOKAHEAD


@compile_function
def _compute_damper_force(
    s: Array,
    x: float,
    v: float,
    u: float,
    p: Array,
    parallel_force: QuaternaryFunction,
    scale_factors: ScaleFunction,
) -> tuple[float, float]:
    """Return the damper's force [N] and y' [m/s] at displacement x [m], velocity v [m/s] and field u [V or A]."""
    a, b, c = scale_factors(x, v, s[ENERGY])
    alpha, c0, c1 = (
        a * evaluate_coefficient(p[0], p[1], u),
        b * evaluate_coefficient(p[6], p[7], u),
        c * evaluate_coefficient(p[8], p[9], u),
    )
    y_rate = compute_inner_velocity(x, v, s[Y], s[Z], alpha, c0, c1, p[10])
    return compute_force(y_rate, x, c1, p[11], p[13]) + parallel_force(x, v, s[LIP_BEND], s[GAS_POSITION]), y_rate


@compile_inline
def _compute_imbalance(
    v: float,
    s: Array,
    load: float,
    film_damping: float,
    u: float,
    p: Array,
    parallel_force: QuaternaryFunction,
    scale_factors: ScaleFunction,
) -> float:
    """Return the force [N] of damper and film at a velocity [m/s], minus the load of the fixture."""
    return _compute_damper_force(s, s[DAMPER], v, u, p, parallel_force, scale_factors)[0] + film_damping * v - load


@compile_function
def _solve_velocity(
    s: Array,
    load: float,
    film_damping: float,
    guess: float,
    u: float,
    p: Array,
    parallel_force: QuaternaryFunction,
    scale_factors: ScaleFunction,
) -> float:
    """Return the velocity [m/s] at which damper and film balance the load [N], by bracketed secants (Illinois)."""
    width = 1e-3
    low, high = guess - width, guess + width
    below = _compute_imbalance(low, s, load, film_damping, u, p, parallel_force, scale_factors)
    above = _compute_imbalance(high, s, load, film_damping, u, p, parallel_force, scale_factors)
    for _ in range(60):
        if below <= 0.0 <= above:
            break
        width *= 2.0
        if below > 0.0:
            high, above, low = low, below, low - width
            below = _compute_imbalance(low, s, load, film_damping, u, p, parallel_force, scale_factors)
        else:
            low, below, high = high, above, high + width
            above = _compute_imbalance(high, s, load, film_damping, u, p, parallel_force, scale_factors)
    side = 0
    for _ in range(60):
        v = high - above * (high - low) / (above - below) if above != below else 0.5 * (low + high)
        imbalance = _compute_imbalance(v, s, load, film_damping, u, p, parallel_force, scale_factors)
        if high - low < _VELOCITY_TOLERANCE or abs(imbalance) < 1e-9:
            break
        # An end that stayed twice is weighted by half, so that the bracket closes from both sides (Illinois).
        if imbalance > 0.0:
            high, above = v, imbalance
            below = 0.5 * below if side == 1 else below
            side = 1
        else:
            low, below = v, imbalance
            above = 0.5 * above if side == -1 else above
            side = -1
    return v


@compile_function
def _compute_actuator_rates(s: Array, command: float, force: float, k: Array, rate: Array) -> None:
    """Write the rates of the actuator under the force [N] of the damper and the mass at the rod."""
    rate[COMMAND] = k[COMMAND_LAG] * (command - s[COMMAND])
    rate[POSITION] = s[VELOCITY]
    error = s[COMMAND] - s[POSITION] - k[ACTUATOR_COMPLIANCE] * force
    unloaded = k[SERVO_BANDWIDTH] * (k[SERVO_BANDWIDTH] * error - 2.0 * k[SERVO_DAMPING] * s[VELOCITY])
    # The force of the mass also deflects the rod and is this rate times the mass: solved for the rate.
    rate[VELOCITY] = unloaded / (1.0 + k[SERVO_BANDWIDTH] * k[SERVO_BANDWIDTH] * k[ACTUATOR_COMPLIANCE] * k[MASS])


@compile_function
def _compute_coil_rates(s: Array, drive: float, delayed_output: float, eta: float, k: Array, rate: Array) -> None:
    """Write the rates from the amplifier's output through the second lag to the field."""
    rate[OUTPUT] = k[AMPLIFIER_RATE] * (drive - s[OUTPUT])
    source = delayed_output if k[DEAD_TIME] > 0.0 else s[OUTPUT]
    rate[LAGGED] = k[SECOND_LAG_RATE] * (source - s[LAGGED])
    rate[LAGGED_TWICE] = k[SECOND_LAG_RATE] * (s[LAGGED] - s[LAGGED_TWICE])
    fraction = k[LAGGED_FRACTION] if k[SECOND_LAG_RATE] > 0.0 else 0.0
    lagged = s[LAGGED_TWICE] if k[LAG_COUNT] > 1.0 else s[LAGGED]
    rate[FIELD] = compute_field_rate(s[FIELD], source + fraction * (lagged - source), eta)


@compile_function
def _compute_heat_rates(s: Array, power: float, k: Array, rate: Array) -> None:
    """Write the rates of energy and temperature of a damper that dissipates a power [W]."""
    rate[ENERGY] = power - k[COOLING_RATE] * s[ENERGY]
    heat = power + k[COIL_HEAT] * s[OUTPUT] * s[OUTPUT]
    rate[TEMPERATURE] = (heat - k[HEAT_LOSS] * (s[TEMPERATURE] - k[AMBIENT])) / k[HEAT_CAPACITY]


@compile_function
def compute_rates(
    s: Array,
    last_damper: float,
    remanence: float,
    command: float,
    drive: float,
    delayed_output: float,
    k: Array,
    p: Array,
    follower: BinaryFunction,
    parallel_force: QuaternaryFunction,
    field_map: BinaryFunction,
    scale_factors: ScaleFunction,
    rate: Array,
) -> tuple[float, float, float, float]:
    """Write the rates of all states to ``rate``.

    Args:
        s: (STATE_COUNT,) states.
        last_damper: [m] displacement of the damper at the start of the step.
        remanence: [V or A] of the iron at the start of the step.
        command: [m] commanded displacement now.
        drive: [V or A] commanded drive.
        delayed_output: [V or A] amplifier output as it reaches the coil after the dead time.
        k: (CONSTANT_COUNT,) constants of actuator, amplifier, coil, heat and mounting.
        p: (14,) parameters of the law in the paper's order.
        follower: displacement of the damper over (its last one, actuator) [m].
        parallel_force: [N] over displacement [m], velocity [m/s], deflection of a lip [1] and gas position [m].
        field_map: field that the fluid sees over (field, remanence) [V or A].
        scale_factors: factors of alpha, c0 and c1 over displacement, velocity and energy.
        rate: (STATE_COUNT,) result.

    Returns:
        Force on the load cell [N], displacement [m], velocity [m/s] and slip velocity [m/s] of the damper.
    """
    x, v = _compute_damper_motion(s[POSITION], s[VELOCITY], last_damper, k[BACKLASH], follower)
    u = field_map(s[FIELD], remanence)
    if k[FIXTURE_COMPLIANCE] > 0.0:
        load = compute_transmitted_force(
            x - s[DAMPER], k[FIXTURE_COMPLIANCE], k[GAP], k[HARDENING], k[IN_GAP_STIFFNESS]
        )
        x, load, film_damping = s[DAMPER], load + k[FILM_DAMPING] * v, k[FILM_DAMPING]
        v = _solve_velocity(s, load, film_damping, v, u, p, parallel_force, scale_factors)
        force, y_rate = _compute_damper_force(s, x, v, u, p, parallel_force, scale_factors)
        force = load - film_damping * v
    else:
        force, y_rate = _compute_damper_force(s, x, v, u, p, parallel_force, scale_factors)
    slip = v - y_rate
    rate[Y], rate[DAMPER] = y_rate, v
    rate[Z] = compute_hysteresis_rate(slip, s[Z], p[5], p[2], p[3], p[12])
    rate[LIP_BEND] = k[BRISTLE_RATE] * (v - abs(v) * s[LIP_BEND])
    rate[GAS_POSITION] = k[HEAT_EXCHANGE_RATE] * (x - s[GAS_POSITION])
    _compute_actuator_rates(s, command, force, k, rate)
    _compute_coil_rates(s, drive, delayed_output, p[4], k, rate)
    _compute_heat_rates(s, abs(force * v), k, rate)
    return force + k[MASS] * rate[VELOCITY], x, v, slip
