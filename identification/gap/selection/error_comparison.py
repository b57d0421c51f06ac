"""Comparison of the errors of two fits by block evidence, behind the filter that shows the first error best.

Block evidence compares mean squares, so an error counts by its size over all noise. In slow noise, a filter that
makes the noise white shows a faster error that is certain. It hides an error as slow as the noise, because the
squares then contain mostly fast noise. The error of the first fit decides between the filtered and the recorded
residual.
"""

from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import BoolArray
from identification.gap.data import Residual
from identification.gap.fits import Candidate
from identification.gap.noise import NoiseModel
from identification.gap.selection.block_evidence import bound_evidence, compute_evidence
from identification.noise import WhiteningFilter


@dataclass(frozen=True)
class ErrorComparison:
    """Comparison of two fits to the same recording."""

    noise_model: NoiseModel
    held_out: BoolArray
    """Mask (N,) of the held-out samples."""
    block_length: float
    """Length of a block of the block evidence [s]."""

    def compute_evidence(self, before: Candidate, after: Candidate) -> float:
        """Compute the block evidence for one candidate over another on all samples."""
        chosen = self.choose_filter(before)
        first, second = (c.residual.whiten(chosen) for c in (before, after))
        return compute_evidence(first, second, self.block_length)

    def compute_held_out_evidence(self, before: Candidate, after: Candidate) -> float:
        """Compute the block evidence for one candidate over another on the held-out samples."""
        chosen = self.choose_filter(before)
        first, second = (self.select_held_out(c.residual.whiten(chosen)) for c in (before, after))
        return compute_evidence(first, second, self.block_length)

    def bound_evidence(self, candidate: Candidate) -> float:
        """Compute the block evidence for a candidate at the noise floor over a known one."""
        chosen = self.choose_filter(candidate)
        return bound_evidence(candidate.residual.whiten(chosen), self._find_floor(chosen), self.block_length)

    def choose_filter(self, candidate: Candidate) -> WhiteningFilter:
        """Return the filter behind which the residual of a candidate is largest over the noise."""
        recorded = WhiteningFilter(np.ones(1), self.noise_model.noise)
        return max(self.noise_model.estimate.whitening, recorded, key=lambda f: self._compute_ratio(candidate, f))

    def select_held_out(self, residual: Residual) -> Residual:
        """Return a residual on the held-out samples."""
        return replace(residual, valid=residual.valid & self.held_out)

    def _compute_ratio(self, candidate: Candidate, chosen: WhiteningFilter) -> float:
        """Return the mean square of a filtered residual over that of the noise [1]."""
        residual = candidate.residual.whiten(chosen)
        return float(np.mean(residual.values[residual.valid] ** 2)) / self._find_floor(chosen) ** 2

    def _find_floor(self, chosen: WhiteningFilter) -> float:
        """Return the noise behind a filter [N], with the propagated noise of the displacement."""
        return float(np.hypot(chosen.deviation, self.noise_model.input_noise or 0.0))
