"""Setpoint sender: checks of each position setpoint and of the drive's state, and the heartbeat of the bench."""

import threading

from drivers.actuator import cia402
from drivers.actuator.cia402 import DriveState
from drivers.actuator.sample_decoder import ActuatorDecoder
from drivers.actuator.servo_drive import METRES_PER_COUNT, ActuatorSettings, ServoDrive
from drivers.channel import Channel
from drivers.errors import OutOfRangeError, RefusedError
from drivers.instrument import Clock
from drivers.polling import ACTUATOR_SCHEDULE
from drivers.transport import CanopenNode

_SAMPLE_TIMEOUT_NS = 3 * ACTUATOR_SCHEDULE.period_ns
"""Age of the latest sample [ns] above which no thread seems to take samples: pending frames are decoded here."""


class SetpointSender:
    """Setpoints of one drive; several threads may use it.

    Args:
        name: name of the actuator, for messages.
        node: CANopen node of the drive.
        drive: the drive.
        clock: bench clock [ns].
        settings: limits and times.
        master_id: node id of the bench, for its heartbeat.
    """

    def __init__(
        self,
        name: str,
        node: CanopenNode,
        drive: ServoDrive,
        clock: Clock,
        settings: ActuatorSettings,
        master_id: int,
    ) -> None:
        self._name, self._node, self._drive, self._clock = name, node, drive, clock
        self._settings, self._master_id = settings, master_id
        self._lock = threading.RLock()
        self._armed_ns: int | None = None
        self._boot_count = 0
        self._last_ns = self._heartbeat_ns = self._last_due_ns = 0
        self._last_position = 0.0

    @property
    def is_armed(self) -> bool:
        """True if setpoints may be sent."""
        return self._armed_ns is not None

    def start_session(self) -> None:
        """Record that the drive has just been set up; after a restart it must be set up again."""
        self._boot_count = self._node.heartbeat.boot_count
        self.disarm()

    def arm(self, position: float) -> None:
        """Accept setpoints from the present position [m] on."""
        with self._lock:
            self._armed_ns = self._last_ns = self._last_due_ns = self._clock()
            self._heartbeat_ns, self._last_position = 0, position

    def disarm(self) -> None:
        """Accept no more setpoints. May be repeated."""
        with self._lock:
            self._armed_ns = None

    def send(
        self,
        position: float,
        origin: float,
        travel: Channel,
        decoder: ActuatorDecoder,
        due_ns: int | None = None,
    ) -> None:
        """Send one setpoint with its SYNC and, when due, the heartbeat of the bench.

        The speed limit uses the times at which setpoints were due, not those at which they were sent. A setpoint
        that follows a late one closely, or replaces several, only looks like a jump.

        Args:
            position: [m] from ``origin``.
            origin: [m from home]
            travel: channel with the range of the rod's position.
            decoder: decoder of the drive's samples, which contain its state.
            due_ns: bench clock at which the setpoint was due [ns]; by default now.

        Raises:
            OutOfRangeError: outside the travel or too fast from the last one; nothing was sent.
            RefusedError: not armed, or the drive has stopped by itself, with its reason.
            NoReplyError, NotConnectedError: the drive or the bus is gone.
        """
        with self._lock:
            now = self._clock()
            self._check_enabled(decoder)
            # A due time in the future would allow for time that has not passed.
            due_ns = now if due_ns is None else min(due_ns, now)
            self._check_setpoint(position, (due_ns - self._last_due_ns) / 1e9, travel)
            target = round((position + origin) / METRES_PER_COUNT)
            self._node.send_process_data({0x6040: cia402.ENABLE, 0x6060: cia402.CYCLIC_POSITION, 0x607A: target})
            self._send_heartbeat(now, (now - self._last_ns) / 1e9)
            self._last_ns, self._last_due_ns, self._last_position = now, due_ns, position

    def _send_heartbeat(self, now_ns: int, interval: float) -> None:
        """Send the heartbeat if due, but only with punctual setpoints: a stalled bench must not seem alive."""
        is_punctual = interval <= 2 * self._settings.cycle
        if is_punctual and now_ns - self._heartbeat_ns >= self._settings.master_heartbeat_period * 1e9:
            self._node.send_heartbeat(self._master_id)
            self._heartbeat_ns = now_ns

    def _check_enabled(self, decoder: ActuatorDecoder) -> None:
        """Check that the drive still follows setpoints."""
        if self._armed_ns is None:
            raise RefusedError(f"{self._name}: not armed; call arm first")
        self._node.heartbeat.check_alive()
        reason = self._find_stop_reason(self._armed_ns, decoder)
        if reason:
            self._armed_ns = None
            raise RefusedError(
                f"{self._name}: the drive has stopped by itself: {reason}; find the cause, then reset"
            )

    def _find_stop_reason(self, armed_ns: int, decoder: ActuatorDecoder) -> str:
        """Return the reason why the drive no longer follows setpoints; empty if it follows them."""
        if self._node.heartbeat.boot_count != self._boot_count:
            return "it has restarted (connect again)"
        if faults := self._drive.faults:
            return "; ".join(map(str, faults))
        if self._clock() - (decoder.last_ns or 0) > _SAMPLE_TIMEOUT_NS:
            decoder.decode_pending()
        # A sample from before arming shows the drive switched off.
        if decoder.last_ns is None or decoder.last_ns < armed_ns or decoder.statusword is None:
            return ""
        state = cia402.decode_drive_state(decoder.statusword)
        return "" if state is DriveState.ENABLED else state.value

    def _check_setpoint(self, position: float, interval: float, travel: Channel) -> None:
        """Check that a setpoint is within the travel and can be reached ``interval`` [s] after the last one."""
        travel.validate(position)
        # At most the setpoint timeout: then the drive has stopped by itself, and a long silence allows no jump.
        # At least one cycle: the drive takes a cycle per setpoint, however close to the last one it arrives.
        duration = max(min(interval, self._settings.setpoint_timeout), self._settings.cycle)
        speed = abs(position - self._last_position) / duration
        if speed > self._settings.max_speed:
            raise OutOfRangeError(
                f"{self._name}: {position:.6g} m is {speed:.3g} m/s from the last setpoint, "
                f"{self._settings.max_speed:g} m/s are allowed; nothing was sent"
            )
