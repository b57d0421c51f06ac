"""The fourteen parameters of the paper: symbol, unit, bounds, scale and meaning in one table.

Everything that shows, checks or searches a parameter takes these facts from here.
"""

from typing import NamedTuple


class Quantity(NamedTuple):
    """What is known of a parameter before any measurement."""

    symbol: str
    """Name in documents and code."""
    unit: str
    """SI unit; ``{drive}`` stands for V or A."""
    low: float
    """Lower bound of the search, in ``unit``."""
    high: float
    """Upper bound of the search, in ``unit``."""
    scale: float
    """A usual magnitude, in ``unit``: what a change of order one means."""
    meaning: str
    """One line for a person."""

    def unit_for(self, drive_unit: str) -> str:
        """The unit with the drive's own, ``V`` or ``A``, put in."""
        return self.unit.format(drive=drive_unit)


class Parameters(NamedTuple):
    """One set of the paper's fourteen parameters, in SI units."""

    alpha_a: float
    """[N/m] hysteretic stiffness at zero drive."""
    alpha_b: float
    """[N/(m drive)] its slope."""
    beta: float
    """[1/m^n] shape of the loop, loading."""
    gamma: float
    """[1/m^n] shape of the loop, unloading."""
    eta: float
    """[1/s] rate of the field behind the drive."""
    A: float
    """[1] the gauge: any positive value gives the same force with alpha, beta and gamma rescaled."""
    c0_a: float
    """[N s/m] viscous damping at large velocity, zero drive."""
    c0_b: float
    """[N s/(m drive)] its slope."""
    c1_a: float
    """[N s/m] roll-off dashpot at low velocity, zero drive."""
    c1_b: float
    """[N s/(m drive)] its slope."""
    k0: float
    """[N/m] stiffness at large velocity."""
    k1: float
    """[N/m] accumulator stiffness."""
    n: float
    """[1] sharpness of the yield."""
    x0: float
    """[m] rest position of the accumulator spring."""


GAUGE = 301.0
"""[1] value of A when nothing else is asked: that of Spencer et al. (1997)."""

PARAMETERS: tuple[Quantity, ...] = (
    Quantity("alpha_a", "N/m", 1.0, 1e7, 1e4, "hysteretic stiffness at zero drive"),
    Quantity("alpha_b", "N/(m {drive})", -1e7, 1e7, 5e4, "growth of the hysteretic stiffness with drive"),
    Quantity("beta", "1/m^n", 0.0, 1e30, 1e6, "shape of the loop while loading"),
    Quantity("gamma", "1/m^n", 0.0, 1e30, 1e6, "shape of the loop while unloading"),
    Quantity("eta", "1/s", 2.0, 2000.0, 100.0, "how fast the field follows the drive"),
    Quantity("A", "1", 1e-3, 1e6, GAUGE, "gauge of the hysteretic variable; no force reveals it"),
    Quantity("c0_a", "N s/m", 1.0, 1e5, 1e3, "viscous damping at large velocity, zero drive"),
    Quantity("c0_b", "N s/(m {drive})", -1e5, 1e5, 1e3, "growth of that damping with drive"),
    Quantity("c1_a", "N s/m", 100.0, 1e7, 2e4, "dashpot that rounds the force off at low velocity, zero drive"),
    Quantity("c1_b", "N s/(m {drive})", -1e7, 1e7, 2e4, "growth of that dashpot with drive"),
    Quantity("k0", "N/m", -1e5, 1e5, 2e3, "stiffness at large velocity"),
    Quantity("k1", "N/m", -1e5, 1e5, 1e3, "stiffness of the gas accumulator"),
    Quantity("n", "1", 1.0, 6.0, 2.0, "sharpness of the yield"),
    Quantity("x0", "m", -1e3, 1e3, 0.1, "rest position of the accumulator spring"),
)
