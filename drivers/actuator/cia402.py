"""States, controlwords and faults of a CiA 402 drive, as pure functions and tables.

A statusword is decoded to a state, each state has the controlword of the next step towards operation, and an
emergency code is classified as a fault.
"""

from enum import Enum
from typing import NamedTuple

from drivers.transport import Emergency

DISABLE_VOLTAGE, QUICK_STOP, SHUT_DOWN, SWITCH_ON, ENABLE = 0x00, 0x02, 0x06, 0x07, 0x0F
START_HOMING = 0x1F
RESET_FAULT = 0x80
"""Controlwords."""
HOMING, CYCLIC_POSITION = 6, 8
"""Modes of operation."""
HOMING_ATTAINED, HOMING_ERROR, REFERENCED = 0x1000, 0x2000, 0x8000
"""Bits of the statusword."""


class DriveState(Enum):
    """State of the drive."""

    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY = "ready to switch on"
    SWITCHED_ON = "switched on"
    ENABLED = "operation enabled"
    QUICK_STOP = "quick stop active"
    FAULT_REACTION = "fault reaction active"
    FAULT = "fault"


# Bit 5, quick stop, is undefined in half of the states: those are matched with mask 4Fh, the others with 6Fh.
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

_NEXT_CONTROL_WORDS = {
    DriveState.SWITCH_ON_DISABLED: SHUT_DOWN,
    DriveState.READY: SWITCH_ON,
    DriveState.SWITCHED_ON: ENABLE,
    # Not directly back to operation: CiA 402 leaves that transition to the manufacturer and advises against it.
    DriveState.QUICK_STOP: DISABLE_VOLTAGE,
}


def decode_drive_state(statusword: int) -> DriveState:
    """Return the state in a statusword; an undefined one counts as not ready."""
    for mask, pattern, state in _PATTERNS:
        if statusword & mask == pattern:
            return state
    return DriveState.NOT_READY


def find_next_control_word(state: DriveState) -> int | None:
    """Return the controlword of the next step towards operation; None if only waiting or a reset helps."""
    return _NEXT_CONTROL_WORDS.get(state)


class FaultKind(Enum):
    """Kind of fault."""

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


_FAULT_KINDS = (
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
"""Emergency code, mask and kind; the first match counts."""


class Fault(NamedTuple):
    """A classified emergency message."""

    kind: FaultKind
    code: int
    """Emergency code."""
    received_ns: int
    """Bench clock [ns]."""

    def __str__(self) -> str:
        return f"{self.kind.value} (emergency {self.code:04X}h)"


def find_active_faults(emergencies: list[Emergency]) -> tuple[Fault, ...]:
    """Return the faults since the drive last reported that none remains."""
    faults: list[Fault] = []
    for emergency in emergencies:
        # 00xxh of CiA 301: no fault remains.
        if emergency.code & 0xFF00 == 0:
            faults.clear()
        else:
            faults.append(Fault(_classify_fault(emergency.code), emergency.code, emergency.received_ns))
    return tuple(faults)


def _classify_fault(code: int) -> FaultKind:
    return next((kind for value, mask, kind in _FAULT_KINDS if code & mask == value), FaultKind.OTHER)
