"""Mounting effects: backlash and compliance, which are fitted independently of their screening.

While the law's yield displacement is wrong, the law resembles either, and no gain is predicted for either. Each is
started at several sizes. Together with other effects, richer forms are only fitted if a simpler one closes part of
the gap.
"""

from collections.abc import Mapping, Sequence

from identification.fitting import EffectModel
from identification.gap.fits import Candidate
from identification.gap.selection.candidate_pool import CandidatePool
from identification.gap.selection.neighbours import fit_extension
from identification.gap.selection.screening import ScreeningResult, compute_expected_gain


def is_mounting_promising(pool: CandidatePool, parent: Candidate, name: str) -> bool:
    """Return False for a set with other effects if the mounting effect alone closed next to none of the gap."""
    alone = pool.candidates.get(frozenset({name}))
    return not parent.names or alone is None or closes_part(pool, alone)


def closes_part(pool: CandidatePool, single: Candidate) -> bool:
    """Return True if an effect alone closes a part of the gap that is worth a fit with others."""
    return pool.compute_excess(single) < pool.settings.helpful_mounting_share * pool.baseline_excess


def fit_mounting(pool: CandidatePool, parent: Candidate, gains: Sequence[ScreeningResult], name: str) -> None:
    """Fit a set with one mounting effect; ``gains`` come from the screening of that set."""
    forms = [g for g in gains if g.effect_model.name == name]
    # A pin that the damper follows and a free one act differently: the gain of one does not predict the other.
    for action in dict.fromkeys(g.effect_model.form.action for g in forms):
        group = [g for g in forms if g.effect_model.form.action == action]
        _fit_forms(pool, parent, sorted(group, key=lambda g: len(g.effect_model.quantities)))


def _fit_forms(pool: CandidatePool, parent: Candidate, gains: Sequence[ScreeningResult]) -> None:
    """Fit a set with the forms of a mounting effect, the simplest first.

    With other effects, after a form that closes next to nothing, only those follow that a linear step expects to
    close enough. Alone, all forms are fitted: a joint that stiffens under load may not resemble a linear spring.
    """
    settings = pool.settings
    simpler: dict[str, float] = {}
    is_helpful = True
    for gain in gains:
        if parent.names and gain.effect_model.form.action == "displacement_backlash":
            continue  # Its contacts need a high rate, and a free pin shows together with other effects as well.
        if pool.is_at_floor(pool.find_best()) or pool.compute_excess(parent) < settings.mounting_excess:
            return
        if not is_helpful and compute_expected_gain(gain) < 1.0 - settings.richer_form_share:
            continue
        values = [*_make_starts(simpler, gain.effect_model), *gain.effect_model.starts]
        extended = fit_extension(pool, parent, gain, values)
        simpler = extended.fit.values[gain.effect_model.name]
        remaining = pool.compute_excess(extended) / pool.compute_excess(parent)
        is_helpful = not parent.names or remaining < settings.richer_form_share


def _make_starts(simpler: Mapping[str, float], model: EffectModel) -> list[tuple[float, ...]]:
    """Return starts of a richer form with the fitted values of the parameters that a simpler form has too."""
    if not simpler:
        return []
    symbols = [q.symbol for q in model.quantities]
    starts = {tuple(simpler.get(s, v) for s, v in zip(symbols, start, strict=True)) for start in model.starts}
    return sorted(starts)
