"""Units and senses in which other machines record, and their conversion to those of a log.

All factors are exact by definition (NIST SP 811, appendix B).
"""

from collections.abc import Collection, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bench.errors import RecordingError


class Conversion(NamedTuple):
    """Value in the unit of a log: factor times the recorded value, plus offset."""

    factor: float
    offset: float = 0.0

    def apply(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return converted values (N,)."""
        return self.factor * values + self.offset

    def reverse(self) -> "Conversion":
        """Return the conversion with the opposite sense."""
        return Conversion(-self.factor, -self.offset)


_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
_FORCES = {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605, "kgf": 9.80665}
UNITS: dict[str, dict[str, Conversion]] = {
    "time_s": {name: Conversion(factor) for name, factor in _TIMES.items()},
    "displacement_m": {name: Conversion(factor) for name, factor in _LENGTHS.items()},
    "velocity_mps": {f"{name}/s": Conversion(factor) for name, factor in _LENGTHS.items()},
    "force_n": {name: Conversion(factor) for name, factor in _FORCES.items()},
    "voltage_v": {"V": Conversion(1.0), "mV": Conversion(1e-3)},
    "current_a": {"A": Conversion(1.0), "mA": Conversion(1e-3)},
    "temperature_c": {
        "degC": Conversion(1.0),
        "degF": Conversion(1.0 / 1.8, -32.0 / 1.8),
        "K": Conversion(1.0, -273.15),
    },
}
"""Conversions by column and unit; the first unit of each column is that of a log."""
REVERSIBLE_COLUMNS = ("displacement_m", "velocity_mps", "force_n", "voltage_v", "current_a")
"""Columns that may be recorded in the opposite sense."""


def make_conversions(units: Mapping[str, str], reversed_columns: Collection[str]) -> dict[str, Conversion]:
    """Return the conversion of each column that needs one.

    Args:
        units: unit in the file by column name.
        reversed_columns: names of the columns whose sense is opposite.

    Raises:
        RecordingError: a column has no such unit, or no sense; the message lists those it may have.
    """
    conversions: dict[str, Conversion] = {}
    for column, unit in units.items():
        if column not in UNITS:
            raise _make_refusal(f"a column {column}", "columns are", UNITS)
        if unit not in UNITS[column]:
            raise _make_refusal(f"{column} in {unit}", f"units of {column} are", UNITS[column])
        conversions[column] = UNITS[column][unit]
    for column in reversed_columns:
        if column not in REVERSIBLE_COLUMNS:
            raise _make_refusal(f"{column} reversed", "columns with a sense are", REVERSIBLE_COLUMNS)
        conversions[column] = conversions.get(column, Conversion(1.0)).reverse()
    return conversions


def _make_refusal(what: str, advice: str, names: Collection[str]) -> RecordingError:
    return RecordingError(f"a file with {what} cannot be imported; {advice} {', '.join(names)}")
