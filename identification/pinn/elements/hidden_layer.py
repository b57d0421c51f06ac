"""Hidden layer that all elements share, and the basis functions that linear output weights on it can form.

Units have random slopes and centres (extreme learning machine, Huang et al. 2006; local ones for differential
equations: Dong and Li 2021). The units are nearly collinear, so they are whitened by a singular value
decomposition. They are then recombined: one function is 1 at the left end, one is 1 at the right end, and the
others vanish at both. States of neighbouring elements thus share their value at the node, and no loss has to
enforce continuity.
"""

from collections.abc import Iterator

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from identification.arrays import Array
from identification.pinn.common import ACTIVATIONS, Activation

_GRID_POINTS = 400
_MIN_SLOPE = 1.0
"""Smallest slope of a unit's input over an element [1]."""
_CENTRE_RANGE = (-0.1, 1.1)
_TABLE_INTERVALS, _TABLE_DEGREE = 1000, 5
"""Intervals of the table of the basis functions, and degree of its splines.

They differ from the functions by less than the rounding of the mixed units, and take a twentieth of the time.
"""
_SINGULAR_TOLERANCE = 1e-11
"""Threshold on a singular value over the largest one [1]: below it, its direction is rounding error."""


class HiddenLayer:
    """Random units of one input in 0..1, recombined into basis functions."""

    def __init__(self, units: int, rank: int, seed: int, activation: Activation = "tanh") -> None:
        self._kind = ACTIVATIONS[activation]
        random = np.random.default_rng(seed)
        steepness = np.exp(random.uniform(np.log(_MIN_SLOPE), np.log(self._kind.max_slope), units))
        self._steepness = steepness * random.choice([-1.0, 1.0], units)
        self._centres = random.uniform(*_CENTRE_RANGE, units)
        mixing = self._recombine(rank)
        self.rank = mixing.shape[1]
        self._values, self._slopes, self._curvatures = self._tabulate(mixing)

    def evaluate(self, place: Array) -> Array:
        """Return the basis functions (..., rank) at inputs (...)."""
        return np.asarray(self._values(place))

    def differentiate(self, place: Array) -> Array:
        """Return the derivatives (..., rank) of the basis functions over the input."""
        return np.asarray(self._slopes(place))

    def differentiate_twice(self, place: Array) -> tuple[Array, Array]:
        """Return the first and second derivatives (..., rank) of the basis functions over the input."""
        return self.differentiate(place), np.asarray(self._curvatures(place))

    def _tabulate(self, mixing: Array) -> list[BSpline]:
        """Return splines through the basis functions, their slopes and their curvatures.

        The slope of an interpolant would amplify the rounding of the mixed units, so each has its own table.
        """
        grid = 0.5 - 0.5 * np.cos(np.pi * np.arange(_TABLE_INTERVALS + 1) / _TABLE_INTERVALS)
        linear = (np.column_stack([np.ones(len(grid)), grid]), np.array([[0.0, 1.0]]), np.zeros((1, 2)))
        return [
            make_interp_spline(grid, units @ mixing[:-2] + part @ mixing[-2:], k=_TABLE_DEGREE)
            for units, part in zip(self._evaluate_units(grid), linear, strict=True)
        ]

    def _evaluate_units(self, place: Array) -> Iterator[Array]:
        """Yield values, first and second derivatives of the units (N, units)."""
        return self._kind.derivatives((place[:, None] - self._centres) * self._steepness, self._steepness)

    def _recombine(self, rank: int) -> Array:
        """Return the mixing (units + 2, rank): two nodal functions, then those that vanish at both ends."""
        grid = 0.5 - 0.5 * np.cos(np.pi * (np.arange(_GRID_POINTS) + 0.5) / _GRID_POINTS)
        _, size, directions = np.linalg.svd(self._evaluate_all(grid), full_matrices=False)
        kept = min(rank, int((size > _SINGULAR_TOLERANCE * size[0]).sum()))
        white = directions[:kept].T / size[:kept] * _GRID_POINTS**0.5
        ends = self._evaluate_all(np.array([0.0, 1.0])) @ white
        Q, _ = np.linalg.qr(ends.T, mode="complete")
        return np.asarray(white @ np.hstack([np.linalg.pinv(ends), Q[:, 2:]]))

    def _evaluate_all(self, place: Array) -> Array:
        """Return the units, a constant and the input itself (N, units + 2)."""
        return np.column_stack([next(self._evaluate_units(place)), np.ones(len(place)), place])
