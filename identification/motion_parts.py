"""Which parts of a stretch move alike: repeating strokes, the joints between them, what lies between, stumbles.

A rod stumbles where it leaves the wave that it repeats for some hundredths of a second: a setpoint came late, or
something knocked. Such a place is smoothed by itself, or its haste would let the noise into the whole segment. Far
off the wave its samples are lost: between two of them nobody knows where the rod was, and a force that is steep
over some micrometres cannot be simulated there.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation

from identification.arrays import Array, BoolArray
from identification.drive import drive_steps
from identification.harmonics import Harmonics
from identification.recordings import Stretch

Indices = npt.NDArray[np.intp]

_JOINT = 0.03
"""[s] Around the ends of what is known of the motion, and around stumbles, transients are left room."""
MOST_GIVE = 0.03
"""[1] of the stroke's deviation: an actuator that gave way more would not be one."""
_FAR_OFF = 0.004
"""[1] of the stroke's deviation by which a stumble leaves the wave at least where its samples are lost."""


class Parts(NamedTuple):
    """How a stretch is divided, (N,) each."""

    regions: Indices
    """What a sample belongs to: 0 a joint, then each repeating part, each part between, each stumble."""
    stumbled: BoolArray
    """True where the rod stumbled."""
    lost: BoolArray
    """True where a stumble went so far that nobody knows how the rod moved from sample to sample."""


def divide(stretch: Stretch, waves: list[Harmonics], gives: bool) -> Parts:
    """The parts of a stretch.

    Args:
        stretch: the recording.
        waves: its repeating parts.
        gives: whether its actuator gives way under the load, which it also does where the stretch begins and ends.
    """
    count, reach = len(stretch.time), _reach(stretch)
    edges = {edge for wave in waves for edge in (wave.start, wave.stop)} - {0, count}
    joints = _around(edges | ({0, count} if gives else set()), count, reach)
    off = np.zeros(count)
    for wave in waves:
        off[wave.start : wave.stop] = wave.off
    found = stumbles(stretch, off)
    stumbled = marked(found, count)
    far = stumbled & (off > _FAR_OFF * _size(stretch))
    return Parts(_regions(waves, joints, found), stumbled, _widened(far, reach))


def stumbles(stretch: Stretch, off: Array) -> list[Indices]:
    """The samples of every stumble; what begins where drive or stroke change is the actuator's answer to that.

    Args:
        stretch: the recording.
        off: (N,) by how much the rod leaves its wave where it stumbles [m]; 0 elsewhere.
    """
    if not off.any():
        return []
    reach = _reach(stretch)
    seams = {s.start for s in stretch.segments} & {s.stop for s in stretch.segments}
    steps = _around(seams | set(drive_steps(stretch.drive).tolist()), len(off), reach)
    runs = _unbroken(_widened(off > 0.0, reach))
    # The runs were widened: a stumble itself begins a reach later.
    begins = [min(run[0] + reach, len(off) - 1) for run in runs]
    most = MOST_GIVE * _size(stretch)
    return [run for run, at in zip(runs, begins, strict=True) if not steps[at] or off[run].max() > most]


def _reach(stretch: Stretch) -> int:
    return int(_JOINT * stretch.rate) + 1


def _size(stretch: Stretch) -> float:
    return float(np.std(stretch.displacement)) or 1.0


def _around(edges: set[int], count: int, reach: int) -> BoolArray:
    """(count,) True around some edges."""
    found = np.zeros(count, bool)
    for edge in edges:
        found[max(edge - reach, 0) : edge + reach] = True
    return found


def _regions(waves: list[Harmonics], joints: BoolArray, stumbled: list[Indices]) -> Indices:
    """(N,) what each sample belongs to: 0 a joint, 1 and on a wave, then what lies between, then stumbles."""
    # In this order: a joint cuts into the wave beside it, a stumble into both.
    regions = np.full(len(joints), -1)
    for k, wave in enumerate(waves):
        regions[wave.start : wave.stop] = 1 + k
    regions[joints] = 0
    for k, run in enumerate([*_unbroken(regions < 0), *stumbled], 1 + len(waves)):
        regions[run] = k
    return regions


def marked(runs: list[Indices], count: int) -> BoolArray:
    """(count,) True at the samples of some runs."""
    found = np.zeros(count, bool)
    for run in runs:
        found[run] = True
    return found


def _widened(mask: BoolArray, reach: int) -> BoolArray:
    """The mask (N,) and so many samples on either side."""
    return np.asarray(binary_dilation(mask, iterations=reach)) if mask.any() else mask


def _unbroken(mask: BoolArray) -> list[Indices]:
    """The runs of places where a mask (N,) is True."""
    places = np.flatnonzero(mask)
    return np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if len(places) else []
