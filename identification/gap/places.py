"""What a further effect explains, place by place.

The right effect in another form than the damper's leaves something, in some places of a recording much and in
others little. In the sum of squares the large places hide what a second effect does in all the others. So each
place, some tenths of a second, has a size of its own for what is left there, and the likelihood of a place is that
of a normal error of unknown size: an effect that is at work takes a part away wherever it acts, while one that
only takes up another's error of form trades one place for another.
"""

import math

import numpy as np

from identification.arrays import Array
from identification.gap.where import Left

_PLACE = 0.4
"""[s] length of a place: less than a stroke, more than a field takes to settle."""
_COUNTS = 1.6
"""[1] independent samples that a place stands for; chosen between what a true effect and another's kin brought."""
_HALF = 0.5
"""[1] part of a place that has to be valid."""


def evidence(before: Left, after: Left) -> float:
    """Natural logarithm of the odds that places give to what leaves ``after`` over what leaves ``before``."""
    return 0.5 * _COUNTS * float(np.sum(np.log(_squares(before) / _squares(after))))


def most(left: Left, floor: float) -> float:
    """The same for something that would lead to the floor [N] wherever more is left."""
    return 0.5 * _COUNTS * float(np.sum(np.log(np.maximum(_squares(left) / floor**2, 1.0))))


def _squares(left: Left) -> Array:
    """(places,) mean squared residual [N²]."""
    found, start = [], 0
    for count, rate in left.rates:
        size = max(math.ceil(_PLACE * rate), 1)
        part = slice(start, start + count // size * size)
        valid = left.valid[part].reshape(-1, size)
        sums = np.sum(np.where(valid, left.residual[part].reshape(-1, size) ** 2, 0.0), axis=1)
        there = valid.sum(axis=1)
        found.append(sums[there > _HALF * size] / there[there > _HALF * size])
        start += count
    return np.concatenate(found)
