"""Random parameters of an effect other than its size, within plausible ranges for its damper."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sim_rig.effect_forms import FORMS
from sim_rig.trial.cases.specimens import SIZES


class ValueRange(NamedTuple):
    """Log-uniform range between two values, in units of a measure of the case."""

    low: float
    high: float
    measure: str = "one"
    """``one`` (SI), ``drive``, ``stroke``, ``duration`` or ``power`` of the case."""
    signed: bool = False
    """True if the value may be negative as well."""


RANGES: dict[str, dict[str, ValueRange]] = {
    "closing_loop": {"width": ValueRange(0.08, 0.2, "drive")},
    "gas_with_wall": {"length": ValueRange(2.2, 4.0, "stroke"), "exchange": ValueRange(0.1, 2.0)},
    "lugre": {
        "peak": ValueRange(0.4, 1.2),
        "presliding_distance": ValueRange(3e-5, 1e-4),
        "stribeck": ValueRange(8e-3, 0.04),
    },
    "reynolds_transition": {"transition": ValueRange(0.03, 0.07)},
    "two_valves": {"opening_velocity": ValueRange(2e-3, 8e-3), "softness": ValueRange(5e-3, 0.025)},
    "arrhenius_two_nodes": {"capacity": ValueRange(2.0, 5.0, "power"), "exchange": ValueRange(6.0, 25.0)},
    "relaxing_rubber": {"gap": ValueRange(0.6, 0.75, "stroke"), "direction": ValueRange(1.0, 1.0, signed=True)},
    "squeeze_film": {"film_damping": ValueRange(20.0, 120.0)},
    "closing_joint": {"closing_deflection": ValueRange(4e-5, 2e-4)},
    "mass_with_bracket": {"frequency": ValueRange(30.0, 70.0)},
    "warm_up_and_walk": {"time_constant": ValueRange(0.15, 0.6, "duration"), "phase": ValueRange(0.1, 6.2)},
    "swelling_harmonics": {"frequency": ValueRange(49.97, 50.03), "phase": ValueRange(0.1, 6.2)},
    "uneven_winding": {
        "position": ValueRange(0.2, 0.6, "stroke", signed=True),
        "width": ValueRange(0.5, 0.9, "stroke"),
    },
    "every_nth_stroke": {"period_path": ValueRange(9.0, 15.0, "stroke")},
    "hangs_at_random": {"phase": ValueRange(0.1, 6.2)},
    "folded_beat": {"frequency": ValueRange(7.0, 40.0)},
    "opens_at_random": {"phase": ValueRange(0.1, 6.2)},
    "on_and_off": {
        "start": ValueRange(0.15, 0.35, "duration"),
        "stop": ValueRange(0.55, 0.8, "duration"),
        "time_constant": ValueRange(0.8, 3.0),
    },
    "bursts": {"frequency": ValueRange(7.0, 20.0), "period": ValueRange(2.5, 5.0)},
}
"""Ranges by form and parameter; the size is not drawn but chosen by its excess."""


def compute_measures(size: str, duration: float, stroke: float) -> dict[str, float]:
    """Return the measures of a case, to which the ranges refer.

    Args:
        size: of the damper.
        duration: of the strokes [s].
        stroke: largest amplitude of the strokes [m].
    """
    limits = SIZES[size]
    power = 0.25 * limits.force * 2 * np.pi * 1.2 * stroke / np.sqrt(2)
    return {"one": 1.0, "drive": limits.drive, "stroke": stroke, "duration": duration, "power": float(power)}


def draw_values(form: str, random: np.random.Generator, measures: Mapping[str, float]) -> dict[str, float]:
    """Draw the parameters of a form; the first, its size, has its usual value."""
    values = {}
    ranges = RANGES.get(form, {})
    for quantity in FORMS[form].parameters:
        span = ranges.get(quantity.symbol)
        value = quantity.scale if span is None else draw_value(span, random) * measures[span.measure]
        values[quantity.symbol] = float(min(max(value, quantity.low), quantity.high))
    return values


def draw_value(span: ValueRange, random: np.random.Generator) -> float:
    """Draw a value of a range, in units of its measure."""
    size = float(np.exp(random.uniform(np.log(span.low), np.log(span.high))))
    return size * float(random.choice([-1.0, 1.0])) if span.signed else size
