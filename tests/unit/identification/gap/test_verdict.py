"""The answer in a word, from what sets leave on seen and on unseen strokes."""

from types import SimpleNamespace

import pytest

from identification.gap.contender import Contender
from identification.gap.posterior import Odds
from identification.gap.verdict import verdict_on, without_promise

FLOOR = 2.0


def contender(names, seen, unseen):
    """A set that leaves so many floors on seen and on unseen strokes."""
    fit = SimpleNamespace(effects=tuple(SimpleNamespace(name=name) for name in names))
    return Contender(fit, None, seen * FLOOR, unseen * FLOOR, 0.01)


def word(named, seen, unseen, *, plain=(3.0, 3.0), unknown=0.1):
    chosen = contender(named, seen, unseen)
    odds = Odds({chosen.names: 1.0 - unknown}, unknown)
    return verdict_on(contender((), *plain), chosen, FLOOR, odds)


@pytest.mark.parametrize(
    ("seen", "unseen", "unknown", "said"),
    [
        (1.01, 1.01, 0.1, "explained"),
        (1.2, 1.2, 0.1, "explained"),
        (1.6, 1.6, 0.1, "partly_explained"),
        (2.9, 2.9, 0.1, "unexplained"),
        (1.6, 1.6, 0.9, "unexplained"),
    ],
)
def test_the_more_of_the_gap_is_taken_the_better_it_is_explained(seen, unseen, unknown, said):
    assert word(("gas_spring",), seen, unseen, unknown=unknown) == said


@pytest.mark.parametrize(("seen", "unseen"), [(1.0, 2.0), (2.0, 1.0)])
def test_a_set_that_hides_the_gap_on_one_side_alone_does_not_explain_it(seen, unseen):
    assert word(("force_drift",), seen, unseen) == "partly_explained"
    assert word(("force_drift",), seen, unseen, unknown=0.9) == "unexplained"


@pytest.mark.parametrize(
    ("named", "unknown", "said"), [(0.25, 0.48, "unexplained"), (0.48, 0.25, "partly_explained")]
)
def test_what_something_unknown_is_likelier_than_is_not_named(named, unknown, said):
    chosen, plain = contender(("fixture_compliance",), 1.6, 1.6), contender((), 3.0, 3.0)
    assert verdict_on(plain, chosen, FLOOR, Odds({chosen.names: named}, unknown)) == said


def test_nothing_named_is_no_gap_unless_something_unknown_is_likely():
    assert word((), 1.005, 1.02, plain=(1.005, 1.02)) == "no_gap"
    assert word((), 3.0, 3.0, unknown=0.9) == "unexplained"
    assert word(("gas_spring",), 1.0, 1.0, plain=(1.0, 1.007)) == "no_gap"


def test_a_gap_on_the_fitted_strokes_alone_is_one():
    assert word(("coil_lag",), 1.005, 1.0, plain=(1.08, 1.0)) == "explained"
    assert word(("coil_lag",), 1.005, 1.0, plain=(1.02, 1.0)) == "no_gap"


def test_what_would_make_another_run_worse_leaves_a_gap_only_where_there_is_one():
    assert without_promise(contender((), 1.005, 1.025), FLOOR) == "no_gap"
    assert without_promise(contender((), 1.3, 1.02), FLOOR) == "unexplained"
