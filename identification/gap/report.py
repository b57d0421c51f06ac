"""What a diagnosis answers: the documents, from the sets that were fitted and their odds."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from identification.assemble import Assembled
from identification.gap.black_box import explainable, history
from identification.gap.checks import blind_spots
from identification.gap.contender import Contender
from identification.gap.documents import STAGES, Diagnosis, Gap, NextStroke, Twin, Verdict, Where
from identification.gap.held_out import Shrinkage
from identification.gap.judge import Judge
from identification.gap.model import Model
from identification.gap.next_stroke import Limits, Rival, best_segment, information
from identification.gap.posterior import Odds, stage_odds
from identification.gap.search import Search
from identification.gap.twin import baseline_fit, twin_of
from identification.gap.verdict import alternatives, named_effects, shares, verdict_on, without_promise
from identification.gap.where import drift, gap_map, harmonics
from identification.gap.words import explanation, nearest
from identification.results import Provenance

TIED = 0.05
"""[1] probability of a set from which on it is worth telling it apart."""
MOST_TIED = 3
_NEARER = 0.95
"""[1] part of the error that known effects may leave at most to be spoken of where none is named."""


@dataclass(frozen=True)
class Answer:
    """What `diagnose` found."""

    diagnosis: Diagnosis
    twin: Twin


@dataclass(frozen=True)
class Report:
    """Everything that goes into the documents."""

    assembled: Assembled
    judge: Judge
    search: Search
    odds: Odds
    model: Model | None
    notes: Sequence[str]
    seed: int

    def answer(self) -> Answer:
        """The documents."""
        plain = self.search.found[frozenset()]
        likeliest = self.odds.ranked()[0][0]
        named = self.search.found[likeliest]
        floor = self.search.floor
        verdict = verdict_on(plain, named, floor, self.odds)
        shrunk = self._shrunk(plain, named)
        if named.names and shrunk.worth is not None and shrunk.worth < 0.0:
            verdict = without_promise(plain, floor)
        if named.names and verdict in ("no_gap", "unexplained"):
            named, likeliest = plain, frozenset()
            shrunk = self._shrunk(plain, plain)
        gap = self._gap(verdict, plain, named, shrunk)
        where = self._where(plain, floor)
        parts = shares(self.search.found, likeliest, sorted(likeliest))
        effects = named_effects(named, self.odds, parts, self.assembled.drive_unit)
        others = alternatives(self.odds, likeliest)
        rest = self._rest(named, floor)
        provenance = self._provenance()
        diagnosis = Diagnosis(
            verdict=verdict,
            effects=effects,
            alternatives=others,
            probability=self.odds.sets[likeliest],
            unknown_probability=self.odds.unknown,
            gap=gap,
            where=where,
            next_stroke=self._next_stroke(floor),
            explanation=explanation(verdict, gap, effects, others, rest),
            notes=[
                *self.notes,
                *self._nearest(verdict, plain),
                *blind_spots(self.judge.cycles, self.assembled.floor),
            ],
            provenance=provenance,
        )
        noise = self.search.hearing.noise
        baseline = baseline_fit(self.assembled, self.judge, plain, noise, provenance)
        specimen = baseline.specimen
        return Answer(diagnosis, twin_of(self.assembled, named, baseline, noise, specimen, provenance))

    def _nearest(self, verdict: Verdict, plain: Contender) -> list[str]:
        """What known effects come nearest where none is named, in words."""
        best = min(self.search.found.values(), key=lambda c: c.unseen)
        if verdict != "unexplained" or best.unseen > _NEARER * plain.unseen:
            return []
        return [nearest(sorted(best.names), plain.unseen, best.unseen, self.search.floor)]

    def _shrunk(self, plain: Contender, named: Contender) -> Shrinkage:
        """How far a set shrinks the gap."""
        hearing = self.search.hearing
        nowhere = np.zeros((1, len(self.judge.force)))
        carried = hearing.other_runs(named, self.search.full) if named.names else nowhere
        noise = hearing.noise_under(named)
        return self.judge.shrunk(plain.left, named.left, noise, carried)

    def _gap(self, verdict: Verdict, plain: Contender, named: Contender, shrunk: Shrinkage) -> Gap:
        noise = self.search.hearing.noise_under(named)
        nothing = verdict == "no_gap"
        return Gap(
            before_n=shrunk.before,
            after_n=shrunk.after,
            noise_floor_n=noise,
            shrinkage=None if nothing else shrunk.value,
            shrinkage_ci95=None if nothing else shrunk.ci95,
            nominal_n=self._nominal(),
            train_before_n=plain.seen,
            train_after_n=named.seen,
        )

    def _nominal(self) -> float | None:
        """RMSE [N] of the given simulation on the unseen strokes."""
        if self.model is None:
            return None
        model = self.model
        return self.judge.rmse(self.judge.left([model.force_on(p) for p in self.judge.fitted_pieces()]))[1]

    def _where(self, plain: Contender, floor: float) -> Where:
        stages = stage_odds(self.odds, STAGES)
        nothing = plain.unseen <= floor or max(stages.values()) < 0.05
        return Where(
            stage=None if nothing else sorted(STAGES, key=stages.__getitem__)[-1],
            stages={name: stages[name] for name in STAGES},
            map=gap_map(plain.left, self.judge.cycles, floor),
            harmonics=harmonics(plain.left, self.judge.cycles),
            drift=drift(plain.left, self.judge.cycles),
            explainable=self._explainable(plain, floor),
        )

    def _explainable(self, contender: Contender, floor: float) -> float:
        if contender.unseen < 1.02 * floor:
            return 0.0
        judge = self.judge
        return explainable(history(judge.pieces), contender.left.residual, judge.seen, judge.unseen, floor)

    def _rest(self, named: Contender, floor: float) -> str:
        """Where what is not explained shows, in words."""
        place = gap_map(named.left, self.judge.cycles, floor)[0]
        share = self._explainable(named, floor)
        unit = self.assembled.drive_unit
        hangs = (
            f"a flexible model of stroke and drive explains {share:.0%} of the rest"
            if share > 0.3
            else "it hangs on nothing that was recorded of stroke and drive"
        )
        return (
            f"What remains is largest at {place.drive:.3g} {unit}, {1e3 * place.amplitude_m:.3g} mm and "
            f"{place.frequency_hz:.3g} Hz ({place.gap_n:.3g} N), and {hangs}."
        )

    def _next_stroke(self, floor: float) -> NextStroke | None:
        tied = [(names, p) for names, p in self.odds.ranked() if p > TIED][:MOST_TIED]
        rivals = [self._rival(names, p) for names, p in tied]
        law = self.search.found[frozenset()].fit.coordinates
        chosen = best_segment(rivals, law, self._limits(), floor)
        if chosen is None:
            return None
        return NextStroke(
            segment=chosen.segment,
            separates=chosen.separates,
            expected_n=chosen.difference,
            detectability=chosen.detectability,
        )

    def _rival(self, names: frozenset[str], probability: float) -> Rival:
        found, none = self.search.found[names], self.search.found[frozenset()]
        left = max(self.search.left_of(found), 0.0) / max(self.search.left_of(none), 1e-3)
        fit = found.fit
        return Rival(
            tuple(sorted(names)), fit.coordinates, fit.active, probability, min(left, 1.0), information(fit)
        )

    def _limits(self) -> Limits:
        """What the recording reached."""
        strokes = [p.stroke for p in self.judge.pieces]
        low = min(float(s.displacement.min()) for s in strokes)
        high = max(float(s.displacement.max()) for s in strokes)
        space = self.search.full.space
        return Limits(
            amplitude=0.5 * (high - low),
            centre=0.5 * (high + low),
            velocity=max(float(np.quantile(np.abs(s.velocity), 0.999)) for s in strokes),
            frequency=max([c.frequency for c in self.judge.cycles.conditions] + [0.5]),
            drives=(space.lowest_drive, space.highest_drive),
        )

    def _provenance(self) -> Provenance:
        return Provenance(
            logs={r.path.name: r.sha256 for r in self.assembled.recordings},
            version=version("mrbench"),
            seed=self.seed,
            settings={"held_out": "every fourth segment, or cycle where segments are few"},
        )
