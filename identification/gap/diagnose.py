"""The diagnosis of one or several logs: floor, where, which, how far, and the stroke that would tell more."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version

import numpy as np

from identification.assemble import Assembled, assemble
from identification.gap.black_box import explainable, history
from identification.gap.checks import (
    blind_spots,
    enough_cycles,
    one_specimen,
    sliding_recorded,
    without_clipping,
)
from identification.gap.contender import Contender
from identification.gap.documents import STAGES, Diagnosis, Gap, NextStroke, Twin, Verdict, Where
from identification.gap.floor import Floor
from identification.gap.judge import Judge
from identification.gap.model import Model
from identification.gap.next_stroke import Limits, Rival, best_segment
from identification.gap.posterior import Odds, odds, stage_odds
from identification.gap.search import Search
from identification.gap.twin import baseline_fit, twin_of
from identification.gap.verdict import alternatives, named_effects, shares, verdict_on
from identification.gap.where import drift, gap_map, harmonics
from identification.gap.words import explanation, nearest
from identification.identify import fit_problem
from identification.problem import COORDINATE_COUNT, Piece, Problem
from identification.recordings import Recording
from identification.results import Provenance
from identification.usable import refuse_useless

_CLOCKS = 5e-5
"""[s] to which the channels' clocks and filters are known."""
_LATEST = 3.0
"""[1] of that, beyond which what is later is an effect."""
_REPEATS = 1.1
"""[1] ratio of cycle-to-cycle over high-frequency floor above which something does not repeat."""
_TIED = 0.05
"""[1] probability of a set from which on it is worth telling it apart."""
_MOST_TIED = 3
_NEARER = 0.95
"""[1] part of the error that known effects may leave at most to be spoken of where none is named."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Answer:
    """What `diagnose` found."""

    diagnosis: Diagnosis
    twin: Twin


def diagnose(
    recordings: Sequence[Recording],
    model: Model | None = None,
    *,
    seed: int = 1,
    progress: Progress = lambda what, error: None,
) -> Answer:
    """Diagnose the gap between the law and recordings of one damper.

    Args:
        recordings: one or several logs of one specimen.
        model: a simulation whose own gap is reported too.
        seed: of everything that chance decides.
        progress: told what is fitted and the force error on unseen strokes so far [N].

    Raises:
        NothingToFit: too little, clipped, of different specimens, or no damper's force and motion.
    """
    one_specimen(recordings)
    refuse_useless(recordings)
    cleaned, notes = without_clipping(recordings)
    assembled = assemble(cleaned)
    judge = Judge.of(assembled)
    enough_cycles(judge.cycles)
    sliding_recorded(judge.fitted_pieces())
    problem = diagnosed_problem(assembled, judge.fitted_pieces())
    search = Search(problem, judge, white_floor(assembled.floor), progress)
    search.run()
    return _Report(assembled, judge, search, _final_odds(search), model, notes, seed).answer()


def _final_odds(search: Search) -> Odds:
    """Odds of the sets, those that count fitted on all samples, with each of their effects left out, too."""
    found = odds(search.candidates(), search.full.samples)
    likely = [names for names, p in found.ranked()[:_MOST_TIED] if p > _TIED]
    parts = {names - {name} for names in likely[:1] if len(names) > 1 for name in names}
    for names in {frozenset[str](), *likely, *(p for p in parts if p in search.found)}:
        search.polish(names)
    for _ in range(_MOST_TIED):
        found = odds(search.candidates(), search.full.samples)
        search.polish(found.ranked()[0][0])
    return found


def white_floor(floor: Floor) -> float:
    """The noise [N] that no model explains; what fails to repeat beyond it is for the effects to explain."""
    if floor.cycle_to_cycle is None or floor.cycle_to_cycle > _REPEATS * floor.high_frequency:
        return floor.high_frequency
    return floor.noise


def diagnosed_problem(assembled: Assembled, pieces: tuple[Piece, ...]) -> Problem:
    """The fit of some recordings as a diagnosis takes it: its own floor, and no delay beyond the clocks'."""
    problem = fit_problem(assembled, _CLOCKS)
    return replace(problem, pieces=pieces, noise=white_floor(assembled.floor), delay_limit=_LATEST)


@dataclass(frozen=True)
class _Report:
    """Everything that goes into the document."""

    assembled: Assembled
    judge: Judge
    search: Search
    odds: Odds
    model: Model | None
    notes: list[str]
    seed: int

    def answer(self) -> Answer:
        """The documents."""
        plain = self.search.found[frozenset()]
        likeliest = self.odds.ranked()[0][0]
        named = self.search.found[likeliest]
        floor = self.search.floor
        verdict = verdict_on(plain.unseen, named.unseen, floor, self.odds, likeliest)
        if verdict in ("no_gap", "unexplained"):
            named, likeliest = plain, frozenset()
        gap = self._gap(plain, named, floor)
        if verdict == "no_gap":
            gap = gap.model_copy(update={"shrinkage": None, "shrinkage_ci95": None})
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
        baseline = baseline_fit(self.assembled, self.judge, plain, floor, provenance)
        specimen = baseline.specimen
        return Answer(diagnosis, twin_of(self.assembled, named, baseline, floor, specimen, provenance))

    def _nearest(self, verdict: Verdict, plain: Contender) -> list[str]:
        """What known effects come nearest where none is named, in words."""
        best = min(self.search.found.values(), key=lambda c: c.unseen)
        if verdict != "unexplained" or best.unseen > _NEARER * plain.unseen:
            return []
        return [nearest(sorted(best.names), plain.unseen, best.unseen, self.search.floor)]

    def _gap(self, plain: Contender, named: Contender, floor: float) -> Gap:
        shrunk = self.judge.shrunk(plain.left, named.left, floor)
        return Gap(
            before_n=shrunk.before,
            after_n=shrunk.after,
            noise_floor_n=floor,
            shrinkage=shrunk.value,
            shrinkage_ci95=shrunk.ci95,
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
        tied = [(names, p) for names, p in self.odds.ranked() if p > _TIED][:_MOST_TIED]
        rivals = [self._rival(names, p) for names, p in tied]
        chosen = best_segment(rivals, self._limits(), floor)
        if chosen is None:
            return None
        return NextStroke(
            segment=chosen.segment,
            separates=chosen.separates,
            expected_n=chosen.difference,
            detectability=chosen.detectability,
        )

    def _rival(self, names: frozenset[str], probability: float) -> Rival:
        fit = self.search.found[names].fit
        q = fit.minimum.unknowns[:COORDINATE_COUNT]
        back = np.linalg.pinv(fit.problem.space.slopes(q))
        known = fit.minimum.evaluation.hessian[:COORDINATE_COUNT, :COORDINATE_COUNT]
        return Rival(tuple(sorted(names)), fit.coordinates, fit.active, probability, back.T @ known @ back)

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
