"""The servo actuator: a CiA 402 drive in cyclic synchronous position.

Whoever leads the rod calls `command` every 4 ms: one setpoint, one SYNC, and, as long as the calls are on time,
now and then the heartbeat by which the drive knows that it is led. The drive interpolates between setpoints
(60C2h) and stops by itself when they are stale (event timer of its RPDO) or when the heartbeat goes (1016h,
6007h): nothing here needs to be alive for that. Positions are in metres from the centre once a specimen is
centred, from home before.
"""

import contextlib
import time
from pathlib import Path
from typing import Any

from drivers.actuator_samples import TIME_STAMP, ActuatorSamples, Scale
from drivers.beat import ACTUATOR
from drivers.can_bus import CanAddress, CanBus
from drivers.canopen_node import CanopenNode
from drivers.channel import Block, Channel, Reading, Stamp
from drivers.cia402 import Fault
from drivers.errors import BadReply, DriverError, NoReply, OutOfRange, Refused
from drivers.instrument import Clock, Health, Tap
from drivers.mounting import Mounting, found, step
from drivers.servo_drive import COUNT, ActuatorSettings, ServoDrive
from drivers.setpoints import Setpoints

_EDS = Path(__file__).parent / "wire" / "actuator.eds"
_OBJECTS = {"actuator_position": 0x6064, "actuator_velocity": 0x606C, "actuator_torque": 0x6077}
_CLOCK_EVERY_NS = 100_000_000
"""[ns] between two readings of the drive's clock."""
_USUAL = ActuatorSettings()


class Actuator:
    """The drive as an instrument of the bench.

    Args:
        name: in configuration, logs and messages.
        address: of the CAN bus.
        clock: of the bench [ns].
        node_id: of the drive.
        master_id: of the bench, for its heartbeat.
        settings: limits and times.
        clamped: whether a specimen is clamped already.
        eds: data sheet of the drive.
    """

    def __init__(
        self,
        name: str,
        address: CanAddress,
        clock: Clock,
        *,
        node_id: int = 5,
        master_id: int = 127,
        settings: ActuatorSettings = _USUAL,
        clamped: bool = False,
        eds: Path = _EDS,
    ) -> None:
        self.settings = settings
        self._name = name
        self._clock = clock
        self._master_id = master_id
        self._bus = CanBus(address, clock)
        self._node = CanopenNode(name, self._bus, node_id, eds, clock, silent_after=settings.drive_silent_after)
        self._drive = ServoDrive(name, self._node)
        self._mounting = found(clamped, referenced=False)
        self._clamped = clamped
        self._origin = 0.0
        self._channels = self._described()
        self._samples = self.decoder(0.0, 1.0)
        # Looked up for each frame: to connect makes another collector, and the bus cannot be told to forget one.
        self._bus.listen(lambda frame: self._samples.take(frame))
        self._setpoints = Setpoints(name, self._node, self._drive, clock, settings, master_id)
        self._clock_asked_ns = 0
        self._words = ""

    @property
    def name(self) -> str:
        """Name in configuration, logs and messages."""
        return self._name

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Position, velocity and torque."""
        return self._channels

    def _described(self) -> tuple[Channel, ...]:
        """The channels, as wide as travel, origin and rated torque make them."""
        low, high = (limit - self._origin for limit in self.settings.travel)
        speed, torque = 4 * self.settings.top_speed, 4 * self._drive.rated_torque
        return (
            Channel("actuator_position", "m", low, high, "read_write", "rod position by the drive's encoder"),
            Channel("actuator_velocity", "m/s", -speed, speed, "read", "rod velocity by the drive"),
            Channel("actuator_torque", "N m", -torque, torque, "read", "torque of the motor"),
        )

    @property
    def mounting(self) -> Mounting:
        """What the rod carries, and whether it knows where it is."""
        return self._mounting

    @property
    def origin(self) -> float:
        """Drive position that counts as zero [m from home]."""
        return self._origin

    @property
    def rated_torque(self) -> float:
        """[N m] as the drive said."""
        return self._drive.rated_torque

    @property
    def stamp(self) -> Stamp | None:
        """The drive's clock beside the bench's, the newest reading; none before the first."""
        return self._samples.stamp

    @property
    def faults(self) -> tuple[Fault, ...]:
        """What the drive reported and has not taken back."""
        return self._drive.faults

    # Connection

    def connect(self) -> None:
        """Open the bus, check that the drive is the right one, set its limits, leave it without voltage."""
        self._setpoints.disarm()
        self._words = ""
        self._bus.open()
        try:
            self._node.attach()
            self._drive.set_up(self.settings)
            referenced = self._drive.referenced()
        except DriverError:
            self._bus.close()
            raise
        self._setpoints.connected()
        # What was clamped before the wire broke still is, and where, as long as the drive has not forgotten home.
        if not referenced or self._mounting not in (Mounting.MOUNTED, Mounting.CENTRED):
            self._mounting, self._origin = found(self._clamped, referenced), 0.0
        self._channels = self._described()
        self._samples = self.decoder(self._origin, self._drive.rated_torque)

    def close(self) -> None:
        """Bring the rod to rest and close the bus."""
        if self._bus.is_open:
            self.make_safe()
        self._bus.close()

    def health(self) -> Health:
        """Counts of samples, and the state in words."""
        samples = self._samples
        # Nobody may be taking samples just now: what has passed is counted all the same (decision 0011).
        samples.catch_up()
        corrupted = samples.corrupted + self._bus.corrupted
        words = "; ".join(filter(None, [self._words, *map(str, self.faults)]))
        return Health(self._bus.is_open, samples.received, samples.lost, corrupted, 0, samples.last_ns, words)

    def listen(self, tap: Tap) -> None:
        """Tell ``tap`` of every frame from now on."""
        self._bus.listen(tap)

    def acquire(self, timeout: float) -> list[Block]:
        """Samples that came since the last call, waiting up to ``timeout`` [s] for the first.

        Raises:
            NotConnected: the bus has gone.
            NoReply: the drive's heartbeat has.
        """
        if self._clock() - self._clock_asked_ns >= _CLOCK_EVERY_NS:
            self._clock_asked_ns = self._clock()
            # A clock that does not answer is asked again; whether the drive is there, its heartbeat says.
            with contextlib.suppress(NoReply, BadReply, Refused):
                # Its answer is taken from the frames by the collector, as a replay takes it.
                self._node.number(TIME_STAMP)
        deadline = time.monotonic() + timeout
        while True:
            time.sleep(ACTUATOR.wait(self._clock()))
            self._bus.take_waiting()
            if blocks := self._samples.blocks():
                return blocks
            if time.monotonic() >= deadline:
                self._node.check_alive()
                return []

    def describe(self) -> dict[str, Any]:
        """What a replay needs beside the frames from now on, see `drivers.replay`."""
        layouts = self._node.layouts
        return {
            "decoder": "actuator",
            "layouts": [{**one._asdict(), "fields": [list(field) for field in one.fields]} for one in layouts],
            "node_id": self._node.node_id,
            "rated_torque": self._drive.rated_torque,
            "origin": self._origin,
            "cycle": self.settings.cycle,
            "state": self._samples.state(),
        }

    def decoder(self, origin: float, rated_torque: float) -> ActuatorSamples:
        """What turns frames into samples, for a replay, too; origin [m from home], rated torque [N m]."""
        scale = Scale(COUNT, COUNT, rated_torque / 1000)
        return ActuatorSamples(self._node.layouts, self._node.node_id, scale, origin, self.settings.cycle)

    def read(self, channel: str) -> Reading:
        """Ask the drive for one value.

        Raises:
            OutOfRange: there is no such channel.
            NoReply, BadReply, Refused, NotConnected: as the case may be.
        """
        if channel not in _OBJECTS:
            raise OutOfRange(f"{self._name}: no channel {channel}; there are {', '.join(_OBJECTS)}")
        raw = self._node.number(_OBJECTS[channel])
        value = raw * (self._drive.rated_torque / 1000 if channel == "actuator_torque" else COUNT)
        zero = self._origin if channel == "actuator_position" else 0.0
        return Reading(value - zero, self._clock(), None, raw, "good")

    def write(self, channel: str, value: float) -> None:
        """Set the position: one call of `command`."""
        if channel != "actuator_position":
            raise OutOfRange(f"{self._name}: {channel} cannot be written; nothing was sent")
        self.command(value)

    # Leading the rod

    def arm(self) -> float:
        """Switch the drive on where it stands; from now on `command` must be called in every cycle.

        Returns:
            Where the rod stands, and the first setpoint should be [m].

        Raises:
            Refused: a fault stands, the reference is lost, or the drive does not switch on.
        """
        if self._mounting in (Mounting.UNMOUNTED, Mounting.STRANDED):
            way = "home it" if self._mounting is Mounting.UNMOUNTED else "unclamp the specimen, unmount and home"
            raise Refused(f"{self._name}: the rod does not know where it is; {way} first")
        self._drive.check_no_fault()
        self._drive.lead_from_now(self._master_id, self.settings)
        # Asked for once the drive holds the rod: without voltage the load could still move it.
        here = self.read("actuator_position").value
        self._setpoints.arm(here)
        return here

    def command(self, position: float, place_ns: int | None = None) -> None:
        """One setpoint, to be called every cycle.

        Args:
            position: [m] from the centre, or from home before a specimen is centred.
            place_ns: bench clock at which it was due, if it is late; it is judged by that.

        Raises:
            OutOfRange: outside the travel or too fast from the last one; nothing was sent.
            Refused: not armed, or the drive has stopped by itself, with its reason.
            NoReply, NotConnected: the drive or the bus has gone.
        """
        self._setpoints.send(position, self._origin, self.channels[0], self._samples, place_ns)

    def sample(self) -> None:
        """Ask for one sample without moving anything: a SYNC alone."""
        self._node.send_sync()

    def rest(self) -> None:
        """End leading the rod in good order, where it stands: no voltage."""
        # Before the stop: a setpoint carries "enable", which may take a quick stop back.
        self._setpoints.disarm()
        self._drive.switch_off()

    def make_safe(self) -> None:
        """Quick stop by the drive's own ramp, watched until the rod stands or the deadline is over."""
        self._setpoints.disarm()
        try:
            self._drive.stop(self.settings.stop_within)
            self._words = ""
        except DriverError as error:
            self._words = f"quick stop not confirmed: {error}"

    def reset(self) -> None:
        """Take back the faults; the drive is left without voltage and nothing moves.

        Raises:
            NoReply: a fault stays.
        """
        self._setpoints.disarm()
        self._drive.reset()
        self._words = ""

    # Home, specimen, centre

    def home(self, within: float = 30.0, method: int = 17) -> None:
        """Seek the reference; never with a specimen clamped.

        Args:
            within: deadline [s].
            method: of 6098h; 17 seeks the negative limit switch, 37 takes the present position.

        Raises:
            Refused: a specimen is clamped, or a fault stands.
            NoReply: the reference was not found in time.
        """
        after = step(self._mounting, "home")
        self._check_not_led("home")
        self._drive.check_no_fault()
        # A drive forgets its reference as soon as it seeks it anew, and keeps none where the search ends early.
        self._mounting = Mounting.UNMOUNTED
        try:
            self._drive.home(method, within)
        except DriverError:
            self.make_safe()
            raise
        self._set_origin(0.0)
        self._mounting = after

    def mount(self) -> None:
        """Take note that a specimen has been clamped."""
        self._check_not_led("mount")
        self._mounting = step(self._mounting, "mount")
        self._clamped = True

    def centre(self) -> None:
        """Count positions from where the rod now stands: the middle of the specimen."""
        after = step(self._mounting, "centre")
        self._check_not_led("centre")
        self._set_origin(self.read("actuator_position").value + self._origin)
        self._mounting = after

    def unmount(self) -> None:
        """Take note that nothing is clamped any more; positions count from home again."""
        self._check_not_led("unmount")
        self._mounting = step(self._mounting, "unmount")
        self._clamped = False
        self._set_origin(0.0)

    def _set_origin(self, origin: float) -> None:
        self._origin = self._samples.origin = origin
        self._channels = self._described()

    def _check_not_led(self, verb: str) -> None:
        if self._setpoints.armed:
            raise Refused(f"{self._name}: cannot {verb} while the rod is led; call rest first")
