"""Counters on the wire: differences of counters that wrap, and samples split at gaps in their numbers."""

from collections.abc import Callable, Hashable, Iterator, Sequence
from itertools import groupby
from typing import Protocol, TypeVar


class _Numbered(Protocol):
    @property
    def number(self) -> int:
        """Running number of the sample."""


_Sample = TypeVar("_Sample", bound=_Numbered)


def compute_step(value: int, last: int, period: int) -> int:
    """Return the step from ``last`` to ``value`` of a counter modulo ``period``, by the shorter way round.

    A step of half a period or more counts as one backwards.
    """
    return (value - last + period // 2) % period - period // 2


def split_at_gaps(
    samples: Sequence[_Sample], get_key: Callable[[_Sample], Hashable] = lambda _: None
) -> Iterator[list[_Sample]]:
    """Yield the longest stretches of samples with consecutive numbers and one key."""
    # Number minus index is constant while no sample is missing.
    for _, group in groupby(enumerate(samples), lambda pair: (pair[1].number - pair[0], get_key(pair[1]))):
        yield [sample for _, sample in group]
