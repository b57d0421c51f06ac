"""The motion of actuator and specimen: explicit Runge-Kutta steps, as many as the stiffness asks for.

The integrator is deliberately another one than the implicit step that identification uses. Each command sample is
cut into blocks of at most an eighth of a millisecond, each block into equal fourth-order steps. At a reversal the
hysteretic variable relaxes at some 2e4 1/s and the law has a corner where the slip velocity changes sign, so
blocks near one get more steps.
"""

import math

import numba
import numpy as np

from identification.damper.effects import connection
from sim_rig.compiled import OF_FOUR, OF_TWO, SCALES, Array, OfFour, OfTwo, Scales, compiled
from sim_rig.compiled_law import at_field
from sim_rig.rates import AHEAD, rates
from sim_rig.states import (
    AMPLIFIER,
    BEHIND,
    COMPLIANCE,
    DEAD_TIME,
    EVER_PRESENT,
    FIELD,
    GIVE,
    HARDENING,
    MEMORY,
    OUTPUT,
    PLAY,
    POSITION,
    SATURATED,
    SERVO,
    SPEED,
    STATES,
    Z,
)

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
_YIELDING_STEPS = 8.0
"""Least steps in a block where the fixture gives way: the damper's velocity is then not the actuator's."""

steepness = compiled(connection.steepness)


@compiled
def _stiffness(s: Array, slip: float, drive: float, k: Array, p: Array) -> float:
    """Fastest rate [1/s] in the motion, for a slip velocity of at most ``slip`` [m/s]: a bound, not a guess."""
    both = abs(at_field(p[6] + p[8], p[7] + p[9], s[FIELD]))
    tangent = 2.0 * abs(at_field(p[0], p[1], s[FIELD])) * p[5]
    hysteresis = p[12] * slip * p[5] / k[SATURATED]
    inner = (tangent + abs(p[10])) / both
    servo = k[SERVO] * math.sqrt(k[COMPLIANCE] * (tangent + abs(p[10]) + abs(p[11])))
    moving = s[OUTPUT] != drive
    if k[GIVE] > 0.0:
        c0, c1 = abs(at_field(p[6], p[7], s[FIELD])), abs(at_field(p[8], p[9], s[FIELD]))
        stiff = steepness(s[POSITION] - s[BEHIND], k[GIVE], 0.0, k[HARDENING], 0.0)
        inner += (tangent + stiff) / c0 + stiff / c1
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
        carried = follow(x, s[POSITION] + s[SPEED] * AHEAD) != x
        carried_later = follow(x, s[POSITION] + s[SPEED] * h) != x
        if carried != carried_later:  # the clevis takes the damper along, or lets go of it, within this block
            steps = CONTACT_STEPS
            fastest += abs(s[SPEED])
    if k[GIVE] > 0.0:
        steps = max(steps, _YIELDING_STEPS)
    per_slip = p[5] * h / k[SATURATED]
    travel = abs(rate[Z]) * h / k[SATURATED] + turn * per_slip
    # Behind a reversal z runs back at twice the rate, until it has its new sign.
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
    remembered: float,
    start: float,
    end: float,
    drive: float,
    late: float,
    h: float,
    k: Array,
    p: Array,
    follow: OfTwo,
    parallel: OfFour,
    seen: OfTwo,
    memory: OfTwo,
    scales: Scales,
    work: Array,
) -> tuple[float, float]:
    """One classical Runge-Kutta step of h [s], in place; the command goes straight from start to end [m].

    Returns:
        Where the damper stands [m], and what the iron remembers.
    """
    a, b, c, d, mid = work[0], work[1], work[2], work[3], work[4]
    half, field = 0.5 * (start + end), s[FIELD]
    rates(s, held, remembered, start, drive, late, k, p, follow, parallel, seen, scales, a)
    for j in range(STATES):
        mid[j] = s[j] + 0.5 * h * a[j]
    rates(mid, held, remembered, half, drive, late, k, p, follow, parallel, seen, scales, b)
    for j in range(STATES):
        mid[j] = s[j] + 0.5 * h * b[j]
    rates(mid, held, remembered, half, drive, late, k, p, follow, parallel, seen, scales, c)
    for j in range(STATES):
        mid[j] = s[j] + h * c[j]
    rates(mid, held, remembered, end, drive, late, k, p, follow, parallel, seen, scales, d)
    for j in range(STATES):
        s[j] += h / 6.0 * (a[j] + 2.0 * (b[j] + c[j]) + d[j])
    # Once a step, by where it ended: a stage only tries, and play and iron would remember what it tried.
    if k[MEMORY] != 0.0 and s[FIELD] != field:
        remembered = memory(remembered, s[FIELD] - field)
    return float(follow(held, s[POSITION])), remembered


@compiled
def _arrived(past: Array, block: int, late_by: float) -> float:
    """Output of the amplifier that reaches the coil half way through a block, ``late_by`` [blocks] after."""
    place = max(block + 0.5 - late_by, 0.0)
    i = min(int(place), block)
    t = min(place - i, 1.0) if i < block else 0.0
    one, other = past[i % len(past)], past[min(i + 1, block) % len(past)]
    return float(one + t * (other - one))


def _march(
    s: Array,
    held: float,
    remembered: float,
    past: Array,
    before: int,
    command: Array,
    drive: Array,
    h: float,
    blocks: int,
    k: Array,
    p: Array,
    follow: OfTwo,
    parallel: OfFour,
    seen: OfTwo,
    memory: OfTwo,
    scales: Scales,
    positions: Array,
    forces: Array,
    outputs: Array,
    damper: Array,
    states: Array,
) -> tuple[float, float, int]:
    """Move the states on through M command samples, in place.

    Args:
        s: (STATES,) states at the first instant.
        held: [m] where the damper stands.
        remembered: what the iron remembers.
        past: ring of the amplifier's outputs at the start of each block, long enough for the dead time.
        before: blocks played so far.
        command: (M+1,) commanded displacement [m] at the start of each sample and the end of the last.
        drive: (M,) commanded drive [V or A], held through each sample.
        h: [s] one block; ``blocks`` of them make a sample.
        k, p, follow, parallel, seen, scales: as in ``rates``.
        memory: what the iron remembers after (remembered, change of the field).
        positions, forces: (M blocks,) filled with actuator position [m] and force on the load cell [N] at the
            start of each block.
        outputs: (M,) filled with the amplifier's output half way through each sample.
        damper: (M, 2) filled with displacement [m] and velocity [m/s] of the damper at each sample.
        states: (M, STATES) filled with the states at each sample.

    Returns:
        Where the damper stands [m], what the iron remembers, and the sample in which the motion was lost, or M.
    """
    work, rate = np.empty((5, STATES)), np.empty(STATES)
    for i in range(len(drive)):
        states[i] = s
        for j in range(blocks):
            start = command[i] + (command[i + 1] - command[i]) * j / blocks
            end = command[i] + (command[i + 1] - command[i]) * (j + 1) / blocks
            if abs(drive[i] - s[OUTPUT]) < _SETTLED * (abs(drive[i]) + 1e-3):
                s[OUTPUT] = drive[i]
            block = before + i * blocks + j
            past[block % len(past)] = s[OUTPUT]
            late = _arrived(past, block, k[DEAD_TIME] / h)
            force, x, v, slip = rates(
                s, held, remembered, start, drive[i], late, k, p, follow, parallel, seen, scales, rate
            )
            positions[i * blocks + j], forces[i * blocks + j] = s[POSITION], force
            if j == 0:
                damper[i, 0], damper[i, 1] = x, v
            if j == blocks // 2:
                outputs[i] = s[OUTPUT]
            steps = steps_for(s, rate, x, slip, drive[i], h, k, p, follow)
            if not (steps <= MOST_STEPS and math.isfinite(force) and math.isfinite(s[Z])):
                return held, remembered, i
            for step in range(int(steps)):
                one = start + (end - start) * step / steps
                other = start + (end - start) * (step + 1) / steps
                held, remembered = _step(
                    s, held, remembered, one, other, drive[i], late, h / steps, k, p,
                    follow, parallel, seen, memory, scales, work,
                )  # fmt: skip
    return held, remembered, len(drive)


_ROW, _TABLE, _NUMBER = numba.float64[::1], numba.float64[:, ::1], numba.float64
_SIGNATURE = (
    *(_ROW, _NUMBER, _NUMBER, _ROW, numba.int64, _ROW, _ROW, _NUMBER, numba.int64, _ROW, _ROW),
    *(OF_TWO, OF_FOUR, OF_TWO, OF_TWO, SCALES, _ROW, _ROW, _ROW, _TABLE, _TABLE),
)
march = compiled(_march, _SIGNATURE)
"""``_march`` compiled when first imported, once for every kind of effect."""
