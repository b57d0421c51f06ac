"""A device's clock on the bench's: bounds from questions and answers, a smooth line between them.

Each stamp says that the device's clock showed a time while the bench's stood between two others. However slow the
wire was, that is true, and no delay has to be assumed symmetric: question and answer give one bound each, and the
tightest of many remain. Within one window the two clocks differ by an offset and a rate; every line that keeps to
all bounds is possible, and what they leave is how far the one taken may be off.

What is handed out never jumps: a better estimate is approached by running a little faster or slower.
"""

import math
import threading
from collections import deque
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from bench.rig.corridor import WANDER, Bound, Corridor, corridor

Instants = npt.NDArray[np.int64]
_Numbers = npt.NDArray[np.float64]

SLEW = 5e-4
"""Share by which the mapping may run faster or slower than the clocks do, to take up a correction."""
TAKEN_UP_NS = 1_000_000_000
"""[ns] over which a correction is taken up, where the slew allows it."""
HASTE = 200
"""Times as fast in the first seconds, when the first answer may have been a slow one."""
WINDOW_NS = 30_000_000_000
"""[ns] for which a stamp counts."""
RESOLUTION_NS = 1_000
"""[ns] a device's clock shows."""
_BUCKET_NS = 500_000_000
"""[ns] of which the tightest bound on each side is kept."""
_SOON_NS = 2_000_000_000
"""[ns] in the beginning in which every stamp is kept and used at once."""
_FALSE_STAMPS = 5
"""Stamps in a row that contradict all before: then these were wrong, or the clock has been set."""
SET_ANEW_NS = 50_000_000
"""[ns] by which a clock must have moved for the mapping to follow in one leap."""
_NEVER_READ = "the device's clock has never been read beside the bench's"
_KNOTS = 48
"""Bends of the mapping that are remembered, two of them in half a second; samples come sooner than that."""


class Stamped(Protocol):
    """A device's clock that was read between two instants of the bench's; `drivers.channel.Stamp` is one."""

    @property
    def device_ns(self) -> int:
        """The device's clock [ns]."""

    @property
    def sent_ns(self) -> int:
        """Bench clock before it was read [ns]."""

    @property
    def received_ns(self) -> int:
        """Bench clock after it was read [ns]."""


class _Knot(NamedTuple):
    """From ``at`` on, the bench clock is ``bench`` + (device - ``at``)·``slope``, until the next knot."""

    at: int
    bench: float
    slope: float


class ClockMap:
    """One device's clock on the bench's; may be used from several threads.

    It is fed as stamps come and asked as samples come. Before the first stamp it knows nothing: see `known`.
    """

    def __init__(self) -> None:
        self.rejected = 0
        """Stamps that contradicted all others and were not used."""
        self._lock = threading.Lock()
        self._fed: Stamped | None = None
        self._restart()

    def _restart(self) -> None:
        self._lows: deque[Bound] = deque()
        self._highs: deque[Bound] = deque()
        self._first: int | None = None
        self._contradictions = 0
        self._corridor: Corridor | None = None
        self._knots: deque[_Knot] = deque(maxlen=_KNOTS)
        self._arrays: tuple[Instants, Instants, _Numbers] | None = None
        self._handed: int | None = None
        self._solved = 0

    @property
    def known(self) -> bool:
        """Whether there has been a stamp."""
        return self._corridor is not None

    def restart(self) -> None:
        """Forget everything: the device has started anew, and its clock with it."""
        with self._lock:
            self._restart()

    def feed(self, stamp: Stamped) -> None:
        """Take a stamp.

        Args:
            stamp: the device's clock between two instants of the bench's; the same one again tells nothing.
        """
        # What it shows has been rounded down: it may have been further by as much as its resolution.
        low = Bound(stamp.device_ns, stamp.sent_ns - stamp.device_ns - RESOLUTION_NS)
        high = Bound(stamp.device_ns, stamp.received_ns - stamp.device_ns)
        with self._lock:
            if stamp == self._fed or high.offset < low.offset or not self._believed(low, high):
                return
            self._fed = stamp
            self._take(low, high)

    def feed_sample(self, device_ns: int, received_ns: int) -> None:
        """Take a sample's stamp: it had been taken before it came, which bounds the offset from above.

        Answers to questions may wait for an adapter; of hundreds of samples a second some just catch it.
        """
        high = Bound(device_ns, received_ns - device_ns)
        with self._lock:
            corridor = self._corridor
            if corridor is not None and high.offset >= corridor.possible(device_ns)[0]:
                _keep(self._highs, high, early=False, sign=-1)

    def bench_ns(self, device_ns: npt.ArrayLike) -> Instants:
        """The bench clock at instants of the device's.

        Args:
            device_ns: the device's clock [ns], any shape.

        Returns:
            Bench clock [ns], of the same shape; grows with the device's clock.

        Raises:
            ValueError: there has been no stamp.
        """
        asked = np.asarray(device_ns, dtype=np.int64)
        with self._lock:
            if not self._knots:
                raise ValueError(_NEVER_READ)
            if asked.size:
                newest = int(asked.max())
                self._handed = newest if self._handed is None else max(self._handed, newest)
            return self._mapped(asked)

    def instant(self, device_ns: int) -> int:
        """`bench_ns` of one instant [ns], quick enough for every cycle.

        Raises:
            ValueError: there has been no stamp.
        """
        with self._lock:
            if not self._knots:
                raise ValueError(_NEVER_READ)
            knot = next((one for one in reversed(self._knots) if one.at <= device_ns), self._knots[0])
            return round(knot.bench) + round((device_ns - knot.at) * knot.slope)

    def skew(self) -> float:
        """Bound of what the mapping leaves at the newest instant [s]; infinite before the first stamp.

        It holds for any delays on the wire as long as the device's rate is steady (`WANDER`), so for more than
        95 of 100 samples.
        """
        with self._lock:
            if self._corridor is None:
                return math.inf
            instants = [self._corridor.at, max(self._corridor.at, self._handed or 0)]
            offsets = self._mapped(np.array(instants)) - instants
            spans = [self._corridor.possible(at) for at in instants]
            left = [max(high - own, own - low) for own, (low, high) in zip(offsets, spans, strict=True)]
            return float(max(left)) * 1e-9

    def rate(self) -> float:
        """How fast the device's clock runs, as a share above the bench's: 50e-6 for 50 ppm too fast."""
        with self._lock:
            return -self._corridor.rate if self._corridor else 0.0

    def _believed(self, low: Bound, high: Bound) -> bool:
        """Whether a stamp can be true together with those before; several that cannot speak against these."""
        corridor = self._corridor
        if corridor is None:
            return True
        least, most = corridor.possible(low.at)
        apart = max(low.offset - most, least - high.offset)
        if apart <= RESOLUTION_NS + WANDER * abs(low.at - corridor.at):
            self._contradictions = 0
            return True
        self._contradictions += 1
        self.rejected += 1
        if self._contradictions < _FALSE_STAMPS:
            return False
        if apart > SET_ANEW_NS:
            self._restart()
        self._lows.clear()
        self._highs.clear()
        self._first, self._contradictions = None, 0
        return True

    def _take(self, low: Bound, high: Bound) -> None:
        self._first = low.at if self._first is None else self._first
        early = self._early(low.at)
        _keep(self._lows, low, early=early, sign=1)
        _keep(self._highs, high, early=early, sign=-1)
        if early or low.at - self._solved >= _BUCKET_NS:
            self._solve(low.at)

    def _early(self, at: int) -> bool:
        return self._first is not None and at - self._first < _SOON_NS

    def _solve(self, at: int) -> None:
        self._solved = at
        while len(self._lows) > 1 and self._lows[0].at < at - WINDOW_NS:
            self._lows.popleft()
        while len(self._highs) > 1 and self._highs[0].at < at - WINDOW_NS:
            self._highs.popleft()
        found = corridor(self._lows, self._highs, at)
        while found is None:  # the rate has changed by more than it may: what is old goes first
            oldest = self._lows if self._lows[0].at <= self._highs[0].at else self._highs
            shorter = oldest if len(oldest) > 1 else self._lows if len(self._lows) > 1 else self._highs
            shorter.popleft()
            found = corridor(self._lows, self._highs, at)
        self._corridor = found
        self._bend(found, at)

    def _bend(self, corridor: Corridor, at: int) -> None:
        """Let the mapping approach the estimate from here on; what has been handed out stays as it is."""
        self._arrays = None
        rate = 1 + corridor.rate
        if self._handed is None or not self._knots:  # nobody has asked yet: no need to approach it softly
            self._knots.clear()
            self._knots.append(_Knot(at, at + corridor.likeliest(at), rate))
            return
        # What was handed out must not change any more: the bend lies behind the newest sample.
        at = max(at, self._handed)
        while len(self._knots) > 1 and self._knots[-1].at > at:
            self._knots.pop()
        last = self._knots[-1]
        here = last.bench + (at - last.at) * last.slope
        missing = at + corridor.likeliest(at) - here
        haste = HASTE if self._early(at) else 1
        slew = min(max(haste * missing / TAKEN_UP_NS, -haste * SLEW), haste * SLEW)
        over = round(missing / slew) if slew else 0
        self._knots.append(_Knot(at, here, rate + slew))
        self._knots.append(_Knot(at + over, here + over * (rate + slew), rate))

    def _mapped(self, asked: Instants) -> Instants:
        """Relative to the newest knot, since nanoseconds of months do not fit a double."""
        last = self._knots[-1]
        if asked.size and asked.min() >= last.at:
            return np.asarray(round(last.bench) + np.rint((asked - last.at) * last.slope).astype(np.int64))
        starts, begins, slopes = self._table()
        place = np.clip(np.searchsorted(starts, asked, side="right") - 1, 0, None)
        return np.asarray(begins[place] + np.rint((asked - starts[place]) * slopes[place]).astype(np.int64))

    def _table(self) -> tuple[Instants, Instants, _Numbers]:
        """The knots as arrays: device clock [ns], bench clock [ns], slope; asked far more often than bent."""
        if self._arrays is None:
            at, bench, slope = zip(*self._knots, strict=True)
            self._arrays = np.array(at), np.array([round(place) for place in bench]), np.array(slope)
        return self._arrays


def _keep(bounds: deque[Bound], bound: Bound, *, early: bool, sign: int) -> None:
    """Keep a bound; of one bucket the tightest alone, where the clocks hardly move apart."""
    same = bounds and not early and bound.at // _BUCKET_NS == bounds[-1].at // _BUCKET_NS
    if not same:
        bounds.append(bound)
    elif sign * bound.offset > sign * bounds[-1].offset:
        bounds[-1] = bound
