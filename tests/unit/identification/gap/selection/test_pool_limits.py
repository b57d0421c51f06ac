"""Limits of the candidate pool, with stand-ins of problems and fits."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.damper import LIBRARY_SIZE
from identification.gap.fits.candidate import Candidate
from identification.gap.selection.candidate_pool import CandidatePool
from identification.gap.selection.search_problems import SearchProblems
from identification.noise import NoiseFloorEstimate

FLOOR = 2.0


def make_candidate(names, train, held_out, chance=0.0):
    effects = tuple(SimpleNamespace(name=name) for name in names)
    return Candidate(SimpleNamespace(effects=effects, active_effects=()), None, train, held_out, chance)


def make_pool(problem=None, evaluation=None, rate=10.0, **settings):
    settings = {"screening_rate": 100.0, "fit_budget": 3} | settings
    problem = SimpleNamespace() if problem is None else problem
    problem.space = SimpleNamespace(scales=SimpleNamespace(rate=rate, damper_size=LIBRARY_SIZE))
    noise_model = SimpleNamespace(floor=FLOOR, estimate=NoiseFloorEstimate(FLOOR, None, FLOOR, ""))
    pool = CandidatePool(SearchProblems(problem, SimpleNamespace(**settings)), evaluation, noise_model)
    pool.candidates[frozenset()] = make_candidate((), 6.0, 6.0)
    return pool


@pytest.mark.parametrize(("fits", "spent"), [(2, False), (3, True), (4, True)])
def test_the_budget_is_a_number_of_fits(fits, spent):
    pool = make_pool()
    pool.fit_count = fits
    assert pool.budget_spent == spent


@pytest.mark.parametrize(("rmse", "negligible"), [(2.08, True), (2.11, False)])
def test_an_excess_is_negligible_below_a_constant_and_a_share_of_the_baseline(rmse, negligible):
    # The baseline has an excess of 8; the limit is 0.02 + 0.01 x 8 = 0.1, at an error of 2.098.
    pool = make_pool(negligible_share=0.01, negligible_excess=0.02)
    assert pool.baseline_excess == 8.0
    assert pool.is_at_floor(make_candidate(("end_stop",), rmse, rmse)) == negligible


def test_the_best_candidate_has_the_smallest_excess():
    pool = make_pool()
    pool.candidates[frozenset({"a"})] = make_candidate("a", 2.5, 3.5)
    pool.candidates[frozenset({"b"})] = make_candidate("b", 3.0, 3.0)
    assert pool.find_best().names == {"b"}


def make_evaluation(held_out, usable):
    return SimpleNamespace(held_out_samples=np.array(held_out, bool), usable=np.array(usable, bool))


def test_the_floor_of_the_evidence_lies_below_the_residual_of_every_candidate():
    # One of four usable samples is held out: 0.75 x 1 + 0.25 x 2.25 = 1.3125 is below the floor of 4.
    evaluation = make_evaluation([0, 1, 0, 0, 0], [1, 1, 1, 1, 0])
    x = SimpleNamespace(excitation=SimpleNamespace(displacement=np.zeros(3)))
    pool = make_pool(SimpleNamespace(pieces=[x]), evaluation)
    pool.candidates[frozenset({"end_stop"})] = make_candidate(("end_stop",), 1.0, 1.5)
    evidence = {e.names: e for e in pool.collect_evidence()}
    assert evidence[frozenset()].excess == pytest.approx(36.0 / 1.3125 - 1.0)
    # The larger share of both splits: 0.9375 / 34.6875 of the held-out gap.
    assert evidence[frozenset({"end_stop"})].excess == pytest.approx(0.9375 / 34.6875 * (36.0 / 1.3125 - 1.0))
    assert evidence[frozenset()].weight == 1.0


class Problem(SimpleNamespace):
    """A problem of pieces that returns the factor of its decimation."""

    def make_fast(self):
        return self

    def decimate(self, factor):
        return factor


@pytest.mark.parametrize(
    ("rates", "length", "motion", "factor"),
    [
        ((1000.0, 500.0), 1000, 10.0, 4),  # 1000 Hz to the rate of 250 Hz
        ((1000.0, 500.0), 1000, 1.0, 4),  # the electronics stay as fast
        ((1000.0, 500.0), 1000, 20.0, 2),  # a motion of twice the usual rate needs twice the samples
        ((1000.0,), 60_000, 10.0, 6),  # 60 000 samples to the length of a long recording
        ((1000.0,), 900_000, 10.0, 10),  # not below the screening rate of 100 Hz
        ((1000.0,), 900_000, 20.0, 5),
        ((100.0,), 1000, 10.0, 1),
        ((100.0,), 60_000, 1.0, 6),  # a slow motion needs a tenth of the usual samples
        ((100.0,), 60_000, 10.0, 1),
    ],
)
def test_data_are_decimated_by_rate_and_length(rates, length, motion, factor):
    pieces = [SimpleNamespace(excitation=SimpleNamespace(rate=r), force=np.zeros(length)) for r in rates]
    pool = make_pool(Problem(pieces=pieces), rate=motion, decimation_rate=250.0, long_recording=10_000)
    assert pool.problems.decimated == factor


@pytest.mark.parametrize(("held_out", "chance"), [([1] * 8 + [0] * 2, 1.0), ([0] * 10, 2.0 * np.sqrt(2.0))])
def test_chance_is_two_deviations_of_the_variance_of_the_held_out_samples(held_out, chance):
    evaluation = make_evaluation(held_out, [1] * 10)
    evaluation.compute_residual = lambda forces: forces[0]
    evaluation.compute_rmse = lambda residual: (3.0, 4.0)
    excitation = SimpleNamespace(time=np.arange(3.0), sampled_drive=np.zeros(3), rate=1.0)
    problem = SimpleNamespace(
        pieces=(SimpleNamespace(excitation=excitation, force=np.zeros(3)),),
        replace_effects=lambda effects: SimpleNamespace(simulate=lambda unknowns: [unknowns]),
    )
    fit = SimpleNamespace(effects=(), active_effects=(), minimum=SimpleNamespace(unknowns=np.arange(3.0)))
    candidate = make_pool(problem, evaluation).evaluate(fit)
    assert (list(candidate.residual), candidate.train_rmse, candidate.held_out_rmse) == ([0.0, 1.0, 2.0], 3.0, 4.0)
    assert candidate.chance_excess == pytest.approx(chance)


@pytest.mark.parametrize("longest", [0, 1, 2])
def test_the_mains_frequency_is_found_in_the_valid_samples_of_the_longest_stretch(longest):
    rate, lengths = 1000.0, [2000, 2000, 2000]
    lengths[longest] = 4000
    lines = [47.0, 53.0, 61.0]
    parts = [np.sin(2 * np.pi * f * np.arange(n) / rate) for f, n in zip(lines, lengths, strict=True)]
    values, valid = np.concatenate(parts), np.ones(8000, bool)
    start = sum(lengths[:longest])
    valid[start], values[start] = False, 1e6
    pieces = [SimpleNamespace(force=p, excitation=SimpleNamespace(rate=rate)) for p in parts]
    parent = SimpleNamespace(residual=SimpleNamespace(values=values, valid=valid))
    found = make_pool(SimpleNamespace(pieces=pieces))._find_mains_frequency(parent)
    assert found == pytest.approx(lines[longest], abs=0.1)
