"""Decisions of the report, from stand-ins of candidates, posterior and recording."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identification.damper.effects import EFFECTS, STAGES
from identification.documents import GapMapEntry, Remainder
from identification.gap.data.cycles import Cycles, StrokeCondition
from identification.gap.data.residual_map import Residual
from identification.gap.data.shrinkage import Shrinkage
from identification.gap.fits.candidate import Candidate
from identification.gap.noise.explainable_share import Explained
from identification.gap.outcome import report
from identification.gap.outcome.report import ReportBuilder
from identification.gap.selection.posterior import Posterior
from identification.noise.noise_floor import NoiseFloorEstimate
from tests.support.discovery_documents import make_discovery

FLOOR = 2.0
NONE, SPRING = frozenset(), frozenset({"gas_spring"})
CYCLES = Cycles(np.zeros(8, int), np.arange(8) / 8.0, np.zeros(1, int), (StrokeCondition(0.25, 0.012, 1.5),))


def make_candidate(names, train, held_out, values=3.0):
    """A candidate with errors relative to the floor and constant residuals [N]."""
    fit = SimpleNamespace(effects=tuple(SimpleNamespace(name=name) for name in names))
    ones = np.ones(8)
    residual = Residual(values * ones, ones, 0.25 * ones, np.arange(8.0), ones > 0, ((8, 1.0),))
    return Candidate(fit, residual, train * FLOOR, held_out * FLOOR, 0.0)


def make_builder(
    *,
    baseline=3.0,
    named=1.0,
    benefit=0.5,
    sets=None,
    unknown=0.05,
    partial=None,
    value=0.9,
    low=0.8,
):
    candidates = {
        NONE: make_candidate((), baseline, baseline, baseline * FLOOR),
        SPRING: make_candidate(SPRING, named, named, named * FLOOR),
    }
    noise_model = SimpleNamespace(
        estimate_noise=lambda candidate: 1.9,
        sample_other_runs=lambda candidate, problem: np.ones((3, 8)),
        has_unsteady_cycles=False,
    )
    pool = SimpleNamespace(
        baseline=candidates[NONE],
        candidates=candidates,
        curve=None,
        library=EFFECTS,
        floor=FLOOR,
        no_gap_limits=(1.008 * FLOOR,) * 2,
        noise_model=noise_model,
        problems=SimpleNamespace(full=SimpleNamespace()),
        baseline_excess=8.0,
        compute_excess=lambda candidate: candidate.compute_excess(FLOOR),
    )

    def estimate_shrinkage(before, after, noise, input_noise, chance):
        return Shrinkage(6.0, float(np.mean(input_noise)), value, (low, 0.95), benefit)

    evaluation = SimpleNamespace(
        force=np.zeros(8), estimate_shrinkage=estimate_shrinkage, cycles=CYCLES, pieces=(),
        select_fitted_pieces=lambda: (1.0, 2.0), compute_residual=lambda forces: forces,
        estimate_shares=lambda before, after, without, rmse, noise: {"all": (0.5, (0.4, 0.9))},
        compute_rmse=lambda forces: (sum(forces), 10 * sum(forces)),
    )  # fmt: skip
    posterior = Posterior(sets or {NONE: 0.15, SPRING: 0.8}, unknown)
    dataset = SimpleNamespace(
        drive_unit="V", floor=NoiseFloorEstimate(2.0, 2.0, 1.9, "", 0.05), held_out=(), stretches=()
    )
    partial = None if partial is None else Posterior(partial, 1.0 - sum(partial.values()))
    return ReportBuilder(dataset, evaluation, pool, posterior, partial, None, [], 1)


@pytest.mark.parametrize(
    ("changes", "verdict", "names", "input_noise"),
    [
        ({}, "explained", SPRING, 1.0),
        ({"benefit": 0.0}, "explained", SPRING, 1.0),
        ({"benefit": None}, "explained", SPRING, 1.0),
        ({"benefit": -0.01}, "unexplained", NONE, 0.0),
        ({"benefit": -0.01, "baseline": 1.02}, "no_gap", NONE, 0.0),
        ({"named": 2.9}, "unexplained", NONE, 0.0),
        ({"named": 2.0, "unknown": 0.9}, "partly_explained", SPRING, 1.0),
        ({"named": 2.0, "low": 0.0}, "unexplained", NONE, 0.0),
        ({"named": 2.0, "value": 0.19}, "unexplained", NONE, 0.0),
        ({"named": 2.0, "sets": {NONE: 0.1, SPRING: 0.05}, "unknown": 0.8}, "unexplained", NONE, 0.0),
        (
            {"named": 2.0, "sets": {NONE: 0.1, SPRING: 0.05}, "unknown": 0.8, "partial": {NONE: 0.1, SPRING: 0.6}},
            "partly_explained",
            SPRING,
            1.0,
        ),
        (
            {"named": 1.0, "sets": {NONE: 0.1, SPRING: 0.05}, "unknown": 0.8, "partial": {NONE: 0.1, SPRING: 0.6}},
            "partly_explained",
            SPRING,
            1.0,
        ),
        (
            {"named": 2.9, "sets": {NONE: 0.1, SPRING: 0.05}, "unknown": 0.8, "partial": {NONE: 0.1, SPRING: 0.6}},
            "unexplained",
            NONE,
            0.0,
        ),
        ({"sets": {NONE: 0.8, SPRING: 0.1}, "benefit": -0.01}, "no_gap", NONE, 0.0),
    ],
)
def test_a_set_is_named_if_it_explains_the_gap_and_benefits_another_run(changes, verdict, names, input_noise):
    chosen, named, shrinkage, _ = make_builder(**changes)._choose_named_set()
    assert (chosen, named.names, shrinkage.after) == (verdict, names, input_noise)


@pytest.mark.parametrize(
    ("probability", "verdict", "names"),
    [(0.3, "partly_explained", SPRING), (0.2, "unexplained", NONE)],
    ids=["the next set is nearly as probable", "the next set is much less probable"],
)
def test_the_next_set_is_a_part_where_the_most_probable_one_closes_too_little(probability, verdict, names):
    stop = frozenset({"end_stop"})
    builder = make_builder(
        named=2.0, sets={NONE: 0.1, SPRING: 0.05}, unknown=0.8, partial={stop: 0.5, SPRING: probability}
    )
    builder.pool.candidates[stop] = make_candidate(stop, 2.9, 2.9, 2.9 * FLOOR)
    chosen, named, _, _ = builder._choose_named_set()
    assert (chosen, named.names) == (verdict, names)


def test_the_gap_of_noise_has_no_shrinkage():
    builder = make_builder()
    named, shrinkage = builder.pool.candidates[SPRING], Shrinkage(6.0, 2.0, 0.9, (0.8, 0.95))
    object.__setattr__(builder, "regression", SimpleNamespace(find_explainable_rmse=lambda sets, noise: 1.9))
    gap = builder._build_gap("explained", named, shrinkage, None)
    assert (gap.shrinkage, gap.shrinkage_ci95, gap.noise_floor_n, gap.nominal_n) == (0.9, (0.8, 0.95), 1.9, None)
    assert (gap.before_n, gap.after_n, gap.train_before_n, gap.train_after_n) == (6.0, 2.0, 6.0, 2.0)
    assert (gap.explainable_n, gap.held_out) == (1.9, None)
    # The noise that a named set leaves may lie below the interval from the recording.
    assert (gap.noise_floor_ci95, gap.floor_known) == (pytest.approx((1.9, 2.098)), True)
    gap = builder._build_gap("no_gap", named, shrinkage, None)
    assert (gap.shrinkage, gap.shrinkage_ci95) == (None, None)


def test_the_floor_is_only_bounded_where_what_does_not_repeat_with_the_cycles_is_not_noise():
    builder = make_builder()
    model = builder.pool.noise_model
    model.has_unsteady_cycles, model.estimate = True, NoiseFloorEstimate(1.5, 1.9, 1.5, "high frequency")
    object.__setattr__(builder, "regression", SimpleNamespace(find_explainable_rmse=lambda sets, noise: 1.9))
    gap = builder._build_gap("unexplained", builder.pool.baseline, Shrinkage(6.0, 6.0, 0.0, (0.0, 0.0)), None)
    assert (gap.noise_floor_ci95, gap.floor_known) == ((1.5, 6.0), False)


def test_a_given_simulation_is_compared_on_the_held_out_cycles():
    builder = make_builder()
    with_model = ReportBuilder(
        builder.dataset, builder.evaluation, builder.pool, builder.posterior, None,
        SimpleNamespace(simulate_force=lambda piece: 3.0 * piece), [], 1,
    )  # fmt: skip
    assert with_model._compute_nominal_rmse() == 90.0


@pytest.mark.parametrize(
    ("verdict", "named", "noted"),
    [("unexplained", 2.8, True), ("unexplained", 2.9, False), ("explained", 1.0, False)],
)
def test_the_nearest_effects_are_noted_if_they_reduce_an_unexplained_error_by_a_twentieth(verdict, named, noted):
    notes = make_builder(named=named)._describe_nearest(verdict)
    assert bool(notes) == noted
    if noted:
        assert "from 6 to 5.6 N, 2.8 times" in notes[0]


@pytest.mark.parametrize(
    ("baseline", "sets", "unknown", "stage"),
    [
        (3.0, {NONE: 0.15, SPRING: 0.8}, 0.0, "damper"),
        (1.0, {NONE: 0.15, SPRING: 0.8}, 0.0, None),  # at the floor
        (3.0, {NONE: 0.96, SPRING: 0.04}, 0.0, None),
        (3.0, {NONE: 0.94, SPRING: 0.06}, 0.0, "damper"),
    ],
)
def test_a_gap_has_the_most_probable_stage(baseline, sets, unknown, stage):
    builder = make_builder(baseline=baseline, sets=sets, unknown=unknown)
    object.__setattr__(builder.pool.baseline, "held_out_rmse", baseline * FLOOR)
    location = _locate_without_regression(builder)
    assert location.stage == stage
    assert set(location.stages) == set(STAGES)
    assert location.map[0].gap_n == pytest.approx(np.sqrt((baseline * FLOOR) ** 2 - FLOOR**2))


def _locate_without_regression(builder):
    builder = SimpleNamespace(
        pool=builder.pool, evaluation=builder.evaluation, posterior=builder.posterior,
        regression=SimpleNamespace(explain=lambda candidate: Explained(0.0, {})),
    )  # fmt: skip
    return ReportBuilder._locate_gap(builder, builder.posterior)


@pytest.mark.parametrize(
    ("share", "variables", "dependence"),
    [
        (0.31, [], "a flexible model of stroke and drive explains 31% of it."),
        (
            0.31,
            ["velocity", "travel_since_reversal", "time"],
            "a flexible model of stroke and drive explains 31% of it, mostly from velocity and travel since "
            "reversal.",
        ),
        (0.3, ["velocity"], "it does not correlate with any"),
    ],
)
def test_the_remainder_is_located_in_millimetres(share, variables, dependence):
    entry = GapMapEntry(drive=0.25, amplitude_m=0.012, frequency_hz=1.5, phase=0.25, gap_n=5.66)
    remainder = Remainder(
        gap_n=4.0, explainable=share, not_repeating=None, stage=None, map=[entry], variables=variables
    )
    text = make_builder()._describe_place(remainder)
    assert text.startswith(f"The remainder is largest at 0.25 V, 12 mm and 1.5 Hz (5.66 N), and {dependence}")
    assert make_builder()._describe_place(None) == ""


VERDICTS = ("no_gap", "explained", "partly_explained", "unexplained")
OFFER = "the option --discover searches for a cause outside the library"
NEEDLESS = "no cause outside the library was searched for, because nothing is left to explain"
NO_CURVE = "no curve at any place closes part of the gap on held-out strokes, so none is reported"


@pytest.mark.parametrize("verdict", VERDICTS)
@pytest.mark.parametrize("discovers", [False, True])
def test_a_note_offers_the_search_or_has_its_result(verdict, discovers):
    builder = replace(make_builder(), discovers=discovers)
    is_open = verdict in ("partly_explained", "unexplained")
    expected = {(False, False): [], (False, True): [OFFER], (True, False): [NEEDLESS], (True, True): [NO_CURVE]}
    assert builder._describe_search(verdict, None) == expected[discovers, is_open]
    if discovers and is_open:
        (note,) = builder._describe_search(verdict, make_discovery())
        assert "the formula a*displacement**2 at the damper gain" in note
        assert "from 6 to 2.75 N" in note


@pytest.mark.parametrize("verdict", VERDICTS)
@pytest.mark.parametrize("discovers", [False, True])
def test_a_cause_is_searched_for_if_it_is_wanted_and_something_is_left(monkeypatch, verdict, discovers):
    builder, asked, settled = replace(make_builder(), discovers=discovers), [], []
    effect = SimpleNamespace(candidate="fitted")
    monkeypatch.setattr(report, "discover_effect", lambda *arguments: asked.append(arguments) or effect)
    monkeypatch.setattr(report, "settle_floor", lambda pool, candidates: settled.append(candidates))
    named = builder.pool.baseline
    found = builder._discover(verdict, named)
    if discovers and verdict in ("partly_explained", "unexplained"):
        assert (found, asked) == (effect, [(builder.pool, named)])
        assert settled == [(named, "fitted")]
    else:
        assert (found, asked, settled) == (None, [], [])


def test_without_a_found_cause_the_floor_stays(monkeypatch):
    builder = replace(make_builder(), discovers=True)
    monkeypatch.setattr(report, "discover_effect", lambda *arguments: None)
    monkeypatch.setattr(report, "settle_floor", lambda *arguments: pytest.fail("the floor was changed"))
    assert builder._discover("unexplained", builder.pool.baseline) is None


def test_without_a_cause_there_is_no_document():
    assert make_builder()._build_discovery(None, None) is None


def test_the_shrinkage_of_a_cause_is_that_of_its_own_set(monkeypatch):
    builder = make_builder()
    found = SimpleNamespace(candidate=builder.pool.candidates[SPRING])
    monkeypatch.setattr(report, "build_discovery", lambda *arguments: arguments)
    given, named, shrinkage, unit = builder._build_discovery(found, builder.pool.baseline)
    assert (given, named, unit) == (found, builder.pool.baseline, "V")
    # The input noise of the set counts, which the law alone does not have.
    assert shrinkage.after == 1.0
