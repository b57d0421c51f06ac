"""Size prior: effects that fit only with an implausible size are less probable."""

import numpy as np

from identification.arrays import Array
from identification.damper import LIBRARY_SIZE, DamperSize, scale_quantity
from identification.simulate import ActiveEffect

_IMPLAUSIBLE_WEIGHT = 0.03
"""Weight of an effect whose size is not plausible on a bench."""
_MAX_NONLINEARITY = 0.1
"""Largest deviation of a displacement channel from a straight line, relative to half the stroke."""
_MIN_FREE_STROKE = 0.3
"""Smallest free travel before an end stop, relative to the largest displacement."""
_BOUND_TOLERANCE = 1e-3
"""Distance from a bound, relative to the bound, within which a size counts as at it."""
_MIN_TIME_CONSTANT = 0.08
"""Smallest time constant, or quarter of a period, of a slow effect, over the time of its observation [1]."""
_GRID_POINTS = 50
"""Displacements at which the nonlinearity of a channel is evaluated."""


def compute_size_weight(effect: ActiveEffect, displacement: Array, size: DamperSize = LIBRARY_SIZE) -> float:
    """Return the weight [1] of an effect for the plausibility of its size: one where it is plausible.

    Args:
        effect: the effect with its values.
        displacement: displacement of the strokes [m], any number of samples.
        size: size of the damper, from which the bounds of the search follow.
    """
    plausible = _has_plausible_size(effect, displacement, size) and not _is_at_bound(effect, size)
    return 1.0 if plausible else _IMPLAUSIBLE_WEIGHT


def _has_plausible_size(effect: ActiveEffect, displacement: Array, size: DamperSize) -> bool:
    """Return True if an effect is as large and as slow as its name implies."""
    values = {q.symbol: v for q, v in zip(effect.form.parameters, effect.values, strict=True)}
    match effect.effect.name:
        case "displacement_nonlinearity":
            return _compute_nonlinearity(effect, displacement) < _MAX_NONLINEARITY
        case "end_stop":
            return values["gap"] > _MIN_FREE_STROKE * float(np.abs(displacement).max())
        case "force_drift":
            times = values.get("duration", np.inf), values.get("period", np.inf) / 4.0
            return min(times) > _MIN_TIME_CONSTANT * size.observation_time
        case "viscous_heating":
            return values["recovery_time"] > _MIN_TIME_CONSTANT * size.observation_time
        case _:
            return True


def _is_at_bound(effect: ActiveEffect, size: DamperSize) -> bool:
    """Return True if a size is at a bound of its search range, and not at a limit of nature."""
    quantities = [scale_quantity(q, size) for q in effect.form.parameters]
    bounds = [
        (value, bound)
        for q, value in zip(quantities, effect.values, strict=True)
        if q.low <= 0.0 and not q.has_natural_limits
        for bound in (q.low, q.high)
        if bound != 0.0
    ]
    return any(abs(value - bound) < _BOUND_TOLERANCE * abs(bound) for value, bound in bounds)


def _compute_nonlinearity(effect: ActiveEffect, displacement: Array) -> float:
    """Compute the largest deviation from a straight line, relative to half the stroke [1]."""
    x = np.linspace(float(displacement.min()), float(displacement.max()), _GRID_POINTS)
    added = np.asarray(effect.form.function(x, *effect.values))
    line = np.polyval(np.polyfit(x, added, 1), x)
    return float(np.max(np.abs(added - line)) / (0.5 * np.ptp(x)))
