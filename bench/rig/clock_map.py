"""Clock map: conversion from a device's clock to the bench clock, from bounds that hold for any delay.

Each clock reading states that the device's clock showed a time between two instants of the bench clock. This is
true however slow the wire was, and no delay has to be assumed symmetric. Request and reply give one bound each;
the tightest of many are kept. Within one window the clocks differ by an offset and a rate. All lines within the
bounds are possible, and their spread is the error bound of the map.

The converted time never jumps: the map approaches a better estimate by running slightly faster or slower.
"""

import math
import threading
from collections import deque
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from bench.rig.clock_offset import MAX_RATE_DRIFT, ClockOffsetBounds, OffsetBound, estimate_offset_bounds

Instants = npt.NDArray[np.int64]
_Numbers = npt.NDArray[np.float64]

MAX_SLEW = 5e-4
"""Largest relative rate by which the map approaches a better estimate (dimensionless)."""
CORRECTION_TIME_NS = 1_000_000_000
"""[ns] Time in which a correction is completed, if the slew limit permits."""
START_SLEW_FACTOR = 200
"""Factor on the slew limit in the first seconds (dimensionless), because the first reply may have been late."""
WINDOW_NS = 30_000_000_000
"""[ns] Time for which a clock reading is used."""
RESOLUTION_NS = 1_000
"""[ns] Resolution of a device's clock."""
_BUCKET_NS = 500_000_000
"""[ns] Interval of which only the tightest bound on each side is kept."""
_START_PHASE_NS = 2_000_000_000
"""[ns] Time after the first reading in which every reading is kept and evaluated at once."""
_MAX_CONTRADICTIONS = 5
"""Number of consecutive contradicting readings at which the earlier ones are discarded."""
CLOCK_STEP_NS = 50_000_000
"""[ns] Threshold on the contradiction of readings: above it, the clock was set and the map jumps to it."""
_NO_READING_MESSAGE = "the device's clock was never read"
_MAX_KNOTS = 48
"""Number of knots that are kept. Two are added in half a second, and samples are converted sooner than that."""


class ClockReadingProtocol(Protocol):
    """Device clock read between two instants of the bench clock, such as `drivers.ClockReading`."""

    @property
    def device_ns(self) -> int:
        """Device clock [ns]."""

    @property
    def sent_ns(self) -> int:
        """Bench clock when the request was sent [ns]."""

    @property
    def received_ns(self) -> int:
        """Bench clock when the reply was received [ns]."""


class _Knot(NamedTuple):
    """Begin of a linear piece: bench clock = ``bench_ns`` + (device clock - ``device_ns``)·``slope``."""

    device_ns: int
    bench_ns: float
    slope: float


class ClockMap:
    """Map from one device's clock to the bench clock; may be used from several threads.

    Readings are added as they are taken, and instants converted as samples arrive. The map is unknown before the
    first reading, see `is_known`.
    """

    def __init__(self) -> None:
        self.rejected_count = 0
        """Number of readings that contradicted all others and were not used."""
        self._lock = threading.Lock()
        self._last_reading: ClockReadingProtocol | None = None
        self._restart()

    def _restart(self) -> None:
        self._lows: deque[OffsetBound] = deque()
        self._highs: deque[OffsetBound] = deque()
        self._first_device_ns: int | None = None
        self._contradictions = 0
        self._offset_bounds: ClockOffsetBounds | None = None
        self._knots: deque[_Knot] = deque(maxlen=_MAX_KNOTS)
        self._knot_table: tuple[Instants, Instants, _Numbers] | None = None
        self._newest_mapped: int | None = None
        self._solved_at = 0

    @property
    def is_known(self) -> bool:
        """True if the device's clock was read."""
        return self._offset_bounds is not None

    def restart(self) -> None:
        """Discard everything, because the device and its clock have restarted."""
        with self._lock:
            self._restart()

    def add_reading(self, reading: ClockReadingProtocol) -> None:
        """Add a clock reading; a repetition of the latest one is ignored."""
        # The device rounds its clock down, so the true time may be later by up to the resolution.
        low = OffsetBound(reading.device_ns, reading.sent_ns - reading.device_ns - RESOLUTION_NS)
        high = OffsetBound(reading.device_ns, reading.received_ns - reading.device_ns)
        with self._lock:
            if reading == self._last_reading or high.offset < low.offset or not self._is_consistent(low, high):
                return
            self._last_reading = reading
            self._add_bounds(low, high)

    def add_sample(self, device_ns: int, received_ns: int) -> None:
        """Add the times of a sample, which was taken before it was received and so bounds the offset from above.

        Replies to requests may wait for an adapter. Of hundreds of samples per second, some arrive without delay.
        """
        high = OffsetBound(device_ns, received_ns - device_ns)
        with self._lock:
            bounds = self._offset_bounds
            if bounds is not None and high.offset >= bounds.find_range(device_ns)[0]:
                _add_bound(self._highs, high, early=False, sign=-1)

    def map_instants(self, device_ns: npt.ArrayLike) -> Instants:
        """Convert instants of the device's clock to the bench clock.

        Args:
            device_ns: device clock [ns], any shape.

        Returns:
            Bench clock [ns] of the same shape, increasing with the device's clock.

        Raises:
            ValueError: the clock was never read.
        """
        instants = np.asarray(device_ns, dtype=np.int64)
        with self._lock:
            if not self._knots:
                raise ValueError(_NO_READING_MESSAGE)
            if instants.size:
                newest = int(instants.max())
                self._newest_mapped = newest if self._newest_mapped is None else max(self._newest_mapped, newest)
            return self._map_array(instants)

    def map_instant(self, device_ns: int) -> int:
        """Convert one instant [ns] as `map_instants` does, fast enough for every cycle.

        Raises:
            ValueError: the clock was never read.
        """
        with self._lock:
            if not self._knots:
                raise ValueError(_NO_READING_MESSAGE)
            knot = next((one for one in reversed(self._knots) if one.device_ns <= device_ns), self._knots[0])
            return round(knot.bench_ns) + round((device_ns - knot.device_ns) * knot.slope)

    def compute_error_bound(self) -> float:
        """Return the clock error bound at the newest converted instant [s]; infinite before the first reading.

        It holds for any delay on the wire while the device's rate drifts by less than `MAX_RATE_DRIFT`, and so for
        more than 95 % of the samples.
        """
        with self._lock:
            if self._offset_bounds is None:
                return math.inf
            newest = max(self._offset_bounds.device_ns, self._newest_mapped or 0)
            instants = [self._offset_bounds.device_ns, newest]
            offsets = self._map_array(np.array(instants)) - instants
            ranges = [self._offset_bounds.find_range(instant) for instant in instants]
            errors = [
                max(high - offset, offset - low) for offset, (low, high) in zip(offsets, ranges, strict=True)
            ]
            return float(max(errors)) * 1e-9

    def estimate_rate(self) -> float:
        """Return the relative rate deviation of the device's clock: 50e-6 if it is 50 ppm fast."""
        with self._lock:
            return -self._offset_bounds.rate if self._offset_bounds else 0.0

    def _is_consistent(self, low: OffsetBound, high: OffsetBound) -> bool:
        """Return whether a reading agrees with the others; several contradicting ones in a row replace them."""
        bounds = self._offset_bounds
        if bounds is None:
            return True
        least, most = bounds.find_range(low.device_ns)
        distance = max(low.offset - most, least - high.offset)
        if distance <= RESOLUTION_NS + MAX_RATE_DRIFT * abs(low.device_ns - bounds.device_ns):
            self._contradictions = 0
            return True
        self._contradictions += 1
        self.rejected_count += 1
        if self._contradictions < _MAX_CONTRADICTIONS:
            return False
        if distance > CLOCK_STEP_NS:
            self._restart()
        self._discard_readings()
        return True

    def _discard_readings(self) -> None:
        self._lows.clear()
        self._highs.clear()
        self._first_device_ns, self._contradictions = None, 0

    def _add_bounds(self, low: OffsetBound, high: OffsetBound) -> None:
        device_ns = low.device_ns
        self._first_device_ns = device_ns if self._first_device_ns is None else self._first_device_ns
        early = self._is_start_phase(device_ns)
        _add_bound(self._lows, low, early=early, sign=1)
        _add_bound(self._highs, high, early=early, sign=-1)
        if early or device_ns - self._solved_at >= _BUCKET_NS:
            self._solve(device_ns)

    def _is_start_phase(self, device_ns: int) -> bool:
        return self._first_device_ns is not None and device_ns - self._first_device_ns < _START_PHASE_NS

    def _solve(self, device_ns: int) -> None:
        self._solved_at = device_ns
        for side in (self._lows, self._highs):
            while len(side) > 1 and side[0].device_ns < device_ns - WINDOW_NS:
                side.popleft()
        bounds = estimate_offset_bounds(self._lows, self._highs, device_ns)
        while bounds is None:  # the rate has changed by more than its limit, so the oldest bounds are removed
            oldest = self._lows if self._lows[0].device_ns <= self._highs[0].device_ns else self._highs
            shortened = oldest if len(oldest) > 1 else self._lows if len(self._lows) > 1 else self._highs
            shortened.popleft()
            bounds = estimate_offset_bounds(self._lows, self._highs, device_ns)
        self._offset_bounds = bounds
        self._add_knots(bounds, device_ns)

    def _add_knots(self, bounds: ClockOffsetBounds, device_ns: int) -> None:
        """Let the map approach the estimate from an instant on; times that were converted stay as they are."""
        self._knot_table = None
        rate = 1 + bounds.rate
        if self._newest_mapped is None or not self._knots:  # nothing was converted, so the map may jump
            self._knots.clear()
            self._knots.append(_Knot(device_ns, device_ns + bounds.estimate_offset(device_ns), rate))
            return
        # The knot is placed after the newest sample, because converted times must not change.
        device_ns = max(device_ns, self._newest_mapped)
        while len(self._knots) > 1 and self._knots[-1].device_ns > device_ns:
            self._knots.pop()
        last = self._knots[-1]
        bench_ns = last.bench_ns + (device_ns - last.device_ns) * last.slope
        missing = device_ns + bounds.estimate_offset(device_ns) - bench_ns
        slew = self._choose_slew(missing, device_ns)
        duration = round(missing / slew) if slew else 0
        self._knots.append(_Knot(device_ns, bench_ns, rate + slew))
        self._knots.append(_Knot(device_ns + duration, bench_ns + duration * (rate + slew), rate))

    def _choose_slew(self, missing: float, device_ns: int) -> float:
        """Return the additional rate (dimensionless) by which the map corrects a missing offset [ns]."""
        factor = START_SLEW_FACTOR if self._is_start_phase(device_ns) else 1
        return min(max(factor * missing / CORRECTION_TIME_NS, -factor * MAX_SLEW), factor * MAX_SLEW)

    def _map_array(self, instants: Instants) -> Instants:
        """Convert relative to a knot, because a double cannot resolve nanoseconds over months."""
        last = self._knots[-1]
        if instants.size and instants.min() >= last.device_ns:
            offsets = np.rint((instants - last.device_ns) * last.slope).astype(np.int64)
            return np.asarray(round(last.bench_ns) + offsets)
        starts, begins, slopes = self._get_knot_table()
        index = np.clip(np.searchsorted(starts, instants, side="right") - 1, 0, None)
        return np.asarray(begins[index] + np.rint((instants - starts[index]) * slopes[index]).astype(np.int64))

    def _get_knot_table(self) -> tuple[Instants, Instants, _Numbers]:
        """Return the knots as arrays: device clock [ns], bench clock [ns], slope."""
        if self._knot_table is None:
            device_ns, bench_ns, slope = zip(*self._knots, strict=True)
            self._knot_table = np.array(device_ns), np.array([round(one) for one in bench_ns]), np.array(slope)
        return self._knot_table


def _add_bound(bounds: deque[OffsetBound], bound: OffsetBound, *, early: bool, sign: int) -> None:
    """Add a bound; within one bucket, where the clocks hardly diverge, only the tightest is kept."""
    is_same = bounds and not early and bound.device_ns // _BUCKET_NS == bounds[-1].device_ns // _BUCKET_NS
    if not is_same:
        bounds.append(bound)
    elif sign * bound.offset > sign * bounds[-1].offset:
        bounds[-1] = bound
