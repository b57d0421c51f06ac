"""Size of a damper, and the range of an effect's parameter that follows from it.

The library states its bounds, scales and starts for a laboratory damper. For a damper of another size they follow
the dimension of the unit: a force grows with the damper's force, a time derivative with its velocity over its
length. A time of electronics or flow does not belong to the size, and keeps its value. Only its upper bound grows
where the motion is slower, because slow motion hides longer delays. A time of a slow change, such as a drift,
follows the time over which the recording shows it. The end of the recording is known.
"""

import re
from itertools import product
from typing import NamedTuple

from identification.damper.parameters import Quantity


class DamperSize(NamedTuple):
    """Magnitudes of force, motion and drive of one damper, and of the time over which it is observed."""

    force: float
    """[N]"""
    length: float
    """Half of the stroke [m]."""
    velocity: float
    """Peak speed [m/s]."""
    drive: float
    """Highest drive [V or A]."""
    observation_time: float
    """Time over which slow changes are observed [s]."""
    recording_time: float
    """Time of the last recorded sample since the start of its run [s]."""


LIBRARY_SIZE = DamperSize(500.0, 0.015, 0.15, 1.0, 100.0, 100.0)
"""Size for which the library of effects states its values."""
SMALLEST_SIZE = DamperSize(5.0, 5e-4, 1e-3, 1e-2, 1.0, 0.1)
"""Smallest admitted size."""
LARGEST_SIZE = DamperSize(5e5, 1.0, 10.0, 100.0, 1e5, 1e5)
"""Largest admitted size."""
_DIMENSIONS = {
    # Exponents of newton, metre, second, drive, observation and recording.
    "1": (0, 0, 0, 0, 0, 0),
    "N": (1, 0, 0, 0, 0, 0),
    "m": (0, 1, 0, 0, 0, 0),
    "s": (0, 0, 1, 0, 0, 0),
    "{drive}": (0, 0, 0, 1, 0, 0),
    "{observation}": (0, 0, 0, 0, 1, 0),
    "{recording}": (0, 0, 0, 0, 0, 1),
    "Hz": (0, 0, -1, 0, 0, 0),
    "J": (1, 1, 0, 0, 0, 0),
    "kg": (1, -1, 2, 0, 0, 0),
}
SLOW_TIME = "{observation}"
"""Scaling of a quantity in seconds that belongs to a slow change."""
RECORDING_TIME = "{recording}"
"""Scaling of a quantity in seconds that is known from the recording."""


def compute_scale_factor(unit: str, size: DamperSize) -> float:
    """Return by how much a quantity with a unit is larger in a damper of a size than in the library's [1].

    Raises:
        KeyError: the unit contains a symbol without a dimension.
    """
    force, length, time, drive, observation, recording = _parse_dimension(unit)
    # Only with a length or a force does a time follow the motion.
    time = time if force or length else 0
    ratio = DamperSize(*(a / b for a, b in zip(size, LIBRARY_SIZE, strict=True)))
    motion = ratio.force**force * ratio.length ** (length + time) * ratio.velocity**-time
    times = ratio.observation_time**observation * ratio.recording_time**recording
    return float(motion * ratio.drive**drive * times)


def scale_quantity(quantity: Quantity, size: DamperSize) -> Quantity:
    """Return a quantity with bounds and scale for a damper of a size."""
    factor = compute_scale_factor(quantity.scaling_unit, size)
    high = quantity.high * _compute_upper_bound_factor(quantity.scaling_unit, size)
    return quantity._replace(low=quantity.low * factor, high=high, scale=quantity.scale * factor)


def widen_bounds(quantity: Quantity) -> Quantity:
    """Return a quantity with bounds that admit a damper of any size."""
    scaled = [scale_quantity(quantity, size) for size in _list_extreme_sizes()]
    return quantity._replace(low=min(q.low for q in scaled), high=max(q.high for q in scaled))


def _compute_upper_bound_factor(unit: str, size: DamperSize) -> float:
    """Return by how much the upper bound of a quantity is larger in a damper of a size [1]."""
    if unit != "s":
        return compute_scale_factor(unit, size)
    slowness = (size.length / size.velocity) / (LIBRARY_SIZE.length / LIBRARY_SIZE.velocity)
    return max(slowness, 1.0)


def _list_extreme_sizes() -> list[DamperSize]:
    """Return all combinations of smallest and largest magnitudes."""
    return [DamperSize(*values) for values in product(*zip(SMALLEST_SIZE, LARGEST_SIZE, strict=True))]


def _parse_dimension(unit: str) -> tuple[int, ...]:
    """Return the exponents of newton, metre, second, drive and observation of a unit such as ``N s^2/m^2``."""
    numerator, _, denominator = unit.partition("/")
    total = [0] * len(DamperSize._fields)
    for part, sign in ((numerator, 1), (denominator, -1)):
        for symbol, power in re.findall(r"([^\s()^]+)(?:\^(\d+))?", part):
            for i, exponent in enumerate(_DIMENSIONS[symbol]):
                total[i] += sign * exponent * int(power or 1)
    return tuple(total)
