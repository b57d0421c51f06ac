"""Rubber stop at the end of the stroke: no force inside its gap, then a spring with a soft onset.

With d the depth beyond the gap, force = k d² / (d + s): a linear spring k once d is well above s. The stop is at
both ends of the stroke, about the middle of the displacement channel, or at one of them.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def compute_extended_stop(x: Any, velocity: Any, stiffness: Any, gap: Any, softness: Any) -> Any:
    """Return the parallel force [N] of a stop at positive displacement [m]; the velocity has no influence."""
    depth = np.maximum(x - gap, 0.0)
    return stiffness * depth * depth / (depth + softness)


def compute_compressed_stop(x: Any, velocity: Any, stiffness: Any, gap: Any, softness: Any) -> Any:
    """Return the parallel force [N] of a stop at negative displacement."""
    depth = np.maximum(-x - gap, 0.0)
    return -stiffness * depth * depth / (depth + softness)


def compute_both_stops(x: Any, velocity: Any, stiffness: Any, gap: Any, softness: Any) -> Any:
    """Return the parallel force [N] of a stop at each end."""
    depth = np.maximum(np.abs(x) - gap, 0.0)
    return np.sign(x) * stiffness * depth * depth / (depth + softness)


_PARAMETERS = (
    Quantity("stiffness", "N/m", 0.0, 1e7, 2e4, "stiffness of the rubber, well compressed"),
    Quantity("gap", "m", 1e-4, 0.5, 0.008, "stroke from the middle to the stop"),
    Quantity("softness", "m", 1e-5, 0.05, 1e-3, "depth of the soft onset"),
)
_STARTS = tuple((0.0, gap, 1e-3) for gap in (0.004, 0.007, 0.009, 0.012, 0.018, 0.03))

END_STOP = Effect(
    name="end_stop",
    stage="damper",
    variable="displacement",
    meaning="the piston meets a rubber stop near the end of its stroke",
    forms=(
        Form("both_ends", "parallel_force", _PARAMETERS, _STARTS, compute_both_stops),
        Form("extended_end", "parallel_force", _PARAMETERS, _STARTS, compute_extended_stop),
        Form("compressed_end", "parallel_force", _PARAMETERS, _STARTS, compute_compressed_stop),
    ),
)
