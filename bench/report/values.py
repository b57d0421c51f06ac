"""Numbers as a person reads them: rounded to what is known of them, each with its unit."""

import math
from typing import NamedTuple

_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"))
_PREFIXED = ("m", "s")
_SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_SYMMETRIC = 0.25
"""[1] how far the halves of an interval may differ to be written with one ±."""


class Shown(NamedTuple):
    """A quantity in words."""

    value: str
    """With its interval."""
    unit: str

    def __str__(self) -> str:
        return f"{self.value} {self.unit}".strip()


def significant(value: float, digits: int = 3) -> str:
    """A number with so many significant digits, never in powers of ten."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    return _fixed(round(value, decimals), decimals)


def rounded(value: float, uncertainty: float) -> str:
    """A number rounded to the first digit of its uncertainty, which is positive."""
    return _fixed(value, -math.floor(math.log10(uncertainty)))


def newton(force: float) -> str:
    """A force [N] with unit."""
    return f"{significant(force)} N"


def times(ratio: float) -> str:
    """A ratio [1] in words."""
    return f"{ratio:.2f} times" if ratio < 10 else f"{significant(ratio)} times"


def percent(share: float) -> str:
    """A share [1] in percent, two significant digits."""
    return f"{significant(100 * share, 2)} %"


def level(drive: float, span: float) -> str:
    """A drive [V or A], rounded to a five-hundredth of the drives' span."""
    quantum = 10.0 ** math.floor(math.log10(span / 500)) if span > 0 else 1e-4
    # The added zero takes the sign off a negative one.
    return f"{round(drive / quantum) * quantum + 0.0:.6g}"


def unit_text(unit: str) -> str:
    """A unit as it is typeset."""
    return unit.replace("^n", "ⁿ").replace(" ", "·")


def quantity(value: float, interval: tuple[float, float] | None, unit: str) -> Shown:
    """A number with its interval, in a handy multiple of its unit.

    ``± h`` where both halves of the interval are alike, the larger being given; ``(from … to)`` where they are
    not. Two significant digits of the half interval decide where the number is rounded.
    """
    scale, prefix, power = _multiple(value, interval, unit)
    shown_unit = prefix + unit_text(unit)
    if interval is None:
        return Shown(_powered(f"{value / scale:.4g}".replace("-", "−"), power), shown_unit)
    low, high = sorted((interval[0] / scale, interval[1] / scale))
    below, above = value / scale - low, high - value / scale
    half = max(below, above)
    if half <= 1e-12 * abs(value / scale) or not math.isfinite(half):
        return Shown(_powered(significant(value / scale, 6), power), shown_unit)
    decimals = 1 - math.floor(math.log10(half))
    if abs(above - below) <= _SYMMETRIC * half:
        text = f"{_fixed(value / scale, decimals)} ± {_fixed(half, decimals)}"
        return Shown(_powered(f"({text})" if power else text, power), shown_unit)
    text = f"{significant(value / scale)} ({significant(low, 2)} … {significant(high, 2)})"
    return Shown(_powered(f"[{text}]" if power else text, power), shown_unit)


def _multiple(value: float, interval: tuple[float, float] | None, unit: str) -> tuple[float, str, int]:
    """Scale, prefix and power of ten that make a number handy."""
    size = abs(value) or max((abs(end) for end in interval or ()), default=0.0)
    if size == 0:
        return 1.0, "", 0
    if unit in _PREFIXED:
        scale, prefix = next((p for p in _PREFIXES if size >= p[0]), _PREFIXES[-1])
        return scale, prefix, 0
    power = math.floor(math.log10(size))
    return (10.0**power, "", power) if power >= 5 or power < -2 else (1.0, "", 0)


def _powered(text: str, power: int) -> str:
    return f"{text} × 10{str(power).translate(_SUPERSCRIPT)}" if power else text


def _fixed(value: float, decimals: int) -> str:
    """A number rounded to decimals, which may be negative; with a true minus sign and never a negative zero."""
    rounded = round(value, decimals) + 0.0  # takes the sign off a zero
    return f"{rounded:.{max(0, decimals)}f}".replace("-", "−")
