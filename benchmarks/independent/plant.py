"""Damper, its effects and its mounting as ordinary differential equations, by the classical Runge-Kutta method.

Nothing of the product is imported. The law is the same; its code, the forms of the effects and the integration are
others, so that an error of the product's simulation is not made twice. The step is fixed, and far shorter than a
sample.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]

_NEWTON_STEPS = 80
"""Largest number of steps in the search for the speed of the damper behind its mounting."""
_SPEED_LIMIT = 20.0
"""Largest speed of the damper behind its mounting, over the peak speed of the stroke [1]."""


class Plant(NamedTuple):
    """Parameters of the damper; an effect with the value 0 does not act. SI units, volt or ampere."""

    yield_base: float
    yield_slope: float
    yield_displacement: float
    shape: float
    """beta over beta + gamma [1]."""
    exponent: float
    c0_base: float
    c0_slope: float
    c1_base: float
    c1_slope: float
    k0: float
    k1: float
    preload: float
    peak_speed: float
    """Peak speed of the stroke [m/s]."""
    gas_force: float = 0.0
    gas_length: float = 1.0
    """Length of the gas column in the middle [m]; negative if it is compressed at positive displacement."""
    gas_exponent: float = 1.0
    turbulence: float = 0.0
    """Force over speed to a power."""
    turbulence_power: float = 1.0
    stop_stiffness: float = 0.0
    stop_high: float = math.inf
    stop_low: float = -math.inf
    stop_power: float = 1.0
    friction: float = 0.0
    static_friction: float = 0.0
    stribeck_speed: float = 1.0
    bristle_stiffness: float = 0.0
    asymmetry: float = 0.0
    """Part by which pulling is stiffer than pushing [1]."""
    asymmetry_speed: float = 1.0
    heating: float = 0.0
    """Softening for a stored energy of 1 [1]."""
    heat_scale: float = 0.0
    """Stored energy per work [1/J]."""
    cooling: float = 0.0
    """[1/s]"""
    position_gain: float = 0.0
    position_angle: float = 0.0
    """[1/m]"""
    position_phase: float = 0.0
    gain_loss: float = 0.0
    first_loss: float = math.inf
    second_loss: float = math.inf
    """Times at which the damper loses a part of its force [s]."""
    gap: float = 0.0
    mount_stiffness: float = 0.0
    """0 without a compliant mounting [N/m]."""
    mount_hardening: float = 0.0


class _State(NamedTuple):
    inner: float
    """Displacement between the two dashpots [m]."""
    hysteresis: float
    """Hysteretic displacement over its largest value [1]."""
    heat: float
    bristle: float
    """Deflection of the seal [m]."""
    rod: float
    """Displacement of the damper behind its mounting [m]."""


@njit(cache=True)
def _compute_parallel_force(x: float, v: float, bristle: float, p: Plant) -> float:
    """Return the force beside the law [N]."""
    force = p.bristle_stiffness * bristle
    if p.gas_force != 0.0:
        force += p.gas_force * np.sign(p.gas_length) * ((1.0 - x / p.gas_length) ** (-p.gas_exponent) - 1.0)
    if p.turbulence != 0.0:
        force += p.turbulence * v * abs(v) ** p.turbulence_power
    if x > p.stop_high:
        force += p.stop_stiffness * (x - p.stop_high) ** p.stop_power
    if x < p.stop_low:
        force -= p.stop_stiffness * (p.stop_low - x) ** p.stop_power
    return force


@njit(cache=True)
def _compute_mount_force(stretch: float, p: Plant) -> float:
    """Return the force of the mounting [N], which has play and a hardening spring."""
    beyond = max(abs(stretch) - p.gap, 0.0)
    return float(np.sign(stretch)) * (p.mount_stiffness * beyond + p.mount_hardening * beyond**3)


@njit(cache=True)
def _compute_gain(time: float, x: float, s: _State, p: Plant) -> float:
    """Return the factor on the force of the fluid [1]."""
    lost = (1.0 if time > p.first_loss else 0.0) + (0.7 if time > p.second_loss else 0.0)
    place = 1.0 + p.position_gain * np.cos(p.position_angle * x + p.position_phase)
    return float(np.exp(-p.heating * s.heat) * place * (1.0 - p.gain_loss * lost))


@njit(cache=True)
def _compute_damper_force(v: float, x: float, field: float, gain: float, s: _State, p: Plant) -> float:
    """Return the force of the damper [N] at a speed of its rod."""
    c0 = (p.c0_base + p.c0_slope * field) * gain
    c1 = (p.c1_base + p.c1_slope * field) * gain
    fluid = (p.yield_base + p.yield_slope * field) * gain * s.hysteresis + p.k0 * (x - s.inner) + c0 * v
    side = 1.0 + p.asymmetry * np.tanh(v / p.asymmetry_speed)
    return float(
        side * c1 / (c0 + c1) * fluid + p.k1 * x - p.preload + _compute_parallel_force(x, v, s.bristle, p)
    )


@njit(cache=True)
def _find_rod_speed(force: float, start: float, x: float, field: float, gain: float, s: _State, p: Plant) -> float:
    """Return the speed of the rod [m/s] at which the damper has the force of the mounting."""
    low, high = -_SPEED_LIMIT * p.peak_speed, _SPEED_LIMIT * p.peak_speed
    speed, small = start, 1e-7 * p.peak_speed
    for _ in range(_NEWTON_STEPS):
        error = _compute_damper_force(speed, x, field, gain, s, p) - force
        if error > 0.0:
            high = speed
        else:
            low = speed
        slope = (_compute_damper_force(speed + small, x, field, gain, s, p) - force - error) / small
        following = speed - error / slope if slope > 0.0 else math.inf
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - speed) < 1e-9 * p.peak_speed:
            break
        speed = following
    return speed


@njit(cache=True)
def _compute_rates(time: float, x: float, v: float, field: float, s: _State, p: Plant) -> tuple[_State, float]:
    """Return the rates of the state and the force [N]."""
    mounted = p.mount_stiffness > 0.0
    rod = s.rod if mounted else x
    gain = _compute_gain(time, rod, s, p)
    force, speed = 0.0, v
    if mounted:
        force = _compute_mount_force(x - s.rod, p)
        speed = _find_rod_speed(force, v, rod, field, gain, s, p)
    else:
        force = _compute_damper_force(v, x, field, gain, s, p)
    c0 = (p.c0_base + p.c0_slope * field) * gain
    c1 = (p.c1_base + p.c1_slope * field) * gain
    fluid = (p.yield_base + p.yield_slope * field) * gain * s.hysteresis + p.k0 * (rod - s.inner) + c0 * speed
    inner = fluid / (c0 + c1)
    slip = speed - inner
    worn = (1.0 - p.shape) * abs(slip) * np.sign(s.hysteresis) + p.shape * slip
    hysteresis = (slip - worn * abs(s.hysteresis) ** p.exponent) / p.yield_displacement
    heat = abs(force * speed) * p.heat_scale - s.heat * p.cooling
    bristle = 0.0
    if p.bristle_stiffness > 0.0:
        limit = p.friction + (p.static_friction - p.friction) * np.exp(-((speed / p.stribeck_speed) ** 2))
        bristle = speed - abs(speed) * p.bristle_stiffness * s.bristle / limit
    return _State(inner, hysteresis, heat, bristle, speed), force


@njit(cache=True)
def _move(s: _State, rates: _State, step: float) -> _State:
    return _State(
        s.inner + step * rates.inner,
        s.hysteresis + step * rates.hysteresis,
        s.heat + step * rates.heat,
        s.bristle + step * rates.bristle,
        s.rod + step * rates.rod,
    )


@njit(cache=True)
def integrate(x: Array, v: Array, field: Array, step: float, stride: int, p: Plant) -> Array:
    """Return the force at every sample [N].

    Args:
        x: displacement of the actuator [m] every half step.
        v: its speed [m/s] every half step.
        field: field of the coil [V or A] every half step.
        step: step of the integration [s].
        stride: steps in a sample.
        p: the plant.
    """
    count = (len(x) - 1) // 2
    force = np.zeros(count // stride + 1)
    s = _State(x[0], 0.0, 0.0, 0.0, x[0])
    for k in range(count):
        i, time = 2 * k, k * step
        first, f = _compute_rates(time, x[i], v[i], field[i], s, p)
        if k % stride == 0:
            force[k // stride] = f
        middle = time + 0.5 * step
        second, f = _compute_rates(middle, x[i + 1], v[i + 1], field[i + 1], _move(s, first, 0.5 * step), p)
        third, f = _compute_rates(middle, x[i + 1], v[i + 1], field[i + 1], _move(s, second, 0.5 * step), p)
        last, f = _compute_rates(time + step, x[i + 2], v[i + 2], field[i + 2], _move(s, third, step), p)
        s = _move(s, first, step / 6.0)
        s = _move(s, second, step / 3.0)
        s = _move(s, third, step / 3.0)
        s = _move(s, last, step / 6.0)
    force[-1] = _compute_rates(count * step, x[-1], v[-1], field[-1], s, p)[1]
    return force
