"""Variables of defined effects along an excitation, computed when an effect asks for them.

A variable that depends on the past has a definition that is the same on every recording: a reversal and a rest
are those of the displacement after a deadband, so noise at rest is neither.
"""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from identification.arrays import Array, njit_cached
from identification.simulate.simulation_model import Excitation
from identification.simulate.stored_energy import compute_stored_energy

DEADBAND = 1e-6
"""Half width of the deadband of the displacement [m]."""
REST_TIME = 0.2
"""Time without a change of the displacement, after the deadband, that counts as rest [s]."""
_NO_LOSS = 1e12
"""Recovery time with which dissipated energy stays in the damper [s]."""


@njit_cached
def apply_deadband(x: Array, still: float) -> Array:
    """Return the displacement (N,) [m] that follows x only where x leaves a band of ``still`` to either side."""
    found = np.empty(len(x))
    held = x[0]
    for i in range(len(x)):
        held = min(max(held, x[i] - still), x[i] + still)
        found[i] = held
    return found


@njit_cached
def trace_last_reversal(values: Array) -> Array:
    """Return the value (N,) at the last reversal of a signal (N,), or its first value before any."""
    found = np.empty(len(values))
    turned, direction = values[0], 0.0
    found[0] = turned
    for i in range(1, len(values)):
        change = values[i] - values[i - 1]
        if change * direction < 0.0:
            turned = values[i - 1]
        if change != 0.0:
            direction = change
        found[i] = turned
    return found


@njit_cached
def trace_travel_since_rest(x: Array, h: float, rest: float) -> Array:
    """Return the path (N,) [m] since a displacement (N,) last stayed unchanged for ``rest`` [s]."""
    found = np.zeros(len(x))
    unchanged = rest
    for i in range(1, len(x)):
        path = abs(x[i] - x[i - 1])
        unchanged = 0.0 if path > 0.0 else unchanged + h
        found[i] = 0.0 if unchanged >= rest else found[i - 1] + path
    return found


class DamperVariables(Mapping[str, Array]):
    """Variables (N,) at the samples of a motion, by name; each is computed once."""

    def __init__(self, excitation: Excitation, x: Array, v: Array, a: Array) -> None:
        self._known: dict[str, Array] = {"displacement": x, "velocity": v, "acceleration": a}
        self._rules: dict[str, Callable[[], Array]] = {
            "drive": lambda: excitation.sampled_drive,
            "time": lambda: excitation.time,
            "dissipated_energy": lambda: compute_stored_energy(excitation, _NO_LOSS),
            "travel_since_reversal": self._compute_travel_since_reversal,
            "travel_since_rest": lambda: trace_travel_since_rest(self._steady, 1.0 / excitation.rate, REST_TIME),
        }

    def __getitem__(self, name: str) -> Array:
        """Return a variable."""
        if name not in self._known:
            self._known[name] = self._rules[name]()
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter({**self._known, **self._rules})

    def __len__(self) -> int:
        """Return the number of variables."""
        return len({**self._known, **self._rules})

    @property
    def _steady(self) -> Array:
        return np.asarray(apply_deadband(self["displacement"], DEADBAND))

    def _compute_travel_since_reversal(self) -> Array:
        steady = self._steady
        return np.abs(steady - trace_last_reversal(steady))


class MovedVariables(Mapping[str, Array]):
    """Variables of another motion near that of some samples: variables of the past are those of the samples."""

    def __init__(self, samples: DamperVariables, x: Array, v: Array) -> None:
        self._samples, self._motion = samples, {"displacement": x, "velocity": v}

    def __getitem__(self, name: str) -> Array:
        """Return a variable; where the motion is given half way between the samples, it is interpolated."""
        if name in self._motion:
            return self._motion[name]
        values = self._samples[name]
        return values if len(values) == len(self._motion["velocity"]) else 0.5 * (values[1:] + values[:-1])

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._samples)

    def __len__(self) -> int:
        """Return the number of variables."""
        return len(self._samples)


def make_coil_variables(values: Array, start: float, h: float) -> dict[str, Array]:
    """Return the variables (N,) of the coil for a drive or field (N,) whose values are ``h`` [s] apart."""
    return {
        "drive": values,
        "drive_history": trace_last_reversal(values),
        "time": np.asarray(start + h * np.arange(len(values)), float),
    }
