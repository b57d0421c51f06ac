"""Clock offset bounds: offsets between two clocks that all clock readings allow, and their most probable line.

Delays only make a reply late. The instant of the request therefore bounds the offset from below, that of the reply
from above. Every line within all bounds is possible; the most probable line is the one by which requests and
replies were least delayed.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

_Numbers = npt.NDArray[np.float64]

MAX_RATE = 1e-3
"""Largest relative rate deviation of a device's clock (dimensionless)."""
MAX_RATE_DRIFT = 5e-7
"""Largest change of the relative rate within a window (dimensionless); older bounds are widened by it."""
REQUEST_SHARE = 0.15
"""Share of a short exchange that the request takes (dimensionless).

The device reads its clock when it has received the request; the reply still has to be composed, collected and
transferred. Measured: 0.13 on Modbus TCP and on the serial line, 0.22 on CANopen."""
MAX_REQUEST_NS = 100_000
"""[ns] Largest transfer time of the fastest of many requests, however late the replies.

Late replies are due to a busy instrument and its adapter. Measured: 0.03 ms on Modbus TCP, 0.06 ms on the serial
line, 0.17 ms on CANopen."""
_RATE_COUNT = 65
"""Number of possible rates that are compared."""
_TYPICAL_RATE = 1e-4
"""Typical relative rate deviation (dimensionless): scale of its prior, which counts if readings are few."""
_MIN_DELAY_NS = 20_000.0
"""[ns] Lower limit of the mean delay."""


class OffsetBound(NamedTuple):
    """Bound of the clock offset, bench minus device [ns], at an instant of the device's clock [ns]."""

    device_ns: int
    offset: int


class ClockOffsetBounds(NamedTuple):
    """Offsets and rates of the offset that all bounds allow, at one instant of the device's clock."""

    device_ns: int
    low: float
    """Smallest possible offset [ns]."""
    high: float
    """Largest possible offset [ns]."""
    rate_low: float
    """Smallest possible rate of the offset (dimensionless)."""
    rate_high: float
    """Largest possible rate of the offset (dimensionless)."""
    offset_low: float
    """Smallest offset at the most probable rate [ns]."""
    offset_width: float
    """Distance between the bounds at the most probable rate [ns]."""
    rate: float
    """Most probable rate of the offset (dimensionless), at which requests and replies were least delayed."""

    def estimate_offset(self, device_ns: int) -> float:
        """Return the most probable offset at an instant of the device's clock [ns]."""
        return (
            self.offset_low
            + min(REQUEST_SHARE * self.offset_width, MAX_REQUEST_NS)
            + (device_ns - self.device_ns) * self.rate
        )

    def find_range(self, device_ns: int) -> tuple[float, float]:
        """Return the smallest and the largest possible offset at an instant of the device's clock [ns]."""
        ahead = device_ns - self.device_ns
        changes = (ahead * self.rate_low, ahead * self.rate_high)
        return self.low + min(changes), self.high + max(changes)


def estimate_offset_bounds(
    lows: Sequence[OffsetBound], highs: Sequence[OffsetBound], device_ns: int
) -> ClockOffsetBounds | None:
    """Estimate the offset bounds at an instant of the device's clock [ns]; None if no line is within them."""
    # Relative to one offset: a double cannot resolve nanoseconds between clocks that were started months apart.
    origin = lows[-1].offset
    low_x, low_y = _make_arrays(lows, device_ns, origin)
    high_x, high_y = _make_arrays(highs, device_ns, origin)
    # Older bounds are wider, because the rates may have drifted since.
    low_y, high_y = low_y + MAX_RATE_DRIFT * np.minimum(low_x, 0), high_y - MAX_RATE_DRIFT * np.minimum(high_x, 0)
    rate_low, rate_high = _find_rate_range(low_x, low_y, high_x, high_y)
    if rate_low > rate_high:
        return None
    rates = np.linspace(rate_low, rate_high, _RATE_COUNT)
    least = (low_y[:, None] - np.outer(low_x, rates)).max(axis=0)
    # At the ends of the range the bounds meet; rounding must not make them cross.
    most = np.maximum((high_y[:, None] - np.outer(high_x, rates)).min(axis=0), least)
    # The width alone must not decide: an adapter that delays replies would then determine the rate, and the force
    # would be displaced by up to 0.5 ms.
    cost = _compute_delay_cost(least - (low_y.mean() - low_x.mean() * rates), len(low_y))
    cost += _compute_delay_cost((high_y.mean() - high_x.mean() * rates) - most, len(high_y))
    # Negative log-likelihood of the delays, plus that of the rate.
    best = int(np.argmin(cost + np.abs(rates) / _TYPICAL_RATE))
    return ClockOffsetBounds(
        device_ns,
        origin + float(least.min()),
        origin + float(most.max()),
        rate_low,
        rate_high,
        origin + float(least[best]),
        float(most[best] - least[best]),
        float(rates[best]),
    )


def _find_rate_range(low_x: _Numbers, low_y: _Numbers, high_x: _Numbers, high_y: _Numbers) -> tuple[float, float]:
    """Return the smallest and the largest rate that all bounds allow; the first exceeds the second if none is.

    A line fits all bounds exactly if it fits each pair of a lower and an upper one: the pair limits its rate.
    """
    distance, rise = low_x[:, None] - high_x, low_y[:, None] - high_y
    if np.any(rise[distance == 0.0] > 0.0):
        return MAX_RATE, -MAX_RATE
    with np.errstate(divide="ignore", invalid="ignore"):
        limits = rise / distance
    lowest = limits[distance > 0.0].max(initial=-MAX_RATE)
    highest = limits[distance < 0.0].min(initial=MAX_RATE)
    return float(lowest), float(highest)


def _compute_delay_cost(mean: _Numbers, count: int) -> _Numbers:
    """Return the cost of one side's mean delays [ns] at each rate, relative to the smallest.

    Delays are assumed to be exponential. The side with short delays therefore determines the rate, however the
    delays of the other side scatter.
    """
    return count * mean / max(float(mean.min()), _MIN_DELAY_NS)


def _make_arrays(bounds: Sequence[OffsetBound], device_ns: int, origin: int) -> tuple[_Numbers, _Numbers]:
    x = np.array([bound.device_ns - device_ns for bound in bounds], dtype=np.float64)
    y = np.array([bound.offset - origin for bound in bounds], dtype=np.float64)
    return x, y
