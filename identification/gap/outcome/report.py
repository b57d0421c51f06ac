"""Report of a diagnosis: its documents, from the candidates and their posterior."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version

from identification.damper.effects import STAGES, Stage
from identification.documents import (
    Diagnosis,
    Discovery,
    Gap,
    GapLocation,
    HeldOutError,
    Provenance,
    Remainder,
    Twin,
    TwinResidual,
    Verdict,
)
from identification.fitting import DamperModel, Dataset
from identification.gap.data import (
    EvaluationData,
    Shrinkage,
    compute_harmonics,
    describe_unobservable_effects,
    estimate_drift,
    extend_to_other_strokes,
    map_gap,
)
from identification.gap.discovery import DiscoveredEffect, discover_effect, locate_unlisted_cause
from identification.gap.fits import Candidate
from identification.gap.noise import ResidualRegression
from identification.gap.outcome.diagnosis_result import DiagnosisResult
from identification.gap.outcome.discovery_document import build_discovery
from identification.gap.outcome.explanation import (
    describe_discovery,
    describe_learned_residual,
    describe_nearest,
    explain_diagnosis,
    locate_remainder,
)
from identification.gap.outcome.held_out_strokes import measure_held_out_strokes
from identification.gap.outcome.next_stroke import propose_next_stroke
from identification.gap.outcome.other_strokes import estimate_error_growth
from identification.gap.outcome.remainder import describe_remainder
from identification.gap.outcome.twin import make_baseline_fit, make_twin
from identification.gap.outcome.twin_residual import learn_twin_residual
from identification.gap.outcome.verdict import (
    NamedSet,
    Share,
    build_named_effects,
    choose_named_set,
    estimate_expected_shrinkage,
    is_ambiguous,
    list_alternatives,
)
from identification.gap.selection import (
    UNKNOWN_THRESHOLD,
    CandidatePool,
    Posterior,
    compute_stage_probabilities,
    settle_floor,
)
from identification.residual import LearnedResidual

_NEAREST_SHARE = 0.95
"""Largest error that unnamed effects may leave to be mentioned, relative to that of the baseline."""
_MIN_STAGE_PROBABILITY = 0.05
"""Smallest probability of a stage that is reported as the most probable one."""


@dataclass(frozen=True)
class ReportBuilder:
    """Inputs of the documents."""

    dataset: Dataset
    evaluation: EvaluationData
    pool: CandidatePool
    posterior: Posterior
    partial: Posterior | None
    """Probabilities of sets as a part of the cause; None where the cause is probably in the library."""
    model: DamperModel | None
    notes: Sequence[str]
    seed: int
    discovers: bool = False
    """True to search for a cause outside the library where the named effects do not explain the gap."""
    learns_residual: bool = False
    """True to learn the residual of law and effects, for predictions with the twin."""

    @cached_property
    def regression(self) -> ResidualRegression:
        """Regression on the residuals of the sets."""
        return ResidualRegression(self.evaluation, self.pool.floor)

    @cached_property
    def unlisted_stages(self) -> dict[Stage, float]:
        """Probability of each stage for a cause outside the library, in addition to the law alone."""
        return locate_unlisted_cause(self.pool, self.pool.baseline)

    def build_result(self) -> DiagnosisResult:
        """Build the documents."""
        chosen = self._choose_named_set()
        found = self._discover(chosen.verdict, chosen.candidate)
        modelled = chosen.candidate if found is None else found.candidate
        residual = self._learn_residual(chosen.verdict, modelled)
        discovery = self._build_discovery(found, chosen.candidate)
        held_out = self._measure_held_out(chosen.candidate, modelled, residual)
        diagnosis = self._build_diagnosis(chosen, discovery, residual, held_out)
        twin = self._build_twin(modelled, discovery, diagnosis.provenance)
        return DiagnosisResult(diagnosis, twin.model_copy(update={"residual": residual}))

    def _build_diagnosis(
        self,
        chosen: NamedSet,
        discovery: Discovery | None,
        residual: TwinResidual | None,
        held_out: HeldOutError | None,
    ) -> Diagnosis:
        verdict, named, shrinkage, posterior = chosen
        gap = self._build_gap(verdict, named, shrinkage, held_out)
        shares = self._estimate_shares(named, shrinkage)
        effects = build_named_effects(named, posterior, shares, self.dataset.drive_unit)
        alternatives = list_alternatives(self.posterior, named.names)
        probability = self.posterior.sets.get(named.names, 0.0)
        remainder = self._build_remainder(verdict, named, gap.noise_floor_n)
        return Diagnosis(
            verdict=verdict,
            effects=effects,
            alternatives=alternatives,
            probability=probability,
            ambiguous=is_ambiguous(alternatives, probability),
            unknown_probability=self.posterior.unknown,
            gap=gap,
            where=self._locate_gap(posterior),
            next_stroke=propose_next_stroke(self.pool, self.posterior),
            remainder=remainder,
            discovery=discovery,
            explanation=explain_diagnosis(verdict, gap, effects, alternatives, self._describe_place(remainder)),
            notes=[
                *self.notes,
                *self._describe_nearest(verdict),
                *self._describe_search(verdict, discovery),
                *self._describe_residual(residual),
                *describe_unobservable_effects(self.evaluation.cycles, self.pool.noise_model.estimate),
            ],
            provenance=self._make_provenance(),
        )

    def _build_twin(self, modelled: Candidate, discovery: Discovery | None, provenance: Provenance) -> Twin:
        noise = self.pool.noise_model.noise
        fit = make_baseline_fit(self.dataset, self.evaluation, self.pool.baseline, noise, provenance)
        definition = None if discovery is None else discovery.definition
        return make_twin(self.dataset, modelled, definition, fit, noise, fit.specimen, provenance)

    def _build_remainder(self, verdict: Verdict, named: Candidate, floor: float) -> Remainder | None:
        """Describe the residual of the named set beyond the noise floor [N]; None without a gap."""
        if verdict == "no_gap":
            return None
        stages = None if named.names else self.unlisted_stages
        return describe_remainder(self.pool, named, self.regression, floor, stages)

    def _discover(self, verdict: Verdict, named: Candidate) -> DiscoveredEffect | None:
        """Return a cause outside the library, if it is wanted and something is left to explain."""
        if not self.discovers or verdict not in ("partly_explained", "unexplained"):
            return None
        found = discover_effect(self.pool, named)
        if found is not None:
            # No set of known effects left noise alone, because none contains the cause.
            settle_floor(self.pool, (self.pool.baseline, found.candidate))
        return found

    def _learn_residual(self, verdict: Verdict, modelled: Candidate) -> TwinResidual | None:
        """Return the learned residual of the twin's effects, if it is wanted and something is left."""
        wanted = self.learns_residual and verdict != "no_gap"
        return learn_twin_residual(self.evaluation, modelled, self.seed) if wanted else None

    def _describe_residual(self, residual: TwinResidual | None) -> list[str]:
        """Return the note on the learned residual, if it is wanted."""
        return [describe_learned_residual(residual)] if self.learns_residual else []

    def _build_discovery(self, found: DiscoveredEffect | None, named: Candidate) -> Discovery | None:
        if found is None:
            return None
        shrinkage = estimate_expected_shrinkage(self.pool, self.evaluation, found.candidate)
        extended = self._extend_shrinkage(shrinkage, found.candidate)
        return build_discovery(found, named, extended, self.dataset.drive_unit)

    def _describe_search(self, verdict: Verdict, discovery: Discovery | None) -> list[str]:
        """Return the note on the search for a cause outside the library: its result, or an offer."""
        if discovery is not None:
            return [describe_discovery(discovery, self.pool.baseline.held_out_rmse)]
        is_open = verdict in ("partly_explained", "unexplained")
        if not self.discovers:
            return ["the option --discover searches for a cause outside the library"] if is_open else []
        if not is_open:
            return ["no cause outside the library was searched for, because nothing is left to explain"]
        return ["no curve at any place closes part of the gap on held-out strokes, so none is reported"]

    def _choose_named_set(self) -> NamedSet:
        chosen = choose_named_set(self.pool, self.evaluation, self.posterior, self.partial)
        return chosen._replace(shrinkage=self._extend_shrinkage(chosen.shrinkage, chosen.candidate))

    def _extend_shrinkage(self, shrinkage: Shrinkage, named: Candidate) -> Shrinkage:
        """Return the shrinkage on other strokes; the sets are chosen by the recorded ones."""
        if shrinkage.remaining is None:
            return shrinkage
        growth = estimate_error_growth(named, self.pool.baseline)
        return extend_to_other_strokes(shrinkage, growth, self.evaluation.cycles.stroke_count)

    def _describe_nearest(self, verdict: Verdict) -> list[str]:
        """Return the note on the most similar known effects where none is named."""
        best = min(self.pool.candidates.values(), key=lambda c: c.held_out_rmse)
        before = self.pool.baseline.held_out_rmse
        if verdict != "unexplained" or best.held_out_rmse > _NEAREST_SHARE * before:
            return []
        return [describe_nearest(sorted(best.names), before, best.held_out_rmse, self.pool.floor)]

    def _estimate_shares(self, named: Candidate, shrinkage: Shrinkage) -> dict[str, Share]:
        """Return the share of each named effect; a set without it that was not fitted counts as the law alone."""
        candidates, baseline = self.pool.candidates, self.pool.baseline
        without = {n: candidates.get(named.names - {n}, baseline).residual for n in sorted(named.names)}
        noise = self.pool.noise_model.estimate_noise(named)
        return self.evaluation.estimate_shares(baseline.residual, named.residual, without, shrinkage.after, noise)

    def _measure_held_out(
        self, named: Candidate, modelled: Candidate, residual: TwinResidual | None
    ) -> HeldOutError | None:
        """Return the error of the named set on the user's held-out strokes, and of the twin with its residual."""
        problem = self.pool.problems.full
        error = measure_held_out_strokes(self.dataset, problem, named)
        if error is None or residual is None:
            return error
        twin = measure_held_out_strokes(self.dataset, problem, modelled, LearnedResidual(residual))
        return error if twin is None else error.model_copy(update={"with_residual": twin.to_force_error()})

    def _build_gap(
        self, verdict: Verdict, named: Candidate, shrinkage: Shrinkage, held_out: HeldOutError | None
    ) -> Gap:
        no_gap = verdict == "no_gap"
        noise = self.pool.noise_model.estimate_noise(named)
        discarded = self.pool.noise_model.has_unsteady_cycles
        floor = self.pool.noise_model.estimate if discarded else self.dataset.floor
        low, high = floor.get_interval(shrinkage.after)
        return Gap(
            before_n=shrinkage.before,
            after_n=shrinkage.after,
            held_out=held_out,
            explainable_n=self._find_explainable_rmse(named, noise),
            noise_floor_n=noise,
            noise_floor_ci95=(min(low, noise), max(high, noise)),
            floor_known=floor.is_known and not discarded,
            shrinkage=None if no_gap else shrinkage.value,
            shrinkage_ci95=None if no_gap else shrinkage.ci95,
            nominal_n=self._compute_nominal_rmse(),
            train_before_n=self.pool.baseline.train_rmse,
            train_after_n=named.train_rmse,
        )

    def _compute_nominal_rmse(self) -> float | None:
        """Compute the RMSE [N] of the given simulation on the held-out cycles."""
        if self.model is None:
            return None
        forces = [self.model.simulate_force(p) for p in self.evaluation.select_fitted_pieces()]
        return self.evaluation.compute_rmse(self.evaluation.compute_residual(forces))[1]

    def _locate_gap(self, posterior: Posterior) -> GapLocation:
        baseline, floor, cycles = self.pool.baseline, self.pool.floor, self.evaluation.cycles
        unlisted = self.unlisted_stages if self.posterior.unknown > UNKNOWN_THRESHOLD else None
        stages = compute_stage_probabilities(posterior, STAGES, self.pool.library, unlisted)
        no_stage = baseline.held_out_rmse <= floor or max(stages.values()) < _MIN_STAGE_PROBABILITY
        return GapLocation(
            stage=None if no_stage else sorted(STAGES, key=stages.__getitem__)[-1],
            stages={name: stages[name] for name in STAGES},
            map=map_gap(baseline.residual, cycles, floor),
            harmonics=compute_harmonics(baseline.residual, cycles),
            drift=estimate_drift(baseline.residual, cycles),
            explainable=self.regression.explain(baseline).share,
        )

    def _find_explainable_rmse(self, named: Candidate, noise: float) -> float:
        """Return the lowest held-out RMSE [N] of a fitted set or of a regression on the residual."""
        lowest = min(c.held_out_rmse for c in self.pool.candidates.values())
        return min(lowest, self.regression.find_explainable_rmse((self.pool.baseline, named), noise))

    def _describe_place(self, remainder: Remainder | None) -> str:
        """Return the sentence on the residual with the named effects; empty where nothing is left."""
        return "" if remainder is None else locate_remainder(remainder, self.dataset.drive_unit)

    def _make_provenance(self) -> Provenance:
        return Provenance(
            logs={r.path.name: r.sha256 for r in self.dataset.recordings},
            version=version("mrbench"),
            seed=self.seed,
            settings={
                "held_out": "every fourth stroke of each drive, or cycle where strokes are few",
                "hold_out": ",".join(self.dataset.hold_out.patterns) or None,
                "hold_out_after": self.dataset.hold_out.after_fraction,
            },
        )
