"""Search coordinates: well-scaled numbers behind the thirteen regular coordinates, bounded in a recording's units.

Yield force, c0 and c1 must be positive at every drive. Their search coordinates are the logarithms of their values
at the lowest and at the highest drive. The slopes over the drive may thus have either sign. With a single drive,
slopes and eta are not observable and stay fixed.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper import COORDINATES, Coordinates
from identification.fitting.recording_scales import RecordingScales

_PAIRS = (("F_a", "F_b"), ("c0_a", "c0_b"), ("c1_a", "c1_b"))
_LOG_COORDINATES = ("D_y", "n", "eta")
_NAMES = Coordinates._fields
_SMALLEST = 1e-300
"""Value whose logarithm stands for that of zero; the bounds then clip it."""
_SHAPES = {q.symbol: (q.low, q.high) for q in COORDINATES if q.unit == "1"}
"""Bounds of the dimensionless coordinates rho and n."""
_YIELD_BOUNDS = ((1e-4, 30.0), (1e-3, 30.0))
"""Yield force at the lowest and at the highest drive, in units of the force."""
_C0_BOUNDS = ((1e-5, 30.0), (1e-5, 30.0))
"""Damping c0 at both drives, in units of force over velocity."""
_C1_BOUNDS = ((1e-3, 1e5), (1e-3, 1e5))
"""Damping c1 at both drives, in units of force over velocity."""
_YIELD_DISPLACEMENT_BOUNDS = (1e-5, 3.0)
"""Yield displacement, in units of the length."""
_SLOWEST_FIELD, _FASTEST_FIELD, _FASTEST_SAMPLED_FIELD = 0.02, 10.0, 4.0
"""Rate of the field: bounds in units of the rate, and upper bound in units of the sampling rate if higher."""
_LOWEST_STIFFNESS, _HIGHEST_STIFFNESS = -0.3, 10.0
"""Stiffness k0, in units of force over length."""
_MAX_ACCUMULATOR_STIFFNESS, _MAX_PRELOAD = 10.0, 50.0
"""Magnitude of k1 in units of force over length, and of f0 in units of the force."""


@dataclass(frozen=True)
class SearchSpace:
    """Map between search coordinates q and regular coordinates, for one range of drives."""

    lowest_drive: float
    """Lowest drive [V or A]."""
    highest_drive: float
    """Highest drive [V or A]."""
    scales: RecordingScales
    """Units of the recording."""
    lowest_k0: float = -np.inf
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

    @property
    def shape_mask(self) -> BoolArray:
        """(13,) True for the shape of the loop and the rate of the field."""
        return np.array([name in ("rho", "n", "eta") for name in _NAMES])

    @property
    def log_mask(self) -> BoolArray:
        """(13,) True where a search coordinate is a logarithm."""
        return np.array([name not in self._units for name in _NAMES])

    def fit_line(self, at_lowest: float, at_highest: float) -> tuple[float, float]:
        """Return value at zero drive and slope of the line through the values at both ends of the range."""
        slope = 0.0 if self.has_one_drive else (at_highest - at_lowest) / self._span
        return at_lowest - slope * self.lowest_drive, slope

    def to_search(self, c: Coordinates) -> Array:
        """Return search coordinates (13,), clipped to their bounds."""
        q = np.empty(len(_NAMES))
        for name in _LOG_COORDINATES:
            q[_NAMES.index(name)] = np.log(max(getattr(c, name), _SMALLEST))
        for name, unit in self._units.items():
            q[_NAMES.index(name)] = getattr(c, name) / unit
        for base, slope in _PAIRS:
            low = getattr(c, base) + getattr(c, slope) * self.lowest_drive
            high = getattr(c, base) + getattr(c, slope) * self.highest_drive
            # A given damper may be negative at an end of the range, as the paper's Table 1 is at 0.5 V.
            q[_NAMES.index(base)] = np.log(max(low, _SMALLEST))
            q[_NAMES.index(slope)] = np.log(max(high, _SMALLEST))
        low, high = self.get_bounds()
        return np.clip(q, low, high)

    def to_coordinates(self, q: Array) -> Coordinates:
        """Return regular coordinates at search coordinates q (13,)."""
        values = {name: float(np.exp(q[_NAMES.index(name)])) for name in _LOG_COORDINATES}
        values |= {name: float(q[_NAMES.index(name)]) * unit for name, unit in self._units.items()}
        for base, slope in _PAIRS:
            low, high = np.exp(q[_NAMES.index(base)]), np.exp(q[_NAMES.index(slope)])
            values[base], values[slope] = self.fit_line(float(low), float(high))
        return Coordinates(**values)

    def differentiate(self, q: Array) -> Array:
        """Return the derivatives (13, 13) of the regular over the search coordinates."""
        D = np.zeros((len(_NAMES), len(_NAMES)))
        for name in _LOG_COORDINATES:
            i = _NAMES.index(name)
            D[i, i] = np.exp(q[i])
        for name, unit in self._units.items():
            D[_NAMES.index(name), _NAMES.index(name)] = unit
        for base, slope in _PAIRS:
            a, b = _NAMES.index(base), _NAMES.index(slope)
            low, high = np.exp(q[a]), np.exp(q[b])
            D[b, b], D[b, a] = (0.0, 0.0) if self.has_one_drive else (high / self._span, -low / self._span)
            D[a, a] = low - D[b, a] * self.lowest_drive
            D[a, b] = -D[b, b] * self.lowest_drive
        return D

    def get_bounds(self) -> tuple[Array, Array]:
        """Return lowest and highest search coordinates, (13,) each."""
        bounds = {**self._pair_bounds, **self._log_bounds, **self._linear_bounds}
        low, high = np.array([bounds[name] for name in _NAMES]).T
        return low, high

    @property
    def _pair_bounds(self) -> dict[str, tuple[float, float]]:
        """Bounds of the search coordinates at the lowest and at the highest drive."""
        units = (self.scales.force, self.scales.damping, self.scales.damping)
        return {
            name: (float(np.log(low * unit)), float(np.log(high * unit)))
            for pair, bounds, unit in zip(_PAIRS, (_YIELD_BOUNDS, _C0_BOUNDS, _C1_BOUNDS), units, strict=True)
            for name, (low, high) in zip(pair, bounds, strict=True)
        }

    @property
    def _log_bounds(self) -> dict[str, tuple[float, float]]:
        """Bounds of the other logarithmic search coordinates."""
        rate = self.scales.rate
        fastest = max(_FASTEST_FIELD * rate, _FASTEST_SAMPLED_FIELD * self.scales.sampling_rate)
        low, high = _YIELD_DISPLACEMENT_BOUNDS
        values = {
            "D_y": (low * self.scales.length, high * self.scales.length),
            "n": _SHAPES["n"],
            "eta": (_SLOWEST_FIELD * rate, fastest),
        }
        return {name: (float(np.log(a)), float(np.log(b))) for name, (a, b) in values.items()}

    @property
    def _linear_bounds(self) -> dict[str, tuple[float, float]]:
        """Bounds of the linear search coordinates."""
        return {
            "rho": _SHAPES["rho"],
            "k0": (max(_LOWEST_STIFFNESS, self.lowest_k0 / self._units["k0"]), _HIGHEST_STIFFNESS),
            "k1": (-_MAX_ACCUMULATOR_STIFFNESS, _MAX_ACCUMULATOR_STIFFNESS),
            "f0": (-_MAX_PRELOAD, _MAX_PRELOAD),
        }

    @property
    def _units(self) -> dict[str, float]:
        """Values of one unit of the linear search coordinates."""
        stiffness = self.scales.stiffness
        return {"rho": 1.0, "k0": stiffness, "k1": stiffness, "f0": self.scales.force}

    @property
    def _span(self) -> float:
        return self.highest_drive - self.lowest_drive
