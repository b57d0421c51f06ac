"""A CiA 402 drive and its few verbs: set up, switch on and off, stop, reset, seek home.

States are led by object access, one step at a time, each with a deadline; process data are left to whoever leads
the rod. Limits are written in the drive's own counts and read back.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

from drivers import cia402
from drivers.canopen_node import CanopenNode
from drivers.cia402 import DriveState, Fault
from drivers.errors import BadReply, NoReply, OutOfRange, Refused

COUNT = 1e-7
"""[m] of one position count, [m/s] of one of velocity; checked against the drive's own unit objects."""
# 402, in the lower half of the device type.
_PROFILE = 0x192
# As CiA 303-2 writes units: 10^-7 (F9h, an exponent of -7) metre (01h), and the same a second (03h).
_UNITS = {0x60A8: 0xF9010000, 0x60A9: 0xF9010300}
_STEP_WITHIN = 1.0
"""[s] for one change of state."""
_POLL = 0.002
"""[s] between looks while waiting."""
_AT_REST = 2e-3
"""[m/s] below which the rod counts as standing."""


@dataclass(frozen=True)
class ActuatorSettings:
    """What the drive is told when it is connected; every value is read back."""

    cycle: float = 0.004
    """[s] between setpoints, whole milliseconds."""
    stale_after: float = 0.05
    """[s] without a setpoint until the drive stops by itself."""
    master_beat: float = 0.02
    """[s] between the heartbeats that accompany setpoints."""
    master_lost_after: float = 0.1
    """[s] without them until the drive stops by itself."""
    drive_beat: float = 0.05
    """[s] between the drive's own heartbeats."""
    drive_silent_after: float = 0.25
    """[s] without them until the drive counts as gone."""
    travel: tuple[float, float] = (-0.06, 0.06)
    """[m] from home: positions outside are refused here and by the drive."""
    top_speed: float = 0.5
    """[m/s] faster setpoints are refused."""
    torque: float = 1.2
    """[N m] limit of the motor."""
    following: float = 5e-3
    """[m] by which the rod may stay behind before the drive stops."""
    arrival: float = 1e-4
    """[m] within which a target counts as reached."""
    stop_within: float = 0.5
    """[s] for coming to rest when made safe."""


# Not the library's own CiA 402 profile (canopen 2.4.1): it leads states by process data, which it does not send
# where they wait for a SYNC, and a reset always takes all of its deadline.
class ServoDrive:
    """The verbs of one drive.

    Args:
        name: for messages.
        node: through which it is reached.
    """

    def __init__(self, name: str, node: CanopenNode) -> None:
        self.rated_torque = 1.0
        """[N m] as the drive said; torques on the wire are per mille of it."""
        self._name = name
        self._node = node

    @property
    def faults(self) -> tuple[Fault, ...]:
        """What the drive reported and has not taken back."""
        return cia402.active_faults(self._node.emergencies)

    def set_up(self, settings: ActuatorSettings) -> None:
        """See that it is the right drive, write and read back its limits, map its process data, start it.

        Raises:
            BadReply: it is another device, or counts in other units.
            Refused: it keeps another limit than it was told, or refuses one.
            NoReply, NotConnected: it or the bus is not there.
        """
        node = self._node
        node.wait_for_heartbeat(_STEP_WITHIN)
        self._identify()
        # Whoever led it before may have left it in motion.
        self.stop(settings.stop_within)
        node.command_state(127, _STEP_WITHIN)  # process data may be mapped anew in pre-operational alone
        node.set_up_process_data()
        self._set_limits(settings)
        node.command_state(5, _STEP_WITHIN)
        self.switch_off()

    def referenced(self) -> bool:
        """Whether the drive knows where the rod is."""
        return bool(self._node.number(0x6041) & cia402.REFERENCED)

    def state(self) -> DriveState:
        """Asked for now."""
        return cia402.drive_state(self._node.number(0x6041))

    def lead_from_now(self, master: int, settings: ActuatorSettings) -> None:
        """Switch on in cyclic synchronous position; once the master's heartbeat is heard, it must go on."""
        self._node.settle(0x6060, cia402.CYCLIC_POSITION)
        self._node.settle(0x1016, master << 16 | round(settings.master_lost_after * 1e3), 1)
        self._switch_on()

    def switch_off(self) -> None:
        """Take the voltage away, and stop watching the master."""
        # First, or the drive would take the silence of whoever led it for a lost master, and fault.
        self._node.download(0x1016, 0, 1)
        self._node.download(0x6040, cia402.DISABLE_VOLTAGE)
        self._until(
            lambda: self.state() in (DriveState.SWITCH_ON_DISABLED, DriveState.FAULT), _STEP_WITHIN, "voltage off"
        )

    def stop(self, within: float) -> None:
        """Quick stop by the drive's own ramp, watched until the rod stands.

        Raises:
            NoReply: it does not stand within ``within`` [s], or says nothing.
        """
        state = self.state()
        if state in (DriveState.ENABLED, DriveState.QUICK_STOP):
            self._node.download(0x6040, cia402.QUICK_STOP)
        if state in (DriveState.ENABLED, DriveState.QUICK_STOP, DriveState.FAULT_REACTION):
            self._until(self._stands, within, "the rod to stand")
        # Whoever led it falls silent now, and means to.
        self._node.download(0x1016, 0, 1)

    def reset(self) -> None:
        """Take back the faults; nothing moves.

        Raises:
            NoReply: a fault stays.
        """
        # A reset is the rising edge of its bit: it has to be down before, and must not stay up.
        for word in (cia402.DISABLE_VOLTAGE, cia402.RESET_FAULT, cia402.DISABLE_VOLTAGE):
            self._node.download(0x6040, word)
        self._until(
            lambda: self.state() is DriveState.SWITCH_ON_DISABLED, _STEP_WITHIN, "the fault to be taken back"
        )
        self._node.emergencies = []

    def home(self, method: int, within: float) -> None:
        """Seek the reference by a method of 6098h, then switch off."""
        self._node.settle(0x6098, method)
        self._node.settle(0x6060, cia402.HOMING)
        self._switch_on()
        self._node.download(0x6040, cia402.START_HOMING)
        self._until(self._homed, within, "the reference")
        self.switch_off()

    def check_no_fault(self) -> None:
        """See that nothing stands against moving.

        Raises:
            Refused: a fault does.
        """
        if self.faults:
            words = "; ".join(map(str, self.faults))
            raise Refused(f"{self._name}: {words}; find the cause, then reset")

    def _identify(self) -> None:
        kind = self._node.number(0x1000)
        if kind & 0xFFFF != _PROFILE:
            raise BadReply(
                f"{self._name}: device type {kind:08X}h is no CiA 402 drive at this node id; see the configuration"
            )
        for index, wanted in _UNITS.items():
            found = self._node.number(index)
            if found != wanted:
                raise BadReply(
                    f"{self._name}: unit object {index:04X}h reads {found:08X}h, not {wanted:08X}h; "
                    "set its unit to 0.1 µm"
                )
        rated = self._node.number(0x6076)
        if rated <= 0:
            raise BadReply(
                f"{self._name}: rated torque (6076h) reads {rated} mN m; enter the motor's in the drive"
            )
        self.rated_torque = rated * 1e-3

    def _set_limits(self, settings: ActuatorSettings) -> None:
        cycle = round(settings.cycle * 1e3)
        if abs(cycle - settings.cycle * 1e3) > 1e-6 or not 1 <= cycle <= 20:
            raise OutOfRange(
                f"{self._name}: cycle {settings.cycle * 1e3:g} ms; whole milliseconds from 1 to 20 are allowed"
            )
        low, high = settings.travel
        wanted = [
            (0x1017, 0, round(settings.drive_beat * 1e3)),  # its heartbeat
            (0x1006, 0, cycle * 1000),  # from SYNC to SYNC [us]
            (0x60C2, 1, cycle),  # over which it interpolates between setpoints
            (0x60C2, 2, -3),  # in ms
            (0x1400, 5, round(settings.stale_after * 1e3)),  # without a setpoint it stops
            (0x6007, 0, 3),  # and without the master's heartbeat: by quick stop
            (0x605A, 0, 6),  # by its own ramp; then it holds the rod
            (0x607D, 1, round(low / COUNT)),
            (0x607D, 2, round(high / COUNT)),
            # Twice what the bench commands: setpoints that left late are made up for by some that follow closer.
            (0x607F, 0, round(2 * settings.top_speed / COUNT)),
            (0x6065, 0, round(settings.following / COUNT)),
            (0x6067, 0, round(settings.arrival / COUNT)),
            (0x6072, 0, round(settings.torque / self.rated_torque * 1000)),
        ]
        for index, sub, value in wanted:
            self._node.settle(index, value, sub)

    def _switch_on(self) -> None:
        """Step by step to operation enabled, as far as each state allows."""

        def stepped() -> bool:
            state = self.state()
            self.check_no_fault()
            word = cia402.onward(state)
            if word is not None:
                self._node.download(0x6040, word)
            return state is DriveState.ENABLED

        self._until(stepped, _STEP_WITHIN, "operation enabled")

    def _stands(self) -> bool:
        # An enabled rod is still for a moment at every reversal, and goes on.
        still = abs(self._node.number(0x606C)) * COUNT < _AT_REST
        return still and self.state() is not DriveState.ENABLED

    def _homed(self) -> bool:
        self.check_no_fault()
        if (state := self.state()) is not DriveState.ENABLED:
            raise Refused(f"{self._name}: homing was broken off, the drive is {state.value}; home again")
        word = self._node.number(0x6041)
        if word & cia402.HOMING_ERROR:
            raise Refused(f"{self._name}: homing ended in an error (statusword {word:04X}h); see the limit switch")
        return bool(word & cia402.HOMING_ATTAINED) and bool(word & cia402.REFERENCED)

    def _until(self, done: Callable[[], bool], within: float, what: str) -> None:
        deadline = time.monotonic() + within
        while not done():
            if time.monotonic() > deadline:
                raise NoReply(
                    f"{self._name}: waited {within:g} s for {what}; the drive says: {self.state().value}; "
                    "see its supply, its enable input and its limit switches"
                )
            time.sleep(_POLL)
