"""The diagnosis of one or several logs: floor, where, which, how far, and the stroke that would tell more."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from identification.assemble import Assembled, assemble
from identification.gap.checks import enough_cycles, one_specimen, sliding_recorded, without_clipping
from identification.gap.exchange import exchange_mounting
from identification.gap.floor import Floor
from identification.gap.further import look_further
from identification.gap.hearing import Hearing
from identification.gap.judge import Judge
from identification.gap.model import Model
from identification.gap.posterior import Odds
from identification.gap.report import MOST_TIED, TIED, Answer, Report
from identification.gap.search import Search
from identification.gap.witness import hear
from identification.identify import fit_problem
from identification.piece import Piece
from identification.problem import Problem
from identification.recordings import Recording
from identification.threads import one_thread
from identification.usable import refuse_useless

_CLOCKS = 5e-5
"""[s] to which the channels' clocks and filters are known."""
_LATEST = 3.0
"""[1] of that, beyond which what is later is an effect."""
_REPEATS = 1.1
"""[1] ratio of cycle-to-cycle over high-frequency floor above which something does not repeat."""
_MOST_POLISHED = 6
"""Sets that are fitted on all samples because the one before them came out worse there."""

_BLAMED = 0.5
"""[1] probability of something unknown from which on the best known set is fitted in full before that is said."""
_FURTHER = 2
"""Effects that are added to the likeliest set at most once it has been fitted in full."""

Progress = Callable[[str, float], None]


def diagnose(
    recordings: Sequence[Recording],
    model: Model | None = None,
    *,
    seed: int = 1,
    witness: bool = False,
    progress: Progress = lambda what, error: None,
) -> Answer:
    """Diagnose the gap between the law and recordings of one damper.

    Args:
        recordings: one or several logs of one specimen.
        model: a simulation whose own gap is reported too.
        seed: of everything that chance decides.
        witness: whether a network is trained with the effects that are named, to see whether it agrees.
        progress: told what is fitted and the force error on unseen strokes so far [N].

    Raises:
        NothingToFit: too little, clipped, of different specimens, or no damper's force and motion.
    """
    return diagnose_prepared(prepare(recordings), model, seed=seed, witness=witness, progress=progress)


@dataclass(frozen=True)
class Prepared:
    """Recordings as a diagnosis takes them."""

    assembled: Assembled
    judge: Judge
    notes: list[str]
    """What was left out of them, in words."""


def prepare(recordings: Sequence[Recording]) -> Prepared:
    """Recordings of one damper, cleaned, smoothed and cut into cycles.

    Raises:
        NothingToFit: as ``diagnose`` does.
    """
    with one_thread():
        one_specimen(recordings)
        refuse_useless(recordings)
        cleaned, notes = without_clipping(recordings)
        assembled = assemble(cleaned)
        judge = Judge.of(assembled)
    enough_cycles(judge.cycles)
    sliding_recorded(assembled.pieces)
    return Prepared(assembled, judge, [*assembled.notes, *judge.notes, *notes])


def diagnose_prepared(
    prepared: Prepared,
    model: Model | None = None,
    *,
    seed: int = 1,
    witness: bool = False,
    progress: Progress = lambda what, error: None,
) -> Answer:
    """``diagnose`` for recordings that are prepared already."""
    assembled, judge = prepared.assembled, prepared.judge
    problem = diagnosed_problem(assembled, judge.fitted_pieces())
    hearing = Hearing(white_floor(assembled.floor), assembled.stretches, seed)
    search = Search(problem, judge, hearing, _wandering(assembled), progress)
    with one_thread():
        search.run()
        found, notes = _final_odds(search), [*prepared.notes, *search.notes]
        answer = Report(assembled, judge, search, found, model, notes, seed).answer()
        named = answer.diagnosis.effects if witness else []
        if not named:
            return answer
        fit = search.found[frozenset(effect.name for effect in named)].fit
        said = hear(fit, problem.with_effects(fit.effects), assembled.drive_unit, seed, progress)
    return replace(answer, diagnosis=answer.diagnosis.model_copy(update={"witness": said}))


def _wandering(assembled: Assembled) -> float:
    """[s] to which the logs say that their clocks are known, where that is worse than is taken for granted."""
    return assembled.clock_skew if assembled.clock_skew > _CLOCKS else 0.0


def _final_odds(search: Search) -> Odds:
    """Odds of the sets, those that count fitted on all samples, with each of their effects left out, too."""
    found = search.odds()
    likely = [names for names, p in found.ranked()[:MOST_TIED] if p > TIED]
    if found.unknown > _BLAMED:
        likely.append(search.best().names)
    parts = {names - {name} for names in likely[:1] if len(names) > 1 for name in names}
    for names in {frozenset[str](), *likely, *(p for p in parts if p in search.found)}:
        search.polish(names)
    for _ in range(_MOST_POLISHED):
        found = search.odds()
        likeliest = found.ranked()[0][0]
        if likeliest in search.complete:
            break
        search.polish(likeliest)
    for _ in range(_FURTHER):
        if not look_further(search, likeliest):
            break
        likeliest = search.odds().ranked()[0][0]
        search.polish(likeliest)
    exchange_mounting(search, likeliest)
    return search.odds()


def white_floor(floor: Floor) -> float:
    """The noise [N] that no model explains; what fails to repeat beyond it is for the effects to explain."""
    if floor.cycle_to_cycle is None or floor.cycle_to_cycle > _REPEATS * floor.high_frequency:
        return floor.high_frequency
    return floor.noise


def diagnosed_problem(assembled: Assembled, pieces: tuple[Piece, ...]) -> Problem:
    """The fit of some recordings as a diagnosis takes it.

    Its own floor, no delay beyond the clocks', and a force offset of each further log: the load cell has another
    zero in every run.
    """
    problem, own = fit_problem(assembled, _CLOCKS), ("offset",) if len(assembled.recordings) > 1 else ()
    return replace(problem, pieces=pieces, noise=white_floor(assembled.floor), delay_limit=_LATEST, own=own)
