"""The motion of actuator and specimen: explicit Runge-Kutta steps, as many as the stiffness asks for.

The law is that of ``identification.damper.law``, compiled here; the integrator is deliberately another one than
the implicit step that identification uses. Each command sample is cut into blocks of at most an eighth of a
millisecond, each block into equal fourth-order steps. At a reversal the hysteretic variable relaxes at some
2e4 1/s and the law has a corner where the slip velocity changes sign, so blocks near one get more steps.

The actuator is a servo: a first-order lag of the command, then a second-order loop about it which the force on
the rod deflects by force / stiffness. It is integrated in the same steps, so that displacement, velocity and
acceleration are continuous between command samples.
"""

import math

import numba
import numpy as np

from identification.damper import law
from sim_rig.compiled import OF_TWO, Array, OfTwo, compiled

STATES = 8
"""Command behind the lag [m], actuator position [m] and velocity [m/s], y [m], z [m], field u, amplifier output
[both V or A], temperature [degC]."""
COMMAND, POSITION, SPEED, Y, Z, FIELD, OUTPUT, TEMPERATURE = range(STATES)

CONSTANTS = 12
"""Rates and weights of everything but the law, in the order of the names below."""
(
    LAG,  # [1/s] rate of the command's lag
    SERVO,  # [rad/s] bandwidth of the servo
    DAMPING,  # [1] damping ratio of the servo
    COMPLIANCE,  # [m/N] deflection of the actuator under load
    AMPLIFIER,  # [1/s] rate of the drive amplifier
    HEAT_CAPACITY,  # [J/K]
    HEAT_LOSS,  # [W/K]
    AMBIENT,  # [degC]
    COIL,  # [W per squared drive] heat of the coil
    SATURATED,  # [m] z_ss, where z settles in long motion
    EVER_PRESENT,  # [1/s] fastest rate beside that of the law
    PLAY,  # 1 where the mounting holds the damper back, else 0
) = range(CONSTANTS)

STABLE = 0.8
"""[1] largest product of rate and step; the method is stable up to 2.78."""
TRAVEL = 0.015
"""[1] largest move of z in one step, as a part of its saturation."""
CORNER_STEPS = 24.0
"""Steps in a block that may hold a reversal."""
CONTACT_STEPS = 96.0
"""Steps in a block in which the mounting may begin or cease to carry the damper: its velocity jumps."""
MOST_STEPS = 2e5
"""Steps in a block beyond which the motion is taken for lost."""
_FELT = 1e-7
"""[1] least move of z, as a part of its saturation, for which a corner is worth the steps."""
_SETTLED = 1e-7
"""[1] part of the drive within which the amplifier's output counts as settled and costs no more steps."""
_AHEAD = 1e-6
"""[s] how far the mounting looks ahead to tell whether it carries the damper along."""

at_field = compiled(law.at_field)
field_rate = compiled(law.field_rate)
inner_velocity = compiled(law.inner_velocity)
hysteresis_rate = compiled(law.hysteresis_rate)
damper_force = compiled(law.force)


@compiled
def _damper_motion(position: float, speed: float, held: float, play: float, follow: OfTwo) -> tuple[float, float]:
    """Displacement [m] and velocity [m/s] of the damper behind its mounting; it stood at ``held`` [m]."""
    if play == 0.0:
        return position, speed
    x = follow(held, position)
    return x, (follow(x, position + speed * _AHEAD) - x) / _AHEAD


@compiled
def rates(
    s: Array,
    held: float,
    command: float,
    drive: float,
    k: Array,
    p: Array,
    follow: OfTwo,
    parallel: OfTwo,
    rate: Array,
) -> tuple[float, float, float, float]:
    """Rates of all states, written to ``rate``.

    Args:
        s: (8,) the states.
        held: [m] where the damper stood when the step began.
        command: [m] commanded displacement now.
        drive: [V or A] commanded drive.
        k: (12,) constants of actuator, amplifier and heat.
        p: (14,) the parameters of the law in the paper's order.
        follow: displacement of the damper over (held, actuator) [m].
        parallel: force beside the law [N] over (displacement [m], velocity [m/s]).
        rate: (8,) the answer.

    Returns:
        Force on the load cell [N], displacement [m], velocity [m/s] and slip velocity [m/s] of the damper.
    """
    x, v = _damper_motion(s[POSITION], s[SPEED], held, k[PLAY], follow)
    alpha, c0, c1 = at_field(p[0], p[1], s[FIELD]), at_field(p[6], p[7], s[FIELD]), at_field(p[8], p[9], s[FIELD])
    y_rate = inner_velocity(x, v, s[Y], s[Z], alpha, c0, c1, p[10])
    slip = v - y_rate
    force = damper_force(y_rate, x, c1, p[11], p[13]) + parallel(x, v)
    rate[COMMAND] = k[LAG] * (command - s[COMMAND])
    rate[POSITION] = s[SPEED]
    error = s[COMMAND] - s[POSITION] - k[COMPLIANCE] * force
    rate[SPEED] = k[SERVO] * (k[SERVO] * error - 2.0 * k[DAMPING] * s[SPEED])
    rate[Y] = y_rate
    rate[Z] = hysteresis_rate(slip, s[Z], p[5], p[2], p[3], p[12])
    rate[FIELD] = field_rate(s[FIELD], s[OUTPUT], p[4])
    rate[OUTPUT] = k[AMPLIFIER] * (drive - s[OUTPUT])
    heat = abs(force * v) + k[COIL] * s[OUTPUT] * s[OUTPUT]
    rate[TEMPERATURE] = (heat - k[HEAT_LOSS] * (s[TEMPERATURE] - k[AMBIENT])) / k[HEAT_CAPACITY]
    return force, x, v, slip


@compiled
def _stiffness(s: Array, slip: float, drive: float, k: Array, p: Array) -> float:
    """Fastest rate [1/s] in the motion, for a slip velocity of at most ``slip`` [m/s]: a bound, not a guess."""
    both = abs(at_field(p[6] + p[8], p[7] + p[9], s[FIELD]))
    tangent = 2.0 * abs(at_field(p[0], p[1], s[FIELD])) * p[5]
    hysteresis = p[12] * slip * p[5] / k[SATURATED]
    inner = (tangent + abs(p[10])) / both
    servo = k[SERVO] * math.sqrt(k[COMPLIANCE] * (tangent + abs(p[10]) + abs(p[11])))
    moving = s[OUTPUT] != drive
    return float(hysteresis + inner + servo + k[EVER_PRESENT] + (k[AMPLIFIER] if moving else 0.0))


@compiled
def steps_for(
    s: Array, rate: Array, x: float, slip: float, drive: float, h: float, k: Array, p: Array, follow: OfTwo
) -> float:
    """Steps that a block of h [s] needs for stability, and for accuracy where the loop turns or play ends."""
    turn = 2.0 * abs(rate[SPEED]) * h
    fastest = abs(slip) + turn
    steps = 1.0
    if k[PLAY] != 0.0:
        carried = follow(x, s[POSITION] + s[SPEED] * _AHEAD) != x
        carried_later = follow(x, s[POSITION] + s[SPEED] * h) != x
        if carried != carried_later:
            steps = CONTACT_STEPS
            fastest += abs(s[SPEED])
    per_slip = p[5] * h / k[SATURATED]
    travel = abs(rate[Z]) * h / k[SATURATED] + turn * per_slip
    if slip * s[Z] < 0.0 or abs(slip) <= turn:
        travel = max(travel, 2.0 * fastest * per_slip)
    if abs(slip) <= turn and turn * per_slip > _FELT:
        steps = max(steps, CORNER_STEPS)
    stable = math.ceil(_stiffness(s, fastest, drive, k, p) * h / STABLE)
    return float(max(steps, stable, math.ceil(travel / TRAVEL)))


@compiled
def _step(
    s: Array,
    held: float,
    start: float,
    end: float,
    drive: float,
    h: float,
    k: Array,
    p: Array,
    follow: OfTwo,
    parallel: OfTwo,
    work: Array,
) -> float:
    """One classical Runge-Kutta step of h [s], in place; the command goes straight from start to end [m].

    Returns:
        Where the damper stands [m].
    """
    a, b, c, d, mid = work[0], work[1], work[2], work[3], work[4]
    half = 0.5 * (start + end)
    rates(s, held, start, drive, k, p, follow, parallel, a)
    for j in range(STATES):
        mid[j] = s[j] + 0.5 * h * a[j]
    rates(mid, held, half, drive, k, p, follow, parallel, b)
    for j in range(STATES):
        mid[j] = s[j] + 0.5 * h * b[j]
    rates(mid, held, half, drive, k, p, follow, parallel, c)
    for j in range(STATES):
        mid[j] = s[j] + h * c[j]
    rates(mid, held, end, drive, k, p, follow, parallel, d)
    for j in range(STATES):
        s[j] += h / 6.0 * (a[j] + 2.0 * (b[j] + c[j]) + d[j])
    return float(follow(held, s[POSITION]))


def _march(
    s: Array,
    held: float,
    command: Array,
    drive: Array,
    h: float,
    blocks: int,
    k: Array,
    p: Array,
    follow: OfTwo,
    parallel: OfTwo,
    positions: Array,
    forces: Array,
    outputs: Array,
    damper: Array,
    states: Array,
) -> tuple[float, int]:
    """Move the states on through M command samples, in place.

    Args:
        s: (8,) states at the first instant.
        held: [m] where the damper stands.
        command: (M+1,) commanded displacement [m] at the start of each sample and the end of the last.
        drive: (M,) commanded drive [V or A], held through each sample.
        h: [s] one block; ``blocks`` of them make a sample.
        k, p, follow, parallel: as in ``rates``.
        positions, forces: (M blocks,) filled with actuator position [m] and force on the load cell [N] at the
            start of each block.
        outputs: (M,) filled with the amplifier's output half way through each sample.
        damper: (M, 2) filled with displacement [m] and velocity [m/s] of the damper at each sample.
        states: (M, 8) filled with the states at each sample.

    Returns:
        Where the damper stands [m], and the sample in which the motion was lost, or M.
    """
    work, rate = np.empty((5, STATES)), np.empty(STATES)
    for i in range(len(drive)):
        states[i] = s
        for j in range(blocks):
            start = command[i] + (command[i + 1] - command[i]) * j / blocks
            end = command[i] + (command[i + 1] - command[i]) * (j + 1) / blocks
            if abs(drive[i] - s[OUTPUT]) < _SETTLED * (abs(drive[i]) + 1e-3):
                s[OUTPUT] = drive[i]
            force, x, v, slip = rates(s, held, start, drive[i], k, p, follow, parallel, rate)
            positions[i * blocks + j], forces[i * blocks + j] = s[POSITION], force
            if j == 0:
                damper[i, 0], damper[i, 1] = x, v
            if j == blocks // 2:
                outputs[i] = s[OUTPUT]
            steps = steps_for(s, rate, x, slip, drive[i], h, k, p, follow)
            if not (steps <= MOST_STEPS and math.isfinite(force) and math.isfinite(s[Z])):
                return held, i
            for step in range(int(steps)):
                one = start + (end - start) * step / steps
                other = start + (end - start) * (step + 1) / steps
                held = _step(s, held, one, other, drive[i], h / steps, k, p, follow, parallel, work)
    return held, len(drive)


_ROW, _TABLE, _NUMBER = numba.float64[::1], numba.float64[:, ::1], numba.float64
_SIGNATURE = (
    *(_ROW, _NUMBER, _ROW, _ROW, _NUMBER, numba.int64, _ROW, _ROW, OF_TWO, OF_TWO),
    *(_ROW, _ROW, _ROW, _TABLE, _TABLE),
)
march = compiled(_march, _SIGNATURE)
"""``_march`` compiled when first imported, once for every kind of effect."""
