"""Who leads the rod: one setpoint every cycle, whatever else goes on.

`Lead` decides what is sent at an instant that it is given; `LeadThread` calls it at absolute deadlines, in a
thread that does nothing else. The drive goes to a setpoint within a cycle, so each one is where the rod is to be a
cycle later. A setpoint that leaves late is that of its late instant: the rod stays on its way, in time.
"""

import threading
import time
from collections.abc import Callable
from typing import Final, Protocol

from bench.errors import RunError
from bench.rig.priority import HASTE, raise_priority
from bench.sequencer.passages import Passage
from bench.sequencer.plan import Entry, RunPlan
from bench.sequencer.track import Playing, Track, standing
from drivers.errors import DriverError

PAUSE = 0.6
"""Share of the time after which the drive stops by itself that setpoints may be withheld."""
_LEFT_OUT = 4
"""Cycles by which the thread may be late and still make up for the setpoints that it owes."""
_JOIN = 2.0
"""[s] for the thread to end."""


class Led(Protocol):
    """The actuator, as it is led."""

    def command(self, position: float, place_ns: int) -> None:
        """One setpoint [m] that was due at this instant, and the SYNC that goes with it."""


class Lead:
    """What is sent at each instant.

    Args:
        actuator: armed.
        permit: has the last word on a position [m]; raises to forbid it.
        plan: told what is played from when on.
        cycle: [s] between setpoints.
        stale_after: [s] without a setpoint until the drive stops by itself.
    """

    def __init__(
        self, actuator: Led, permit: Callable[[float], None], plan: RunPlan, cycle: float, stale_after: float
    ) -> None:
        self.cycle_ns: Final = round(cycle * 1e9)
        self._actuator, self._permit, self._plan = actuator, permit, plan
        self._patience_ns = round(PAUSE * stale_after * 1e9)
        self._lock = threading.Lock()
        self._entry: Entry | None = None
        self._next: tuple[Track, Passage | None] | None = None
        self._silent_ns: int | None = None
        self._broken = False
        self._stopped = False

    @property
    def playing(self) -> Playing | None:
        """What is played."""
        return None if self._entry is None else self._entry.playing

    def stand(self, position: float) -> None:
        """Hold the rod at a position [m] from the next setpoint on."""
        self.play(standing(position))

    def play(self, track: Track, passage: Passage | None = None) -> bool:
        """Begin a track with the next setpoint; false where the silence before did not last, or after a stop."""
        with self._lock:
            whole = not self._broken and not self._stopped
            if whole:
                self._next = track, passage
            self._silent_ns, self._broken = None, False
            return whole

    def hush(self, now_ns: int) -> None:
        """Withhold setpoints and SYNCs until `play`; the drive holds the rod, which must stand."""
        with self._lock:
            self._silent_ns, self._broken = now_ns, False

    def stop(self, now_ns: int, acceleration: float) -> None:
        """Let the motion fade out; nothing is begun any more."""
        with self._lock:
            self._stopped, self._next, self._silent_ns = True, None, None
            if self._entry is not None:
                # Where the rod is in a cycle has been sent already.
                playing = self._entry.playing.stopped(now_ns + self.cycle_ns, acceleration)
                self._enter(Entry(playing, self._entry.passage))

    def done(self, now_ns: int) -> bool:
        """Whether nothing moves any more and nothing waits to begin."""
        with self._lock:
            waits = self._next is not None
            return not waits and (self._entry is None or now_ns >= self._entry.playing.end_ns + self.cycle_ns)

    def step(self, now_ns: int) -> bool:
        """Send the setpoint of an instant [ns]; false where none is due in a silence.

        Raises:
            Interlocked: it is forbidden.
            DriverError: the drive refuses it, or has gone.
        """
        with self._lock:
            if self._is_silent(now_ns):
                return False
            if self._next is not None:
                track, passage = self._next
                self._next = None
                self._enter(Entry(Playing(track, now_ns), passage))
            if self._entry is None:
                return False
            # The drive is there a cycle later.
            position = self._entry.playing.position(now_ns + self.cycle_ns)
            self._permit(position)
            self._actuator.command(position, now_ns)
            return True

    def _is_silent(self, now_ns: int) -> bool:
        """A silence that lasts too long is broken, or the drive would stop by itself."""
        if self._silent_ns is not None and now_ns - self._silent_ns > self._patience_ns:
            self._silent_ns, self._broken = None, True
        return self._silent_ns is not None

    def _enter(self, entry: Entry) -> None:
        self._entry = entry
        self._plan.enter(entry)


class LeadThread:
    """Calls `Lead.step` every cycle; a context manager.

    Args:
        lead: what is sent.
        clock: of the bench [ns].
        late: told of each setpoint that left late: bench clock [ns], by how much [s].
        failed: told why the rod is led no more, once.
    """

    def __init__(
        self,
        lead: Lead,
        clock: Callable[[], int],
        late: Callable[[int, float], None],
        failed: Callable[[Exception], None],
    ) -> None:
        self.late_cycles = 0
        """Cycles in which no setpoint left in time."""
        self.failure: Exception | None = None
        self.warning = ""
        """Why setpoints leave without real-time priority; empty where they have it."""
        self._lead, self._clock, self._told_late, self._told_failed = lead, clock, late, failed
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="setpoints", daemon=True)

    def __enter__(self) -> "LeadThread":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join(_JOIN)

    def _run(self) -> None:
        self.warning = raise_priority(HASTE)
        cycle = self._lead.cycle_ns
        # At whole cycles of the bench clock: those who take the drive's answers are woken by the same clock.
        due = self._clock() // cycle * cycle
        try:
            while not self._stopping.is_set():
                # From the grid, not from now: a late turn must not make all later ones late.
                due += cycle
                time.sleep(max(due - self._clock(), 0) * 1e-9)
                now = self._clock()
                self._note(now, (now - due) * 1e-9)
                # All that is owed for longer would leave in one burst: the row goes on from here.
                if now - due > _LEFT_OUT * cycle:
                    due += (now - due) // cycle * cycle
                # Every place on the grid of cycles gets its setpoint, for a drive that is locked to SYNC counts
                # them, and reaches each at its place however late this thread was.
                self._lead.step(due)
        except Exception as error:  # a thread that died in silence would leave the rod without anybody who knows
            expected = isinstance(error, DriverError | RunError)
            self.failure = error if expected else RunError(f"setpoints ended: {error!r}; this is a defect")
            self._told_failed(self.failure)

    def _note(self, now_ns: int, late: float) -> None:
        missed = int(late * 1e9) // self._lead.cycle_ns
        if missed:
            self.late_cycles += missed
            self._told_late(now_ns, late)
