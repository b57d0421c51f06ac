"""Search coordinates: unbounded, well-scaled numbers behind the thirteen regular coordinates.

Yield force, c0 and c1 must be positive at every drive. Their search coordinates are the logarithms of their values
at the lowest and at the highest drive, so the slopes over the drive may have either sign. With a single drive,
slopes and eta are not observable and stay fixed.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper import COORDINATES, Coordinates

_PAIRS = (("F_a", "F_b"), ("c0_a", "c0_b"), ("c1_a", "c1_b"))
_LOG_COORDINATES = ("D_y", "n", "eta")
_NAMES = Coordinates._fields
_BOUNDS = {q.symbol: (q.low, q.high) for q in COORDINATES}
_SCALES = {q.symbol: q.scale for q in COORDINATES}
_MARGIN = 3.0
"""Factor by which a value at an end of the drive range may exceed the bounds of its zero-drive coordinate."""


@dataclass(frozen=True)
class SearchSpace:
    """Map between search coordinates q and regular coordinates, for one range of drives."""

    lowest_drive: float
    """Lowest drive [V or A]."""
    highest_drive: float
    """Highest drive [V or A]."""
    lowest_k0: float = _BOUNDS["k0"][0]
    """Lower bound on k0 [N/m]: below it, the inner displacement would diverge within these strokes."""

    @property
    def has_one_drive(self) -> bool:
        """True if the drive is constant, so that slopes over it are not observable."""
        return self.highest_drive - self.lowest_drive < 1e-9

    @property
    def free_mask(self) -> BoolArray:
        """(13,) True where a search coordinate is free."""
        unobservable = {"F_b", "c0_b", "c1_b", "eta"} if self.has_one_drive else set()
        return np.array([name not in unobservable for name in _NAMES])

    def to_search(self, c: Coordinates) -> Array:
        """Return search coordinates (13,), clipped to their bounds."""
        q = np.empty(len(_NAMES))
        for i, name in enumerate(_NAMES):
            value = getattr(c, name)
            if name in _LOG_COORDINATES:
                q[i] = np.log(np.clip(value, *_BOUNDS[name]))
            else:
                q[i] = value / _SCALES[name]
        for base, slope in _PAIRS:
            low = getattr(c, base) + getattr(c, slope) * self.lowest_drive
            high = getattr(c, base) + getattr(c, slope) * self.highest_drive
            # A given damper may be negative at an end of the range, as the paper's Table 1 is at 0.5 V.
            floor = _BOUNDS[base][0]
            q[_NAMES.index(base)] = np.log(max(low, floor))
            q[_NAMES.index(slope)] = np.log(max(high, floor))
        low, high = self.get_bounds()
        return np.clip(q, low, high)

    def to_coordinates(self, q: Array) -> Coordinates:
        """Return regular coordinates at search coordinates q (13,)."""
        values = {}
        for i, name in enumerate(_NAMES):
            values[name] = float(np.exp(q[i])) if name in _LOG_COORDINATES else float(q[i]) * _SCALES[name]
        for base, slope in _PAIRS:
            low, high = np.exp(q[_NAMES.index(base)]), np.exp(q[_NAMES.index(slope)])
            values[slope] = 0.0 if self.has_one_drive else float((high - low) / self._span)
            values[base] = float(low) - values[slope] * self.lowest_drive
        return Coordinates(**values)

    def differentiate(self, q: Array) -> Array:
        """Return the derivatives (13, 13) of the regular over the search coordinates."""
        D = np.zeros((len(_NAMES), len(_NAMES)))
        for i, name in enumerate(_NAMES):
            D[i, i] = np.exp(q[i]) if name in _LOG_COORDINATES else _SCALES[name]
        for base, slope in _PAIRS:
            a, b = _NAMES.index(base), _NAMES.index(slope)
            low, high = np.exp(q[a]), np.exp(q[b])
            D[b, b], D[b, a] = (0.0, 0.0) if self.has_one_drive else (high / self._span, -low / self._span)
            D[a, a] = low - D[b, a] * self.lowest_drive
            D[a, b] = -D[b, b] * self.lowest_drive
        return D

    def get_bounds(self) -> tuple[Array, Array]:
        """Return lowest and highest search coordinates, (13,) each."""
        low, high = np.empty(len(_NAMES)), np.empty(len(_NAMES))
        for i, name in enumerate(_NAMES):
            a, b = _BOUNDS[name]
            low[i], high[i] = (
                (np.log(a), np.log(b)) if name in _LOG_COORDINATES else (a / _SCALES[name], b / _SCALES[name])
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
