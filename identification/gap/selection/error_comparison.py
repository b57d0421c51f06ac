"""Comparison of the errors of two fits by block evidence, behind the filter that shows the first error best.

Block evidence compares mean squares, so an error counts by its size over all noise. In slow noise, a filter that
makes the noise white shows a faster error that is certain. It hides an error as slow as the noise, because the
squares then contain mostly fast noise. The error of the first fit decides between the filtered and the recorded
residual.

The closed share states instead how much of the error beyond the noise disappears, in the geometric mean over the
conditions. A missing effect removes most of it wherever it acts. An effect that repairs the form of another
removes little: the same form error returns in every block of a condition, and evidence over blocks counts it each
time.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.gap.data import Cycles, Residual, bound_evidence, compute_evidence
from identification.gap.fits import NO_GAP_RATIO, Candidate
from identification.gap.noise import NoiseModel, compute_noise_evidence
from identification.gap.selection.posterior import compute_log_prior
from identification.noise import WhiteningFilter

_CERTAIN_ODDS = 100.0
"""Odds, beyond the prior ones, at which noise of the residual's spectrum cannot be what an effect explains [1]."""


@dataclass(frozen=True)
class ErrorComparison:
    """Comparison of two fits to the same recording."""

    noise_model: NoiseModel
    held_out: BoolArray
    """Mask (N,) of the held-out samples."""
    block_length: float
    """Length of a block of the block evidence [s]."""
    cycles: Cycles
    """Cycles of the recordings, which belong to conditions."""

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

    def expect_held_out_evidence(self, before: Candidate, after: Candidate) -> float:
        """Compute the block evidence on the held-out samples that a right second candidate would have.

        Held-out samples on which the two candidates hardly differ cannot judge between them.
        """
        chosen = self.choose_filter(before)
        first, second = (self.select_held_out(c.residual.whiten(chosen)) for c in (before, after))
        wrong = replace(second, values=np.hypot(second.values, second.values - first.values))
        return compute_evidence(wrong, second, self.block_length)

    def compute_noise_evidence(self, before: Candidate, after: Candidate) -> float:
        """Compute the log likelihood ratio for one candidate over another if the second residual is noise.

        Slow noise makes neighbouring blocks alike, so block evidence counts the same chance several times.
        """
        return compute_noise_evidence(after.residual, before.residual.values - after.residual.values)

    def exceeds_noise(self, before: Candidate, after: Candidate, freedom: int = 0) -> bool:
        """Return True if noise of the second residual's spectrum cannot be what its further effects explain.

        Slow noise makes the interval of the floor wide, because few of its periods were recorded. At the
        frequencies of an effect the noise can be known far better. An effect below the smallest gap does not
        count, however certain it is.

        Args:
            before: a set of effects.
            after: the same with further effects, or another cause.
            freedom: evidence that fitted coefficients bring in noise alone (natural logarithm).
        """
        first, second = (float(np.mean(c.residual.values[c.residual.valid] ** 2)) for c in (before, after))
        if first < NO_GAP_RATIO**2 * second:
            return False
        prior_odds = compute_log_prior(before.names) - compute_log_prior(after.names)
        return self.compute_noise_evidence(before, after) > prior_odds + math.log(_CERTAIN_ODDS) + freedom

    def bound_evidence(self, candidate: Candidate) -> float:
        """Compute the block evidence for a candidate at the noise floor over a known one."""
        chosen = self.choose_filter(candidate)
        return bound_evidence(candidate.residual.whiten(chosen), self._find_floor(chosen), self.block_length)

    def compute_closed_share(self, before: Candidate, after: Candidate) -> float:
        """Compute the part of the error beyond the noise [1] that another candidate closes, over conditions."""
        chosen = self.choose_filter(before)
        (first, counts), (second, _) = (self._compute_condition_squares(c, chosen) for c in (before, after))
        means = (float(s @ counts / counts.sum()) for s in (first, second))
        # A floor above a residual is too high by as much.
        noise = min(self._find_floor(chosen) ** 2, *means)
        chance = noise * np.sqrt(2.0 / counts)
        ratios = (np.maximum(second - noise, 0.0) + chance) / (np.maximum(first - noise, 0.0) + chance)
        return 1.0 - float(np.exp(np.mean(np.log(ratios))))

    def _compute_condition_squares(self, candidate: Candidate, chosen: WhiteningFilter) -> tuple[Array, Array]:
        """Return mean square (conditions,) [N²] of a filtered residual, and the number of samples."""
        residual = candidate.residual.whiten(chosen)
        values = residual.values**2, np.ones(len(residual.values))
        by_cycle = (self.cycles.sum_by_cycle(v, residual.valid) for v in values)
        sums, counts = (np.bincount(self.cycles.segment, v).astype(float) for v in by_cycle)
        used = counts > 0
        return sums[used] / counts[used], counts[used]

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
