"""Control chart of individual values (ISO 7870-2), with an exponentially weighted mean for drift (ISO 7870-6).

The baseline is the first `BASELINE_POINTS` checks of a series. Its mean is the centre. The standard deviation
between checks follows from the mean moving range over d2 = 1.128 (ISO 7870-2). Three rules apply to later checks:

- beyond_limits: more than 3 standard deviations from the centre (ISO 7870-2).
- run_of_eight: the eighth check in a row on one side of the centre (Western Electric, 1956, rule 4).
- drift: the weighted mean with λ = 0.2 is beyond its limits, 2.962 of its standard deviations from the centre.
  In control it is so once in 500 checks on average (ISO 7870-6; Lucas and Saccucci, 1990).

In the baseline only the first rule is evaluated. Limits that follow from 20 checks are uncertain themselves, so
false alarms are more frequent than with known limits.
"""

from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from pydantic import Field

from bench.checks.statistics import Array
from bench.validation import FrozenModel

BASELINE_POINTS = 20
"""Number of checks that determine centre and limits."""
D2 = 1.128
"""Mean range of two values over their standard deviation, for a normal distribution."""
LIMIT_FACTOR = 3.0
RUN_LENGTH = 8
EWMA_WEIGHT = 0.2
EWMA_FACTOR = 2.962
ChartState: TypeAlias = Literal["not_enough", "no_limits", "in_control", "out_of_control"]
"""State of the latest check; no_limits: the checks of the baseline do not differ."""
Rule: TypeAlias = Literal["beyond_limits", "run_of_eight", "drift"]


class ChartLimits(FrozenModel):
    """Centre and limits, in the unit of the chart."""

    centre: float = Field(description="mean of the baseline")
    sigma: float = Field(ge=0, description="standard deviation between checks")
    sigma_from: Literal["moving_range", "uncertainty"] = Field(
        description="uncertainty: that of one check, because the moving range is smaller"
    )
    lower: float = Field(description="centre - 3 sigma")
    upper: float = Field(description="centre + 3 sigma")
    ewma_lower: float = Field(description="lower limit of the exponentially weighted mean")
    ewma_upper: float = Field(description="upper limit of the exponentially weighted mean")


class ChartValues(NamedTuple):
    """Limits and state of a series of checks."""

    limits: ChartLimits | None
    """None before the baseline is complete, and if its checks do not differ."""
    ewma: Array
    """Weighted mean after each check that follows the baseline, shape (later checks,); empty without limits."""
    rules: list[tuple[Rule, ...]]
    """Rules by which each check is out of control."""
    state: ChartState


def compute_chart(values: Array, uncertainties: Array) -> ChartValues:
    """Compute the chart of one channel.

    Args:
        values: values of the checks, shape (checks,), the oldest first.
        uncertainties: their standard uncertainties, shape (checks,).
    """
    none: list[tuple[Rule, ...]] = [()] * len(values)
    if len(values) < BASELINE_POINTS:
        return ChartValues(None, np.empty(0), none, "not_enough")
    limits = compute_limits(values[:BASELINE_POINTS], uncertainties[:BASELINE_POINTS])
    if not limits.sigma:
        return ChartValues(None, np.empty(0), none, "no_limits")
    ewma = compute_ewma(values[BASELINE_POINTS:], limits.centre)
    rules = find_rules(values, ewma, limits)
    return ChartValues(limits, ewma, rules, "out_of_control" if rules[-1] else "in_control")


def compute_limits(values: Array, uncertainties: Array) -> ChartLimits:
    """Compute centre and limits of a baseline.

    The standard deviation between checks is never below the uncertainty of one check: equal values by chance, or
    by a coarse converter, would otherwise give limits that every later check exceeds.

    Args:
        values: values of the baseline, shape (checks,), the oldest first.
        uncertainties: their standard uncertainties, shape (checks,).
    """
    centre = float(np.mean(values))
    between, single = float(np.mean(np.abs(np.diff(values)))) / D2, float(np.sqrt(np.mean(uncertainties**2)))
    sigma = max(between, single)
    ewma_sigma = sigma * (EWMA_WEIGHT / (2 - EWMA_WEIGHT)) ** 0.5
    return ChartLimits(
        centre=centre,
        sigma=sigma,
        sigma_from="moving_range" if between >= single else "uncertainty",
        lower=centre - LIMIT_FACTOR * sigma,
        upper=centre + LIMIT_FACTOR * sigma,
        ewma_lower=centre - EWMA_FACTOR * ewma_sigma,
        ewma_upper=centre + EWMA_FACTOR * ewma_sigma,
    )


def compute_ewma(values: Array, centre: float) -> Array:
    """Return the exponentially weighted mean after each value, shape (checks,); it begins at the centre."""
    means, mean = np.empty(len(values)), centre
    for index, value in enumerate(values):
        mean += EWMA_WEIGHT * (value - mean)
        means[index] = mean
    return means


def find_rules(values: Array, ewma: Array, limits: ChartLimits) -> list[tuple[Rule, ...]]:
    """Return the rules by which each check is out of control.

    Args:
        values: all values, shape (checks,); the baseline comes first.
        ewma: weighted mean of the values after the baseline.
        limits: of the chart.
    """
    first = len(values) - len(ewma)
    is_beyond = (values < limits.lower) | (values > limits.upper)
    is_run = np.zeros(len(values), dtype=bool)
    is_run[first:] = _find_runs(np.sign(values[first:] - limits.centre))
    is_drift = np.zeros(len(values), dtype=bool)
    is_drift[first:] = (ewma < limits.ewma_lower) | (ewma > limits.ewma_upper)
    names: tuple[Rule, ...] = ("beyond_limits", "run_of_eight", "drift")
    return [
        tuple(name for name, applies in zip(names, row, strict=True) if applies)
        for row in zip(is_beyond, is_run, is_drift, strict=True)
    ]


def _find_runs(sides: Array) -> npt.NDArray[np.bool_]:
    """Return which values end a run of eight on one side of the centre."""
    ends, length = np.zeros(len(sides), dtype=bool), 0
    for index, side in enumerate(sides):
        length = length + 1 if side and index and side == sides[index - 1] else int(side != 0)
        ends[index] = length >= RUN_LENGTH
    return ends
