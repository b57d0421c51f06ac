"""What moves the states of actuator and specimen: the law, what stands around it, and the servo.

The law is that of ``identification.damper.law``, compiled here. The actuator is a servo: a first-order lag of the
command, then a second-order loop about it which the force on the rod deflects by force / stiffness. It is
integrated in the same steps as the specimen, so that displacement, velocity and acceleration are continuous
between command samples.
"""

from identification.damper.effects import connection
from sim_rig.compiled import Array, OfFour, OfTwo, Scales, compiled, inlined
from sim_rig.compiled_law import at_field, damper_force, field_rate, hysteresis_rate, inner_velocity
from sim_rig.states import (
    AMBIENT,
    AMPLIFIER,
    BEHIND,
    BENT,
    BRISTLES,
    COIL,
    COMMAND,
    COMPLIANCE,
    COOLING,
    DAMPING,
    DEAD_TIME,
    ENERGY,
    EXCHANGE,
    FIELD,
    FILM,
    FOLLOWED,
    GAP,
    GIVE,
    HARDENING,
    HEAT_CAPACITY,
    HEAT_LOSS,
    INSIDE,
    LAG,
    LAGGED,
    LAYERS,
    MASS,
    OUTPUT,
    PLAY,
    POSITION,
    SECOND_LAG,
    SERVO,
    SLOW_PART,
    SPEED,
    TEMPERATURE,
    TWICE,
    Y,
    Z,
)

_BALANCED = 1e-9
"""[m/s] to which the velocity of the damper behind its fixture is found."""
AHEAD = 1e-6
"""[s] how far the mounting looks ahead to tell whether it carries the damper along."""

carried = compiled(connection.carried)


@compiled
def _damper_motion(position: float, speed: float, held: float, play: float, follow: OfTwo) -> tuple[float, float]:
    """Displacement [m] and velocity [m/s] of the damper behind its mounting; it stood at ``held`` [m]."""
    if play == 0.0:
        return position, speed
    x = follow(held, position)
    return x, (follow(x, position + speed * AHEAD) - x) / AHEAD


@compiled
def _damper_force(
    s: Array, x: float, v: float, u: float, p: Array, parallel: OfFour, scales: Scales
) -> tuple[float, float]:
    """Force of the damper [N] and y' [m/s] at displacement x [m], velocity v [m/s] and the field seen."""
    a, b, c = scales(x, v, s[ENERGY])
    alpha, c0, c1 = a * at_field(p[0], p[1], u), b * at_field(p[6], p[7], u), c * at_field(p[8], p[9], u)
    y_rate = inner_velocity(x, v, s[Y], s[Z], alpha, c0, c1, p[10])
    return damper_force(y_rate, x, c1, p[11], p[13]) + parallel(x, v, s[BENT], s[FOLLOWED]), y_rate


@inlined
def _excess(
    v: float, s: Array, load: float, film: float, u: float, p: Array, parallel: OfFour, scales: Scales
) -> float:
    """Force [N] by which damper and film, at a velocity [m/s], resist more than the load of the fixture."""
    return _damper_force(s, s[BEHIND], v, u, p, parallel, scales)[0] + film * v - load


@compiled
def _balanced_velocity(
    s: Array, load: float, film: float, guess: float, u: float, p: Array, parallel: OfFour, scales: Scales
) -> float:
    """Velocity [m/s] at which damper and film resist with the load [N] of the fixture, by brackets and secants."""
    width = 1e-3
    low, high = guess - width, guess + width
    below = _excess(low, s, load, film, u, p, parallel, scales)
    above = _excess(high, s, load, film, u, p, parallel, scales)
    for _ in range(60):
        if below <= 0.0 <= above:
            break
        width *= 2.0
        if below > 0.0:
            high, above, low = low, below, low - width
            below = _excess(low, s, load, film, u, p, parallel, scales)
        else:
            low, below, high = high, above, high + width
            above = _excess(high, s, load, film, u, p, parallel, scales)
    side = 0
    for _ in range(60):
        v = high - above * (high - low) / (above - below) if above != below else 0.5 * (low + high)
        rest = _excess(v, s, load, film, u, p, parallel, scales)
        if high - low < _BALANCED or abs(rest) < 1e-9:
            break
        # An end that has stayed twice counts half, so that the bracket closes from both sides (Illinois).
        if rest > 0.0:
            high, above = v, rest
            below = 0.5 * below if side == 1 else below
            side = 1
        else:
            low, below = v, rest
            above = 0.5 * above if side == -1 else above
            side = -1
    return v


@compiled
def _move_actuator(s: Array, command: float, force: float, k: Array, rate: Array) -> None:
    """Rates of the actuator under the force [N] of the damper; the mass at the rod is moved along."""
    rate[COMMAND] = k[LAG] * (command - s[COMMAND])
    rate[POSITION] = s[SPEED]
    error = s[COMMAND] - s[POSITION] - k[COMPLIANCE] * force
    wanted = k[SERVO] * (k[SERVO] * error - 2.0 * k[DAMPING] * s[SPEED])
    # The mass's force, too, holds the rod back, and is this very rate times the mass: solved for it.
    rate[SPEED] = wanted / (1.0 + k[SERVO] * k[SERVO] * k[COMPLIANCE] * k[MASS])


@compiled
def _drive_coil(s: Array, drive: float, late: float, eta: float, k: Array, rate: Array) -> None:
    """Rates from the amplifier's output through the second lag to the field."""
    rate[OUTPUT] = k[AMPLIFIER] * (drive - s[OUTPUT])
    source = late if k[DEAD_TIME] > 0.0 else s[OUTPUT]
    rate[LAGGED] = k[SECOND_LAG] * (source - s[LAGGED])
    rate[TWICE] = k[SECOND_LAG] * (s[LAGGED] - s[TWICE])
    slow = k[SLOW_PART] if k[SECOND_LAG] > 0.0 else 0.0
    behind = s[TWICE] if k[LAYERS] > 1.0 else s[LAGGED]
    rate[FIELD] = field_rate(s[FIELD], source + slow * (behind - source), eta)


@compiled
def _heat(s: Array, power: float, k: Array, rate: Array) -> None:
    """Rates of energy and temperature of a damper that takes up a power [W]."""
    rate[ENERGY] = power - k[COOLING] * s[ENERGY]
    heat = power + k[COIL] * s[OUTPUT] * s[OUTPUT]
    rate[TEMPERATURE] = (heat - k[HEAT_LOSS] * (s[TEMPERATURE] - k[AMBIENT])) / k[HEAT_CAPACITY]


@compiled
def rates(
    s: Array,
    held: float,
    remembered: float,
    command: float,
    drive: float,
    late: float,
    k: Array,
    p: Array,
    follow: OfTwo,
    parallel: OfFour,
    seen: OfTwo,
    scales: Scales,
    rate: Array,
) -> tuple[float, float, float, float]:
    """Rates of all states, written to ``rate``.

    Args:
        s: (STATES,) the states.
        held: [m] where the damper stood when the step began.
        remembered: what the iron remembered then.
        command: [m] commanded displacement now.
        drive: [V or A] commanded drive.
        late: [V or A] output as it reaches the coil after its dead time.
        k: (CONSTANTS,) constants of actuator, amplifier, coil, heat and mounting.
        p: (14,) the parameters of the law in the paper's order.
        follow: displacement of the damper over (held, actuator) [m].
        parallel: force beside the law [N] over (displacement [m], velocity [m/s], bend of a lip [1], displacement
            that follows [m]).
        seen: field that the damper sees over (field, remembered) [V or A].
        scales: factors of alpha, c0 and c1 over displacement, velocity and energy.
        rate: (STATES,) the answer.

    Returns:
        Force on the load cell [N], displacement [m], velocity [m/s] and slip velocity [m/s] of the damper.
    """
    x, v = _damper_motion(s[POSITION], s[SPEED], held, k[PLAY], follow)
    u = seen(s[FIELD], remembered)
    if k[GIVE] > 0.0:
        load = carried(x - s[BEHIND], k[GIVE], k[GAP], k[HARDENING], k[INSIDE])
        x, load, film = s[BEHIND], load + k[FILM] * v, k[FILM]
        v = _balanced_velocity(s, load, film, v, u, p, parallel, scales)
        force, y_rate = _damper_force(s, x, v, u, p, parallel, scales)
        force = load - film * v
    else:
        force, y_rate = _damper_force(s, x, v, u, p, parallel, scales)
    slip = v - y_rate
    rate[Y], rate[BEHIND] = y_rate, v
    rate[Z] = hysteresis_rate(slip, s[Z], p[5], p[2], p[3], p[12])
    rate[BENT] = k[BRISTLES] * (v - abs(v) * s[BENT])
    rate[FOLLOWED] = k[EXCHANGE] * (x - s[FOLLOWED])
    _move_actuator(s, command, force, k, rate)
    _drive_coil(s, drive, late, p[4], k, rate)
    _heat(s, abs(force * v), k, rate)
    return force + k[MASS] * rate[SPEED], x, v, slip
