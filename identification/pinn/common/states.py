"""States of the network over time, and their units."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array

Indices = npt.NDArray[np.int64]

Y_UNIT = 1e-3
"""Inner displacement [m] of an output weight of one."""
SlipVelocity = Callable[[Array], Array]
"""Slip velocity x' - y' [m/s] at times [s] of one piece."""


class TimeSpan(NamedTuple):
    """Part of a piece that is learned, on the piece's own time [s]."""

    start: float
    end: float


class States(NamedTuple):
    """States of the network at some times, (N,) each."""

    z: Array
    """Hysteretic variable over its saturation [1]."""
    y: Array
    """Inner displacement [m]."""
    y_rate: Array
    """Inner velocity [m/s]."""
