"""Order of the unknowns of a fit.

The search coordinates of the law come first, then the two delays and y(0) of each piece. The effects' search
coordinates follow, then the per-log parameters of each log after the first.
"""

from dataclasses import dataclass
from typing import ClassVar

from identification.damper import Coordinates

COORDINATE_COUNT = len(Coordinates._fields)
COMMON_COUNT = COORDINATE_COUNT + 2
"""Number of unknowns that come first and that all pieces share: the search coordinates and the two delays."""


@dataclass(frozen=True)
class UnknownLayout:
    """Slices and columns of the unknowns."""

    piece_count: int
    effect_sizes: tuple[int, ...]
    """Number of parameters of each effect."""
    log_size: int
    """Number of per-log parameters of each log after the first."""
    further_logs: int
    """Number of logs after the first."""

    coordinates: ClassVar[slice] = slice(0, COORDINATE_COUNT)
    delays: ClassVar[slice] = slice(COORDINATE_COUNT, COMMON_COUNT)

    @property
    def y0(self) -> slice:
        """Inner displacements at the start of each piece."""
        return slice(COMMON_COUNT, COMMON_COUNT + self.piece_count)

    @property
    def effects(self) -> slice:
        """Search coordinates of all effects."""
        return slice(self.y0.stop, self.y0.stop + self.effect_count)

    @property
    def per_log(self) -> slice:
        """Per-log parameters of all logs."""
        return slice(self.effects.stop, self.effects.stop + self.per_log_count)

    @property
    def effect_count(self) -> int:
        """Number of parameters of all effects."""
        return sum(self.effect_sizes)

    @property
    def per_log_count(self) -> int:
        """Number of per-log parameters of all logs."""
        return self.log_size * self.further_logs

    @property
    def size(self) -> int:
        """Number of unknowns U."""
        return COMMON_COUNT + self.piece_count + self.effect_count + self.per_log_count

    @property
    def effect_slices(self) -> list[slice]:
        """Search coordinates of each effect."""
        ends = [self.effects.start + sum(self.effect_sizes[: k + 1]) for k in range(len(self.effect_sizes))]
        return [slice(end - size, end) for end, size in zip(ends, self.effect_sizes, strict=True)]

    @property
    def shared_columns(self) -> list[int]:
        """(C,) indices of the unknowns that no piece has alone: all but y(0)."""
        return [*range(COMMON_COUNT), *range(self.effects.start, self.size)]

    def find_log_columns(self, log: int) -> list[int]:
        """Return the indices of the per-log parameters of a log; the first log, 0, has none."""
        start = self.per_log.start + (log - 1) * self.log_size
        return list(range(start, start + self.log_size)) if log > 0 else []

    def find_piece_columns(self, piece: int, log: int) -> list[int]:
        """Return the indices of the unknowns of a piece: common ones, its y(0), effects, per-log parameters."""
        effects = range(self.effects.start, self.effects.stop)
        return [*range(COMMON_COUNT), self.y0.start + piece, *effects, *self.find_log_columns(log)]
