"""Training pieces: pieces of a recording with motion and field at any time, and batches of their elements."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.arrays import Array
from identification.fitting import LowPass, Piece, Problem, compute_filter_delay
from identification.pinn.common.inputs import PieceInputs
from identification.pinn.common.states import Indices, TimeSpan

_RESPONSE_TAIL = 1e-7
"""Amplitude [1] below which the tail of an impulse response is cut off."""


@dataclass(frozen=True)
class TrainingPiece:
    """One piece as the network is trained on it."""

    number: int
    """Index of the piece in the problem."""
    piece: Piece
    inputs: PieceInputs
    span: TimeSpan
    decimation: int
    """Distance of the samples that enter the training [samples]."""

    @cached_property
    def impulse_response(self) -> Array:
        """Impulse response of the force channel on its fine grid, newest sample first; one 1 without a filter."""
        if self.piece.low_pass is None:
            return np.ones(1)
        reported, rate = self.piece.low_pass.channel_filter, self.piece.low_pass.rate * self.oversampling
        impulse = np.zeros(round(rate))
        impulse[1] = 1.0
        response = LowPass(reported, rate).apply(impulse)[1:]
        kept = response[: int(np.flatnonzero(np.abs(response) > _RESPONSE_TAIL)[-1]) + 1]
        return np.asarray(kept / kept.sum())

    @property
    def lag(self) -> float:
        """Delay [s] of slow signals in the filter."""
        return (
            float(self.impulse_response @ np.arange(len(self.impulse_response)))
            * self.inputs.h
            / self.oversampling
        )

    @property
    def oversampling(self) -> int:
        """Points of the fine grid for each sample."""
        return self.piece.low_pass.oversampling if self.piece.low_pass else 1

    @property
    def stride(self) -> int:
        """Points of the fine grid between two samples of the training."""
        return self.oversampling * self.decimation

    @property
    def sample_times(self) -> Array:
        """Times (N,) [s] of the motion behind each recorded force, for the force channel's reported delay."""
        return np.asarray(np.arange(len(self.piece.force)) * self.inputs.h - self.piece.force_delay)


def make_training_pieces(problem: Problem, *, decimation: int = 1) -> list[TrainingPiece]:
    """Return the pieces of a problem, each from its first to its last fitted sample."""
    return [_make_training_piece(number, piece, decimation) for number, piece in enumerate(problem.pieces)]


def _make_training_piece(number: int, piece: Piece, decimation: int) -> TrainingPiece:
    inputs = PieceInputs(piece)
    fitted = np.flatnonzero(piece.train) * inputs.h - piece.force_delay
    span = TimeSpan(max(float(fitted[0]), 0.0), min(float(fitted[-1]), inputs.duration))
    return TrainingPiece(number, piece, inputs, span, decimation)


@dataclass(frozen=True)
class Batch:
    """Some elements of one piece: K elements with M Gauss points and S samples each."""

    source: TrainingPiece
    elements: Indices
    """Numbers of the elements (K,)."""
    left_node: Indices
    """Numbers of their left nodes (K,)."""
    time: Array
    """Times of the Gauss points (K, M) [s]."""
    basis: Array
    """Basis functions at the Gauss points (M, rank), the same in all elements."""
    basis_rates: Array
    """Time derivatives of the basis functions (K, M, rank) [1/s]."""
    test_functions: Array
    """Test functions (M, rank), weighted by the quadrature.

    Orthonormal combinations of the basis functions' derivatives and, last, of the basis functions themselves.
    """
    weighted_tests: Array
    """Test functions with the weight of each (M, rank); the last one counts little. (M, M) for collocation."""
    point_weights: Array
    """Root of the number of samples that each Gauss point represents (K, M)."""
    slip_velocity: Array
    """Slip velocity (K,) [m/s] that scales hysteresis residuals."""
    motion: tuple[Array, Array]
    """Displacement [m] and velocity [m/s] (K, M); the velocity is that of the residual weighting."""
    samples: Indices
    """Indices of the samples in the recording (K, S)."""
    sample_time: Array
    """Time of the motion behind each recorded force (K, S) [s]."""
    sample_basis_rates: Array
    """Time derivatives of the basis functions (K, S, rank) [1/s], filtered as the force."""
    sample_basis_curvatures: Array
    """Second time derivatives of the basis functions (K, S, rank) [1/s²], filtered as the force."""
    filter_memory: Array
    """Contribution of earlier elements to the filtered inner velocity (K, S) [m/s]."""
    sample_motion: tuple[Array, Array]
    """Displacement [m] and velocity [m/s] at the samples (K, S)."""
    force: Array
    """Recorded force (K, S) [N]."""
    sample_weights: Array
    """Weight of each sample (K, S) [1]; 0 where it is not fitted."""


def approximate_filters(problem: Problem) -> Problem:
    """Return the problem with the filter of each force channel replaced by its delay."""

    def replace_filter(piece: Piece) -> Piece:
        if piece.low_pass is None:
            return piece
        lag = compute_filter_delay(piece.low_pass.channel_filter)
        return replace(piece, low_pass=None, force_delay=piece.force_delay + lag)

    return replace(problem, pieces=tuple(replace_filter(p) for p in problem.pieces))
