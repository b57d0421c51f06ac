"""Drift of the force channel's zero: electronics that warm up, a load cell that creeps.

The zero settles towards another value, oscillates slowly, or follows a wave with five overtones. A wave describes
the drift of the recorded time only. Where its period is longer than the recording, its amplitudes may be many
times the drift, and its continuation as large as they are. So the zero is held at its last value after the
recording.
"""

from typing import Any

import numpy as np

from identification.damper.damper_size import RECORDING_TIME, SLOW_TIME
from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def compute_settling_drift(time: Any, drive: Any, change: Any, duration: Any) -> Any:
    """Return the added force [N] of a zero that settles, at a time [s]; the drive has no influence."""
    return change * (1.0 - np.exp(-time / duration)) + 0.0 * drive


def compute_sinusoidal_drift(time: Any, drive: Any, cosine: Any, sine: Any, period: Any, end: Any) -> Any:
    """Return the added force [N] of a zero that follows one slow wave until its end [s]."""
    angle = 2.0 * np.pi * np.minimum(time, end) / period
    return cosine * np.cos(angle) + sine * np.sin(angle) + 0.0 * drive


def compute_harmonic_drift(time: Any, drive: Any, *parts: Any) -> Any:
    """Return the added force [N] of a slow wave with overtones until its end.

    ``parts`` holds cosine and sine [N] of each order, then the period and the end [s].
    """
    *_, period, end = parts
    angle = 2.0 * np.pi * np.minimum(time, end) / period
    wave = 0.0 * angle + 0.0 * drive
    for k in range(len(parts) // 2 - 1):
        wave = wave + parts[2 * k] * np.cos((k + 1.0) * angle) + parts[2 * k + 1] * np.sin((k + 1.0) * angle)
    return wave


_HARMONICS = tuple(
    Quantity(f"{part}_{order}", "N", -1e4, 1e4, 5.0, f"{part} of the wave at {order} times its frequency")
    for order in range(1, 7)
    for part in ("cosine", "sine")
)

_END = Quantity(
    "end", "s", 100.0, 100.0, 100.0, "end of the recording, after which the zero is held", RECORDING_TIME
)

FORCE_DRIFT = Effect(
    name="force_drift",
    stage="force_channel",
    variable="time",
    meaning="the zero of the load cell drifts",
    forms=(
        Form(
            "settling",
            "additive_force",
            (
                Quantity("change", "N", -1e4, 1e4, 5.0, "final change of the zero"),
                Quantity("duration", "s", 3.0, 3000.0, 60.0, "time constant of that change", SLOW_TIME),
            ),
            ((0.0, 10.0), (0.0, 40.0), (0.0, 400.0)),
            compute_settling_drift,
        ),
        Form(
            "sinusoidal",
            "additive_force",
            (
                Quantity("cosine", "N", -1e4, 1e4, 5.0, "cosine of the zero's wave"),
                Quantity("sine", "N", -1e4, 1e4, 5.0, "sine of the zero's wave"),
                Quantity("period", "s", 10.0, 3000.0, 100.0, "period of that wave", SLOW_TIME),
                _END,
            ),
            tuple((0.0, 0.0, period, 100.0) for period in (25.0, 50.0, 100.0, 250.0)),
            compute_sinusoidal_drift,
        ),
        Form(
            "harmonic",
            "additive_force",
            (
                *_HARMONICS,
                Quantity("period", "s", 60.0, 3000.0, 100.0, "period of the slowest wave", SLOW_TIME),
                _END,
            ),
            tuple((0.0,) * len(_HARMONICS) + (period, 100.0) for period in (70.0, 140.0)),
            compute_harmonic_drift,
        ),
    ),
)
