"""Readings of one channel from its true values, as machine code.

A rig makes a few readings of each channel at a time. Called for so few numbers, each function of numpy would take
longer than all of this together.
"""

import math
from typing import NamedTuple

import numba
import numpy as np

from sim_rig.plant import Array, compile_function
from sim_rig.sensors.sampling import VECTOR, evaluate_cubic

_DRIFT_PERIOD = 100.0
"""[s] period of the slow drift that the mapping of a clock leaves."""


class ReadingConstants(NamedTuple):
    """Constants of one channel and one run; values in the unit of the channel."""

    delay: float
    """[s] delay that the channel reports."""
    hidden_delay: float
    """[s] delay beyond it."""
    offset: float
    """[s] error of the clock mapping."""
    drift: float
    """[s] amplitude of the slow drift of the clock mapping."""
    phase: float
    """[rad] phase of that drift at the start."""
    gain: float
    """[1] reading over true value."""
    zero: float
    """[channel unit] reading at a true value of zero."""
    zero_drift: float
    """[channel unit per s] of the zero."""
    limit: float
    """[channel unit] reading beyond which it saturates."""
    resolution: float
    """[channel unit] step of the converter, 0 for none."""


def _convert(
    true_values: Array,
    first: int,
    dt: float,
    held: bool,
    start: int,
    rate: float,
    constants: ReadingConstants,
    jitter: Array,
    noise: Array,
    stamps: Array,
    values: Array,
) -> None:
    c = constants
    for j in range(len(stamps)):
        stamp = (start + j) / rate
        instant = stamp - c.delay - c.hidden_delay + c.offset + jitter[j]
        if c.drift != 0.0:
            instant += c.drift * math.sin(2 * math.pi * stamp / _DRIFT_PERIOD + c.phase)
        if held:
            index = int(np.rint(instant / dt)) - first
            true = true_values[min(max(index, 0), len(true_values) - 1)]
        else:
            true = evaluate_cubic(true_values, instant / dt, first)
        value = true * c.gain + c.zero + c.zero_drift * stamp + noise[j]
        value = np.minimum(np.maximum(value, -c.limit), c.limit)
        stamps[j] = stamp
        values[j] = np.rint(value / c.resolution) * c.resolution if c.resolution != 0.0 else value


_COUNT = len(ReadingConstants._fields)
_CONSTANTS = numba.types.NamedUniTuple(numba.float64, _COUNT, ReadingConstants)  # type: ignore[no-untyped-call]
convert_readings = compile_function(
    _convert,
    numba.void(
        VECTOR, numba.int64, numba.float64, numba.boolean, numba.int64, numba.float64, _CONSTANTS,
        VECTOR, VECTOR, VECTOR, VECTOR,
    ),
    brief=True,
)  # fmt: skip
"""Make the readings from number ``start`` on, ``rate`` [Hz] of them in a second.

The true values are sampled every ``dt`` [s], the first of them with number ``first``; ``held`` ones keep their
value until the next. ``jitter`` [s] and ``noise`` hold one number for each reading. ``stamps`` [s] and ``values``
get the result.
"""
