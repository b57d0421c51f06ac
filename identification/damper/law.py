"""Modified Bouc-Wen law of Spencer et al. (1997), as the paper prints it in eqs. 1-8.

A dashpot ``c1`` is in series with a Bouc-Wen element ``alpha z``, a dashpot ``c0`` and a spring ``k0``, which are
parallel to each other. A spring ``k1`` (the gas accumulator) is parallel to all of it:

    force = c1 y' + k1 (x - x0)                                            (2)
    z'    = -gamma |w| z |z|^(n-1) - beta w |z|^n + A w,   w = x' - y'      (3)
    y'    = (alpha z + k0 (x - y) + c0 x') / (c0 + c1)                     (4)
    alpha, c0, c1 = a + b u                                                (5-7)
    u'    = -eta (u - v)                                                   (8)

Two corrections to the printed equations: eq. 8 has ``+eta (u - v)``, which is unstable for the positive eta of the
paper's Table 1; eq. 13 has ``x' + y'`` where eqs. 3 and 18 have the slip ``x' - y'``.

Only ``+ - * / **`` and ``abs`` are used, so floats, numpy arrays, numba values and torch tensors all work.
"""

from typing import Any, TypeAlias

Number: TypeAlias = Any
"""A float, a numpy array, a numba value or a torch tensor."""

Z_GUARD = 1e-30
"""Offset of ``|z|`` that keeps the gradient of ``|z|^(n-1)`` finite at z = 0 for n < 2; far below any actual z."""


def evaluate_coefficient(base: Number, slope: Number, field: Number) -> Number:
    """Return alpha, c0 or c1 at the field u (eqs. 5-7), in the unit of ``base``."""
    return base + slope * field


def compute_field_rate(field: Number, drive: Number, eta: Number) -> Number:
    """Return the rate of the field [V/s or A/s] towards the drive, for eta in 1/s (eq. 8, stable sign)."""
    return -eta * (field - drive)


def compute_inner_velocity(
    x: Number, velocity: Number, y: Number, z: Number, alpha: Number, c0: Number, c1: Number, k0: Number
) -> Number:
    """Return the velocity y' [m/s] of the point between the two dashpots (eq. 4).

    Args:
        x: displacement of the damper [m].
        velocity: rate of the displacement [m/s].
        y: inner displacement [m].
        z: hysteretic displacement [m].
        alpha: hysteretic stiffness [N/m] at the present field.
        c0: viscous damping at large velocity [N s/m] at the present field.
        c1: dashpot of the roll-off at low velocity [N s/m] at the present field.
        k0: stiffness at large velocity [N/m].
    """
    return (alpha * z + k0 * (x - y) + c0 * velocity) / (c0 + c1)


def compute_hysteresis_rate(slip: Number, z: Number, A: Number, beta: Number, gamma: Number, n: Number) -> Number:
    """Return the rate z' [m/s] of the hysteretic displacement at a slip velocity x' - y' [m/s] (eq. 3)."""
    size = abs(z)
    power = (size + Z_GUARD) ** (n - 1)
    return A * slip - (gamma * abs(slip) * z + beta * slip * size) * power


def differentiate_hysteresis_rate(
    slip: Number, z: Number, A: Number, beta: Number, gamma: Number, n: Number
) -> tuple[Number, Number]:
    """Return the derivatives of z' over the slip velocity [1] and over z [1/s].

    Implicit steps and sensitivities use them. At the two kinks, slip = 0 and z = 0, they are those of the positive
    side.
    """
    size = abs(z)
    power = (size + Z_GUARD) ** (n - 1)
    # Branches are allowed here: only compiled steps call this, one number at a time.
    slip_sign = 1.0 if slip >= 0 else -1.0
    z_sign = 1.0 if z >= 0 else -1.0
    over_slip = A - (gamma * slip_sign * z + beta * size) * power
    over_z = -n * power * (gamma * abs(slip) + beta * slip * z_sign)
    return over_slip, over_z


def compute_force(y_rate: Number, x: Number, c1: Number, k1: Number, x0: Number) -> Number:
    """Return the damper force [N], tension positive (eq. 2)."""
    return c1 * y_rate + k1 * (x - x0)
