"""Clocks that wander: no gap where the log says that they may, and no cloak for an effect."""

from dataclasses import replace

import numpy as np
import orjson
import pytest
from made_up_runs import NOISE, run, stiffening

from identification.assemble import assemble
from identification.gap.clocks import steadied
from identification.gap.diagnose import diagnose, diagnosed_problem, prepare, white_floor
from identification.gap.explain import Effort
from identification.gap.hearing import Hearing
from identification.gap.search import Search

SKEW = 2e-4


def wandering(recording, skew=SKEW):
    """The recording with a force that is up to 0.16 ms early or late, and a log that says so of its clocks."""
    (made,) = recording.stretches
    late = 0.8 * SKEW * np.sin(2 * np.pi * made.time / 30.0)
    force = np.interp(made.time - late, made.time, made.force)
    facts = {name: {"channels": [name], "skew_s": skew} for name in ("force", "displacement")}
    said = {name: orjson.dumps(one).decode() for name, one in facts.items()}
    metadata = {**recording.metadata, "clock_skew": said}
    return replace(recording, stretches=(replace(made, force=force),), metadata=metadata)


def test_the_log_says_how_well_its_clocks_are_known():
    assert assemble([wandering(run())]).clock_skew == pytest.approx(SKEW / np.sqrt(2))
    assert assemble([run()]).clock_skew == 0.0


def law_alone(recording):
    """The law's fit with what it leaves, before and after what clocks may do to it."""
    prepared = prepare([recording])
    problem = diagnosed_problem(prepared.assembled, prepared.judge.fitted_pieces())
    hearing = Hearing(white_floor(prepared.assembled.floor), prepared.assembled.stretches)
    none = Search(problem, prepared.judge, hearing).fit(
        (), effort=Effort(thin=1, starts=1, descents=1, polish=False)
    )
    steady, wander = steadied(none, problem, prepared.judge, SKEW)
    return none.seen**2 - NOISE**2, steady.seen**2 - NOISE**2, wander


def test_what_a_wander_makes_is_taken_away():
    before, after, wander = law_alone(wandering(run()))
    assert after < 0.3 * before
    assert 0.5 * SKEW < wander < SKEW


def test_what_an_effect_makes_is_not():
    before, after, _ = law_alone(run(stiffening))
    assert after > 0.95 * before


def test_a_wander_that_the_log_allows_is_no_gap_and_is_said(monkeypatch):
    # Half a minute: by chance the law alone stands 3 % above the floor on the strokes kept out.
    monkeypatch.setattr("identification.gap.search.NOTHING", 1.04)
    found = diagnose([wandering(run())]).diagnosis
    assert found.verdict == "no_gap"
    assert any("wanders by" in note for note in found.notes)


def test_a_wander_of_which_the_log_says_nothing_is_no_excuse(monkeypatch):
    monkeypatch.setattr("identification.gap.search.NOTHING", 1.04)
    found = diagnose([wandering(run(), skew=0.0)]).diagnosis
    assert found.verdict == "unexplained"
    assert not any("wanders by" in note for note in found.notes)


def test_an_effect_stays_beside_a_wander():
    found = diagnose([wandering(run(stiffening))]).diagnosis
    assert [effect.name for effect in found.effects] == ["gas_spring"]
    assert not any("wanders by" in note for note in found.notes)
