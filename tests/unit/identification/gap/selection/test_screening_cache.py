"""A screening is reused while effects and excess of its set stay nearly the same."""

from dataclasses import replace

import pytest

from identification.damper.effects import EFFECTS
from identification.gap.fits import JointFit
from identification.gap.selection.screening_cache import ScreeningCache
from tests.support.candidate_pools import fit_baseline

SCREENED = frozenset({"gas_spring", "moving_mass", "end_stop"})
OTHERS = frozenset(EFFECTS) - SCREENED


@pytest.fixture(scope="module")
def pool():
    pool = fit_baseline("gas_spring")
    pool.extend("moving_mass")
    return pool


@pytest.fixture(scope="module")
def find_gains(pool):
    """Screens three effects by default, in addition to the law."""
    cache = ScreeningCache(125.0, EFFECTS)

    def find(names=frozenset(), without=OTHERS, excess=0.5):
        return cache.find_gains(pool.candidates[names], without, excess, pool.problems.decimated, lambda _: 50.0)

    return find


def test_a_screening_is_reused_for_nearly_the_same_excess(find_gains):
    first = find_gains()
    assert {g.effect_model.name for g in first} == SCREENED
    again = find_gains(excess=0.51)
    assert all(a is b for a, b in zip(first, again, strict=True))


def test_fewer_effects_are_taken_from_a_screening_of_more(find_gains):
    first = find_gains()
    fewer = find_gains(without=OTHERS | {"moving_mass"})
    assert {g.effect_model.name for g in fewer} == SCREENED - {"moving_mass"}
    assert all(any(g is known for known in first) for g in fewer)


@pytest.mark.parametrize(
    "change",
    [{"excess": 0.4}, {"names": frozenset({"moving_mass"})}, {"without": OTHERS - {"coil_lag"}}],
    ids=["excess", "set", "more effects"],
)
def test_a_different_question_is_screened_again(find_gains, change):
    first = find_gains()
    assert not any(g is known for known in first for g in find_gains(**change))


def test_a_set_whose_effects_are_in_another_order_is_screened_again(pool):
    cache = ScreeningCache(125.0, EFFECTS)
    known = pool.candidates[pool.extend("moving_mass", "gas_spring")]
    reversed_problem = known.fit.problem.replace_effects(known.fit.effects[::-1])
    other = replace(known, fit=JointFit(reversed_problem, known.fit.minimum))

    def find(candidate):
        return cache.find_gains(candidate, OTHERS | {"gas_spring"}, 0.5, pool.problems.decimated, lambda _: 50.0)

    assert find(known)[0] is find(known)[0]
    assert find(other)[0] is not find(known)[0]
