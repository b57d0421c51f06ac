"""Candidate pool: the sets of effects that were fitted to one recording.

The pool fits, screens and compares sets. It keeps the best fit of each set. The strategies in this package
decide which sets are fitted.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper.effects import EFFECTS, Effect
from identification.fitting import EffectModel, Piece, fit_output_error
from identification.gap.data import EvaluationData, split_by_piece
from identification.gap.fits import (
    EXPLAINED_RATIO,
    Candidate,
    FitOptions,
    JointFit,
    fit_jointly,
    refit_all_samples,
)
from identification.gap.noise import NoiseModel, compute_noise_drift, find_mains_frequency, has_drift
from identification.gap.selection.error_comparison import ErrorComparison
from identification.gap.selection.posterior import BlockEvidence, Posterior, SetEvidence, compute_posterior
from identification.gap.selection.screening import ScreeningResult
from identification.gap.selection.screening_cache import ScreeningCache
from identification.gap.selection.search_problems import SearchProblems
from identification.gap.selection.search_settings import LAW_SEARCH, QUICK_FIT, SET_SEARCH, SearchSettings
from identification.gap.selection.size_prior import compute_size_weight
from identification.progress import Progress, advance, ignore_progress
from identification.uncertainty import estimate_step_shifts, shift_steps

_CHANCE_DEVIATIONS = 2.0
"""Standard deviations of a sample variance that count as chance."""


class CurveAlternative(NamedTuple):
    """A curve that is an alternative to the fitted sets."""

    names: frozenset[str]
    """Name of the effect whose form it stands for; another name for a cause outside the library."""
    candidate: Candidate
    """The law with the curve."""
    evidence: BlockEvidence
    """Block evidence on the held-out samples over the most probable set."""


@dataclass
class CandidatePool:
    """The sets of effects that were fitted to one recording."""

    problems: SearchProblems
    evaluation: EvaluationData
    noise_model: NoiseModel
    clock_deviation: float = 0.0
    """Standard deviation of the delay between the channels [s]; 0 where it is small enough to be ignored."""
    progress: Progress = ignore_progress
    library: Mapping[str, Effect] = field(default_factory=lambda: EFFECTS)
    """Effects that the search considers, by name."""
    candidates: dict[frozenset[str], Candidate] = field(default_factory=dict)
    """Best fit of each set."""
    full_fits: set[frozenset[str]] = field(default_factory=set)
    """Sets that were fitted on all samples."""
    block_evidence: dict[frozenset[str], BlockEvidence] = field(default_factory=dict)
    """Block evidence of the sets for which it was computed."""
    held_out_evidence: dict[frozenset[str], tuple[BlockEvidence, ...]] = field(default_factory=dict)
    """Block evidence on the held-out samples over sets with one effect less, where it was computed."""
    curve: CurveAlternative | None = None
    """The law with the best curve, where curves were fitted and it is an alternative to the sets."""
    fit_count: int = 0
    """Number of fits."""
    notes: list[str] = field(default_factory=list)
    """Messages about the search for a person."""
    _screenings: ScreeningCache = field(init=False)

    def __post_init__(self) -> None:
        """Create the cache of screenings."""
        self._screenings = ScreeningCache(self.problems.screening_rate, self.library)

    @property
    def settings(self) -> SearchSettings:
        """Limits of the search."""
        return self.problems.settings

    @property
    def budget_spent(self) -> bool:
        """True after as many fits as the budget allows; a count gives the same result on every machine."""
        return self.fit_count >= self.settings.fit_budget

    @property
    def floor(self) -> float:
        """Noise floor [N]."""
        return self.noise_model.floor

    @property
    def no_gap_limits(self) -> tuple[float, float]:
        """RMSE of the baseline on fitted and on held-out samples [N] up to which the verdict is ``no_gap``."""
        fitted, held_out = self.evaluation.fitted_samples, self.evaluation.held_out_samples
        return self._find_no_gap_limit(fitted), self._find_no_gap_limit(held_out)

    @property
    def has_uncertain_floor(self) -> bool:
        """True where the interval of the floor contains errors that would count as explained above a known one."""
        largest = max(EXPLAINED_RATIO, self.settings.no_gap_ratio)
        return max(self.no_gap_limits) > largest * self.floor

    def _find_no_gap_limit(self, samples: BoolArray) -> float:
        highest = self.noise_model.compute_highest_rmse(max(int(np.count_nonzero(samples)), 1))
        return max(self.settings.no_gap_ratio * self.floor, highest)

    @property
    def baseline(self) -> Candidate:
        """Candidate without effects."""
        return self.candidates[frozenset()]

    @property
    def baseline_excess(self) -> float:
        """Excess of the baseline [1]."""
        return self.compute_excess(self.baseline)

    @property
    def comparison(self) -> ErrorComparison:
        """Comparison of the errors of two candidates by block evidence."""
        evaluation = self.evaluation
        return ErrorComparison(
            self.noise_model, evaluation.held_out_samples, self.problems.block_length, evaluation.cycles
        )

    def compute_excess(self, candidate: Candidate) -> float:
        """Compute the excess of a candidate over the present noise floor [1]."""
        return candidate.compute_excess(self.floor)

    def is_at_floor(self, candidate: Candidate) -> bool:
        """Return True if the excess is negligible, so that no further effect is searched for."""
        share = self.settings.negligible_share * max(self.baseline_excess, 0.0)
        return self.compute_excess(candidate) < self.settings.negligible_excess + share

    def find_best(self) -> Candidate:
        """Return the candidate with the smallest excess."""
        return min(self.candidates.values(), key=self.compute_excess)

    def reaches_floor(self, candidate: Candidate) -> bool:
        """Return True if the error on fitted and on held-out samples is nearly the noise floor."""
        return candidate.reaches_floor(self.floor)

    def collect_evidence(self) -> list[SetEvidence]:
        """Return the evidence of every set."""
        floor = self._find_lowest_floor()
        x = np.concatenate([p.excitation.displacement for p in self.problems.full.pieces])
        size = self.problems.full.space.scales.damper_size
        return [
            SetEvidence(
                names,
                c.compute_relative_excess(self.baseline, floor),
                math.prod(compute_size_weight(e, x, size) for e in c.fit.active_effects),
                self.block_evidence.get(names),
                self.held_out_evidence.get(names, ()),
            )
            for names, c in self.candidates.items()
        ]

    def compute_posterior(self) -> Posterior:
        """Compute the posterior of all fitted sets."""
        coloured_share = self.noise_model.estimate.coloured_share
        curve = self._collect_curve_evidence()
        # The same limit as that of the verdict ``no_gap``.
        noise_excess = (self.no_gap_limits[0] / self.floor) ** 2 - 1.0
        samples = self.problems.full.samples
        return compute_posterior(self.collect_evidence(), samples, coloured_share, curve, noise_excess)

    def _collect_curve_evidence(self) -> SetEvidence | None:
        """Return the evidence of the curve that is an alternative to the sets; None without one."""
        if self.curve is None:
            return None
        names, candidate, evidence = self.curve
        excess = candidate.compute_relative_excess(self.baseline, self._find_lowest_floor())
        return SetEvidence(names, excess, block_evidence=evidence)

    def _find_lowest_floor(self) -> float:
        """Return a floor [N] that lies below the residual of every candidate."""
        part = float(np.mean(self.evaluation.held_out_samples[self.evaluation.usable]))
        lowest = min(
            math.sqrt((1.0 - part) * c.train_rmse**2 + part * c.held_out_rmse**2) for c in self.candidates.values()
        )
        return min(self.floor, lowest)

    def fit_law(self) -> Candidate:
        """Fit the law alone, which is the baseline."""
        return self.search(())

    def search(self, effects: tuple[EffectModel, ...]) -> Candidate:
        """Fit a set on decimated data by the search of an identification, and keep it if it is the best.

        `fit` starts where another set ended. A large effect has moved that law to values from which no descent
        returns.
        """
        self.fit_count += 1
        problem = self.problems.decimated.replace_effects(effects)
        minimum = fit_output_error(problem, SET_SEARCH if effects else LAW_SEARCH)
        return self._keep(self.evaluate(JointFit(problem, minimum)))

    def fit(
        self, effects: tuple[EffectModel, ...], starts: Sequence[Array] = (), options: FitOptions = QUICK_FIT
    ) -> Candidate:
        """Fit a set on decimated data, evaluate it on all samples, and keep it if it is the best of its names.

        Starts are unknowns (U,) of the joint problem; the options add further ones.

        Returns:
            The best known candidate of this set, which may come from an earlier fit.
        """
        self.fit_count += 1
        return self._keep(self.evaluate(fit_jointly(self.problems.decimated, effects, None, options, starts)))

    def _keep(self, candidate: Candidate) -> Candidate:
        """Keep a candidate if it is the best of its names, and return the best."""
        effects = candidate.fit.effects
        progress = advance(self.progress, self.fit_count / self.settings.fit_budget)
        progress(" and ".join(model.name for model in effects) or "law alone", candidate.held_out_rmse)
        known = self.candidates.get(candidate.names)
        if known is None or self.compute_excess(candidate) < self.compute_excess(known):
            self.candidates[candidate.names] = candidate
        return self.candidates[candidate.names]

    def fit_fully(self, names: frozenset[str]) -> None:
        """Fit a set on all samples, once, starting from its best fit on decimated data."""
        if names not in self.full_fits:
            self._continue_fit(names)
            self.candidates[names] = self.refit_all_samples(self.candidates[names])
            self.full_fits.add(names)

    def fit_most_probable_set(self, compute_posterior: Callable[["CandidatePool"], Posterior]) -> frozenset[str]:
        """Fit the most probable set on all samples; repeat while another set is then more probable."""
        for _ in range(self.settings.max_refits):
            names = compute_posterior(self).most_probable_set
            if names in self.full_fits:
                break
            self.fit_fully(names)
        return names

    def screen(self, parent: Candidate, without: frozenset[str]) -> list[ScreeningResult]:
        """Estimate the gain of every further effect in addition to a set, except of those named."""
        return self._screenings.find_gains(
            parent, without, self.compute_excess(parent), self.problems.decimated, self._find_mains_frequency
        )

    def evaluate(self, fit: JointFit) -> Candidate:
        """Compute the residual of a fit on all samples; a drift that slow noise explains remains in it."""
        forces = self.problems.full.replace_effects(fit.effects).simulate(fit.minimum.unknowns)
        residual = self.evaluation.compute_residual(forces)
        if has_drift(fit):
            slow_variance = self.noise_model.bound_slow_variance(residual)
            drift = compute_noise_drift(fit, self.problems.full, slow_variance)
            drifts = split_by_piece(drift, self.problems.full.pieces)
            residual = self.evaluation.compute_residual([f - d for f, d in zip(forces, drifts, strict=True)])
        estimate = self.noise_model.estimate
        held_out = max(int(np.count_nonzero(self.evaluation.held_out_samples)), 1)
        chance = _CHANCE_DEVIATIONS * estimate.compute_chance(held_out)
        return Candidate(fit, residual, *self.evaluation.compute_rmse(residual), chance)

    def propagate_input_noise(self, candidate: Candidate) -> Array:
        """Return the squared change of a candidate's force by the noise of its inputs, (runs, N) [N²]."""
        return self.noise_model.sample_other_runs(candidate, self.problems.full)

    def update_residuals(self) -> None:
        """Compute the residuals of all fits again, after the estimate of slow noise has changed."""
        self.candidates = {names: self.evaluate(c.fit) for names, c in self.candidates.items()}

    @cached_property
    def _recorded_pieces(self) -> tuple[Piece, ...]:
        """Pieces with the drives as recorded, before any step is moved."""
        return self.evaluation.pieces

    def place_drive_steps(self, candidate: Candidate) -> bool:
        """Move the steps of the drives to the instants that a candidate shows; return True if any moved."""
        recorded = replace(self.problems.full, pieces=self._recorded_pieces).replace_effects(candidate.fit.effects)
        shifts = estimate_step_shifts(recorded, candidate.fit.minimum.unknowns)
        if shifts is None:
            return False
        self.evaluation = replace(self.evaluation, pieces=shift_steps(recorded, shifts).pieces)
        moved = replace(self.problems.full, pieces=self.evaluation.select_fitted_pieces())
        self.problems = replace(self.problems, full=moved)
        self._screenings = ScreeningCache(self.problems.screening_rate, self.library)
        self.full_fits.clear()
        self.update_residuals()
        return True

    def _continue_fit(self, names: frozenset[str]) -> None:
        """Continue a descent that stopped at its limit of iterations."""
        for _ in range(self.settings.refit_rounds):
            known = self.candidates[names]
            if known.fit.converged or self.budget_spent:
                return
            self.fit(known.fit.effects, [known.fit.minimum.unknowns])

    def refit_all_samples(self, candidate: Candidate) -> Candidate:
        """Refine a candidate on all samples; it is not kept."""
        for _ in range(self.settings.refit_rounds):
            simulated = split_by_piece(candidate.residual.simulated_force, self.problems.full.pieces)
            fit = refit_all_samples(self.problems.full, candidate.fit, simulated, self.settings.refit_iterations)
            candidate = self.evaluate(fit)
            if abs(candidate.train_rmse - fit.rmse) < self.settings.refit_tolerance * self.floor:
                break
        return candidate

    def refit_usable_samples(self, candidate: Candidate) -> Candidate:
        """Refine a candidate on all usable samples, the held-out ones included; it is not kept."""
        problem = replace(self.problems.full, pieces=self.evaluation.pieces)
        simulated = split_by_piece(candidate.residual.simulated_force, problem.pieces)
        return self.evaluate(refit_all_samples(problem, candidate.fit, simulated, self.settings.refit_iterations))

    def _find_mains_frequency(self, parent: Candidate) -> float:
        """Find the mains frequency [Hz] in the residual of the longest stretch, which resolves it best."""
        pieces = self.problems.full.pieces
        errors = split_by_piece(np.where(parent.residual.valid, parent.residual.values, 0.0), pieces)
        longest = max(range(len(pieces)), key=lambda i: len(errors[i]))
        return find_mains_frequency(errors[longest], pieces[longest].excitation.rate)
