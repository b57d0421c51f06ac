"""Interlocks: every sample is checked on arrival, and every command before it is sent.

Time and samples are passed in and limit violations are returned; the module uses no threads and no wires. The fast
limits use the actuator's encoder and the load cell. LVDT samples arrive tens of milliseconds late, so they are
recorded but not limited.
"""

import contextlib
import math
import threading
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from functools import reduce
from typing import NamedTuple

from bench.errors import InterlockError
from bench.safety.limits import Action, LimitMatrix, LimitViolation, Quantity, evaluate_limits, merge_limits
from drivers import SampleBlock

_CHANNEL_QUANTITIES: dict[str, Quantity] = {
    "force": "force",
    "actuator_position": "displacement",
    "actuator_velocity": "actuator_velocity",
    "coil_current": "coil_current",
    "coil_voltage": "coil_voltage",
    "temperature": "temperature",
}
"""Limited quantity of each channel; ``force_raw``, LVDT and torque are not limited."""
_REPEAT_TIME = 1.0
"""[s] Time after which a violation that persists is reported again."""
_NEVER_NS = -(2**62)
"""[ns] Instant before all others."""


class Trip(NamedTuple):
    """Trip that is latched."""

    reason: str
    by_person: bool = False
    """True after an abort by a person, False after an interlock."""


class _LimitScope(NamedTuple):
    """Change of the limits for the duration of one `Interlocks.use_limits` block."""

    specimen: LimitMatrix
    ignore: frozenset[Quantity]


class Interlocks:
    """Limits of the bench with their state; all methods may be called from any thread.

    One lock guards the limits in force, the latch of a trip, the force age and the reported violations.

    Args:
        fixture: limits that always apply, unless a block of `use_limits` ignores a quantity.
        drive: quantity that is commanded of the coil.
    """

    def __init__(self, fixture: LimitMatrix, drive: Quantity) -> None:
        self._fixture: LimitMatrix = {quantity: dict(thresholds) for quantity, thresholds in fixture.items()}
        self._drive = drive
        self._lock = threading.Lock()
        self._scopes: list[_LimitScope] = []
        self._limits: LimitMatrix = self._fixture
        self._trip: Trip | None = None
        self._force_watchers = 0
        self._force_ns: int | None = None
        self._reported_ns: dict[tuple[Quantity, Action], int] = {}

    @property
    def limits(self) -> LimitMatrix:
        """Limits in force."""
        with self._lock:
            return self._limits

    @property
    def trip_reason(self) -> str:
        """Reason of the trip that is latched; empty without a trip."""
        trip = self.trip
        return "" if trip is None else trip.reason

    @property
    def trip(self) -> Trip | None:
        """Trip that is latched."""
        with self._lock:
            return self._trip

    def latch(self, reason: str, by_person: bool = False) -> bool:
        """Refuse all commands until a reset; return False if a trip was latched before.

        Args:
            reason: for a person; the first one is kept.
            by_person: whether a person aborted, instead of an interlock.
        """
        with self._lock:
            is_first = self._trip is None
            self._trip = self._trip or Trip(reason, by_person)
            return is_first

    def reset(self) -> None:
        """Release the latch, and report the next violation without the repeat delay."""
        with self._lock:
            self._trip = None
            self._reported_ns.clear()

    @contextlib.contextmanager
    def use_limits(self, specimen: LimitMatrix | None = None, ignore: Collection[Quantity] = ()) -> Iterator[None]:
        """Change the limits for the duration of a block, and restore them however it ends.

        Blocks may be nested, and may overlap in several threads: the limits in force always follow from the
        fixture and all open blocks.

        Args:
            specimen: limits that apply in addition; the stricter threshold wins.
            ignore: quantities whose fixture limits do not apply.
        """
        scope = _LimitScope(specimen or {}, frozenset(ignore))
        with self._lock:
            self._scopes.append(scope)
            self._limits = self._combine_scopes()
        try:
            yield
        finally:
            with self._lock:
                self._scopes.remove(scope)
                self._limits = self._combine_scopes()

    @contextlib.contextmanager
    def expect_force(self, since_ns: int) -> Iterator[None]:
        """Limit the age of the newest force sample for the duration of a block.

        Args:
            since_ns: bench clock [ns] from which the age counts until the first sample.
        """
        with self._lock:
            self._force_watchers += 1
            self._force_ns = since_ns if self._force_ns is None else max(since_ns, self._force_ns)
        try:
            yield
        finally:
            with self._lock:
                self._force_watchers -= 1
                if not self._force_watchers:
                    self._force_ns = None

    def check(self, blocks: Iterable[SampleBlock], now_ns: int) -> list[LimitViolation]:
        """Return the violations of new samples and of the force age, strongest first.

        A violation that persists is returned once per repeat time (1 s).

        Args:
            blocks: samples as acquired.
            now_ns: bench clock [ns].
        """
        # Before the lock, for which the check of a setpoint may be waiting.
        measured = [(block, _find_largest(block.values.tolist())) for block in blocks if _is_limited(block)]
        with self._lock:
            violations = []
            for block, value in measured:
                self._note_force_time(block, value)
                violations += self._evaluate(_CHANNEL_QUANTITIES[block.channel], value)
            violations += self._evaluate("force_age", self._compute_force_age(now_ns))
            return self._drop_repeats(violations, now_ns)

    def check_value(self, quantity: Quantity, value: float, now_ns: int) -> list[LimitViolation]:
        """Return the violation of one value in the quantity's unit, if any, as `check` does."""
        with self._lock:
            return self._drop_repeats(self._evaluate(quantity, value), now_ns)

    def compute_force_age(self, now_ns: int) -> float:
        """Return the time since the newest valid force sample [s]; 0 while no force is expected."""
        with self._lock:
            return self._compute_force_age(now_ns)

    def permit(self, position: float | None = None, drive: float | None = None) -> None:
        """Check a command immediately before it is sent.

        Args:
            position: setpoint of the actuator [m].
            drive: setpoint of the coil [V or A].

        Raises:
            InterlockError: a trip is latched, or the value exceeds a limit that would end a run.
        """
        with self._lock:
            trip, limits = self._trip, self._limits
        if trip is not None:
            raise InterlockError(f"nothing is sent after a trip ({trip.reason}); find the cause, then reset")
        commands: list[tuple[Quantity, float | None]] = [("displacement", position), (self._drive, drive)]
        for quantity, value in commands:
            if value is not None:
                _check_command(limits, quantity, value)

    # With the lock held

    def _combine_scopes(self) -> LimitMatrix:
        ignored = {quantity for scope in self._scopes for quantity in scope.ignore}
        fixture = {quantity: limits for quantity, limits in self._fixture.items() if quantity not in ignored}
        return reduce(merge_limits, (scope.specimen for scope in self._scopes), fixture)

    def _evaluate(self, quantity: Quantity, value: float) -> list[LimitViolation]:
        violation = evaluate_limits(self._limits, quantity, value)
        return [] if violation is None else [violation]

    def _note_force_time(self, block: SampleBlock, value: float) -> None:
        # A bad sample arrives in time but carries no force, so it must not reset the force age.
        is_valid = block.channel == "force" and block.quality != "bad" and not math.isnan(value)
        if self._force_ns is not None and is_valid:
            self._force_ns = block.received_ns

    def _compute_force_age(self, now_ns: int) -> float:
        return 0.0 if self._force_ns is None else (now_ns - self._force_ns) * 1e-9

    def _drop_repeats(self, violations: list[LimitViolation], now_ns: int) -> list[LimitViolation]:
        """Remove violations that were reported within the repeat time, and sort the others by action."""
        new = []
        for violation in sorted(violations, key=lambda one: one.action, reverse=True):
            # The action is part of the key: a trip is reported although the alarm before it was.
            key = violation.quantity, violation.action
            if now_ns - self._reported_ns.get(key, _NEVER_NS) >= _REPEAT_TIME * 1e9:
                self._reported_ns[key] = now_ns
                new.append(violation)
        return new


def _check_command(limits: LimitMatrix, quantity: Quantity, value: float) -> None:
    if not math.isfinite(value):
        raise InterlockError(f"commanded {quantity.replace('_', ' ')} is {value}, not a number; nothing was sent")
    violation = evaluate_limits(limits, quantity, value)
    # Weaker actions do not end a run, so a command may exceed their thresholds.
    if violation is not None and violation.action >= Action.CONTROLLED_STOP:
        raise InterlockError(f"commanded {violation}; nothing was sent")


def _is_limited(block: SampleBlock) -> bool:
    return block.channel in _CHANNEL_QUANTITIES and len(block.values) > 0


def _find_largest(values: Iterable[float]) -> float:
    """Return the value of largest magnitude with its sign, ignoring NaN; NaN if there is no other."""
    return max((value for value in values if value == value), key=abs, default=math.nan)


def compute_following_error(
    position: Sequence[float], time_ns: Sequence[int], command: Callable[[int], float]
) -> float:
    """Return the largest following error with its sign [m].

    Args:
        position: position by the drive's encoder [m]. Lists, because arrays are slower for one or two samples.
        time_ns: bench clock of each position [ns].
        command: commanded position [m] at an instant of the bench clock [ns].
    """
    return _find_largest(actual - command(instant) for actual, instant in zip(position, time_ns, strict=True))
