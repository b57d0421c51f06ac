"""Servo actuator: a CiA 402 drive in cyclic synchronous position mode.

`Actuator.send_setpoint` is called once per cycle (4 ms). It sends one setpoint and one SYNC and, with punctual
setpoints, the bench's heartbeat now and then. The drive interpolates between setpoints (60C2h). It stops by itself
when setpoints are stale (event timer of its RPDO) or the heartbeat is lost (1016h, 6007h), without any action of
the bench. Positions are in metres from the specimen's centre once a specimen is centred, and from home before.
"""

from pathlib import Path
from typing import Any

from drivers.actuator.channels import OBJECTS, make_channels
from drivers.actuator.cia402 import Fault
from drivers.actuator.reference_state import (
    ReferenceState,
    apply_transition,
    check_referenced,
    find_initial_state,
)
from drivers.actuator.sample_reader import SampleReader
from drivers.actuator.servo_drive import METRES_PER_COUNT, ActuatorSettings, ServoDrive
from drivers.actuator.setpoints import SetpointSender
from drivers.channel import Channel, ClockReading, Reading, SampleBlock
from drivers.errors import DriverError, OutOfRangeError, RefusedError
from drivers.instrument import Clock, FrameListener, Health
from drivers.transport import CanAddress, CanBus, CanopenNode
from drivers.wire_files import ACTUATOR_EDS

_DEFAULT_SETTINGS = ActuatorSettings()


class Actuator:
    """The drive as an instrument of the bench.

    Args:
        name: used in configuration, logs and messages.
        address: CAN bus.
        clock: bench clock [ns].
        node_id: node id of the drive.
        master_id: node id of the bench, for its heartbeat.
        settings: limits and times.
        clamped: whether a specimen is clamped already.
        eds: electronic data sheet of the drive.
    """

    def __init__(
        self,
        name: str,
        address: CanAddress,
        clock: Clock,
        *,
        node_id: int = 5,
        master_id: int = 127,
        settings: ActuatorSettings = _DEFAULT_SETTINGS,
        clamped: bool = False,
        eds: Path = ACTUATOR_EDS,
    ) -> None:
        self.settings = settings
        self._name, self._clock, self._master_id = name, clock, master_id
        self._bus = CanBus(address, clock)
        self._node = CanopenNode(
            name, self._bus, node_id, eds, clock, heartbeat_timeout=settings.drive_heartbeat_timeout
        )
        self._drive = ServoDrive(name, self._node)
        self._reference_state = find_initial_state(clamped, referenced=False)
        self._clamped, self._origin = clamped, 0.0
        self._channels = make_channels(self.settings, self._origin, self._drive.rated_torque)
        self._samples = SampleReader(self._bus, self._node, clock, settings.cycle)
        self._setpoints = SetpointSender(name, self._node, self._drive, clock, settings, master_id)
        self._message = ""

    @property
    def name(self) -> str:
        """Name in configuration, logs and messages."""
        return self._name

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Position, velocity and torque."""
        return self._channels

    @property
    def reference_state(self) -> ReferenceState:
        """Reference of the rod's position, and specimen."""
        return self._reference_state

    @property
    def origin(self) -> float:
        """Drive position that counts as zero [m from home]."""
        return self._origin

    @property
    def rated_torque(self) -> float:
        """[N m] as reported by the drive."""
        return self._drive.rated_torque

    @property
    def clock_reading(self) -> ClockReading | None:
        """Latest reading of the drive's clock; None before the first."""
        return self._samples.decoder.clock_reading

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Faults that the drive has reported and not cleared."""
        return self._drive.faults

    # Connection

    def connect(self) -> None:
        """Open the bus, check the drive's identity, write its limits, and leave it without voltage."""
        self._setpoints.disarm()
        self._message = ""
        self._bus.open()
        try:
            self._node.attach()
            self._drive.configure(self.settings)
            is_referenced = self._drive.is_referenced()
        except DriverError:
            self._bus.close()
            raise
        self._setpoints.start_session()
        # After a broken connection the specimen is still clamped, and its centre valid if the drive is referenced.
        if not is_referenced or self._reference_state not in (ReferenceState.MOUNTED, ReferenceState.CENTRED):
            self._reference_state, self._origin = find_initial_state(self._clamped, is_referenced), 0.0
        self._channels = make_channels(self.settings, self._origin, self._drive.rated_torque)
        self._samples.start(self._origin, self._drive.rated_torque)

    def close(self) -> None:
        """Bring the rod to rest and close the bus."""
        if self._bus.is_open:
            self.make_safe()
        self._bus.close()

    def get_health(self) -> Health:
        """Return the counts of samples, and the present problems."""
        decoder = self._samples.decoder
        # Frames are counted even while no thread takes samples (decision 0011).
        decoder.decode_pending()
        corrupted = decoder.corrupted + self._bus.corrupted
        message = "; ".join(filter(None, [self._message, *map(str, self.faults)]))
        return Health(self._bus.is_open, decoder.received, decoder.lost, corrupted, 0, decoder.last_ns, message)

    def add_listener(self, listener: FrameListener) -> None:
        """Call ``listener`` with every frame from now on."""
        self._bus.add_listener(listener)

    def acquire(self, timeout: float) -> list[SampleBlock]:
        """Return the samples since the last call, waiting up to ``timeout`` [s] for the first.

        Raises:
            NotConnectedError: the bus is gone.
            NoReplyError: the drive's heartbeat is lost.
        """
        return self._samples.acquire(timeout)

    def snapshot_decoder(self) -> dict[str, Any]:
        """Return the decoder's state, from which a replay decodes the frames to come, see `drivers.replay`."""
        return self._samples.snapshot(self._origin, self._drive.rated_torque)

    def read(self, channel: str) -> Reading:
        """Request one value from the drive.

        Raises:
            OutOfRangeError: there is no such channel.
            NoReplyError, InvalidReplyError, RefusedError, NotConnectedError: the value was not read.
        """
        if channel not in OBJECTS:
            raise OutOfRangeError(f"{self._name}: no channel {channel}; there are {', '.join(OBJECTS)}")
        raw = self._node.read_number(OBJECTS[channel])
        value = raw * (self._drive.rated_torque / 1000 if channel == "actuator_torque" else METRES_PER_COUNT)
        zero = self._origin if channel == "actuator_position" else 0.0
        return Reading(value - zero, self._clock(), None, raw, "good")

    def write(self, channel: str, value: float) -> None:
        """Set the position, as one call of `send_setpoint`."""
        if channel != "actuator_position":
            raise OutOfRangeError(f"{self._name}: {channel} cannot be written; nothing was sent")
        self.send_setpoint(value)

    # Motion

    def arm(self) -> float:
        """Switch the drive on at its present position. From then on, call `send_setpoint` in every cycle.

        Returns:
            Present position of the rod, and of the first setpoint [m].

        Raises:
            RefusedError: there is a fault or no reference, or the drive does not switch on.
        """
        check_referenced(self._reference_state, self._name)
        self._drive.check_no_fault()
        self._drive.enable_operation(self._master_id, self.settings)
        # Read once the drive holds the rod: without voltage the load could still move it.
        position = self.read("actuator_position").value
        self._setpoints.arm(position)
        return position

    def send_setpoint(self, position: float, due_ns: int | None = None) -> None:
        """Send one setpoint, once per cycle.

        Args:
            position: [m] from the specimen's centre, or from home before a specimen is centred.
            due_ns: bench clock at which the setpoint was due, if it is late [ns]; the speed limit uses it.

        Raises:
            OutOfRangeError: outside the travel or too fast from the last one; nothing was sent.
            RefusedError: not armed, or the drive has stopped by itself, with its reason.
            NoReplyError, NotConnectedError: the drive or the bus is gone.
        """
        self._setpoints.send(position, self._origin, self.channels[0], self._samples.decoder, due_ns)

    def send_sync(self) -> None:
        """Request one sample without a setpoint, by a SYNC alone."""
        self._node.send_sync()

    def disable(self) -> None:
        """Switch the voltage off at the present position, after setpoints have ended."""
        # Before the stop: a setpoint contains "enable", which may cancel a quick stop.
        self._setpoints.disarm()
        self._drive.switch_off()

    def make_safe(self) -> str:
        """Stop quickly by the drive's own ramp, and wait until the rod is at rest or the deadline is over.

        Returns:
            The reason why the drive did not confirm that the rod is at rest; empty if it did.
        """
        self._setpoints.disarm()
        try:
            self._drive.stop(self.settings.stop_timeout)
            self._message = ""
        except DriverError as error:
            self._message = f"quick stop not confirmed: {error}"
            return str(error)
        return ""

    def reset(self) -> None:
        """Clear the faults; the drive stays without voltage and nothing moves.

        Raises:
            NoReplyError: a fault remains.
        """
        self._setpoints.disarm()
        self._drive.reset()
        self._message = ""

    # Home, specimen, centre

    def home(self, timeout: float = 30.0, method: int = 17) -> None:
        """Seek the reference; refused with a specimen clamped.

        Args:
            timeout: deadline [s].
            method: method of 6098h; 17 seeks the negative limit switch, 37 takes the present position.

        Raises:
            RefusedError: a specimen is clamped, or there is a fault.
            NoReplyError: the reference was not found in time.
        """
        after = apply_transition(self._reference_state, "home")
        self._check_disarmed("home")
        self._drive.check_no_fault()
        # A drive drops its reference when it starts to seek, and has none if the search ends early.
        self._reference_state = ReferenceState.UNREFERENCED
        self._seek_home(method, timeout)
        self._set_origin(0.0)
        self._reference_state = after

    def _seek_home(self, method: int, timeout: float) -> None:
        try:
            self._drive.home(method, timeout)
        except DriverError:
            self.make_safe()
            raise

    def mount(self) -> None:
        """Record that a specimen has been clamped."""
        self._check_disarmed("mount")
        self._reference_state = apply_transition(self._reference_state, "mount")
        self._clamped = True

    def centre(self) -> None:
        """Make the present position, the middle of the specimen, the zero of positions."""
        after = apply_transition(self._reference_state, "centre")
        self._check_disarmed("centre")
        self._set_origin(self.read("actuator_position").value + self._origin)
        self._reference_state = after

    def unmount(self) -> None:
        """Record that the specimen has been removed; positions count from home again."""
        self._check_disarmed("unmount")
        self._reference_state = apply_transition(self._reference_state, "unmount")
        self._clamped = False
        self._set_origin(0.0)

    def _set_origin(self, origin: float) -> None:
        self._origin = self._samples.decoder.origin = origin
        self._channels = make_channels(self.settings, self._origin, self._drive.rated_torque)

    def _check_disarmed(self, step: str) -> None:
        if self._setpoints.is_armed:
            raise RefusedError(f"{self._name}: cannot {step} while the drive is armed; call disable first")
