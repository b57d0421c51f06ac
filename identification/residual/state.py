"""State of a damper on which its residual may depend, without units.

Velocity, acceleration and travel since the last reversal are compressed: a residual changes fastest near a
reversal, where all three are small or change their sign. The recent speed distinguishes a reversal from rest, and
a slow stroke from the turn of a fast one. All other variables are alike there. The changes of force and velocity
over a short time show lags of coil, oil and channels, which the law has only in part.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.simulate import Excitation, apply_deadband, filter_series, trace_last_reversal

_TRAVEL, _VELOCITY, _ACCELERATION = 0.01, 0.03, 0.1
"""Travel over half the stroke, velocity and acceleration over their peaks [1], from which each is compressed."""
_DEADBAND = 1e-3
"""Half width, over half the stroke [1], of the deadband within which a change of direction is no reversal."""
_RECENT = 2.0
"""Time constant of the recent speed, over half the stroke at the peak speed [1]."""
_CHANGE_TIME = 0.1
"""Time constant of the mean from which a change is measured, over half the stroke at the peak speed [1]."""
_FORCE_CHANGE = 0.25
"""Change of the force, over its standard deviation [1], that counts as one."""
VARIABLES = (
    "travel_since_reversal", "velocity", "drive", "law_force", "recent_speed", "force_change", "velocity_change",
    "displacement", "acceleration",
)  # fmt: skip
"""Names of the variables of a state, the likeliest first."""

State = Mapping[str, Array]
"""Variables (N,) by name, each without unit and of the order of one."""


class StateUnits(NamedTuple):
    """Units of a recording in which the state is expressed."""

    force: float
    """Standard deviation of the force [N]."""
    length: float
    """Half of the largest stroke [m]."""
    centre: float
    """Middle of the largest stroke [m]."""
    velocity: float
    """Peak speed [m/s]."""
    lowest_drive: float
    """Lowest drive [V or A]."""
    highest_drive: float
    """Highest drive [V or A]; one above the lowest where the drive is constant."""


def compute_state(excitation: Excitation, law_force: Array, units: StateUnits) -> State:
    """Return the state along an excitation.

    Args:
        excitation: motion and drive, N samples.
        law_force: (N,) force of law and effects [N].
        units: units of the recordings from which the residual is learned.
    """
    x, v, a = excitation.displacement, excitation.velocity, excitation.acceleration
    steady = apply_deadband(x, _DEADBAND * units.length)
    travel = steady - trace_last_reversal(steady)
    drive = (excitation.sampled_drive - units.lowest_drive) / (units.highest_drive - units.lowest_drive)
    return {
        "travel_since_reversal": _compress(travel / units.length, _TRAVEL),
        "velocity": _compress(v / units.velocity, _VELOCITY),
        "drive": 2.0 * drive,
        "law_force": law_force / units.force,
        "recent_speed": _compress(_average_speed(v, excitation.rate, units) / units.velocity, _VELOCITY),
        "force_change": _measure_change(law_force, excitation.rate, units) / (_FORCE_CHANGE * units.force),
        "velocity_change": _compress(_measure_change(v, excitation.rate, units) / units.velocity, _VELOCITY),
        "displacement": 2.0 * (x - units.centre) / units.length,
        "acceleration": _compress(a * units.length / units.velocity**2, _ACCELERATION),
    }


def _average_speed(velocity: Array, rate: float, units: StateUnits) -> Array:
    """Return the speed (N,) [m/s] averaged over the recent past, with weights that fall exponentially."""
    samples, speed = _RECENT * units.length / units.velocity * rate, np.abs(velocity)
    # As if the first stretch of this length had lasted for long before.
    return _average_past(speed, samples, float(speed[: max(1, round(samples))].mean()))


def _measure_change(values: Array, rate: float, units: StateUnits) -> Array:
    """Return values (N,) less their mean over the recent past, with weights that fall exponentially."""
    samples = _CHANGE_TIME * units.length / units.velocity * rate
    return values - _average_past(values, samples, float(values[0]))


def _average_past(values: Array, samples: float, before: float) -> Array:
    """Return the mean (N,) of values (N,) and of their past, with weights that fall over so many samples.

    ``before`` is the mean at the start.
    """
    weight = 1.0 / (1.0 + samples)
    b, a = np.array([weight, 0.0]), np.array([1.0, weight - 1.0])
    return filter_series(b, a, values, np.array([(1.0 - weight) * before]))


def _compress(values: Array, threshold: float) -> Array:
    """Return values (N,) on a scale that is linear below a threshold and logarithmic above it."""
    return np.asarray(np.arcsinh(values / threshold))
