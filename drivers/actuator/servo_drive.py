"""Operations of a CiA 402 drive: set up, switch on and off, stop, reset, home.

States change by object access, one step at a time, each with a deadline; the setpoint sender uses process data.
Limits are written in the drive's own counts and read back.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

from drivers.actuator import cia402
from drivers.actuator.cia402 import DriveState, Fault
from drivers.errors import InvalidReplyError, NoReplyError, OutOfRangeError, RefusedError
from drivers.transport import CanopenNode

METRES_PER_COUNT = 1e-7
"""[m] per position count and [m/s] per velocity count; checked against the drive's unit objects."""
# Profile 402, in the lower half of the device type.
_DEVICE_PROFILE = 0x192
# Units as in CiA 303-2: 10^-7 (F9h, an exponent of -7) metre (01h), and the same per second (03h).
_UNITS = {0x60A8: 0xF9010000, 0x60A9: 0xF9010300}
_STEP_TIMEOUT = 1.0
"""Time limit of one change of state [s]."""
_POLL_PERIOD = 0.002
"""Time between checks while waiting [s]."""
_REST_SPEED = 2e-3
"""Speed below which the rod counts as at rest [m/s]."""


@dataclass(frozen=True)
class ActuatorSettings:
    """Settings written to the drive when it is connected; every value is read back."""

    cycle: float = 0.004
    """Time between setpoints [s], whole milliseconds."""
    setpoint_timeout: float = 0.05
    """Time without a setpoint after which the drive stops by itself [s]."""
    master_heartbeat_period: float = 0.02
    """Time between the heartbeats that accompany setpoints [s]."""
    master_heartbeat_timeout: float = 0.1
    """Time without these heartbeats after which the drive stops by itself [s]."""
    drive_heartbeat_period: float = 0.05
    """Time between the drive's own heartbeats [s]."""
    drive_heartbeat_timeout: float = 0.25
    """Time without these heartbeats after which the drive counts as lost [s]."""
    travel: tuple[float, float] = (-0.06, 0.06)
    """Smallest and largest position [m from home]; others are refused here and by the drive."""
    max_speed: float = 0.5
    """Largest speed between setpoints [m/s]; faster ones are refused."""
    torque_limit: float = 1.2
    """Limit of the motor [N m]."""
    following_error_window: float = 5e-3
    """Largest following error before the drive stops [m] (6065h)."""
    position_window: float = 1e-4
    """Largest distance at which a target counts as reached [m] (6067h)."""
    stop_timeout: float = 0.5
    """Time limit for coming to rest when made safe [s]."""


# Not the library's own CiA 402 profile (canopen 2.4.1): it changes states by process data, which it does not send
# if they wait for a SYNC, and a reset always takes its full deadline.
class ServoDrive:
    """Operations of one drive.

    Args:
        name: name of the actuator, for messages.
        node: CANopen node of the drive.
    """

    def __init__(self, name: str, node: CanopenNode) -> None:
        self.rated_torque = 1.0
        """[N m] as reported by the drive; torques on the wire are per mille of it."""
        self._name = name
        self._node = node

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Faults that the drive has reported and not cleared."""
        return cia402.find_active_faults(self._node.emergencies)

    def configure(self, settings: ActuatorSettings) -> None:
        """Check the drive's identity, write and read back its limits, map its process data, start it.

        Raises:
            InvalidReplyError: it is another device, or its counts have other units.
            RefusedError: it keeps another limit than was written, or refuses one.
            NoReplyError, NotConnectedError: the drive or the bus is gone.
        """
        node = self._node
        # First, so that an absent node is reported as such, not as an object access without a reply.
        node.heartbeat.wait_for_next(_STEP_TIMEOUT)
        self._identify()
        # An earlier master may have left it in motion.
        self.stop(settings.stop_timeout)
        node.command_state(127, _STEP_TIMEOUT)  # process data can be mapped in pre-operational only
        node.set_up_process_data()
        self._write_limits(settings)
        node.command_state(5, _STEP_TIMEOUT)
        self.switch_off()

    def is_referenced(self) -> bool:
        """Return whether the drive has a position reference."""
        return bool(self._node.read_number(0x6041) & cia402.REFERENCED)

    def read_state(self) -> DriveState:
        """Request the state of the drive."""
        return cia402.decode_drive_state(self._node.read_number(0x6041))

    def enable_operation(self, master_id: int, settings: ActuatorSettings) -> None:
        """Switch on in cyclic synchronous position mode; the drive then expects heartbeats after the first."""
        self._node.write_verified(0x6060, cia402.CYCLIC_POSITION)
        # Not earlier: heartbeats accompany setpoints, so there are none while the drive is off.
        self._node.write_verified(0x1016, master_id << 16 | round(settings.master_heartbeat_timeout * 1e3), 1)
        self._switch_on()

    def switch_off(self) -> None:
        """Switch the voltage off, and stop monitoring the master."""
        # First, or the drive would take the silence of a master that has finished for a lost one, and fault.
        self._node.download(0x1016, 0, 1)
        self._node.download(0x6040, cia402.DISABLE_VOLTAGE)
        self._wait_until(
            lambda: self.read_state() in (DriveState.SWITCH_ON_DISABLED, DriveState.FAULT),
            _STEP_TIMEOUT,
            "voltage off",
        )

    def stop(self, timeout: float) -> None:
        """Stop quickly by the drive's own ramp, and wait until the rod is at rest.

        Raises:
            NoReplyError: it is not at rest within ``timeout`` [s], or does not reply.
        """
        state = self.read_state()
        if state in (DriveState.ENABLED, DriveState.QUICK_STOP):
            self._node.download(0x6040, cia402.QUICK_STOP)
        # In every state: in its fault reaction the drive brakes by itself, and without voltage the rod may coast.
        self._wait_until(self._is_at_rest, timeout, "the rod to come to rest")
        # The master falls silent now, on purpose.
        self._node.download(0x1016, 0, 1)

    def reset(self) -> None:
        """Clear the faults; nothing moves.

        Raises:
            NoReplyError: a fault remains.
        """
        # A reset is the rising edge of its bit, so the bit has to be low before, and must not stay high.
        for word in (cia402.DISABLE_VOLTAGE, cia402.RESET_FAULT, cia402.DISABLE_VOLTAGE):
            self._node.download(0x6040, word)
        self._wait_until(
            lambda: self.read_state() is DriveState.SWITCH_ON_DISABLED, _STEP_TIMEOUT, "the fault to clear"
        )
        self._node.emergencies = []

    def home(self, method: int, timeout: float) -> None:
        """Seek the reference by a method of 6098h, then switch off."""
        self._node.write_verified(0x6098, method)
        self._node.write_verified(0x6060, cia402.HOMING)
        self._switch_on()
        self._node.download(0x6040, cia402.START_HOMING)
        self._wait_until(self._is_homed, timeout, "the reference")
        self.switch_off()

    def check_no_fault(self) -> None:
        """Check that no fault prevents motion.

        Raises:
            RefusedError: there is a fault.
        """
        if faults := self.faults:
            raise RefusedError(f"{self._name}: {'; '.join(map(str, faults))}; find the cause, then reset")

    def _identify(self) -> None:
        device_type = self._node.read_number(0x1000)
        if device_type & 0xFFFF != _DEVICE_PROFILE:
            raise InvalidReplyError(
                f"{self._name}: the device at this node id is not a CiA 402 drive (device type "
                f"{device_type:08X}h); check the configuration"
            )
        for index, expected in _UNITS.items():
            unit = self._node.read_number(index)
            if unit != expected:
                raise InvalidReplyError(
                    f"{self._name}: unit object {index:04X}h reads {unit:08X}h, not {expected:08X}h; "
                    "set its unit to 0.1 µm"
                )
        self.rated_torque = self._read_rated_torque()

    def _read_rated_torque(self) -> float:
        rated = self._node.read_number(0x6076)
        # Torques on the wire are per mille of it, so without a value they cannot be converted.
        if rated <= 0:
            raise InvalidReplyError(
                f"{self._name}: rated torque (6076h) reads {rated} mN m; enter the motor's in the drive"
            )
        return rated * 1e-3

    def _write_limits(self, settings: ActuatorSettings) -> None:
        cycle = round(settings.cycle * 1e3)
        if abs(cycle - settings.cycle * 1e3) > 1e-6 or not 1 <= cycle <= 20:
            raise OutOfRangeError(
                f"{self._name}: cycle {settings.cycle * 1e3:g} ms; whole milliseconds from 1 to 20 are allowed"
            )
        low, high = settings.travel
        objects = [
            (0x1017, 0, round(settings.drive_heartbeat_period * 1e3)),  # its heartbeat
            (0x1006, 0, cycle * 1000),  # from SYNC to SYNC [us]
            (0x60C2, 1, cycle),  # interpolation time between setpoints
            (0x60C2, 2, -3),  # in ms
            (0x1400, 5, round(settings.setpoint_timeout * 1e3)),  # without a setpoint it stops
            (0x6007, 0, 3),  # and without the master's heartbeat: by quick stop
            (0x605A, 0, 6),  # by its own ramp; then it holds the rod
            (0x607D, 1, round(low / METRES_PER_COUNT)),
            (0x607D, 2, round(high / METRES_PER_COUNT)),
            # Twice the bench's limit: after late setpoints, the next ones follow more closely.
            (0x607F, 0, round(2 * settings.max_speed / METRES_PER_COUNT)),
            (0x6065, 0, round(settings.following_error_window / METRES_PER_COUNT)),
            (0x6067, 0, round(settings.position_window / METRES_PER_COUNT)),
            (0x6072, 0, round(settings.torque_limit / self.rated_torque * 1000)),
        ]
        for index, sub, value in objects:
            self._node.write_verified(index, value, sub)

    def _switch_on(self) -> None:
        """Switch on step by step until operation is enabled."""

        def advance_state() -> bool:
            state = self.read_state()
            self.check_no_fault()
            word = cia402.find_next_control_word(state)
            if word is not None:
                self._node.download(0x6040, word)
            return state is DriveState.ENABLED

        self._wait_until(advance_state, _STEP_TIMEOUT, "operation enabled")

    def _is_at_rest(self) -> bool:
        # The speed alone is not enough: an enabled rod is at rest for an instant at every reversal.
        is_slow = abs(self._node.read_number(0x606C)) * METRES_PER_COUNT < _REST_SPEED
        return is_slow and self.read_state() is not DriveState.ENABLED

    def _is_homed(self) -> bool:
        self.check_no_fault()
        if (state := self.read_state()) is not DriveState.ENABLED:
            raise RefusedError(f"{self._name}: homing was interrupted, the drive is {state.value}; home again")
        word = self._node.read_number(0x6041)
        if word & cia402.HOMING_ERROR:
            raise RefusedError(
                f"{self._name}: homing ended in an error (statusword {word:04X}h); check the limit switch"
            )
        return bool(word & cia402.HOMING_ATTAINED) and bool(word & cia402.REFERENCED)

    def _wait_until(self, is_done: Callable[[], bool], timeout: float, event: str) -> None:
        deadline = time.monotonic() + timeout
        while not is_done():
            if time.monotonic() > deadline:
                raise NoReplyError(
                    f"{self._name}: waited {timeout:g} s for {event}; the drive's state is "
                    f"{self.read_state().value}; check its supply, its enable input and its limit switches"
                )
            time.sleep(_POLL_PERIOD)
