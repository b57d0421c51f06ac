"""Where the fit searches: unbounded, well-scaled numbers behind the thirteen coordinates.

Quantities that must be positive at every drive of the method (yield force, c0, c1) are carried as the logarithm
of their value at the lowest and at the highest drive, so that the slopes are free while the damper stays a
damper. With one drive only, slopes and eta cannot be seen and are left out.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper.coordinates import COORDINATES, Coordinates

_PAIRS = (("F_a", "F_b"), ("c0_a", "c0_b"), ("c1_a", "c1_b"))
_LOGARITHMIC = ("D_y", "n", "eta")
_NAMES = Coordinates._fields
_BOUNDS = {q.symbol: (q.low, q.high) for q in COORDINATES}
_SCALES = {q.symbol: q.scale for q in COORDINATES}
_MARGIN = 3.0
"""[1] how far a value at the highest drive may stand outside the bound of its zero-drive coordinate."""


@dataclass(frozen=True)
class SearchSpace:
    """The map between search numbers q and coordinates, for one range of drives."""

    lowest_drive: float
    """[V or A]"""
    highest_drive: float
    """[V or A]"""
    lowest_k0: float = _BOUNDS["k0"][0]
    """[N/m] below which the inner displacement would run away within these strokes."""

    @property
    def one_drive(self) -> bool:
        """Whether the drive never changes, so that no slope can be seen."""
        return self.highest_drive - self.lowest_drive < 1e-9

    @property
    def free(self) -> BoolArray:
        """(13,) True where a search number is free."""
        hidden = {"F_b", "c0_b", "c1_b", "eta"} if self.one_drive else set()
        return np.array([name not in hidden for name in _NAMES])

    def to_search(self, c: Coordinates) -> Array:
        """(13,) search numbers of a point; values outside the bounds are moved onto them."""
        q = np.empty(len(_NAMES))
        for i, name in enumerate(_NAMES):
            value = getattr(c, name)
            if name in _LOGARITHMIC:
                q[i] = np.log(np.clip(value, *_BOUNDS[name]))
            else:
                q[i] = value / _SCALES[name]
        for base, slope in _PAIRS:
            low = getattr(c, base) + getattr(c, slope) * self.lowest_drive
            high = getattr(c, base) + getattr(c, slope) * self.highest_drive
            floor = _BOUNDS[base][0]
            q[_NAMES.index(base)] = np.log(max(low, floor))
            q[_NAMES.index(slope)] = np.log(max(high, floor))
        low, high = self.bounds()
        return np.clip(q, low, high)

    def to_coordinates(self, q: Array) -> Coordinates:
        """The point at search numbers q (13,)."""
        values = {}
        for i, name in enumerate(_NAMES):
            values[name] = float(np.exp(q[i])) if name in _LOGARITHMIC else float(q[i]) * _SCALES[name]
        for base, slope in _PAIRS:
            low, high = np.exp(q[_NAMES.index(base)]), np.exp(q[_NAMES.index(slope)])
            values[slope] = 0.0 if self.one_drive else float((high - low) / self._span)
            values[base] = float(low) - values[slope] * self.lowest_drive
        return Coordinates(**values)

    def slopes(self, q: Array) -> Array:
        """(13, 13) derivative of the coordinates over the search numbers."""
        D = np.zeros((len(_NAMES), len(_NAMES)))
        for i, name in enumerate(_NAMES):
            D[i, i] = np.exp(q[i]) if name in _LOGARITHMIC else _SCALES[name]
        for base, slope in _PAIRS:
            a, b = _NAMES.index(base), _NAMES.index(slope)
            low, high = np.exp(q[a]), np.exp(q[b])
            D[b, b], D[b, a] = (0.0, 0.0) if self.one_drive else (high / self._span, -low / self._span)
            D[a, a] = low - D[b, a] * self.lowest_drive
            D[a, b] = -D[b, b] * self.lowest_drive
        return D

    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest search numbers, (13,) each."""
        low, high = np.empty(len(_NAMES)), np.empty(len(_NAMES))
        for i, name in enumerate(_NAMES):
            a, b = _BOUNDS[name]
            low[i], high[i] = (
                (np.log(a), np.log(b)) if name in _LOGARITHMIC else (a / _SCALES[name], b / _SCALES[name])
            )
        low[_NAMES.index("k0")] = self.lowest_k0 / _SCALES["k0"]
        for base, slope in _PAIRS:
            a, b = _BOUNDS[base]
            for name in (base, slope):
                i = _NAMES.index(name)
                low[i], high[i] = np.log(a / _MARGIN), np.log(b * _MARGIN)
        return low, high

    @property
    def _span(self) -> float:
        return self.highest_drive - self.lowest_drive
