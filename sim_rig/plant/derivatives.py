"""Time derivatives of the states of the plant: the damper's law with its effects, on the actuator.

The law is that of ``identification.damper.law``, compiled. The actuator is integrated in the same steps as the
specimen, so that displacement, velocity and acceleration are continuous between command samples.
"""

import math

from identification.damper.effects import connection
from sim_rig.plant.defined_effects import (
    FIELD_PLACE,
    FORCE_PLACE,
    GAIN_PLACE,
    MOUNTING_PLACE,
    DefinedFunctions,
    evaluate,
    improve_acceleration,
    set_variables,
    set_velocity,
)
from sim_rig.plant.jit import (
    Array,
    BinaryFunction,
    QuaternaryFunction,
    ScaleFunction,
    compile_function,
    compile_inline,
)
from sim_rig.plant.law import (
    compute_force,
    compute_hysteresis_rate,
    compute_inner_velocity,
    evaluate_coefficient,
)
from sim_rig.plant.rig_rates import compute_actuator_rates, compute_coil_rates, compute_heat_rates
from sim_rig.plant.states import (
    BACKLASH,
    BRISTLE_RATE,
    CONSTANT_COUNT,
    DAMPER,
    ENERGY,
    FIELD,
    FILM_DAMPING,
    FIXTURE_COMPLIANCE,
    GAP,
    GAS_POSITION,
    HARDENING,
    HEAT_EXCHANGE_RATE,
    IN_GAP_STIFFNESS,
    LIP_BEND,
    MASS,
    PEAK_RATIO,
    POSITION,
    STRIBECK_SPEED,
    VELOCITY,
    Y,
    Z,
)

_VELOCITY_TOLERANCE = 1e-9
"""[m/s] tolerance of the velocity of the damper behind a compliant fixture."""
LOOKAHEAD = 1e-6
"""[s] time over which the mounting looks ahead to determine whether it moves the damper."""

_compute_transmitted_force = compile_function(connection.compute_transmitted_force)
_interpolate_force = compile_function(connection.interpolate_force)


@compile_function
def _compute_spring_force(elongation: float, k: Array) -> float:
    """Return the force of the mounting [N] at an elongation [m], without that of its film."""
    if len(k) > CONSTANT_COUNT:
        return float(_interpolate_force(elongation, k, CONSTANT_COUNT)[0])
    return float(
        _compute_transmitted_force(elongation, k[FIXTURE_COMPLIANCE], k[GAP], k[HARDENING], k[IN_GAP_STIFFNESS])
    )


@compile_function
def _compute_damper_motion(
    position: float, velocity: float, last: float, backlash: float, backlash_map: BinaryFunction
) -> tuple[float, float]:
    """Return displacement [m] and velocity [m/s] of the damper behind its mounting, from its last one [m]."""
    if backlash == 0.0:
        return position, velocity
    x = backlash_map(last, position)
    return x, (backlash_map(x, position + velocity * LOOKAHEAD) - x) / LOOKAHEAD


@compile_function
def _compute_damper_force(
    s: Array,
    x: float,
    v: float,
    u: float,
    p: Array,
    parallel_force: QuaternaryFunction,
    scale_factors: ScaleFunction,
    defined: DefinedFunctions | None,
) -> tuple[float, float]:
    """Return the damper's force [N] and y' [m/s] at displacement x [m], velocity v [m/s] and field u [V or A]."""
    a, b, c = scale_factors(x, v, s[ENERGY])
    force = parallel_force(x, v, s[LIP_BEND], s[GAS_POSITION])
    if defined is not None:
        set_velocity(defined, v)
        gain = evaluate(defined, GAIN_PLACE)
        a, b, c = gain * a, gain * b, gain * c
        force += evaluate(defined, FORCE_PLACE)
    alpha, c0, c1 = (
        a * evaluate_coefficient(p[0], p[1], u),
        b * evaluate_coefficient(p[6], p[7], u),
        c * evaluate_coefficient(p[8], p[9], u),
    )
    y_rate = compute_inner_velocity(x, v, s[Y], s[Z], alpha, c0, c1, p[10])
    return compute_force(y_rate, x, c1, p[11], p[13]) + force, y_rate


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
    defined: DefinedFunctions | None,
) -> float:
    """Return the force [N] of damper and film at a velocity [m/s], minus the load of the fixture."""
    return (
        _compute_damper_force(s, s[DAMPER], v, u, p, parallel_force, scale_factors, defined)[0]
        + film_damping * v
        - load
    )


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
    defined: DefinedFunctions | None,
) -> float:
    """Return the velocity [m/s] at which damper and film balance the load [N], by bracketed secants (Illinois)."""
    width = 1e-3
    low, high = guess - width, guess + width
    below = _compute_imbalance(low, s, load, film_damping, u, p, parallel_force, scale_factors, defined)
    above = _compute_imbalance(high, s, load, film_damping, u, p, parallel_force, scale_factors, defined)
    for _ in range(60):
        if below <= 0.0 <= above:
            break
        width *= 2.0
        if below > 0.0:
            high, above, low = low, below, low - width
            below = _compute_imbalance(low, s, load, film_damping, u, p, parallel_force, scale_factors, defined)
        else:
            low, below, high = high, above, high + width
            above = _compute_imbalance(high, s, load, film_damping, u, p, parallel_force, scale_factors, defined)
    side = 0
    for _ in range(60):
        v = high - above * (high - low) / (above - below) if above != below else 0.5 * (low + high)
        imbalance = _compute_imbalance(v, s, load, film_damping, u, p, parallel_force, scale_factors, defined)
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
def _balance_mounting(
    s: Array,
    driven_x: float,
    driven_v: float,
    u: float,
    k: Array,
    p: Array,
    parallel_force: QuaternaryFunction,
    scale_factors: ScaleFunction,
    defined: DefinedFunctions | None,
) -> tuple[float, float, float]:
    """Return force [N], velocity [m/s] and y' [m/s] of the damper behind a compliant fixture.

    ``driven_x`` [m] and ``driven_v`` [m/s] are the motion at the fixture's other end.
    """
    load = _compute_spring_force(driven_x - s[DAMPER], k)
    load, film_damping = load + k[FILM_DAMPING] * driven_v, k[FILM_DAMPING]
    v = _solve_velocity(s, load, film_damping, driven_v, u, p, parallel_force, scale_factors, defined)
    y_rate = _compute_damper_force(s, s[DAMPER], v, u, p, parallel_force, scale_factors, defined)[1]
    return load - film_damping * v, v, y_rate


@compile_function
def _compute_lip_rate(v: float, deflection: float, k: Array) -> float:
    """Return the rate of a lip's deflection [1/s]; sticking, it bends further than in fast sliding."""
    limit = 1.0 + k[PEAK_RATIO] * math.exp(-((v / k[STRIBECK_SPEED]) ** 2))
    return float(k[BRISTLE_RATE] * (v - abs(v) * deflection / limit))


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
    backlash_map: BinaryFunction,
    parallel_force: QuaternaryFunction,
    field_map: BinaryFunction,
    scale_factors: ScaleFunction,
    rate: Array,
    defined: DefinedFunctions | None = None,
    time: float = 0.0,
) -> tuple[float, float, float, float]:
    """Write the rates of all states to ``rate``.

    Args:
        s: (STATE_COUNT,) states.
        last_damper: [m] displacement of the damper at the start of the step.
        remanence: [V or A] of the iron at the start of the step.
        command: [m] commanded displacement now.
        drive: [V or A] commanded drive.
        delayed_output: [V or A] amplifier output as it reaches the coil after the dead time.
        k: (CONSTANT_COUNT,) constants of actuator, amplifier, coil, heat and mounting, then a table of this.
        p: (14,) parameters of the law in the paper's order.
        backlash_map: displacement of the damper over (its last one, actuator) [m].
        parallel_force: [N] over displacement [m], velocity [m/s], deflection of a lip [1] and gas position [m].
        field_map: field that the fluid sees over (field, remanence) [V or A].
        scale_factors: factors of alpha, c0 and c1 over displacement, velocity and energy.
        rate: (STATE_COUNT,) result.
        defined: functions of defined effects; with None, their code is not compiled.
        time: [s] since the start of the run, for defined effects.

    Returns:
        Force on the load cell [N], displacement [m], velocity [m/s] and slip velocity [m/s] of the damper.
    """
    driven_x, driven_v = _compute_damper_motion(s[POSITION], s[VELOCITY], last_damper, k[BACKLASH], backlash_map)
    compliant = k[FIXTURE_COMPLIANCE] > 0.0
    x, v, u = s[DAMPER] if compliant else driven_x, driven_v, field_map(s[FIELD], remanence)
    passes, mounting_force = 1, 0.0
    if defined is not None:
        set_variables(defined, x, u, s[ENERGY], time)
        u += evaluate(defined, FIELD_PLACE)
        passes = defined.passes
    for i in range(passes):
        if compliant:
            force, v, y_rate = _balance_mounting(
                s, driven_x, driven_v, u, k, p, parallel_force, scale_factors, defined
            )
        else:
            force, y_rate = _compute_damper_force(s, x, v, u, p, parallel_force, scale_factors, defined)
        if defined is not None:
            mounting_force = evaluate(defined, MOUNTING_PLACE)
        compute_actuator_rates(s, command, force + mounting_force, k, rate)
        if defined is not None:
            improve_acceleration(defined, rate[VELOCITY], i == 0)
    slip = v - y_rate
    rate[Y], rate[DAMPER] = y_rate, v
    rate[Z] = compute_hysteresis_rate(slip, s[Z], p[5], p[2], p[3], p[12])
    rate[LIP_BEND] = _compute_lip_rate(v, s[LIP_BEND], k) if k[BRISTLE_RATE] > 0.0 else 0.0
    rate[GAS_POSITION] = k[HEAT_EXCHANGE_RATE] * (x - s[GAS_POSITION])
    compute_coil_rates(s, drive, delayed_output, p[4], k, defined, rate)
    compute_heat_rates(s, abs(force * v), k, rate)
    return force + mounting_force + k[MASS] * rate[VELOCITY], x, v, slip
