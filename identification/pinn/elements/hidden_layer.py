"""Hidden layer that all elements share, and the basis functions that linear output weights on it can form.

Units have random slopes and centres (extreme learning machine, Huang et al. 2006; local ones for differential
equations: Dong and Li 2021). The units are nearly collinear, so they are whitened by a singular value
decomposition. They are then recombined: one function is 1 at the left end, one is 1 at the right end, and the
others vanish at both. States of neighbouring elements thus share their value at the node, and no loss has to
enforce continuity.
"""

from collections.abc import Iterator

import numpy as np

from identification.arrays import Array
from identification.pinn.common import ACTIVATIONS, Activation

_GRID_POINTS = 400
_MIN_SLOPE = 1.0
"""Smallest slope of a unit's input over an element [1]."""
_CENTRE_RANGE = (-0.1, 1.1)
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
        self._mixing: Array = np.eye(units + 2)
        self._mixing = self._recombine(rank)
        self.rank = self._mixing.shape[1]

    def evaluate(self, place: Array) -> Array:
        """Return the basis functions (..., rank) at inputs (...)."""
        return self._add_linear_part(place, self._mix(next(self._evaluate_units(place))))

    def differentiate(self, place: Array) -> Array:
        """Return the derivatives (..., rank) of the basis functions over the input."""
        units = self._evaluate_units(place)
        next(units)
        return np.asarray(self._mix(next(units)) + self._mixing[-1])

    def evaluate_and_differentiate(self, place: Array) -> tuple[Array, Array]:
        """Return the basis functions (..., rank) at inputs (...), and their derivatives."""
        units = self._evaluate_units(place)
        values = self._add_linear_part(place, self._mix(next(units)))
        return values, self._mix(next(units)) + self._mixing[-1]

    def differentiate_twice(self, place: Array) -> tuple[Array, Array]:
        """Return the first and second derivatives (..., rank) of the basis functions over the input."""
        units = self._evaluate_units(place)
        next(units)
        slopes = self._mix(next(units)) + self._mixing[-1]
        return slopes, self._mix(next(units))

    def _evaluate_units(self, place: Array) -> Iterator[Array]:
        """Yield values, first and second derivatives of the units (..., units)."""
        return self._kind.derivatives((place[..., None] - self._centres) * self._steepness, self._steepness)

    def _add_linear_part(self, place: Array, mixed: Array) -> Array:
        """Add the parts of the constant and of the input itself."""
        return np.asarray(mixed + (self._mixing[-2] + place[..., None] * self._mixing[-1]))

    def _mix(self, units: Array) -> Array:
        return np.asarray(units @ self._mixing[:-2])

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
