"""Safety supervisor: applies the actions that exceeded limits demand (alarm, hold, controlled stop, trip).

It is called on the threads of the wires when samples arrive. A trip starts threads of its own at once and waits
for nothing.
"""

import contextlib
import threading
from collections.abc import Callable, Iterator, Mapping
from itertools import chain
from typing import Any

from bench.recorder import EventReporter
from bench.rig import Batch, ClockMap, Rig
from bench.safety import (
    STOP_DEADLINE,
    Action,
    Interlocks,
    LimitViolation,
    Trip,
    bring_to_rest,
    compute_following_error,
)
from bench.sequencer import CommandHistory
from drivers import Clock, SampleBlock

_MAX_UNREPORTED_CYCLES = 2
"""Threshold on the delay of a setpoint [cycles]: above it, the log contains an event; a drive bridges less."""

StopFunction = Callable[[str, bool], None]
"""Controlled stop of the run: reason, and whether the rod is held."""


class SafetySupervisor:
    """Reactions to exceeded limits.

    Args:
        rig: instruments that a trip stops.
        interlocks: limits of the bench.
        clock: bench clock [ns].
        maps: clock maps of the instruments by name.
        report_event: receives alarms and trips.
        stop: controlled stop of the run.
    """

    def __init__(
        self,
        rig: Rig,
        interlocks: Interlocks,
        clock: Clock,
        maps: Mapping[str, ClockMap],
        report_event: EventReporter,
        stop: StopFunction,
    ) -> None:
        self._rig, self._interlocks, self._clock = rig, interlocks, clock
        self._maps, self._report_event, self._stop = maps, report_event, stop
        self._history: CommandHistory | None = None
        self._stop_thread: threading.Thread | None = None
        self._cycle_ns = round(rig.actuator.settings.cycle * 1e9)

    @contextlib.contextmanager
    def follow(self, history: CommandHistory) -> Iterator[None]:
        """Check the following error against a run's commands for the duration of a block."""
        self._history = history
        try:
            yield
        finally:
            self._history = None

    def on_samples(self, batch: Batch) -> None:
        """Check new samples."""
        now_ns = self._clock()
        violations = self._interlocks.check(batch.blocks, now_ns)
        history = self._history  # read once, because the run may end meanwhile
        if history is not None and batch.instrument == self._rig.actuator.name:
            following_error = self._find_following_error(batch, history)
            violations += self._interlocks.check_value("following_error", following_error, now_ns)
        self._apply_violations(violations)

    def on_timer(self) -> None:
        """Check for missing samples."""
        # A silent load cell delivers no batch, so the force age has to be checked by time as well.
        self._apply_violations(self._interlocks.check((), self._clock()))

    def on_late_setpoint(self, now_ns: int, delay: float) -> None:
        """Check the delay of a setpoint [s]; report a long one, because the rod may not have moved as demanded."""
        if delay * 1e9 > _MAX_UNREPORTED_CYCLES * self._cycle_ns:
            self._report_event(
                "late", f"a setpoint left {1e3 * delay:.1f} ms late", quantity="setpoint_lateness", value=delay
            )
        self._apply_violations(self._interlocks.check_value("setpoint_lateness", delay, now_ns))

    def apply(self, action: Action, reason: str, **details: Any) -> None:
        """Apply an action; the details of its reason are added to the log."""
        if action is Action.TRIP:
            self.trip(reason, **details)
        elif action is not Action.NONE:
            self._report_event("alarm", reason, **details)
            if action is not Action.INDICATE:
                self._stop(reason, action is Action.HOLD)

    def trip(self, reason: str, by_person: bool = False, **details: Any) -> None:
        """Stop coil and actuator at once, each in a thread of its own; latches.

        Args:
            reason: for a person.
            by_person: whether a person aborted, instead of an interlock.
            details: further fields of the event in the log.
        """
        if not self._interlocks.latch(reason, by_person):
            return
        # Before the report, which may wait for a lock.
        self._stop_thread = threading.Thread(target=self._bring_to_rest, name="trip", daemon=True)
        self._stop_thread.start()
        self._report_event("trip", reason, **details)
        self._stop(reason, False)

    def wait_until_stopped(self) -> Trip | None:
        """Wait for the end of a trip; return the trip that is latched, None without one."""
        if self._stop_thread is not None:
            self._stop_thread.join(2 * STOP_DEADLINE)
        return self._interlocks.trip

    def _apply_violations(self, violations: list[LimitViolation]) -> None:
        for one in violations:
            self.apply(one.action, str(one), quantity=one.quantity, value=one.value, limit=one.limit)

    def _bring_to_rest(self) -> None:
        result = bring_to_rest([self._rig.amplifier, self._rig.actuator])
        self._report_event(
            # An output whose rest nobody has confirmed may still move or heat.
            "alarm" if result.failures else "state",
            f"outputs after the trip: {result}",
            confirmed_after_s=result.seconds,
            not_confirmed=result.failures,
        )

    def _find_following_error(self, batch: Batch, history: CommandHistory) -> float:
        """Return the largest following error [m] of a batch; sample numbers give the distances of its samples."""
        positions = [block for block in batch.blocks if block.channel == "actuator_position"]
        values = list(chain.from_iterable(block.values.tolist() for block in positions))
        numbers = chain.from_iterable(range(block.first, block.first + len(block.values)) for block in positions)
        newest = positions[-1].first + len(positions[-1].values) - 1
        newest_ns = self._find_sample_time(batch.instrument, positions[-1])
        times = [newest_ns - (newest - number) * self._cycle_ns for number in numbers]
        return compute_following_error(values, times, history.find_position)

    def _find_sample_time(self, instrument: str, block: SampleBlock) -> int:
        """Return the bench clock [ns] at the last sample of a block; a late reading is not a position error."""
        clock = self._maps.get(instrument)
        if clock is None or not clock.is_known or block.device_ns is None:
            return block.received_ns
        return clock.map_instant(int(block.device_ns[-1]))
