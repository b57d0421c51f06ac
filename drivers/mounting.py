"""Whether a specimen is clamped and the rod knows where it is, and what may be done in each case.

A small machine of its own, of which the drive knows nothing: it decides when the rod may seek its home, which with
a specimen clamped would drive it into its ends.
"""

from enum import Enum

from drivers.errors import Refused


class Mounting(Enum):
    """What the rod carries, and whether it knows where it is."""

    UNMOUNTED = "unmounted"
    """No specimen, no reference."""
    HOMED = "homed"
    """No specimen; the position is referenced."""
    MOUNTED = "mounted"
    """A specimen is clamped, its middle not yet found."""
    CENTRED = "centred"
    """Positions count from the middle of the specimen."""
    STRANDED = "stranded"
    """A specimen is clamped and the reference is lost."""


_CLAMPED = "a specimen is clamped, and homing would drive it into its ends; unclamp it and call unmount first"
_STEPS: dict[str, dict[Mounting, Mounting | str]] = {
    "home": {
        Mounting.UNMOUNTED: Mounting.HOMED,
        Mounting.HOMED: Mounting.HOMED,
        Mounting.MOUNTED: _CLAMPED,
        Mounting.CENTRED: _CLAMPED,
        Mounting.STRANDED: _CLAMPED,
    },
    "mount": {
        Mounting.UNMOUNTED: "the rod does not know where it is; home it first",
        Mounting.HOMED: Mounting.MOUNTED,
        Mounting.MOUNTED: Mounting.MOUNTED,
        Mounting.CENTRED: "the specimen is already mounted and centred; call unmount first",
        Mounting.STRANDED: "the reference is lost; unclamp the specimen, call unmount and home first",
    },
    "centre": {
        Mounting.UNMOUNTED: "the rod does not know where it is; home it, then mount a specimen",
        Mounting.HOMED: "no specimen is mounted; mount it first",
        Mounting.MOUNTED: Mounting.CENTRED,
        Mounting.CENTRED: Mounting.CENTRED,
        Mounting.STRANDED: "the reference is lost; unclamp the specimen, call unmount and home first",
    },
    "unmount": {
        Mounting.UNMOUNTED: Mounting.UNMOUNTED,
        Mounting.HOMED: Mounting.HOMED,
        Mounting.MOUNTED: Mounting.HOMED,
        Mounting.CENTRED: Mounting.HOMED,
        Mounting.STRANDED: Mounting.UNMOUNTED,
    },
}


def step(mounting: Mounting, verb: str) -> Mounting:
    """The mounting after one of home, mount, centre, unmount.

    Raises:
        Refused: it may not be done now, with the reason.
    """
    after = _STEPS[verb][mounting]
    if isinstance(after, str):
        raise Refused(f"actuator: cannot {verb} while {mounting.value}: {after}")
    return after


def found(clamped: bool, referenced: bool) -> Mounting:
    """The mounting of a drive that has just been connected."""
    if clamped:
        return Mounting.MOUNTED if referenced else Mounting.STRANDED
    return Mounting.HOMED if referenced else Mounting.UNMOUNTED
