"""The states of a CiA 402 drive, the words that move it, and what its emergencies mean.

Nothing here sends anything: a statusword is read as a state, a state is answered by the controlword that leads on
to operation, and an emergency code becomes a named fault.
"""

from enum import Enum
from typing import NamedTuple

from drivers.canopen_node import Emergency

DISABLE_VOLTAGE, QUICK_STOP, SHUT_DOWN, SWITCH_ON, ENABLE = 0x00, 0x02, 0x06, 0x07, 0x0F
START_HOMING = 0x1F
RESET_FAULT = 0x80
"""Controlwords."""
HOMING, CYCLIC_POSITION = 6, 8
"""Modes of operation."""
HOMING_ATTAINED, HOMING_ERROR, REFERENCED = 0x1000, 0x2000, 0x8000
"""Bits of the statusword."""


class DriveState(Enum):
    """What the drive says it is."""

    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY = "ready to switch on"
    SWITCHED_ON = "switched on"
    ENABLED = "operation enabled"
    QUICK_STOP = "quick stop active"
    FAULT_REACTION = "fault reaction active"
    FAULT = "fault"


# Bit 5, quick stop, says nothing in half of the states: these are told apart by 4Fh, the others by 6Fh.
_PATTERNS = (
    (0x4F, 0x00, DriveState.NOT_READY),
    (0x4F, 0x40, DriveState.SWITCH_ON_DISABLED),
    (0x6F, 0x21, DriveState.READY),
    (0x6F, 0x23, DriveState.SWITCHED_ON),
    (0x6F, 0x27, DriveState.ENABLED),
    (0x6F, 0x07, DriveState.QUICK_STOP),
    (0x4F, 0x0F, DriveState.FAULT_REACTION),
    (0x4F, 0x08, DriveState.FAULT),
)

_ONWARD = {
    DriveState.SWITCH_ON_DISABLED: SHUT_DOWN,
    DriveState.READY: SWITCH_ON,
    DriveState.SWITCHED_ON: ENABLE,
    # Not straight back to operation: CiA 402 leaves that way to the maker and advises against it.
    DriveState.QUICK_STOP: DISABLE_VOLTAGE,
}


def drive_state(statusword: int) -> DriveState:
    """The state that a statusword shows; what is none counts as not ready."""
    for mask, pattern, state in _PATTERNS:
        if statusword & mask == pattern:
            return state
    return DriveState.NOT_READY


def onward(state: DriveState) -> int | None:
    """The controlword that leads one step towards operation; none where only waiting or a reset helps."""
    return _ONWARD.get(state)


class FaultKind(Enum):
    """What goes wrong with a drive."""

    STALE_SETPOINTS = "setpoints were stale"
    MASTER_LOST = "the heartbeat of the master was lost"
    FOLLOWING_ERROR = "the rod did not follow"
    TRAVEL_LIMIT = "a position outside the travel was commanded"
    OVER_CURRENT = "over-current"
    VOLTAGE = "supply voltage"
    OVER_TEMPERATURE = "over-temperature"
    POSITION_SENSOR = "position sensor"
    COMMUNICATION = "communication"
    OTHER = "another fault"


_KINDS = (
    (0x8250, 0xFFFF, FaultKind.STALE_SETPOINTS),
    (0x8130, 0xFFFF, FaultKind.MASTER_LOST),
    (0x8611, 0xFFFF, FaultKind.FOLLOWING_ERROR),
    (0x8612, 0xFFFF, FaultKind.TRAVEL_LIMIT),
    (0x2000, 0xF000, FaultKind.OVER_CURRENT),
    (0x3000, 0xF000, FaultKind.VOLTAGE),
    (0x4000, 0xF000, FaultKind.OVER_TEMPERATURE),
    (0x7300, 0xFF00, FaultKind.POSITION_SENSOR),
    (0x8000, 0xF000, FaultKind.COMMUNICATION),
)


class Fault(NamedTuple):
    """An emergency message, understood."""

    kind: FaultKind
    code: int
    """As the drive sent it."""
    received_ns: int
    """Bench clock [ns]."""

    def __str__(self) -> str:
        return f"{self.kind.value} (emergency {self.code:04X}h)"


def active_faults(emergencies: list[Emergency]) -> tuple[Fault, ...]:
    """The faults since the drive last said that none was left."""
    faults: list[Fault] = []
    for emergency in emergencies:
        # 00xxh of CiA 301: no fault is left.
        if emergency.code & 0xFF00 == 0:
            faults.clear()
        else:
            faults.append(Fault(_kind(emergency.code), emergency.code, emergency.received_ns))
    return tuple(faults)


def _kind(code: int) -> FaultKind:
    return next((kind for value, mask, kind in _KINDS if code & mask == value), FaultKind.OTHER)
