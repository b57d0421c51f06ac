"""The simulated servo drive: CiA 402 in cyclic synchronous position and homing mode, behind a CANopen slave.

Setpoints that stop coming (event timer of RPDO 1), a master's heartbeat that goes (6007h) and a commanded stop all
end in a quick stop by the drive's own ramp. What the rod does is the rig's affair: the demand goes out as a
command, position and force come back as what the sensors report. The drive's own zero is found by homing; until
then its position is only relative to where it was switched on.
"""

import math
from pathlib import Path

from sim_rig.canopen_slave import CanopenSlave, Send
from sim_rig.drive_motion import Demand, Motion
from sim_rig.drive_senses import PLAIN_MACHINE, DriveSenses, Machine
from sim_rig.drive_states import State, next_state
from sim_rig.object_dictionary import ObjectDictionary
from sim_rig.signals import Signals

_EDS = Path(__file__).parents[1] / "drivers" / "wire" / "actuator.eds"
_COUNT = 1e-7
"""[m] of one count, also [m/s] and [m/s²]."""
_MILLISECOND = 1_000_000
"""[ns]"""
_BEHIND_NS = 15_000_000
"""[ns] Age of the newest position beyond which the simulation is behind, not the rod."""
_HOMING, _CYCLIC_POSITION = 6, 8
"""Modes of operation."""
_NO_POSITION, _MASTER_LOST, _STALE, _ASTRAY, _OUTSIDE = 0x7320, 0x8130, 0x8250, 0x8611, 0x8612
"""Emergency codes: position sensor, heartbeat of the master, old setpoints, following error, beyond the travel."""


class CanopenActuator:
    """One drive as a node of a `SocketcandServer`.

    Args:
        signals: the rig.
        node_id: on the bus.
        referenced: whether its encoder still knows where it is, zero being the rig's.
        machine: mechanics and clock.
    """

    def __init__(
        self, signals: Signals, *, node_id: int = 5, referenced: bool = False, machine: Machine = PLAIN_MACHINE
    ) -> None:
        self.objects = ObjectDictionary(_EDS, node_id)
        self.objects.put(0x6076, round(machine.torque * 1e3))
        self.state = State.SWITCH_ON_DISABLED
        self.demand = Demand()
        self.referenced = referenced
        self._signals, self._machine = signals, machine
        self._senses = DriveSenses(signals, machine)
        self._node_id = node_id
        self._zero = 0.0 if referenced else self._senses.position()[1]
        self._setpoint_ns: int | None = None
        self._away_ns: int | None = None
        self._controlword = 0
        self._homed = self._homing = self._latched = self._limited = False
        self._pushed: float | None = None
        self._refreshed_ns = -1

    def join(self, send: Send, now_ns: int) -> None:
        """Take part in a bus and announce the node."""
        self.slave = CanopenSlave(self._node_id, self.objects, self, send)
        self.slave.boot(now_ns)

    def take(self, identifier: int, data: bytes, now_ns: int) -> None:
        """A frame has passed; a silenced drive is deaf, too."""
        if not self.slave.injection.silent:
            self.slave.take(identifier, data, now_ns)

    def tick(self, now_ns: int) -> None:
        """Move the demand on, look after the limits."""
        self.demand.advance(now_ns)
        if self.state in (State.ENABLED, State.QUICK_STOP, State.FAULT_REACTION):
            self._watch(now_ns)
            self._push(now_ns)
        self.slave.tick(now_ns)

    def fail(self, code: int, now_ns: int | None = None) -> None:
        """A fault with this emergency code: brake, then drop out."""
        now = self._signals.now_ns() if now_ns is None else now_ns
        self._emergency(code, now)
        running = self.state in (State.ENABLED, State.QUICK_STOP)
        self.state = State.FAULT_REACTION if running else State.FAULT
        self._brake()

    # What the slave asks

    def refresh(self, now_ns: int) -> None:
        """Actual values, taken once an instant."""
        if now_ns == self._refreshed_ns:
            return
        self._refreshed_ns = now_ns
        taken_ns, position, velocity = self._senses.measured(now_ns)
        if not math.isfinite(position):
            if self.state not in (State.FAULT, State.FAULT_REACTION):
                self.fail(_NO_POSITION, now_ns)
            self.objects.put(0x6041, self._statusword())  # of all that it sends, this alone is still known
            return
        self.objects.put(0x1013, self._senses.micros(taken_ns))
        self.objects.put(0x6064, _counts(position - self._zero))
        self.objects.put(0x606C, _counts(velocity))
        self.objects.put(0x60F4, _counts(self.demand.position - position))
        self.objects.put(0x6077, self._senses.torque(now_ns, self.objects.number(0x6076) * 1e-3))
        self.objects.put(0x6061, self.objects.number(0x6060))
        self.objects.put(0x6041, self._statusword())

    def asked(self, index: int, now_ns: int) -> None:
        """Process data carry the instant of their position; a client that asks for the clock gets the clock."""
        if index == 0x1013:
            # Afterwards refreshed anew: process data of this very instant carry their own stamp again.
            self.objects.put(0x1013, self._senses.micros(now_ns))
            self._refreshed_ns = -1

    def written(self, index: int, sub: int, now_ns: int) -> None:
        """Act on what a client wrote."""
        if index == 0x6040:
            self._control(now_ns)

    def synchronised(self, now_ns: int) -> None:
        """A setpoint has come into force."""
        self._control(now_ns)
        if self.state is State.ENABLED and self.objects.number(0x6060) == _CYCLIC_POSITION:
            self._setpoint_ns = now_ns
            self._follow(now_ns)

    def master_lost(self, now_ns: int) -> None:
        """The reaction of 6007h, for a drive that is being led."""
        reaction = self.objects.number(0x6007)
        if reaction == 1 and self.state is State.ENABLED:
            self.fail(_MASTER_LOST, now_ns)
        elif reaction:
            self._abandoned(_MASTER_LOST, now_ns)
            self._go(State.SWITCH_ON_DISABLED if reaction == 2 else self.state, now_ns)

    def reset(self, now_ns: int) -> None:
        """Start anew: disabled, parameters as they were."""
        self.state, self._latched = State.SWITCH_ON_DISABLED, False
        self.demand.rest(self._senses.position()[1])

    # States

    def _control(self, now_ns: int) -> None:
        before, word = self._controlword, self.objects.number(0x6040)
        self._controlword = word
        if self.state is State.FAULT:
            # On the rising edge of its bit alone, as CiA 402 has it.
            if word & ~before & 0x80:
                self._clear(now_ns)
        elif self.state is not State.FAULT_REACTION:
            self._go(next_state(self.state, word, self._latched), now_ns)
        starts = word & 0x10 and not before & 0x10
        if starts and self.state is State.ENABLED and self.objects.number(0x6060) == _HOMING:
            self._start_homing()

    def _go(self, state: State, now_ns: int) -> None:
        if state is self.state:
            return
        if state is State.QUICK_STOP:
            self._brake()
        # It takes hold where the rod stands, wherever the demand was left.
        elif state is State.ENABLED:
            self.demand.advance(now_ns)
            self.demand.rest(self._senses.position()[1])
            self._setpoint_ns = self._away_ns = None
        elif self.state in (State.ENABLED, State.QUICK_STOP):
            self.demand.rest(self.demand.position)
        if state is State.SWITCH_ON_DISABLED and self._latched:
            self._clear(now_ns)
        self._homing = self._homing and state is State.ENABLED
        self.state = state

    def _clear(self, now_ns: int) -> None:
        self.state, self._latched = State.SWITCH_ON_DISABLED, False
        self.objects.put(0x603F, 0)
        self.slave.emergency(0, 0, now_ns)

    def _abandoned(self, code: int, now_ns: int) -> None:
        """Nobody leads any more: say so and stop."""
        if self.state is not State.ENABLED:
            return
        self._emergency(code, now_ns)
        self._latched = True
        self.state = State.QUICK_STOP
        self._brake()

    def _emergency(self, code: int, now_ns: int) -> None:
        self.objects.put(0x603F, code)
        # Error register of CiA 301: generic, and communication (10h) or what the device profile says (20h).
        self.slave.emergency(code, 0x11 if code & 0xF000 == 0x8000 else 0x21, now_ns)

    def _statusword(self) -> int:
        # Beside the state, by CiA 402: voltage on 10h, remote 200h, target reached 400h, a limit at work 800h,
        # homing attained or setpoints followed 1000h; 8000h, referenced, is this maker's own.
        word = self.state.value | 0x10
        moving = self.demand.motion is not Motion.REST
        if self.objects.number(0x6060) == _HOMING:
            word |= (0x1000 if self._homed else 0) | (0 if moving else 0x400)
        elif self.state is State.ENABLED:
            word |= 0x1000
        return word | (0x800 if self._limited else 0) | (0x8000 if self.referenced else 0) | 0x200

    # Motion

    def _follow(self, now_ns: int) -> None:
        wanted = self.objects.number(0x607A)
        low, high = self.objects.number(0x607D, 1), self.objects.number(0x607D, 2)
        if self.referenced and not low <= wanted <= high:
            self._limited = True
            self.fail(_OUTSIDE, now_ns)
            return
        # A motor at its limit holds what it has; it neither lets go nor goes on until the load is less.
        saturated = abs(self.objects.number(0x6077)) > self.objects.number(0x6072)
        self._limited = saturated
        target = self.demand.position if saturated else self._zero + wanted * _COUNT
        self.demand.advance(now_ns)
        self._push(now_ns)
        legs = self.demand.follow(
            target,
            now_ns,
            self.objects.number(0x60C2, 1) * _MILLISECOND,
            self.objects.number(0x607F) * _COUNT,
            self.objects.number(0x6085) * _COUNT,
        )
        for leg in legs:
            self._signals.lead(leg.target, leg.end_ns, leg.begin_ns)
        # Without the limit of torque, the demand would follow the setpoint.
        self._lag(self._zero + wanted * _COUNT if saturated else self.demand.position, now_ns)

    def _lag(self, demanded: float, now_ns: int) -> None:
        """Following error, that of the demand [m] and not of setpoints still to be reached, once it has lasted."""
        seen_ns, position = self._senses.position()
        if now_ns - seen_ns > _BEHIND_NS:  # a busy machine holds the simulation up: no fault of the drive
            return
        if abs(demanded - position) <= self.objects.number(0x6065) * _COUNT:
            self._away_ns = None
        elif self._away_ns is None:
            self._away_ns = now_ns
        elif now_ns - self._away_ns > self.objects.number(0x6066) * _MILLISECOND:
            self.fail(_ASTRAY, now_ns)

    def _watch(self, now_ns: int) -> None:
        stale = self.objects.number(0x1400, 5) * _MILLISECOND
        if stale and self._setpoint_ns is not None and now_ns - self._setpoint_ns > stale:
            self._setpoint_ns = None
            self._abandoned(_STALE, now_ns)
        if self.demand.motion is not Motion.REST:
            return
        if self._homing:
            self._finish_homing()
        elif self.state is State.FAULT_REACTION:
            self.state = State.FAULT
        elif self.state is State.QUICK_STOP and self.objects.number(0x605A) < 5:
            self.state = State.SWITCH_ON_DISABLED

    def _brake(self) -> None:
        self._setpoint_ns, self._homing = None, False
        self.demand.brake(self.objects.number(0x6085) * _COUNT)

    def _start_homing(self) -> None:
        self._homed, self._homing, self.referenced = False, True, False
        if self.objects.number(0x6098) != 37:
            self.demand.travel(self._machine.switch, self.objects.number(0x6099, 1) * _COUNT)

    def _finish_homing(self) -> None:
        """The rod stands at the switch: this is where the home offset applies."""
        offset = 0 if self.objects.number(0x6098) == 37 else self.objects.number(0x607C)
        self._zero = self.demand.position - offset * _COUNT
        self._homing, self._homed, self.referenced = False, True, True

    def _push(self, now_ns: int) -> None:
        # While it follows setpoints the rig knows the way ahead, by `lead`.
        if self.demand.motion is not Motion.FOLLOW and self.demand.position != self._pushed:
            self._pushed = self.demand.position
            self._signals.command("displacement", self.demand.position, now_ns)


def _counts(value: float) -> int:
    """[0.1 um], within what 32 bits hold."""
    return max(min(round(value / _COUNT), 2**31 - 1), -(2**31))
