"""Checks of a recording before its diagnosis, and effects that its strokes cannot show."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from identification.errors import UnusableDataError
from identification.fitting import Piece
from identification.gap.data.cycles import Cycles
from identification.noise import NoiseFloorEstimate

_FEWEST_CYCLES = 4
"""Smallest number of cycles, or of seconds where nothing repeats: with fewer, nothing can be held out."""
_SLIDING_SPEED = 0.5
"""Speed relative to the largest speed of a stroke: above it, a damper slides."""
_SPEED_QUANTILE = 0.99
"""Quantile of the speed that counts as the largest; a shock is faster than any stroke."""


def check_sliding_recorded(pieces: Sequence[Piece]) -> None:
    """Check that valid force was recorded while the damper slid.

    Raises:
        UnusableDataError: all valid samples are slow.
    """
    speeds = [np.abs(p.excitation.velocity) for p in pieces]
    limits = [_SLIDING_SPEED * float(np.quantile(v, _SPEED_QUANTILE)) for v in speeds]
    measured = zip(speeds, limits, pieces, strict=True)
    if not any(((v > limit) & (p.train > 0)).any() for v, limit, p in measured):
        raise UnusableDataError(
            f"no valid force was recorded above {max(limits):.2g} m/s (clipped or not measured), so the damping "
            "force at speed cannot be identified; record again with a larger range of the load cell"
        )


def check_cycle_count(cycles: Cycles) -> None:
    """Check that there are enough cycles to hold some out.

    Raises:
        UnusableDataError: fewer than four cycles.
    """
    if cycles.count < _FEWEST_CYCLES:
        raise UnusableDataError(
            f"the recording contains {cycles.count} cycle{'s' if cycles.count != 1 else ''} of the stroke; a "
            f"diagnosis needs at least {_FEWEST_CYCLES} to hold some out of its fits; record longer"
        )


def describe_unobservable_effects(cycles: Cycles, floor: NoiseFloorEstimate) -> list[str]:
    """Return notes about effects that these strokes cannot show or separate."""
    notes = []
    drives = {_round(c.drive) for c in cycles.conditions}
    frequencies = {_round(c.frequency) for c in cycles.conditions if c.frequency}
    amplitudes = {_round(c.amplitude) for c in cycles.conditions}
    if len(drives) == 1:
        notes.append("only one drive: effects of the coil cannot be observed")
    if _has_each_drive_once(cycles):
        notes.append("each drive in one stretch of time: effects of the coil and a change over time look alike")
    if len(frequencies) == 1:
        notes.append("only one frequency: force delay, moving mass and fixture compliance look alike")
    if len(amplitudes) == 1:
        notes.append("only one amplitude: gas spring, end stop and displacement nonlinearity look alike")
    if floor.cycle_to_cycle is None:
        source = "the" if floor.is_known else "high frequencies only:"
        notes.append(f"the noise floor is estimated from {source} {floor.basis}")
    elif floor.is_known and floor.get_interval(floor.noise)[0] > floor.high_frequency:
        ratio = floor.noise / floor.high_frequency
        notes.append(
            f"the noise floor is {ratio:.2f} times the noise at high frequencies: part of the force does not "
            "repeat; slow noise of the load cell, stick-slip and a loose part of the fixture look alike"
        )
    notes.append("a gain error of the force or displacement channel can only be found by calibration")
    return notes


def _has_each_drive_once(cycles: Cycles) -> bool:
    """Return True if there are several drives and none was returned to."""
    drives = [_round(c.drive) for c in cycles.conditions if c.is_stroke]
    changes = sum(before != after for before, after in pairwise(drives))
    return 0 < changes < len(set(drives))


def _round(value: float) -> float:
    """Round to two significant digits, within which conditions count as equal."""
    return float(f"{value:.2g}")
