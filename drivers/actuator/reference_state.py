"""Reference state of the rod: reference of its position, clamped specimen, and the steps allowed in each state.

The drive does not know this state. It decides when the rod may seek its home, which with a specimen clamped would
drive the specimen into its ends.
"""

from enum import Enum

from drivers.errors import RefusedError


class ReferenceState(Enum):
    """Reference of the rod's position, and specimen."""

    UNREFERENCED = "unreferenced"
    """No specimen, no reference."""
    HOMED = "homed"
    """No specimen; the position is referenced."""
    MOUNTED = "mounted"
    """A specimen is clamped; its middle is not yet set."""
    CENTRED = "centred"
    """Positions count from the middle of the specimen."""
    REFERENCE_LOST = "reference_lost"
    """A specimen is clamped and the drive has lost its reference."""


_CLAMPED_MESSAGE = (
    "a specimen is clamped, and homing would drive it into its ends; unclamp it and call unmount first"
)
_LOST_MESSAGE = "the reference is lost; unclamp the specimen, call unmount and home first"
_TRANSITIONS: dict[str, dict[ReferenceState, ReferenceState | str]] = {
    "home": {
        ReferenceState.UNREFERENCED: ReferenceState.HOMED,
        ReferenceState.HOMED: ReferenceState.HOMED,
        ReferenceState.MOUNTED: _CLAMPED_MESSAGE,
        ReferenceState.CENTRED: _CLAMPED_MESSAGE,
        ReferenceState.REFERENCE_LOST: _CLAMPED_MESSAGE,
    },
    "mount": {
        ReferenceState.UNREFERENCED: "the rod's position is not referenced; home it first",
        ReferenceState.HOMED: ReferenceState.MOUNTED,
        ReferenceState.MOUNTED: ReferenceState.MOUNTED,
        ReferenceState.CENTRED: "the specimen is already mounted and centred; call unmount first",
        ReferenceState.REFERENCE_LOST: _LOST_MESSAGE,
    },
    "centre": {
        ReferenceState.UNREFERENCED: "the rod's position is not referenced; home it, then mount a specimen",
        ReferenceState.HOMED: "no specimen is mounted; mount it first",
        ReferenceState.MOUNTED: ReferenceState.CENTRED,
        ReferenceState.CENTRED: ReferenceState.CENTRED,
        ReferenceState.REFERENCE_LOST: _LOST_MESSAGE,
    },
    "unmount": {
        ReferenceState.UNREFERENCED: ReferenceState.UNREFERENCED,
        ReferenceState.HOMED: ReferenceState.HOMED,
        ReferenceState.MOUNTED: ReferenceState.HOMED,
        ReferenceState.CENTRED: ReferenceState.HOMED,
        ReferenceState.REFERENCE_LOST: ReferenceState.UNREFERENCED,
    },
}


def apply_transition(state: ReferenceState, step: str) -> ReferenceState:
    """Return the reference state after one of home, mount, centre, unmount.

    Raises:
        RefusedError: the step is not allowed in this state.
    """
    after = _TRANSITIONS[step][state]
    if isinstance(after, str):
        raise RefusedError(f"actuator: cannot {step} while {state.value.replace('_', ' ')}: {after}")
    return after


def find_initial_state(clamped: bool, referenced: bool) -> ReferenceState:
    """Return the reference state of a drive that has just been connected."""
    if clamped:
        return ReferenceState.MOUNTED if referenced else ReferenceState.REFERENCE_LOST
    return ReferenceState.HOMED if referenced else ReferenceState.UNREFERENCED


def check_referenced(state: ReferenceState, name: str) -> None:
    """Check that positions are referenced, before the actuator ``name`` moves.

    Raises:
        RefusedError: they are not; with the steps that lead to a reference.
    """
    if state in (ReferenceState.UNREFERENCED, ReferenceState.REFERENCE_LOST):
        action = "home it" if state is ReferenceState.UNREFERENCED else "unclamp the specimen, unmount and home"
        raise RefusedError(f"{name}: the rod's position is not referenced; {action} first")
