"""The hidden layer that all elements share, and the functions that a linear head on it can make.

Units with random slopes and centres (an extreme learning machine, Huang et al. 2006; local ones for
differential equations: Dong and Li 2021). The units are nearly alike, so they are whitened by a singular value
decomposition, and recombined into one function that is 1 at the left end, one that is 1 at the right end, and
others that vanish at both: states of neighbouring elements then share their value at the node between them, and
no loss has to ask for continuity.
"""

from collections.abc import Iterator

import numpy as np

from identification.arrays import Array
from identification.pinn.activations import ACTIVATIONS, Activation

_POINTS = 400
_FLATTEST = 1.0
"""[1] least slope of a unit's input over an element."""
_CENTRES = (-0.1, 1.1)
_SMALLEST = 1e-11
"""[1] of the largest singular value: below it a direction is rounding."""


class HiddenLayer:
    """Units of one input in 0..1, and their recombination."""

    def __init__(self, units: int, rank: int, seed: int, activation: Activation = "tanh") -> None:
        self._kind = ACTIVATIONS[activation]
        random = np.random.default_rng(seed)
        steepness = np.exp(random.uniform(np.log(_FLATTEST), np.log(self._kind.steepest), units))
        self._steepness = steepness * random.choice([-1.0, 1.0], units)
        self._centres = random.uniform(*_CENTRES, units)
        self._mixing: Array = np.eye(units + 2)
        self._mixing = self._recombined(rank)
        self.rank = self._mixing.shape[1]

    def values(self, place: Array) -> Array:
        """The functions (..., rank) at inputs (...)."""
        return self._line(place, self._mixed(next(self._units(place))))

    def slopes(self, place: Array) -> Array:
        """Their slopes (..., rank) over the input."""
        units = self._units(place)
        next(units)
        return np.asarray(self._mixed(next(units)) + self._mixing[-1])

    def values_and_slopes(self, place: Array) -> tuple[Array, Array]:
        """The functions (..., rank) at inputs (...), and their slopes."""
        units = self._units(place)
        values = self._line(place, self._mixed(next(units)))
        return values, self._mixed(next(units)) + self._mixing[-1]

    def slopes_and_curvatures(self, place: Array) -> tuple[Array, Array]:
        """Slopes (..., rank) over the input, and the slopes of these."""
        units = self._units(place)
        next(units)
        slopes = self._mixed(next(units)) + self._mixing[-1]
        return slopes, self._mixed(next(units))

    def _units(self, place: Array) -> Iterator[Array]:
        """(..., units) of the units: values, slopes, curvatures."""
        return self._kind.derivatives((place[..., None] - self._centres) * self._steepness, self._steepness)

    def _line(self, place: Array, mixed: Array) -> Array:
        """With what constant and input add."""
        return np.asarray(mixed + (self._mixing[-2] + place[..., None] * self._mixing[-1]))

    def _mixed(self, units: Array) -> Array:
        return np.asarray(units @ self._mixing[:-2])

    def _recombined(self, rank: int) -> Array:
        """(units + 2, rank): two nodal functions, then those that vanish at both ends."""
        dense = 0.5 - 0.5 * np.cos(np.pi * (np.arange(_POINTS) + 0.5) / _POINTS)
        _, size, directions = np.linalg.svd(self._everything(dense), full_matrices=False)
        kept = min(rank, int((size > _SMALLEST * size[0]).sum()))
        white = directions[:kept].T / size[:kept] * _POINTS**0.5
        ends = self._everything(np.array([0.0, 1.0])) @ white
        Q, _ = np.linalg.qr(ends.T, mode="complete")
        return np.asarray(white @ np.hstack([np.linalg.pinv(ends), Q[:, 2:]]))

    def _everything(self, place: Array) -> Array:
        """(N, units + 2): the units, a constant and the input itself."""
        return np.column_stack([next(self._units(place)), np.ones(len(place)), place])
