"""The verdict, from the errors of sets on fitted and held-out samples and their posterior."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.documents import EffectSet
from identification.fitting import EffectModel
from identification.gap.data.shrinkage import Shrinkage
from identification.gap.fits.candidate import NO_GAP_RATIO, Candidate
from identification.gap.outcome.verdict import (
    build_named_effects,
    choose_named_set,
    decide_unnamed_verdict,
    decide_verdict,
    is_ambiguous,
    list_alternatives,
    list_likely_sets,
)
from identification.gap.selection.posterior import Posterior

FLOOR = 2.0


def make_candidate(names, train, held_out):
    """A set with these errors on fitted and held-out samples, relative to the floor."""
    fit = SimpleNamespace(effects=tuple(SimpleNamespace(name=name) for name in names))
    return Candidate(fit, None, train * FLOOR, held_out * FLOOR, 0.01)


def decide(named, train, held_out, *, baseline=(3.0, 3.0), unknown=0.1):
    candidate = make_candidate(named, train, held_out)
    posterior = Posterior({candidate.names: 1.0 - unknown}, unknown)
    return decide_verdict(make_candidate((), *baseline), candidate, FLOOR, (NO_GAP_RATIO * FLOOR,) * 2, posterior)


@pytest.mark.parametrize(
    ("train", "held_out", "unknown", "verdict"),
    [
        (1.01, 1.01, 0.1, "explained"),
        (1.049, 1.049, 0.9, "explained"),  # at the floor
        (1.18, 1.18, 0.1, "explained"),  # 95 % of the excess variance
        (1.18, 1.18, 0.9, "partly_explained"),
        (1.2, 1.2, 0.1, "partly_explained"),
        (2.7, 2.7, 0.1, "partly_explained"),  # 21 %
        (2.73, 2.73, 0.1, "unexplained"),
        (1.6, 1.6, 0.9, "partly_explained"),
    ],
)
def test_the_verdict_follows_the_part_of_the_gap_that_is_closed(train, held_out, unknown, verdict):
    assert decide(("gas_spring",), train, held_out, unknown=unknown) == verdict


@pytest.mark.parametrize(("train", "held_out"), [(1.0, 2.0), (2.0, 1.0)])
def test_a_set_that_closes_the_gap_on_one_side_alone_does_not_explain_it(train, held_out):
    assert decide(("force_drift",), train, held_out) == "partly_explained"


@pytest.mark.parametrize(
    ("train", "held_out", "verdict"),
    [(2.9, 2.0, "partly_explained"), (3.01, 2.0, "unexplained"), (2.9, 2.73, "unexplained")],
)
def test_a_set_is_named_as_a_part_if_it_closes_a_fifth_of_the_gap_on_unseen_strokes(train, held_out, verdict):
    assert decide(("force_drift",), train, held_out) == verdict


def test_without_a_named_set_there_is_no_gap_unless_an_unknown_cause_is_probable():
    assert decide((), 1.005, 1.02, baseline=(1.005, 1.02)) == "no_gap"
    assert decide((), 3.0, 3.0, unknown=0.9) == "unexplained"
    assert decide(("gas_spring",), 1.0, 1.0, baseline=(1.0, 1.007)) == "no_gap"


def test_a_gap_on_the_fitted_samples_alone_is_one():
    assert decide(("coil_lag",), 1.005, 1.0, baseline=(1.08, 1.0)) == "explained"
    assert decide(("coil_lag",), 1.005, 1.0, baseline=(1.02, 1.0)) == "no_gap"


def test_an_unnamed_set_leaves_a_gap_only_where_there_is_one():
    assert decide_unnamed_verdict(make_candidate((), 1.005, 1.025), FLOOR, (NO_GAP_RATIO * FLOOR,) * 2) == "no_gap"
    assert (
        decide_unnamed_verdict(make_candidate((), 1.3, 1.02), FLOOR, (NO_GAP_RATIO * FLOOR,) * 2) == "unexplained"
    )


def test_alternatives_are_the_most_probable_other_sets():
    sets = {frozenset({name}): p for name, p in zip("abcdef", (0.5, 0.2, 0.1, 0.05, 0.03, 0.001), strict=True)}
    alternatives = list_alternatives(Posterior(sets, 0.1), frozenset({"a"}))
    assert [(a.effects, a.probability) for a in alternatives] == [(["b"], 0.2), (["c"], 0.1), (["d"], 0.05)]


def test_likely_sets_have_at_least_half_of_the_largest_probability():
    sets = {frozenset({name}): p for name, p in zip("abcd", (0.1, 0.4, 0.2, 0.19), strict=True)}
    assert list_likely_sets(Posterior(sets, 0.1)) == [frozenset({"b"}), frozenset({"c"})]


@pytest.mark.parametrize(("probabilities", "expected"), [((0.3, 0.4), 0.7), ((0.6, 0.41), 1.0)])
def test_a_named_effect_has_its_probability_in_all_sets_and_an_interval(probabilities, expected):
    models = (EffectModel.from_name("gas_spring"), EffectModel.from_name("moving_mass", "rigid"))
    actives = [SimpleNamespace(values=m.form.starts[0]) for m in models]
    deviations = {m.name: dict.fromkeys((q.symbol for q in m.quantities), 0.5) for m in models}
    fit = SimpleNamespace(effects=models, active_effects=actives, deviations=deviations)
    sets = zip(({"gas_spring"}, {"gas_spring", "moving_mass"}), probabilities, strict=True)
    posterior = Posterior({frozenset(names): p for names, p in sets}, 0.0)
    shares = {"gas_spring": (0.2, (0.1, 0.3)), "moving_mass": (0.8, (0.6, 1.1))}
    mass, spring = build_named_effects(SimpleNamespace(fit=fit), posterior, shares, "V")
    assert (mass.name, mass.stage, mass.form, mass.share, mass.note) == (
        "moving_mass",
        "mounting",
        "rigid",
        0.8,
        "",
    )
    assert (mass.probability, spring.probability) == pytest.approx((probabilities[1], expected))
    assert (mass.place, mass.variable, mass.share_ci95) == ("mounting", "acceleration", (0.6, 1.1))
    value = mass.parameters["mass"]
    assert value.unit == "kg"
    assert value.ci95[1] == pytest.approx(value.value + 1.96 * 0.5)


@pytest.mark.parametrize(("probability", "ambiguous"), [(0.39, True), (0.41, False)])
def test_an_answer_is_ambiguous_if_an_alternative_is_half_as_probable(probability, ambiguous):
    alternatives = [EffectSet(effects=["coil_lag"], probability=0.1), EffectSet(effects=[], probability=0.2)]
    assert is_ambiguous(alternatives, probability) == ambiguous


@pytest.mark.parametrize(
    ("empty", "exceeds_noise", "verdict"),
    [
        (0.04, True, "explained"),
        (0.06, True, "no_gap"),  # that nothing is missing is not improbable
        (0.04, False, "no_gap"),
    ],
)
def test_certain_effects_are_named_inside_the_interval_of_the_floor(empty, exceeds_noise, verdict):
    candidate, baseline = make_candidate(("gas_spring",), 1.0, 1.0), make_candidate((), 1.06, 1.06)
    posterior = Posterior({candidate.names: 0.9, frozenset(): empty}, 0.1 - empty)
    pool = SimpleNamespace(
        baseline=baseline,
        candidates={candidate.names: candidate},
        curve=None,
        floor=FLOOR,
        no_gap_limits=(1.07 * FLOOR,) * 2,
        comparison=SimpleNamespace(exceeds_noise=lambda before, after: exceeds_noise),
        noise_model=SimpleNamespace(
            estimate_noise=lambda c: FLOOR, sample_other_runs=lambda c, problem: np.zeros((1, 4))
        ),
        problems=SimpleNamespace(full=None),
    )
    shrinkage = Shrinkage(0.7, 0.1, 0.9, (0.5, 0.95), 0.5)
    evaluation = SimpleNamespace(force=np.zeros(4), estimate_shrinkage=lambda *errors: shrinkage)
    chosen = choose_named_set(pool, evaluation, posterior, None)
    assert chosen.verdict == verdict
    assert chosen.candidate is (candidate if verdict == "explained" else baseline)


@pytest.mark.parametrize(
    ("has_curve", "unknown", "verdict"),
    [(True, 0.9, "partly_explained"), (True, 0.05, "explained"), (False, 0.9, "explained")],
)
def test_a_more_probable_curve_leaves_a_set_at_the_floor_as_a_part(has_curve, unknown, verdict):
    baseline, candidate = make_candidate((), 2.0, 2.0), make_candidate(("viscous_heating",), 1.0, 1.0)
    posterior = Posterior({candidate.names: 1.0 - unknown}, unknown)
    limits = (1.01 * FLOOR,) * 2
    found = decide_verdict(baseline, candidate, FLOOR, limits, posterior, has_unlisted_curve=has_curve)
    assert found == verdict


def test_certain_effects_that_close_too_little_are_not_named_inside_the_interval_of_the_floor():
    baseline, candidate = make_candidate((), 1.06, 1.06), make_candidate(("gas_spring",), 1.057, 1.057)
    posterior = Posterior({candidate.names: 0.9, frozenset(): 0.01}, 0.09)
    limits = (1.07 * FLOOR,) * 2
    assert decide_verdict(baseline, candidate, 0.9 * FLOOR, limits, posterior, is_certain=True) == "unexplained"


def test_a_baseline_within_the_interval_of_the_floor_has_no_gap():
    candidate, baseline = make_candidate(("gas_spring",), 1.0, 1.0), make_candidate((), 1.06, 1.06)
    posterior = Posterior({candidate.names: 0.9}, 0.1)
    assert decide_verdict(baseline, candidate, FLOOR, (1.07 * FLOOR,) * 2, posterior) == "no_gap"
    assert decide_verdict(baseline, candidate, FLOOR, (1.05 * FLOOR,) * 2, posterior) == "explained"
    assert decide_unnamed_verdict(baseline, FLOOR, (1.07 * FLOOR,) * 2) == "no_gap"
    assert decide_unnamed_verdict(baseline, FLOOR, (1.05 * FLOOR,) * 2) == "unexplained"
