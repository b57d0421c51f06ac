"""Candidate strokes that can be added to a method without exceeding its limits.

They are sines from long and slow to short and fast, and a slow triangle. Each is combined with a drive that steps
within the strokes, one that rises in a staircase, and one that is constant at its maximum.
"""

import math
from collections.abc import Iterator
from typing import Any

from pydantic import TypeAdapter

from bench.errors import MethodError
from bench.methods.compile import Programme, compile_method
from bench.methods.document import Conditioning, Method, MethodLimits, MethodSegment
from bench.methods.envelope import compute_envelope

CANDIDATE_DURATION = 10.0
"""Duration [s] of a candidate stroke."""
LIMIT_SHARE = 0.9
"""Share of the limits of velocity and acceleration that a candidate stroke uses."""
AMPLITUDE_SHARES = (1.0, 0.5, 0.2)
"""Amplitudes over the largest displacement of the method."""
FREQUENCY_SHARES = (1.0, 0.4, 0.15)
"""Frequencies over the highest frequency that the limits allow."""
DRIVE_LEVELS = (0.2, 1.0, 0.0, 0.6, 1.0, 0.4, 0.8, 0.0, 1.0, 0.2, 0.6, 0.0, 0.8, 0.4, 1.0, 0.0, 0.4, 0.0, 0.6, 0.2)
"""Levels over the largest drive: steps of all heights, up and down."""

_SEGMENT_ADAPTER = TypeAdapter(MethodSegment)


def make_candidate_strokes(programme: Programme) -> list[tuple[MethodSegment, Programme]]:
    """Return segments that can be added to a programme's method within its limits, each compiled separately."""
    candidates = []
    for content in _make_documents(programme):
        segment = _SEGMENT_ADAPTER.validate_python(content)
        method = programme.method.model_copy(update={"segments": (segment,), "conditioning": Conditioning()})
        if (compiled := _compile_within_limits(method)) is not None:
            candidates.append((segment, compiled))
    return candidates


def _compile_within_limits(method: Method) -> Programme | None:
    try:
        compiled = compile_method(method)
    except MethodError:
        return None
    return compiled if compute_envelope(compiled).verdict == "within limits" else None


def _make_documents(programme: Programme) -> Iterator[dict[str, Any]]:
    for motion in _make_motions(programme):
        for kind, drive in _make_drives(programme.method.limits.drive).items():
            size = f"{1e3 * motion['amplitude_m']:g}mm_{motion['frequency_hz']:g}Hz"
            yield {
                "name": f"add_{motion['kind']}_{size}_{kind}",
                "motion": motion,
                "duration_s": CANDIDATE_DURATION,
                "drive": drive,
            }


def _compute_max_frequency(limits: MethodLimits, amplitude: float) -> float:
    """Return the highest frequency [Hz] of a sine of an amplitude [m] within the limits."""
    return LIMIT_SHARE * min(
        limits.velocity_mps / (2 * math.pi * amplitude),
        math.sqrt(limits.acceleration_mps2 / amplitude) / (2 * math.pi),
    )


def _make_motions(programme: Programme) -> Iterator[dict[str, Any]]:
    limits, largest = programme.method.limits, float(abs(programme.displacement).max())
    for share in AMPLITUDE_SHARES:
        amplitude = _round_down(share * (largest or 0.5 * limits.stroke_m))
        highest = _compute_max_frequency(limits, amplitude)
        for frequency_share in FREQUENCY_SHARES:
            frequency = _round_down(frequency_share * highest)
            yield {"kind": "sine", "amplitude_m": amplitude, "frequency_hz": frequency}
        slow = _round_down(0.1 * highest)
        # About ten times the smallest possible acceleration of this triangle, 32 amplitude frequency².
        corner_acceleration = _round_down(300 * amplitude * slow**2)
        yield {
            "kind": "triangle",
            "amplitude_m": amplitude,
            "frequency_hz": slow,
            "corner_acceleration_mps2": corner_acceleration,
        }


def _make_drives(highest: float) -> dict[str, dict[str, Any]]:
    interval = CANDIDATE_DURATION / len(DRIVE_LEVELS)
    steps = [_round_down(level * highest) for level in DRIVE_LEVELS]
    return {
        "steps": {"kind": "steps", "time_s": [k * interval for k in range(len(steps))], "values": steps},
        "levels": {"kind": "staircase", "levels": [_round_down(k / 4 * highest) for k in range(5)]},
        "highest": {"kind": "constant", "value": highest},
    }


def _round_down(value: float) -> float:
    """Round down to two digits, so that rounding exceeds no limit."""
    if value <= 0:
        return 0.0
    step = float(10.0 ** (math.floor(math.log10(value)) - 1))
    return float(f"{math.floor(value / step + 1e-9) * step:.2g}")
