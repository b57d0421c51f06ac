"""What bounds leave of the offset between two clocks, and the likeliest line between them.

Delays only ever make an answer late: a question bounds the offset from below, an answer from above. Every line
that keeps to all bounds is possible; the likeliest is the one by which questions and answers were least late.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

_Numbers = npt.NDArray[np.float64]

FASTEST = 1e-3
"""Share by which a device's clock may be fast or slow."""
WANDER = 5e-7
"""Share by which a clock's rate may change within a window: an old bound is loosened by it."""
LEAN = 0.15
"""Share of a quick exchange that its question takes: the clock is read as soon as that is understood, while the
answer has still to be made, collected and carried, and is longer. Measured: 0.13 on Modbus TCP and on the serial
line, 0.22 on CANopen."""
QUESTION_NS = 100_000
"""[ns] that the quickest of many questions takes at most, however late the answers are: those wait for a busy
instrument and its adapter. Measured: 0.03 ms on Modbus TCP, 0.06 ms on the serial line, 0.17 ms on CANopen."""
_RATES = 65
"""Rates tried at a time."""
_USUAL_RATE = 1e-4
"""Share by which clocks differ, as a rule: where stamps tell little, they are taken to be alike."""
_SHORTEST_NS = 20_000.0
"""[ns] below which a typical delay is not believed."""
_ZOOMS = 4
"""Times that the rates tried are spread anew over those that are possible."""


class Bound(NamedTuple):
    """A bound of the offset, bench minus device [ns], at an instant of the device's clock [ns]."""

    at: int
    offset: int


class Corridor(NamedTuple):
    """What the bounds leave at one instant of the device's clock."""

    at: int
    low: float
    """Least offset possible [ns]."""
    high: float
    """Largest offset possible [ns]."""
    slowest: float
    """Least rate of the offset possible."""
    fastest: float
    """Largest rate of the offset possible."""
    line: float
    """Least offset [ns] by the likeliest rate."""
    gap: float
    """[ns] that it leaves between the bounds."""
    rate: float
    """The likeliest rate of the offset: that by which questions and answers were least late."""

    def likeliest(self, at: int) -> float:
        """The likeliest offset [ns]."""
        return self.line + min(LEAN * self.gap, QUESTION_NS) + (at - self.at) * self.rate

    def possible(self, at: int) -> tuple[float, float]:
        """Least and largest offset at an instant [ns]."""
        ahead = at - self.at
        rates = (ahead * self.slowest, ahead * self.fastest)
        return self.low + min(rates), self.high + max(rates)


def corridor(lows: Sequence[Bound], highs: Sequence[Bound], at: int) -> Corridor | None:
    """What all bounds leave at an instant [ns]; none where no line keeps to them all."""
    # Relative to one of them: nanoseconds between clocks that were started months apart do not fit a double.
    origin = lows[-1].offset
    low_x, low_y = _arrays(lows, at, origin)
    high_x, high_y = _arrays(highs, at, origin)
    # The older a bound, the less it says of now: the clocks' rates may have wandered since.
    low_y, high_y = low_y + WANDER * np.minimum(low_x, 0), high_y - WANDER * np.minimum(high_x, 0)
    rates = np.linspace(-FASTEST, FASTEST, _RATES)
    found: Corridor | None = None
    for _ in range(_ZOOMS):
        least = (low_y[:, None] - np.outer(low_x, rates)).max(axis=0)
        most = (high_y[:, None] - np.outer(high_x, rates)).min(axis=0)
        possible = np.flatnonzero(most >= least)
        first, last = possible[[0, -1]] if possible.size else [np.argmax(most - least)] * 2
        if possible.size:
            edges = least[possible].min(), most[possible].max(), rates[first], rates[last]
            gap = most - least
            # Judged by the width between the bounds alone, an adapter that holds answers back decides the rate,
            # and the force comes up to 0.5 ms off.
            late = _lateness(least - (low_y.mean() - low_x.mean() * rates), len(low_y))
            late += _lateness((high_y.mean() - high_x.mean() * rates) - most, len(high_y))
            # Minus the logarithm of how likely each is: such delays, and clocks that differ by so much.
            best = possible[np.argmin((late + np.abs(rates) / _USUAL_RATE)[possible])]
            low, high, slowest, fastest = (float(edge) for edge in edges)
            line = origin + float(least[best])
            found = Corridor(
                at, origin + low, origin + high, slowest, fastest, line, float(gap[best]), float(rates[best])
            )
        # The edge of what is possible lies between two rates that were tried: one more on each side.
        rates = np.linspace(rates[max(first - 1, 0)], rates[min(last + 1, _RATES - 1)], _RATES)
    return found


def _lateness(mean: _Numbers, count: int) -> _Numbers:
    """How unlikely one side's lateness is by each rate, as its share of what it is at best.

    Delays are taken to be exponential. The side whose delays are short then says what the rate is; the other's may
    scatter as an adapter likes.
    """
    return count * mean / max(float(mean.min()), _SHORTEST_NS)


def _arrays(bounds: Sequence[Bound], at: int, origin: int) -> tuple[_Numbers, _Numbers]:
    x = np.array([bound.at - at for bound in bounds], dtype=np.float64)
    y = np.array([bound.offset - origin for bound in bounds], dtype=np.float64)
    return x, y
