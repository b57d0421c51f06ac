"""Conditions in which runs differ: a different force has then another cause than the damper."""

from collections.abc import Iterator

from bench.comparison.document import ComparedRun, Difference, Quantity, Stroke

_TEMPERATURE_K = 2.0
"""Difference of temperature from which it is named [K]: the oil of a damper loses some percent of viscosity."""
_SHARE = 0.02
"""Difference of stroke, rate or drive from which it is named, over the value of the first run."""
_PRELOAD_SHARE = 0.02
"""Difference of the preload from which it is named, over the peak force of the first run."""
_MIN_DRIVE = 0.01
"""Difference of drive that is always tolerated [V or A]."""


def compare_identity(first: ComparedRun, other: ComparedRun) -> Iterator[Difference]:
    """Yield the differences of specimen and method."""
    facts: tuple[tuple[Quantity, str, str], ...] = (
        ("specimen", first.specimen, other.specimen),
        ("method", first.method, other.method),
    )
    for quantity, one, two in facts:
        if one != two:
            text = f"{quantity}: {one or 'unnamed'} against {two or 'unnamed'}"
            yield Difference(
                quantity=quantity, run=other.run, segment="", first=None, other=None, unit="", text=text
            )


def compare_conditions(first: Stroke, other: Stroke, drive_unit: str) -> Iterator[Difference]:
    """Yield the differences of temperature, stroke, rate, drive and preload of two strokes."""
    peak = max(first.peak_tension_n, -first.peak_compression_n)
    drive_limit = max(_SHARE * abs(first.drive), _MIN_DRIVE)
    found: tuple[tuple[Quantity, float | None, float | None, str, float, int], ...] = (
        ("temperature", first.temperature_c, other.temperature_c, "°C", _TEMPERATURE_K, 1),
        ("stroke", first.amplitude_m, other.amplitude_m, "mm", _SHARE * first.amplitude_m, 2),
        ("rate", first.frequency_hz, other.frequency_hz, "Hz", _SHARE * first.frequency_hz, 3),
        ("drive", first.drive, other.drive, drive_unit, drive_limit, 3),
        ("preload", first.preload_n, other.preload_n, "N", _PRELOAD_SHARE * peak, 1),
    )
    for quantity, one, two, unit, limit, digits in found:
        if one is not None and two is not None and abs(one - two) > limit:
            text = f"{quantity}: {_format(one, unit, digits)} against {_format(two, unit, digits)}"
            yield Difference(
                quantity=quantity,
                run=other.run,
                segment=first.segment,
                first=one,
                other=two,
                unit="m" if unit == "mm" else unit,
                text=text,
            )


def _format(value: float, unit: str, digits: int) -> str:
    shown = value * 1e3 if unit == "mm" else value
    return f"{round(shown, digits) + 0.0:g} {unit}"  # adding zero turns -0 into 0
