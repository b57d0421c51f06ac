"""Size of a damper, and the range of an effect's parameter that follows from it.

The library states its bounds, scales and starts for a laboratory damper. For a damper of another size they follow
the dimension of the unit: a force grows with the damper's force, a time derivative with its velocity over its
length. A pure time belongs to electronics, heat or flow, not to the size, and keeps its value.
"""

import re
from itertools import product
from typing import NamedTuple

from identification.damper.parameters import Quantity


class DamperSize(NamedTuple):
    """Magnitudes of force, motion and drive of one damper."""

    force: float
    """[N]"""
    length: float
    """Half of the stroke [m]."""
    velocity: float
    """Peak speed [m/s]."""
    drive: float
    """Highest drive [V or A]."""


LIBRARY_SIZE = DamperSize(500.0, 0.015, 0.15, 1.0)
"""Size for which the library of effects states its values."""
SMALLEST_SIZE = DamperSize(5.0, 5e-4, 1e-3, 1e-2)
"""Smallest admitted size."""
LARGEST_SIZE = DamperSize(5e5, 1.0, 10.0, 100.0)
"""Largest admitted size."""
_DIMENSIONS = {
    # Exponents of newton, metre, second and drive.
    "1": (0, 0, 0, 0),
    "N": (1, 0, 0, 0),
    "m": (0, 1, 0, 0),
    "s": (0, 0, 1, 0),
    "{drive}": (0, 0, 0, 1),
    "Hz": (0, 0, -1, 0),
    "J": (1, 1, 0, 0),
    "kg": (1, -1, 2, 0),
}


def compute_scale_factor(unit: str, size: DamperSize) -> float:
    """Return by how much a quantity with a unit is larger in a damper of a size than in the library's [1].

    Raises:
        KeyError: the unit contains a symbol without a dimension.
    """
    force, length, time, drive = _parse_dimension(unit)
    # Only with a length or a force does a time follow the motion.
    time = time if force or length else 0
    ratio = DamperSize(*(a / b for a, b in zip(size, LIBRARY_SIZE, strict=True)))
    return float(ratio.force**force * ratio.length ** (length + time) * ratio.velocity**-time * ratio.drive**drive)


def scale_quantity(quantity: Quantity, size: DamperSize) -> Quantity:
    """Return a quantity with bounds and scale for a damper of a size."""
    factor = compute_scale_factor(quantity.scaling_unit, size)
    return quantity._replace(low=quantity.low * factor, high=quantity.high * factor, scale=quantity.scale * factor)


def widen_bounds(quantity: Quantity) -> Quantity:
    """Return a quantity with bounds that admit a damper of any size."""
    factors = [compute_scale_factor(quantity.scaling_unit, size) for size in _list_extreme_sizes()]
    low = quantity.low * (min(factors) if quantity.low > 0.0 else max(factors))
    return quantity._replace(low=low, high=quantity.high * max(factors))


def _list_extreme_sizes() -> list[DamperSize]:
    """Return all combinations of smallest and largest force, length, velocity and drive."""
    return [DamperSize(*values) for values in product(*zip(SMALLEST_SIZE, LARGEST_SIZE, strict=True))]


def _parse_dimension(unit: str) -> tuple[int, int, int, int]:
    """Return the exponents of newton, metre, second and drive of a unit such as ``N s^2/m^2``."""
    numerator, _, denominator = unit.partition("/")
    total = [0, 0, 0, 0]
    for part, sign in ((numerator, 1), (denominator, -1)):
        for symbol, power in re.findall(r"([^\s()^]+)(?:\^(\d+))?", part):
            for i, exponent in enumerate(_DIMENSIONS[symbol]):
                total[i] += sign * exponent * int(power or 1)
    return total[0], total[1], total[2], total[3]
