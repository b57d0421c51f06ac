"""Simulated servo drive: CiA 402 in cyclic synchronous position and homing mode, behind a CANopen slave.

Missing setpoints (event timer of RPDO 1), a lost heartbeat of the master (6007h) and a commanded stop all end in a
quick stop. The drive's own ramp defines it. The drive does not simulate the rod. It sends its demand to the rig as
a command, and receives position and force as the sensors report them. Homing finds the drive's zero. Before, its
position is relative to the position at switch-on.
"""

import math

from sim_rig.instruments.cia402_states import DriveState, find_next_state
from sim_rig.instruments.encoder import DEFAULT_MECHANICS, DriveMechanics, DriveSensors
from sim_rig.instruments.motion_generator import MotionGenerator, MotionState
from sim_rig.instruments.wire_files import ACTUATOR_EDS
from sim_rig.live import RigInterface
from sim_rig.protocols import CanopenSlave, ObjectDictionary, SendFrame

_COUNT = 1e-7
"""Size of one count: [m], [m/s] and [m/s²]."""
_MILLISECOND = 1_000_000
"""[ns]"""
_MAX_SAMPLE_AGE_NS = 15_000_000
"""Threshold on the age of the newest position [ns]: above it, the simulation is behind and not the rod."""
_OVERDUE_PERIODS = 1.25
"""Threshold on the age of the last setpoint [interpolation periods]: above it, the next one is missing."""
_HOMING, _CYCLIC_POSITION = 6, 8
"""Modes of operation."""
_NO_POSITION, _MASTER_LOST, _SETPOINT_TIMEOUT = 0x7320, 0x8130, 0x8250
_FOLLOWING_ERROR, _TRAVEL_LIMIT = 0x8611, 0x8612
"""Emergency codes: position sensor, heartbeat of the master, setpoint timeout, following error, travel limit."""


class ServoDriveDevice:
    """One drive as a node of a `SocketcandServer`.

    Args:
        signals: the rig.
        node_id: on the bus.
        referenced: whether its position is referenced already, with the zero of the rig.
        mechanics: mechanics and clock.
    """

    def __init__(
        self,
        signals: RigInterface,
        *,
        node_id: int = 5,
        referenced: bool = False,
        mechanics: DriveMechanics = DEFAULT_MECHANICS,
    ) -> None:
        self.objects = ObjectDictionary(ACTUATOR_EDS, node_id)
        self.objects.set_value(0x6076, round(mechanics.torque * 1e3))
        self.state = DriveState.SWITCH_ON_DISABLED
        self.generator = MotionGenerator()
        self.referenced = referenced
        self._signals, self._mechanics = signals, mechanics
        self._sensors = DriveSensors(signals, mechanics)
        self._node_id = node_id
        self._home_offset = 0.0 if referenced else self._sensors.read_position()[1]
        self._setpoint_ns: int | None = None
        self._deviation_start_ns: int | None = None
        self._controlword = 0
        self._homed = self._homing = self._latched = self._limited = False
        self._last_command: float | None = None
        self._refreshed_ns = -1

    def join(self, send: SendFrame, now_ns: int) -> None:
        """Join a bus and announce the node."""
        self.slave = CanopenSlave(self._node_id, self.objects, self, send)
        self.slave.boot(now_ns)

    def receive(self, identifier: int, data: bytes, now_ns: int) -> None:
        """Process a frame; a silenced drive ignores it."""
        if not self.slave.injection.silent:
            self.slave.receive(identifier, data, now_ns)

    def tick(self, now_ns: int) -> None:
        """Advance the demand and check the limits."""
        self.generator.advance(now_ns)
        if self.state in (DriveState.ENABLED, DriveState.QUICK_STOP, DriveState.FAULT_REACTION):
            self._supervise(now_ns)
            self._publish_demand(now_ns)
        self.slave.tick(now_ns)

    def acts_by_itself(self, now_ns: int) -> bool:
        """Return whether the rod moves without setpoints, or a setpoint is missing."""
        overdue_ns = _OVERDUE_PERIODS * self.objects.get_number(0x60C2, 1) * _MILLISECOND
        is_overdue = self._setpoint_ns is None or now_ns - self._setpoint_ns > overdue_ns
        return is_overdue and self.generator.state is not MotionState.REST

    def raise_fault(self, code: int, now_ns: int | None = None) -> None:
        """Enter the fault state with an emergency code, after braking."""
        now = self._signals.now_ns() if now_ns is None else now_ns
        self._report_emergency(code, now)
        running = self.state in (DriveState.ENABLED, DriveState.QUICK_STOP)
        self.state = DriveState.FAULT_REACTION if running else DriveState.FAULT
        self._brake()

    # Callbacks of the slave

    def update_objects(self, now_ns: int) -> None:
        """Update the actual values, once per instant."""
        if now_ns == self._refreshed_ns:
            return
        self._refreshed_ns = now_ns
        sample_ns, position, velocity = self._sensors.read_motion(now_ns)
        if not math.isfinite(position):
            if self.state not in (DriveState.FAULT, DriveState.FAULT_REACTION):
                self.raise_fault(_NO_POSITION, now_ns)
            # Of all that it sends, only the statusword is still valid.
            self.objects.set_value(0x6041, self._make_statusword())
            return
        self.objects.set_value(0x1013, self._sensors.read_clock_us(sample_ns))
        self.objects.set_value(0x6064, _convert_to_counts(position - self._home_offset))
        self.objects.set_value(0x606C, _convert_to_counts(velocity))
        self.objects.set_value(0x60F4, _convert_to_counts(self.generator.position - position))
        self.objects.set_value(0x6077, self._sensors.read_torque(now_ns, self.objects.get_number(0x6076) * 1e-3))
        self.objects.set_value(0x6061, self.objects.get_number(0x6060))
        self.objects.set_value(0x6041, self._make_statusword())

    def on_read(self, index: int, now_ns: int) -> None:
        """Set the clock object to the present time for a client; process data carry the time of their position."""
        if index == 0x1013:
            # Refreshed again afterwards, so that process data of the same instant contain their own stamp.
            self.objects.set_value(0x1013, self._sensors.read_clock_us(now_ns))
            self._refreshed_ns = -1

    def on_write(self, index: int, sub: int, now_ns: int) -> None:
        """Apply a controlword that a client wrote."""
        if index == 0x6040:
            self._apply_controlword(now_ns)

    def on_sync(self, now_ns: int) -> None:
        """Apply controlword and setpoint, which take effect with this SYNC."""
        self._apply_controlword(now_ns)
        if self.state is DriveState.ENABLED and self.objects.get_number(0x6060) == _CYCLIC_POSITION:
            self._setpoint_ns = now_ns
            self._follow_setpoint(now_ns)

    def on_master_lost(self, now_ns: int) -> None:
        """React to a lost master as object 6007h defines."""
        # CiA 402: 0 no action, 1 fault, 2 voltage off, 3 quick stop.
        reaction = self.objects.get_number(0x6007)
        if reaction == 1 and self.state is DriveState.ENABLED:
            self.raise_fault(_MASTER_LOST, now_ns)
        elif reaction:
            self._stop_on_loss(_MASTER_LOST, now_ns)
            self._change_state(DriveState.SWITCH_ON_DISABLED if reaction == 2 else self.state, now_ns)

    def reset(self, now_ns: int) -> None:
        """Reset the node: disabled, with unchanged parameters."""
        self.state, self._latched = DriveState.SWITCH_ON_DISABLED, False
        self.generator.hold_at(self._sensors.read_position()[1])

    # States

    def _apply_controlword(self, now_ns: int) -> None:
        before, word = self._controlword, self.objects.get_number(0x6040)
        self._controlword = word
        if self.state is DriveState.FAULT:
            # Only on the rising edge of its bit, after CiA 402.
            if word & ~before & 0x80:
                self._clear_fault(now_ns)
        elif self.state is not DriveState.FAULT_REACTION:
            self._change_state(find_next_state(self.state, word, self._latched), now_ns)
        start_requested = word & 0x10 and not before & 0x10
        if start_requested and self.state is DriveState.ENABLED and self.objects.get_number(0x6060) == _HOMING:
            self._start_homing()

    def _change_state(self, state: DriveState, now_ns: int) -> None:
        if state is self.state:
            return
        if state is DriveState.QUICK_STOP:
            self._brake()
        # The demand restarts at the position of the rod, not at its last value.
        elif state is DriveState.ENABLED:
            self.generator.advance(now_ns)
            self.generator.hold_at(self._sensors.read_position()[1])
            self._setpoint_ns = self._deviation_start_ns = None
        elif self.state in (DriveState.ENABLED, DriveState.QUICK_STOP):
            self.generator.hold_at(self.generator.position)
        if state is DriveState.SWITCH_ON_DISABLED and self._latched:
            self._clear_fault(now_ns)
        self._homing = self._homing and state is DriveState.ENABLED
        self.state = state

    def _clear_fault(self, now_ns: int) -> None:
        self.state, self._latched = DriveState.SWITCH_ON_DISABLED, False
        self.objects.set_value(0x603F, 0)
        self.slave.send_emergency(0, 0, now_ns)

    def _stop_on_loss(self, code: int, now_ns: int) -> None:
        """Report the loss of setpoints or master, and stop."""
        if self.state is not DriveState.ENABLED:
            return
        self._report_emergency(code, now_ns)
        self._latched = True
        self.state = DriveState.QUICK_STOP
        self._brake()

    def _report_emergency(self, code: int, now_ns: int) -> None:
        self.objects.set_value(0x603F, code)
        # Error register of CiA 301: generic (1h), with communication (10h) or device profile (20h).
        self.slave.send_emergency(code, 0x11 if code & 0xF000 == 0x8000 else 0x21, now_ns)

    def _make_statusword(self) -> int:
        # CiA 402: voltage on 10h, remote 200h, target reached 400h, limit active 800h, homing attained or
        # setpoints followed 1000h. Manufacturer specific: referenced 8000h.
        word = self.state.value | 0x10
        moving = self.generator.state is not MotionState.REST
        if self.objects.get_number(0x6060) == _HOMING:
            word |= (0x1000 if self._homed else 0) | (0 if moving else 0x400)
        elif self.state is DriveState.ENABLED:
            word |= 0x1000
        return word | (0x800 if self._limited else 0) | (0x8000 if self.referenced else 0) | 0x200

    # Motion

    def _follow_setpoint(self, now_ns: int) -> None:
        setpoint = self.objects.get_number(0x607A)
        low, high = self.objects.get_number(0x607D, 1), self.objects.get_number(0x607D, 2)
        if self.referenced and not low <= setpoint <= high:
            self._limited = True
            self.raise_fault(_TRAVEL_LIMIT, now_ns)
            return
        # A motor at its torque limit holds its position until the load decreases.
        saturated = abs(self.objects.get_number(0x6077)) > self.objects.get_number(0x6072)
        self._limited = saturated
        target = self.generator.position if saturated else self._home_offset + setpoint * _COUNT
        self.generator.advance(now_ns)
        self._publish_demand(now_ns)
        moves = self.generator.add_setpoint(
            target,
            now_ns,
            self.objects.get_number(0x60C2, 1) * _MILLISECOND,
            self.objects.get_number(0x607F) * _COUNT,
            self.objects.get_number(0x6085) * _COUNT,
        )
        for move in moves:
            self._signals.schedule_position(move.target, move.end_ns, move.begin_ns)
        # At the torque limit the demand is held back, so the setpoint itself is compared.
        self._check_following_error(
            self._home_offset + setpoint * _COUNT if saturated else self.generator.position, now_ns
        )

    def _check_following_error(self, demanded: float, now_ns: int) -> None:
        """Raise a fault when the following error of the demand [m] has lasted for its timeout (6066h)."""
        sample_ns, position = self._sensors.read_position()
        if now_ns - sample_ns > _MAX_SAMPLE_AGE_NS:  # the simulation is delayed by a busy computer
            return
        if abs(demanded - position) <= self.objects.get_number(0x6065) * _COUNT:
            self._deviation_start_ns = None
        elif self._deviation_start_ns is None:
            self._deviation_start_ns = now_ns
        elif now_ns - self._deviation_start_ns > self.objects.get_number(0x6066) * _MILLISECOND:
            self.raise_fault(_FOLLOWING_ERROR, now_ns)

    def _supervise(self, now_ns: int) -> None:
        timeout = self.objects.get_number(0x1400, 5) * _MILLISECOND
        if timeout and self._setpoint_ns is not None and now_ns - self._setpoint_ns > timeout:
            self._setpoint_ns = None
            self._stop_on_loss(_SETPOINT_TIMEOUT, now_ns)
        if self.generator.state is not MotionState.REST:
            return
        if self._homing:
            self._finish_homing()
        elif self.state is DriveState.FAULT_REACTION:
            self.state = DriveState.FAULT
        # CiA 402: below 5 the drive switches off after its quick stop, otherwise it holds the rod.
        elif self.state is DriveState.QUICK_STOP and self.objects.get_number(0x605A) < 5:
            self.state = DriveState.SWITCH_ON_DISABLED

    def _brake(self) -> None:
        self._setpoint_ns, self._homing = None, False
        self.generator.brake(self.objects.get_number(0x6085) * _COUNT)

    def _start_homing(self) -> None:
        self._homed, self._homing, self.referenced = False, True, False
        # Method 37 takes the present position as home, so nothing moves.
        if self.objects.get_number(0x6098) != 37:
            self.generator.move_to(self._mechanics.limit_switch, self.objects.get_number(0x6099, 1) * _COUNT)

    def _finish_homing(self) -> None:
        """Set the zero: the rod is at the limit switch, to which the home offset refers."""
        offset = 0 if self.objects.get_number(0x6098) == 37 else self.objects.get_number(0x607C)
        self._home_offset = self.generator.position - offset * _COUNT
        self._homing, self._homed, self.referenced = False, True, True

    def _publish_demand(self, now_ns: int) -> None:
        # While it follows setpoints, the rig gets the moves in advance by `schedule_position`.
        if self.generator.state is not MotionState.FOLLOW and self.generator.position != self._last_command:
            self._last_command = self.generator.position
            self._signals.command("displacement", self.generator.position, now_ns)


def _convert_to_counts(value: float) -> int:
    """Return a value [m] in counts, limited to 32 bits."""
    return max(min(round(value / _COUNT), 2**31 - 1), -(2**31))
