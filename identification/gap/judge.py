"""What a model leaves of the force, on the strokes that its fit saw and on those kept out of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.arrays import Array, BoolArray
from identification.assemble import Assembled
from identification.gap.held_out import Again, Judged, Shrinkage, held_out_cycles, shrinkage
from identification.gap.residual import Cycles, by_piece, cut_cycles
from identification.gap.stumbles import left_out
from identification.gap.where import Left
from identification.piece import Piece
from identification.prediction import rmse

_MOVED = 0.1
"""[1] of the half stroke that the damper has to move before its force is looked at."""


@dataclass(frozen=True)
class Judge:
    """The recordings, cut into cycles that are fitted and cycles that are not."""

    pieces: tuple[Piece, ...]
    """With all samples that may be fitted or judged marked."""
    cycles: Cycles
    held: BoolArray
    """(cycles,) kept out of every fit."""
    start: Array
    """(N,) [s] of each sample since the first."""
    recorded: BoolArray
    """(N,) measured at all: a prediction is judged there, first instants and ends as well."""
    notes: tuple[str, ...] = ()
    """What was left out of the recordings, in words."""

    @staticmethod
    def of(assembled: Assembled) -> "Judge":
        """The judge of some recordings."""
        cycles = cut_cycles(assembled.stretches, assembled.pieces)
        first = assembled.stretches[0].time[0]
        time = np.concatenate([s.time - first for s in assembled.stretches])
        sound, notes = left_out(assembled.pieces, cycles)
        pieces = tuple(map(_once_moved, sound))
        recorded = np.concatenate([s.counts for s in assembled.stretches])
        return Judge(pieces, cycles, held_out_cycles(cycles), time, recorded, tuple(notes))

    @cached_property
    def usable(self) -> BoolArray:
        """(N,) samples that are fitted or judged."""
        return np.concatenate([p.train for p in self.pieces]) > 0

    @cached_property
    def unseen(self) -> BoolArray:
        """(N,) samples kept out of every fit."""
        return np.asarray(self.usable & (self.cycles.cycle >= 0) & self.held[self.cycles.cycle])

    @cached_property
    def seen(self) -> BoolArray:
        """(N,) samples that are fitted."""
        return np.asarray(self.usable & ~self.unseen)

    @cached_property
    def force(self) -> Array:
        """(N,) recorded force [N]."""
        return np.concatenate([p.force for p in self.pieces])

    def masks(self) -> list[Array]:
        """(N,) of each piece: 1.0 where a sample is fitted."""
        return [part.astype(float) for part in by_piece(self.seen, self.pieces)]

    def fitted_pieces(self) -> tuple[Piece, ...]:
        """The pieces with what is kept out of every fit unmarked."""
        return tuple(replace(p, train=m) for p, m in zip(self.pieces, self.masks(), strict=True))

    def left(self, forces: Sequence[Array]) -> Left:
        """What simulated forces, (N,) of each piece, leave."""
        simulated = np.concatenate(forces)
        return Left(
            self.force - simulated,
            simulated,
            np.concatenate([p.stroke.drive for p in self.pieces]),
            self.start,
            self.usable,
            tuple((len(p.force), p.stroke.rate) for p in self.pieces),
        )

    def rmse(self, left: Left) -> tuple[float, float]:
        """RMSE [N] on seen and on unseen strokes."""
        return rmse(left.residual[self.seen]), rmse(left.residual[self.unseen])

    def shrunk(self, before: Left, after: Left, noise: float, carried: Array) -> Shrinkage:
        """How far the gap is to shrink on another run.

        Args:
            before, after: what the law leaves without and with effects.
            noise: of the recorded force [N].
            carried: (runs, N) squared change [N²] of the force simulated with effects, as the noise of the motion
                of other runs makes it.
        """
        judged = self._judged(before, after)
        again = Again(
            float(carried[:, self.usable].mean()),
            float(carried[:, self.unseen].mean()),
            carried[:, self.recorded].mean(axis=1),
            float(np.mean(before.residual[self.recorded] ** 2)),
        )
        return shrinkage(judged, noise, again, self.cycles.strokes)

    def _judged(self, before: Left, after: Left) -> Judged:
        """The cycles that have samples to judge."""
        sums = [self.cycles.sums(left.residual**2, self.usable) for left in (before, after)]
        counts = self.cycles.sums(np.ones(len(self.force)), self.usable)
        there = counts > 0
        return Judged(sums[0][there], sums[1][there], counts[there], self.cycles.segment[there], self.held[there])


def _once_moved(piece: Piece) -> Piece:
    """The piece without its first instants: what the hysteresis held before nobody has recorded."""
    x = piece.stroke.displacement
    away = np.abs(x - x[0]) > _MOVED * 0.5 * np.ptp(x)
    count = int(np.argmax(away)) if away.any() else 0
    return replace(piece, train=np.where(np.arange(len(x)) < count, 0.0, piece.train))
