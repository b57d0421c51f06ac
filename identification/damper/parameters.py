"""Table of the paper's fourteen parameters: symbol, unit, bounds, scale and meaning.

All code that shows or checks a parameter uses this table. Its bounds admit dampers from 10 N to 400 kN.
"""

from typing import NamedTuple


class Quantity(NamedTuple):
    """A parameter as it is known before any measurement."""

    symbol: str
    """Name in documents and code."""
    unit: str
    """SI unit; ``{drive}`` stands for V or A."""
    low: float
    """Smallest value that any damper may have, in ``unit``; a fit searches a narrower range."""
    high: float
    """Largest value that any damper may have, in ``unit``; a value with equal limits is known and not fitted."""
    scale: float
    """Usual magnitude in a laboratory damper, in ``unit``: the size of a change of order one."""
    meaning: str
    """Description for a person, one line."""
    scaling: str = ""
    """Unit by which it follows the damper's size, if not ``unit``: for a value that holds at a fixed reference."""
    has_natural_limits: bool = False
    """True if nothing can have a value beyond the limits, so that a value at one of them is plausible."""

    @property
    def scaling_unit(self) -> str:
        """Unit by which the quantity follows the damper's size."""
        return self.scaling or self.unit

    def format_unit(self, drive_unit: str) -> str:
        """Return the unit with the drive's unit, ``V`` or ``A``, filled in."""
        return self.unit.format(drive=drive_unit)


class Parameters(NamedTuple):
    """Set of the paper's fourteen parameters, in SI units."""

    alpha_a: float
    """Hysteretic stiffness at zero drive [N/m]."""
    alpha_b: float
    """Growth of alpha with drive [N/(m drive)]."""
    beta: float
    """Shape of the loop in loading [1/m^n]."""
    gamma: float
    """Shape of the loop in unloading [1/m^n]."""
    eta: float
    """Rate constant of the field behind the drive [1/s]."""
    A: float
    """Gauge [1]: any positive value gives the same force with alpha, beta and gamma rescaled."""
    c0_a: float
    """Viscous damping at large velocity and zero drive [N s/m]."""
    c0_b: float
    """Growth of c0 with drive [N s/(m drive)]."""
    c1_a: float
    """Roll-off dashpot at low velocity and zero drive [N s/m]."""
    c1_b: float
    """Growth of c1 with drive [N s/(m drive)]."""
    k0: float
    """Stiffness at large velocity [N/m]."""
    k1: float
    """Accumulator stiffness [N/m]."""
    n: float
    """Sharpness of the yield [1]."""
    x0: float
    """Rest position of the accumulator spring [m]."""


GAUGE = 301.0
"""Default value of A [1], from Spencer et al. (1997)."""

PARAMETERS: tuple[Quantity, ...] = (
    Quantity("alpha_a", "N/m", 1e-9, 1e14, 1e4, "hysteretic stiffness at zero drive"),
    Quantity("alpha_b", "N/(m {drive})", -1e17, 1e17, 5e4, "growth of the hysteretic stiffness with drive"),
    Quantity("beta", "1/m^n", 0.0, 1e45, 1e6, "shape of the loop while loading"),
    Quantity("gamma", "1/m^n", 0.0, 1e45, 1e6, "shape of the loop while unloading"),
    Quantity("eta", "1/s", 1e-4, 1e6, 100.0, "rate constant with which the field follows the drive"),
    Quantity("A", "1", 1e-3, 1e6, GAUGE, "gauge of the hysteretic variable; the force does not depend on it"),
    Quantity("c0_a", "N s/m", 1e-5, 1e10, 1e3, "viscous damping at large velocity, zero drive"),
    Quantity("c0_b", "N s/(m {drive})", -1e13, 1e13, 1e3, "growth of that damping with drive"),
    Quantity("c1_a", "N s/m", 1e-4, 1e13, 2e4, "dashpot that rounds the force at low velocity, zero drive"),
    Quantity("c1_b", "N s/(m {drive})", -1e16, 1e16, 2e4, "growth of that dashpot with drive"),
    Quantity("k0", "N/m", -1e10, 1e10, 2e3, "stiffness at large velocity"),
    Quantity("k1", "N/m", -1e10, 1e10, 1e3, "stiffness of the gas accumulator"),
    # Below n = 1 the derivative of z' over z would be infinite at z = 0.
    Quantity("n", "1", 1.0, 6.0, 2.0, "sharpness of the yield"),
    Quantity("x0", "m", -1e6, 1e6, 0.1, "rest position of the accumulator spring"),
)
