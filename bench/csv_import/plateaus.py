"""Plateaus: intervals of constant drive in a commanded or measured drive.

The medians of windows of about ten milliseconds are hardly affected by noise and spikes. Successive windows with
equal medians form a plateau.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_MEDIAN_WINDOW = 0.01
"""Length [s] of the window of one median."""

NEGLIGIBLE_STEP = 0.005
"""Threshold on a difference of drive [V or A]: below it, the drives count as equal."""


@dataclass(frozen=True)
class Plateau:
    """Interval of constant drive."""

    start: int
    stop: int
    level: float
    """[V or A]"""

    def clip(self, start: int, stop: int) -> "Plateau":
        """Return the part between two samples, which may be empty."""
        first = min(max(self.start, start), stop)
        return Plateau(first, max(first, min(self.stop, stop)), self.level)

    def __len__(self) -> int:
        return self.stop - self.start


def find_plateaus(drive: Array, rate: float) -> tuple[list[Plateau], float]:
    """Find the plateaus of a drive, in order and without gaps.

    Args:
        drive: [V or A], shape (samples,).
        rate: sampling rate [Hz].

    Returns:
        The plateaus, with many short ones where the drive varies, and the tolerance on equal drives [V or A].
    """
    size = max(9, round(_MEDIAN_WINDOW * rate))
    starts = np.arange(0, max(1, len(drive) - size + 1), size)
    stops = np.append(starts[1:], len(drive))
    medians = [float(np.median(drive[start:stop])) for start, stop in zip(starts, stops, strict=True)]
    tolerance = _estimate_tolerance(np.array(medians))
    plateaus = _join_windows(zip(starts.tolist(), stops.tolist(), medians, strict=True), tolerance)
    return [Plateau(p.start, p.stop, float(np.median(drive[p.start : p.stop]))) for p in plateaus], tolerance


def _join_windows(windows: Iterable[tuple[int, int, float]], tolerance: float) -> list[Plateau]:
    """Join successive windows (first sample, end, median) whose medians are equal within a tolerance."""
    plateaus: list[Plateau] = []
    for start, stop, median in windows:
        if plateaus and abs(median - plateaus[-1].level) <= tolerance:
            last = plateaus.pop()
            share = (stop - start) / (stop - last.start)  # weight of the window in the mean of the plateau
            plateaus.append(Plateau(last.start, stop, last.level + share * (median - last.level)))
        else:
            plateaus.append(Plateau(start, stop, median))
    return plateaus


def _estimate_tolerance(medians: Array) -> float:
    """Estimate the tolerance on equal drives: four standard deviations of a median.

    It is limited to 2 to 4 % of the largest drive.
    """
    steps = np.abs(np.diff(medians)) if len(medians) > 1 else np.zeros(1)
    # The difference of two medians has twice the variance of one.
    noise = 1.4826 * float(np.median(steps)) / np.sqrt(2)
    largest = float(np.max(np.abs(medians)))
    return max(NEGLIGIBLE_STEP, float(np.clip(4 * noise, 0.02 * largest, 0.04 * largest)))


def find_edge(drive: Array, left: Plateau, right: Plateau) -> int:
    """Return the first sample of the right one of two plateaus: where the drive passes their mean level."""
    halfway = (left.level + right.level) / 2
    first = max(left.start, left.stop - (left.stop - left.start) // 2)
    last = min(right.stop, right.start + (right.stop - right.start + 1) // 2 + 1)
    part = drive[first:last]
    beyond = part >= halfway if right.level > left.level else part <= halfway
    before = np.flatnonzero(~beyond)
    return first + int(before[-1]) + 1 if len(before) else first
