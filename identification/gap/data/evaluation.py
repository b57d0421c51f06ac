"""Residual of a model on the fitted samples and on the held-out cycles."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.arrays import Array, BoolArray
from identification.fitting import Dataset, Piece, compute_rmse
from identification.gap.data.cycles import Cycles, cut_cycles, select_held_out_cycles, split_by_piece
from identification.gap.data.disturbed_cycles import mask_disturbed_cycles
from identification.gap.data.residual_map import Residual
from identification.gap.data.shrinkage import (
    CycleErrors,
    HeldOutErrors,
    Replicates,
    Shrinkage,
    estimate_shares,
    estimate_shrinkage,
)

_FIRST_MOTION = 0.1
"""Displacement relative to half the stroke, before which samples are not used: their hysteresis is unknown."""


@dataclass(frozen=True)
class EvaluationData:
    """Recordings cut into cycles, with masks of the fitted and the held-out samples.

    N counts the samples of all pieces in sequence.
    """

    pieces: tuple[Piece, ...]
    """With all usable samples marked for the fit, held-out ones included."""
    cycles: Cycles
    held_out_cycles: BoolArray
    """(cycles,) True where a cycle is kept out of every fit."""
    time: Array
    """(N,) time since the first sample [s]."""
    recorded: BoolArray
    """(N,) True where the force was measured, including starts and ends. Predictions are compared there."""
    notes: tuple[str, ...] = ()
    """Messages about excluded parts of the recordings."""

    @staticmethod
    def make(dataset: Dataset) -> "EvaluationData":
        """Cut recordings into cycles and choose the held-out ones."""
        cycles = cut_cycles(dataset.stretches, dataset.pieces)
        first = dataset.stretches[0].time[0]
        time = np.concatenate([s.time - first for s in dataset.stretches])
        undisturbed, notes = mask_disturbed_cycles(dataset.pieces, cycles)
        pieces = tuple(map(_mask_before_motion, undisturbed))
        recorded = np.concatenate(
            [s.valid_mask & ~held_out for s, held_out in zip(dataset.stretches, dataset.held_out, strict=True)]
        )
        usable = np.concatenate([p.train for p in pieces]) > 0
        held_out_cycles = select_held_out_cycles(cycles, cycles.sum_by_cycle(usable.astype(float), usable) > 0)
        return EvaluationData(pieces, cycles, held_out_cycles, time, recorded, tuple(notes))

    @cached_property
    def usable(self) -> BoolArray:
        """(N,) True where a sample is fitted or held out."""
        return np.concatenate([p.train for p in self.pieces]) > 0

    @cached_property
    def held_out_samples(self) -> BoolArray:
        """(N,) True where a sample is kept out of every fit."""
        return np.asarray(self.usable & (self.cycles.cycle >= 0) & self.held_out_cycles[self.cycles.cycle])

    @cached_property
    def fitted_samples(self) -> BoolArray:
        """(N,) True where a sample is fitted."""
        return np.asarray(self.usable & ~self.held_out_samples)

    @cached_property
    def force(self) -> Array:
        """(N,) recorded force [N]."""
        return np.concatenate([p.force for p in self.pieces])

    @cached_property
    def drive(self) -> Array:
        """(N,) drive [V or A]."""
        return np.concatenate([p.excitation.sampled_drive for p in self.pieces])

    def make_fit_masks(self) -> list[Array]:
        """Return a mask (N,) for each piece: 1.0 where a sample is fitted."""
        return [part.astype(float) for part in split_by_piece(self.fitted_samples, self.pieces)]

    def select_fitted_pieces(self) -> tuple[Piece, ...]:
        """Return the pieces with only the fitted samples marked."""
        return tuple(replace(p, train=m) for p, m in zip(self.pieces, self.make_fit_masks(), strict=True))

    def compute_residual(self, forces: Sequence[Array]) -> Residual:
        """Compute the residual of simulated forces [N], (N,) for each piece."""
        simulated = np.concatenate(forces)
        return Residual(
            self.force - simulated,
            simulated,
            np.concatenate([p.excitation.drive for p in self.pieces]),
            self.time,
            self.usable,
            tuple((len(p.force), p.excitation.rate) for p in self.pieces),
        )

    def compute_rmse(self, residual: Residual) -> tuple[float, float]:
        """Return the RMSE [N] on the fitted and on the held-out samples."""
        values = residual.values
        return compute_rmse(values[self.fitted_samples]), compute_rmse(values[self.held_out_samples])

    def estimate_shrinkage(
        self, before: Residual, after: Residual, noise: float, input_noise_squares: Array, chance: float = 0.0
    ) -> Shrinkage:
        """Estimate how far the gap shrinks on another run.

        Args:
            before, after: residuals of the law without and with effects.
            noise: standard deviation of the noise in the recorded force [N].
            input_noise_squares: (runs, N) squared change [N²] of the force simulated with effects, for the input
                noise of other runs.
            chance: excess of the held-out mean square over that of the noise which sampling can produce [N²].
        """
        errors = self._compute_cycle_errors(before, after)
        replicates = Replicates(
            float(input_noise_squares[:, self.usable].mean()),
            float(input_noise_squares[:, self.held_out_samples].mean()),
            input_noise_squares[:, self.recorded].mean(axis=1),
            float(np.mean(before.values[self.recorded] ** 2)),
        )
        return estimate_shrinkage(errors, noise, replicates, self.cycles.stroke_count, chance)

    def estimate_shares(
        self, before: Residual, after: Residual, without: Mapping[str, Residual], expected: float, noise: float
    ) -> dict[str, tuple[float, tuple[float, float]]]:
        """Estimate the share of each named effect in the gap on held-out samples, with its 95 % interval.

        Args:
            before, after: residuals of the law without and with all named effects.
            without: residuals without one of them, by its name.
            expected: RMSE with all of them that is expected of another run [N].
            noise: standard deviation of the noise in the recorded force [N].
        """
        counts = self.cycles.sum_by_cycle(np.ones(len(self.force)), self.held_out_samples)
        used = counts > 0

        def sum_squares(residual: Residual) -> Array:
            return self.cycles.sum_by_cycle(residual.values**2, self.held_out_samples)[used]

        errors = HeldOutErrors(
            sum_squares(before),
            sum_squares(after),
            {name: sum_squares(residual) for name, residual in without.items()},
            counts[used],
            self.cycles.segment[used],
        )
        return estimate_shares(errors, expected, noise)

    def _compute_cycle_errors(self, before: Residual, after: Residual) -> CycleErrors:
        """Compute the errors of all cycles with usable samples."""
        sums = [self.cycles.sum_by_cycle(residual.values**2, self.usable) for residual in (before, after)]
        counts = self.cycles.sum_by_cycle(np.ones(len(self.force)), self.usable)
        used = counts > 0
        return CycleErrors(
            sums[0][used], sums[1][used], counts[used], self.cycles.segment[used], self.held_out_cycles[used]
        )


def _mask_before_motion(piece: Piece) -> Piece:
    """Exclude the samples before the first motion; the initial state of the hysteresis was not recorded."""
    x = piece.excitation.displacement
    moved = np.abs(x - x[0]) > _FIRST_MOTION * 0.5 * np.ptp(x)
    count = int(np.argmax(moved)) if moved.any() else 0
    return replace(piece, train=np.where(np.arange(len(x)) < count, 0.0, piece.train))
