"""Strokes that could be added to a method without passing its limits.

Sines from long and slow to short and swift and a slow triangle, each with a drive that steps inside the strokes,
one that climbs from stroke to stroke, and one that stays highest. What they would tell is not known here.
"""

import math
from collections.abc import Iterator
from typing import Any

from pydantic import TypeAdapter

from bench.errors import MethodError
from bench.methods.compile import Programme, compile_method
from bench.methods.document import Conditioning, Method, Segment
from bench.methods.envelope import envelope

SECONDS = 10.0
"""[s] length of an addition."""
MARGIN = 0.9
"""[1] share of the limits of velocity and acceleration that an addition uses."""
SHARES = (1.0, 0.5, 0.2)
"""[1] of the method's own largest stroke."""
PARTS = (1.0, 0.4, 0.15)
"""[1] of the highest frequency that the limits allow."""
LEVELS = (0.2, 1.0, 0.0, 0.6, 1.0, 0.4, 0.8, 0.0, 1.0, 0.2, 0.6, 0.0, 0.8, 0.4, 1.0, 0.0, 0.4, 0.0, 0.6, 0.2)
"""[1] of the largest drive: steps of every height, up and down."""

_DOCUMENT = TypeAdapter(Segment)


def additions(programme: Programme) -> list[tuple[Segment, Programme]]:
    """Segments that could be added to a programme's method, each compiled by itself; none beyond its limits."""
    found = []
    for content in _contents(programme):
        segment = _DOCUMENT.validate_python(content)
        alone = programme.method.model_copy(update={"segments": (segment,), "conditioning": Conditioning()})
        if (compiled := _within_limits(alone)) is not None:
            found.append((segment, compiled))
    return found


def _within_limits(method: Method) -> Programme | None:
    try:
        compiled = compile_method(method)
    except MethodError:
        return None
    return compiled if envelope(compiled).verdict == "within limits" else None


def _contents(programme: Programme) -> Iterator[dict[str, Any]]:
    for motion in _motions(programme):
        for kind, drive in _drives(programme.method.limits.drive).items():
            size = f"{1e3 * motion['amplitude_m']:g}mm_{motion['frequency_hz']:g}Hz"
            yield {
                "name": f"add_{motion['kind']}_{size}_{kind}",
                "motion": motion,
                "duration_s": SECONDS,
                "drive": drive,
            }


def _motions(programme: Programme) -> Iterator[dict[str, Any]]:
    limits, largest = programme.method.limits, float(abs(programme.displacement).max())
    for share in SHARES:
        amplitude = _two_digits(share * (largest or 0.5 * limits.stroke_m))
        highest = MARGIN * min(
            limits.velocity_mps / (2 * math.pi * amplitude),
            math.sqrt(limits.acceleration_mps2 / amplitude) / (2 * math.pi),
        )
        for part in PARTS:
            yield {"kind": "sine", "amplitude_m": amplitude, "frequency_hz": _two_digits(part * highest)}
        slow = _two_digits(0.1 * highest)
        # Some ten times the least that a triangle of this size can have, 32 amplitude frequency².
        corners = _two_digits(300 * amplitude * slow**2)
        yield {
            "kind": "triangle",
            "amplitude_m": amplitude,
            "frequency_hz": slow,
            "corner_acceleration_mps2": corners,
        }


def _drives(highest: float) -> dict[str, dict[str, Any]]:
    every = SECONDS / len(LEVELS)
    steps = [_two_digits(level * highest) for level in LEVELS]
    return {
        "steps": {"kind": "steps", "time_s": [k * every for k in range(len(steps))], "values": steps},
        "levels": {"kind": "staircase", "levels": [_two_digits(k / 4 * highest) for k in range(5)]},
        "highest": {"kind": "constant", "value": highest},
    }


def _two_digits(value: float) -> float:
    """Rounded down to two digits, so that no limit is passed by rounding."""
    if value <= 0:
        return 0.0
    step = float(10.0 ** (math.floor(math.log10(value)) - 1))
    return float(f"{math.floor(value / step + 1e-9) * step:.2g}")
