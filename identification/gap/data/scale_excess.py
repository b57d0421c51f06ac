"""Part of a residual that exceeds the noise at its time scale.

Slow noise leaves the floor uncertain, and an error of the model within that interval would count as noise. The
uncertain part of such noise is slower than the strokes, however. At the scale of an error the noise is known, and
what exceeds it there is an error of the model.
"""

import math
from collections.abc import Sequence

from identification.gap.data.error_square import ErrorSquare
from identification.gap.data.residual_map import Residual
from identification.noise import ScaleVariance, list_scales, measure_scale_variance


def estimate_scale_excess(
    residual: Residual, scales: Sequence[ScaleVariance], input_square: float
) -> ErrorSquare | None:
    """Estimate the part of a residual beyond the noise, over the scales where it is certain; None if nowhere.

    Args:
        residual: residual of the law.
        scales: variance of the noise of the force by time scale.
        input_square: mean square of the propagated noise of the displacement [N²], at an unknown scale.
    """
    found = [_compute_excess(residual, scale, input_square) for scale in scales]
    certain = [excess for excess in found if excess.lowest > 0.0]
    if not certain:
        return None
    return ErrorSquare(sum(e.square for e in certain), math.hypot(*(e.deviation for e in certain)))


def measure_residual_scales(residual: Residual) -> tuple[ScaleVariance, ...]:
    """Measure the variance of a residual by time scale; at no scale if sampling rates differ."""
    if len({rate for _, rate in residual.rates}) != 1:
        return ()
    found = []
    for samples in list_scales(min(count for count, _ in residual.rates)):
        variance, differences = _measure_scale(residual, samples)
        if differences:
            found.append(ScaleVariance.from_signal(samples, variance, differences))
    return tuple(found)


def _compute_excess(residual: Residual, scale: ScaleVariance, input_square: float) -> ErrorSquare:
    """Return the part of a residual beyond the noise at one scale."""
    variance, differences = _measure_scale(residual, scale.samples)
    if not differences:
        return ErrorSquare(0.0, math.inf)
    deviation = math.hypot(scale.compute_chance(differences), scale.uncertainty)
    return ErrorSquare(variance - scale.variance - input_square, deviation)


def _measure_scale(residual: Residual, samples: int) -> tuple[float, int]:
    """Return the variance of a residual at a scale [N²] and the number of differences within its recordings."""
    total, count = 0.0, 0
    for part, _ in residual.parts:
        variance, differences = measure_scale_variance(residual.values[part], residual.valid[part], samples)
        total, count = total + variance * differences, count + differences
    return total / max(count, 1), count
