"""Noise model: current estimate of the noise, updated from the residuals of candidates.

It starts with the noise floor of the recorded force. Propagated input noise is added.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identification.arrays import Array
from identification.fitting import Piece, Problem
from identification.gap.data import (
    ErrorSquare,
    EvaluationData,
    Residual,
    estimate_repeated_residual,
    estimate_scale_excess,
    measure_residual_scales,
    split_by_piece,
)
from identification.gap.fits import NO_GAP_RATIO, Candidate
from identification.gap.noise.input_noise import propagate_input_noise, resample_motion
from identification.logs import Stretch
from identification.noise import (
    NORMAL_95,
    NoiseFloorEstimate,
    estimate_high_frequency_noise,
    estimate_slow_variance,
)

_CHANCE_DEVIATIONS = 3.0
"""Standard deviations of a mean square that noise alone hardly exceeds: in one recording of 700."""
_SEARCH_DRAWS = 2
"""Draws of the input noise during the search; over the strokes, each estimates its size to some hundredths."""
_REPORT_DRAWS = 8
"""Draws of the input noise for the report; at rest, before a run, draws differ by more than their mean."""


@dataclass
class NoiseModel:
    """Estimated noise of force and displacement."""

    estimate: NoiseFloorEstimate
    """Noise of the recorded force."""
    stretches: Sequence[Stretch]
    """Recorded stretches, one for each piece."""
    seed: int = 1
    """Seed of the input noise."""
    input_noise: float | None = None
    """Propagated noise of the displacement [N]; None before the first update."""
    has_certain_error: bool = False
    """True where a part of the law's residual is certainly an error of the law."""
    has_unsteady_cycles: bool = False
    """True where what does not repeat with the cycles is not noise."""
    _motion_draws: list[tuple[Piece, ...]] = field(default_factory=list)

    @property
    def noise(self) -> float:
        """Noise of the recorded force [N]."""
        return self.estimate.noise

    @property
    def floor(self) -> float:
        """Noise floor of the residual [N]: noise of the force and propagated input noise."""
        return math.hypot(self.noise, self.input_noise or 0.0)

    @property
    def highest_floor(self) -> float:
        """Upper end of the floor's 95 % interval [N]; the floor itself where no cycles repeat."""
        return math.hypot(self.estimate.get_interval(self.noise)[1], self.input_noise or 0.0)

    def compute_highest_rmse(self, samples: int) -> float:
        """Return the RMSE [N] that noise alone hardly exceeds on some samples.

        Slow noise differs from one part of a recording to the next. Where an error of the law is certain, the
        floor is that of the recorded noise itself.
        """
        if self.has_certain_error:
            return self.highest_floor
        uncertain = _CHANCE_DEVIATIONS / NORMAL_95 * (self.highest_floor**2 - self.floor**2)
        chance = _CHANCE_DEVIATIONS * self.estimate.compute_chance(samples) * self.noise**2
        return math.sqrt(self.floor**2 + math.hypot(uncertain, chance))

    def update(self, candidate: Candidate, full_problem: Problem, evaluation: EvaluationData) -> None:
        """Estimate the propagated noise of the displacement from a candidate's simulated loop.

        Args:
            candidate: the best set so far; the baseline comes first.
            full_problem: problem of all samples.
            evaluation: the same recordings, cut into cycles.
        """
        if max(candidate.train_rmse, candidate.held_out_rmse) < NO_GAP_RATIO * self.noise:
            return
        squares = self._propagate(candidate, full_problem, _SEARCH_DRAWS)[:, evaluation.fitted_samples]
        size = math.sqrt(float(squares.mean()))
        # With missing effects the simulated loop may be far too steep. The smallest estimate is the safe one.
        self.input_noise = size if self.input_noise is None else min(size, self.input_noise)

    def narrow_floor(self, candidate: Candidate, evaluation: EvaluationData) -> None:
        """Take the floor from the residual of the law where a part of it is certainly an error of the law.

        The rest is noise. Within the interval of the floor all of it would count as noise, because slow noise
        leaves a wide interval.

        Args:
            candidate: the law without effects.
            evaluation: the recordings, cut into cycles.
        """
        error = self._find_certain_error(candidate, evaluation)
        if error is None:
            return
        self.has_certain_error = True
        values = candidate.residual.values[candidate.residual.valid]
        input_square = (self.input_noise or 0.0) ** 2
        rest = math.sqrt(max(float(np.mean(values**2)) - error.square - input_square, 0.0))
        low, high = self.estimate.get_interval(self.noise)
        if low <= rest <= high:
            self.estimate = replace(self.estimate, noise=rest, deviation=0.5 * error.deviation / rest)

    def _find_certain_error(self, candidate: Candidate, evaluation: EvaluationData) -> ErrorSquare | None:
        """Return the part of a residual that repeats with the cycles or exceeds the noise at its time scale."""
        found = (
            estimate_repeated_residual(candidate.residual, evaluation.cycles),
            estimate_scale_excess(candidate.residual, self.estimate.scales, (self.input_noise or 0.0) ** 2),
        )
        errors = [e for e in found if e is not None and e.lowest > (NO_GAP_RATIO**2 - 1.0) * self.noise**2]
        return max(errors, key=lambda e: e.square, default=None)

    def is_disproved_by(self, candidate: Candidate) -> bool:
        """Return True if a set of effects leaves less than the floor of repeated cycles, by more than chance."""
        if not candidate.names or self.estimate.deviation is None:
            return False
        lowest = self.noise - _CHANCE_DEVIATIONS * self.estimate.deviation
        return max(candidate.train_rmse, candidate.held_out_rmse) < lowest

    def discard_cycles(self, candidate: Candidate) -> None:
        """Replace the floor of repeated cycles by the noise at high frequencies, where a set disproves it.

        A spectral line that the set explains is no noise, so the smaller of force and residual counts.
        """
        residual = candidate.residual.values[candidate.residual.valid]
        fast = min(estimate_high_frequency_noise(residual), self.estimate.high_frequency)
        self.has_unsteady_cycles = True
        self.estimate = replace(self.estimate, high_frequency=fast).discard_cycles(
            "a model leaves less than what does not repeat with the cycles"
        )

    def may_be_noise(self, candidate: Candidate, evaluation: EvaluationData) -> bool:
        """Return True if the estimate of the noise does not exclude that a whole residual is noise.

        Few cycles do not show noise that is slower than they are. So the residual is compared with the noise by
        time scale, where that is known, and else with the interval of the floor.
        """
        if self.estimate.scales:
            return self._find_certain_error(candidate, evaluation) is None
        return self.describe_residual(candidate).noise < self.estimate.get_interval(math.inf)[1]

    def describe_residual(self, candidate: Candidate) -> NoiseFloorEstimate:
        """Return the estimate of the noise if the residual of a candidate is noise; at most few cycles repeat."""
        residual = candidate.residual
        values = residual.values[residual.valid]
        total = float(np.mean(values**2))
        square = max(total - (self.input_noise or 0.0) ** 2, self.noise**2)
        # The input noise is taken from every scale alike, because its spectrum is not known.
        scales = tuple(scale.multiply(square / total) for scale in measure_residual_scales(residual))
        estimate = replace(
            self.estimate, noise=math.sqrt(square), scales=scales, slow_variance=estimate_slow_variance(scales)
        )
        deviation = 0.5 * estimate.noise * estimate.compute_chance(len(values))
        ratio = estimate.noise / self.estimate.high_frequency
        basis = (
            f"residual of the model, {ratio:.2f} times the noise at high frequencies: no function of stroke, "
            f"drive and time predicts it, and {'few' if self.estimate.is_known else 'no'} cycles repeat"
        )
        return replace(estimate, deviation=deviation, basis=basis)

    def bound_slow_variance(self, residual: Residual) -> float:
        """Return the largest variance of slow noise in each factor e of the frequency [N²].

        Few repeated cycles show it only at fast frequencies, and none do not show it. A residual contains the
        noise of all frequencies, and errors besides.

        Args:
            residual: residual of any candidate.
        """
        scales = measure_residual_scales(residual)
        bounds = [self.estimate.slow_variance.highest] if self.estimate.is_known else []
        bounds += [estimate_slow_variance(scales).highest] if scales else []
        return min(bounds, default=0.0)

    def estimate_noise(self, candidate: Candidate) -> float:
        """Return the noise of the recorded force [N], limited by the residual of a candidate fitted later."""
        values = candidate.residual.values[candidate.residual.valid]
        limit = math.sqrt(max(float(np.mean(values**2)) - (self.input_noise or 0.0) ** 2, 0.0))
        white_noise = self.noise * math.sqrt(1.0 - self.estimate.coloured_share)
        return max(min(self.noise, limit), white_noise)

    def sample_other_runs(self, candidate: Candidate, full_problem: Problem) -> Array:
        """Return the squared change of a candidate's force [N²] by the input noise of other runs, (runs, N).

        Args:
            candidate: a set of effects.
            full_problem: problem of all samples.
        """
        return self._propagate(candidate, full_problem, _REPORT_DRAWS)

    def _propagate(self, candidate: Candidate, full_problem: Problem, draws: int) -> Array:
        if len(self._motion_draws) < draws:
            forces = split_by_piece(candidate.residual.simulated_force, full_problem.pieces)
            missing = range(len(self._motion_draws), draws)
            self._motion_draws += resample_motion(
                self.stretches, full_problem.pieces, forces, self.noise, self.seed, missing
            )
        problem = full_problem.replace_effects(candidate.fit.effects)
        return propagate_input_noise(problem, candidate.fit.minimum.unknowns, self._motion_draws[:draws])
