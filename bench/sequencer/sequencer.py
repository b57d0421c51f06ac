"""Sequencer: plays one programme on actuator and coil amplifier, from the first move to rest at the end.

Leaving `Sequencer.run` in any way brings the bench to rest. Every wait has a deadline, and its error states what
was awaited, for how long, and the last value.
"""

import threading
import time
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from bench.errors import RunError
from bench.methods import Programme
from bench.sequencer.command_history import CommandHistory
from bench.sequencer.playback import PlaybackSection, find_checkpoint_samples, split_into_sections
from bench.sequencer.run_observer import RunObserver
from bench.sequencer.setpoint_thread import PAUSE_SHARE, SetpointGenerator, SetpointThread
from bench.sequencer.shunt import ShuntedCell, use_shunt
from bench.sequencer.trajectory import STOP_TIMES, plan_approach
from drivers import Clock, DriverError
from drivers.actuator import Actuator
from drivers.modbus import CoilAmplifier, TableState

_POLL_PERIOD = 0.02
"""[s] Interval of polling while waiting."""
_TIME_MARGIN = 1.0
"""[s] Time by which a motion may exceed its planned duration."""
_MAX_ATTEMPTS = 3
"""Number of attempts to arm the table if its reply exceeds the suspension of setpoints."""
_MAX_HOLD_TIME = 600.0
"""[s] Longest hold; after it, the run ends."""


class AmplifierTimeouts(NamedTuple):
    """Deadlines for the coil amplifier, in seconds."""

    table_start: float = 1.0
    """Time [s] for the armed table to start with the SYNC."""
    zero_output: float = 2.0
    """Time [s] for the coil to reach zero, including its ramp."""


OPERATION_TIMEOUTS = AmplifierTimeouts()
"""Deadlines in operation."""


class Guard(Protocol):
    """Check of every command, such as `bench.safety.Interlocks`."""

    @property
    def trip_reason(self) -> str:
        """Reason of the trip that is latched; empty without a trip."""

    def permit(self, position: float | None = None, drive: float | None = None) -> None:
        """Raise `bench.errors.InterlockError` to forbid a position [m] or a drive [V or A]."""


class Sequencer:
    """Playback of one run.

    Args:
        actuator: connected, at rest.
        amplifier: connected, at zero.
        guard: checks each command before it is sent.
        history: records the commands.
        clock: bench clock [ns].
        observer: receives the events of the run.
        get_amplifier_rate: returns the relative rate deviation of the amplifier's clock (50e-6 for 50 ppm fast).
        timeouts: deadlines for the amplifier.
        load_cell: switches its shunt for the segments that need it; None without such a load cell.
    """

    def __init__(
        self,
        actuator: Actuator,
        amplifier: CoilAmplifier,
        guard: Guard,
        history: CommandHistory,
        clock: Clock,
        observer: RunObserver,
        get_amplifier_rate: Callable[[], float],
        timeouts: AmplifierTimeouts = OPERATION_TIMEOUTS,
        load_cell: ShuntedCell | None = None,
    ) -> None:
        settings = actuator.settings
        self._actuator, self._amplifier, self._guard, self._history = actuator, amplifier, guard, history
        self._clock, self._observer, self._get_amplifier_rate = clock, observer, get_amplifier_rate
        self._timeouts, self._load_cell = timeouts, load_cell
        self._generator = SetpointGenerator(
            actuator, self._permit, history, settings.cycle, settings.setpoint_timeout
        )
        self._thread = SetpointThread(self._generator, clock, observer.on_late_setpoint, self._on_setpoints_failed)
        self._stop_requested = threading.Event()
        self._hold_released = threading.Event()
        self._acceleration = 0.0
        self._stop_reason = ""
        self._pause_requested = threading.Event()
        self._paused_after = ""

    @property
    def stop_reason(self) -> str:
        """Reason why the run ended early; empty if it did not."""
        return self._stop_reason

    @property
    def paused_after(self) -> str:
        """Name of the checkpoint at which the run was paused; empty if it was not."""
        return self._paused_after

    @property
    def late_cycles(self) -> int:
        """Number of cycles without a setpoint in time."""
        return self._thread.late_cycles

    def stop(self, reason: str, hold: bool = False) -> None:
        """Stop the motion softly and set the coil to zero; from any thread, harmless if repeated.

        Args:
            reason: for a person; the first one is kept.
            hold: keep the rod at its position until `stop` is called without it.
        """
        self._stop_reason = self._stop_reason or reason
        # Before the stop is requested, or the run would take this stop for a hold.
        if not hold:
            self._hold_released.set()
        self._history.switch_off(self._clock())
        self._generator.stop(self._clock(), self._acceleration)
        self._stop_requested.set()

    def pause(self) -> None:
        """End the run at the next checkpoint; from any thread, without effect if none follows."""
        self._pause_requested.set()

    def run(self, programme: Programme) -> None:
        """Play a programme; return when everything is at rest, early after a `stop` or a `pause`.

        Args:
            programme: compiled method.

        Raises:
            RunError: the drive cannot be played exactly, a wait timed out, or a command was forbidden.
            DriverError: an instrument refuses or does not reply.
        """
        sections = split_into_sections(programme, self._amplifier.table_capacity)
        self._check_programme(programme)
        self._acceleration = programme.method.limits.acceleration_mps2
        if self._stop_requested.is_set():  # nothing was switched on yet
            return
        try:
            position = self._actuator.arm()
            # The first setpoints are the present position, so that the rod does not jump when they begin.
            self._generator.hold_at(position)
            # From now on no idle request may send a SYNC, which would start an armed table.
            self._observer.on_setpoints_active(True)
            with self._thread:
                try:
                    self._play(programme, sections, position)
                finally:
                    # Within the thread's context, because setpoints have to continue until nothing moves.
                    self._stop_motion(programme)
        finally:
            self._observer.on_setpoints_active(False)
            self._switch_off()
        self._raise_failure()

    def _play(self, programme: Programme, sections: tuple[PlaybackSection, ...], position: float) -> None:
        start = float(programme.displacement[sections[0].start])
        approach = plan_approach(position, start)
        self._observer.on_state(
            f"moving to {start * 1e3:.3f} mm, from {position * 1e3:.3f} mm, within {approach.duration:.1f} s"
        )
        self._generator.start(approach)
        self._await_rest(approach.duration, "the rod to reach its first position")
        self._observer.on_arrived()
        checkpoints = find_checkpoint_samples(sections[0].programme)
        for section in sections:
            if self._stop_requested.is_set():
                return
            if self._pause_requested.is_set() and section.start in checkpoints:
                self._paused_after = checkpoints[section.start]
                return
            self._upload_drive(section)
            # A stop may have been requested during the upload, which takes several exchanges.
            if not self._stop_requested.is_set():
                with use_shunt(self._load_cell, section):
                    self._start_section(section)
                    self._await_rest(section.duration, "the end of the section")

    def _check_programme(self, programme: Programme) -> None:
        """Check before anything moves that every command of the programme is permitted."""
        for position in (programme.displacement.min(), programme.displacement.max()):
            self._actuator.channels[0].validate(float(position))
            self._guard.permit(position=float(position))
        for drive in (programme.drive.min(), programme.drive.max()):
            self._guard.permit(drive=float(drive))
        peak_velocity = float(np.abs(programme.velocity).max())
        if peak_velocity > self._actuator.settings.max_speed:
            raise RunError(
                f"method {programme.method.name} moves at {peak_velocity:.3g} m/s, but the actuator's limit is "
                f"{self._actuator.settings.max_speed:g} m/s; lower amplitude or frequency"
            )

    # Coil

    def _upload_drive(self, section: PlaybackSection) -> None:
        times, levels = section.list_drive_steps()
        # The amplifier plays the table by itself, so all levels are checked before the upload.
        self._guard.permit(drive=float(np.abs(levels).max()))
        # The table runs by the amplifier's clock, the motion by the bench clock.
        self._amplifier.upload_table(times * (1 + self._get_amplifier_rate()), levels)

    def _arm_table(self, position: float) -> None:
        """Arm the drive table during a suspension; after an error, setpoints hold the rod at a position [m]."""
        try:
            self._guard.permit()
            self._amplifier.arm_table()
        except Exception:
            # Setpoints have to continue for a soft stop; during a suspension the drive would stop by itself.
            self._generator.hold_at(position)
            raise

    def _start_section(self, section: PlaybackSection) -> None:
        """Start motion and table with the same SYNC."""
        for _ in range(_MAX_ATTEMPTS):
            # The next SYNC starts the armed table, so it has to be the SYNC of the section's first setpoint.
            self._generator.suspend(self._clock())
            self._arm_table(float(section.programme.displacement[section.start]))
            has_started = self._generator.start(section.trajectory, section)
            if self._stop_requested.is_set():
                return
            if has_started:
                self._check_table_started()
                return
            # The suspension has expired: the table would start with a SYNC other than that of the section.
            self._amplifier.abort_table()
        longest = self._actuator.settings.setpoint_timeout * PAUSE_SHARE * 1e3
        raise RunError(
            f"{self._amplifier.name}: its table was armed {_MAX_ATTEMPTS} times, but each reply took longer than "
            f"{longest:.0f} ms; check its wire, or raise setpoint_timeout"
        )

    def _check_table_started(self) -> None:
        """Wait for the start of the table; without it, the coil would stay undriven and no error would appear."""
        deadline = time.monotonic() + self._timeouts.table_start
        while (state := self._amplifier.read_table_progress().state) not in (TableState.RUNNING, TableState.DONE):
            if self._stop_requested.wait(_POLL_PERIOD):
                return
            if time.monotonic() > deadline:
                raise RunError(
                    f"{self._amplifier.name}: waited {self._timeouts.table_start:g} s for its table to start with "
                    f"the SYNC; it is {state.name.lower()}; check the line from the bus to its SYNC input"
                )

    # Waiting and ending

    def _permit(self, position: float) -> None:
        self._guard.permit(position=position)

    def _on_setpoints_failed(self, error: Exception) -> None:
        self._stop_reason = self._stop_reason or str(error)
        self._history.switch_off(self._clock())
        self._stop_requested.set()
        self._observer.on_setpoints_failed(str(error))

    def _await_rest(self, duration: float, event: str) -> None:
        """Wait until the motion has ended or a stop is requested."""
        deadline = time.monotonic() + duration + _TIME_MARGIN
        while not self._generator.is_done(self._clock()):
            if self._stop_requested.wait(_POLL_PERIOD):
                return
            if time.monotonic() > deadline:
                raise RunError(f"waited {duration + _TIME_MARGIN:.1f} s for {event}; {self._describe_setpoint()}")

    def _describe_setpoint(self) -> str:
        schedule = self._generator.schedule
        if schedule is None:
            return "no setpoint was sent"
        return f"the setpoint is {schedule.find_position(self._clock()) * 1e3:.3f} mm"

    def _stop_motion(self, programme: Programme) -> None:
        """Set the coil to zero and stop the motion softly; after a trip the supervisor stops both."""
        self._history.switch_off(self._clock())
        if self._guard.trip_reason or self._thread.failure is not None:
            return
        self._generator.stop(self._clock(), programme.method.limits.acceleration_mps2)
        # Before the motion has ended, because without its field the damper resists least.
        self._amplifier.ramp_down()
        timeout = STOP_TIMES[-1] + _TIME_MARGIN
        deadline = time.monotonic() + timeout
        while not self._generator.is_done(self._clock()) and self._thread.failure is None:
            if time.monotonic() > deadline:
                raise RunError(f"waited {timeout:.1f} s for the motion to stop; {self._describe_setpoint()}")
            time.sleep(_POLL_PERIOD)
        if self._stop_requested.is_set() and not self._hold_released.is_set() and self._thread.failure is None:
            self._observer.on_state("the rod is held at its position; stop ends the hold")
            self._hold_position()

    def _hold_position(self) -> None:
        deadline = time.monotonic() + _MAX_HOLD_TIME
        while not self._hold_released.wait(_POLL_PERIOD) and time.monotonic() < deadline:
            if self._guard.trip_reason or self._thread.failure is not None:
                return

    def _switch_off(self) -> None:
        """Remove the voltage from coil and drive; use the drive's quick stop if the rod may still move."""
        if self._guard.trip_reason:  # the supervisor stops both
            return None
        # Without waiting for zero, so that the coil ramps down while the drive is switched off.
        self._amplifier.ramp_down()
        if self._thread.failure is not None:
            self._actuator.make_safe()
            return None
        try:
            self._actuator.disable()
        except DriverError:
            self._actuator.make_safe()
            raise
        return self._check_zero_output()

    def _check_zero_output(self) -> None:
        deadline = time.monotonic() + self._timeouts.zero_output
        while (output := self._amplifier.read_status().output) != 0.0:
            if time.monotonic() > deadline:
                raise RunError(
                    f"{self._amplifier.name}: waited {self._timeouts.zero_output:g} s for its output to reach "
                    f"zero; it is {output:.4g}; if its watchdog does not switch it off, use the main switch"
                )
            time.sleep(_POLL_PERIOD)

    def _raise_failure(self) -> None:
        failure = self._thread.failure
        # After a trip every setpoint is forbidden, so this failure is only its consequence.
        if failure is not None and not self._guard.trip_reason:
            raise failure
