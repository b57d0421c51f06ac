"""Sizes that an effect has on real benches: what fits only by being absurd is less likely beforehand."""

import numpy as np

from identification.arrays import Array
from identification.simulate import ActiveEffect

_ABSURD = 0.03
"""[1] weight of an effect whose size no bench has shown."""
_BENT = 0.1
"""[1] of the stroke that a displacement channel may be off its line."""
_FREE = 0.3
"""[1] of the half stroke that a rod moves before it meets a stop at its end."""
_NEAR = 1e-3
"""[1] of a bound's size."""
_SLOW = 8.0
"""[s] shortest time constant, or quarter of a period, of something that is called slow."""


def plausibility(effect: ActiveEffect, displacement: Array) -> float:
    """Weight [1] of an effect for its size: one where it is usual.

    Args:
        effect: with its values.
        displacement: of the strokes [m], any number of samples.
    """
    usual = _usual(effect, displacement) and not _at_limit(effect)
    return 1.0 if usual else _ABSURD


def _usual(effect: ActiveEffect, displacement: Array) -> bool:
    """Whether an effect is as large and as slow as its name says."""
    values = {q.symbol: v for q, v in zip(effect.form.parameters, effect.values, strict=True)}
    match effect.effect.name:
        case "displacement_nonlinearity":
            return _bend(effect, displacement) < _BENT
        case "end_stop":
            return values["gap"] > _FREE * float(np.abs(displacement).max())
        case "force_drift":
            return min(values.get("duration", np.inf), values.get("period", np.inf) / 4.0) > _SLOW
        case "viscous_heating":
            return values["recovery"] > _SLOW
        case _:
            return True


def _at_limit(effect: ActiveEffect) -> bool:
    """Whether a size stands at the limit of what is searched."""
    ends = [
        (value, end)
        for q, value in zip(effect.form.parameters, effect.values, strict=True)
        if q.low <= 0.0
        for end in (q.low, q.high)
        if end != 0.0
    ]
    return any(abs(value - end) < _NEAR * abs(end) for value, end in ends)


def _bend(effect: ActiveEffect, displacement: Array) -> float:
    """Largest deviation from a straight line over half the stroke [1]."""
    x = np.linspace(float(displacement.min()), float(displacement.max()), 50)
    added = np.asarray(effect.form.act(x, *effect.values))
    line = np.polyval(np.polyfit(x, added, 1), x)
    return float(np.max(np.abs(added - line)) / (0.5 * np.ptp(x)))
