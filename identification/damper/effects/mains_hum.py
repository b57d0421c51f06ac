"""Mains interference in the force channel: a line near 50 or 60 Hz, on some rigs with its third harmonic."""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def compute_mains_line(time: Any, drive: Any, cosine: Any, sine: Any, frequency: Any) -> Any:
    """Return the added force [N] of the fundamental at a time [s]; the drive has no influence."""
    angle = 2.0 * np.pi * frequency * time
    return cosine * np.cos(angle) + sine * np.sin(angle) + 0.0 * drive


def compute_mains_harmonics(
    time: Any, drive: Any, cosine: Any, sine: Any, cosine_third: Any, sine_third: Any, frequency: Any
) -> Any:
    """Return the added force [N] of the fundamental and its third harmonic."""
    angle = 2.0 * np.pi * frequency * time
    first = cosine * np.cos(angle) + sine * np.sin(angle)
    return first + cosine_third * np.cos(3.0 * angle) + sine_third * np.sin(3.0 * angle) + 0.0 * drive


_COSINE = Quantity("cosine", "N", -1e4, 1e4, 2.0, "cosine of the fundamental")
_SINE = Quantity("sine", "N", -1e4, 1e4, 2.0, "sine of the fundamental")
_FREQUENCY = Quantity("frequency", "Hz", 45.0, 65.0, 50.0, "mains frequency")

MAINS_HUM = Effect(
    name="mains_hum",
    stage="force_channel",
    variable="time",
    meaning="mains interference adds to the recorded force",
    forms=(
        Form(
            "fundamental",
            "additive_force",
            (_COSINE, _SINE, _FREQUENCY),
            ((0.0, 0.0, 50.0), (0.0, 0.0, 60.0)),
            compute_mains_line,
        ),
        Form(
            "third_harmonic",
            "additive_force",
            (
                _COSINE,
                _SINE,
                Quantity("cosine_third", "N", -1e4, 1e4, 1.0, "cosine of the third harmonic"),
                Quantity("sine_third", "N", -1e4, 1e4, 1.0, "sine of the third harmonic"),
                _FREQUENCY,
            ),
            ((0.0, 0.0, 0.0, 0.0, 50.0), (0.0, 0.0, 0.0, 0.0, 60.0)),
            compute_mains_harmonics,
        ),
    ),
)
