"""Repeatability and reproducibility of one quantity, by one-way analysis of variance as in ISO 5725-2.

The groups are the mountings of one specimen. The model of a value is

    y = m + L + e

with the mean m, the contribution L of the mounting (standard deviation s_L) and the contribution e of the run
within a mounting (s_r, repeatability). With p groups of n_i runs, N runs in total, group means y_i and general
mean y:

    s_r² = Σ (y_ik - y_i)² / (N - p)
    s_d² = Σ n_i (y_i - y)² / (p - 1)
    n    = (N - Σ n_i² / N) / (p - 1)
    s_L² = max(0, (s_d² - s_r²) / n)
    s_R² = s_r² + s_L²

The limits 2.8 s_r and 2.8 s_R contain the difference of two values with a probability of 95 %.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt

LIMIT_FACTOR = 2.8
"""95 % limit of the difference of two values, over the standard deviation of one (1.96 √2)."""
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Scatter:
    """Scatter of one quantity over runs and mountings, in the unit of the quantity."""

    runs: int
    mountings: int
    mean: float
    repeatability: float | None
    """Standard deviation s_r of runs in one mounting; None without a repetition."""
    repeatability_ci95: tuple[float, float] | None
    """95 % interval of s_r for normally distributed values."""
    between: float | None
    """Standard deviation s_L between mountings; None without a second mounting or without s_r."""
    is_clipped: bool
    """True if the estimate of s_L² is negative and was replaced by zero."""
    reproducibility: float | None
    """Standard deviation s_R of runs in different mountings."""
    missing: str
    """Runs that the missing standard deviations need; empty if none is missing."""

    @property
    def repeatability_limit(self) -> float | None:
        """95 % limit r of the difference of two runs in one mounting."""
        return None if self.repeatability is None else LIMIT_FACTOR * self.repeatability

    @property
    def reproducibility_limit(self) -> float | None:
        """95 % limit R of the difference of two runs in different mountings."""
        return None if self.reproducibility is None else LIMIT_FACTOR * self.reproducibility


def analyse_scatter(groups: Sequence[Sequence[float]]) -> Scatter:
    """Return the scatter of a quantity.

    Args:
        groups: values of the runs of each mounting; no group is empty, and there is at least one.
    """
    values = [np.asarray(group, dtype=np.float64) for group in groups]
    counts = np.array([len(group) for group in values], dtype=np.float64)
    means = np.array([group.mean() for group in values])
    mean = float(counts @ means / counts.sum())
    within = _estimate_within(values)
    between = None if within is None or len(values) < 2 else _estimate_between(counts, means, mean, within)
    return Scatter(
        runs=int(counts.sum()),
        mountings=len(values),
        mean=mean,
        repeatability=None if within is None else sqrt(within),
        repeatability_ci95=None if within is None else _make_interval(within, int(counts.sum()) - len(values)),
        between=None if between is None else sqrt(max(between, 0.0)),
        is_clipped=between is not None and between < 0.0,
        reproducibility=None if within is None or between is None else sqrt(within + max(between, 0.0)),
        missing=_describe_missing(has_repetition=within is not None, mountings=len(values)),
    )


def _estimate_within(values: Sequence[npt.NDArray[np.float64]]) -> float | None:
    """Return s_r²; None if no mounting has two runs."""
    freedom = sum(len(group) - 1 for group in values)
    squares = sum(float(np.sum((group - group.mean()) ** 2)) for group in values)
    return squares / freedom if freedom else None


def _estimate_between(
    counts: npt.NDArray[np.float64], means: npt.NDArray[np.float64], mean: float, within: float
) -> float:
    """Return the estimate of s_L², which may be negative; ``counts`` and ``means`` have shape (mountings,)."""
    freedom = len(counts) - 1
    spread = float(counts @ (means - mean) ** 2) / freedom
    size = float(counts.sum() - counts @ counts / counts.sum()) / freedom
    return (spread - within) / size


def _make_interval(variance: float, freedom: int) -> tuple[float, float]:
    """Return the 95 % interval of the standard deviation of a variance with degrees of freedom."""
    # Only here: the service loads this module at its start, and the package takes most of a second.
    from scipy.stats import chi2

    lower, upper = (float(chi2.ppf(share, freedom)) for share in ((1 - _CONFIDENCE) / 2, (1 + _CONFIDENCE) / 2))
    return sqrt(freedom * variance / upper), sqrt(freedom * variance / lower)


def _describe_missing(*, has_repetition: bool, mountings: int) -> str:
    """Describe the runs that are missing; empty if none are."""
    needs = []
    if not has_repetition:
        needs.append("1 more run in the same mounting for the repeatability")
    if mountings < 2:
        needs.append("1 run after a remount for the reproducibility")
    return f"missing: {' and '.join(needs)}" if needs else ""
