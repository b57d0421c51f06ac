"""Thirteen regular coordinates in place of the paper's fourteen parameters.

The force is unchanged by (alpha_a, alpha_b, beta, gamma, A) -> (s alpha_a, s alpha_b, s^(n-1) beta, s^(n-1) gamma,
A/s), so no recording determines that direction. With the saturated hysteretic displacement ``z_ss =
(A/(beta+gamma))^(1/n)``, these coordinates are gauge-free and well scaled:

    F_a = alpha_a z_ss   F_b = alpha_b z_ss   D_y = z_ss / A   rho = beta / (beta + gamma)   f0 = k1 x0

and ``zeta = z / z_ss`` obeys the same law with A = 1/D_y, beta = rho/D_y, gamma = (1-rho)/D_y, alpha = F.
"""

from typing import NamedTuple

from identification.damper.parameters import GAUGE, PARAMETERS, Parameters, Quantity


class Coordinates(NamedTuple):
    """Point in the space that the fit searches, in SI units."""

    F_a: float
    """Yield force at zero drive [N]."""
    F_b: float
    """Growth of the yield force with drive [N/drive]."""
    D_y: float
    """Yield displacement [m]: slip over which the loop turns at a reversal."""
    rho: float
    """Shape of the loop, beta / (beta + gamma) [1]."""
    n: float
    """Sharpness of the yield [1]."""
    eta: float
    """Rate constant of the field behind the drive [1/s]."""
    c0_a: float
    """Viscous damping at large velocity and zero drive [N s/m]."""
    c0_b: float
    """Growth of c0 with drive [N s/(m drive)]."""
    c1_a: float
    """Roll-off dashpot at zero drive [N s/m]."""
    c1_b: float
    """Growth of c1 with drive [N s/(m drive)]."""
    k0: float
    """Stiffness at large velocity [N/m]."""
    k1: float
    """Accumulator stiffness [N/m]."""
    f0: float
    """Accumulator preload k1 x0 [N]."""


_PARAMETERS = {q.symbol: q for q in PARAMETERS}
COORDINATES: tuple[Quantity, ...] = (
    Quantity("F_a", "N", 1e-4, 1e7, 50.0, "yield force at zero drive"),
    Quantity("F_b", "N/{drive}", 0.0, 1e10, 900.0, "growth of the yield force with drive"),
    Quantity("D_y", "m", 1e-9, 10.0, 3e-5, "slip over which the loop turns at a reversal"),
    Quantity("rho", "1", 0.02, 0.98, 0.5, "asymmetry between loading and unloading of the loop"),
    *(_PARAMETERS[symbol] for symbol in ("n", "eta", "c0_a", "c0_b", "c1_a", "c1_b", "k0", "k1")),
    Quantity("f0", "N", -1e8, 1e8, 50.0, "preload of the gas accumulator and zero of the load cell"),
)


def to_coordinates(p: Parameters) -> Coordinates:
    """Return the regular coordinates of a parameter set; they do not depend on its gauge."""
    saturated = (p.A / (p.beta + p.gamma)) ** (1 / p.n)
    return Coordinates(
        F_a=p.alpha_a * saturated,
        F_b=p.alpha_b * saturated,
        D_y=saturated / p.A,
        rho=p.beta / (p.beta + p.gamma),
        n=p.n,
        eta=p.eta,
        c0_a=p.c0_a,
        c0_b=p.c0_b,
        c1_a=p.c1_a,
        c1_b=p.c1_b,
        k0=p.k0,
        k1=p.k1,
        f0=p.k1 * p.x0,
    )


def to_parameters(c: Coordinates, gauge: float = GAUGE) -> Parameters:
    """Return the paper's fourteen parameters at a chosen gauge A [1].

    Raises:
        ZeroDivisionError: ``k1`` is exactly zero, so that no x0 gives the preload ``f0``.
    """
    saturated = c.D_y * gauge
    beta_plus_gamma = gauge / saturated**c.n
    return Parameters(
        alpha_a=c.F_a / saturated,
        alpha_b=c.F_b / saturated,
        beta=c.rho * beta_plus_gamma,
        gamma=(1 - c.rho) * beta_plus_gamma,
        eta=c.eta,
        A=gauge,
        c0_a=c.c0_a,
        c0_b=c.c0_b,
        c1_a=c.c1_a,
        c1_b=c.c1_b,
        k0=c.k0,
        k1=c.k1,
        n=c.n,
        x0=c.f0 / c.k1,
    )
