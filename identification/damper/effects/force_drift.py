"""A force channel whose zero wanders: warming electronics, a cell that creeps.

Either the zero settles towards another value, or it swings slowly, or it wanders: a wave with five overtones. All
stay bounded for all time.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def settling(time: Any, drive: Any, change: Any, duration: Any) -> Any:
    """Force [N] that the channel adds at a time [s]; the drive plays no part."""
    return change * (1.0 - np.exp(-time / duration)) + 0.0 * drive


def swinging(time: Any, drive: Any, cosine: Any, sine: Any, period: Any) -> Any:
    """The same as a slow wave."""
    angle = 2.0 * np.pi * time / period
    return cosine * np.cos(angle) + sine * np.sin(angle) + 0.0 * drive


def wandering(time: Any, drive: Any, *parts: Any) -> Any:
    """The same as a wave with overtones; cosine and sine [N] of each order come first, the period [s] last."""
    angle = 2.0 * np.pi * time / parts[-1]
    wave = 0.0 * angle + 0.0 * drive
    for k in range(len(parts) // 2):
        wave = wave + parts[2 * k] * np.cos((k + 1.0) * angle) + parts[2 * k + 1] * np.sin((k + 1.0) * angle)
    return wave


_PARTS = tuple(
    Quantity(f"{part}_{order}", "N", -1e4, 1e4, 5.0, f"{part} of the wave at {order} times its frequency")
    for order in range(1, 7)
    for part in ("cosine", "sine")
)

FORCE_DRIFT = Effect(
    name="force_drift",
    stage="force_channel",
    meaning="the zero of the load cell wanders",
    forms=(
        Form(
            "settling",
            "added_force",
            (
                Quantity("change", "N", -1e4, 1e4, 5.0, "change of the zero in the end"),
                Quantity("duration", "s", 3.0, 3000.0, 60.0, "time constant of that change"),
            ),
            ((0.0, 10.0), (0.0, 40.0), (0.0, 400.0)),
            settling,
        ),
        Form(
            "swinging",
            "added_force",
            (
                Quantity("cosine", "N", -1e4, 1e4, 5.0, "wave of the zero, its cosine"),
                Quantity("sine", "N", -1e4, 1e4, 5.0, "wave of the zero, its sine"),
                Quantity("period", "s", 10.0, 3000.0, 100.0, "period of that wave"),
            ),
            ((0.0, 0.0, 25.0), (0.0, 0.0, 50.0), (0.0, 0.0, 100.0), (0.0, 0.0, 250.0)),
            swinging,
        ),
        Form(
            "wandering",
            "added_force",
            (*_PARTS, Quantity("period", "s", 60.0, 3000.0, 100.0, "period of the slowest wave")),
            ((0.0,) * 12 + (70.0,), (0.0,) * 12 + (140.0,)),
            wandering,
        ),
    ),
)
