"""Trial segments: strokes inside the limits of a recording, among which the next stroke is chosen."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.simulate import Excitation

_RATE = 1000.0
"""Sampling rate of the trial segments [Hz]."""
_TARGET_DURATION = 6.0
"""Approximate duration of a trial segment [s]."""
_FADE = 0.5
"""Duration of the fades at both ends of a segment [s]."""
_AMPLITUDE_SHARES = (1.0, 0.5, 0.2)
"""Amplitudes of the sines, relative to the limit."""
_FREQUENCY_SHARES = (1.0, 0.4, 0.15)
"""Frequencies of the sines, relative to the highest that the limits allow at their amplitude."""
_MAX_FREQUENCY_RATIO = 2.0
"""Highest frequency of a sine, relative to the highest recorded one."""
_TRIANGLE_SPEED_SHARE = 0.3
"""Speed of the triangle, relative to the limit."""
_LOWEST_FREQUENCY = 0.2
"""Lowest frequency of a trial segment [Hz]."""
_CORNER_ACCELERATION = 300.0
"""Acceleration in the corners of the triangle, relative to amplitude times squared frequency."""
_CORNER_ROUNDING = 0.98
"""Rounding of the triangle's corners; 1 would be a sharp triangle."""


@dataclass(frozen=True)
class StrokeLimits:
    """Limits of a trial segment, which are those of the recording."""

    amplitude: float
    """Amplitude [m]."""
    centre: float
    """Centre of the motion [m]."""
    velocity: float
    """Velocity [m/s]."""
    frequency: float
    """Frequency [Hz]."""
    drives: tuple[float, float]
    """Lowest and highest drive [V or A]."""


def generate_trial_segments(limits: StrokeLimits) -> Iterator[tuple[dict[str, Any], Excitation]]:
    """Yield segments of a method with their excitations."""
    for motion, drive in itertools.product(_generate_motions(limits), _make_drives(*limits.drives)):
        cycles = _count_cycles(motion["frequency_hz"], len(drive.get("levels", [0])))
        segment = {
            "name": _format_name(motion, drive),
            "motion": motion,
            "centre_m": round(limits.centre, 5),
            "fade_s": _FADE,
            "cycles": cycles,
            "drive": drive,
        }
        yield segment, _make_excitation(motion, drive, limits.centre, cycles)


def _make_drives(low: float, high: float) -> list[dict[str, Any]]:
    """Return constant drives and, if the drive may change, a staircase up and down."""
    middle = 0.5 * (low + high)
    drives: list[dict[str, Any]] = [
        {"kind": "constant", "value": round(level, 4)} for level in sorted({low, middle, high})
    ]
    if high > low:
        # Only steps excite the coil. Levels passed upwards and downwards differ if the field has a memory.
        levels = [round(v, 4) for v in (low, middle, high, middle, low)]
        drives.append({"kind": "staircase", "levels": levels})
    return drives


def _count_cycles(frequency: float, levels: int) -> int:
    """Return the number of cycles of about the target duration, the same at every level of the drive."""
    return levels * max(1, round(_TARGET_DURATION * frequency / levels))


def _generate_motions(limits: StrokeLimits) -> Iterator[dict[str, Any]]:
    """Yield sines of several amplitudes and frequencies, and a triangle, whose velocity is constant."""
    for amplitude_share in _AMPLITUDE_SHARES:
        amplitude = amplitude_share * limits.amplitude
        highest = min(limits.velocity / (2 * np.pi * amplitude), _MAX_FREQUENCY_RATIO * limits.frequency)
        for frequency_share in _FREQUENCY_SHARES:
            yield {
                "kind": "sine",
                "amplitude_m": _round(amplitude),
                "frequency_hz": _round(max(frequency_share * highest, _LOWEST_FREQUENCY)),
            }
    frequency = _TRIANGLE_SPEED_SHARE * limits.velocity / (4 * limits.amplitude)
    frequency, amplitude = _round(max(frequency, _LOWEST_FREQUENCY)), _round(limits.amplitude)
    yield {
        "kind": "triangle",
        "amplitude_m": amplitude,
        "frequency_hz": frequency,
        "corner_acceleration_mps2": _round(_CORNER_ACCELERATION * amplitude * frequency**2),
    }


def _round(value: float) -> float:
    """Round to three significant digits, as a person would write a method."""
    return float(f"{value:.3g}")


def _format_name(motion: dict[str, Any], drive: dict[str, Any]) -> str:
    size = f"{1e3 * motion['amplitude_m']:.3g}mm_{motion['frequency_hz']:.3g}Hz"
    level = f"{drive['value']:.3g}" if drive["kind"] == "constant" else "steps"
    return f"next_{motion['kind']}_{size}_{level}"


def _make_excitation(motion: dict[str, Any], drive: dict[str, Any], centre: float, cycles: int) -> Excitation:
    """Sample a segment without its fades."""
    seconds = cycles / motion["frequency_hz"]
    time = np.arange(round(seconds * _RATE)) / _RATE
    amplitude, omega = motion["amplitude_m"], 2 * np.pi * motion["frequency_hz"]
    if motion["kind"] == "sine":
        x, v = amplitude * np.sin(omega * time), amplitude * omega * np.cos(omega * time)
        a = -amplitude * omega**2 * np.sin(omega * time)
    else:
        shape = np.arcsin(_CORNER_ROUNDING * np.sin(omega * time)) / np.arcsin(_CORNER_ROUNDING)
        x = amplitude * shape
        v = np.gradient(x, time)
        a = np.gradient(v, time)
    levels = drive.get("levels") or [drive["value"]]
    steps = np.asarray(levels)[np.minimum((time / seconds * len(levels)).astype(int), len(levels) - 1)]
    return Excitation(_RATE, centre + x, v, a, steps.astype(float))
