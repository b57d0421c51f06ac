"""Hum of the mains in the force channel: a line near 50 or 60 Hz, and on some rigs its third harmonic."""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def line(time: Any, drive: Any, cosine: Any, sine: Any, frequency: Any) -> Any:
    """Force [N] that the channel adds at a time [s]; the drive plays no part."""
    angle = 2.0 * np.pi * frequency * time
    return cosine * np.cos(angle) + sine * np.sin(angle) + 0.0 * drive


def with_third(
    time: Any, drive: Any, cosine: Any, sine: Any, cosine_third: Any, sine_third: Any, frequency: Any
) -> Any:
    """The same with a third harmonic."""
    angle = 2.0 * np.pi * frequency * time
    first = cosine * np.cos(angle) + sine * np.sin(angle)
    return first + cosine_third * np.cos(3.0 * angle) + sine_third * np.sin(3.0 * angle) + 0.0 * drive


_COSINE = Quantity("cosine", "N", -1e4, 1e4, 2.0, "the line, its cosine")
_SINE = Quantity("sine", "N", -1e4, 1e4, 2.0, "the line, its sine")
_FREQUENCY = Quantity("frequency", "Hz", 45.0, 65.0, 50.0, "of the mains")

MAINS_HUM = Effect(
    name="mains_hum",
    stage="force_channel",
    meaning="the mains hums in the force channel",
    forms=(
        Form(
            "line",
            "added_force",
            (_COSINE, _SINE, _FREQUENCY),
            ((0.0, 0.0, 50.0), (0.0, 0.0, 60.0)),
            line,
        ),
        Form(
            "with_third",
            "added_force",
            (
                _COSINE,
                _SINE,
                Quantity("cosine_third", "N", -1e4, 1e4, 1.0, "its third harmonic, the cosine"),
                Quantity("sine_third", "N", -1e4, 1e4, 1.0, "its third harmonic, the sine"),
                _FREQUENCY,
            ),
            ((0.0, 0.0, 0.0, 0.0, 50.0), (0.0, 0.0, 0.0, 0.0, 60.0)),
            with_third,
        ),
    ),
)
