"""Formatting of numbers, rounded to their uncertainty and with their unit."""

import math
import re
from typing import NamedTuple

_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"))
_PREFIXED_UNITS = ("m", "s")
_SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_SYMMETRY_TOLERANCE = 0.25
"""Largest relative difference of the halves of an interval that is written with ±."""


class FormattedQuantity(NamedTuple):
    """A quantity as text."""

    value: str
    """Value with its interval."""
    unit: str

    def __str__(self) -> str:
        return f"{self.value} {self.unit}".strip()


def format_significant(value: float, digits: int = 3) -> str:
    """Format a number with significant digits, without a power of ten."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    return _format_fixed(round(value, decimals), decimals)


def format_rounded(value: float, uncertainty: float) -> str:
    """Format a number rounded to the first digit of its (positive) uncertainty."""
    return _format_fixed(value, -math.floor(math.log10(uncertainty)))


def format_force(force: float) -> str:
    """Format a force [N] with unit."""
    return f"{format_significant(force)} N"


def format_ratio(ratio: float) -> str:
    """Format a ratio as a multiple."""
    return f"{ratio:.2f} times" if ratio < 10 else f"{format_significant(ratio)} times"


def format_percent(share: float) -> str:
    """Format a share in percent with two significant digits."""
    return f"{format_significant(100 * share, 2)} %"


def format_share(share: float, interval: tuple[float, float] | None) -> str:
    """Format a share in percent with its interval."""
    bounds = f" ({format_percent(interval[0])} to {format_percent(interval[1])})" if interval else ""
    return f"{format_percent(share)}{bounds}"


def format_drive(drive: float, span: float) -> str:
    """Format a drive [V or A], rounded to a five-hundredth of the drives' span."""
    quantum = 10.0 ** math.floor(math.log10(span / 500)) if span > 0 else 1e-4
    # Adding zero removes the sign of a negative zero.
    return f"{round(drive / quantum) * quantum + 0.0:.6g}"


def format_unit(unit: str) -> str:
    """Return the typeset unit."""
    powers = re.sub(r"\^(-?\d+)", lambda match: match[1].translate(_SUPERSCRIPT), unit)
    return powers.replace("^n", "ⁿ").replace(" ", "·")


def format_name(name: str) -> str:
    """Return the name of an effect, stage, place, variable or parameter without underscores."""
    return name.replace("_", " ")


def format_quantity(value: float, interval: tuple[float, float] | None, unit: str) -> FormattedQuantity:
    """Format a number with its interval, in a suitable multiple of its unit.

    An interval is written as ``± h`` with the larger half if both halves are similar, else as ``(from … to)``.
    The number is rounded to two significant digits of the half interval.
    """
    scale, prefix, power = _choose_multiple(value, interval, unit)
    unit_text = prefix + format_unit(unit)
    if interval is None:
        return FormattedQuantity(_append_power(f"{value / scale:.4g}".replace("-", "−"), power), unit_text)
    low, high = sorted((interval[0] / scale, interval[1] / scale))
    below, above = value / scale - low, high - value / scale
    half = max(below, above)
    if half <= 1e-12 * abs(value / scale) or not math.isfinite(half):
        return FormattedQuantity(_append_power(format_significant(value / scale, 6), power), unit_text)
    decimals = 1 - math.floor(math.log10(half))
    if abs(above - below) <= _SYMMETRY_TOLERANCE * half:
        text = f"{_format_fixed(value / scale, decimals)} ± {_format_fixed(half, decimals)}"
        return FormattedQuantity(_append_power(f"({text})" if power else text, power), unit_text)
    text = f"{format_significant(value / scale)} ({format_significant(low, 2)} … {format_significant(high, 2)})"
    return FormattedQuantity(_append_power(f"[{text}]" if power else text, power), unit_text)


def _choose_multiple(value: float, interval: tuple[float, float] | None, unit: str) -> tuple[float, str, int]:
    """Return scale, prefix and power of ten of a suitable multiple."""
    # A value that is small against its interval has the multiple of the interval.
    half = (max(interval) - min(interval)) / 2 if interval else 0.0
    size = max(abs(value), half if math.isfinite(half) else 0.0)
    if size == 0:
        return 1.0, "", 0
    if unit in _PREFIXED_UNITS:
        scale, prefix = next((p for p in _PREFIXES if size >= p[0]), _PREFIXES[-1])
        return scale, prefix, 0
    power = math.floor(math.log10(size))
    return (10.0**power, "", power) if power >= 5 or power < -2 else (1.0, "", 0)


def _append_power(text: str, power: int) -> str:
    return f"{text} × 10{str(power).translate(_SUPERSCRIPT)}" if power else text


def _format_fixed(value: float, decimals: int) -> str:
    """Format a number rounded to decimals (may be negative), with a minus sign but without a negative zero."""
    rounded = round(value, decimals) + 0.0  # removes the sign of a zero
    return f"{rounded:.{max(0, decimals)}f}".replace("-", "−")
