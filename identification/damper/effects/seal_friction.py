"""Dry friction of the rod seal: a static peak that falls to the sliding value (Stribeck).

force = (F_c + F_s exp(-(v/v_s)²)) v / sqrt(v² + v_0²); the last factor is a smooth sign. With
``stribeck_exponential`` the peak falls as an exponential of the speed. A soft lip deflects before it slides
(Dahl). With ``presliding`` the sign is replaced by the lip's deflection, which depends on the travel since the
last reversal. With ``bristle`` the deflection itself follows the peak, as in the LuGre model without its viscous
part (Canudas de Wit et al. 1995): F' = (v - |v| F / g(v)) F_c / d, with g = F_c (1 + r exp(-(v/v_s)²)).
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

CREEP_SPEED = 5e-4
"""Speed v_0 [m/s]: below it, the seal creeps rather than slides."""


def compute_stribeck_friction(x: Any, velocity: Any, sliding: Any, peak: Any, stribeck: Any) -> Any:
    """Return the parallel force [N] at a velocity [m/s]; the displacement [m] has no influence."""
    sign = velocity / np.sqrt(velocity * velocity + CREEP_SPEED * CREEP_SPEED)
    return (sliding + peak * np.exp(-((velocity / stribeck) ** 2))) * sign


def compute_exponential_friction(x: Any, velocity: Any, sliding: Any, peak: Any, stribeck: Any) -> Any:
    """Return the parallel force [N] with a peak that falls as an exponential of the speed."""
    sign = velocity / np.sqrt(velocity * velocity + CREEP_SPEED * CREEP_SPEED)
    return (sliding + peak * np.exp(-np.abs(velocity) / stribeck)) * sign


def compute_presliding_friction(
    x: Any, velocity: Any, deflection: Any, sliding: Any, peak: Any, stribeck: Any, presliding_distance: Any
) -> Any:
    """Return the parallel force [N] of a lip with a deflection [1], relative to its largest one."""
    return (sliding + peak * np.exp(-((velocity / stribeck) ** 2))) * deflection


def update_lip_deflection(
    deflection: Any, change: Any, velocity: Any, sliding: Any, peak: Any, stribeck: Any, presliding_distance: Any
) -> Any:
    """Return the relative deflection [1] of the lip after a monotonic change of the displacement [m]."""
    target = 1.0 if change > 0.0 else -1.0
    return target + (deflection - target) * np.exp(-abs(change) / presliding_distance)


def compute_bristle_friction(
    x: Any, velocity: Any, deflection: Any, sliding: Any, peak_ratio: Any, stribeck: Any, presliding_distance: Any
) -> Any:
    """Return the parallel force [N] of bristles with a deflection [1], relative to that of fast sliding."""
    return sliding * deflection


def update_bristle_deflection(deflection: Any, change: Any, velocity: Any, *parameters: Any) -> Any:
    """Return the relative deflection [1] of bristles after a change of displacement [m] at a velocity [m/s].

    The last three parameters are peak ratio, Stribeck speed and presliding distance.
    """
    peak_ratio, stribeck, presliding_distance = parameters[-3:]
    limit = 1.0 + peak_ratio * np.exp(-((velocity / stribeck) ** 2))
    target = limit if change > 0.0 else -limit
    return target + (deflection - target) * np.exp(-abs(change) / (presliding_distance * limit))


_SLIDING = Quantity("sliding", "N", 0.0, 1000.0, 20.0, "friction while sliding")
_PEAK = Quantity("peak", "N", 0.0, 1000.0, 10.0, "additional friction while sticking")
PEAK_RATIO = Quantity("peak_ratio", "1", 0.0, 3.0, 0.3, "further friction while sticking, over the sliding one")
STRIBECK_SPEED = Quantity("stribeck", "m/s", 5e-4, 0.2, 0.015, "velocity over which the peak falls")
PRESLIDING_DISTANCE = Quantity("presliding_distance", "m", 2e-6, 2e-3, 5e-5, "travel over which the lip deflects")
_PARAMETERS = (_SLIDING, _PEAK, STRIBECK_SPEED)
_STRIBECK_STARTS, _PRESLIDING_STARTS = (0.006, 0.02, 0.06), (3e-5, 2e-4)
_STARTS = tuple((0.0, 0.0, speed) for speed in _STRIBECK_STARTS)

SEAL_FRICTION = Effect(
    name="seal_friction",
    stage="damper",
    variable="velocity",
    meaning="the seals rub, and stick before they slide",
    forms=(
        Form("stribeck", "parallel_force", _PARAMETERS, _STARTS, compute_stribeck_friction),
        Form("stribeck_exponential", "parallel_force", _PARAMETERS, _STARTS, compute_exponential_friction),
        Form(
            "presliding",
            "hysteretic_force",
            (*_PARAMETERS, PRESLIDING_DISTANCE),
            tuple((*start, distance) for start in _STARTS for distance in _PRESLIDING_STARTS),
            compute_presliding_friction,
            update_lip_deflection,
        ),
        Form(
            "bristle",
            "hysteretic_force",
            (_SLIDING, PEAK_RATIO, STRIBECK_SPEED, PRESLIDING_DISTANCE),
            tuple((0.0, 0.3, speed, distance) for speed in _STRIBECK_STARTS for distance in _PRESLIDING_STARTS),
            compute_bristle_friction,
            update_bristle_deflection,
        ),
    ),
)
