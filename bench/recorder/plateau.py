"""Finds the stretches of constant drive in a drive that was commanded or measured.

The drive is looked at in blocks of some ten milliseconds: a block's median shrugs off noise and spikes. Blocks
that agree make a plateau.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_BLOCK = 0.01
"""[s] of drive behind one median."""

NEGLIGIBLE = 0.005
"""[V or A] difference of drive that is none."""


@dataclass(frozen=True)
class Plateau:
    """A stretch of constant drive."""

    start: int
    stop: int
    level: float
    """[V or A]"""

    def within(self, start: int, stop: int) -> "Plateau":
        """The part of it between two samples; empty where they do not meet."""
        first = min(max(self.start, start), stop)
        return Plateau(first, max(first, min(self.stop, stop)), self.level)

    def __len__(self) -> int:
        return self.stop - self.start


def find_plateaus(drive: Array, rate: float) -> tuple[list[Plateau], float]:
    """The plateaus of a drive, one after the other without gaps, and what counts as equal.

    Args:
        drive: [V or A], shape (samples,).
        rate: [Hz].

    Returns:
        The plateaus, many of them short where the drive varies, and the tolerance [V or A].
    """
    size = max(9, round(_BLOCK * rate))
    starts = np.arange(0, max(1, len(drive) - size + 1), size)
    stops = np.append(starts[1:], len(drive))
    medians = [float(np.median(drive[start:stop])) for start, stop in zip(starts, stops, strict=True)]
    tolerance = _tolerance(np.array(medians))
    plateaus: list[Plateau] = []
    for start, stop, median in zip(starts.tolist(), stops.tolist(), medians, strict=True):
        if plateaus and abs(median - plateaus[-1].level) <= tolerance:
            last = plateaus.pop()
            share = (stop - start) / (stop - last.start)  # the running mean of all its blocks
            plateaus.append(Plateau(last.start, stop, last.level + share * (median - last.level)))
        else:
            plateaus.append(Plateau(start, stop, median))
    return [Plateau(p.start, p.stop, float(np.median(drive[p.start : p.stop]))) for p in plateaus], tolerance


def _tolerance(medians: Array) -> float:
    """Four deviations from block to block, but within 2 to 4 % of the largest drive."""
    steps = np.abs(np.diff(medians)) if len(medians) > 1 else np.zeros(1)
    # A difference of two blocks has twice the variance of one.
    noise = 1.4826 * float(np.median(steps)) / np.sqrt(2)
    largest = float(np.max(np.abs(medians)))
    return max(NEGLIGIBLE, float(np.clip(4 * noise, 0.02 * largest, 0.04 * largest)))


def edge(drive: Array, left: Plateau, right: Plateau) -> int:
    """The first sample that belongs to the right one of two plateaus: where the drive is halfway."""
    halfway = (left.level + right.level) / 2
    first = max(left.start, left.stop - (left.stop - left.start) // 2)
    last = min(right.stop, right.start + (right.stop - right.start + 1) // 2 + 1)
    part = drive[first:last]
    beyond = part >= halfway if right.level > left.level else part <= halfway
    runs = np.flatnonzero(~beyond)
    return first + int(runs[-1]) + 1 if len(runs) else first
