"""A rubber at the end of the stroke: silent inside its gap, then a spring that sets in softly.

With d the depth beyond the gap, force = k d^2 / (d + s): a straight spring k once d is well above s. The stop may
stand at both ends, about the middle of the displacement channel, or at one of them.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def extended(x: Any, velocity: Any, stiffness: Any, gap: Any, softness: Any) -> Any:
    """Force [N] beside the law of a stop at positive displacement [m]; the velocity [m/s] plays no part."""
    depth = np.maximum(x - gap, 0.0)
    return stiffness * depth * depth / (depth + softness)


def compressed(x: Any, velocity: Any, stiffness: Any, gap: Any, softness: Any) -> Any:
    """The same at negative displacement."""
    depth = np.maximum(-x - gap, 0.0)
    return -stiffness * depth * depth / (depth + softness)


def both(x: Any, velocity: Any, stiffness: Any, gap: Any, softness: Any) -> Any:
    """The same at both ends."""
    depth = np.maximum(np.abs(x) - gap, 0.0)
    return np.sign(x) * stiffness * depth * depth / (depth + softness)


_PARAMETERS = (
    Quantity("stiffness", "N/m", 0.0, 1e7, 2e4, "of the rubber, well compressed"),
    Quantity("gap", "m", 1e-4, 0.5, 0.008, "stroke from the middle to the stop"),
    Quantity("softness", "m", 1e-5, 0.05, 1e-3, "depth over which the rubber sets in"),
)
_STARTS = tuple((0.0, gap, 1e-3) for gap in (0.004, 0.007, 0.009, 0.012, 0.018, 0.03))

END_STOP = Effect(
    name="end_stop",
    stage="damper",
    meaning="the piston meets a rubber near the end of its stroke",
    forms=(
        Form("both_ends", "parallel_force", _PARAMETERS, _STARTS, both),
        Form("extended_end", "parallel_force", _PARAMETERS, _STARTS, extended),
        Form("compressed_end", "parallel_force", _PARAMETERS, _STARTS, compressed),
    ),
)
