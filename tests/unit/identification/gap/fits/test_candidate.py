"""The excess of a candidate counts the worse of fitted and held-out samples."""

import pytest

from identification.gap.fits import Candidate

FLOOR = 2.0


def make_candidate(train, held_out, chance=0.01):
    """A candidate with these errors relative to the floor."""
    return Candidate(None, None, train * FLOOR, held_out * FLOOR, chance)


@pytest.mark.parametrize(("train", "held_out", "excess"), [(2.0, 1.0, 3.0), (1.0, 2.0, 2.99), (1.0, 1.0, 0.0)])
def test_the_excess_is_the_larger_of_both_beyond_chance(train, held_out, excess):
    assert make_candidate(train, held_out).compute_excess(FLOOR) == pytest.approx(excess)


def test_the_relative_excess_is_the_larger_share_of_both_gaps():
    baseline = make_candidate(3.0, 2.0, 0.0)
    hides_train = make_candidate(1.0, 1.5, 0.0)
    share = (1.5**2 - 1.0) / (2.0**2 - 1.0)
    assert hides_train.compute_relative_excess(baseline, FLOOR) == pytest.approx(share * 8.0)
    assert baseline.compute_relative_excess(baseline, FLOOR) == pytest.approx(8.0)


def test_without_a_gap_on_both_sides_the_excess_itself_counts():
    baseline, candidate = make_candidate(3.0, 1.05), make_candidate(1.2, 1.0)
    assert candidate.compute_relative_excess(baseline, FLOOR) == candidate.compute_excess(FLOOR)


@pytest.mark.parametrize(
    ("train", "held_out", "chance", "reaches"),
    [(1.04, 1.04, 0.0, True), (1.06, 1.0, 0.5, False), (1.0, 1.06, 0.0, False), (1.0, 1.06, 0.05, True)],
)
def test_the_held_out_error_reaches_the_floor_within_chance(train, held_out, chance, reaches):
    assert make_candidate(train, held_out, chance).reaches_floor(FLOOR) == reaches
