"""Shunt of the load cell during a run: on for its segments, and off at every end of a run.

The instrument switches the shunt off by itself after a time, which bounds how long a lost wire leaves it on.
"""

import contextlib
from collections.abc import Iterator
from typing import Protocol

from bench.errors import RunError
from bench.methods import Programme
from bench.safety import Action, LimitMatrix, evaluate_limits
from bench.sequencer.playback import PlaybackSection
from drivers import DriverError

MARGIN = 5.0
"""[s] Time by which the shunt may stay on beyond its section.

It contains the start of the section, which may take some attempts, and the delay of a busy machine."""


class ShuntedCell(Protocol):
    """Load cell whose shunt can be switched, such as `drivers.load_cell.LoadCell`."""

    @property
    def name(self) -> str:
        """Name in messages."""

    @property
    def longest_shunt(self) -> float:
        """Longest time for which the shunt can be switched on [s]."""

    def switch_shunt_on(self, duration: float) -> float | None:
        """Switch the shunt on for a time [s]; return the force that it simulates [N], None if not known.

        Raises:
            DriverError: the load cell refuses or does not reply.
        """

    def switch_shunt_off(self) -> float | None:
        """Switch the shunt off, on or not; result and errors are those of `switch_shunt_on`."""


def check_shunt(programme: Programme, cell: ShuntedCell, limits: LimitMatrix) -> None:
    """Check before anything moves that a load cell can play the segments with the shunt; it is off afterwards.

    Args:
        programme: compiled method; without such a segment, nothing is sent.
        cell: connected load cell of the bench.
        limits: limits in force during the run.

    Raises:
        RunError: the load cell has no shunt or allows only a shorter time, or the simulated force alone exceeds a
            limit that ends a run.
    """
    segments = [segment for segment in programme.segments if segment.shunt]
    if not segments:
        return
    where = f"method {programme.method.name}, segment {segments[0].name}"
    try:
        force = cell.switch_shunt_off()
    except DriverError as error:
        raise RunError(f"{where}: the shunt of the load cell cannot be switched: {error}") from None
    longest = max(segment.stop - segment.start for segment in segments) / programme.rate
    if longest + MARGIN > cell.longest_shunt:
        raise RunError(
            f"{where}: the shunt is needed for {longest:g} s, but {cell.name} allows "
            f"{cell.longest_shunt - MARGIN:g} s, with {MARGIN:g} s in reserve; shorten the segment"
        )
    violation = None if force is None else evaluate_limits(limits, "force", force)
    if violation is not None and violation.action >= Action.HOLD:
        raise RunError(
            f"{where}: the shunt of {cell.name} simulates too much: {violation}; raise the limit if cell and "
            "damper allow it, or use a shunt of higher resistance"
        )


@contextlib.contextmanager
def use_shunt(cell: ShuntedCell | None, section: PlaybackSection) -> Iterator[None]:
    """Have the shunt on within the block if the section needs it, and off after it, however the block ends.

    Args:
        cell: connected load cell; None if it cannot switch a shunt.
        section: section that is played within the block.

    Raises:
        RunError: the section needs a shunt, and there is none.
        DriverError: the load cell refuses or does not reply. If it does not reply to the command at the end, the
            shunt switches itself off at the latest `MARGIN` after the planned end of the section.
    """
    if not section.shunt:
        yield
        return
    if cell is None:
        raise RunError(f"method {section.programme.method.name} needs a shunt, but no load cell can switch one")
    try:
        cell.switch_shunt_on(section.duration + MARGIN)
        yield
    except BaseException:
        # Also after a failed command, which may have been executed; the first error is the one to report.
        with contextlib.suppress(DriverError):
            cell.switch_shunt_off()
        raise
    cell.switch_shunt_off()
