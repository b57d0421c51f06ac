"""The modified Bouc-Wen law of Spencer et al. (1997), as the paper prints it in eqs. 1-8.

A dashpot ``c1`` stands in series with a Bouc-Wen element ``alpha z`` beside a dashpot ``c0`` and a spring
``k0``; a spring ``k1`` (the gas accumulator) stands parallel to all of it:

    force = c1 y' + k1 (x - x0)                                            (2)
    z'    = -gamma |w| z |z|^(n-1) - beta w |z|^n + A w,   w = x' - y'      (3)
    y'    = (alpha z + k0 (x - y) + c0 x') / (c0 + c1)                     (4)
    alpha, c0, c1 = a + b u                                                (5-7)
    u'    = -eta (u - v)                                                   (8)

Two corrections to the printed equations: eq. 8 has ``+eta (u - v)`` there, which is unstable for the positive
eta of its own Table 1; eq. 13 has ``x' + y'`` where eqs. 3 and 18 have the slip ``x' - y'``.

Only ``+ - * / **`` and ``abs`` are used, so floats, numpy arrays, numba values and torch tensors all pass.
"""

from typing import Any, TypeAlias

Number: TypeAlias = Any
"""A float, a numpy array, a numba value or a torch tensor."""

Z_GUARD = 1e-30
"""Keeps the gradient of ``|z|^(n-1)`` finite at z = 0 where n < 2; far below any hysteretic displacement."""


def at_field(base: Number, slope: Number, field: Number) -> Number:
    """Value of alpha, c0 or c1 at the field u (eqs. 5-7), in the unit of ``base``."""
    return base + slope * field


def field_rate(field: Number, drive: Number, eta: Number) -> Number:
    """Rate of the field [V/s or A/s] towards the drive with rate constant eta [1/s] (eq. 8, stable sign)."""
    return -eta * (field - drive)


def inner_velocity(
    x: Number, velocity: Number, y: Number, z: Number, alpha: Number, c0: Number, c1: Number, k0: Number
) -> Number:
    """Velocity y' [m/s] of the point between the two dashpots (eq. 4).

    Args:
        x: displacement of the damper [m].
        velocity: its rate [m/s].
        y: inner displacement [m].
        z: hysteretic displacement [m].
        alpha: hysteretic stiffness [N/m] at the present field.
        c0: viscous damping at large velocity [N s/m] at the present field.
        c1: dashpot of the roll-off at low velocity [N s/m] at the present field.
        k0: stiffness at large velocity [N/m].
    """
    return (alpha * z + k0 * (x - y) + c0 * velocity) / (c0 + c1)


def hysteresis_rate(slip: Number, z: Number, A: Number, beta: Number, gamma: Number, n: Number) -> Number:
    """Rate z' [m/s] of the hysteretic displacement for the slip velocity x' - y' [m/s] (eq. 3)."""
    size = abs(z)
    power = (size + Z_GUARD) ** (n - 1)
    return A * slip - (gamma * abs(slip) * z + beta * slip * size) * power


def hysteresis_slopes(
    slip: Number, z: Number, A: Number, beta: Number, gamma: Number, n: Number
) -> tuple[Number, Number]:
    """Slopes of z' over the slip velocity [1] and over z [1/s], for implicit steps and sensitivities.

    At the two kinks, slip = 0 and z = 0, the slope is that of the positive side.
    """
    size = abs(z)
    power = (size + Z_GUARD) ** (n - 1)
    # Branches are allowed here: only compiled steps ask for these slopes, one number at a time.
    slip_sign = 1.0 if slip >= 0 else -1.0
    z_sign = 1.0 if z >= 0 else -1.0
    over_slip = A - (gamma * slip_sign * z + beta * size) * power
    over_z = -n * power * (gamma * abs(slip) + beta * slip * z_sign)
    return over_slip, over_z


def force(y_rate: Number, x: Number, c1: Number, k1: Number, x0: Number) -> Number:
    """Damper force [N], tension positive (eq. 2)."""
    return c1 * y_rate + k1 * (x - x0)
