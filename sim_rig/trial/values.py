"""What a drawn effect has beside its size: each parameter within a range that makes sense on its damper."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sim_rig.scenarios.sealed import FORMS
from sim_rig.trial.specimens import SIZES


class Range(NamedTuple):
    """Log-uniform between two values, in a natural measure of the bench."""

    low: float
    high: float
    measure: str = "one"
    """``one`` (SI), ``drive``, ``stroke``, ``duration`` or ``power`` of the case."""
    either: bool = False
    """Whether it may be negative, too."""


RANGES: dict[str, dict[str, Range]] = {
    "closing_loop": {"width": Range(0.08, 0.2, "drive")},
    "gas_with_wall": {"length": Range(2.2, 4.0, "stroke"), "exchange": Range(0.1, 2.0)},
    "lugre": {"peak": Range(0.4, 1.2), "bend": Range(3e-5, 1e-4), "stribeck": Range(8e-3, 0.04)},
    "reynolds_transition": {"transition": Range(0.03, 0.07)},
    "two_valves": {"opens": Range(2e-3, 8e-3), "softness": Range(5e-3, 0.025)},
    "arrhenius_two_nodes": {"capacity": Range(2.0, 5.0, "power"), "exchange": Range(6.0, 25.0)},
    "relaxing_rubber": {"gap": Range(0.6, 0.75, "stroke"), "sense": Range(1.0, 1.0, either=True)},
    "squeeze_film": {"film": Range(20.0, 120.0)},
    "closing_joint": {"closes": Range(4e-5, 2e-4)},
    "mass_with_bracket": {"frequency": Range(30.0, 70.0)},
    "warm_up_and_walk": {"time": Range(0.15, 0.6, "duration"), "phase": Range(0.1, 6.2)},
    "swelling_harmonics": {"frequency": Range(49.97, 50.03), "phase": Range(0.1, 6.2)},
    "uneven_winding": {
        "place": Range(0.2, 0.6, "stroke", either=True),
        "width": Range(0.5, 0.9, "stroke"),
    },
    "every_nth_stroke": {"path": Range(9.0, 15.0, "stroke")},
    "hangs_at_random": {"phase": Range(0.1, 6.2)},
    "folded_beat": {"beat": Range(7.0, 40.0)},
    "opens_at_random": {"phase": Range(0.1, 6.2)},
    "on_and_off": {
        "start": Range(0.15, 0.35, "duration"),
        "stop": Range(0.55, 0.8, "duration"),
        "time": Range(0.8, 3.0),
    },
    "bursts": {"frequency": Range(7.0, 20.0), "period": Range(2.5, 5.0)},
}
"""By form and parameter; the size is not drawn but chosen."""


def measures(size: str, duration: float, stroke: float) -> dict[str, float]:
    """Natural measures of a case.

    Args:
        size: of the damper.
        duration: of the strokes [s].
        stroke: largest amplitude of the strokes [m].
    """
    limits = SIZES[size]
    power = 0.25 * limits.force * 2 * np.pi * 1.2 * stroke / np.sqrt(2)
    return {"one": 1.0, "drive": limits.drive, "stroke": stroke, "duration": duration, "power": float(power)}


def drawn_values(form: str, chance: np.random.Generator, measured: Mapping[str, float]) -> dict[str, float]:
    """The parameters of a form, the first, its size, at its usual value."""
    values = {}
    ranges = RANGES.get(form, {})
    for quantity in FORMS[form].parameters:
        span = ranges.get(quantity.symbol)
        value = quantity.scale if span is None else _drawn(span, chance) * measured[span.measure]
        values[quantity.symbol] = float(min(max(value, quantity.low), quantity.high))
    return values


def _drawn(span: Range, chance: np.random.Generator) -> float:
    size = float(np.exp(chance.uniform(np.log(span.low), np.log(span.high))))
    return size * float(chance.choice([-1.0, 1.0])) if span.either else size
