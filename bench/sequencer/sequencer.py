"""Plays one programme on actuator and coil amplifier, from the first move to the rest at the end.

Whatever happens, the rest at the end is not part of the plan: it is what leaving `Sequencer.run` means. Every wait
has a deadline, and its error says what was awaited, for how long, and what the last value was.
"""

import threading
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np

from bench.errors import RunError
from bench.methods import Programme
from bench.sequencer.lead import PAUSE, Lead, LeadThread
from bench.sequencer.passages import Passage, passages
from bench.sequencer.plan import RunPlan
from bench.sequencer.track import FADES, approach
from drivers.actuator import Actuator
from drivers.coil_amplifier import CoilAmplifier
from drivers.coil_table import TableState
from drivers.errors import DriverError

_LOOK = 0.02
"""[s] between two looks while waiting."""
_SPARE = 1.0
"""[s] beyond what a motion is to take."""
_TABLE_WITHIN = 1.0
"""[s] for the armed table to start with the SYNC."""
_ZERO_WITHIN = 2.0
"""[s] for the coil to come to zero, its ramp included."""
_ATTEMPTS = 3
"""Times that the table is armed anew where its answer came too late to hold the SYNC back for it."""
_LONGEST_HOLD = 600.0
"""[s] after which a rod that is held is let go all the same."""

Clock = Callable[[], int]
Tell = Callable[[str, str], None]
"""Told of what happens: kind of event, words."""


class Guard(Protocol):
    """Has the last word before any write; `bench.safety.interlocks.Interlocks` is one."""

    @property
    def tripped(self) -> str:
        """Why everything was brought to rest; empty where it was not."""

    def permit(self, position: float | None = None, drive: float | None = None) -> None:
        """Raise `bench.errors.Interlocked` to forbid a position [m] or a drive [V or A]."""


class Sequencer:
    """One run.

    Args:
        actuator: connected, at rest.
        amplifier: connected, at zero.
        guard: has the last word before any write.
        plan: told what is commanded from when on.
        clock: of the bench [ns].
        tell: told of what happens.
        late: told of setpoints that leave late: bench clock [ns], by how much [s].
        failed: told at once why the rod is led no more.
        leading: told whether setpoints, and the SYNCs that go with them, are sent.
        arrived: told when the rod stands where the programme begins.
        clock_rate: how fast the amplifier's clock runs, as a share above the bench's.
    """

    def __init__(
        self,
        actuator: Actuator,
        amplifier: CoilAmplifier,
        guard: Guard,
        plan: RunPlan,
        clock: Clock,
        tell: Tell,
        late: Callable[[int, float], None] = lambda now_ns, late: None,
        failed: Callable[[str], None] = lambda why: None,
        leading: Callable[[bool], None] = lambda led: None,
        arrived: Callable[[], None] = lambda: None,
        clock_rate: Callable[[], float] = lambda: 0.0,
    ) -> None:
        settings = actuator.settings
        self._actuator, self._amplifier, self._guard, self._plan = actuator, amplifier, guard, plan
        self._clock, self._clock_rate = clock, clock_rate
        self._tell, self._told_failed = tell, failed
        self._told_leading, self._told_arrived = leading, arrived
        self._lead = Lead(actuator, self._permit, plan, settings.cycle, settings.stale_after)
        self._thread = LeadThread(self._lead, clock, late, self._failed)
        self._ending = threading.Event()
        self._released = threading.Event()
        self._acceleration = 0.0
        self.stopped = ""
        """Why it ended before its end; empty where it did not."""

    @property
    def late_cycles(self) -> int:
        """Cycles in which no setpoint left in time."""
        return self._thread.late_cycles

    def stop(self, why: str, hold: bool = False) -> None:
        """End in good order: the motion fades out, the coil goes to zero; from any thread, harmless when repeated.

        Args:
            why: in words; the first one is kept.
            hold: keep the rod led where it stands until `stop` is called without it.
        """
        self.stopped = self.stopped or why
        # Before `_ending` is set, or the run would take this stop for a hold.
        if not hold:
            self._released.set()
        self._plan.switch_off(self._clock())
        self._lead.stop(self._clock(), self._acceleration)
        self._ending.set()

    def run(self, programme: Programme, first: int = 0) -> None:
        """Play a programme; returns when everything is at rest, early after a `stop`.

        Args:
            programme: compiled.
            first: sample to begin with, at rest.

        Raises:
            RunError: the drive cannot be played exactly, a wait was in vain, or the run was tripped.
            DriverError: an instrument refuses or has gone.
        """
        parts = passages(programme, self._amplifier.table_capacity, first)
        self._check(programme)
        self._acceleration = programme.method.limits.acceleration_mps2
        if self._ending.is_set():  # stopped before anything was switched on: nothing has to come to rest
            return
        try:
            here = self._actuator.arm()
            self._lead.stand(here)
            self._told_leading(True)
            with self._thread:
                try:
                    self._play(programme, parts, here)
                finally:
                    # Within the thread's context: setpoints have to go on until nothing moves.
                    self._come_to_rest(programme)
        finally:
            self._told_leading(False)
            self._switch_off()
        self._raise_failure()

    def _play(self, programme: Programme, parts: tuple[Passage, ...], here: float) -> None:
        start = float(programme.displacement[parts[0].start])
        way = approach(here, start)
        self._tell(
            "state", f"going to {start * 1e3:.3f} mm, from {here * 1e3:.3f} mm, within {way.duration:.1f} s"
        )
        self._lead.play(way)
        self._await_rest(way.duration, "the rod to reach its first position")
        self._told_arrived()
        for part in parts:
            if self._ending.is_set():
                return
            self._bring_up(part)
            if not self._ending.is_set():
                self._begin(part)
                self._await_rest(part.track.duration, "the end of the passage")

    def _check(self, programme: Programme) -> None:
        """See before anything moves that nothing will be forbidden on the way."""
        for position in (programme.displacement.min(), programme.displacement.max()):
            self._actuator.channels[0].checked(float(position))
            self._guard.permit(position=float(position))
        for drive in (programme.drive.min(), programme.drive.max()):
            self._guard.permit(drive=float(drive))
        fastest = float(np.abs(programme.velocity).max())
        if fastest > self._actuator.settings.top_speed:
            raise RunError(
                f"method {programme.method.name} moves at {fastest:.3g} m/s, the actuator is allowed "
                f"{self._actuator.settings.top_speed:g} m/s; lower amplitude or frequency"
            )

    # The coil

    def _bring_up(self, part: Passage) -> None:
        times, levels = part.steps()
        self._guard.permit(drive=float(np.abs(levels).max()))
        # The table runs by the amplifier's clock, the motion by the bench's.
        self._amplifier.upload(times * (1 + self._clock_rate()), levels)

    def _begin(self, part: Passage) -> None:
        """Start motion and table with one and the same SYNC."""
        for _ in range(_ATTEMPTS):
            # No SYNC from here on: the next one starts the armed table, and has to be that of the first setpoint.
            self._lead.hush(self._clock())
            try:
                self._guard.permit()
                self._amplifier.arm()
            except Exception:
                # The run is to end in good order; in a silence that lasts the drive would stop by itself.
                self._lead.stand(float(part.programme.displacement[part.start]))
                raise
            started = self._lead.play(part.track, part)
            if self._ending.is_set():
                return
            if started:
                self._see_table_run()
                return
            self._amplifier.abort_table()
        raise RunError(
            f"{self._amplifier.name}: its table was armed {_ATTEMPTS} times, each answer came later than "
            f"{self._actuator.settings.stale_after * PAUSE * 1e3:.0f} ms; see its wire, or raise stale_after"
        )

    def _see_table_run(self) -> None:
        """A table that no SYNC starts would leave the coil without its drive, and nobody the wiser."""
        deadline = time.monotonic() + _TABLE_WITHIN
        while (state := self._amplifier.table().state) not in (TableState.RUNNING, TableState.DONE):
            if self._ending.wait(_LOOK):
                return
            if time.monotonic() > deadline:
                raise RunError(
                    f"{self._amplifier.name}: waited {_TABLE_WITHIN:g} s for its table to start with the SYNC; it "
                    f"is {state.name.lower()}; see the line from the bus to its SYNC input"
                )

    # Waiting and ending

    def _permit(self, position: float) -> None:
        self._guard.permit(position=position)

    def _failed(self, error: Exception) -> None:
        self.stopped = self.stopped or str(error)
        self._plan.switch_off(self._clock())
        self._ending.set()
        self._told_failed(str(error))

    def _await_rest(self, duration: float, what: str) -> None:
        """Until nothing moves any more, or the run is to end."""
        deadline = time.monotonic() + duration + _SPARE
        while not self._lead.done(self._clock()):
            if self._ending.wait(_LOOK):
                return
            if time.monotonic() > deadline:
                raise RunError(f"waited {duration + _SPARE:.1f} s for {what}; {self._where()}")

    def _where(self) -> str:
        playing = self._lead.playing
        return "nothing was sent" if playing is None else f"sent to {playing.position(self._clock()) * 1e3:.3f} mm"

    def _come_to_rest(self, programme: Programme) -> None:
        """Coil to zero and motion faded out, whyever the run ends; after a trip others see to that."""
        self._plan.switch_off(self._clock())
        if self._guard.tripped or self._thread.failure is not None:
            return
        self._lead.stop(self._clock(), programme.method.limits.acceleration_mps2)
        # While the motion fades: without its field the damper resists the least.
        self._amplifier.make_safe()
        deadline = time.monotonic() + FADES[-1] + _SPARE
        while not self._lead.done(self._clock()) and self._thread.failure is None:
            if time.monotonic() > deadline:
                raise RunError(f"waited {FADES[-1] + _SPARE:.1f} s for the motion to fade out; {self._where()}")
            time.sleep(_LOOK)
        if self._ending.is_set() and not self._released.is_set() and self._thread.failure is None:
            self._tell("state", "the rod is held where it stands; stop ends it")
            self._hold()

    def _hold(self) -> None:
        deadline = time.monotonic() + _LONGEST_HOLD
        while not self._released.wait(_LOOK) and time.monotonic() < deadline:
            if self._guard.tripped or self._thread.failure is not None:
                return

    def _switch_off(self) -> None:
        """No voltage at coil and drive; where the rod may still move, the drive's own quick stop."""
        if self._guard.tripped:  # its own threads see to that
            return None
        self._amplifier.make_safe()
        if self._thread.failure is not None:
            return self._actuator.make_safe()
        try:
            self._actuator.rest()
        except DriverError:
            self._actuator.make_safe()
            raise
        return self._see_zero()

    def _see_zero(self) -> None:
        deadline = time.monotonic() + _ZERO_WITHIN
        while (output := self._amplifier.condition().output) != 0.0:
            if time.monotonic() > deadline:
                raise RunError(
                    f"{self._amplifier.name}: waited {_ZERO_WITHIN:g} s for its output to come to zero; it is "
                    f"{output:.4g}; its watchdog or the main switch has to"
                )
            time.sleep(_LOOK)

    def _raise_failure(self) -> None:
        failure = self._thread.failure
        if failure is not None and not self._guard.tripped:
            raise failure
