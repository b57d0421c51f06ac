"""Leads the rod cycle by cycle: what may be sent, and whether the drive still does what it is told."""

import threading

from drivers import cia402
from drivers.actuator_samples import ActuatorSamples
from drivers.beat import ACTUATOR
from drivers.canopen_node import CanopenNode
from drivers.channel import Channel
from drivers.cia402 import DriveState
from drivers.errors import OutOfRange, Refused
from drivers.instrument import Clock
from drivers.servo_drive import COUNT, ActuatorSettings, ServoDrive

_STALE_NS = 3 * ACTUATOR.every_ns
"""[ns] without a sample after which nobody seems to ask for them."""


class Setpoints:
    """Setpoints of one drive; may be used from several threads.

    Args:
        name: of the actuator, for messages.
        node: the drive on its bus.
        drive: what it is.
        clock: of the bench [ns].
        settings: limits and times.
        master_id: of the bench, for its heartbeat.
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
        self._sending = threading.RLock()
        self._armed_ns: int | None = None
        self._boots = 0
        self._last_ns = self._beat_ns = self._place_ns = 0
        self._last = 0.0

    @property
    def armed(self) -> bool:
        """Whether the rod is led."""
        return self._armed_ns is not None

    def connected(self) -> None:
        """Take note that the drive has just been set up: if it starts anew, it must be set up again."""
        self._boots = self._node.boots
        self.disarm()

    def arm(self, here: float) -> None:
        """Lead the rod from where it stands [m] on."""
        with self._sending:
            self._armed_ns = self._last_ns = self._place_ns = self._clock()
            self._beat_ns, self._last = 0, here

    def disarm(self) -> None:
        """Lead it no more; harmless when repeated."""
        with self._sending:
            self._armed_ns = None

    def send(
        self,
        position: float,
        origin: float,
        travel: Channel,
        samples: ActuatorSamples,
        place_ns: int | None = None,
    ) -> None:
        """Send one setpoint, with its SYNC and now and then the heartbeat of the bench.

        However late it leaves, it is judged by its place in the row: what makes up for setpoints that were held up
        follows closer upon them, or stands for several, and only looks like a leap.

        Args:
            position: [m] from ``origin``.
            origin: [m from home]
            travel: what the rod's position may be.
            samples: of the drive; they say what state it is in.
            place_ns: bench clock at which it was due; now, where nobody says.

        Raises:
            OutOfRange: outside the travel or too fast from the last one; nothing was sent.
            Refused: not armed, or the drive has stopped by itself, with its reason.
            NoReply, NotConnected: the drive or the bus has gone.
        """
        with self._sending:
            now = self._clock()
            self._check_led(samples)
            # A place still to come would allow for time that has not passed.
            place = now if place_ns is None else min(place_ns, now)
            # By its place: judged by when it leaves, one that makes up for a late one is refused as a leap.
            self._check(position, (place - self._place_ns) / 1e9, travel)
            target = round((position + origin) / COUNT)
            self._node.lead({0x6040: cia402.ENABLE, 0x6060: cia402.CYCLIC_POSITION, 0x607A: target})
            self._beat(now, (now - self._last_ns) / 1e9)
            self._last_ns, self._place_ns, self._last = now, place, position

    def _beat(self, now: int, since: float) -> None:
        """The bench's heartbeat goes with setpoints that come in time: who leads no more must not seem alive."""
        in_time = since <= 2 * self._settings.cycle
        if in_time and now - self._beat_ns >= self._settings.master_beat * 1e9:
            self._node.send_heartbeat(self._master_id)
            self._beat_ns = now

    def _check_led(self, samples: ActuatorSamples) -> None:
        """See that the drive still does what it is told."""
        if self._armed_ns is None:
            raise Refused(f"{self._name}: not armed; call arm first")
        self._node.check_alive()
        why = self._stopped(self._armed_ns, samples)
        if why:
            self._armed_ns = None
            raise Refused(f"{self._name}: the drive has stopped by itself: {why}; find the cause, then reset")

    def _stopped(self, armed_ns: int, samples: ActuatorSamples) -> str:
        """Why the drive no longer follows, empty if it does."""
        if self._node.boots != self._boots:
            return "it has restarted (connect again)"
        if faults := self._drive.faults:
            return "; ".join(map(str, faults))
        if self._clock() - (samples.last_ns or 0) > _STALE_NS:
            samples.catch_up()
        # A sample from before it was armed shows the drive as it was, switched off.
        if samples.last_ns is None or samples.last_ns < armed_ns or samples.statusword is None:
            return ""
        state = cia402.drive_state(samples.statusword)
        return "" if state is DriveState.ENABLED else state.value

    def _check(self, position: float, since: float, travel: Channel) -> None:
        """See that a setpoint lies within the travel and can be reached ``since`` [s] behind the last one."""
        travel.checked(position)
        # A long silence excuses no leap: beyond `stale_after` the drive has stopped by itself. And it takes a
        # cycle over each setpoint, however close upon the last one it came.
        time = max(min(since, self._settings.stale_after), self._settings.cycle)
        speed = abs(position - self._last) / time
        if speed > self._settings.top_speed:
            raise OutOfRange(
                f"{self._name}: {position:.6g} m is {speed:.3g} m/s from the last setpoint, "
                f"{self._settings.top_speed:g} m/s are allowed; nothing was sent"
            )
