"""Drift of a quantity over runs, and runs that lie far from it.

A straight line is fitted by least squares, weighted by the intervals of the values. The definitions are those of
`bench/web/static/specimens/drift.js`, and a test compares the two.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

Z95 = NormalDist().inv_cdf(0.975)
"""Half of a 95 % interval over its standard deviation."""
MIN_RUNS = 3
"""Smallest number of runs of a drift."""
MIN_OUTLIER_RUNS = 5
"""Smallest number of runs of which one can be an outlier."""
_FALSE_ALARM = 0.05
"""Probability that a series without outliers shows one."""
Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class DriftLine:
    """Straight line through the values of a quantity."""

    level: float
    """Value at x = 0."""
    slope: float
    """Drift per unit of x."""
    half_width: float
    """Half of the 95 % interval of the slope."""
    covariance: Array
    """Covariance of level and slope, shape (2, 2)."""
    freedom: int
    """Degrees of freedom of the scatter."""
    widening: float
    """Variance of the values over that which their intervals state, at least 1."""

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the slope."""
        return self.slope - self.half_width, self.slope + self.half_width

    @property
    def is_significant(self) -> bool:
        """True if the 95 % interval of the slope excludes zero."""
        return abs(self.slope) > self.half_width

    def evaluate(self, x: float) -> float:
        """Return the value of the line."""
        return self.level + self.slope * x

    def compute_variance(self, x: float) -> float:
        """Return the variance of the line."""
        row = np.array([1.0, x])
        return float(row @ self.covariance @ row)


def fit_drift(
    x: Sequence[float], values: Sequence[float], half_widths: Sequence[float | None]
) -> DriftLine | None:
    """Fit a line to values; those without an interval do not count.

    If the values scatter more than their intervals say, the interval of the slope is that of the scatter.

    Args:
        x: places of the values, shape (runs,).
        values: values, shape (runs,).
        half_widths: half of the 95 % interval of each value; None without one.

    Returns:
        The line; None with fewer than three values with an interval, or with all of them at one place.
    """
    # Only here: the service loads this module at its start, and the package takes most of a second.
    from scipy.stats import t

    rows = [
        (1.0, place, value, Z95 / half) for place, value, half in zip(x, values, half_widths, strict=True) if half
    ]
    if len(rows) < MIN_RUNS or len({place for _, place, _, _ in rows}) < 2:
        return None
    table = np.array(rows)
    weights = table[:, 3]
    design, target = table[:, :2] * weights[:, None], table[:, 2] * weights
    inverse = np.linalg.inv(design.T @ design)
    level, slope = inverse @ design.T @ target
    freedom = len(rows) - 2
    scatter = float(np.sum((target - design @ np.array([level, slope])) ** 2)) / freedom
    widening = max(scatter, 1.0)
    quantile = float(t.ppf(0.975, freedom)) if scatter > 1.0 else Z95
    half = quantile * sqrt(inverse[1, 1] * widening)
    return DriftLine(float(level), float(slope), half, inverse * widening, freedom, widening)


def find_outliers(x: Sequence[float], values: Sequence[float], half_widths: Sequence[float | None]) -> list[int]:
    """Return the indices of values that lie too far from the line through all others.

    The test is that of the deleted residual over its standard deviation, by Student's distribution. It allows for
    the number of values: a series without outliers shows one with a probability of at most 5 %.
    """
    known = sum(half is not None and half > 0 for half in half_widths)
    if known < MIN_OUTLIER_RUNS:
        return []
    return [k for k in range(len(values)) if _is_outlier(k, x, values, half_widths, _FALSE_ALARM / known)]


def _is_outlier(
    k: int, x: Sequence[float], values: Sequence[float], half_widths: Sequence[float | None], level: float
) -> bool:
    """Return whether one value is an outlier at a level of significance [1]."""
    from scipy.stats import t

    half = half_widths[k]
    others = fit_drift(*([*one[:k], *one[k + 1 :]] for one in (x, values, half_widths)))  # type: ignore[arg-type]
    if not half or others is None:
        return False
    expected = sqrt((half / Z95) ** 2 * others.widening + others.compute_variance(x[k]))
    return 2 * float(t.sf(abs(values[k] - others.evaluate(x[k])) / expected, others.freedom)) < level
